//! Heights where the ground does not lie level: stairs and elevators after a walk on the level.
#![expect(clippy::unwrap_used, reason = "the helpers of a test are part of it")]

use sohle_shared::step::FloorMode;
use sohle_shared::tracker::Parameters;
use sohle_walks::simulation::{Scenario, SensorModel, Simulation};
use sohle_walks::track::Track;

/// The steps of the demo, whose way goes over level floors, three flights of stairs and an elevator: what kind of ground,
/// by how much it really rose, and by how much it was said to. **Units:** m.
fn rises(seed: u64) -> Vec<(FloorMode, f64, f64)> {
    let scenario = Scenario { seed, sensor: SensorModel::bmx055_calibrated(), ..Scenario::demo() };
    let mut heights = Vec::new();
    let samples = Simulation::new(&scenario).unwrap().map(|moment| {
        heights.push((moment.sample.time, moment.truth.position[2]));
        moment.sample
    });
    let track = Track::of(samples, &Parameters::default());
    let height = |time| heights[heights.partition_point(|&(at, _)| at < time).min(heights.len() - 1)].1;
    let pairs = track.steps.windows(2);
    pairs
        .map(|steps| {
            let rise = height(steps[1].stance_end) - height(steps[0].stance_end);
            (steps[1].mode, rise, f64::from(steps[1].displacement.z))
        })
        .collect()
}

#[test]
fn stairs_and_elevators_after_a_level_walk_come_out_at_their_height() {
    for seed in 1..=3 {
        let rises = rises(seed);
        let sum = |mode, risen: fn(f64) -> bool| {
            let these = rises.iter().filter(|(of, rise, _)| *of == mode && risen(*rise));
            these.fold((0.0, 0.0), |sum, (_, rise, said)| (sum.0 + rise, sum.1 + said))
        };
        // A quarter of a riser on a floor's height: the next floor is never in doubt. Before rests were believed the strength
        // of gravity, the level walk bent the bias and it was 5 %.
        for (mode, risen) in [
            (FloorMode::Stairs, (|rise| rise > 0.05) as fn(f64) -> bool),
            (FloorMode::Stairs, |rise| rise < -0.05),
            (FloorMode::Elevator, |rise| rise < -1.0),
        ] {
            let (rise, said) = sum(mode, risen);
            assert!(rise.abs() > 1.5, "the demo has such ground: {rise}");
            assert!((said - rise).abs() < 0.03 * rise.abs(), "seed {seed}, {mode:?}: {said} m for {rise} m");
        }
    }
}
