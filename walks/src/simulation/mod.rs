//! The walk simulator: a person walks a route with a sensor on the shoe, and the truth is known.
//!
//! A [`Scenario`] (who, where, with which sensor, which seed) becomes a [`Simulation`], an iterator over [`Moment`]s: the
//! paired inertial sample as the driver hands it to the tracker, and where the sensor really was. Below it, [`Dies`]
//! yields the raw counts of the two dies at the instants of their own clocks, for whoever wants to feed a driver.
//! Stance intervals come as [`TruthStance`] with the first moment after each. Nothing is held in memory but the stride
//! under way, so that days can be simulated.
//!
//! Position and attitude of the foot are one formula, differentiated exactly ([`jet`]); equal scenarios give equal bits
//! on every machine (transcendental functions from `libm`, own normal distribution).
//!
//! # Beside real recordings
//! Printed by `sohle simulate --describe` and `sohle simulate --describe FILE [--profile NAME]` (see [`peaks`]): median
//! over the strides, with the range of the middle 80 %. Persons a, b, c are those of the detector test; the real sensors
//! sample at 200 to 820 Hz behind low-pass filters, the simulated one at 2 kHz without.
//!
//! |  | strides | stride s | peak rate rad/s | 95 % | peak force m/s² | 95 % | stillest (SHOE) | below 3e5 s |
//! |---|---|---|---|---|---|---|---|---|
//! | recorded: walk 31 | 32 | 1.21 (1.10-1.33) | 8.7 (7.6-9.3) | 7.3 | 42 (37-47) | 27 | 2.7e3 (8e2-6e3) | 0.49 |
//! | recorded: walk 32 | 61 | 1.16 (1.06-1.25) | 7.9 (7.4-8.3) | 7.0 | 38 (33-41) | 30 | 2.5e3 (1e3-6e3) | 0.51 |
//! | recorded: walk 36 | 57 | 1.15 (1.07-1.24) | 8.1 (7.4-8.5) | 7.0 | 36 (32-39) | 30 | 2.8e3 (1e3-6e3) | 0.49 |
//! | recorded: walk 39 | 80 | 1.23 (1.11-1.34) | 7.8 (7.2-8.3) | 6.8 | 33 (29-36) | 27 | 3.5e3 (2e3-7e3) | 0.55 |
//! | recorded: x-io walk | 16 | 1.24 (0.99-1.56) | 10.2 (8.7-11.1) | 8.3 | 47 (39-53) | 35 | 1.5e3 (7e2-4e3) | 0.53 |
//! | recorded: gaitmap walk, left | 30 | 1.12 (0.96-1.20) | 9.8 (8.0-10.8) | 7.8 | 109 (57-159) | 34 | 7.1e2 (2e2-1e3) | 0.44 |
//! | recorded: openshoe250 5 km/h | 46 | 1.15 (1.07-1.23) | 6.9 (6.5-7.3) | 6.4 | 51 (43-56) | 31 | 1.6e3 (9e2-3e3) | 0.39 |
//! | **simulated: walk a** | 99 | 1.07 (0.99-1.14) | 7.9 (7.4-8.3) | 7.1 | 39 (35-47) | 30 | 1.5e3 (8e2-3e3) | 0.45 |
//! | **simulated: walk b** | 100 | 1.14 (1.06-1.28) | 8.1 (7.6-8.6) | 7.3 | 58 (47-73) | 30 | 2.1e3 (8e2-4e3) | 0.47 |
//! | **simulated: walk c** | 99 | 1.21 (1.10-1.39) | 8.3 (7.6-9.1) | 7.5 | 72 (59-89) | 31 | 2.1e3 (9e2-5e3) | 0.50 |
//! | recorded: openshoe250 7 km/h | 42 | 0.96 (0.90-1.08) | 8.6 (8.0-9.1) | 7.9 | 71 (59-77) | 47 | 4.3e3 (2e3-8e3) | 0.28 |
//! | recorded: openshoe820 | 48 | 1.01 (0.98-1.04) | 13.2 (11.0-15.3) | 7.9 | 144 (111-163) | 44 | 4.5e2 (3e2-8e2) | 0.35 |
//! | **simulated: fast a** | 99 | 0.86 (0.78-0.94) | 9.7 (9.2-10.5) | 8.8 | 70 (67-74) | 53 | 3.0e3 (2e3-6e3) | 0.34 |
//! | **simulated: fast b** | 99 | 0.93 (0.85-1.04) | 10.0 (9.3-10.7) | 9.0 | 69 (60-81) | 51 | 4.0e3 (2e3-9e3) | 0.35 |
//! | **simulated: fast c** | 99 | 1.01 (0.92-1.10) | 10.1 (9.2-11.0) | 9.2 | 81 (64-97) | 53 | 4.2e3 (2e3-1e4) | 0.38 |
//! | recorded: run 34 | 23 | 0.93 (0.87-1.14) | 9.3 (8.5-9.9) | 8.8 | 58 (44-68) | 41 | 2.5e4 (1e4-5e4) | 0.25 |
//! | **simulated: run a** | 99 | 0.76 (0.73-0.79) | 10.6 (9.9-11.5) | 9.7 | 60 (56-66) | 54 | 1.6e4 (1e4-3e4) | 0.15 |
//! | **simulated: run b** | 99 | 0.82 (0.78-0.87) | 10.6 (9.8-11.7) | 9.9 | 66 (57-78) | 50 | 2.2e4 (1e4-5e4) | 0.14 |
//! | **simulated: run c** | 100 | 0.88 (0.82-0.95) | 10.9 (9.6-11.8) | 10.0 | 78 (63-99) | 50 | 2.6e4 (1e4-6e4) | 0.15 |
//! | recorded: gaitmap stairs up, left | 19 | 1.00 (0.90-1.10) | 10.4 (7.5-12.4) | 5.9 | 150 (58-170) | 33 | 3.6e2 (2e2-3e3) | 0.48 |
//! | recorded: gaitmap stairs up, right | 20 | 0.99 (0.95-1.11) | 10.4 (8.1-13.6) | 6.3 | 147 (64-163) | 32 | 3.5e2 (1e2-1e3) | 0.44 |
//! | **simulated: up a** | 30 | 0.93 (0.88-0.99) | 5.9 (5.7-6.1) | 5.5 | 58 (52-63) | 36 | 3.4e2 (2e2-6e2) | 0.43 |
//! | **simulated: up b** | 30 | 1.01 (0.94-1.11) | 5.9 (5.6-6.3) | 5.5 | 70 (62-76) | 31 | 4.1e2 (3e2-8e2) | 0.47 |
//! | **simulated: up c** | 30 | 1.11 (1.00-1.17) | 6.0 (5.6-6.5) | 5.7 | 79 (70-86) | 29 | 5.6e2 (4e2-9e2) | 0.52 |
//! | **simulated: down a** | 30 | 0.90 (0.87-0.95) | 5.6 (5.4-5.9) | 5.1 | 58 (52-64) | 36 | 4.4e2 (3e2-8e2) | 0.37 |
//! | **simulated: down b** | 30 | 0.98 (0.93-1.06) | 5.8 (5.4-6.1) | 5.2 | 73 (64-81) | 33 | 7.9e2 (4e2-1e3) | 0.40 |
//! | **simulated: down c** | 31 | 1.06 (0.99-1.15) | 5.8 (5.4-6.2) | 5.2 | 84 (63-93) | 30 | 8.8e2 (6e2-2e3) | 0.43 |
//! | **simulated: side a** | 39 | 0.92 (0.87-0.98) | 2.7 (2.6-2.9) | 2.5 | 26 (24-29) | 20 | 2.4e2 (2e2-5e2) | 0.54 |
//! | **simulated: side b** | 40 | 0.97 (0.90-1.00) | 2.7 (2.5-2.8) | 2.4 | 29 (27-32) | 19 | 3.8e2 (2e2-5e2) | 0.59 |
//! | **simulated: side c** | 39 | 1.00 (0.91-1.18) | 2.7 (2.5-3.0) | 2.5 | 34 (30-37) | 19 | 4.1e2 (3e2-7e2) | 0.61 |

