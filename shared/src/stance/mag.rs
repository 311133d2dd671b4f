//! MAG, the acceleration magnitude detector: the acceleration is as large as gravity.
//!
//! # Source
//! Skog et al. 2010 (see [`super`]): `T = 1/W sum((|a_k| - g)²)`, here without the division by the noise.

use super::window::Window;
use super::{CAPACITY, MINIMUM, StanceDetector, Verdict};
use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;

/// Settings of [`Mag`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Length of the window. **Units:** s.
    pub window_s: f32,
    /// The foot stands below this root mean square of the difference to gravity. **Units:** m/s².
    pub threshold: f32,
}

impl Default for Parameters {
    /// The stillest moment of every surveyed stance at walking pace lies below this threshold; in a run it does not.
    fn default() -> Self {
        Self { window_s: 0.06, threshold: 0.25 }
    }
}

/// The detector; its statistic is the mean square of `|a| - g`. **Units:** (m/s²)².
#[derive(Clone, Debug)]
pub struct Mag {
    parameters: Parameters,
    window: Window<1, CAPACITY>,
}

impl Mag {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, window: Window::over(parameters.window_s, MINIMUM) }
    }
}

impl StanceDetector for Mag {
    fn push(&mut self, time: Micros, accel: AccelCorrected, _gyro: GyroCorrected, gravity: f32) -> Verdict {
        self.window.push(time, [libm::sqrtf(accel.0.norm_squared())]);
        if !self.window.is_complete() {
            return Verdict::unknown();
        }
        let [mean] = self.window.mean();
        let [variance] = self.window.variance();
        let off = mean - gravity;
        Verdict::below(variance + off * off, self.parameters.threshold * self.parameters.threshold)
    }

    fn reset(&mut self) {
        self.window.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_measures_the_distance_to_gravity_in_any_direction() {
        let mut detector = Mag::new(&Parameters::default());
        let gyro = GyroCorrected([0.0; 3].into());
        let mut verdict = Verdict::unknown();
        for i in 0..40 {
            let accel = if i % 2 == 0 { [6.0, 0.0, 8.0] } else { [0.0, -11.0, 0.0] };
            verdict = detector.push(Micros(i * 5_000), AccelCorrected(accel.into()), gyro, 9.0);
        }
        // Half of the samples are off by 1, half by 2; values are cut to 4e-6 m/s².
        assert!((verdict.statistic - 2.5).abs() < 1e-4);
    }
}
