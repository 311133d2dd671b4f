use super::*;
use crate::building::geometry::{Point, distance};
use crate::building::{Node, WalkGraph};
use crate::graph::EdgeKind;
use crate::sight::{Seen, Sight};
use nalgebra::{Matrix4, Vector3};
use proptest::prelude::*;
use sohle_shared::sample::ClippedSamples;
use sohle_shared::step::{FloorMode, StepQuality};

fn graph(places: &[(i32, Point, f64)], edges: &[[usize; 2]]) -> Graph {
    let nodes = places.iter().map(|&(floor, place, height_m)| Node { floor, place, height_m }).collect();
    Graph::new(&WalkGraph { nodes, edges: edges.to_vec() }, &[]).unwrap()
}

fn level(places: &[Point], edges: &[[usize; 2]]) -> Graph {
    graph(&places.iter().map(|&place| (0, place, 0.0)).collect::<Vec<_>>(), edges)
}

/// A step after a turn. **Units:** m, rad.
fn step(index: u32, length: f64, turn: f64, rise: f64) -> Step {
    let (sin, cos) = turn.sin_cos();
    let time = Micros(i64::from(index) * 550_000);
    let mut covariance = Matrix4::identity() * 2.5e-3;
    covariance[(2, 2)] = 0.02;
    covariance[(3, 3)] = 3e-4;
    Step {
        index,
        stance_start: time,
        stance_end: time,
        displacement: Vector3::new(length * cos, length * sin, rise).cast(),
        turn: turn as f32,
        covariance,
        mode: FloorMode::Level,
        quality: StepQuality::default(),
        clipped: ClippedSamples::default(),
    }
}

fn at(place: Point, heading: f64) -> Start {
    Start::At(vec![Place { floor: 0, place, sigma_m: 0.3, heading: Some((heading, 0.1)) }])
}

/// Legs straight on after a turn: turns in degrees, lengths in steps of 0.7 m.
fn walk(matcher: &mut Matcher<&Graph>, legs: &[(f64, u32)]) -> Vec<Estimate> {
    let mut told = Vec::new();
    for &(turn, steps) in legs {
        for number in 0..steps {
            let turn = if number == 0 { turn.to_radians() } else { 0.0 };
            let index = matcher.last.map_or(0, |(index, _)| index + 1);
            told.push(matcher.step(&step(index, 0.7, turn, 0.0)).clone());
        }
    }
    told
}

/// Two blocks: corridors at x = 0, 10, 20 and at y = 0, 12, in edges of 2 m or so.
fn blocks() -> Graph {
    let (mut places, mut edges) = (Vec::<Point>::new(), Vec::new());
    let mut line = |from: Point, to: Point, pieces: usize| {
        let mut last = None;
        for piece in 0..=pieces {
            let place = crate::building::geometry::between(from, to, piece as f64 / pieces as f64);
            let known = places.iter().position(|&known| distance(known, place) < 1e-6);
            let number = known.unwrap_or_else(|| {
                places.push(place);
                places.len() - 1
            });
            edges.extend(last.map(|last| [last, number]));
            last = Some(number);
        }
    };
    for y in [0.0, 12.0] {
        line([0.0, y], [20.0, y], 10);
    }
    for x in [0.0, 10.0, 20.0] {
        line([x, 0.0], [x, 12.0], 6);
    }
    level(&places, &edges)
}

#[test]
fn a_wrong_length_and_a_drift_are_taken_out_at_the_turns() {
    let graph = blocks();
    let mut matcher = Matcher::new(&graph, &Parameters::default(), &at([0.0, 0.0], 0.0)).unwrap();
    // Steps that say 5 % too much, and 0.3 degrees of drift to the left with each: 23 degrees in the whole.
    let mut index = 0;
    for (turn, steps) in [(0.0, 15), (90.0, 18), (-90.0, 15), (-90.0, 18), (-90.0, 15_u32)] {
        for number in 0..steps {
            let turn: f64 = if number == 0 { turn } else { 0.0 } + 0.3;
            matcher.step(&step(index, 0.7, turn.to_radians(), 0.0));
            index += 1;
        }
    }
    // East, north, east, south, and west to the crossing in the middle; by the steps alone it is 5 m off.
    let place = matcher.estimate().place().unwrap();
    assert!(matcher.estimate().is_located(), "{}", matcher.estimate());
    assert!(distance(place.position, [10.0, 0.0]) < 1.5, "{}", matcher.estimate());
    assert!(place.scale < 0.99, "{}", matcher.estimate());
}