pub mod dies;
pub mod error;
pub mod gait;
mod in_building;
pub mod jet;
pub mod motion;
pub mod mounting;
pub mod output;
pub mod path;
pub mod peaks;
pub mod person;
pub mod phone;
pub mod plan;
pub mod profile;
pub mod random;
pub mod route;
pub mod scenario;
pub mod sensor;

pub use dies::{Dies, Reading};
pub use error::Error;
pub use gait::Gait;
pub use mounting::{Mounting, Orientation};
pub use person::{Foot, Person};
pub use route::{Leg, Route};
pub use scenario::Scenario;
pub use sensor::SensorModel;

use crate::recording::{TruthPose, TruthStance};
use nalgebra::Vector3;
use sohle_shared::sample::{Accel, Clipped, Counts, Gyro, ImuSample};
use std::collections::VecDeque;

/// One sample of the simulated sensor, with the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The sample at the gyroscope's instant; the accelerometer is interpolated to it.
    pub sample: ImuSample,
    /// Where the sensor was at that instant.
    pub truth: TruthPose,
    /// Number of the last stance that has begun; 0 is the one the walk starts from.
    pub step: u32,
    /// The stance that has ended since the moment before. The last moment carries the stance the recording ends in.
    pub stance: Option<TruthStance>,
}

