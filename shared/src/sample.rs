//! Inertial samples: what comes from the sensor, before and after correction, as different types.
//!
//! # Frame
//! All vectors are in the sensor frame `l` of the IMU unless a type says otherwise; it is right-handed and fixed to the
//! shoe in any attitude. An accelerometer at rest measures the reaction to gravity: `+g` along the upward vertical.

use crate::time::Micros;
use nalgebra::Vector3;

/// Standard gravity, used until the tracker has measured its own. **Units:** m/s².
pub const STANDARD_GRAVITY_M_S2: f32 = 9.806_65;

/// Register counts of one die, as read. **Units:** least significant bits; **Frame:** sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counts(pub [i16; 3]);

impl Counts {
    /// The counts times the weight of one bit. **Units:** those of `per_bit`.
    pub fn scaled(self, per_bit: f32) -> Vector3<f32> {
        Vector3::from(self.0.map(|count| f32::from(count) * per_bit))
    }

    /// Whether an axis stands at the end of a range of `bits` bits (two's complement).
    pub fn saturated(self, bits: u32) -> bool {
        let end = (1_i32 << (bits - 1)) - 1;
        self.0.iter().any(|&count| i32::from(count) >= end || i32::from(count) <= -end)
    }
}

/// Specific force as measured, bias and scale not corrected. **Units:** m/s²; **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accel(pub Vector3<f32>);

/// Angular rate as measured, bias not corrected. **Units:** rad/s; **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gyro(pub Vector3<f32>);

/// Specific force after bias and scale were taken out. **Units:** m/s²; **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelCorrected(pub Vector3<f32>);

/// Angular rate after the bias was taken out. **Units:** rad/s; **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroCorrected(pub Vector3<f32>);

/// Gyroscope bias. **Units:** rad/s; **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroBias(pub Vector3<f32>);

/// Accelerometer bias. **Units:** m/s²; **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelBias(pub Vector3<f32>);

impl GyroBias {
    /// No bias.
    pub fn zero() -> Self {
        Self(Vector3::zeros())
    }
}

impl AccelBias {
    /// No bias.
    pub fn zero() -> Self {
        Self(Vector3::zeros())
    }
}

impl Gyro {
    /// Takes the bias out.
    pub fn corrected(self, bias: GyroBias) -> GyroCorrected {
        GyroCorrected(self.0 - bias.0)
    }
}

impl Accel {
    /// Takes the bias out.
    pub fn corrected(self, bias: AccelBias) -> AccelCorrected {
        AccelCorrected(self.0 - bias.0)
    }
}

/// Which die stood at the end of its range when the sample was taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Clipped {
    /// An accelerometer axis was at the end of its range.
    pub accel: bool,
    /// A gyroscope axis was at the end of its range.
    pub gyro: bool,
}

/// How many samples stood at the end of a range. A count that would exceed its type stays at the largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ClippedSamples {
    /// Of the accelerometer.
    pub accel: u16,
    /// Of the gyroscope.
    pub gyro: u16,
}

impl ClippedSamples {
    /// Counts a sample.
    pub fn count(&mut self, clipped: Clipped) {
        self.add(Self { accel: u16::from(clipped.accel), gyro: u16::from(clipped.gyro) });
    }

    /// Adds what was counted elsewhere.
    pub fn add(&mut self, other: Self) {
        self.accel = self.accel.saturating_add(other.accel);
        self.gyro = self.gyro.saturating_add(other.gyro);
    }
}

/// One reading of accelerometer and gyroscope at the same moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// When the sample was taken.
    pub time: Micros,
    /// Specific force. **Units:** m/s²; **Frame:** sensor.
    pub accel: Accel,
    /// Angular rate. **Units:** rad/s; **Frame:** sensor.
    pub gyro: Gyro,
    /// End-of-range marks.
    pub clipped: Clipped,
}

impl ImuSample {
    /// A sample that is inside both ranges. **Units:** `accel` m/s², `gyro` rad/s; **Frame:** sensor.
    pub fn new(time: Micros, accel: [f32; 3], gyro: [f32; 3]) -> Self {
        Self { time, accel: Accel(accel.into()), gyro: Gyro(gyro.into()), clipped: Clipped::default() }
    }

    /// Whether every value is a number. Only such a sample may enter a filter.
    pub fn is_finite(&self) -> bool {
        self.accel.0.iter().chain(self.gyro.0.iter()).all(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_tell_saturation_at_both_ends() {
        assert!(Counts([0, 2047, 0]).saturated(12));
        assert!(Counts([-2048, 0, 0]).saturated(12));
        assert!(!Counts([2046, -2046, 0]).saturated(12));
        assert!(Counts([0, 0, i16::MIN]).saturated(16));
    }

    #[test]
    fn counts_of_clipped_samples_stay_at_the_largest() {
        let mut counts = ClippedSamples { accel: u16::MAX - 1, gyro: 0 };
        for _ in 0..3 {
            counts.count(Clipped { accel: true, gyro: false });
        }
        assert_eq!(counts, ClippedSamples { accel: u16::MAX, gyro: 0 });
    }

    #[test]
    fn a_sample_with_a_nan_is_not_finite() {
        let sample = ImuSample::new(Micros(0), [0.0, f32::NAN, 9.81], [0.0; 3]);
        assert!(!sample.is_finite());
    }
}
