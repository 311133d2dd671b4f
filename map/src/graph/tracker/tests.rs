//! Each case of the document's figure 6.3, and the examples of its chapter 6, by name.

use super::*;
use crate::building::geometry::{Point, distance};
use crate::building::{Node, WalkGraph};
use proptest::prelude::*;

/// A step of the document. **Units:** m.
pub(super) const STEP: f64 = 0.68;

pub(super) fn graph(places: &[Point], edges: &[[usize; 2]]) -> Graph {
    let nodes = places.iter().map(|&place| Node { place, ..Node::default() }).collect();
    Graph::new(&WalkGraph { nodes, edges: edges.to_vec() }, &[]).unwrap()
}

pub(super) fn edge(graph: &Graph, from: u32, to: u32) -> EdgeId {
    graph.between(NodeId(from), NodeId(to)).unwrap()
}

/// Begins at node 0 towards node 1.
fn tracker(graph: &Graph) -> Tracker<&Graph> {
    Tracker::new(graph, &Parameters::documented(), edge(graph, 0, 1), 0.0)
}

/// Steps with these turns, in degrees; what was decided at the last.
fn walk(tracker: &mut Tracker<&Graph>, turns: &[f64]) -> Decision {
    let mut last = None;
    for turn in turns {
        last = Some(tracker.step(turn.to_radians(), 0.0, 0.0));
    }
    last.unwrap()
}

fn is_at(decision: &Decision, place: Point) -> bool {
    distance(decision.place, place) < 1e-9
}

/// Eastwards along three edges of 2.3 m.
fn corridor() -> Graph {
    graph(&[[0.0, 0.0], [2.3, 0.0], [4.6, 0.0], [6.9, 0.0]], &[[0, 1], [1, 2], [2, 3]])
}

/// A corridor to the east that ends after 4 m, and ways to the north and 30 degrees to the left.
fn crossing() -> Graph {
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    graph(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [4.0 + 3.0 * cos, 3.0 * sin]], &[[0, 1], [1, 2], [1, 3]])
}

#[test]
fn case_1_a_step_along_the_edge() {
    let graph = corridor();
    let decision = walk(&mut tracker(&graph), &[4.0, -9.0]);
    assert_eq!((decision.case, decision.window), (Case::Straight, 0));
    assert!(is_at(&decision, [2.0 * STEP, 0.0]));
}

#[test]
fn figure_6_16_a_step_held_back_is_laid_down_when_one_goes_on_straight() {
    let graph = corridor();
    let mut tracker = tracker(&graph);
    let held = walk(&mut tracker, &[0.0, 12.0]);
    assert_eq!((held.case, held.window), (Case::Waiting, 1));
    assert!(is_at(&held, [STEP, 0.0]));
    let decision = walk(&mut tracker, &[-10.0]);
    assert_eq!((decision.case, decision.window), (Case::Straight, 0));
    assert!(is_at(&decision, [3.0 * STEP, 0.0]));
}

#[test]
fn figure_6_17_steps_that_do_not_fit_go_on_onto_the_next_edge() {
    let graph = corridor();
    let mut tracker = tracker(&graph);
    let decision = walk(&mut tracker, &[0.0, 0.0, 0.0, 12.0, -10.0]);
    assert_eq!((decision.case, decision.edge), (Case::Straight, edge(&graph, 1, 2)));
    assert!(is_at(&decision, [5.0 * STEP, 0.0]));
    // A new edge: the deviation begins at zero.
    assert_eq!(tracker.delta, 0.0);
}

#[test]
fn case_1_steps_that_fit_onto_no_edge_vanish() {
    let graph = graph(&[[0.0, 0.0], [2.3, 0.0]], &[[0, 1]]);
    let decision = walk(&mut tracker(&graph), &[0.0, 0.0, 12.0, -10.0]);
    // Two of three fit: one more would end at 2.72 m.
    assert!(is_at(&decision, [3.0 * STEP, 0.0]), "{decision}");
}

