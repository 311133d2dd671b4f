//! Finds the steps in the vertical acceleration.

/// Settings of [`StepDetector`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// Cut-off of the low-pass. **Units:** Hz.
    pub cut_off_hz: f64,
    /// Least time between two steps (Graph, 4.1.1). **Units:** s.
    pub shortest_s: f64,
    /// Least rise from a trough to the peak of a step. **Units:** m/s².
    pub least_rise: f64,
    /// And least part of the usual rise: the threshold follows the gait (the moving average of Graph, 4.1.1).
    pub part_of_usual: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { cut_off_hz: 3.0, shortest_s: 0.3, least_rise: 1.0, part_of_usual: 0.35 }
    }
}

/// A step that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// When the acceleration was largest. **Units:** s.
    pub time: f64,
    /// From the trough before to the peak. **Units:** m/s².
    pub rise: f64,
}

/// Finds steps as they come: a peak is told as soon as the acceleration has fallen half-way again.
#[derive(Clone, Debug)]
pub struct StepDetector {
    parameters: Parameters,
    /// The two stages of the low-pass.
    smooth: Option<[f64; 2]>,
    /// Lowest value since the last peak was told.
    trough: f64,
    /// Highest value since that, and when.
    peak: Option<(f64, f64)>,
    usual: f64,
    last: Option<f64>,
}

impl StepDetector {
    /// Nothing has come yet.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, smooth: None, trough: f64::INFINITY, peak: None, usual: 0.0, last: None }
    }

    /// Takes in the vertical acceleration at `time`, `dt` seconds after the last; tells of a step. **Units:** m/s², s.
    pub fn push(&mut self, vertical: f64, time: f64, dt: f64) -> Option<Found> {
        let part = 1.0 - (-std::f64::consts::TAU * self.parameters.cut_off_hz * dt).exp();
        let [first, second] = self.smooth.unwrap_or([vertical; 2]);
        let first = first + part * (vertical - first);
        let value = second + part * (first - second);
        self.smooth = Some([first, value]);
        self.look(value, time)
    }

    fn look(&mut self, value: f64, time: f64) -> Option<Found> {
        let p = self.parameters;
        match self.peak {
            Some((highest, _)) if value < highest => {}
            _ if value > self.trough => self.peak = Some((value, time)),
            _ => {}
        }
        if value < self.trough {
            self.trough = value;
            // What rose before it was no step, or it would have been told.
            self.peak = None;
        }
        let (highest, at) = self.peak?;
        let rise = highest - self.trough;
        let enough = rise >= p.least_rise.max(p.part_of_usual * self.usual);
        let fallen = value < highest - 0.5 * rise;
        if !(enough && fallen) {
            return None;
        }
        (self.trough, self.peak) = (value, None);
        if self.last.is_some_and(|last| at - last < p.shortest_s) {
            return None;
        }
        self.last = Some(at);
        self.usual = if self.usual == 0.0 { rise } else { self.usual + 0.15 * (rise - self.usual) };
        Some(Found { time: at, rise })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn steps(acceleration: impl Fn(f64) -> f64, seconds: f64) -> Vec<f64> {
        let mut detector = StepDetector::new(&Parameters::default());
        (0..(seconds * 100.0) as i32)
            .filter_map(|i| detector.push(acceleration(f64::from(i) / 100.0), f64::from(i) / 100.0, 0.01))
            .map(|found| found.time)
            .collect()
    }

    #[test]
    fn every_step_is_found_once_whatever_the_gait() {
        for (frequency, size) in [(1.2, 1.5), (1.8, 3.0), (2.5, 8.0)] {
            let found =
                steps(|t| size * (TAU * frequency * t).sin() + 0.4 * size * (2.0 * TAU * frequency * t).sin(), 20.0);
            let expected = 20.0 * frequency;
            assert!((found.len() as f64 - expected).abs() <= 1.0, "{frequency} Hz: {}", found.len());
            assert!(found.windows(2).all(|pair| (pair[1] - pair[0] - 1.0 / frequency).abs() < 0.03));
        }
    }

    #[test]
    fn standing_has_no_steps() {
        assert_eq!(steps(|t| 0.3 * (TAU * 7.0 * t).sin() + 0.2 * (TAU * 0.4 * t).sin(), 20.0).len(), 0);
    }
}
