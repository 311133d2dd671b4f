//! The document's discrete Kalman filter.
//!
//! # Source
//! Fix, 2.1.1 and 3.1. The prediction has no noise of its own (2.3): what a step is wrong by is in the variances of
//! `dx` and `dy`, which each step sets anew.

use super::aligner::Aligner;
use super::beginning::Waiting;
use super::method::{Estimate, Method, Start};
use super::observation::Observation;
use super::parameters::Documented;
use nalgebra::{Matrix4, Vector4};
use sohle_shared::step::Step;

/// The filter: `(x, y, dx, dy)`.
#[derive(Clone, Debug)]
pub struct Kalman {
    parameters: Documented,
    aligner: Aligner,
    state: Option<(Vector4<f64>, Matrix4<f64>)>,
}

impl Kalman {
    /// Begins. A start direction is believed; without one it is estimated from the first positions.
    pub fn new(parameters: &Documented, start: &Start) -> Self {
        let variance = parameters.step_sigma_m.powi(2);
        let at = |([x, y], sigma): ([f64; 2], f64)| {
            let covariance = Vector4::new(sigma * sigma, sigma * sigma, variance, variance);
            (Vector4::new(x, y, 0.0, 0.0), Matrix4::from_diagonal(&covariance))
        };
        Self { parameters: *parameters, aligner: Aligner::new(parameters, start), state: start.place.map(at) }
    }

    /// (3.1 - 3.5) with the displacement of this step.
    fn predict(&mut self, [dx, dy]: [f64; 2]) {
        let variance = self.parameters.step_sigma_m.powi(2);
        let Some((state, covariance)) = &mut self.state else { return };
        let before = Vector4::new(state.x, state.y, dx, dy);
        let mut variances = Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, variance, variance));
        variances.fixed_view_mut::<2, 2>(0, 0).copy_from(&covariance.fixed_view::<2, 2>(0, 0));
        let transition = transition();
        *state = transition * before;
        *covariance = transition * variances * transition.transpose();
    }

    /// (3.6, 3.7, 2.6 - 2.10): position and displacement, both at their weight.
    fn update(&mut self, [x, y]: [f64; 2]) {
        let p = &self.parameters;
        let (fix, step) = (p.fix_sigma_m.powi(2), p.step_sigma_m.powi(2));
        let noise = Matrix4::from_diagonal(&Vector4::new(fix, fix, step, step));
        let Some((state, covariance)) = &mut self.state else {
            self.state = Some((Vector4::new(x, y, 0.0, 0.0), noise));
            return;
        };
        let innovation = Vector4::new(x, y, state.z, state.w) - *state;
        let Some(inverse) = (noise + *covariance).try_inverse() else { return };
        let gain = *covariance * inverse;
        *state += gain * innovation;
        *covariance = (Matrix4::identity() - gain) * *covariance;
    }

    fn take(&mut self, next: Waiting) {
        match (next, self.aligner.phi0()) {
            (Waiting::Step(polar), Some(phi0)) => self.predict(polar.along(phi0)),
            (Waiting::Fix(place), _) => self.update(place),
            (Waiting::Step(_), None) => {}
        }
    }
}

/// `T` of (3.4).
fn transition() -> Matrix4<f64> {
    Matrix4::new(1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
}

impl Method for Kalman {
    fn step(&mut self, step: &Step) {
        self.aligner.step(step).into_iter().for_each(|next| self.take(next));
    }

    fn observe(&mut self, observation: &Observation) {
        self.aligner.observe(observation).into_iter().for_each(|next| self.take(next));
    }

    fn estimate(&self) -> Option<Estimate> {
        let of =
            |(state, p): (Vector4<f64>, Matrix4<f64>)| ([state.x, state.y], p.fixed_view::<2, 2>(0, 0).into_owned());
        self.aligner.estimate(self.state.map(of))
    }
}

#[cfg(test)]
mod tests {
    use super::super::polar::{Polars, tests::step};
    use super::*;
    use nalgebra::{SMatrix, SVector};

    const STEPS: usize = 60;
    const UNKNOWN: usize = STEPS + 1;

    /// The same as one dense adjustment: the start, and for each step its displacement, are unknown; positions are sums of
    /// them. No recursion, no gain.
    fn dense(
        steps: &[[f64; 2]],
        fixes: &[(usize, [f64; 2])],
        (start, start_sigma): ([f64; 2], f64),
    ) -> ([f64; 2], f64) {
        let p = Documented::default();
        type Row = SVector<f64, UNKNOWN>;
        let mut rows: Vec<(Row, [f64; 2], f64)> = Vec::new();
        let unit = |index: usize| Row::from_fn(|row, _| f64::from(row == index));
        rows.push((unit(0), start, start_sigma));
        for (index, &step) in steps.iter().enumerate() {
            rows.push((unit(index + 1), step, p.step_sigma_m));
        }
        for &(after, place) in fixes {
            if after > 0 {
                // (3.6): with each position the displacement is measured again, at what it is predicted.
                rows.push((unit(after), steps[after - 1], p.step_sigma_m));
            }
            rows.push((Row::from_fn(|row, _| f64::from(row <= after)), place, p.fix_sigma_m));
        }
        let mut normal = SMatrix::<f64, UNKNOWN, UNKNOWN>::zeros();
        // Steps that have not come must not make it singular.
        (steps.len() + 1..UNKNOWN).for_each(|unused| normal[(unused, unused)] = 1.0);
        let mut right = SMatrix::<f64, UNKNOWN, 2>::zeros();
        for (row, value, sigma) in &rows {
            normal += row * row.transpose() / (sigma * sigma);
            right += row * nalgebra::RowVector2::from(*value) / (sigma * sigma);
        }
        let inverse = normal.lu().try_inverse().unwrap();
        let sum = Row::from_fn(|row, _| f64::from(row <= steps.len()));
        let place = sum.transpose() * inverse * right;
        ([place[(0, 0)], place[(0, 1)]], (sum.transpose() * inverse * sum)[(0, 0)])
    }

    #[test]
    fn it_agrees_with_a_dense_adjustment() {
        let start = Start { place: Some(([3.0, -2.0], 0.5)), direction: Some((3.5, 0.0)) };
        let mut filter = Kalman::new(&Documented::default(), &start);
        let (mut steps, mut fixes, mut polars) = (Vec::new(), Vec::new(), Polars::default());
        for index in 0..STEPS as u32 {
            let next = step(index, f64::from(index), 0.7, 0.3 * f64::from(index).sin());
            steps.push(polars.next(&next).unwrap().along(3.5));
            filter.step(&next);
            if index % 7 == 6 {
                let place = [f64::from(index) * 0.3, 5.0 - f64::from(index) * 0.1];
                fixes.push((steps.len(), place));
                filter.observe(&Observation::position(next.stance_end, place, 1.0));
                let (place, variance) = dense(&steps, &fixes, start.place.unwrap());
                let found = filter.estimate().unwrap();
                assert!((found.place[0] - place[0]).abs() < 1e-9 && (found.place[1] - place[1]).abs() < 1e-9);
                assert!((found.covariance[(0, 0)] - variance).abs() < 1e-9 && found.covariance[(0, 1)].abs() < 1e-12);
            }
        }
        assert_eq!(fixes.len(), 8);
    }
}
