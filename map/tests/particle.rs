//! The particle filter on walks with truth, in a building made for it.

use nalgebra::{Matrix4, Vector3};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use sohle_map::particle::{
    Connector, ConnectorKind, Map, Parameters, ParticleFilter, Plan, Start, StartPlace, State, Wall,
};
use sohle_shared::step::{FloorMode, Step, StepQuality};
use sohle_shared::time::Micros;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The walls of a rectangle, with doors of 1 m in the south wall at the given places.
fn room([x, y]: [f32; 2], [far_x, far_y]: [f32; 2], doors: &[f32]) -> Vec<Wall> {
    let mut walls = vec![[[x, y], [x, far_y]], [[far_x, y], [far_x, far_y]], [[x, far_y], [far_x, far_y]]];
    let mut from = x;
    for &door in doors {
        walls.push([[from, y], [door, y]]);
        from = door + 1.0;
    }
    walls.push([[from, y], [far_x, y]]);
    walls
}

fn rectangle([x, y]: [f32; 2], [far_x, far_y]: [f32; 2]) -> Vec<[f32; 2]> {
    vec![[x, y], [far_x, y], [far_x, far_y], [x, far_y]]
}

/// Two floors of 40 m by 12 m: a corridor of 2 m along the south, five rooms of different widths north of it, and stairs at
/// its east end, (36, 2) to (40, 12), open to the corridor.
fn building() -> Arc<Map> {
    let rooms = [(0.0, 6.0, 1.0), (6.0, 11.0, 8.5), (11.0, 20.0, 17.5), (20.0, 24.0, 20.5), (24.0, 36.0, 29.0)];
    let plan = |number, height| {
        let mut walls = vec![
            [[0.0, 0.0], [40.0, 0.0]],
            [[0.0, 0.0], [0.0, 2.0]],
            [[40.0, 0.0], [40.0, 12.0]],
            [[36.0, 12.0], [40.0, 12.0]],
        ];
        for (west, east, door) in rooms {
            walls.extend(room([west, 2.0], [east, 12.0], &[door]));
        }
        let outlines = rooms.map(|(west, east, _)| rectangle([west, 2.0], [east, 12.0]));
        Plan { number, height, closed: walls.clone(), walls, rooms: outlines.to_vec() }
    };
    let stairs = rectangle([36.0, 2.0], [40.0, 12.0]);
    let connector = Connector { kind: ConnectorKind::Stairs, outlines: vec![(0, stairs.clone()), (1, stairs)] };
    Arc::new(Map::new(vec![plan(0, 0.0), plan(1, 3.5)], vec![connector]).expect("it is a building"))
}

/// A stance of the foot. **Units:** m, rad.
#[derive(Clone, Copy, Debug)]
struct Stance {
    place: Vector3<f64>,
    heading: f64,
}

/// Stances along a way through points (x, y, z), 1.2 m apart, the foot 0.1 m left of the way; its heading frame is turned
/// against the way by an angle that nobody knows.
fn stances(points: &[[f64; 3]], mounting: f64) -> Vec<Stance> {
    let mut stances = Vec::new();
    let mut due = 0.0;
    for pair in points.windows(2) {
        let [from, to] = [Vector3::from(pair[0]), Vector3::from(pair[1])];
        let (along, length) = (to - from, (to - from).norm());
        let heading = along.y.atan2(along.x);
        while due <= length {
            let aside = Vector3::new(-heading.sin(), heading.cos(), 0.0) * 0.1;
            stances.push(Stance { place: from + along * (due / length) + aside, heading: heading + mounting });
            due += 1.2;
        }
        due -= length;
    }
    stances
}

