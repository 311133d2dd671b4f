//! SHOE, the stance hypothesis optimal estimation detector: the acceleration is gravity alone, whatever its direction, and
//! the foot does not turn.
//!
//! # Source
//! Skog et al. 2010 (see [`super`]), the generalised likelihood ratio test with unknown direction of gravity:
//! `T = 1/W sum(|a_k - g mean(a)/|mean(a)||² / sigma_a² + |omega_k|² / sigma_omega²)`. The first sum is the variance of
//! the acceleration about its mean plus `(|mean(a)| - g)²`.

use super::window::Window;
use super::{CAPACITY, MINIMUM, StanceDetector, Verdict};
use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;
use nalgebra::Vector3;

/// Settings of [`Shoe`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Length of the window. **Units:** s.
    pub window_s: f32,
    /// Noise of the accelerometer that weighs its part. **Units:** m/s².
    pub accel_sigma: f32,
    /// Noise of the gyroscope that weighs its part. **Units:** rad/s.
    pub gyro_sigma: f32,
    /// The foot stands below it. **Units:** 1.
    pub threshold: f32,
}

impl Default for Parameters {
    /// SPEC section 9: the threshold for walks; runs need ten times as much.
    fn default() -> Self {
        Self { window_s: 0.03, accel_sigma: 0.02, gyro_sigma: 0.2_f32.to_radians(), threshold: 1e4 }
    }
}

/// The detector; its statistic is `T`, without dimension.
#[derive(Clone, Debug)]
pub struct Shoe {
    parameters: Parameters,
    window: Window<6, CAPACITY>,
}

impl Shoe {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, window: Window::over(parameters.window_s, MINIMUM) }
    }
}

impl StanceDetector for Shoe {
    fn push(&mut self, time: Micros, accel: AccelCorrected, gyro: GyroCorrected, gravity: f32) -> Verdict {
        let (a, w) = (accel.0, gyro.0);
        self.window.push(time, [a.x, a.y, a.z, w.x, w.y, w.z]);
        if !self.window.is_complete() {
            return Verdict::unknown();
        }
        let mean = self.window.mean();
        let variance = self.window.variance();
        let off = libm::sqrtf(Vector3::new(mean[0], mean[1], mean[2]).norm_squared()) - gravity;
        let accel_part = variance[0] + variance[1] + variance[2] + off * off;
        let gyro_part: f32 = (3..6).map(|axis| variance[axis] + mean[axis] * mean[axis]).sum();
        let Parameters { accel_sigma, gyro_sigma, threshold, .. } = self.parameters;
        let statistic = accel_part / (accel_sigma * accel_sigma) + gyro_part / (gyro_sigma * gyro_sigma);
        Verdict::below(statistic, threshold)
    }

    fn reset(&mut self) {
        self.window.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_statistic_is_the_sum_of_the_paper(
            samples in proptest::collection::vec((-30.0_f32..30.0, -30.0_f32..30.0, -5.0_f32..30.0, -9.0_f32..9.0), 7..40),
        ) {
            let parameters = Parameters::default();
            let mut detector = Shoe::new(&parameters);
            let mut last = Verdict::unknown();
            for (i, &(x, y, z, w)) in samples.iter().enumerate() {
                let gyro = GyroCorrected(Vector3::new(0.1, w, -0.2));
                last = detector.push(Micros(i as i64 * 5_000), AccelCorrected(Vector3::new(x, y, z)), gyro, 9.81);
            }
            let held = &samples[samples.len() - 6..];
            let mean = held.iter().map(|s| Vector3::new(s.0, s.1, s.2).cast::<f64>()).sum::<Vector3<f64>>() / 6.0;
            let up = mean.normalize() * 9.81;
            let sum: f64 = held
                .iter()
                .map(|s| {
                    let a = (Vector3::new(s.0, s.1, s.2).cast::<f64>() - up).norm_squared();
                    let w = f64::from(s.3) * f64::from(s.3) + 0.05;
                    a / f64::from(parameters.accel_sigma).powi(2) + w / f64::from(parameters.gyro_sigma).powi(2)
                })
                .sum();
            // Rounding of some ten f32 operations on the value; the counts of the window (4e-6) against sigma 3.5e-3.
            prop_assert!((f64::from(last.statistic) * 6.0 - sum).abs() < 1e-5 * sum + 1.0);
        }

        #[test]
        fn the_mounting_does_not_matter(a in -1.0_f32..1.0, b in -1.0_f32..1.0, c in -1.0_f32..1.0) {
            let mounting = crate::so3::exp(&Vector3::new(3.0 * a, 3.0 * b, 3.0 * c));
            let parameters = Parameters::default();
            let (mut plain, mut turned) = (Shoe::new(&parameters), Shoe::new(&parameters));
            for i in 0..20 {
                let accel = Vector3::new(0.02 * i as f32, -0.1, 9.7);
                let gyro = Vector3::new(0.1, 0.01 * i as f32, 0.0);
                let time = Micros(i * 5_000);
                let p = plain.push(time, AccelCorrected(accel), GyroCorrected(gyro), 9.81);
                let t = turned.push(time, AccelCorrected(mounting * accel), GyroCorrected(mounting * gyro), 9.81);
                // Turning 9.8 m/s² rounds to 1e-6, against a deviation of some 0.1 m/s².
                prop_assert!(p.statistic == t.statistic || (p.statistic - t.statistic).abs() < 1e-3 * p.statistic);
            }
        }
    }
}
