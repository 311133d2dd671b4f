//! What is known of the one sensor that sits on the shoe, and how it is found out.
//!
//! A [`Calibration`] takes out of every sample what is constant in a unit: the accelerometer's offset, scale and
//! misalignment, and the gyroscope's bias at the temperature of the moment and under the force of the moment. The
//! [`Guide`] finds it: the sensor is laid down in twelve attitudes for some seconds each, in any order, and the guide says
//! what comes next, takes or refuses each rest with a reason, and tells at the end whether the sensor is good enough. It is
//! fed with samples and knows nothing of where they come from, so the same guide runs on the shoe and on a recording.
//! With the feature `store`, module `store` keeps the result in flash.
//!
//! A corrected sample is still an [`ImuSample`]: one of a better sensor. What is left of its errors is what the tracker
//! estimates and takes out itself, and only that makes `AccelCorrected` and `GyroCorrected` of it. So there is no third
//! type, and one place (after the driver, before the tracker) where [`Calibration::apply`] is called.

pub mod ellipsoid;
mod guide;
mod noise;
mod pose;
#[cfg(feature = "store")]
pub mod store;
mod temperature;
pub mod verdict;

pub use ellipsoid::{Correction, FitError};
pub use guide::{Event, Guide, Outcome, Parameters, Prompt};
pub use noise::{Density, Noise};
pub use pose::{Direction, GyroFit, Pose, Refusal, SixPose};
pub use temperature::{GyroBiasTable, POINTS, Point};
pub use verdict::{Finding, Grade, Property, Verdict};

use crate::sample::{Accel, Gyro, ImuSample};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Degrees to radians.
const DEG: f32 = core::f32::consts::PI / 180.0;

/// How well the accelerometer's correction is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Quality {
    /// Verdict of the guide.
    pub grade: Grade,
    /// Poses it was found from.
    pub poses: u8,
    /// Root mean square of what the corrected readings at rest are off gravity. **Units:** m/s².
    pub residual: f32,
    /// Standard deviation of the worst bias. **Units:** m/s².
    pub bias_sigma: f32,
    /// Standard deviation of the worst scale. **Units:** 1.
    pub scale_sigma: f32,
}

/// The constants of one unit. `Default` changes nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Calibration {
    /// When it was made, if whoever made it has a calendar. **Units:** s since 1970-01-01.
    pub made: Option<u64>,
    /// Temperature at which the accelerometer's correction was found; its offset moves by up to 1 mg/K, which the tracker
    /// has to estimate. **Units:** °C.
    pub temperature: Option<f32>,
    /// Turn from the sensor to the shoe (x forward, y left, z up), w, x, y, z. The tracker does not need it; displays do.
    pub mounting: Option<[f32; 4]>,
    /// Rate that the gyroscope reads for a force, row by row. **Units:** rad/s per m/s²; **Frame:** sensor.
    pub gyro_per_accel: [[f32; 3]; 3],
    /// How well the accelerometer's correction is known.
    pub quality: Quality,
    /// Of the accelerometer.
    pub accel: Correction,
    /// Of the gyroscope, without force.
    pub gyro: GyroBiasTable,
}

impl Calibration {
    /// The sample as a sensor without these errors would have taken it. **Units:** °C, the temperature of the dies if
    /// known.
    pub fn apply(&self, sample: &ImuSample, temperature: Option<f32>) -> ImuSample {
        let force = self.accel.apply(&sample.accel.0);
        let bias = self.gyro.bias(temperature).unwrap_or_else(Vector3::zeros);
        let rate = sample.gyro.0 - bias - self.per_accel() * force;
        ImuSample { accel: Accel(force), gyro: Gyro(rate), ..*sample }
    }

