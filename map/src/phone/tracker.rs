//! From a phone's samples to steps.

use super::attitude::{self, Attitude};
use super::barometer::{self, Barometer};
use super::detector::{self, StepDetector};
use super::length::Length;
use super::sample::PhoneSample;
use super::step::Measured;
use crate::building::geometry::wrapped;
use sohle_shared::step::{Step, StepQuality};
use sohle_shared::time::Micros;

/// Samples further apart leave a gap. **Units:** s.
const GAP_S: f64 = 0.5;
/// Standard gravity. **Units:** m/s².
const GRAVITY: f64 = 9.806_65;

/// Settings of [`PhoneTracker`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How the vertical and the heading are followed.
    pub attitude: attitude::Parameters,
    /// How steps are found.
    pub detector: detector::Parameters,
    /// How the height is followed.
    pub barometer: barometer::Parameters,
    /// Height of the person. **Units:** m.
    pub person_m: f64,
    /// How long steps are.
    pub length: Length,
    /// How wrong a length is from step to step (standard deviation, as a part of it).
    pub length_part: f64,
    /// How far a step leads aside (standard deviation). **Units:** m.
    pub aside_m: f64,
    /// How wrong a turn is (standard deviation). **Units:** rad.
    pub turn_sigma: f64,
    /// And how wrong as a part of it: who turns does not hold the phone as still as who goes straight on.
    pub turn_part: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            attitude: attitude::Parameters::default(),
            detector: detector::Parameters::default(),
            barometer: barometer::Parameters::default(),
            person_m: 1.75,
            length: Length::default(),
            length_part: 0.07,
            aside_m: 0.05,
            turn_sigma: 1.0_f64.to_radians(),
            turn_part: 0.05,
        }
    }
}

impl Parameters {
    /// With the step length of the document.
    pub fn documented() -> Self {
        Self { length: Length::documented(), ..Self::default() }
    }
}

/// Finds the steps of somebody who holds a phone.
#[derive(Clone, Debug)]
pub struct PhoneTracker {
    parameters: Parameters,
    attitude: Attitude,
    detector: StepDetector,
    barometer: Barometer,
    last: Option<Micros>,
    last_pressure: Option<Micros>,
    gap: bool,
    /// Of the step that is being made: sum of the headings and their number.
    headings: (f64, u32),
    /// The last step: its moment, its heading, the height then.
    previous: Option<(Micros, f64, Option<f64>)>,
    count: u32,
}

impl PhoneTracker {
    /// Nothing has come yet.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            attitude: Attitude::new(&parameters.attitude),
            detector: StepDetector::new(&parameters.detector),
            barometer: Barometer::new(&parameters.barometer),
            parameters: parameters.clone(),
            last: None,
            last_pressure: None,
            gap: false,
            headings: (0.0, 0),
            previous: None,
            count: 0,
        }
    }

    /// Takes in a sample; tells a step that it completes. Samples that are no numbers or not later than the last are left
    /// out.
    pub fn push(&mut self, sample: &PhoneSample) -> Option<Step> {
        let numbers = sample.accel.iter().chain(&sample.gyro).all(|value| value.is_finite());
        if !numbers || self.last.is_some_and(|last| sample.time <= last) {
            return None;
        }
        let mut dt = self.last.map_or(0.0, |last| (sample.time - last) as f64 * 1e-6);
        self.last = Some(sample.time);
        if dt > GAP_S {
            (self.gap, dt) = (true, 0.0);
        }
        self.attitude.push(sample, dt);
        if let Some(pressure) = sample.pressure {
            let dt = self.last_pressure.map_or(0.0, |last| (sample.time - last) as f64 * 1e-6);
            self.last_pressure = Some(sample.time);
            self.barometer.push(pressure, dt);
        }
        self.headings.0 += self.attitude.heading();
        self.headings.1 += 1;
        let vertical = sample.accel.dot(&self.attitude.up()) - GRAVITY;
        let seconds = sample.time.0 as f64 * 1e-6;
        let found = self.detector.push(vertical, seconds, dt)?;
        Some(self.step(sample.time, found.rise))
    }

    /// The step that ends now. Its direction is the mean heading since the last one: so the sway of the body falls out.
    fn step(&mut self, time: Micros, bounce: f64) -> Step {
        let p = &self.parameters;
        let (sum, number) = std::mem::take(&mut self.headings);
        let heading = sum / f64::from(number.max(1));
        let height = self.barometer.height();
        let (before, turn, rise) = match self.previous {
            Some((before, then, low)) => {
                (before, wrapped(heading - then), height.zip(low).map(|(high, low)| high - low))
            }
            None => (time, 0.0, None),
        };
        let seconds = (time - before) as f64 * 1e-6;
        let (length, part) = if seconds > 0.0 {
            (p.length.of(p.person_m, 1.0 / seconds, bounce), p.length_part)
        } else {
            // Of the first step of all nobody knows where in it the recording began.
            (0.5 * p.length.of(p.person_m, f64::INFINITY, bounce), 0.5)
        };
        let step = Measured { index: self.count, time, length, part, turn, rise }.step(p);
        let quality = StepQuality { gap: std::mem::take(&mut self.gap), ..step.quality };
        self.previous = Some((time, heading, height));
        self.count = self.count.wrapping_add(1);
        Step { quality, ..step }
    }
}