#[test]
fn case_2_figure_6_20_half_a_turn_keeps_the_place_and_takes_the_edge_back() {
    let graph = graph(&[[0.0, 0.0], [10.0, 0.0]], &[[0, 1]]);
    let mut tracker = tracker(&graph);
    let begun = walk(&mut tracker, &[0.0, 0.0, 100.0, 50.0]);
    // Waiting for the end of the half turn does not count for the window.
    assert_eq!((begun.case, begun.window), (Case::HalfTurnBegun, 1));
    let decision = walk(&mut tracker, &[22.0]);
    assert_eq!((decision.case, decision.edge, decision.window), (Case::HalfTurn, edge(&graph, 1, 0), 0));
    assert!(is_at(&decision, [2.0 * STEP, 0.0]));
    assert!(is_at(&walk(&mut tracker, &[0.0]), [STEP, 0.0]));
}

#[test]
fn case_2_figure_6_19_half_a_turn_that_stays_short_is_carried_out_once_the_heading_is_steady() {
    let graph = graph(&[[0.0, 0.0], [10.0, 0.0]], &[[0, 1]]);
    let mut tracker = tracker(&graph);
    assert_eq!(walk(&mut tracker, &[0.0, 100.0, 50.0, 12.0]).case, Case::HalfTurnBegun);
    assert_eq!(walk(&mut tracker, &[3.0]).case, Case::HalfTurn);
}

#[test]
fn case_3_decision_v_the_rest_of_half_a_turn_is_no_turn() {
    let graph = graph(&[[0.0, 0.0], [10.0, 0.0]], &[[0, 1]]);
    let mut tracker = tracker(&graph);
    assert_eq!(walk(&mut tracker, &[0.0, 0.0, 100.0, 71.0]).case, Case::HalfTurn);
    let decision = walk(&mut tracker, &[19.0]);
    assert_eq!(decision.case, Case::RestOfHalfTurn);
    assert!(is_at(&decision, [STEP, 0.0]));
    assert_eq!(walk(&mut tracker, &[0.0]).case, Case::Straight);
}

#[test]
fn case_3_figure_6_22_left_a_turn_is_taken_at_the_nearest_node() {
    let graph = crossing();
    let mut tracker = tracker(&graph);
    let held = walk(&mut tracker, &[0.0, 0.0, 0.0, 0.0, 0.0, 50.0]);
    assert_eq!((held.case, held.window), (Case::Waiting, 1));
    let decision = walk(&mut tracker, &[42.0]);
    assert_eq!((decision.case, decision.edge), (Case::Turn, edge(&graph, 1, 2)));
    // 0.6 m are left on the old edge, less than a step: both are laid onto the new one.
    assert!(is_at(&decision, [4.0, 2.0 * STEP]));
    assert_eq!(decision.sigma_m, 0.0);
    assert!((decision.candidates[0].angle.to_degrees() - 2.0).abs() < 1e-9);
}

#[test]
fn case_3_figures_6_22_right_and_6_23_a_part_of_a_turn_is_corrected() {
    let graph = crossing();
    let mut tracker = tracker(&graph);
    let part = walk(&mut tracker, &[0.0, 0.0, 0.0, 0.0, 0.0, 30.0]);
    assert_eq!((part.case, part.edge), (Case::Turn, edge(&graph, 1, 3)));
    let decision = walk(&mut tracker, &[60.0]);
    assert_eq!((decision.case, decision.edge), (Case::Turn, edge(&graph, 1, 2)));
    // What was laid onto the wrong edge lies on the right one.
    assert!(is_at(&decision, [4.0, 2.0 * STEP]));
    assert_eq!(tracker.trail, [edge(&graph, 1, 2)]);
}

