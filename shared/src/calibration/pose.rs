//! The attitudes in which the sensor was laid down, and which are still missing.
//!
//! Twelve show everything: each of the six faces up, then six edges, two in each plane of two axes. The faces show bias
//! and scale, the edges the misalignment of the axes, and three of the twelve are left over to check the rest by. Order
//! and exactness do not matter, and others do no harm: the fit uses only that each was at rest.

use super::DEG;
use super::ellipsoid::{Fit, FitError, fit};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// A direction of the sensor by its axes: -1, 0 or 1 of each, so one of 6 faces, 12 edges and 8 corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Direction(pub [i8; 3]);

impl Direction {
    /// Faces, then edges, in the order in which they are asked for: each turn from one to the next is short.
    pub const WANTED: [Self; 12] = [
        Self([0, 0, 1]),
        Self([1, 0, 0]),
        Self([0, 0, -1]),
        Self([-1, 0, 0]),
        Self([0, 1, 0]),
        Self([0, -1, 0]),
        Self([0, -1, 1]),
        Self([0, 1, 1]),
        Self([1, 1, 0]),
        Self([1, -1, 0]),
        Self([1, 0, -1]),
        Self([1, 0, 1]),
    ];

    /// The face, edge or corner nearest to `vector`.
    pub fn nearest(vector: &Vector3<f32>) -> Self {
        let length = libm::sqrtf(vector.norm_squared());
        // Half way between a face and an edge, and an edge and a corner: tan(22.5 deg) and tan(17.6 deg) of the largest
        // component, taken as one.
        let threshold = 0.36 * length;
        Self([0, 1, 2].map(|axis| match vector[axis] {
            value if value > threshold => 1,
            value if value < -threshold => -1,
            _ => 0,
        }))
    }

    /// Whether two differ at most in the sign: the length of gravity shows the same in both.
    fn shows_edge(self, other: Self) -> bool {
        self == other || self.0.map(|value| -value) == other.0
    }
}

impl core::fmt::Display for Direction {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mut first = true;
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if self.0[axis] != 0 {
                let sign = if self.0[axis] > 0 { '+' } else { '-' };
                write!(out, "{}{sign}{name}", if first { "" } else { " and " })?;
                first = false;
            }
        }
        Ok(())
    }
}

/// Room for the twelve and as many others.
pub const MOST: usize = 24;
/// A pose closer than this to another shows nothing new: cosine of 20 degrees.
const NEAR_COSINE: f32 = 0.939_7;
/// Length of a reading at rest that no accelerometer of this class is off: 160 mg and 6 %, twice the data sheet's.
const FURTHEST_OFF: f32 = 0.25;

/// Why a rest was not taken as a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Refusal {
    /// The sensor moved before it had rested long enough.
    Moved,
    /// It has rested in much the same attitude before.
    Duplicate,
    /// What it read at rest is not gravity.
    NotGravity,
    /// An axis stood at the end of its range.
    Clipped,
    /// There is no room for more poses.
    Full,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.write_str(match self {
            Self::Moved => "it moved before it had rested long enough; lay it down and let go of it",
            Self::Duplicate => "it has rested in this attitude before; turn it by more than 20 degrees",
            Self::NotGravity => "the accelerometer reads something else than gravity, more than 25 % off",
            Self::Clipped => "an axis stood at the end of its range while the sensor rested",
            Self::Full => "enough poses were taken",
        })
    }
}

/// One rest of the sensor. **Frame:** sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Mean reading of the accelerometer. **Units:** m/s².
    pub accel: Vector3<f32>,
    /// Mean reading of the gyroscope. **Units:** rad/s.
    pub gyro: Vector3<f32>,
    /// Temperature, if known. **Units:** °C.
    pub temperature: Option<f32>,
}

/// What the gyroscope reads at rest in any attitude and at any temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroFit {
    /// Bias at the mean temperature, without force. **Units:** rad/s; **Frame:** sensor.
    pub bias: Vector3<f32>,
    /// Rate read for a force. **Units:** rad/s per m/s².
    pub per_accel: Matrix3<f32>,
    /// Root mean square of what the poses are off. **Units:** rad/s.
    pub residual: f32,
}

/// The poses taken so far.
#[derive(Clone, Debug)]
pub struct SixPose {
    gravity: f32,
    poses: [Pose; MOST],
    len: usize,
}

impl SixPose {
    /// No poses yet; `gravity` is that of the place. **Units:** m/s².
    pub fn new(gravity: f32) -> Self {
        let none = Pose { accel: Vector3::zeros(), gyro: Vector3::zeros(), temperature: None };
        Self { gravity, poses: [none; MOST], len: 0 }
    }

