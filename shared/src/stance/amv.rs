//! AMV, the acceleration moving variance detector: the acceleration does not change.
//!
//! It needs neither gyroscope nor gravity, but takes a foot that moves evenly for a standing one.
//!
//! # Source
//! Skog et al. 2010 (see [`super`]): `T = 1/W sum(|a_k - mean(a)|²)`, here without the division by the noise.

use super::window::Window;
use super::{CAPACITY, MINIMUM, StanceDetector, Verdict};
use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;

/// Settings of [`Amv`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Length of the window. **Units:** s.
    pub window_s: f32,
    /// The foot stands below this standard deviation of the acceleration. **Units:** m/s².
    pub threshold: f32,
}

impl Default for Parameters {
    /// The stillest moment of every surveyed stance at walking pace lies below this threshold; in a run it does not.
    fn default() -> Self {
        Self { window_s: 0.06, threshold: 0.4 }
    }
}

/// The detector; its statistic is the variance of the acceleration, summed over the axes. **Units:** (m/s²)².
#[derive(Clone, Debug)]
pub struct Amv {
    parameters: Parameters,
    window: Window<3, CAPACITY>,
}

impl Amv {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, window: Window::over(parameters.window_s, MINIMUM) }
    }
}

impl StanceDetector for Amv {
    fn push(&mut self, time: Micros, accel: AccelCorrected, _gyro: GyroCorrected, _gravity: f32) -> Verdict {
        self.window.push(time, accel.0.into());
        if !self.window.is_complete() {
            return Verdict::unknown();
        }
        Verdict::below(self.window.variance().iter().sum(), self.parameters.threshold * self.parameters.threshold)
    }

    fn reset(&mut self) {
        self.window.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_changes_count_not_the_size() {
        let mut detector = Amv::new(&Parameters::default());
        let gyro = GyroCorrected([0.0; 3].into());
        let mut verdict = Verdict::unknown();
        for i in 0..20 {
            verdict = detector.push(Micros(i * 5_000), AccelCorrected([30.0, -20.0, 9.81].into()), gyro, 9.81);
        }
        assert!(verdict.stance && verdict.statistic == 0.0);
        verdict = detector.push(Micros(100_000), AccelCorrected([34.0, -20.0, 9.81].into()), gyro, 9.81);
        // One of the 12 samples in 60 ms is off by 4: 16 (1/12 - 1/144).
        assert!((verdict.statistic - 16.0 * 11.0 / 144.0).abs() < 1e-4 && !verdict.stance);
    }
}
