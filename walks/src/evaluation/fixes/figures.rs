//! Figures of errors, and how a method is run.

use crate::evaluation::building::suite::Errors;
use crate::evaluation::phone::path::{Path, rms};
use crate::fixes::{Method, Observation};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// A distribution of errors with its root mean square.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Figures {
    /// Root mean square. **Units:** m.
    pub rmse_m: f64,
    /// 75th and 95th percentile, worst.
    #[serde(flatten)]
    pub errors: Errors,
}

impl Figures {
    /// Of these.
    pub fn of(errors: Vec<f64>) -> Self {
        Self { rmse_m: rms(&errors).unwrap_or_default(), errors: Errors::of(errors) }
    }
}

/// A mean of normalised squares (1 when all is as it is said), and where 95 % of such means lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Bounds {
    /// The mean.
    pub mean: f64,
    /// Where it should not be below.
    pub low: f64,
    /// And not above.
    pub high: f64,
}

impl Bounds {
    /// Of values of two degrees of freedom each, of which so many are independent of each other.
    ///
    /// # Source
    /// Wilson and Hilferty, "The distribution of chi-square", PNAS 17 (1931): a cube root that is all but normal.
    pub fn of(values: &[f64], independent: usize) -> Self {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let part = 2.0 / (9.0 * 2.0 * independent.max(1) as f64);
        let at = |sigmas: f64| (1.0 - part + sigmas * part.sqrt()).powi(3);
        Self { mean, low: at(-1.96), high: at(1.96) }
    }

    /// Whether it is where it should be.
    pub fn holds(&self) -> bool {
        (self.low..=self.high).contains(&self.mean)
    }
}

/// The path as a method says it at the time; steps and observations in the order of their times.
pub fn live<M: Method + ?Sized>(method: &mut M, steps: &[Step], observations: &[Observation]) -> Path {
    let mut path = Path::default();
    let note = |method: &M, path: &mut Path, time: Micros| {
        if let Some(estimate) = method.estimate() {
            path.note(time, estimate.place);
        }
    };
    if let Some(first) = steps.first() {
        note(method, &mut path, Micros(first.stance_start.0 - 1));
    }
    let mut waiting = observations.iter().peekable();
    for step in steps {
        while let Some(observation) = waiting.next_if(|observation| observation.time < step.stance_end) {
            method.observe(observation);
            note(method, &mut path, observation.time);
        }
        method.step(step);
        note(method, &mut path, step.stance_end);
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_the_table_of_chi_square() {
        // Twenty degrees of freedom: 9.59 and 34.17.
        let bounds = Bounds::of(&[1.0; 10], 10);
        assert!((bounds.low - 0.4795).abs() < 0.005 && (bounds.high - 1.7085).abs() < 0.005, "{bounds:?}");
        assert!(bounds.holds() && !Bounds::of(&[2.0], 10).holds());
    }
}