#[test]
fn case_3_figure_6_25_virtual_steps_fill_the_old_edge() {
    let graph = crossing();
    let mut tracker = tracker(&graph);
    let decision = walk(&mut tracker, &[0.0, 0.0, 90.0]);
    // Three more steps would fit onto the old edge; one step is laid onto the new one.
    assert_eq!(decision.case, Case::Turn);
    assert!(is_at(&decision, [4.0, STEP]));
}

#[test]
fn case_3_figure_6_26_a_turn_goes_on_beyond_the_new_edge() {
    let graph = graph(&[[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [4.0, 4.0]], &[[0, 1], [1, 2], [2, 3]]);
    let decision = walk(&mut tracker(&graph), &[0.0, 0.0, 0.0, 0.0, 0.0, 50.0, 10.0, 32.0]);
    assert_eq!((decision.case, decision.edge), (Case::Turn, edge(&graph, 2, 3)));
    assert!(is_at(&decision, [4.0, 3.0 * STEP]));
}

#[test]
fn case_3_the_end_node_is_favoured_by_a_metre_and_a_half() {
    // At 1.36 m of 4 m the start node is nearer, but for the favour.
    let graph = graph(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]], &[[0, 1], [1, 2], [0, 3]]);
    assert_eq!(walk(&mut tracker(&graph), &[0.0, 0.0, 90.0]).edge, edge(&graph, 1, 2));
    assert_eq!(walk(&mut tracker(&graph), &[0.0, 90.0]).edge, edge(&graph, 0, 3));
}

#[test]
fn case_4_figure_6_30_straight_on_beyond_the_end_node() {
    let graph = corridor();
    let decision = walk(&mut tracker(&graph), &[0.0, 0.0, 0.0, 0.0]);
    assert_eq!((decision.case, decision.edge), (Case::Beyond, edge(&graph, 1, 2)));
    assert!(is_at(&decision, [4.0 * STEP, 0.0]));
}

#[test]
fn case_4_figure_6_29_a_way_that_bends_by_fifteen_degrees_goes_straight_on() {
    let (sin, cos) = 15.0_f64.to_radians().sin_cos();
    let graph = graph(&[[0.0, 0.0], [2.0, 0.0], [2.0 + 2.0 * cos, 2.0 * sin]], &[[0, 1], [1, 2]]);
    let decision = walk(&mut tracker(&graph), &[0.0, 0.0, 0.0]);
    assert_eq!((decision.case, decision.edge), (Case::Beyond, edge(&graph, 1, 2)));
    assert!((decision.limit.to_degrees() - 20.0).abs() < 1e-9);
}

#[test]
fn case_4_figure_6_28_a_turn_behind_the_end_of_a_corridor() {
    let graph = graph(&[[0.0, 0.0], [2.0, 0.0], [2.0, 6.0]], &[[0, 1], [1, 2]]);
    let mut tracker = tracker(&graph);
    let waiting = walk(&mut tracker, &[0.0, 0.0, 0.0, 0.0]);
    assert_eq!((waiting.case, waiting.window), (Case::Waiting, 2));
    assert!((waiting.limit.to_degrees() - 10.0).abs() < 1e-9);
    let decision = walk(&mut tracker, &[90.0]);
    assert_eq!(decision.edge, edge(&graph, 1, 2));
    assert!(is_at(&decision, [2.0, 3.0 * STEP]));
}

#[test]
fn case_4_decision_viii_behind_the_end_only_ten_degrees_fit() {
    let (sin, cos) = 19.0_f64.to_radians().sin_cos();
    let graph = graph(&[[0.0, 0.0], [2.0, 0.0], [2.0 + 4.0 * cos, 4.0 * sin]], &[[0, 1], [1, 2]]);
    let mut tracker = tracker(&graph);
    // 24 degrees off; then 14, where 20 would have been enough; then 9.5.
    assert_eq!(walk(&mut tracker, &[-5.0, 0.0, 0.0]).case, Case::Waiting);
    assert_eq!(walk(&mut tracker, &[10.0]).case, Case::Waiting);
    assert_eq!(walk(&mut tracker, &[4.5]).case, Case::TurnBehindEnd);
}