    /// Takes in what a rest in use showed: the mean of measured samples, not corrected ones. `sigma` is how well its rate
    /// shows the bias. **Units:** °C; m/s²; rad/s; **Frame:** sensor.
    pub fn learn(&mut self, temperature: f32, accel: &Vector3<f32>, gyro: &Vector3<f32>, sigma: f32) {
        let bias = gyro - self.per_accel() * self.accel.apply(accel);
        self.gyro.learn(temperature, &bias, sigma);
    }

    /// Rate that the gyroscope reads for a force. **Units:** rad/s per m/s²; **Frame:** sensor.
    pub fn per_accel(&self) -> Matrix3<f32> {
        let [x, y, z] = self.gyro_per_accel.map(|row| Vector3::from(row).transpose());
        Matrix3::from_rows(&[x, y, z])
    }

    /// Turn from the sensor to the shoe, if known.
    pub fn mounting(&self) -> Option<UnitQuaternion<f32>> {
        let [w, x, y, z] = self.mounting?;
        UnitQuaternion::try_new(nalgebra::Quaternion::new(w, x, y, z), 0.5)
    }

    /// Whether every value is a number. Only such a calibration may be used.
    pub fn is_finite(&self) -> bool {
        let Correction { bias, scale, cross } = self.accel;
        let vectors = [bias, scale, cross].into_iter().chain(self.gyro_per_accel);
        let finite = |point: &Point| point.bias.iter().chain([&point.temperature]).all(|value| value.is_finite());
        vectors.flatten().chain(self.mounting.into_iter().flatten()).all(f32::is_finite)
            && self.gyro.points().all(finite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Micros;
    use proptest::prelude::*;

    #[test]
    fn the_default_changes_no_bit() {
        let sample = ImuSample::new(Micros(7), [0.1, -9.7, 1e-3], [0.2, -0.3, 4.0]);
        assert_eq!(Calibration::default().apply(&sample, Some(31.5)), sample);
        assert_eq!(Calibration::default().mounting(), None);
    }

    #[test]
    fn what_a_rest_taught_is_gone_from_the_next() {
        let mut calibration = Calibration {
            accel: Correction { bias: [0.3, 0.1, -0.2], scale: [1.01, 0.99, 1.0], cross: [0.001, 0.0, -0.002] },
            gyro_per_accel: [[1e-4, 0.0, 2e-4], [0.0, -1e-4, 0.0], [1e-4, 1e-4, 0.0]],
            ..Calibration::default()
        };
        let sample = ImuSample::new(Micros(7), [0.4, -9.7, 0.5], [0.02, -0.01, 0.005]);
        calibration.learn(25.0, &sample.accel.0, &sample.gyro.0, 1e-4);
        assert!(calibration.apply(&sample, Some(25.0)).gyro.0.amax() < 1e-6);
        // Turned over, the gyroscope reads something else, and that is known too.
        let over = ImuSample::new(Micros(8), [0.2, 9.9, -0.9], [0.02, -0.01, 0.005]);
        let expected = calibration.per_accel()
            * (calibration.accel.apply(&sample.accel.0) - calibration.accel.apply(&over.accel.0));
        assert!((calibration.apply(&over, Some(25.0)).gyro.0 - expected).amax() < 1e-6);
    }

    proptest! {
        #[test]
        fn nothing_makes_it_panic(v in proptest::collection::vec(proptest::num::f32::ANY, 24)) {
            let three = |first: usize| [v[first], v[first + 1], v[first + 2]];
            let mut calibration = Calibration {
                mounting: Some([v[0], v[1], v[2], v[3]]),
                accel: Correction { bias: three(3), scale: three(6), cross: three(9) },
                ..Calibration::default()
            };
            calibration.learn(v[12], &three(13).into(), &three(16).into(), v[19]);
            let corrected = calibration.apply(&ImuSample::new(Micros(0), three(20), three(21)), Some(v[23]));
            prop_assert_eq!(corrected.time, Micros(0));
            let _ = (calibration.mounting(), calibration.is_finite());
        }
    }
}
