//! The steps of the document's figure 6.35, its list of restrictions, and the cubic spline, each by name.

use super::super::tests::{STEP, edge, graph};
use super::super::*;
use super::curvature::slopes;
use super::*;
use crate::building::{Node, WalkGraph};
use proptest::prelude::*;

/// Two corridors to the east, 9 m apart, joined at 12 m by one that runs north: node 1 is the crossing, 2 its other end.
/// Both corridors go on to the east (3 and 4), and a third begins near the way there (5 to 6).
fn two_corridors() -> Graph {
    let places = [[0.0, 0.0], [12.0, 0.0], [12.0, 9.0], [22.0, 0.0], [22.0, 9.0], [17.5, 5.0], [17.5, 9.0]];
    graph(&places, &[[0, 1], [1, 2], [1, 3], [2, 6], [6, 4], [5, 6]])
}

fn by_matching(graph: &Graph) -> Tracker<&Graph> {
    let parameters = Parameters { search: SearchBy::MapMatching, ..Parameters::documented() };
    Tracker::new(graph, &parameters, edge(graph, 0, 1), 0.0)
}

/// Steps with these turns, in degrees; what was decided at the last.
fn walk(tracker: &mut Tracker<&Graph>, turns: impl IntoIterator<Item = f64>) -> Decision {
    turns.into_iter().map(|turn| tracker.step(turn.to_radians(), 0.0, 0.0)).last().unwrap()
}

/// To the crossing, cleanly to the north, and along a wide arc to the east, which fits no edge: until the search.
fn wide_arc(tracker: &mut Tracker<&Graph>) -> Decision {
    walk(tracker, [0.0; 17]);
    let turned = walk(tracker, [90.0]);
    assert_eq!(turned.case, Case::Turn, "{turned}");
    walk(tracker, [0.0; 9]);
    let arc = [-13.0, -13.0, -13.0, -13.0, -6.0, -5.0];
    walk(tracker, arc)
}

#[test]
fn figure_6_36_and_6_37_the_route_of_the_shape_of_the_steps_is_chosen() {
    let graph = two_corridors();
    let mut tracker = by_matching(&graph);
    let decision = wide_arc(&mut tracker);
    assert_eq!(decision.case, Case::MapMatching, "{decision}");
    let matching = decision.matching.clone().unwrap();
    // From the start: what follows the turn alone is not long enough.
    assert_eq!(matching.from, NodeId(0));
    let routes = matching.routes.unwrap();
    assert!(routes.windows(2).all(|pair| pair[0].residual <= pair[1].residual));
    assert!(routes.iter().all(|route| route.correlation >= 0.3));
    assert_eq!(tracker.trail, routes[0].edges);
    assert!(routes[0].edges.contains(&edge(&graph, 1, 2)), "{decision}");
    assert_eq!((decision.window, tracker.delta), (0, 0.0));
}

#[test]
fn the_end_of_the_reference_is_projected_onto_the_last_edge_or_one_step_is_laid_there() {
    let graph = two_corridors();
    let mut tracker = by_matching(&graph);
    let decision = wide_arc(&mut tracker);
    let end = decision.matching.as_ref().unwrap().end;
    let [from, to] = graph.ends(decision.edge);
    let foot = geometry::nearest(&[from, to], end);
    let beyond = geometry::distance(foot, from) < 1e-9 || geometry::distance(foot, to) < 1e-9;
    let expected = if beyond { graph.on(decision.edge, STEP) } else { foot };
    assert!(geometry::distance(decision.place, expected) < 1e-9, "{decision}");
}

#[test]
fn by_default_the_search_is_by_direction_and_distance() {
    let graph = two_corridors();
    assert_eq!(Parameters::default().search, SearchBy::Distance);
    let mut tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 0, 1), 0.0);
    let decision = wide_arc(&mut tracker);
    assert!(decision.case != Case::MapMatching && decision.matching.is_none(), "{decision}");
}

/// What matching tells of a track from node 0 with these turns, in degrees.
fn told(graph: &Graph, turns: &[f64], thresholds: &Thresholds) -> Matching {
    let mut tracker = by_matching(graph);
    for turn in turns {
        tracker.history.step(turn.to_radians(), STEP);
    }
    let reference = tracker.history.track(thresholds).unwrap();
    tracker.matching(&reference, thresholds)
}

