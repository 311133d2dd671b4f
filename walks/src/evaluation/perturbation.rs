//! The same walk as another sensor would have recorded it: mounted otherwise, slower, noisier.
//!
//! A setting that only fits the recordings it was found on gives worse figures on these. They change what reaches the
//! tracker, never the truth.

use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use sohle_shared::sample::ImuSample;
use std::f32::consts::{FRAC_PI_2, PI};

/// A change of all samples of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Perturbation {
    /// As recorded
    #[value(skip)]
    Recorded,
    /// Sensor turned by 180 degrees about its x axis
    UpsideDown,
    /// Sensor turned by 90 degrees about its y axis: what was level stands upright
    XVertical,
    /// Sensor turned by 78 degrees about an axis that is none of its own
    OddAngle,
    /// Every second sample left out, so that what is faster folds back: no sensor does this
    HalfRate,
    /// Two samples averaged into one
    HalfRateAveraged,
    /// What a sensor at half the rate and with a low-pass for it records
    HalfRateFiltered,
    /// White noise of the BMX055 added
    Noise,
}

/// White noise of the BMX055's gyroscope. **Units:** rad/s/√Hz. **Source:** data sheet, 0.014 °/s/√Hz.
const GYRO_NOISE: f32 = 2.443e-4;
/// White noise of the BMX055's accelerometer. **Units:** m/s²/√Hz. **Source:** data sheet, 150 µg/√Hz.
const ACCEL_NOISE: f32 = 1.471e-3;
/// Any number: the noise has to be the same each time, nothing more.
const SEED: u128 = 0x05EE_D0F5_01E5;

impl Perturbation {
    /// All of them, the unchanged recording first.
    pub const ALL: [Self; 8] = [
        Self::Recorded,
        Self::UpsideDown,
        Self::XVertical,
        Self::OddAngle,
        Self::HalfRate,
        Self::HalfRateAveraged,
        Self::HalfRateFiltered,
        Self::Noise,
    ];

    /// The name on the command line and in outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recorded => "recorded",
            Self::UpsideDown => "upside-down",
            Self::XVertical => "x-vertical",
            Self::OddAngle => "odd-angle",
            Self::HalfRate => "half-rate",
            Self::HalfRateAveraged => "half-rate-averaged",
            Self::HalfRateFiltered => "half-rate-filtered",
            Self::Noise => "noise",
        }
    }

    /// The changed samples.
    pub fn apply(self, samples: &[ImuSample]) -> Vec<ImuSample> {
        match self {
            Self::Recorded => samples.to_vec(),
            Self::UpsideDown => turned(samples, Vector3::new(PI, 0.0, 0.0)),
            Self::XVertical => turned(samples, Vector3::new(0.0, FRAC_PI_2, 0.0)),
            Self::OddAngle => turned(samples, Vector3::new(0.7, -1.1, 0.4)),
            Self::HalfRate => samples.iter().step_by(2).copied().collect(),
            Self::HalfRateAveraged => samples.chunks_exact(2).map(|pair| averaged(&pair[0], &pair[1])).collect(),
            Self::HalfRateFiltered => filtered(samples).into_iter().step_by(2).collect(),
            Self::Noise => noisy(samples),
        }
    }
}

/// Turns the readings by the rotation vector `by`. **Units:** rad.
fn turned(samples: &[ImuSample], by: Vector3<f32>) -> Vec<ImuSample> {
    let rotation = Rotation3::new(by);
    let mut turned = samples.to_vec();
    for sample in &mut turned {
        sample.accel.0 = rotation * sample.accel.0;
        sample.gyro.0 = rotation * sample.gyro.0;
    }
    turned
}

fn averaged(first: &ImuSample, second: &ImuSample) -> ImuSample {
    let mut sample = *second;
    sample.time = first.time + (second.time - first.time) / 2;
    sample.accel.0 = (first.accel.0 + second.accel.0) * 0.5;
    sample.gyro.0 = (first.gyro.0 + second.gyro.0) * 0.5;
    sample.clipped.accel |= first.clipped.accel;
    sample.clipped.gyro |= first.clipped.gyro;
    sample
}

/// Samples on each side that a filtered one is made of.
const REACH: i32 = 7;

/// Half of the band left: a sinc under a Hamming window (Oppenheim, Schafer: "Discrete-Time Signal Processing", 7.5), no
/// delay. Beyond the ends the first and the last sample go on.
fn filtered(samples: &[ImuSample]) -> Vec<ImuSample> {
    let weights: Vec<(i32, f32)> = (-REACH..=REACH)
        .map(|k| {
            let x = PI * k as f32 / 2.0;
            let sinc = if k == 0 { 1.0 } else { libm::sinf(x) / x };
            (k, sinc * (0.54 + 0.46 * libm::cosf(PI * k as f32 / (REACH + 1) as f32)))
        })
        .collect();
    let sum: f32 = weights.iter().map(|(_, weight)| weight).sum();
    let filter = |at: usize| {
        let mut sample = samples[at];
        (sample.accel.0, sample.gyro.0) = (Vector3::zeros(), Vector3::zeros());
        for &(k, weight) in &weights {
            let other = &samples[at.saturating_add_signed(k as isize).min(samples.len() - 1)];
            sample.accel.0 += other.accel.0 * (weight / sum);
            sample.gyro.0 += other.gyro.0 * (weight / sum);
            // The others weigh too little for a reading at the end of the range to spoil them.
            if k.abs() <= 1 {
                sample.clipped.accel |= other.clipped.accel;
                sample.clipped.gyro |= other.clipped.gyro;
            }
        }
        sample
    };
    (0..samples.len()).map(filter).collect()
}

