//! The extended Kalman filter, which the document names and leaves empty: start direction and step scale are estimated.
//!
//! # Source
//! Fix, 2.1.2 (2.11 - 2.15), with the motion of (3.2, 3.3) times a step scale `s`:
//! `f(x, w) = (x + s L cos(phi + R), y + s L sin(phi + R), phi, s) + C w`, where `w` is what the step is wrong by along and
//! across its direction.

use super::aligner::Aligner;
use super::beginning::Waiting;
use super::method::{Estimate, Method, Start};
use super::observation::Observation;
use super::parameters::Documented;
use super::polar::Polar;
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};
use sohle_shared::step::Step;

/// The filter: `(x, y, phi, s)`.
#[derive(Clone, Debug)]
pub struct Extended {
    parameters: Documented,
    aligner: Aligner,
    /// How well the start direction is known, as it was given or found (standard deviation). **Units:** rad.
    direction_sigma: f64,
    start: Option<([f64; 2], f64)>,
    state: Option<(Vector4<f64>, Matrix4<f64>)>,
}

impl Extended {
    /// Begins. Without a start direction it is estimated from the first positions, and then better with each.
    pub fn new(parameters: &Documented, start: &Start) -> Self {
        let mut filter = Self {
            parameters: *parameters,
            aligner: Aligner::new(parameters, start),
            direction_sigma: start.direction.map_or(parameters.direction_sigma, |(_, sigma)| sigma),
            start: start.place,
            state: None,
        };
        filter.begin();
        filter
    }

    /// The state at the start, as soon as place and direction are known.
    fn begin(&mut self) {
        if let (None, Some(phi), Some((place, sigma))) = (self.state, self.aligner.phi0(), self.start) {
            let sigmas = Vector4::new(sigma, sigma, self.direction_sigma, self.parameters.scale_sigma);
            let covariance = Matrix4::from_diagonal(&sigmas.component_mul(&sigmas));
            self.state = Some((Vector4::new(place[0], place[1], phi, 1.0), covariance));
        }
    }

    /// (2.11, 2.13, 2.14).
    fn predict(&mut self, polar: Polar) {
        let noise = Matrix2::identity() * self.parameters.step_sigma_m.powi(2);
        let Some((state, covariance)) = &mut self.state else { return };
        let (after, transition, disturbance) = motion(state, polar);
        *state = after;
        *covariance = transition * *covariance * transition.transpose() + disturbance * noise * disturbance.transpose();
    }

    /// (2.6 - 2.10) with (2.15): positions see x and y.
    fn update(&mut self, place: [f64; 2]) {
        let sigma = self.parameters.fix_sigma_m;
        let Some((state, covariance)) = &mut self.state else {
            self.start = Some((place, sigma));
            return self.begin();
        };
        let design = Matrix2x4::identity();
        let innovation = Vector2::from(place) - design * *state;
        let spread = design * *covariance * design.transpose() + Matrix2::identity() * (sigma * sigma);
        let Some(inverse) = spread.try_inverse() else { return };
        let gain = *covariance * design.transpose() * inverse;
        *state += gain * innovation;
        let left = (Matrix4::identity() - gain * design) * *covariance;
        // What rounding leaves asymmetric would grow.
        *covariance = (left + left.transpose()) * 0.5;
    }

    fn take(&mut self, next: Waiting) {
        self.begin();
        match next {
            Waiting::Step(polar) => self.predict(polar),
            Waiting::Fix(place) => self.update(place),
        }
    }

    /// The start direction and the step scale, with their standard deviations. **Units:** rad; 1.
    pub fn calibration(&self) -> Option<[(f64, f64); 2]> {
        let (state, covariance) = self.state.as_ref()?;
        Some([2, 3].map(|i| (state[i], covariance[(i, i)].max(0.0).sqrt())))
    }
}

/// `f`, `T` and `C` of a step.
fn motion(state: &Vector4<f64>, polar: Polar) -> (Vector4<f64>, Matrix4<f64>, nalgebra::Matrix4x2<f64>) {
    let [dx, dy] = polar.along(state.z);
    let scale = state.w;
    let after = state + Vector4::new(scale * dx, scale * dy, 0.0, 0.0);
    let mut transition = Matrix4::identity();
    transition[(0, 2)] = -scale * dy;
    transition[(1, 2)] = scale * dx;
    transition[(0, 3)] = dx;
    transition[(1, 3)] = dy;
    let (sin, cos) = (state.z + polar.direction).sin_cos();
    let disturbance = nalgebra::Matrix4x2::new(cos, -sin, sin, cos, 0.0, 0.0, 0.0, 0.0);
    (after, transition, disturbance)
}

impl Method for Extended {
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

    const STEPS: usize = 50;
    const UNKNOWN: usize = 4 + 2 * STEPS;