/// A corridor of 6 m without a way off, and another to the north that begins at `x`.
fn search_graph(x: f64) -> Graph {
    graph(&[[0.0, 0.0], [6.0, 0.0], [x, 1.0], [x, 5.0]], &[[0, 1], [1, 2], [2, 3]])
}

/// Three steps along the corridor, and six to the north.
const NORTH_AFTER_THREE: [f64; 9] = [0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0];

#[test]
fn case_5_figures_6_32_and_6_34_a_local_search_after_five_steps() {
    let graph = search_graph(3.0);
    let mut tracker = tracker(&graph);
    assert_eq!(walk(&mut tracker, &NORTH_AFTER_THREE[..8]).window, 5);
    let decision = walk(&mut tracker, &NORTH_AFTER_THREE[8..]);
    assert_eq!((decision.case, decision.edge, decision.window), (Case::LocalSearch, edge(&graph, 2, 3), 0));
    // One step on the new edge, searched around the last position and the steps held back.
    assert!(is_at(&decision, [3.0, 1.0 + STEP]));
    let search = decision.search.unwrap();
    assert!(distance(search.from, [3.0 * STEP, 6.0 * STEP]) < 1e-9);
    // 3 sigma of three steps on the graph.
    assert!((search.radius_m - 3.0 * 1.5 * 3.0_f64.sqrt()).abs() < 0.02);
    // The shortest way since the last turn takes the place of the wrong one.
    assert_eq!(tracker.trail, [edge(&graph, 0, 1), edge(&graph, 1, 2), edge(&graph, 2, 3)]);
}

#[test]
fn case_5_a_global_search_begins_anew() {
    let graph = search_graph(30.0);
    let mut tracker = tracker(&graph);
    let decision = walk(&mut tracker, &NORTH_AFTER_THREE);
    assert_eq!((decision.case, decision.edge), (Case::GlobalSearch, edge(&graph, 2, 3)));
    assert!(is_at(&decision, [30.0, 1.0 + STEP]));
    assert_eq!((tracker.trail.len(), tracker.turned_at), (1, NodeId(2)));
}

#[test]
fn case_5_figure_6_33_edges_since_the_last_turn_are_not_chosen() {
    let places = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [0.0, 3.0], [9.0, 3.0]];
    let graph = graph(&places, &[[0, 1], [1, 2], [0, 3], [3, 4]]);
    let decision = walk(&mut tracker(&graph), &[0.0; 11]);
    // Straight on behind the end of the wrong corridor: not its last edge, which begins nearer.
    assert_eq!((decision.case, decision.edge), (Case::LocalSearch, edge(&graph, 3, 4)));
}