#[test]
fn an_unknown_start_is_found_by_the_turns_and_told_honestly() {
    // Legs of 8 m and 5 m with a turn to the left: once in this graph, beside a corridor without one.
    let places = [
        [0.0, 0.0],
        [4.0, 0.0],
        [8.0, 0.0],
        [8.0, 2.5],
        [8.0, 5.0],
        [30.0, 0.0],
        [34.0, 0.0],
        [38.0, 0.0],
        [42.0, 0.0],
    ];
    let graph = level(&places, &[[0, 1], [1, 2], [2, 3], [3, 4], [5, 6], [6, 7], [7, 8]]);
    let mut matcher = Matcher::new(&graph, &Parameters::default(), &Start::Anywhere).unwrap();
    let told = walk(&mut matcher, &[(0.0, 11), (90.0, 7)]);
    // After 7 m straight on it may be in either corridor, in both directions.
    assert!(told[9].places.len() > 1 && !told[9].is_located(), "{}", told[9]);
    let end = told.last().unwrap();
    assert!(end.is_located() && distance(end.places[0].position, [8.0, 5.0]) < 1.0, "{end}");
    // All that is told adds up to one, less what is too unlikely to be told.
    for told in told {
        let sum: f64 = told.places.iter().map(|place| place.probability).sum();
        assert!(sum <= 1.0 + 1e-9 && sum > 0.9, "{sum}");
        assert!(told.places.windows(2).all(|pair| pair[0].probability >= pair[1].probability));
    }
}

#[test]
fn a_wrong_start_is_given_up_when_nothing_fits() {
    let graph = blocks();
    // It is said to begin in the middle, to the north; in truth it begins in a corner, to the east.
    let mut matcher =
        Matcher::new(&graph, &Parameters::default(), &at([10.0, 0.0], std::f64::consts::FRAC_PI_2)).unwrap();
    let wrong = walk(&mut matcher, &[(0.0, 14)]);
    assert!(distance(wrong[13].places[0].position, [10.0, 9.8]) < 1.5, "{}", wrong[13]);
    // North, east, south around a block, which leads out of the graph from where it is believed to be.
    let told = walk(&mut matcher, &[(90.0, 17), (-90.0, 14), (-90.0, 17), (90.0, 1)]);
    assert!(told.iter().map(|told| told.sown).sum::<usize>() > 0);
    // The true corner is among the likely places again.
    let end = &told[told.len() - 1];
    let is_true = |place: &&Likely| distance(place.position, [20.0, 0.0]) < 2.0;
    assert!(end.places.iter().find(is_true).is_some_and(|place| place.probability > 0.2), "{end}");
}

#[test]
fn missing_steps_widen_what_is_known() {
    let graph = blocks();
    let mut matcher = Matcher::new(&graph, &Parameters::default(), &at([0.0, 0.0], 0.0)).unwrap();
    let before = walk(&mut matcher, &[(0.0, 5)]).last().unwrap().places[0].sigma_m();
    let after = matcher.step(&step(10, 0.7, 0.0, 0.0)).clone();
    assert!(after.sown > 0 && after.places[0].sigma_m() > 2.0 * before, "{after}");
}

/// Two floors with a flight from (4, 0) to (10, 0), an elevator at (0, 0), and a way on at both ends of each floor.
fn two_floors() -> Graph {
    graph(
        &[
            (0, [0.0, 0.0], 0.0),
            (0, [4.0, 0.0], 0.0),
            (0, [7.0, 0.0], 1.8),
            (1, [10.0, 0.0], 3.6),
            (1, [14.0, 0.0], 3.6),
            (1, [0.0, 0.0], 3.6),
            (1, [4.0, 1.5], 3.6),
            (0, [4.0, 8.0], 0.0),
            (1, [0.0, 6.0], 3.6),
        ],
        &[[0, 1], [1, 2], [2, 3], [3, 4], [0, 5], [5, 6], [6, 4], [1, 7], [5, 8]],
    )
}

