//! Offset, scale and misalignment of an accelerometer from rests in different attitudes.
//!
//! At rest a corrected reading is as long as gravity, whatever the attitude: `|C (a - b)| = g`. Uncorrected readings lie on
//! an ellipsoid, and the fit finds the `b` and `C` that make it a sphere. No attitude needs to be known or exact.
//!
//! The length says nothing of a common rotation of the axes, so `C` has six freedoms, not nine. It is taken symmetric
//! rather than triangular: if every axis is off by the same amount in a random direction, the axes of a symmetric
//! correction are off from those of the housing by 1/sqrt(2) of that, those of a triangular one by the whole.
//!
//! The data sheet is the prior: a freedom that the rests do not show (misalignment, from six rests on the faces) stays at
//! what an average sensor has, and its standard deviation says that it was not seen. The prior is so wide that it takes
//! less than a thousandth from what is seen.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// What turns a reading into the specific force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Correction {
    /// Reading without any force. **Units:** m/s²; **Frame:** sensor.
    pub bias: [f32; 3],
    /// Factor for each axis, after the bias was taken out. **Units:** 1.
    pub scale: [f32; 3],
    /// Share of one axis that belongs to another and back: yz, zx, xy. **Units:** 1.
    pub cross: [f32; 3],
}

impl Default for Correction {
    /// Changes nothing.
    fn default() -> Self {
        Self { bias: [0.0; 3], scale: [1.0; 3], cross: [0.0; 3] }
    }
}

impl Correction {
    /// `C`.
    pub fn matrix(&self) -> Matrix3<f32> {
        let ([x, y, z], [yz, zx, xy]) = (self.scale, self.cross);
        Matrix3::new(x, xy, zx, xy, y, yz, zx, yz, z)
    }

    /// `C (a - b)`. **Units:** m/s²; **Frame:** sensor.
    pub fn apply(&self, reading: &Vector3<f32>) -> Vector3<f32> {
        self.matrix() * (reading - Vector3::from(self.bias))
    }
}

/// Number of unknowns: three of the bias, three of the scale, three of the misalignment.
const FREEDOMS: usize = 9;
/// Most a pose may be off that was measured well: a kelvin moves the offset by 1 mg (BMA255 class). **Units:** m/s².
const POSE_SIGMA: f32 = 0.01;
/// Standard deviations of an average sensor: twice the data sheet's ±80 mg, ±3 % and ±1 %, so as not to press a bad unit
/// into it.
const PRIOR: [f32; FREEDOMS] = [1.6, 1.6, 1.6, 0.06, 0.06, 0.06, 0.02, 0.02, 0.02];
/// Fewest poses: with fewer not even bias and scale are determined.
pub const FEWEST: usize = 6;
/// The fit converges in 4 steps on any sensor that is one.
const STEPS: usize = 12;

/// Why there is no fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum FitError {
    /// Fewer poses than unknowns.
    TooFew,
    /// No ellipsoid goes through the readings.
    Diverged,
}

impl core::fmt::Display for FitError {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooFew => write!(out, "fewer than {FEWEST} poses, one on each side of the sensor is needed"),
            Self::Diverged => out.write_str("the readings at rest lie on no ellipsoid, expected the length of gravity"),
        }
    }
}

impl core::error::Error for FitError {}

/// A correction and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// What was found.
    pub correction: Correction,
    /// Largest standard deviation of a bias. **Units:** m/s².
    pub bias_sigma: f32,
    /// Largest standard deviation of a scale. **Units:** 1.
    pub scale_sigma: f32,
    /// Largest standard deviation of a misalignment. **Units:** 1.
    pub cross_sigma: f32,
    /// Root mean square of what the corrected lengths are off gravity. **Units:** m/s².
    pub residual: f32,
    /// Poses beyond those that the unknowns used up: without any the residual proves nothing. **Units:** 1.
    pub redundancy: f32,
}

type Unknowns = SVector<f32, FREEDOMS>;
type Information = SMatrix<f32, FREEDOMS, FREEDOMS>;

/// The unknowns in parts of their prior's standard deviation.
fn correction(unknowns: &Unknowns) -> Correction {
    let value = |index: usize| unknowns[index] * PRIOR[index];
    let part = |first: usize, neutral: f32| [0, 1, 2].map(|axis| neutral + value(first + axis));
    Correction { bias: part(0, 0.0), scale: part(3, 1.0), cross: part(6, 0.0) }
}

