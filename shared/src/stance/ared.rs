//! ARED, the angular rate energy detector: the foot does not turn.
//!
//! # Source
//! Skog et al. 2010 (see [`super`]): `T = 1/W sum(|omega_k|²)`, here without the division by the noise.

use super::window::Window;
use super::{CAPACITY, MINIMUM, StanceDetector, Verdict};
use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;

/// Settings of [`Ared`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Length of the window. **Units:** s.
    pub window_s: f32,
    /// The foot stands below this root mean square of the angular rate. **Units:** rad/s.
    pub threshold: f32,
}

impl Default for Parameters {
    /// The stillest moment of every surveyed stance at walking pace lies below this threshold; in a run it does not.
    fn default() -> Self {
        Self { window_s: 0.03, threshold: 0.5 }
    }
}

/// The detector; its statistic is the mean square of the angular rate. **Units:** (rad/s)².
#[derive(Clone, Debug)]
pub struct Ared {
    parameters: Parameters,
    window: Window<3, CAPACITY>,
}

impl Ared {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, window: Window::over(parameters.window_s, MINIMUM) }
    }
}

impl StanceDetector for Ared {
    fn push(&mut self, time: Micros, _accel: AccelCorrected, gyro: GyroCorrected, _gravity: f32) -> Verdict {
        self.window.push(time, gyro.0.into());
        if !self.window.is_complete() {
            return Verdict::unknown();
        }
        let mean_square = self.window.mean().iter().zip(self.window.variance()).map(|(m, v)| m * m + v).sum();
        Verdict::below(mean_square, self.parameters.threshold * self.parameters.threshold)
    }

    fn reset(&mut self) {
        self.window.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_turn_counts_like_a_shaking_one() {
        for sign in [1.0, -1.0] {
            let mut detector = Ared::new(&Parameters::default());
            let mut verdict = Verdict::unknown();
            for i in 0..20 {
                let rate = if i % 2 == 0 { 0.5 } else { 0.5 * sign };
                let gyro = GyroCorrected([0.0, rate, 0.0].into());
                verdict = detector.push(Micros(i * 5_000), AccelCorrected([0.0; 3].into()), gyro, 9.81);
            }
            // Values are cut to 4e-6 rad/s.
            assert!((verdict.statistic - 0.25).abs() < 1e-5);
            assert!(!verdict.stance);
        }
    }
}