/// 17 steps to the crossing, and so many more after a left turn of 90 degrees.
fn left_after(count: usize) -> Vec<f64> {
    let mut turns = vec![0.0; 17];
    turns.push(90.0);
    turns.resize(17 + count, 0.0);
    turns
}

#[test]
fn restriction_the_reference_is_longer_than_15_m() {
    let graph = two_corridors();
    // 22 steps are 14.96 m.
    assert_eq!(told(&graph, &left_after(5), &Thresholds::documented()).routes, Err(Unmatched::Short));
    assert!(told(&graph, &left_after(6), &Thresholds::documented()).routes.is_ok());
}

#[test]
fn restriction_the_reference_holds_a_turn() {
    let graph = two_corridors();
    assert_eq!(told(&graph, &[0.0; 30], &Thresholds::documented()).routes, Err(Unmatched::Straight));
}

#[test]
fn restriction_routes_end_within_10_m_and_are_as_long_within_10_m() {
    let graph = two_corridors();
    let found = told(&graph, &left_after(12), &Thresholds::documented());
    let length = found.length_m;
    for route in found.routes.unwrap() {
        let end = graph.node(graph.edge(*route.edges.last().unwrap()).to).place;
        assert!(geometry::distance(end, found.end) <= 10.0 && (route.length_m - length).abs() <= 10.0, "{route:?}");
    }
    let none = Thresholds { radius_m: 0.1, ..Thresholds::documented() };
    assert_eq!(told(&graph, &left_after(12), &none).routes, Err(Unmatched::NoRoute));
}

#[test]
fn restriction_five_shortest_routes_to_a_node() {
    // A ladder of three rungs, which has more than five routes to its end.
    let rung = |k: usize| [[4.0 * k as f64, 0.0], [4.0 * k as f64, 2.0]];
    let places: Vec<Point> = (0..5).flat_map(rung).collect();
    let mut edges: Vec<[usize; 2]> = (0..5).map(|k| [2 * k, 2 * k + 1]).collect();
    edges.extend((0..8).map(|k| [k, k + 2]));
    let graph = graph(&places, &edges);
    let from = edge(&graph, 0, 2);
    let parameters = Parameters { search: SearchBy::MapMatching, ..Parameters::documented() };
    let mut tracker = Tracker::new(&graph, &parameters, from, 0.0);
    for step in 0..25 {
        let turn: f64 = if step == 23 { 90.0 } else { 0.0 };
        tracker.history.step(turn.to_radians(), STEP);
    }
    let count = |routes: usize| {
        let thresholds = Thresholds { radius_m: 1.0, routes, ..Thresholds::documented() };
        let reference = tracker.history.track(&thresholds).unwrap();
        tracker.matching(&reference, &thresholds).compared
    };
    // Node 9 alone is within 1 m of the end.
    assert_eq!((count(1), count(5)), (1, 5));
}