    /// The poses, in the order in which they came.
    pub fn poses(&self) -> &[Pose] {
        &self.poses[..self.len]
    }

    /// Takes a rest in, and tells which way is up in it; a rest that shows nothing is refused and changes nothing.
    pub fn push(&mut self, pose: Pose) -> Result<Direction, Refusal> {
        self.examine(&pose.accel)?;
        let Some(free) = self.poses.get_mut(self.len) else { return Err(Refusal::Full) };
        *free = pose;
        self.len += 1;
        Ok(Direction::nearest(&pose.accel))
    }

    /// Whether a rest with this reading could be taken in. **Units:** m/s²; **Frame:** sensor.
    pub fn examine(&self, accel: &Vector3<f32>) -> Result<(), Refusal> {
        let length = libm::sqrtf(accel.norm_squared());
        // Written so that what is not a number is refused too.
        let plausible = (length - self.gravity).abs() <= FURTHEST_OFF * self.gravity;
        if !plausible {
            return Err(Refusal::NotGravity);
        }
        let near = |pose: &Pose| {
            let other = libm::sqrtf(pose.accel.norm_squared());
            pose.accel.dot(accel) > NEAR_COSINE * length * other
        };
        if self.poses().iter().any(near) {
            return Err(Refusal::Duplicate);
        }
        if self.len == MOST { Err(Refusal::Full) } else { Ok(()) }
    }

    /// Those of [`Direction::WANTED`] that no pose has shown yet.
    pub fn missing(&self) -> impl Iterator<Item = Direction> + '_ {
        Direction::WANTED.into_iter().enumerate().filter_map(|(index, wanted)| {
            let seen = self.poses().iter().map(|pose| Direction::nearest(&pose.accel)).any(|seen| {
                // The faces show bias and scale only together with their opposites.
                if index < 6 { seen == wanted } else { seen.shows_edge(wanted) }
            });
            (!seen).then_some(wanted)
        })
    }

    /// Bias, scale and misalignment of the accelerometer.
    pub fn fit_accel(&self) -> Result<Fit, FitError> {
        let mut readings = [Vector3::zeros(); MOST];
        for (reading, pose) in readings.iter_mut().zip(self.poses()) {
            *reading = pose.accel;
        }
        fit(&readings[..self.len], self.gravity)
    }

    /// Mean temperature of the poses, if it is known of all. **Units:** °C.
    pub fn temperature(&self) -> Option<f32> {
        let sum = self.poses().iter().try_fold(0.0, |sum, pose| pose.temperature.map(|t| sum + t));
        sum.filter(|_| self.len > 0).map(|sum| sum / self.len as f32)
    }

    /// Bias of the gyroscope and its dependence on the force, by least squares with the data sheet as prior; `None` with
    /// fewer than four poses. What the temperature did meanwhile is solved for and put aside.
    pub fn fit_gyro(&self) -> Option<GyroFit> {
        if self.len < 4 {
            return None;
        }
        let mean = self.temperature();
        let mut information =
            SMatrix::<f32, 5, 5>::from_diagonal(&GYRO_PRIOR.map(|sigma| 1.0 / (sigma * sigma)).into());
        let mut right = SMatrix::<f32, 5, 3>::zeros();
        let weight = 1.0 / (GYRO_SIGMA * GYRO_SIGMA);
        let row = |pose: &Pose| {
            let [x, y, z] = (pose.accel / self.gravity).into();
            let warmer = pose.temperature.zip(mean).map_or(0.0, |(temperature, mean)| temperature - mean);
            SVector::<f32, 5>::from([1.0, warmer, x, y, z])
        };
        for pose in self.poses() {
            let row = row(pose);
            information += row * row.transpose() * weight;
            right += row * pose.gyro.transpose() * weight;
        }
        let found = information.cholesky()?.solve(&right);
        let squares: f32 =
            self.poses().iter().map(|pose| (pose.gyro - found.transpose() * row(pose)).norm_squared()).sum();
        let bias = found.row(0).transpose();
        let per_accel = found.fixed_rows::<3>(2).transpose() / self.gravity;
        let residual = libm::sqrtf(squares / (3 * self.len) as f32);
        let finite = bias.iter().chain(per_accel.iter()).all(|value| value.is_finite());
        finite.then_some(GyroFit { bias, per_accel, residual })
    }
}