/// Adds noise up to half of the sample rate: density times the root of that bandwidth.
fn noisy(samples: &[ImuSample]) -> Vec<ImuSample> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Vec::new() };
    let seconds = last.time.since(first.time);
    let rate = if seconds > 0.0 { (samples.len() - 1) as f32 / seconds } else { 0.0 };
    let root_bandwidth = libm::sqrtf(rate / 2.0);
    let mut random = Pcg64Mcg::from_seed(SEED.to_le_bytes());
    let mut noise = |density: f32| {
        Vector3::from_fn(|_, _| {
            let normal: f32 = StandardNormal.sample(&mut random);
            normal * density * root_bandwidth
        })
    };
    let mut noisy = samples.to_vec();
    for sample in &mut noisy {
        sample.accel.0 += noise(ACCEL_NOISE);
        sample.gyro.0 += noise(GYRO_NOISE);
    }
    noisy
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use sohle_shared::time::Micros;

    fn walk() -> Vec<ImuSample> {
        (0..2001)
            .map(|k| ImuSample::new(Micros(k * 5000), [k as f32 * 0.01, 1.0, 9.81], [0.0, k as f32 * 0.001, 0.5]))
            .collect()
    }

    #[test]
    fn names_are_those_of_the_command_line() {
        assert_eq!(Perturbation::value_variants(), &Perturbation::ALL[1..]);
        for perturbation in &Perturbation::ALL[1..] {
            assert_eq!(perturbation.to_possible_value().unwrap().get_name(), perturbation.name());
        }
    }

    #[test]
    fn a_turn_keeps_magnitudes_and_times() {
        let walk = walk();
        for turn in [Perturbation::UpsideDown, Perturbation::XVertical, Perturbation::OddAngle] {
            for (before, after) in walk.iter().zip(turn.apply(&walk)) {
                assert_eq!(before.time, after.time);
                // 1e-4 of 22 m/s²: a few roundings in f32.
                assert!((before.accel.0.norm() - after.accel.0.norm()).abs() < 1e-4);
                assert!((before.gyro.0.dot(&before.accel.0) - after.gyro.0.dot(&after.accel.0)).abs() < 1e-3);
            }
        }
        assert!(Perturbation::UpsideDown.apply(&walk)[0].accel.0.z < -9.8);
        assert!(Perturbation::XVertical.apply(&walk)[0].accel.0.x > 9.8);
    }

    #[test]
    fn half_the_rate_is_half_the_samples() {
        let walk = walk();
        let plain = Perturbation::HalfRate.apply(&walk);
        assert_eq!((plain.len(), plain[1]), (1001, walk[2]));
        let averaged = Perturbation::HalfRateAveraged.apply(&walk);
        assert_eq!((averaged.len(), averaged[0].time), (1000, Micros(2500)));
        assert!((averaged[1].accel.0.x - 0.025).abs() < 1e-6);
    }

    #[test]
    fn a_filter_keeps_what_half_the_rate_can_tell_and_nothing_else() {
        let wave = |period: f32| {
            let sample = |k: i64| {
                let x = (2.0 * PI * k as f32 / period).sin();
                ImuSample::new(Micros(k * 5000), [x, 1.0, 9.81], [0.0, x, 0.5])
            };
            (0..401).map(sample).collect::<Vec<_>>()
        };
        let left = |period| {
            let filtered = Perturbation::HalfRateFiltered.apply(&wave(period));
            assert_eq!(filtered.len(), 201);
            // Away from the ends.
            filtered[20..180].iter().map(|sample| sample.accel.0.x.abs()).fold(0.0, f32::max)
        };
        // A tenth of the rate passes; its largest reading is sin 72 degrees, 5 % below its peak. Four tenths would fold back.
        assert!((left(10.0) - 1.0).abs() < 0.06, "{}", left(10.0));
        assert!(left(2.5) < 0.01, "{}", left(2.5));
        assert_eq!(Perturbation::HalfRateFiltered.apply(&[]), []);
    }

    #[test]
    fn the_noise_is_as_strong_as_the_data_sheet_says_and_the_same_each_time() {
        let walk = walk();
        let noisy = Perturbation::Noise.apply(&walk);
        assert_eq!(noisy, Perturbation::Noise.apply(&walk));
        let squares: f32 = walk.iter().zip(&noisy).map(|(a, b)| (b.gyro.0 - a.gyro.0).norm_squared()).sum();
        let sigma = (squares / (3 * walk.len()) as f32).sqrt();
        // 200 Hz: 2.443e-4 * sqrt(100); the sample deviation of 6003 values is within 3 % at four sigma.
        assert!((sigma / 2.443e-3 - 1.0).abs() < 0.04, "{sigma}");
    }
}
