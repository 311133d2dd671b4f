//! What all methods take and tell.

use super::observation::Observation;
use nalgebra::Matrix2;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// Where the person is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Of when.
    pub time: Micros,
    /// **Units:** m; **Frame:** building.
    pub place: [f64; 2],
    /// Covariance of the place. **Units:** m².
    pub covariance: Matrix2<f64>,
}

impl Estimate {
    /// A place that is known from a position alone.
    pub(super) fn of_fix(time: Micros, place: [f64; 2], sigma_m: f64) -> Self {
        Self { time, place, covariance: Matrix2::identity() * (sigma_m * sigma_m) }
    }

    /// Standard deviation: root of the sum over the axes. **Units:** m.
    pub fn sigma_m(&self) -> f64 {
        self.covariance.trace().max(0.0).sqrt()
    }
}

/// What is known of the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Start {
    /// Where the first step begins, and the standard deviation of each coordinate. **Units:** m; **Frame:** building.
    pub place: Option<([f64; 2], f64)>,
    /// Direction of the heading frame of the first step (`Phi0` of Fix, 3.2), and its standard deviation. **Units:** rad.
    pub direction: Option<(f64, f64)>,
}

/// A way to put steps and positions together.
pub trait Method {
    /// Takes in a step. Steps come in order; one that is no number counts as none.
    fn step(&mut self, step: &Step);

    /// Takes in a position or a range; it belongs to its own time, as far as the method can go back.
    fn observe(&mut self, observation: &Observation);

    /// What is known after all that was taken in; nothing before there was a place.
    fn estimate(&self) -> Option<Estimate>;
}