/// A reading of the gyroscope. **Units:** time in s.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    time: f64,
    counts: Counts,
    truth: TruthPose,
    step: u32,
}

/// A simulated walk as an iterator over its samples.
#[derive(Debug)]
pub struct Simulation {
    dies: Dies,
    /// The two latest readings of the accelerometer.
    accel: [Option<(f64, Counts)>; 2],
    /// Readings of the gyroscope that wait for an accelerometer reading after them.
    waiting: VecDeque<Waiting>,
    /// One finished moment is held back, to carry the last stance if nothing follows it.
    held: Option<Moment>,
    temperature: Option<i8>,
}

impl Simulation {
    /// The walk of `scenario`.
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        Ok(Self {
            dies: Dies::new(scenario)?,
            accel: [None; 2],
            waiting: VecDeque::new(),
            held: None,
            temperature: None,
        })
    }

    /// The sensor's unit with the errors that were drawn for it.
    pub fn unit(&self) -> &sensor::Unit {
        self.dies.unit()
    }

    /// The latest temperature reading. **Units:** 0.5 K, 0 at 23 °C.
    pub fn temperature(&self) -> Option<i8> {
        self.temperature
    }

    /// The oldest waiting gyroscope reading with the accelerometer interpolated to it, if readings on both sides of it are
    /// there. A gyroscope reading before the first of the accelerometer is dropped.
    fn pair(&mut self) -> Option<Moment> {
        let [Some((before, a)), Some((after, b))] = self.accel else { return None };
        while let Some(&Waiting { time, counts: rate, truth, step }) = self.waiting.front() {
            if time > after {
                return None;
            }
            self.waiting.pop_front();
            if time < before {
                continue;
            }
            let unit = self.dies.unit();
            let share = ((time - before) / (after - before)) as f32;
            let per_bit = unit.accel.per_bit() as f32;
            let (a_si, b_si) = (a.scaled(per_bit), b.scaled(per_bit));
            let gyro: Vector3<f32> = rate.scaled(unit.gyro.per_bit() as f32);
            let clipped = Clipped {
                accel: a.saturated(unit.accel.bits()) || b.saturated(unit.accel.bits()),
                gyro: rate.saturated(unit.gyro.bits()),
            };
            let sample =
                ImuSample { time: truth.time, accel: Accel(a_si + (b_si - a_si) * share), gyro: Gyro(gyro), clipped };
            return Some(Moment { sample, truth, step, stance: None });
        }
        None
    }

    fn next_pair(&mut self) -> Option<Moment> {
        loop {
            if let Some(moment) = self.pair() {
                return Some(moment);
            }
            match self.dies.next()? {
                (time, Reading::Accel(counts)) => self.accel = [self.accel[1], Some((time, counts))],
                (time, Reading::Gyro { counts, truth, step }) => {
                    self.waiting.push_back(Waiting { time, counts, truth, step });
                }
                (_, Reading::Temperature(steps)) => self.temperature = Some(steps),
            }
        }
    }
}

impl Iterator for Simulation {
    type Item = Moment;

