//! The smoother as a whole, on walks whose truth is known.

use super::{Outcome, Parameters, Smoother};
use crate::fixes::polar::tests::step;
use crate::fixes::{Measured, Method, Observation, Start};
use nalgebra::Vector2;
use proptest::prelude::*;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::f64::consts::TAU;

/// A walk of so many steps, 0.6 s each, with bends; where each of them ended. Steps are told 4 % too short.
fn walk(count: u32) -> (Vec<Step>, Vec<[f64; 2]>) {
    let (mut steps, mut truth) = (Vec::new(), Vec::new());
    let (mut place, mut heading) = (Vector2::new(20.0, -7.0), 2.5_f64);
    for index in 0..count {
        let turn = if index % 25 == 24 { 1.4 } else { 0.03 * f64::from(index).sin() };
        place += Vector2::new(heading.cos(), heading.sin()) * 0.7;
        heading += turn;
        steps.push(step(index, 0.6 * f64::from(index + 1), 0.7 / 1.04, turn));
        truth.push(place.into());
    }
    (steps, truth)
}

/// Some number between -1 and 1, the same each time.
fn some(index: usize, kind: f64) -> f64 {
    ((index as f64 + 1.0) * kind).sin()
}

/// A position at the end of every third step; every fifth of them may be 20 m off.
fn said(steps: &[Step], truth: &[[f64; 2]], sigma_m: f64, outliers: bool) -> Vec<Observation> {
    let every_third = steps.iter().zip(truth).enumerate().skip(2).step_by(3);
    every_third
        .map(|(index, (step, place))| {
            let far = outliers && index % 15 == 5;
            let off = if far { 20.0 } else { 0.0 };
            let noise = [12.9898, 78.233].map(|kind| 1.2 * sigma_m * some(index, kind));
            let at = [place[0] + noise[0] + off, place[1] + noise[1]];
            Observation::position(step.stance_end, at, sigma_m)
        })
        .collect()
}

/// Goes through a walk; each position comes so many steps late. The error from step 40 on.
fn follow(smoother: &mut Smoother, (steps, truth): (&[Step], &[[f64; 2]]), said: &[Observation], late: i64) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    let mut waiting = said.iter().peekable();
    for (index, (step, truth)) in steps.iter().zip(truth).enumerate() {
        smoother.step(step);
        let now = step.stance_end.0 - late * 600_000;
        while let Some(observation) = waiting.next_if(|observation| observation.time.0 <= now) {
            smoother.observe(observation);
        }
        if index >= 40 {
            let place = smoother.estimate().unwrap().place;
            sum += (place[0] - truth[0]).powi(2) + (place[1] - truth[1]).powi(2);
            count += 1;
        }
    }
    (sum / f64::from(count)).sqrt()
}

fn new() -> Smoother {
    Smoother::new(&Parameters { scale_sigma: 0.05, ..Parameters::default() }, &Start::default())
}

#[test]
fn direction_and_scale_are_found_and_the_place_is_better_than_any_position() {
    let (steps, truth) = walk(200);
    let mut smoother = new();
    let error = follow(&mut smoother, (&steps, &truth), &said(&steps, &truth, 2.0, false), 0);
    assert!(error < 1.0, "{error}");
    let found = smoother.calibration().unwrap();
    assert!((found.scale.0 - 1.04).abs() < 0.015 && found.scale.1 < 0.03, "{found:?}");
    let expected = 2.5 + steps.iter().map(|step| f64::from(step.turn)).sum::<f64>();
    let off = (found.heading.0 - expected).rem_euclid(TAU);
    assert!(off.min(TAU - off) < 0.1, "{off}");
}

#[test]
fn outliers_are_doubted_and_cost_little() {
    let (steps, truth) = walk(200);
    let mut smoother = new();
    let error = follow(&mut smoother, (&steps, &truth), &said(&steps, &truth, 2.0, true), 0);
    // A third of what one position is off in a coordinate; how much worse than without outliers, over many walks, the suite tells.
    assert!(error < 0.66, "{error}");
    let last = said(&steps, &truth, 2.0, true).pop().unwrap();
    let Measured::Position { place, .. } = last.measured else { unreachable!() };
    let far =
        Observation { source: "wifi".into(), ..Observation::position(last.time, [place[0], place[1] + 20.0], 2.0) };
    let verdict = smoother.hear(&far);
    assert_eq!(verdict.outcome, Outcome::Doubted);
    let told = verdict.to_string();
    assert!(told.starts_with("wifi: doubted, ") && told.contains("times what was expected"), "{told}");
}

