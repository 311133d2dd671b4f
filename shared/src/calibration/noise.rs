//! How noisy a sensor at rest is, on a short and on a long scale.
//!
//! White noise of density `n` leaves a standard deviation of `n / sqrt(2 t)` in means over the time `t` (one-sided
//! density, as data sheets give it). So the spread of the short means inside a rest tells the density, and the differences
//! of the means of two neighbouring rests tell it again for a time fifty times as long (the Allan deviation, IEEE Std
//! 952-1997, annex C): if the second is much larger, something drifts or the table shakes.

use crate::rest::Rest;
use crate::time::Micros;
use nalgebra::Vector3;

/// A noise density of each die. **Units:** m/s²/sqrt(Hz), rad/s/sqrt(Hz).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Density {
    /// Of the accelerometer.
    pub accel: f32,
    /// Of the gyroscope.
    pub gyro: f32,
}

/// Sums over all rests.
#[derive(Clone, Debug, Default)]
pub struct Noise {
    rests: u32,
    /// Sums of squared densities of three axes, short and long.
    short: [f32; 2],
    long: [f32; 2],
    pairs: u32,
    last: Option<(Micros, Rest)>,
}

/// Means of neighbouring rests that differ by more were not of the same rest. **Units:** m/s², rad/s.
const SAME_REST: [f32; 2] = [0.1, 0.5 * core::f32::consts::PI / 180.0];
/// Fewest rests, and pairs of rests, to tell a density from: 8 pairs of three axes tell it to 14 %.
const FEWEST: u32 = 8;

impl Noise {
    /// Takes in a rest that ends at `time` and was judged by increments of `period`. **Units:** s.
    pub fn push(&mut self, time: Micros, rest: &Rest, period: f32) {
        let square = |sigma: f32| sigma * sigma * 2.0 * period;
        let short = [square(rest.accel_sigma), square(rest.gyro_sigma)];
        if !short.iter().all(|value| value.is_finite()) {
            return;
        }
        self.rests = self.rests.saturating_add(1);
        self.short = [self.short[0] + short[0], self.short[1] + short[1]];
        if let Some((before, last)) = self.last.replace((time, *rest)) {
            let apart = time.since(before);
            let [accel, gyro] = [rest.accel - last.accel, rest.gyro - last.gyro];
            if (0.0..2.0 * LONGEST_S).contains(&apart) && accel.amax() < SAME_REST[0] && gyro.amax() < SAME_REST[1] {
                // Rests follow each other without a gap, so one is as long as they are apart; half the mean square of
                // the difference is the variance.
                self.long[0] += squared(&accel) * apart;
                self.long[1] += squared(&gyro) * apart;
                self.pairs = self.pairs.saturating_add(1);
            }
        }
    }

    /// Density by the means over one increment; `None` until enough was seen.
    pub fn short(&self) -> Option<Density> {
        density(self.short, self.rests)
    }

    /// Density by the means over a rest; `None` until enough was seen.
    pub fn long(&self) -> Option<Density> {
        density(self.long, self.pairs)
    }
}

/// Rests are half a second long. **Units:** s.
const LONGEST_S: f32 = 0.5;

fn squared(vector: &Vector3<f32>) -> f32 {
    vector.norm_squared()
}

fn density([accel, gyro]: [f32; 2], count: u32) -> Option<Density> {
    let axis = |sum: f32| libm::sqrtf(sum / (3.0 * count as f32));
    (count >= FEWEST).then(|| Density { accel: axis(accel), gyro: axis(gyro) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rest::{Parameters, RestDetector};

    /// Even noise of standard deviation 1, the same on every machine.
    fn noise(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 40) as f32 / 16_777_216.0 - 0.5) * libm::sqrtf(12.0)
    }

    fn measured(accel: f32, gyro: f32, drift: f32) -> Noise {
        let mut detector = RestDetector::new(&Parameters::default());
        let mut noise_sums = Noise::default();
        let mut state = 1;
        // Means over 10 ms: the density times sqrt(1 / (2 * 0.01)).
        let factor = libm::sqrtf(50.0);
        for i in 0..3_000_i32 {
            let time = Micros(i64::from(i) * 10_000);
            let mut draw = |density: f32| Vector3::from_fn(|_, _| density * factor * noise(&mut state));
            let (force, rate) = (Vector3::z() * 9.81 + draw(accel), draw(gyro));
            let slow = libm::sinf(i as f32 * 0.03) * drift;
            if let Some(rest) = detector.push(time, &force, &rate.add_scalar(slow), 1.0) {
                noise_sums.push(time, &rest, 0.01);
            }
        }
        noise_sums
    }

    #[test]
    fn white_noise_is_found_on_both_scales() {
        let noise = measured(1.5e-3, 2.5e-4, 0.0);
        let (short, long) = (noise.short().unwrap(), noise.long().unwrap());
        // 58 rests of 50 means; 57 pairs of three axes, which share their rests: 1 % and 9 % (one standard error).
        for (density, truth) in [(short.accel, 1.5e-3), (short.gyro, 2.5e-4)] {
            assert!((density / truth - 1.0).abs() < 0.04, "{density} {truth}");
        }
        for (density, truth) in [(long.accel, 1.5e-3), (long.gyro, 2.5e-4)] {
            assert!((density / truth - 1.0).abs() < 0.25, "{density} {truth}");
        }
    }

    #[test]
    fn a_drift_shows_on_the_long_scale_only() {
        let noise = measured(1.5e-3, 2.5e-4, 1e-3);
        assert!(noise.short().unwrap().gyro < 1.2 * 2.5e-4);
        assert!(noise.long().unwrap().gyro > 2.0 * 2.5e-4);
    }

    #[test]
    fn little_is_not_judged() {
        assert_eq!(Noise::default().short(), None);
        assert_eq!(Noise::default().long(), None);
    }
}
