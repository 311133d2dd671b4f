//! The document's stance detector: the foot stands once it has been still for a while.
//!
//! # Source
//! Foot, section 4.5 and table 4.1. The time between samples is that of their stamps (SPEC section 8, decision 2).

use super::window::Window;
use super::{StanceDetector, Verdict};
use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;
use nalgebra::Vector3;

/// Samples the running means are taken over (Foot, 4.5: "ring buffer with 200 entries").
const ENTRIES: usize = 200;
/// A hole in the time line longer than this is a movement: nothing is known of what happened in it. **Units:** µs.
const GAP_US: i64 = 100_000;

/// Settings of [`Documented`], names as in table 4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// How long the foot must have been still. **Units:** s.
    pub min_still_time: f32,
    /// A moving foot becomes still at this angular rate or below. **Units:** rad/s.
    pub max_gyro_norm: f32,
    /// and when the magnitude of the acceleration is this near to gravity. **Units:** m/s².
    pub max_accel_norm: f32,
    /// A still foot stays still within this distance from the running mean, for each axis. **Units:** rad/s.
    pub max_gyro_offset: [f32; 3],
    /// and within this one, for each axis. **Units:** m/s².
    pub max_accel_offset: [f32; 3],
}

impl Parameters {
    /// Table 4.1.
    pub fn documented() -> Self {
        Self {
            min_still_time: 0.15,
            max_gyro_norm: 20_f32.to_radians(),
            max_accel_norm: 0.6,
            max_gyro_offset: [8_f32.to_radians(); 3],
            max_accel_offset: [0.8, 0.8, 2.0],
        }
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Self::documented()
    }
}

/// The detector; its statistic is the time the foot has been still. **Units:** s.
#[derive(Clone, Debug)]
pub struct Documented {
    parameters: Parameters,
    moving: bool,
    still_us: i64,
    last: Option<Micros>,
    /// Angular rate (3) and acceleration (3) of the still samples.
    still: Window<6, ENTRIES>,
}

impl Documented {
    /// A detector that has seen nothing; the foot is taken to be moving.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, moving: true, still_us: 0, last: None, still: Window::of_newest() }
    }

    /// Lines 1 to 5: whether a moving foot still moves.
    fn has_not_stopped(&self, accel: &Vector3<f32>, gyro: &Vector3<f32>, gravity: f32) -> bool {
        let rate = libm::sqrtf(gyro.norm_squared());
        let off = (libm::sqrtf(accel.norm_squared()) - gravity).abs();
        // What is not a number is not within a limit.
        !(rate <= self.parameters.max_gyro_norm && off <= self.parameters.max_accel_norm)
    }

    /// Lines 6 to 13: whether a still foot has moved.
    fn has_moved(&self, accel: &Vector3<f32>, gyro: &Vector3<f32>) -> bool {
        let [gx, gy, gz, ax, ay, az] = self.still.mean();
        let within = |value: &Vector3<f32>, mean: [f32; 3], limit: [f32; 3]| {
            (0..3).all(|axis| (value[axis] - mean[axis]).abs() <= limit[axis])
        };
        !(within(gyro, [gx, gy, gz], self.parameters.max_gyro_offset)
            && within(accel, [ax, ay, az], self.parameters.max_accel_offset))
    }
}

impl StanceDetector for Documented {
    fn push(&mut self, time: Micros, accel: AccelCorrected, gyro: GyroCorrected, gravity: f32) -> Verdict {
        let passed_us = self.last.map_or(0, |last| time - last);
        self.last = Some(time);
        let (a, w) = (accel.0, gyro.0);
        self.moving = if !(0..=GAP_US).contains(&passed_us) {
            true
        } else if self.moving {
            self.has_not_stopped(&a, &w, gravity)
        } else {
            self.has_moved(&a, &w)
        };
        if self.moving {
            self.still_us = 0;
            self.still.clear();
        } else {
            self.still_us = self.still_us.saturating_add(passed_us);
            self.still.push(time, [w.x, w.y, w.z, a.x, a.y, a.z]);
        }
        let still_s = self.still_us as f32 * 1e-6;
        Verdict { stance: still_s > self.parameters.min_still_time, statistic: still_s, velocity_sigma: None }
    }

    fn reset(&mut self) {
        *self = Self::new(&self.parameters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: ([f32; 3], [f32; 3]) = ([0.0, 0.0, 9.81], [0.0; 3]);

    /// Pushes samples 2 ms apart; the stamps go on from `start`.
    fn run(detector: &mut Documented, start: i64, samples: &[([f32; 3], [f32; 3])]) -> Verdict {
        let mut verdict = Verdict::unknown();
        for (i, (accel, gyro)) in samples.iter().enumerate() {
            let time = Micros(start + i as i64 * 2_000);
            verdict = detector.push(time, AccelCorrected((*accel).into()), GyroCorrected((*gyro).into()), 9.81);
        }
        verdict
    }

    fn standing() -> Documented {
        let mut detector = Documented::new(&Parameters::documented());
        assert!(run(&mut detector, 0, &[STILL; 100]).stance);
        detector
    }

    #[test]
    fn a_stance_is_declared_after_the_time_of_rest_and_not_before() {
        let mut detector = Documented::new(&Parameters::documented());
        // The first sample has no time before it: 75 intervals of 2 ms are 0.15 s, which is not above 0.15 s.
        assert!(!run(&mut detector, 0, &[STILL; 76]).stance);
        assert!(run(&mut detector, 76 * 2_000, &[STILL]).stance);
    }

    #[test]
    fn a_moving_foot_stops_only_within_the_norms() {
        for (accel, gyro) in [([0.0, 0.0, 9.2], [0.0; 3]), ([0.0, 0.0, 10.5], [0.0; 3]), (STILL.0, [0.0, 0.36, 0.0])] {
            let mut detector = Documented::new(&Parameters::documented());
            assert_eq!(run(&mut detector, 0, &[(accel, gyro); 200]).statistic, 0.0);
        }
        let mut detector = Documented::new(&Parameters::documented());
        assert!(run(&mut detector, 0, &[([0.0, 0.0, 9.3], [0.0, 0.34, 0.0]); 200]).stance);
    }

    #[test]
    fn a_standing_foot_is_held_by_the_offsets_of_each_axis() {
        let stays = [([0.7, 0.0, 9.81], [0.0; 3]), ([0.0, 0.0, 11.7], [0.0; 3]), (STILL.0, [0.13, 0.13, 0.13])];
        let moves = [([0.9, 0.0, 9.81], [0.0; 3]), ([0.0, 0.0, 11.9], [0.0; 3]), (STILL.0, [0.0, 0.0, 0.15])];
        for sample in stays {
            assert!(run(&mut standing(), 200_000, &[sample]).stance, "{sample:?}");
        }
        for sample in moves {
            assert_eq!(run(&mut standing(), 200_000, &[sample]).statistic, 0.0, "{sample:?}");
        }
    }

    #[test]
    fn the_mean_follows_the_last_200_samples() {
        let mut detector = standing();
        let tilted = ([0.7, 0.0, 9.81], [0.0; 3]);
        let more = ([1.4, 0.0, 9.81], [0.0; 3]);
        assert!(run(&mut detector, 200_000, &[tilted; 200]).stance);
        // All 200 samples are tilted by now: 1.4 is 0.7 from their mean.
        assert!(run(&mut detector, 600_000, &[more]).stance);
    }

    #[test]
    fn days_of_standing_stay_a_stance() {
        let mut detector = standing();
        detector.still_us = 30 * 86_400 * 1_000_000;
        assert!(run(&mut detector, 200_000, &[STILL]).stance);
    }
}