#[test]
fn case_5_decision_x_a_second_search_goes_on_from_where_the_first_began() {
    let graph = search_graph(3.0);
    let mut tracker = tracker(&graph);
    walk(&mut tracker, &NORTH_AFTER_THREE);
    let decision = walk(&mut tracker, &[90.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let search = decision.search.unwrap();
    assert!(distance(search.from, [3.0 * STEP - 6.0 * STEP, 6.0 * STEP]) < 1e-9, "{decision}");
    // Decision xii: no edge anywhere fits; it waits on.
    assert_eq!((decision.case, decision.window), (Case::Waiting, 6));
    assert_eq!(walk(&mut tracker, &[0.0]).window, 7);
}

#[test]
fn case_5_decision_x_the_steps_between_two_searches_count() {
    let graph = search_graph(3.0);
    let mut tracker = tracker(&graph);
    walk(&mut tracker, &NORTH_AFTER_THREE);
    let decision = walk(&mut tracker, &[0.0, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let search = decision.search.unwrap();
    assert!(distance(search.from, [3.0 * STEP - 6.0 * STEP, 7.0 * STEP]) < 1e-9, "{decision}");
}

#[test]
fn case_5_decision_x_a_search_after_a_clean_turn_is_a_first_one() {
    let places = [[0.0, 0.0], [6.0, 0.0], [3.0, 1.0], [3.0, 5.0], [9.0, 5.0]];
    let graph = graph(&places, &[[0, 1], [1, 2], [2, 3], [3, 4]]);
    let mut tracker = tracker(&graph);
    walk(&mut tracker, &NORTH_AFTER_THREE);
    let turn = walk(&mut tracker, &[0.0, 0.0, -90.0]);
    assert_eq!((turn.case, turn.edge), (Case::Turn, edge(&graph, 3, 4)));
    let before = walk(&mut tracker, &[0.0, 0.0, 0.0]).place;
    let search = walk(&mut tracker, &[-90.0, 0.0, 0.0, 0.0, 0.0, 0.0]).search.unwrap();
    assert!(distance(search.from, [before[0], before[1] - 6.0 * STEP]) < 1e-9, "{search:?}");
}

/// Two floors, 3.6 m apart, with stairs in two flights from node 1 to node 4 and an elevator from node 6 to node 7.
fn two_floors() -> (Graph, Floors) {
    let node = |floor: i32, place: Point, height_m: f64| Node { floor, place, height_m };
    let nodes = vec![
        node(0, [0.0, 0.0], 0.0),
        node(0, [4.0, 0.0], 0.0),
        node(0, [4.0, 3.0], 1.8),
        node(0, [2.0, 3.0], 1.8),
        node(1, [2.0, 0.0], 3.6),
        node(1, [-2.0, 0.0], 3.6),
        node(0, [-3.0, 0.0], 0.0),
        node(1, [-3.0, 0.0], 3.6),
    ];
    let edges = vec![[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [0, 6], [5, 7], [6, 7]];
    let graph = Graph::new(&WalkGraph { nodes, edges }, &[]).unwrap();
    let floor = |number: i32, height_m: f64| crate::building::Floor { number, height_m, ..Default::default() };
    let building = crate::building::Building { floors: vec![floor(0, 0.0), floor(1, 3.6)], ..Default::default() };
    (graph, Floors::new(&building, 0).unwrap())
}

/// Turns in degrees and rises.
fn climb(tracker: &mut Tracker<&Graph>, steps: &[(f64, f64)]) -> Decision {
    let mut last = None;
    for (turn, rise) in steps {
        last = Some(tracker.step(turn.to_radians(), 0.0, *rise));
    }
    last.unwrap()
}

#[test]
fn floors_without_a_barometer_change_where_the_stairs_lead() {
    let (graph, _) = two_floors();
    let mut tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 3, 4), 0.0);
    // Ten steps of 0.3 m to the end of the flight, one that does not fit, and a turn.
    let decision = walk(&mut tracker, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -90.0]);
    assert_eq!((decision.case, decision.edge), (Case::Turn, edge(&graph, 4, 5)));
    assert!((decision.place[0] - (2.0 - 2.0 * 0.3)).abs() < 1e-9);
}

#[test]
fn floors_rule_1_and_figure_6_44_the_last_position_is_projected_onto_the_stairs_beside_it() {
    let (graph, floors) = two_floors();
    let tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 3, 4), 0.0);
    let mut tracker = tracker.with_barometer(floors);
    let steps = [(0.0, 1.8), (0.0, 0.17), (0.0, 0.17), (0.0, 0.17), (0.0, 0.17)];
    assert_eq!(climb(&mut tracker, &steps).change, None);
    let decision = climb(&mut tracker, &[(0.0, 0.17)]);
    assert_eq!(decision.change, Some(Change { from: 0, to: 1, by: By::Stairs }));
    assert_eq!(decision.edge, edge(&graph, 3, 4));
    assert!(is_at(&decision, [2.0, 3.0 - 6.0 * 0.3]));
}