#[test]
fn restriction_routes_do_not_begin_in_the_opposite_direction() {
    // A loop, whose way round to the west is the shorter.
    let places = [[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [-2.0, 8.0], [-2.0, 0.0]];
    let graph = graph(&places, &[[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]]);
    let mut turns = vec![0.0; 15];
    turns.push(90.0);
    turns.resize(26, 0.0);
    let eastwards = told(&graph, &turns, &Thresholds::documented()).routes.unwrap();
    assert!(eastwards.iter().all(|route| route.edges[0] == edge(&graph, 0, 1)), "{eastwards:?}");
    let both =
        Thresholds { begin_deg: 180.0, correlation: f64::NEG_INFINITY, length_m: 20.0, ..Thresholds::documented() };
    let both = told(&graph, &turns, &both).routes.unwrap();
    assert!(both.iter().any(|route| route.edges[0] == edge(&graph, 0, 4)), "{both:?}");
}

#[test]
fn restriction_routes_do_not_turn_round() {
    // Node 2 is reached only by a hairpin of 170 degrees.
    let (sin, cos) = 170.0_f64.to_radians().sin_cos();
    let graph = graph(&[[0.0, 0.0], [14.0, 0.0], [14.0 + 6.0 * cos, 6.0 * sin]], &[[0, 1], [1, 2]]);
    let mut turns = vec![0.0; 20];
    turns.push(100.0);
    turns.push(50.0);
    turns.resize(26, 0.0);
    let found = told(&graph, &turns, &Thresholds { correlation: f64::NEG_INFINITY, ..Thresholds::documented() });
    assert!(found.routes.unwrap().iter().all(|route| route.edges.len() == 1));
}

#[test]
fn restriction_a_correlation_below_0_3_excludes_a_route() {
    // The only routes go straight on or to the right.
    let graph = graph(&[[0.0, 0.0], [12.0, 0.0], [12.0, -6.0], [20.0, 0.0]], &[[0, 1], [1, 2], [1, 3]]);
    let found = told(&graph, &left_after(6), &Thresholds::documented());
    assert!(found.compared > 0);
    assert_eq!(found.routes, Err(Unmatched::Unlike));
}

#[test]
fn restriction_routes_keep_to_one_floor() {
    let node = |floor: i32, place: Point| Node { floor, place, height_m: 3.6 * f64::from(floor) };
    let nodes = vec![node(0, [0.0, 0.0]), node(0, [12.0, 0.0]), node(1, [12.0, 6.0]), node(1, [14.0, 6.0])];
    let graph = Graph::new(&WalkGraph { nodes, edges: vec![[0, 1], [1, 2], [2, 3]] }, &[]).unwrap();
    let found =
        told(&graph, &left_after(8), &Thresholds { correlation: f64::NEG_INFINITY, ..Thresholds::documented() });
    assert!(found.routes.unwrap().iter().all(|route| route.edges == [edge(&graph, 0, 1)]));
}

#[test]
fn figure_7_11_where_a_condition_is_not_met_the_other_search_comes_in_its_place() {
    let graph = two_corridors();
    let mut tracker = by_matching(&graph);
    // Three steps, and north where no way goes: 6 m are too short.
    let decision = walk(&mut tracker, [0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(decision.matching.as_ref().unwrap().routes, Err(Unmatched::Short));
    assert!(matches!(decision.case, Case::LocalSearch | Case::GlobalSearch), "{decision}");
    assert!(decision.search.is_some());
}

#[test]
fn half_a_turn_and_a_global_search_begin_a_new_reference() {
    let graph = graph(&[[0.0, 0.0], [30.0, 0.0]], &[[0, 1]]);
    let mut tracker = by_matching(&graph);
    walk(&mut tracker, [0.0; 20]);
    assert_eq!(walk(&mut tracker, [100.0, 71.0]).case, Case::HalfTurn);
    let track = tracker.history.track(&Thresholds::documented()).unwrap();
    assert_eq!((track.node, track.bend), (NodeId(1), 0.0));
}

#[test]
fn a_reference_begins_at_the_last_turn_that_is_far_enough_back() {
    let turn = |node: u32, x: f64| Turn { node: NodeId(node), place: [x, 0.0], entry: [x, 0.0], heading: 0.0 };
    let thresholds = Thresholds::documented();
    let mut history = History::begin(turn(0, 0.0));
    for node in 1..6 {
        for step in 0..12 {
            history.step(if step == 11 { 1.0 } else { 0.0 }, 1.0);
        }
        history.turned(turn(node, 0.0), &thresholds);
    }
    // 24 m back; the last turn but one is only 12 m back, and the older ones are forgotten.
    assert_eq!(history.track(&thresholds).unwrap().node, NodeId(3));
    // A turn at the node of the last one corrects it.
    history.step(1.0, 1.0);
    history.turned(turn(5, 0.0), &thresholds);
    history.step(0.0, 4.0);
    assert_eq!(history.track(&thresholds).unwrap().node, NodeId(4));
}

#[test]
fn figure_6_39_the_curvature_of_an_arc_is_one_by_its_radius() {
    let arc: Vec<Point> = (0..40).map(|k| (0.1 * f64::from(k)).sin_cos()).map(|(y, x)| [5.0 * x, 5.0 * y]).collect();
    let bends = curvature(&arc);
    // Over the cut at half a turn, too; a chord is shorter than its arc by 0.04 %.
    assert_eq!(bends.len(), 39);
    assert!(bends.iter().all(|bend| (bend - 0.2).abs() < 2e-4), "{bends:?}");
}

#[test]
fn the_natural_spline_over_a_roof() {
    // y = 1.5 x - 0.5 x³ up to the ridge.
    let slopes = slopes(&[0.0, 1.0, 2.0], &[0.0, 1.0, 0.0]);
    assert!(slopes.iter().zip([1.5, 0.0, -1.5]).all(|(a, b)| (a - b).abs() < 1e-12), "{slopes:?}");
    assert!(curvature(&[[0.0; 2]]).is_empty());
    assert_eq!(curvature(&[[0.0; 2], [1.0, 0.0]]), [0.0]);
}

#[test]
fn figure_6_40_the_peak_tells_the_shift() {
    let (first, later) = ([0.0, 0.0, 2.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 2.0, 1.0]);
    assert_eq!(correlation(&first, &later, 3), (5.0, 2));
    assert_eq!(correlation(&later, &first, 3), (5.0, -2));
    // Not so far: what overlaps counts.
    assert_eq!(correlation(&first, &later, 1), (2.0, 1));
    assert_eq!(correlation(&[], &[], 3), (0.0, 0));
}

#[test]
fn figure_7_10_a_stronger_bend_has_a_higher_peak() {
    let reference = [0.0, 1.0, 1.0, 0.0];
    assert!(correlation(&reference, &[0.0, 2.0, 1.0, 0.0], 1).0 > correlation(&reference, &reference, 1).0);
}

#[test]
fn settings_are_read_from_a_file() {
    let read: Parameters = toml::from_str("search = \"map-matching\"\n[matching]\nroutes = 3\n").unwrap();
    assert_eq!((read.search, read.matching.routes), (SearchBy::MapMatching, 3));
    assert_eq!(read.matching.radius_m, 10.0);
    let written = toml::to_string(&read).unwrap();
    assert_eq!(toml::from_str::<Parameters>(&written).unwrap(), read);
    assert!(toml::from_str::<Parameters>("search = \"anything\"").is_err());
}

#[test]
fn matching_is_told_in_words() {
    let graph = two_corridors();
    let mut tracker = by_matching(&graph);
    let text = wide_arc(&mut tracker).to_string();
    assert!(text.starts_with("case 5 map matching, "), "{text}");
    for part in ["map matching of ", " routes alike; chosen ", "correlation ", "residual "] {
        assert!(text.contains(part), "{text}");
    }
    let short = walk(&mut by_matching(&graph), [0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0]).to_string();
    assert!(short.contains("m in 9 steps from node 0 to (2.04, 4.08): too short, searched within"), "{short}");
}

proptest! {
    /// The turn of the whole and the scale of all steps do not change which route wins.
    #[test]
    fn residuals_do_not_depend_on_drift_and_step_length(angle in -0.5_f64..0.5, scale in 0.8_f64..1.2) {
        let graph = two_corridors();
        let tracker = by_matching(&graph);
        let edges = [edge(&graph, 0, 1), edge(&graph, 1, 2), edge(&graph, 2, 6)];
        let points = tracker.points(&edges, 30);
        prop_assert_eq!(points.len(), 31);
        prop_assert!(geometry::distance(points[30], [17.5, 9.0]) < 1e-9);
        let (sin, cos) = angle.sin_cos();
        let moved: Vec<Point> =
            points.iter().map(|[x, y]| [scale * (cos * x - sin * y), scale * (sin * x + cos * y)]).collect();
        prop_assert!(Helmert::fit(&moved, &points).residual(&moved, &points) < 1e-12);
    }

    /// A spline through a straight line is the line.
    #[test]
    fn the_spline_of_a_line_has_its_slope(slope in -3.0_f64..3.0, widths in proptest::collection::vec(0.1_f64..2.0, 1..20)) {
        let mut x = vec![0.0];
        for width in widths {
            x.push(x[x.len() - 1] + width);
        }
        let y: Vec<f64> = x.iter().map(|x| 1.0 + slope * x).collect();
        prop_assert!(slopes(&x, &y).into_iter().all(|found| (found - slope).abs() < 1e-9));
    }
}
