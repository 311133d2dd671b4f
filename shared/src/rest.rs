//! Is the foot truly at rest, as when its owner stands or sits? Then, and only then, the gyroscope shows its bias and the
//! accelerometer the vertical.
//!
//! A stance is not a rest: the foot of a walker still turns by some degrees per second. A rest is half a second in which
//! neither rate nor force varies.

use crate::stance::window::Window;
use crate::time::Micros;
use nalgebra::Vector3;

/// Settings of [`RestDetector`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Length of a rest. **Units:** s.
    pub window_s: f32,
    /// Largest standard deviation of the angular rate in it. **Units:** rad/s.
    pub gyro_sigma: f32,
    /// Largest standard deviation of the specific force in it. **Units:** m/s².
    pub accel_sigma: f32,
    /// Largest rate left after the bias known so far: more is a slow turn, not a bias. **Units:** rad/s.
    pub gyro_mean: f32,
    /// What the mean rate of a rest tells of the bias at best (standard deviation). **Units:** rad/s.
    pub bias_sigma: f32,
    /// How much less it tells when the rate varied: this part of the standard deviation is added. **Units:** 1.
    pub bias_share: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            window_s: 0.5,
            gyro_sigma: 1.0_f32.to_radians(),
            accel_sigma: 0.15,
            gyro_mean: 2.0_f32.to_radians(),
            bias_sigma: 0.02_f32.to_radians(),
            bias_share: 0.3,
        }
    }
}

/// A stretch of rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Mean angular rate. **Units:** rad/s; **Frame:** sensor.
    pub gyro: Vector3<f32>,
    /// Mean specific force. **Units:** m/s²; **Frame:** sensor.
    pub accel: Vector3<f32>,
    /// How well the mean rate shows the bias (standard deviation). **Units:** rad/s.
    pub bias_sigma: f32,
    /// How much the rate varied from increment to increment (standard deviation of the vector). **Units:** rad/s.
    pub gyro_sigma: f32,
    /// How much the force varied, likewise. **Units:** m/s².
    pub accel_sigma: f32,
}

/// Room for a rest of 0.64 s at increments of 10 ms.
const CAPACITY: usize = 64;
/// Fewest increments a rest is judged from.
const MINIMUM: usize = 8;

/// Finds rests, one after the other, without overlap.
#[derive(Clone, Debug)]
pub struct RestDetector {
    parameters: Parameters,
    window: Window<6, CAPACITY>,
}

impl RestDetector {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, window: Window::over(parameters.window_s, MINIMUM) }
    }

    /// Takes in what the sensor showed on average over some milliseconds, and tells of a rest that ends now. `spread` scales
    /// what may vary: 1 for a rest, more for the best that could be had.
    pub fn push(&mut self, time: Micros, accel: &Vector3<f32>, gyro: &Vector3<f32>, spread: f32) -> Option<Rest> {
        self.window.push(time, [accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z]);
        if !self.window.is_complete() {
            return None;
        }
        let p = &self.parameters;
        let [ax, ay, az, gx, gy, gz] = self.window.variance();
        let gyro_sigma = libm::sqrtf(gx + gy + gz);
        let accel_sigma = libm::sqrtf(ax + ay + az);
        let [ax, ay, az, gx, gy, gz] = self.window.mean();
        let gyro = Vector3::new(gx, gy, gz);
        let turns = gyro.norm_squared() > p.gyro_mean * p.gyro_mean * spread * spread;
        if gyro_sigma > p.gyro_sigma * spread || accel_sigma > p.accel_sigma * spread || turns {
            return None;
        }
        self.window.clear();
        let bias_sigma = p.bias_sigma + p.bias_share * gyro_sigma;
        Some(Rest { gyro, accel: Vector3::new(ax, ay, az), bias_sigma, gyro_sigma, accel_sigma })
    }

    /// As new, with other settings.
    pub fn restart(&mut self, parameters: &Parameters) {
        self.parameters = *parameters;
        self.window.restart(parameters.window_s, MINIMUM);
    }

    /// Forgets everything seen.
    pub fn reset(&mut self) {
        self.window.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rests(seconds: i64, foot: impl Fn(f32) -> (Vector3<f32>, Vector3<f32>)) -> usize {
        let mut detector = RestDetector::new(&Parameters::default());
        (0..seconds * 100)
            .filter(|&i| {
                let (accel, gyro) = foot(i as f32 * 0.01);
                detector.push(Micros(i * 10_000), &accel, &gyro, 1.0).is_some()
            })
            .count()
    }

    #[test]
    fn ten_seconds_of_rest_are_nineteen_rests() {
        // Each takes half a second and the one increment more that completes it.
        assert_eq!(rests(10, |_| (Vector3::new(0.0, 0.0, 9.8), Vector3::new(0.01, -0.02, 0.0))), 19);
    }

    #[test]
    fn a_stance_of_a_walker_a_slow_turn_and_a_start_are_none() {
        let up = Vector3::new(0.0, 0.0, 9.8);
        // Rolling over at 20 deg/s for 0.3 s in each stride.
        let walker = |t: f32| (up, Vector3::new(0.0, 0.35 * libm::sinf(5.0 * t), 0.0));
        assert_eq!(rests(5, walker), 0);
        assert_eq!(rests(5, |_| (up, Vector3::new(0.0, 0.0, 0.1))), 0);
        assert_eq!(rests(5, |t| (up * (1.0 + 0.2 * t), Vector3::zeros())), 0);
    }
}