#[test]
fn floors_stairs_are_searched_from_both_floors_that_they_join() {
    let (graph, floors) = two_floors();
    let tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 3, 4), 0.0);
    let mut tracker = tracker.with_barometer(floors);
    let up = climb(&mut tracker, &[(0.0, 1.8), (0.0, 0.3), (0.0, 0.3), (0.0, 0.3)]);
    assert_eq!(up.change, Some(Change { from: 0, to: 1, by: By::Stairs }));
    // Towards the lower flight, whose nodes are numbered with the lower floor.
    let decision = climb(&mut tracker, &[(90.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]);
    assert!(decision.candidates.iter().any(|candidate| candidate.edge == edge(&graph, 3, 2)), "{decision}");
}

#[test]
fn floors_rule_2_else_a_stair_edge_in_the_direction_of_the_heading() {
    let (graph, floors) = two_floors();
    let tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 0, 6), 0.0);
    let mut tracker = tracker.with_barometer(floors);
    let decision = climb(&mut tracker, &[(90.0, 1.8), (0.0, 0.3), (0.0, 0.3), (0.0, 0.3)]);
    assert_eq!(decision.change, Some(Change { from: 0, to: 1, by: By::Stairs }));
    assert_eq!((decision.edge, decision.along_m), (edge(&graph, 3, 4), 0.0));
}

#[test]
fn floors_rule_3_else_the_last_edge_of_the_stairs() {
    let (graph, floors) = two_floors();
    let tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 0, 6), 0.0);
    let mut tracker = tracker.with_barometer(floors);
    let decision = climb(&mut tracker, &[(0.0, 1.8), (0.0, 0.3), (0.0, 0.3), (0.0, 0.3)]);
    assert_eq!(decision.edge, edge(&graph, 3, 4));
}

#[test]
fn floors_figure_6_43_a_rise_without_steps_is_an_elevator() {
    let (graph, floors) = two_floors();
    let tracker = Tracker::new(&graph, &Parameters::documented(), edge(&graph, 0, 6), 0.0);
    let mut tracker = tracker.with_barometer(floors);
    let decision = climb(&mut tracker, &[(0.0, 0.0), (0.0, 0.0), (0.0, 3.5)]);
    assert_eq!(decision.change, Some(Change { from: 0, to: 1, by: By::Elevator }));
    assert_eq!(decision.edge, edge(&graph, 7, 5));
    assert!(is_at(&climb(&mut tracker, &[(0.0, 0.0)]), [-3.0 + STEP, 0.0]));
}

#[test]
fn decisions_are_told_in_words() {
    let graph = crossing();
    let decision = walk(&mut tracker(&graph), &[0.0, 0.0, 90.0]);
    assert_eq!(
        decision.to_string(),
        "case 3 turn, delta 90.0 deg, window 0, candidates 2 at 0.0, 3 at 60.0, 1 at 90.0 (limit 10 deg): edge 2 at 0.68 m, \
         (4.00, 0.68) +- 0.0 m"
    );
}

proptest! {
    #[test]
    fn whatever_comes_the_position_stays_on_the_graph(
        places in proptest::collection::vec(proptest::array::uniform2(0.0_f64..12.0), 8),
        drawn in proptest::collection::vec((0_usize..8, 0_usize..8), 6..16),
        turns in proptest::collection::vec(-100.0_f64..100.0, 60),
    ) {
        let edges: Vec<[usize; 2]> = drawn.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
        prop_assume!(!edges.is_empty());
        let graph = graph(&places, &edges);
        let mut tracker = Tracker::new(&graph, &Parameters::documented(), EdgeId(0), 0.0);
        for turn in turns {
            let decision = tracker.step((0.3 * turn).to_radians(), 0.7, 0.0);
            let length = graph.edge(decision.edge).length_m;
            prop_assert!((-1e-9..=length + 1e-9).contains(&decision.along_m), "{decision} of {length}");
            prop_assert!(decision.place.iter().all(|value| value.is_finite()));
            prop_assert!(decision.window <= 60);
        }
    }
}
