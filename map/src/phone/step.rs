//! A step as a phone tells it.

use super::tracker::Parameters;
use nalgebra::{Matrix4, Vector3};
use sohle_shared::sample::ClippedSamples;
use sohle_shared::step::{FloorMode, Step, StepQuality};
use sohle_shared::time::Micros;

/// Nothing is known better than that (standard deviation). **Units:** m.
const LEAST_SIGMA_M: f64 = 0.02;
/// How little is known of a height that nothing measures (standard deviation). **Units:** m.
const UNKNOWN_HEIGHT_M: f64 = 10.0;

/// What a phone knows of a step. **Frame:** heading frame of the previous step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Number of the step.
    pub index: u32,
    /// When it ended.
    pub time: Micros,
    /// Its length in the plan. **Units:** m.
    pub length: f64,
    /// How wrong the length may be (standard deviation, as a part of it).
    pub part: f64,
    /// Its direction, from that of the step before. **Units:** rad.
    pub turn: f64,
    /// How far it led up, where that was measured. **Units:** m.
    pub rise: Option<f64>,
}

impl Measured {
    /// The step, with the covariance that the settings give it.
    pub fn step(&self, parameters: &Parameters) -> Step {
        let (sin, cos) = self.turn.sin_cos();
        Step {
            index: self.index,
            stance_start: self.time,
            stance_end: self.time,
            displacement: Vector3::new(self.length * cos, self.length * sin, self.rise.unwrap_or(0.0)).cast(),
            turn: self.turn as f32,
            covariance: self.covariance(parameters).cast(),
            mode: FloorMode::Level,
            quality: StepQuality::default(),
            clipped: ClippedSamples::default(),
        }
    }

    /// How wrong the step may be (x, y, z, turn). **Units:** m, rad.
    fn covariance(&self, p: &Parameters) -> Matrix4<f64> {
        let along = (self.part * self.length).powi(2) + LEAST_SIGMA_M * LEAST_SIGMA_M;
        let aside = p.aside_m * p.aside_m;
        let tall = if self.rise.is_some() { p.barometer.sigma_m } else { UNKNOWN_HEIGHT_M }.powi(2);
        let turned = p.turn_sigma * p.turn_sigma + (p.turn_part * self.turn).powi(2);
        // Along and aside of the new direction, seen from the old one.
        let (sin, cos) = self.turn.sin_cos();
        let (xx, yy) = (along * cos * cos + aside * sin * sin, along * sin * sin + aside * cos * cos);
        let xy = (along - aside) * sin * cos;
        Matrix4::new(
            xx, xy, 0.0, 0.0, //
            xy, yy, 0.0, 0.0, //
            0.0, 0.0, tall, 0.0, //
            0.0, 0.0, 0.0, turned,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_step_round_a_corner_is_unsure_along_its_own_direction() {
        let measured = Measured { index: 3, time: Micros(7), length: 0.7, part: 0.1, turn: FRAC_PI_2, rise: None };
        let step = measured.step(&Parameters::default());
        assert!((step.displacement - Vector3::new(0.0, 0.7, 0.0)).norm() < 1e-6);
        let sigma = |row: usize| step.covariance[(row, row)].sqrt();
        // 0.1 of 0.7 m and 0.02 m along, 0.05 m aside.
        assert!((sigma(0) - 0.05).abs() < 1e-6 && (sigma(1) - 0.0728).abs() < 1e-4, "{}", step.covariance);
        assert!(sigma(2) > 5.0);
        let level = Measured { rise: Some(0.0), ..measured }.step(&Parameters::default());
        assert!(level.covariance[(2, 2)] < 1.0);
    }
}