/// What a pose of some seconds shows of the gyroscope's bias. **Units:** rad/s.
const GYRO_SIGMA: f32 = 0.01 * DEG;
/// Prior of bias, its change with the temperature and what 1 g does on each axis: limits of the data sheet (BMI088,
/// table 5), ±3 times for the bias. **Units:** rad/s, rad/s/K, rad/s.
const GYRO_PRIOR: [f32; 5] = [3.0 * DEG, 0.015 * DEG, 0.1 * DEG, 0.1 * DEG, 0.1 * DEG];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::STANDARD_GRAVITY_M_S2;
    use std::string::ToString;
    use std::vec::Vec;

    const G: f32 = STANDARD_GRAVITY_M_S2;

    fn pose(direction: Direction) -> Pose {
        let up = Vector3::from(direction.0.map(f32::from)).normalize();
        Pose { accel: up * G, gyro: Vector3::zeros(), temperature: Some(25.0) }
    }

    #[test]
    fn the_twelve_are_recognised_in_any_order_and_then_nothing_is_missing() {
        let mut poses = SixPose::new(G);
        for (taken, direction) in Direction::WANTED.into_iter().rev().enumerate() {
            assert_eq!(poses.missing().count(), 12 - taken);
            assert_eq!(poses.push(pose(direction)), Ok(direction));
        }
        assert_eq!(poses.missing().count(), 0);
        assert_eq!(poses.push(pose(Direction([1, 1, 1]))), Ok(Direction([1, 1, 1])));
        assert_eq!(poses.temperature(), Some(25.0));
    }

    #[test]
    fn a_tilted_face_is_still_that_face() {
        let tilted = Vector3::new(0.3, -0.15, -0.95);
        assert_eq!(Direction::nearest(&tilted), Direction([0, 0, -1]));
        assert_eq!(Direction([0, -1, 1]).to_string(), "-y and +z");
    }

    #[test]
    fn an_edge_counts_on_either_side() {
        let mut poses = SixPose::new(G);
        poses.push(pose(Direction([-1, -1, 0]))).unwrap();
        assert!(!poses.missing().any(|missing| missing == Direction([1, 1, 0])));
        assert!(poses.missing().any(|missing| missing == Direction([1, -1, 0])));
    }

    #[test]
    fn what_shows_nothing_is_refused_with_its_reason() {
        let mut poses = SixPose::new(G);
        poses.push(pose(Direction([0, 0, 1]))).unwrap();
        let near = Pose { accel: Vector3::new(2.0, 0.0, 9.6), ..pose(Direction([0, 0, 1])) };
        assert_eq!(poses.push(near), Err(Refusal::Duplicate));
        assert_eq!(poses.push(Pose { accel: Vector3::x(), ..near }), Err(Refusal::NotGravity));
        assert_eq!(poses.push(Pose { accel: Vector3::x() * f32::NAN, ..near }), Err(Refusal::NotGravity));
        assert_eq!(poses.poses().len(), 1);
        assert!(matches!(poses.fit_accel(), Err(FitError::TooFew)));
    }

    #[test]
    fn what_the_force_does_to_the_gyroscope_is_told_from_bias_and_temperature() {
        let bias = Vector3::new(0.8, -0.4, 0.1) * DEG;
        let per_accel = Matrix3::new(3.0, -2.0, 1.0, 0.5, -3.0, 2.0, 1.0, 1.0, -1.0) * (0.01 * DEG / G);
        let mut poses = SixPose::new(G);
        for (index, direction) in Direction::WANTED.into_iter().enumerate() {
            let plain = pose(direction);
            let temperature = 24.0 + 0.3 * index as f32;
            // It warms by 3.3 K while it is turned.
            let drift = Vector3::new(0.01, -0.01, 0.005) * (DEG * (temperature - 25.65));
            let gyro = bias + per_accel * plain.accel + drift;
            poses.push(Pose { gyro, temperature: Some(temperature), ..plain }).unwrap();
        }
        let fit = poses.fit_gyro().unwrap();
        // No noise; the prior takes (0.01 / 0.1)^2 / 4 of 0.03 deg/s and less of the others, and what it takes leaks.
        assert!((fit.bias - bias).amax() < 1e-3 * DEG, "{}", (fit.bias - bias) / DEG);
        assert!((fit.per_accel - per_accel).amax() * G < 1e-3 * DEG, "{}", (fit.per_accel - per_accel) * G / DEG);
        assert!(fit.residual < 1e-3 * DEG);
    }

    #[test]
    fn there_is_room_for_only_so_many() {
        let mut poses = SixPose::new(G);
        let around: Vec<_> = (-1..=1)
            .flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| Direction([x, y, z]))))
            .filter(|direction| direction.0 != [0; 3])
            .collect();
        let refused = around.into_iter().filter(|&direction| poses.push(pose(direction)) == Err(Refusal::Full));
        assert_eq!(refused.count(), 2);
    }
}