#[test]
fn heights_tell_stairs_from_a_turn_and_an_elevator_from_standing() {
    let graph = two_floors();
    assert!(graph.edges().iter().any(|edge| edge.kind == EdgeKind::Elevator));
    let matcher = Matcher::new(&graph, &Parameters::default(), &at([0.0, 0.0], 0.0)).unwrap();
    let mut stairs = matcher.with_heights();
    for index in 0..6 {
        stairs.step(&step(index, 0.7, 0.0, 0.0));
    }
    for index in 6..26 {
        stairs.step(&step(index, 0.3, 0.0, 0.18));
    }
    let place = stairs.step(&step(26, 0.7, 0.0, 0.0)).place().unwrap().clone();
    assert!(place.floor == 1 && (place.height_m - 3.6).abs() < 0.4 && place.position[0] > 9.0, "{place:?}");
    // A ride without a step, and a few steps to the north, which is there on the upper floor only.
    let start = at([0.0, 0.0], std::f64::consts::FRAC_PI_2);
    let mut carried = Matcher::new(&graph, &Parameters::default(), &start).unwrap().with_heights();
    carried.step(&step(0, 0.0, 0.0, 0.0));
    carried.step(&step(1, 0.7, 0.0, 3.6));
    for index in 2..7 {
        carried.step(&step(index, 0.7, 0.0, 0.0));
    }
    let place = carried.estimate().place().unwrap();
    assert!(place.floor == 1 && distance(place.position, [0.0, 4.5]) < 1.2, "{}", carried.estimate());
}