/// Length of the corrected reading less gravity, and its derivative.
fn residual(reading: &Vector3<f32>, at: &Correction, gravity: f32) -> Option<(f32, Unknowns)> {
    let free = reading - Vector3::from(at.bias);
    let matrix = at.matrix();
    let corrected = matrix * free;
    let length = libm::sqrtf(corrected.norm_squared());
    let up = corrected / length;
    let bias = -(matrix * up);
    let mut row = Unknowns::zeros();
    for axis in 0..3 {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        row[axis] = bias[axis];
        row[3 + axis] = up[axis] * free[axis];
        row[6 + axis] = up[next] * free[last] + up[last] * free[next];
    }
    row.component_mul_assign(&Unknowns::from(PRIOR));
    (length > 0.0 && row.iter().all(|value| value.is_finite())).then_some((length - gravity, row))
}

/// The correction that makes every reading in `poses` as long as `gravity`. **Units:** m/s²; **Frame:** sensor.
///
/// Gauss-Newton on bias, scale and misalignment, with the data sheet as prior.
pub fn fit(poses: &[Vector3<f32>], gravity: f32) -> Result<Fit, FitError> {
    if poses.len() < FEWEST {
        return Err(FitError::TooFew);
    }
    let mut unknowns = Unknowns::zeros();
    let weight = 1.0 / (POSE_SIGMA * POSE_SIGMA);
    for _ in 0..STEPS {
        let at = correction(&unknowns);
        let mut information = Information::identity();
        let mut gradient = unknowns;
        for pose in poses {
            let (off, row) = residual(pose, &at, gravity).ok_or(FitError::Diverged)?;
            information += row * row.transpose() * weight;
            gradient += row * (off * weight);
        }
        let step = information.cholesky().ok_or(FitError::Diverged)?.solve(&gradient);
        unknowns -= step;
        // A millionth of 160 mg.
        if step.amax() < 1e-6 {
            break;
        }
    }
    let found = correction(&unknowns);
    let mut information = Information::identity();
    let mut squares = 0.0;
    for pose in poses {
        let (off, row) = residual(pose, &found, gravity).ok_or(FitError::Diverged)?;
        information += row * row.transpose() * weight;
        squares += off * off;
    }
    let covariance = information.cholesky().ok_or(FitError::Diverged)?.inverse();
    // Of each unknown the rests determined what the prior does not: 1 less the share of the variance that is left.
    let redundancy = poses.len() as f32 - (FREEDOMS as f32 - covariance.trace());
    // Poses that fit worse than assumed were measured worse than assumed.
    let excess = if redundancy >= 1.0 { libm::sqrtf(squares / redundancy) / POSE_SIGMA } else { 1.0 };
    let sigma = |first: usize| {
        let variance = (first..first + 3).map(|i| PRIOR[i] * PRIOR[i] * covariance[(i, i)]).fold(0.0, f32::max);
        libm::sqrtf(variance) * excess.max(1.0)
    };
    let (bias_sigma, scale_sigma, cross_sigma) = (sigma(0), sigma(3), sigma(6));
    let residual = libm::sqrtf(squares / poses.len() as f32);
    let fit = Fit { correction: found, bias_sigma, scale_sigma, cross_sigma, residual, redundancy };
    let finite = unknowns.iter().chain([&bias_sigma, &scale_sigma, &cross_sigma, &residual]).all(|v| v.is_finite());
    // Ten times the prior is no accelerometer.
    if finite && unknowns.amax() < 10.0 { Ok(fit) } else { Err(FitError::Diverged) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::STANDARD_GRAVITY_M_S2;
    use proptest::prelude::*;
    use std::vec::Vec;

    const G: f32 = STANDARD_GRAVITY_M_S2;

    /// What a sensor with `error` reads at rest when `up` points upwards.
    fn reading(error: &Correction, up: Vector3<f32>) -> Vector3<f32> {
        error.matrix().try_inverse().unwrap() * (up.normalize() * G) + Vector3::from(error.bias)
    }

    fn faces() -> Vec<Vector3<f32>> {
        [0, 1, 2].into_iter().flat_map(|axis| [1.0, -1.0].map(|sign| Vector3::ith(axis, sign))).collect()
    }

    fn edges() -> Vec<Vector3<f32>> {
        let signs = [1.0_f32, -1.0];
        (0..3).flat_map(|axis| signs.map(|sign| Vector3::ith(axis, sign) + Vector3::ith((axis + 1) % 3, 1.0))).collect()
    }

    fn error() -> Correction {
        Correction { bias: [0.7, -0.5, 0.3], scale: [1.02, 0.985, 0.99], cross: [0.004, -0.006, 0.003] }
    }

    fn distance(one: &Correction, other: &Correction) -> [f32; 3] {
        [(one.bias, other.bias), (one.scale, other.scale), (one.cross, other.cross)]
            .map(|(a, b)| (Vector3::from(a) - Vector3::from(b)).amax())
    }

    #[test]
    fn faces_and_edges_show_everything() {
        let poses: Vec<_> = faces().into_iter().chain(edges()).map(|up| reading(&error(), up)).collect();
        let fit = fit(&poses, G).unwrap();
        let [bias, scale, cross] = distance(&fit.correction, &error());
        // No noise; the prior pulls by (sigma / prior)^2: 4e-5 of 0.7 m/s², 3e-4 of 2 %, 1e-3 of 0.6 %.
        assert!(bias < 1e-4 && scale < 2e-5 && cross < 2e-5, "{bias} {scale} {cross}");
        assert!(fit.residual < 1e-3 && fit.redundancy > 2.9, "{fit:?}");
        assert!(fit.bias_sigma < 0.01 && fit.scale_sigma < 1e-3 && fit.cross_sigma < 2e-3, "{fit:?}");
    }

    #[test]
    fn six_faces_show_bias_and_scale_and_say_that_the_rest_is_unknown() {
        let straight = Correction { cross: [0.0; 3], ..error() };
        let poses: Vec<_> = faces().into_iter().map(|up| reading(&straight, up)).collect();
        let fit = fit(&poses, G).unwrap();
        let [bias, scale, cross] = distance(&fit.correction, &straight);
        assert!(bias < 1e-3 && scale < 1e-4 && cross < 1e-3, "{bias} {scale} {cross}");
        assert!(fit.cross_sigma > 0.01, "{fit:?}");
        assert!(fit.redundancy < 0.1, "{fit:?}");
    }

    #[test]
    fn a_pose_that_moved_shows_in_the_residual_and_in_the_sigmas() {
        let mut poses: Vec<_> = faces().into_iter().chain(edges()).map(|up| reading(&error(), up)).collect();
        let clean = fit(&poses, G).unwrap();
        poses[7] *= 1.02;
        let spoilt = fit(&poses, G).unwrap();
        // 0.2 m/s² off; the misalignment hides most of it, since only two edges show each.
        assert!(spoilt.residual > 0.02 && spoilt.bias_sigma > 4.0 * clean.bias_sigma, "{spoilt:?}");
    }

    #[test]
    fn too_few_and_senseless_poses_are_refused() {
        assert_eq!(fit(&faces()[..5], G), Err(FitError::TooFew));
        assert_eq!(fit(&[Vector3::zeros(); 6], G), Err(FitError::Diverged));
        assert_eq!(fit(&[Vector3::new(f32::NAN, 0.0, 9.8); 7], G), Err(FitError::Diverged));
        // In g instead of m/s².
        assert_eq!(fit(&faces(), G), Err(FitError::Diverged));
        // Six times the same attitude shows one number only, and the fit says so.
        let same = fit(&[Vector3::new(0.1, 0.2, 9.9); 6], G).unwrap();
        assert!(same.bias_sigma > 1.0, "{same:?}");
    }

    proptest! {
        #[test]
        fn any_attitudes_will_do(
            ups in proptest::collection::vec(proptest::array::uniform3(-1.0_f32..1.0), 14..24),
            bias in proptest::array::uniform3(-0.8_f32..0.8),
            scale in proptest::array::uniform3(0.97_f32..1.03),
            cross in proptest::array::uniform3(-0.01_f32..0.01),
        ) {
            let truth = Correction { bias, scale, cross };
            let ups: Vec<_> = ups.into_iter().map(Vector3::from).filter(|up| up.norm() > 0.1).collect();
            prop_assume!(ups.len() >= FEWEST);
            let poses: Vec<_> = ups.iter().map(|&up| reading(&truth, up)).collect();
            let fit = fit(&poses, G).unwrap();
            let [bias, scale, cross] = distance(&fit.correction, &truth);
            // Without noise whatever is left is the prior's pull, which is below a fourth of the standard deviation told:
            // sigma^2 / prior^2 times an error of half the prior.
            prop_assert!(bias < 0.5 * fit.bias_sigma + 1e-4, "{} {:?}", bias, fit);
            prop_assert!(scale < 0.5 * fit.scale_sigma + 1e-5, "{} {:?}", scale, fit);
            prop_assert!(cross < 0.6 * fit.cross_sigma + 1e-5, "{} {:?}", cross, fit);
        }

        #[test]
        fn nothing_makes_it_panic(poses in proptest::collection::vec(proptest::array::uniform3(proptest::num::f32::ANY), 0..20)) {
            let poses: Vec<_> = poses.into_iter().map(Vector3::from).collect();
            if let Ok(fit) = fit(&poses, G) {
                prop_assert!(fit.correction.apply(&Vector3::zeros()).iter().all(|value| value.is_finite()));
            }
        }
    }
}