#[test]
fn a_late_position_counts_where_it_was_measured() {
    let (steps, truth) = walk(80);
    let said = said(&steps, &truth, 1.0, false);
    let ends = |late: i64| {
        let mut smoother = new();
        follow(&mut smoother, (&steps, &truth), &said, late);
        // What is still on its way at the end comes too.
        let now = steps[steps.len() - 1].stance_end.0 - late * 600_000;
        said.iter()
            .filter(|observation| observation.time.0 > now)
            .for_each(|observation| smoother.observe(observation));
        smoother.open_part()
    };
    let (now, late) = (ends(0), ends(4));
    assert_eq!(now.len(), late.len());
    for (one, other) in now.iter().zip(&late) {
        // Each ends where a round changes less than a millimetre.
        let off = (one.place[0] - other.place[0]).hypot(one.place[1] - other.place[1]);
        assert!(off < 0.01, "{off}");
    }
}

#[test]
fn what_is_older_than_the_window_or_long_after_the_last_step_is_told() {
    let (steps, truth) = walk(150);
    let mut smoother = new();
    follow(&mut smoother, (&steps, &truth), &said(&steps, &truth, 1.0, false), 0);
    assert!(matches!(smoother.hear(&Observation::position(Micros(1), [0.0; 2], 1.0)).outcome, Outcome::TooLate(_)));
    let after = Micros(steps[149].stance_end.0 + 7_200_000_000);
    assert!(matches!(smoother.hear(&Observation::position(after, [0.0; 2], 1.0)).outcome, Outcome::TooEarly(_)));
}

#[test]
fn a_path_that_all_positions_are_against_is_given_up() {
    let (steps, truth) = walk(200);
    let mut smoother = new();
    // Carried off by 15 m in the middle, and no step tells of it.
    let moved: Vec<[f64; 2]> =
        truth.iter().enumerate().map(|(i, at)| if i < 100 { *at } else { [at[0] + 15.0, at[1]] }).collect();
    follow(&mut smoother, (&steps, &moved), &said(&steps, &moved, 1.0, false), 0);
    let place = smoother.estimate().unwrap().place;
    let off = (place[0] - moved[199][0]).hypot(place[1] - moved[199][1]);
    assert!(off < 2.0, "{off}");
}

#[test]
fn who_stands_for_an_hour_is_where_all_positions_say_and_walks_on_from_there() {
    let (steps, truth) = walk(120);
    let mut smoother = new();
    follow(&mut smoother, (&steps[..60], &truth[..60]), &said(&steps[..60], &truth[..60], 2.0, false), 0);
    let begin = steps[59].stance_end.0;
    for second in 1..=3_600_i64 {
        let noise = [12.9898, 78.233].map(|kind| 2.0 * some(second as usize, kind));
        let at = [truth[59][0] + noise[0], truth[59][1] + noise[1]];
        smoother.observe(&Observation::position(Micros(begin + second * 1_000_000), at, 2.0));
    }
    assert!(smoother.open_part().len() <= Parameters::default().window);
    for (step, truth) in steps.iter().zip(&truth).skip(60) {
        let later = Step {
            stance_start: step.stance_start + 3_600_000_000,
            stance_end: step.stance_end + 3_600_000_000,
            ..*step
        };
        smoother.step(&later);
        let place = smoother.estimate().unwrap().place;
        let off = (place[0] - truth[0]).hypot(place[1] - truth[1]);
        assert!(off < 5.0, "{off}");
    }
}

#[test]
fn missing_steps_and_a_tracker_that_starts_anew_are_survived() {
    let (mut steps, truth) = walk(240);
    let said = said(&steps, &truth, 1.0, false);
    steps.iter_mut().skip(160).for_each(|step| step.index -= 160);
    let hole = steps.iter().zip(&truth).enumerate().filter(|(index, _)| !(80..110).contains(index));
    let (steps, truth): (Vec<Step>, Vec<[f64; 2]>) = hole.map(|(_, (step, truth))| (*step, *truth)).unzip();
    let mut smoother = new();
    follow(&mut smoother, (&steps, &truth), &said, 0);
    let (place, last) = (smoother.estimate().unwrap().place, truth[truth.len() - 1]);
    assert!((place[0] - last[0]).hypot(place[1] - last[1]) < 1.5, "{place:?} {last:?}");
}