/// All steps of a recording.
pub fn steps(samples: &[PhoneSample], parameters: &Parameters) -> Vec<Step> {
    let mut tracker = PhoneTracker::new(parameters);
    samples.iter().filter_map(|sample| tracker.push(sample)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use std::f64::consts::{PI, TAU};

    /// Ten seconds straight on at 1.8 steps a second, a quarter turn to the left, and ten seconds more.
    fn walk() -> Vec<Step> {
        let mut tracker = PhoneTracker::new(&Parameters::default());
        (0..2_100)
            .filter_map(|i| {
                let t = f64::from(i) / 100.0;
                let turning = (10.0..11.0).contains(&t);
                let sway = 0.3 * (TAU * 0.9 * t).cos();
                tracker.push(&PhoneSample {
                    time: Micros(i64::from(i) * 10_000),
                    accel: Vector3::new(0.0, 0.0, GRAVITY + 3.0 * (TAU * 1.8 * t).sin()),
                    gyro: Vector3::new(0.0, 0.0, sway + if turning { PI / 2.0 } else { 0.0 }),
                    magnetic: None,
                    pressure: Some(1_000.0),
                })
            })
            .collect()
    }

    #[test]
    fn a_corner_is_walked_as_it_is() {
        let steps = walk();
        assert!((36..=39).contains(&steps.len()), "{}", steps.len());
        let (mut place, mut heading) = ([0.0_f64; 2], 0.0_f64);
        for step in &steps {
            let (sin, cos) = heading.sin_cos();
            let [x, y] = [step.displacement.x, step.displacement.y].map(f64::from);
            place = [place[0] + cos * x - sin * y, place[1] + sin * x + cos * y];
            heading += f64::from(step.turn);
        }
        // The low-pass leaves a bounce of 3.6 m/s², which stands for 0.655 m; the corner is cut by a step at most.
        assert!((heading - PI / 2.0).abs() < 0.12, "{heading}");
        assert!((place[0] - 13.2).abs() < 1.5 && (place[1] - 12.6).abs() < 1.5, "{place:?}");
        assert!(
            steps
                .iter()
                .all(|step| step.displacement.z.abs() < 1e-3 && step.covariance[(2, 2)] < 0.03 || step.index == 0)
        );
        assert!(steps.iter().all(|step| step.covariance.cholesky().is_some()));
    }

    #[test]
    fn nonsense_is_left_out_and_a_hole_is_told() {
        let mut tracker = PhoneTracker::new(&Parameters::default());
        let mut gaps = 0;
        for i in 0..1_000_i64 {
            let hole = if i >= 500 { 5_000_000 } else { 0 };
            let t = i as f64 / 100.0;
            let accel = if i % 50 == 7 { f64::NAN } else { GRAVITY + 3.0 * (TAU * 1.8 * t).sin() };
            let sample = PhoneSample {
                time: Micros(i * 10_000 + hole),
                accel: Vector3::new(0.0, 0.0, accel),
                gyro: Vector3::zeros(),
                magnetic: None,
                pressure: None,
            };
            if let Some(step) = tracker.push(&sample) {
                gaps += u32::from(step.quality.gap);
                assert!(step.displacement.iter().all(|value| value.is_finite()));
            }
            assert_eq!(tracker.push(&sample), None);
        }
        assert_eq!(gaps, 1);
    }
}