#[test]
fn bad_input_is_refused_or_changes_nothing() {
    let graph = blocks();
    let wrong = Parameters { aside_m: f64::NAN, ..Parameters::default() };
    let told = Matcher::new(&graph, &wrong, &Start::Anywhere).unwrap_err().to_string();
    assert_eq!(told, "settings of the matcher: aside_m = NaN: expected 0.05 to 20");
    let place = Place { floor: 7, place: [0.0; 2], sigma_m: 1.0, heading: None };
    let told = Matcher::new(&graph, &Parameters::default(), &Start::At(vec![place])).unwrap_err().to_string();
    assert_eq!(told, "the walk graph has no edge on floor 7");
    let mut matcher = Matcher::new(&graph, &Parameters::phone(), &at([0.0, 0.0], 0.0)).unwrap();
    let before = walk(&mut matcher, &[(0.0, 3)]).pop().unwrap();
    assert_eq!(*matcher.step(&step(3, f64::NAN, 0.0, 0.0)), before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn whatever_comes_the_answer_is_finite_and_the_same_again(
        places in proptest::collection::vec(proptest::array::uniform2(0.0_f64..12.0), 8),
        drawn in proptest::collection::vec((0_usize..8, 0_usize..8), 6..16),
        steps in proptest::collection::vec((0.0_f64..2.0, -3.2_f64..3.2, -1.0_f64..1.0), 40),
    ) {
        let edges: Vec<[usize; 2]> = drawn.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
        prop_assume!(!edges.is_empty());
        let graph = level(&places, &edges);
        let follow = || {
            let mut matcher = Matcher::new(&graph, &Parameters::default(), &Start::Anywhere).unwrap().with_heights();
            let told = steps.iter().enumerate().map(|(index, &(length, turn, rise))| {
                matcher.step(&step(index as u32, length, turn, rise)).clone()
            });
            told.collect::<Vec<_>>()
        };
        let told = follow();
        for told in &told {
            prop_assert!(!told.places.is_empty() && told.hypotheses > 0);
            for place in &told.places {
                prop_assert!(place.position.iter().chain(place.covariance.iter()).all(|value| value.is_finite()));
                prop_assert!((0.0..=1.0 + 1e-9).contains(&place.probability));
                prop_assert!((-1e-9..=graph.edge(place.edge).length_m + 1e-9).contains(&place.along_m));
            }
        }
        prop_assert_eq!(told, follow());
    }
}

/// Along the lower corridor of the blocks and up the one in the middle, as `(x, y)` after each step of 0.7 m; and the steps.
fn around_the_corner() -> (Vec<Point>, Vec<Step>) {
    let legs = [(14_u32, [0.7, 0.0], 0.0), (14, [0.0, 0.7], std::f64::consts::FRAC_PI_2)];
    let (mut truth, mut steps, mut place) = (Vec::new(), Vec::new(), [0.0, 0.0]);
    for (count, [x, y], turn) in legs {
        for number in 0..count {
            place = [place[0] + x, place[1] + y];
            truth.push(place);
            steps.push(step(steps.len() as u32, 0.7, if number == 0 { turn } else { 0.0 }, 0.0));
        }
    }
    (truth, steps)
}

fn sight_at(place: Point, sigma_m: f64) -> Sight {
    Sight { seen: Seen::Place(place, nalgebra::Matrix2::identity() * (sigma_m * sigma_m)), floor: None, outlier: 1e-3 }
}

#[test]
fn positions_tell_where_somebody_is_whom_the_steps_alone_leave_anywhere() {
    let graph = blocks();
    let (truth, steps) = around_the_corner();
    let follow = |with: bool| {
        let mut matcher = Matcher::new(&graph, &Parameters::default(), &Start::Anywhere).unwrap();
        for (index, step) in steps.iter().enumerate() {
            matcher.step(step);
            if with && index % 4 == 3 {
                matcher.sight(&sight_at(truth[index], 1.0), step.stance_end);
            }
        }
        matcher.estimate().clone()
    };
    // One turn to the left in a net of blocks tells little.
    assert!(!follow(false).is_located(), "{}", follow(false));
    let found = follow(true);
    assert!(found.is_located() && distance(found.places[0].position, truth[27]) < 0.7, "{found}");
}

#[test]
fn a_position_that_comes_late_counts_where_it_was_measured() {
    let graph = blocks();
    // Straight on, by steps that are a tenth too long; a position of the sixth metre is heard at the tenth.
    let steps: Vec<Step> = (0..24).map(|index| step(index, 0.77, 0.0, 0.0)).collect();
    let end = |heard: Option<Micros>| {
        let start = Place { floor: 0, place: [0.0, 0.0], sigma_m: 0.2, heading: Some((0.0, 0.1)) };
        let parameters = Parameters { scale: 0.1, ..Parameters::default() };
        let mut matcher = Matcher::new(&graph, &parameters, &Start::At(vec![start])).unwrap();
        for (index, step) in steps.iter().enumerate() {
            matcher.step(step);
            if let Some(time) = heard.filter(|_| index == 13) {
                matcher.sight(&sight_at([5.6, 0.0], 0.1), time);
            }
        }
        matcher.estimate().places[0].position[0]
    };
    let truth = 24.0 * 0.7;
    let [right, wrong, none] = [Some(steps[7].stance_end), Some(steps[13].stance_end), None].map(end);
    let [right, wrong, none] = [right, wrong, none].map(|end| (end - truth).abs());
    assert!(right < 0.6 && none > 1.2 && wrong > right + 0.5, "{right} {wrong} {none}");
}

#[test]
fn an_outlier_carries_nobody_away_and_several_that_agree_do() {
    let graph = blocks();
    let start = at([0.0, 0.0], 0.0);
    let mut matcher = Matcher::new(&graph, &Parameters::default(), &start).unwrap();
    let (mut truth, mut told) = ([0.0, 0.0], Vec::new());
    for index in 0..26 {
        truth[0] += 0.7;
        let step = step(index, 0.7, 0.0, 0.0);
        matcher.step(&step);
        // One of five is 8 m off.
        if index % 5 == 2 {
            let estimate = matcher.sight(&sight_at([truth[0], 8.0], 0.5), step.stance_end);
            told.push(distance(estimate.places[0].position, truth));
        } else {
            matcher.sight(&sight_at(truth, 0.5), step.stance_end);
        }
    }
    assert!(told.iter().all(|&off| off < 0.7), "{told:?}");
    // Somebody is believed at the wrong end of the corridor above, walking the same way.
    let mut matcher = Matcher::new(&graph, &Parameters::default(), &at([0.0, 12.0], 0.0)).unwrap();
    for index in 0..20 {
        let step = step(index, 0.7, 0.0, 0.0);
        matcher.step(&step);
        matcher.sight(&sight_at([0.7 * f64::from(index + 1), 0.0], 0.5), step.stance_end);
    }
    let end = matcher.estimate();
    assert!(distance(end.places[0].position, [14.0, 0.0]) < 1.0 && end.is_located(), "{end}");
}

#[test]
fn a_range_says_how_far_and_a_floor_says_which() {
    let graph = two_floors();
    let places = [0, 1].map(|floor| Place { floor, place: [8.0, 4.0], sigma_m: 4.0, heading: None });
    let mut matcher = Matcher::new(&graph, &Parameters::default(), &Start::At(places.to_vec())).unwrap();
    matcher.step(&step(0, 0.0, 0.0, 0.0));
    let range = Seen::Range { anchor: [14.0, 0.0], above_m: 0.0, metres: 10.0, sigma_m: 0.1 };
    let estimate = matcher.sight(&Sight { seen: range, floor: Some(1), outlier: 1e-4 }, Micros(0)).clone();
    let best = &estimate.places[0];
    assert!(best.floor == 1 && (distance(best.position, [14.0, 0.0]) - 10.0).abs() < 0.5, "{estimate}");
    let wrong: f64 = estimate.places.iter().filter(|place| place.floor == 0).map(|place| place.probability).sum();
    assert!(wrong < 0.01, "{estimate}");
}