    fn next(&mut self) -> Option<Moment> {
        let following = self.next_pair().map(|mut moment| {
            moment.stance = self.dies.stance_ended(moment.truth.time.as_seconds());
            moment
        });
        let first = self.held.is_none();
        let mut due = std::mem::replace(&mut self.held, following);
        match (&mut due, &following) {
            (None, Some(_)) if first => self.next(),
            (Some(last), None) if last.stance.is_none() => {
                last.stance = self.dies.stance_ended(f64::INFINITY);
                due
            }
            _ => due,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::peaks::Peaks;
    use super::*;
    use sha2::{Digest, Sha256};

    fn fingerprint(scenario: &Scenario) -> String {
        let mut hash = Sha256::new();
        for moment in Simulation::new(scenario).unwrap() {
            hash.update(moment.sample.time.0.to_le_bytes());
            for value in moment.sample.accel.0.iter().chain(moment.sample.gyro.0.iter()) {
                hash.update(value.to_bits().to_le_bytes());
            }
            for value in moment.truth.position.iter().chain(&moment.truth.velocity).chain(&moment.truth.attitude) {
                hash.update(value.to_bits().to_le_bytes());
            }
        }
        hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect()
    }

    fn short(seed: u64) -> Scenario {
        Scenario { duration: Some(25.0), ..Scenario::endless(seed) }
    }

    #[test]
    fn equal_scenarios_give_equal_bits() {
        // The value itself guards against differences between machines, compilers and profiles.
        assert_eq!(fingerprint(&short(7)), "c89fa9ba161916fe");
        assert_ne!(fingerprint(&short(7)), fingerprint(&short(8)));
    }

    #[test]
    fn samples_come_at_the_gyroscopes_own_rate_and_agree_with_the_truth() {
        let mut scenario = short(3);
        scenario.sensor = SensorModel::ideal();
        scenario.sensor.gyro.clock_error = 0.003;
        scenario.sensor.accel.clock_error = 0.003;
        let simulation = Simulation::new(&scenario).unwrap();
        let (gyro, accel) = (simulation.unit().gyro.period(), simulation.unit().accel.period());
        assert!(gyro != accel && (gyro * 2000.0 - 1.0).abs() < 0.0031, "{gyro} {accel}");
        let moments: Vec<Moment> = simulation.collect();
        let (first, last) = (moments[0].truth.time, moments[moments.len() - 1].truth.time);
        // Both ends are rounded to microseconds.
        assert!(((last - first) as f64 * 1e-6 - (moments.len() - 1) as f64 * gyro).abs() < 1.1e-6);
        let mut motion = scenario.motion().unwrap();
        let mut worst = 0.0_f64;
        for moment in &moments {
            assert_eq!(moment.sample.time, moment.truth.time);
            let time = moment.truth.time.as_seconds();
            assert!(motion.advance(time));
            let truth = motion.at(time);
            // Half a microsecond of rounding at up to 6 m/s.
            assert!((nalgebra::Vector3::from(moment.truth.position) - truth.position).norm() < 4e-6);
            let force = truth.specific_force(scenario.gravity).map(|value| value as f32);
            // One bit and a half, and what interpolation over half a millisecond misses of a 40 Hz vibration:
            // (2 pi 40)^2 (0.5 ms)^2 / 8 of 150 m/s², 0.3 m/s², and twice that where it sets in.
            worst = worst.max(f64::from((moment.sample.accel.0 - force).amax()));
            let rate = truth.rate.map(|value| value as f32);
            assert!((moment.sample.gyro.0 - rate).amax() < 0.0011);
        }
        assert!(worst < 0.75, "{worst}");
    }

    #[test]
    fn every_stance_is_told_once_and_the_moments_agree_with_it() {
        let mut scenario = Scenario::detector_test(Person::a(), Gait::Walk);
        scenario.strides = Some(12);
        let moments: Vec<Moment> = Simulation::new(&scenario).unwrap().collect();
        let stances: Vec<TruthStance> = moments.iter().filter_map(|moment| moment.stance).collect();
        assert_eq!(stances.len(), 13);
        for moment in &moments {
            let inside = stances.iter().find(|s| s.start <= moment.truth.time && moment.truth.time < s.end);
            assert_eq!(moment.truth.stance, inside.is_some(), "{:?}", moment.truth.time);
            if let Some(inside) = inside {
                assert_eq!(stances[moment.step as usize], *inside);
            }
        }
        assert!(moments.last().unwrap().stance.is_some());
    }

    #[test]
    fn a_recording_ends_when_it_is_asked_to() {
        for seconds in [2.0, 6.3, 60.0] {
            let mut scenario = Scenario { duration: Some(seconds), ..Scenario::default() };
            scenario.route.legs = vec![Leg::walk(9.0, 0.0)];
            let last = Simulation::new(&scenario).unwrap().last().unwrap();
            assert!((last.truth.time.as_seconds() - seconds).abs() < 2e-3, "{seconds}: {:?}", last.truth.time);
        }
    }

    #[test]
    fn a_long_simulation_holds_no_more_than_a_short_one() {
        let mut simulation = Simulation::new(&Scenario { duration: Some(1e8), ..Scenario::endless(2) }).unwrap();
        // What it holds shows in how long it takes to write it down.
        let mut held = |samples: usize| {
            assert!(simulation.nth(samples - 1).is_some());
            format!("{simulation:?}").len()
        };
        let early = held(20 * 2000);
        let late = held(300 * 2000);
        assert!(late < early + early / 4, "{early} {late}");
    }

    #[test]
    fn gaits_are_as_violent_as_recorded_ones() {
        // Ranges over the recordings named in the module's documentation and the three people, with room for the bandwidth:
        // the recorders sample at 200 to 820 Hz, the simulated sensor at 2 kHz without a filter.
        let cases = [
            (Gait::Walk, 6.5..10.5, 30.0..145.0, 0.8..1.5, 1e3..2e4, 0.35..0.65),
            (Gait::Fast, 6.5..11.0, 45.0..145.0, 0.7..1.2, 1.5e3..3e4, 0.25..0.50),
            (Gait::Run, 8.5..14.0, 45.0..160.0, 0.6..1.0, 1e4..6e4, 0.08..0.25),
        ];
        for person in Person::all() {
            for (gait, rate, force, stride, stillest, still) in cases.clone() {
                let scenario = Scenario { strides: Some(40), ..Scenario::detector_test(person, gait) };
                let samples: Vec<ImuSample> = Simulation::new(&scenario).unwrap().map(|moment| moment.sample).collect();
                let peaks = Peaks::of(&samples);
                assert!((38..=41).contains(&peaks.strides), "{peaks:?}");
                assert!(rate.contains(&peaks.rate.median), "{gait:?} {peaks:?}");
                assert!(force.contains(&peaks.force.median), "{gait:?} {peaks:?}");
                assert!(stride.contains(&peaks.stride.median), "{gait:?} {peaks:?}");
                assert!(stillest.contains(&peaks.stillest.median), "{gait:?} {peaks:?}");
                assert!(still.contains(&peaks.nearly_still.median), "{gait:?} {peaks:?}");
            }
        }
    }

    #[test]
    fn a_simulated_walk_is_like_the_surveyed_ones() {
        let Some(folder) = crate::recording::recordings_dir() else { return };
        let scenario = Scenario { strides: Some(60), ..Scenario::detector_test(Person::b(), Gait::Walk) };
        let samples: Vec<ImuSample> = Simulation::new(&scenario).unwrap().map(|moment| moment.sample).collect();
        let simulated = Peaks::of(&samples);
        for walk in ["31", "32", "36", "39"] {
            let path = folder.join(format!("foot_koroglu_gcp/exp{walk}_imu.csv"));
            let Ok(recorded) = crate::recording::open(&path, None) else { continue };
            let recorded = Peaks::of(&recorded.samples);
            // People and walks differ by some 20 % among themselves, the statistic by a factor of two.
            for (ours, theirs) in [
                (simulated.stride.median, recorded.stride.median),
                (simulated.rate.median, recorded.rate.median),
                (simulated.rate_95, recorded.rate_95),
                (simulated.force_95, recorded.force_95),
                (simulated.nearly_still.median, recorded.nearly_still.median),
            ] {
                assert!((ours / theirs - 1.0).abs() < 0.25, "{walk}: {simulated:?} {recorded:?}");
            }
            let stillness = simulated.stillest.median / recorded.stillest.median;
            assert!((0.4..2.5).contains(&stillness), "{walk}: {simulated:?} {recorded:?}");
        }
    }

    #[test]
    fn a_narrow_range_clips_and_says_so() {
        let mut scenario = short(4);
        scenario.sensor.accel.range = 4.0 * sensor::G_M_S2;
        let clipped = Simulation::new(&scenario).unwrap().filter(|moment| moment.sample.clipped.accel).count();
        assert!(clipped > 20, "{clipped}");
        let end = scenario.sensor.accel.range as f32;
        assert!(Simulation::new(&scenario).unwrap().all(|moment| moment.sample.accel.0.amax() <= end));
    }
}
