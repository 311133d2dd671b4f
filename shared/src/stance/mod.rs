//! When does the foot stand? Detectors that tell it from the samples alone, behind one trait.
//!
//! * [`documented`]: the document's own (Foot, 4.5), thresholds on the raw values and a time of rest.
//! * [`shoe`], [`ared`], [`amv`], [`mag`]: a statistic of a short sliding window below a threshold (Skog, Händel, Nilsson,
//!   Rantakokko: "Zero-velocity detection - an algorithm evaluation", IEEE Trans. Biomed. Eng. 57(11), 2010). All four are
//!   likelihood ratio tests for a standing foot that differ in what they look at.
//!
//! * [`adaptive`]: the project's own, for every pace with one setting.
//!
//! All use [`window::Window`], whose length is a time, and judge a sample from itself and earlier ones only.

use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;

pub mod adaptive;
pub mod amv;
pub mod ared;
pub mod documented;
pub mod mag;
pub mod shoe;
pub mod window;

/// What a detector says of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Whether the foot stands.
    pub stance: bool,
    /// What was compared with the threshold; infinite while too little has been seen. **Units:** the detector's own.
    pub statistic: f32,
    /// How far from zero the velocity of this standing foot may be (standard deviation), when the detector can tell;
    /// otherwise the filter's own value holds. **Units:** m/s.
    pub velocity_sigma: Option<f32>,
}

impl Verdict {
    /// A verdict by a threshold: standing where the statistic lies below it. A statistic that is not a number does not.
    fn below(statistic: f32, threshold: f32) -> Self {
        Self { stance: statistic < threshold, statistic, velocity_sigma: None }
    }

    /// The verdict while too little has been seen: not standing.
    fn unknown() -> Self {
        Self { stance: false, statistic: f32::INFINITY, velocity_sigma: None }
    }
}

/// Tells from one sample after the other whether the foot stands.
pub trait StanceDetector {
    /// Judges the moment of the newest sample. **Units:** `gravity` is the magnitude measured at rest, m/s².
    ///
    /// Samples come in the order of their times. After a gap a detector starts anew by itself. Never panics; values that
    /// are not finite are never a stance.
    fn push(&mut self, time: Micros, accel: AccelCorrected, gyro: GyroCorrected, gravity: f32) -> Verdict;

    /// Forgets everything seen.
    fn reset(&mut self);
}

/// Room for the window of the detectors by statistic: 0.128 s at 2 kHz.
const CAPACITY: usize = 256;
/// Fewest samples a variance is taken from.
const MINIMUM: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::boxed::Box;
    use std::vec::Vec;

    fn all() -> [(&'static str, Box<dyn StanceDetector>); 6] {
        [
            ("adaptive", Box::new(adaptive::FromSamples::new(&adaptive::Parameters::default()))),
            ("documented", Box::new(documented::Documented::new(&documented::Parameters::default()))),
            ("shoe", Box::new(shoe::Shoe::new(&shoe::Parameters::default()))),
            ("ared", Box::new(ared::Ared::new(&ared::Parameters::default()))),
            ("amv", Box::new(amv::Amv::new(&amv::Parameters::default()))),
            ("mag", Box::new(mag::Mag::new(&mag::Parameters::default()))),
        ]
    }

    /// A foot seen at `t` seconds: strides of 1.2 s, of which 0.5 s standing still, the rest a swing about y.
    fn foot(t: f32) -> ([f32; 3], [f32; 3]) {
        let phase = t - 1.2 * libm::floorf(t / 1.2);
        if phase < 0.5 {
            return ([0.0, 0.0, 9.81], [0.0; 3]);
        }
        let (sin, cos) = libm::sincosf(core::f32::consts::TAU * (phase - 0.5) / 0.7);
        ([8.0 * sin + 3.0, 2.0 * cos, 9.81 + 8.0 * cos], [0.5 * sin, 6.0 * cos + 1.0, 0.3 * cos])
    }

    fn verdicts(detector: &mut dyn StanceDetector, rate: i64, seconds: i64) -> Vec<(f32, Verdict)> {
        (0..rate * seconds)
            .map(|i| {
                let time = Micros(i * 1_000_000 / rate);
                let (accel, gyro) = foot(time.as_seconds() as f32);
                let verdict = detector.push(time, AccelCorrected(accel.into()), GyroCorrected(gyro.into()), 9.81);
                (time.as_seconds() as f32, verdict)
            })
            .collect()
    }

    #[test]
    fn each_finds_each_stance_once_at_every_rate() {
        for rate in [50, 100, 200, 820, 2_000] {
            for (name, mut detector) in all() {
                let verdicts = verdicts(detector.as_mut(), rate, 12);
                let begins = verdicts.windows(2).filter(|pair| !pair[0].1.stance && pair[1].1.stance).count();
                assert_eq!(begins, 10, "{name} at {rate} Hz");
                for (t, verdict) in verdicts {
                    let phase = t - 1.2 * libm::floorf(t / 1.2);
                    // From 0.25 s into the rest, which the slowest of them needs at 50 Hz, all must see it.
                    if (0.25..0.48).contains(&phase) {
                        assert!(verdict.stance, "{name} at {rate} Hz, {phase} s into the stride");
                    }
                    // Once the newest sample of the swing has filled the window, none may.
                    if phase > 0.58 {
                        assert!(!verdict.stance, "{name} at {rate} Hz, {phase} s into the stride");
                    }
                }
            }
        }
    }

    #[test]
    fn a_reset_forgets() {
        for (name, mut detector) in all() {
            let first = verdicts(detector.as_mut(), 200, 3);
            detector.reset();
            assert_eq!(first, verdicts(detector.as_mut(), 200, 3), "{name}");
        }
    }

    #[test]
    fn values_that_are_not_finite_are_no_stance() {
        for (name, mut detector) in all() {
            verdicts(detector.as_mut(), 200, 1);
            for bad in [f32::NAN, f32::INFINITY] {
                let accel = AccelCorrected([0.0, 0.0, bad].into());
                let gyro = GyroCorrected([bad, 0.0, 0.0].into());
                assert!(!detector.push(Micros(1_005_000), accel, gyro, 9.81).stance, "{name}");
            }
        }
    }

    #[test]
    fn a_gap_is_no_stance() {
        for (name, mut detector) in all() {
            verdicts(detector.as_mut(), 200, 1);
            let (accel, gyro) = foot(0.0);
            let verdict =
                detector.push(Micros(9_000_000), AccelCorrected(accel.into()), GyroCorrected(gyro.into()), 9.81);
            assert!(!verdict.stance, "{name}");
        }
    }

    proptest! {
        #[test]
        fn no_input_panics(samples in proptest::collection::vec((any::<i64>(), any::<[u32; 7]>()), 1..60)) {
            for (_, mut detector) in all() {
                for (time, bits) in &samples {
                    let [a, b, c, d, e, f, gravity] = bits.map(f32::from_bits);
                    detector.push(Micros(*time), AccelCorrected([a, b, c].into()), GyroCorrected([d, e, f].into()), gravity);
                }
            }
        }
    }
}