#[test]
fn ranges_to_three_anchors_are_a_place() {
    let (steps, truth) = walk(120);
    let anchors = [[0.0, 0.0], [30.0, -20.0], [10.0, 20.0]];
    let first = Observation::position(steps[0].stance_end, truth[0], 3.0);
    let mut smoother = new();
    smoother.step(&steps[0]);
    smoother.observe(&first);
    for (index, (step, truth)) in steps.iter().zip(&truth).enumerate().skip(1) {
        smoother.step(step);
        let anchor = anchors[index % 3];
        let metres = (truth[0] - anchor[0]).hypot(truth[1] - anchor[1]).hypot(2.0) + 0.1 * some(index, 12.9898);
        // One of ten goes around a corner.
        let metres = metres + if index % 10 == 7 { 6.0 } else { 0.0 };
        let measured = Measured::Range { anchor, above_m: 2.0, metres, sigma_m: 0.2 };
        smoother.observe(&Observation { measured, time: step.stance_end, ..first.clone() });
    }
    let (place, last) = (smoother.estimate().unwrap().place, truth[119]);
    assert!((place[0] - last[0]).hypot(place[1] - last[1]) < 0.5, "{place:?} {last:?}");
}

#[test]
fn ranges_alone_find_the_place() {
    let (steps, truth) = walk(150);
    let anchors = [[0.0, 0.0], [30.0, -20.0], [10.0, 20.0], [-10.0, -15.0]];
    let mut smoother = new();
    for (index, (step, truth)) in steps.iter().zip(&truth).enumerate() {
        smoother.step(step);
        let anchor = anchors[index % 4];
        let metres = (truth[0] - anchor[0]).hypot(truth[1] - anchor[1]) + 0.1 * some(index, 12.9898);
        let measured = Measured::Range { anchor, above_m: 0.0, metres, sigma_m: 0.2 };
        smoother.observe(&Observation { measured, ..Observation::position(step.stance_end, [0.0; 2], 1.0) });
    }
    let (place, last) = (smoother.estimate().unwrap().place, truth[149]);
    assert!((place[0] - last[0]).hypot(place[1] - last[1]) < 0.5, "{place:?} {last:?}");
}

#[test]
fn an_exact_position_after_a_long_way_without_any_is_believed() {
    let (steps, truth) = walk(300);
    let mut smoother = new();
    follow(&mut smoother, (&steps[..150], &truth[..150]), &said(&steps[..150], &truth[..150], 3.0, false), 0);
    steps[150..].iter().for_each(|step| smoother.step(step));
    // By their own covariance steps may have lost the place by metres; a code on a door is known to ten centimetres.
    let sigma_m = smoother.estimate().unwrap().sigma_m();
    assert!((2.0..20.0).contains(&sigma_m), "{sigma_m}");
    let door = [truth[299][0] + 0.6 * sigma_m, truth[299][1] - 0.3 * sigma_m];
    let verdict = smoother.hear(&Observation::position(steps[299].stance_end, door, 0.1));
    assert_eq!(verdict.outcome, Outcome::Taken, "{verdict}");
    let place = smoother.estimate().unwrap().place;
    assert!((place[0] - door[0]).hypot(place[1] - door[1]) < 0.2, "{place:?} {door:?}");
}

#[test]
fn positions_heard_before_the_steps_that_were_made_by_then_count_where_they_were_measured() {
    let (steps, truth) = walk(60);
    let said = said(&steps, &truth, 1.0, false);
    let (mut before, mut after) = (new(), new());
    before.observe(said.last().unwrap());
    steps.iter().for_each(|step| before.step(step));
    said.iter().for_each(|observation| before.observe(observation));
    steps.iter().for_each(|step| after.step(step));
    said.iter().chain(said.last()).for_each(|observation| after.observe(observation));
    let [one, other] = [before, after].map(|smoother| smoother.estimate().unwrap().place);
    assert!((one[0] - other[0]).hypot(one[1] - other[1]) < 0.05, "{one:?} {other:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Law: whatever comes, in whatever order, there is an answer of numbers.
    #[test]
    fn nothing_breaks_it(
        events in proptest::collection::vec((0_u8..4, -1e4..1e4_f64, -50.0..50.0_f64, 0.0..1e3_f64), 1..60),
    ) {
        let mut smoother = Smoother::new(&Parameters { window: 12, most_fixes: 20, ..Parameters::default() }, &Start::default());
        for (index, &(kind, time, value, sigma)) in events.iter().enumerate() {
            match kind {
                0 => smoother.step(&step(index as u32, index as f64, value.abs() / 20.0, value)),
                1 => smoother.step(&step((value.abs() * 10.0) as u32, time.abs(), f64::NAN, value)),
                2 => smoother.observe(&Observation::position(Micros((time * 1e6) as i64), [value, time], sigma.max(1e-3))),
                _ => {
                    let at = Micros(index as i64 * 1_000_000);
                    smoother.observe(&Observation::position(at, [value, sigma], sigma.max(1e-3)));
                }
            }
            if let Some(estimate) = smoother.estimate() {
                let numbers = estimate.place.iter().chain(estimate.covariance.iter());
                prop_assert!(numbers.into_iter().all(|value| value.is_finite()), "{estimate:?}");
            }
        }
    }
}