/// Steps from stance to stance, with errors of 1 cm and 0.2 degrees that their covariance tells of.
fn steps(stances: &[Stance], seed: u64) -> Vec<Step> {
    let mut source = Pcg64Mcg::new(u128::from(seed) << 1 | 1);
    let mut normal = || (0..12).map(|_| source.next_u32() as f64 / u32::MAX as f64).sum::<f64>() - 6.0;
    let turn_sigma = 0.2_f64.to_radians();
    let pairs = stances.windows(2).enumerate();
    pairs
        .map(|(i, pair)| {
            let moved = pair[1].place - pair[0].place;
            let (sin, cos) = pair[0].heading.sin_cos();
            let local = Vector3::new(cos * moved.x + sin * moved.y, cos * moved.y - sin * moved.x, moved.z);
            let displacement = local + Vector3::new(normal(), normal(), normal()) * 0.01;
            let turn =
                (pair[1].heading - pair[0].heading + turn_sigma * normal() + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
            let variances = [1e-4, 1e-4, 1e-4, turn_sigma * turn_sigma].map(|value| value as f32);
            let start = Micros(i as i64 * 1_100_000);
            Step {
                index: i as u32 + 1,
                stance_start: start,
                stance_end: Micros(start.0 + 500_000),
                displacement: displacement.cast(),
                turn: turn as f32,
                covariance: Matrix4::from_diagonal(&variances.into()),
                mode: FloorMode::Level,
                quality: StepQuality::default(),
                clipped: Default::default(),
            }
        })
        .collect()
}

/// Out of the second room, along the corridor, up the stairs, into the fourth room above, and back to the corridor.
fn tour() -> Vec<[f64; 3]> {
    let lower = [[8.0, 10.0, 0.0], [9.0, 3.0, 0.0], [9.0, 1.0, 0.0], [37.5, 1.0, 0.0], [37.5, 3.0, 0.0]];
    let flight = [[37.5, 10.0, 1.75], [38.7, 10.0, 1.75], [38.7, 3.0, 3.5]];
    let upper =
        [[38.7, 1.0, 3.5], [21.0, 1.0, 3.5], [21.0, 5.0, 3.5], [22.5, 9.0, 3.5], [21.0, 3.0, 3.5], [21.0, 1.0, 3.5]];
    let back = [[29.5, 1.0, 3.5], [29.5, 6.0, 3.5], [34.0, 10.0, 3.5]];
    [&lower[..], &flight, &upper, &back].concat()
}

/// Distance of the estimate to the truth in the plane and whether the floor is right, after each step.
fn errors(filter: &mut ParticleFilter, stances: &[Stance], steps: &[Step]) -> Vec<(State, f64, bool)> {
    steps
        .iter()
        .zip(&stances[1..])
        .map(|(step, truth)| {
            let estimate = filter.step(step);
            let place = estimate.place().expect("particles never vanish");
            let floor = i32::from(truth.place.z > 1.85);
            // Half-way up, either floor is right.
            let right = place.floor == floor || (truth.place.z - 1.75).abs() < 0.5;
            (estimate.state, (place.position - truth.place).xy().norm(), right)
        })
        .collect()
}

#[test]
fn a_known_start_is_followed_through_rooms_and_over_stairs() {
    for (seed, parameters, most_m) in [(1, Parameters::default(), 0.35), (2, Parameters::documented(), 1.0)] {
        let truth = stances(&tour(), 0.7);
        let start = Start::At(vec![StartPlace::exactly(0, [truth[0].place.x as f32, truth[0].place.y as f32])]);
        let mut filter = ParticleFilter::new(building(), &parameters, &start, seed).unwrap();
        let errors = errors(&mut filter, &truth, &steps(&truth, seed));
        // The heading is unknown: the first turn decides.
        let settled = &errors[12..];
        let mean = settled.iter().map(|(_, error, _)| error).sum::<f64>() / settled.len() as f64;
        assert!(mean < most_m, "{:?}: {mean} {errors:?}", parameters.method);
        assert!(settled.iter().all(|(_, _, floor)| *floor), "{:?}", parameters.method);
        assert_eq!(filter.estimate().state, State::Located);
        // The fourth room was left for the fifth.
        let room = filter.estimate().rooms[0];
        assert_eq!((room.floor, room.room), (1, Some(4)));
    }
}

#[test]
fn an_unknown_start_is_found_and_not_before_it_can_be_known() {
    let mut located = 0;
    for seed in 0..10 {
        let truth = stances(&tour(), 2.0 + seed as f64);
        let mut filter = ParticleFilter::new(building(), &Parameters::default(), &Start::Anywhere, seed).unwrap();
        assert_eq!(filter.estimate().state, State::Searching);
        let errors = errors(&mut filter, &truth, &steps(&truth, seed));
        for (i, (state, error, floor)) in errors.iter().enumerate() {
            // Both floors are alike but for the stairs.
            assert!(*state != State::Located || (*error < 1.0 && *floor), "seed {seed}, step {i}: {errors:?}");
        }
        located += usize::from(filter.estimate().state == State::Located);
    }
    assert_eq!(located, 10);
}

#[test]
fn the_past_is_better_known_than_it_was() {
    let truth = stances(&tour(), 1.0);
    let mut filter = ParticleFilter::new(building(), &Parameters::default(), &Start::Anywhere, 1).unwrap();
    let then = errors(&mut filter, &truth, &steps(&truth, 1));
    let past = filter.past();
    // The steps count from 1, as do the stances after the start.
    let off = |place: &sohle_map::particle::PastPlace| {
        (nalgebra::Vector3::from(place.position) - truth[place.step as usize].place).xy().norm()
    };
    let first = past[0].step as usize;
    assert!(first < 25, "remembered from step {first} only");
    let now = past.iter().map(off).sum::<f64>() / past.len() as f64;
    let then = then[first - 1..].iter().map(|(_, error, _)| error).sum::<f64>() / past.len() as f64;
    assert!(now < 0.5 * then && now < 0.3, "{now} against {then}");
}

#[test]
fn somebody_carried_away_is_found_again() {
    for seed in 0..5 {
        let truth = stances(&tour(), 1.0);
        let mut filter = ParticleFilter::new(building(), &Parameters::default(), &Start::Anywhere, seed).unwrap();
        errors(&mut filter, &truth, &steps(&truth, seed));
        assert_eq!(filter.estimate().state, State::Located);
        // From the fifth room of the upper floor to the second of the lower one, though no step says so.
        let mut again = steps(&truth, seed + 100);
        let (last, end) = (steps(&truth, seed).len() as u32, again.len());
        for step in &mut again {
            step.index += last;
        }
        let errors = errors(&mut filter, &truth, &again);
        assert!(errors.iter().any(|(state, _, _)| *state != State::Located), "seed {seed}: it was not noticed");
        let (state, error, floor) = errors[end - 1];
        assert!(state == State::Located && error < 1.0 && floor, "seed {seed}: {errors:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_on_any_number_of_threads() {
    let truth = stances(&tour()[..6], 1.0);
    let steps = steps(&truth, 3);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut filter = ParticleFilter::new(building(), &Parameters::default(), &Start::Anywhere, 3).unwrap();
            steps.iter().map(|step| filter.step(step).clone()).collect::<Vec<_>>()
        })
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn a_step_of_thirty_metres_loses_nobody_for_good() {
    let truth = stances(&tour(), 1.0);
    let mut walk = steps(&truth, 4);
    walk[40].displacement.x = 30.0;
    let start = Start::At(vec![StartPlace::exactly(0, [8.0, 10.0])]);
    let mut filter = ParticleFilter::new(building(), &Parameters::default(), &start, 4).unwrap();
    let errors = errors(&mut filter, &truth, &walk);
    let (state, error, floor) = errors[errors.len() - 1];
    assert!(state == State::Located && error < 1.0 && floor, "{errors:?}");
}

#[test]
fn a_step_that_is_no_number_is_survived() {
    let truth = stances(&tour()[..4], 1.0);
    let mut walk = steps(&truth, 4);
    walk[5].displacement.x = f32::NAN;
    walk[7].covariance[(0, 0)] = f32::NAN;
    walk[9].turn = f32::INFINITY;
    let mut filter = ParticleFilter::new(building(), &Parameters::default(), &Start::Anywhere, 4).unwrap();
    for step in &walk {
        let estimate = filter.step(step);
        assert!(estimate.place().is_some_and(|place| place.position.iter().all(|value| value.is_finite())));
    }
}