    /// The same as one dense adjustment: the start state and what each step is wrong by are unknown; linearised where the
    /// filter was, every later state is an affine function of them.
    struct Dense {
        /// The last state: constant part and coefficients.
        constant: Vector4<f64>,
        coefficients: SMatrix<f64, 4, UNKNOWN>,
        normal: SMatrix<f64, UNKNOWN, UNKNOWN>,
        right: SVector<f64, UNKNOWN>,
        used: usize,
    }

    impl Dense {
        fn new(start: &Vector4<f64>, sigmas: &Vector4<f64>) -> Self {
            let mut dense = Self {
                constant: Vector4::zeros(),
                coefficients: SMatrix::identity(),
                // What no step has used yet must not make it singular.
                normal: SMatrix::identity(),
                right: SVector::zeros(),
                used: 4,
            };
            for i in 0..4 {
                dense.normal[(i, i)] = sigmas[i].powi(-2);
                dense.right[i] = start[i] * sigmas[i].powi(-2);
            }
            dense
        }

        fn step(&mut self, at: &Vector4<f64>, polar: Polar, sigma: f64) {
            let (after, transition, disturbance) = motion(at, polar);
            self.constant = after + transition * (self.constant - at);
            self.coefficients = transition * self.coefficients;
            for i in 0..2 {
                self.coefficients.column_mut(self.used + i).copy_from(&disturbance.column(i));
                self.normal[(self.used + i, self.used + i)] = sigma.powi(-2);
            }
            self.used += 2;
        }

        fn fix(&mut self, place: [f64; 2], sigma: f64) {
            let rows = self.coefficients.fixed_rows::<2>(0).into_owned();
            let said = Vector2::from(place) - self.constant.xy();
            self.normal += rows.transpose() * rows / (sigma * sigma);
            self.right += rows.transpose() * said / (sigma * sigma);
        }

        fn solve(&self) -> (Vector4<f64>, Matrix4<f64>) {
            let inverse = self.normal.lu().try_inverse().unwrap();
            let state = self.constant + self.coefficients * (inverse * self.right);
            (state, self.coefficients * inverse * self.coefficients.transpose())
        }
    }

    #[test]
    fn it_agrees_with_a_dense_adjustment() {
        let p = Documented::default();
        let start = Start { place: Some(([3.0, -2.0], 0.5)), direction: Some((3.5, 0.4)) };
        let mut filter = Extended::new(&p, &start);
        let sigmas = Vector4::new(0.5, 0.5, 0.4, p.scale_sigma);
        let mut dense = Dense::new(&Vector4::new(3.0, -2.0, 3.5, 1.0), &sigmas);
        let mut polars = Polars::default();
        let mut truth = [3.0, -2.0];
        for index in 0..STEPS as u32 {
            let next = step(index, f64::from(index), 0.7, 0.3 * f64::from(index).sin());
            let polar = polars.next(&next).unwrap();
            dense.step(&filter.state.unwrap().0, polar, p.step_sigma_m);
            filter.step(&next);
            let [dx, dy] = polar.along(3.9);
            truth = [truth[0] + 1.1 * dx, truth[1] + 1.1 * dy];
            if index % 6 == 5 {
                dense.fix(truth, p.fix_sigma_m);
                filter.observe(&Observation::position(next.stance_end, truth, 1.0));
                let (state, covariance) = dense.solve();
                let (found, p) = filter.state.unwrap();
                assert!((found - state).amax() < 1e-9, "{found} {state}");
                assert!((p - covariance).amax() < 1e-9, "{p}");
            }
        }
    }

    #[test]
    fn direction_and_scale_are_found_from_exact_positions() {
        let exact = Documented { fix_sigma_m: 0.1, step_sigma_m: 0.02, ..Documented::default() };
        let mut filter = Extended::new(&exact, &Start::default());
        let (mut polars, mut place) = (Polars::default(), [20.0, 10.0]);
        for index in 0..200_u32 {
            let next = step(index, f64::from(index), 0.7, if index % 40 == 39 { 1.5 } else { 0.0 });
            let [dx, dy] = polars.next(&next).unwrap().along(-2.0);
            place = [place[0] + 1.07 * dx, place[1] + 1.07 * dy];
            filter.step(&next);
            if index % 5 == 0 {
                filter.observe(&Observation::position(next.stance_end, place, 1.0));
            }
        }
        let [(phi, _), (scale, sigma)] = filter.calibration().unwrap();
        assert!((phi + 2.0).abs() < 0.01 && (scale - 1.07).abs() < 0.005 && sigma < 0.01, "{phi} {scale} {sigma}");
        let found = filter.estimate().unwrap();
        assert!((found.place[0] - place[0]).hypot(found.place[1] - place[1]) < 0.3, "{found:?} {place:?}");
    }
}
