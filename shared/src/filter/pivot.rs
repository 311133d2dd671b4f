//! The project's own filter: it knows that what stands on the floor is not the sensor but the foot below it.
//!
//! The sensor sits some centimetres above the point the standing foot turns about. A foot that rolls over it at some
//! degrees per second moves the sensor by some centimetres per second, always forwards, and a zero-velocity update that
//! does not know this takes one to two percent off every stride. This filter estimates the lever arm from that pivot to
//! the sensor, and the update says that the pivot does not move.
//!
//! What else differs from [`super::unscented`], each for what it measures or costs:
//!
//! * It predicts from [`Increment`]s of some milliseconds, not from samples.
//! * Only the attitude enters the prediction by a curved function, so only along its three axes sigma points are drawn (six,
//!   one standard deviation out); all else is linear and exact. Zero velocity and height are linear: exact updates.
//! * Biases of gyroscope and accelerometer are states.
//! * What is lost between the samples of an impact enters as noise at that moment, and so is not smeared over the swing.
//! * Zero velocity says next to nothing of the heading and of the gyroscope's bias about the vertical; what it seems to say
//!   is mostly the rolling of the foot. Both are *considered* (Schmidt): their uncertainty counts, but they are corrected
//!   by a part only, or not at all.
//! * So is the accelerometer's bias along the vertical. A heel that still falls when the foot counts as standing lifts every
//!   level stride by some millimetres; taken for a bias, that made stairs and elevators some percent too low. A rest shows
//!   this bias by the strength of gravity.
//!
//! # Frame
//! World as in [`super::rebase`]; biases and lever arm in the sensor frame.
//!
//! # Source
//! Sigma points of the attitude: first-order divided differences (Nørgaard, Poulsen, Ravn: "New developments in state
//! estimation for nonlinear systems", Automatica 36, 2000). Consider states: Schmidt, "Application of state-space methods
//! to navigation problems", Advances in Control Systems 3, 1966. Lever arm as a state: the project's own.

use super::covariance::{self, symmetrise};
use super::rebase::{self, Change};
use super::state::{POSITION, ROTATION, State, VELOCITY};
use crate::preintegration::Increment;
use crate::sample::{AccelBias, GyroBias, STANDARD_GRAVITY_M_S2};
use crate::so3;
use crate::stance::adaptive::Speed;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

/// Degrees of freedom of the error: rotation, position, velocity, gyroscope bias, accelerometer bias, lever arm.
pub const FREEDOMS: usize = 18;
/// Rotation, position and velocity: the part of the error that a prediction turns and mixes.
const POSE: usize = 9;
/// First component of the gyroscope bias. **Units:** rad/s; **Frame:** sensor.
const GYRO_BIAS: usize = 9;
/// First component of the accelerometer bias. **Units:** m/s²; **Frame:** sensor.
const ACCEL_BIAS: usize = 12;
/// First component of the lever arm from the pivot to the sensor. **Units:** m; **Frame:** sensor.
const LEVER: usize = 15;

/// The covariance of the error.
pub type Covariance = SMatrix<f32, FREEDOMS, FREEDOMS>;
type Direction = SVector<f32, FREEDOMS>;

/// Settings of [`PivotFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Tilt at the start (standard deviation). **Units:** rad.
    pub tilt_sigma: f32,
    /// Tilt when the start was in motion. **Units:** rad.
    pub tilt_sigma_moving: f32,
    /// Velocity at the start. **Units:** m/s.
    pub velocity_sigma: f32,
    /// Gyroscope bias when no rest has shown it. **Units:** rad/s.
    pub gyro_bias_sigma: f32,
    /// Accelerometer bias. **Units:** m/s².
    pub accel_bias_sigma: f32,
    /// Lever arm. **Units:** m.
    pub lever_sigma: f32,
    /// Noise of the angular rate. **Units:** rad/s per square root of Hz.
    pub gyro_noise: f32,
    /// Noise of the specific force. **Units:** m/s² per square root of Hz.
    pub accel_noise: f32,
    /// Random walk of the gyroscope bias. **Units:** rad/s per square root of s.
    pub gyro_bias_noise: f32,
    /// Random walk of the accelerometer bias. **Units:** m/s² per square root of s.
    pub accel_bias_noise: f32,
    /// Random walk of the lever arm. **Units:** m per square root of s.
    pub lever_noise: f32,
    /// How long a jump between two samples may have been misjudged: times the jump, the noise it leaves. **Units:** s.
    pub jump_s: f32,
    /// What may be missing of a clipped angular rate. **Units:** rad/s.
    pub gyro_clip_sigma: f32,
    /// What may be missing of a clipped specific force. **Units:** m/s².
    pub accel_clip_sigma: f32,
    /// Angular rate that a hole in the samples may hide. **Units:** rad/s.
    pub gap_gyro_sigma: f32,
    /// Acceleration that a hole in the samples may hide. **Units:** m/s².
    pub gap_accel_sigma: f32,
    /// The part of a correction of the heading by zero velocity or height that is carried out, 0 to 1.
    pub heading_share: f32,
    /// The same for the gyroscope bias about the vertical.
    pub vertical_bias_share: f32,
    /// The same for the accelerometer's bias along the vertical, which rests show better.
    pub force_bias_share: f32,
    /// How well the direction of the specific force of a rest shows the vertical. **Units:** m/s².
    pub gravity_sigma: f32,
    /// How well its strength shows the accelerometer's bias along the vertical. **Units:** m/s².
    pub force_sigma: f32,
    /// How well the height of a level floor is known. **Units:** m.
    pub height_sigma: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            tilt_sigma: 0.3_f32.to_radians(),
            tilt_sigma_moving: 5.0_f32.to_radians(),
            velocity_sigma: 0.01,
            gyro_bias_sigma: 0.3_f32.to_radians(),
            accel_bias_sigma: 0.1,
            lever_sigma: 0.1,
            gyro_noise: 0.003,
            accel_noise: 0.028,
            gyro_bias_noise: 1e-5,
            accel_bias_noise: 1e-4,
            lever_noise: 1e-4,
            jump_s: 0.0015,
            gyro_clip_sigma: 0.3,
            accel_clip_sigma: 10.0,
            gap_gyro_sigma: 1.0,
            gap_accel_sigma: 5.0,
            heading_share: 0.3,
            vertical_bias_share: 0.0,
            force_bias_share: 0.1,
            gravity_sigma: 0.05,
            force_sigma: 0.02,
            height_sigma: 0.003,
        }
    }
}

/// The filter.
#[derive(Clone, Debug)]
pub struct PivotFilter {
    parameters: Parameters,
    state: State,
    gyro_bias: Vector3<f32>,
    accel_bias: Vector3<f32>,
    lever: Vector3<f32>,
    /// Angular rate at the end of the last increment. **Units:** rad/s; **Frame:** sensor.
    rate: Vector3<f32>,
    covariance: Covariance,
    /// Attitude at the last re-base.
    reference: UnitQuaternion<f32>,
    repaired: u32,
}

impl PivotFilter {
    /// A filter that stands level in the origin.
    pub fn new(parameters: &Parameters) -> Self {
        let mut filter = Self {
            parameters: *parameters,
            state: State::at_rest(UnitQuaternion::identity()),
            gyro_bias: Vector3::zeros(),
            accel_bias: Vector3::zeros(),
            lever: Vector3::zeros(),
            rate: Vector3::zeros(),
            covariance: Covariance::zeros(),
            reference: UnitQuaternion::identity(),
            repaired: 0,
        };
        filter.start(&Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2), None);
        filter
    }

    /// As new, with other settings.
    pub fn restart(&mut self, parameters: &Parameters) {
        self.parameters = *parameters;
        self.repaired = 0;
        self.start(&Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2), None);
    }

    /// Starts in the origin, standing, with the vertical along `accel`, the mean specific force. **Units:** m/s²;
    /// **Frame:** sensor. `bias` is the mean angular rate of a rest and how well it shows the bias, or nothing when the
    /// walk was on already.
    ///
    /// What the accelerometer shows beyond standard gravity is taken for its bias along the vertical: at rest, and in the
    /// attitude of the standing foot, where it matters, bias, scale and the local gravity are one and the same.
    pub fn start(&mut self, accel: &Vector3<f32>, bias: Option<(Vector3<f32>, f32)>) {
        let p = self.parameters;
        let attitude = so3::level(accel);
        self.state = State::at_rest(attitude);
        self.reference = attitude;
        self.lever = Vector3::zeros();
        self.rate = Vector3::zeros();
        self.gyro_bias = bias.map_or_else(Vector3::zeros, |(rate, _)| rate);
        let up = self.state.up();
        let excess = accel.dot(&up) - STANDARD_GRAVITY_M_S2;
        self.accel_bias = if bias.is_some() { up * excess } else { Vector3::zeros() };

        let tilt = if bias.is_some() { p.tilt_sigma } else { p.tilt_sigma_moving };
        let gyro_bias = bias.map_or(p.gyro_bias_sigma, |(_, sigma)| sigma.min(p.gyro_bias_sigma));
        let sigmas = [
            (ROTATION, tilt),
            (VELOCITY, p.velocity_sigma),
            (GYRO_BIAS, gyro_bias),
            (ACCEL_BIAS, p.accel_bias_sigma),
            (LEVER, p.lever_sigma),
        ];
        self.covariance = Covariance::zeros();
        for (first, sigma) in sigmas {
            for axis in first..first + 3 {
                self.covariance[(axis, axis)] = sigma * sigma;
            }
        }
        // The heading of the start is the origin of headings: known.
        let known = Matrix3::identity() - up * up.transpose();
        self.transform_block(ROTATION, &known);
        if bias.is_some() {
            let less = p.accel_bias_sigma * p.accel_bias_sigma - p.force_sigma * p.force_sigma;
            let mut block = self.covariance.fixed_view_mut::<3, 3>(ACCEL_BIAS, ACCEL_BIAS);
            block -= up * up.transpose() * less.max(0.0);
        }
        symmetrise(&mut self.covariance);
    }

    /// Moves on by an increment.
    pub fn predict(&mut self, increment: &Increment) {
        let p = self.parameters;
        let dt = increment.duration();
        if increment.gap {
            self.predict_gap(dt);
            return;
        }
        let attitude = self.state.attitude;
        let spread = self.spread();
        let (velocity_turn, velocity) = self.turned(&increment.velocity, &spread);
        let (position_turn, position) = self.turned(&increment.position, &spread);
        let gravity = Vector3::new(0.0, 0.0, -STANDARD_GRAVITY_M_S2);
        self.state.position += self.state.velocity * dt + position + gravity * (0.5 * dt * dt);
        self.state.velocity += velocity + gravity * dt;
        self.state.attitude = so3::renormalised(&(attitude * increment.turn));
        self.rate = increment.gyro_mean();

        let rotation = attitude.to_rotation_matrix();
        let back = increment.turn.inverse().to_rotation_matrix();
        self.propagate(back.matrix(), &velocity_turn, &position_turn, &(rotation.matrix() * -dt), dt);

        let jump_s = if increment.sets_out { p.jump_s.max(SET_OUT * dt) } else { p.jump_s };
        let jump = jump_s * jump_s;
        let gyro = p.gyro_noise * p.gyro_noise * dt
            + jump * increment.gyro_jump
            + p.gyro_clip_sigma * p.gyro_clip_sigma * increment.gyro_clipped;
        let accel = p.accel_noise * p.accel_noise * dt
            + jump * increment.accel_jump
            + p.accel_clip_sigma * p.accel_clip_sigma * increment.accel_clipped;
        self.add_noise(dt, gyro, accel);
    }

    /// Stands for a while, unseen: only the biases may have changed.
    pub fn stand(&mut self, duration_s: f32) {
        let p = self.parameters;
        let duration_s = duration_s.clamp(0.0, LONGEST_REST_S);
        for (first, noise) in [(GYRO_BIAS, p.gyro_bias_noise), (ACCEL_BIAS, p.accel_bias_noise)] {
            for axis in first..first + 3 {
                self.covariance[(axis, axis)] += noise * noise * duration_s;
            }
        }
    }

    /// A hole in the samples: the foot went on somehow.
    fn predict_gap(&mut self, dt: f32) {
        let p = self.parameters;
        self.state.position += self.state.velocity * dt;
        self.propagate(&Matrix3::identity(), &Matrix3::zeros(), &Matrix3::zeros(), &Matrix3::zeros(), dt);
        let time = dt.min(LONGEST_GAP_S);
        let squared = time * time;
        self.add_noise(
            dt,
            p.gap_gyro_sigma * p.gap_gyro_sigma * squared,
            p.gap_accel_sigma * p.gap_accel_sigma * squared,
        );
        let place = 0.5 * p.gap_accel_sigma * squared;
        for axis in POSITION..POSITION + 3 {
            self.covariance[(axis, axis)] += place * place;
        }
    }

    /// The sigma points of the attitude: one ahead and one behind along each axis `e`, by the angle `sigma`. Turned by
    /// them, a vector `v` becomes `v cos sigma +- e x v sin sigma` (across the axis). Half the difference over `sigma` is
    /// `e x v` times the first number; the mean over the seven points (Foot, 4.45) falls short of `v`, across the axis, by
    /// the second.
    fn spread(&self) -> [(f32, f32); 3] {
        [0, 1, 2].map(|axis| {
            let variance = self.covariance[(ROTATION + axis, ROTATION + axis)];
            let sigma = libm::sqrtf(variance.clamp(LEAST_SPREAD * LEAST_SPREAD, 1.0));
            let point = so3::exp(&Vector3::new(sigma, 0.0, 0.0));
            // Sine and 1 - cosine of the whole angle from those of the half.
            (2.0 * point.w * point.i / sigma, 2.0 * (2.0 * point.i * point.i) / 7.0)
        })
    }

    /// `vector`, turned into the world by sigma points of the attitude: how it depends on the rotation error, and its mean.
    fn turned(&self, vector: &Vector3<f32>, spread: &[(f32, f32); 3]) -> (Matrix3<f32>, Vector3<f32>) {
        let [(slope_x, fall_x), (slope_y, fall_y), (slope_z, fall_z)] = *spread;
        let [x, y, z] = [vector.x, vector.y, vector.z];
        let across = [Vector3::new(0.0, -z, y), Vector3::new(z, 0.0, -x), Vector3::new(-y, x, 0.0)];
        let derivative = Matrix3::from_columns(&[across[0] * slope_x, across[1] * slope_y, across[2] * slope_z]);
        let mean = Vector3::new(x - x * (fall_y + fall_z), y - y * (fall_x + fall_z), z - z * (fall_x + fall_y));
        let rotation = self.state.attitude.to_rotation_matrix();
        (rotation.matrix() * derivative, rotation * mean)
    }

    /// `F P F^T` for the `F` of a prediction, which is the identity but for these blocks:
    /// rotation from rotation `back` and gyroscope bias `-dt`; velocity from rotation and accelerometer bias; position from
    /// rotation and velocity `dt`.
    fn propagate(
        &mut self,
        back: &Matrix3<f32>,
        velocity_turn: &Matrix3<f32>,
        position_turn: &Matrix3<f32>,
        velocity_bias: &Matrix3<f32>,
        dt: f32,
    ) {
        let mix = |error: [Vector3<f32>; 5]| {
            let [rotation, position, velocity, gyro_bias, accel_bias] = error;
            [
                back * rotation - gyro_bias * dt,
                position + position_turn * rotation + velocity * dt,
                velocity + velocity_turn * rotation + velocity_bias * accel_bias,
            ]
        };
        let p = &mut self.covariance;
        // `F P`, a column of it being a function of that column of `P` alone. Then the same from the other side: of the columns,
        // only those of the pose itself are new; where the rows of the others meet them, the upper triangle has them already.
        for column in 0..FREEDOMS {
            let part = |first: usize| Vector3::new(p[(first, column)], p[(first + 1, column)], p[(first + 2, column)]);
            let mixed = mix([ROTATION, POSITION, VELOCITY, GYRO_BIAS, ACCEL_BIAS].map(part));
            for (first, mixed) in [ROTATION, POSITION, VELOCITY].into_iter().zip(mixed) {
                for k in 0..3 {
                    p[(first + k, column)] = mixed[k];
                }
            }
        }
        for row in 0..POSE {
            let part = |first: usize| Vector3::new(p[(row, first)], p[(row, first + 1)], p[(row, first + 2)]);
            let mixed = mix([ROTATION, POSITION, VELOCITY, GYRO_BIAS, ACCEL_BIAS].map(part));
            for (first, mixed) in [ROTATION, POSITION, VELOCITY].into_iter().zip(mixed) {
                for k in 0..3 {
                    p[(row, first + k)] = mixed[k];
                }
            }
        }
        for i in 0..POSE {
            for j in 0..i {
                let mean = 0.5 * (p[(i, j)] + p[(j, i)]);
                p[(i, j)] = mean;
                p[(j, i)] = mean;
            }
            for j in POSE..FREEDOMS {
                p[(j, i)] = p[(i, j)];
            }
        }
    }

    fn add_noise(&mut self, dt: f32, rotation: f32, velocity: f32) {
        let p = self.parameters;
        let variances = [
            (ROTATION, rotation),
            (POSITION, POSITION_NOISE * dt),
            (VELOCITY, velocity),
            (GYRO_BIAS, p.gyro_bias_noise * p.gyro_bias_noise * dt),
            (ACCEL_BIAS, p.accel_bias_noise * p.accel_bias_noise * dt),
            (LEVER, p.lever_noise * p.lever_noise * dt),
        ];
        for (first, variance) in variances {
            for axis in first..first + 3 {
                self.covariance[(axis, axis)] += variance;
            }
        }
    }

    /// The pivot does not move (H2): the velocity of the sensor is what its turning about the pivot makes it. `sigma` is how
    /// far from that it may be, **Units:** m/s. In an elevator (H5) only the horizontal velocity is known.
    pub fn update_zero_velocity(&mut self, sigma: f32, horizontal_only: bool) {
        let rotation = self.state.attitude.to_rotation_matrix();
        let arm = rotation.matrix() * self.rate.cross_matrix();
        let expected = arm * self.lever;
        let mut correction = Direction::zeros();
        for axis in 0..if horizontal_only { 2 } else { 3 } {
            let mut reading = Direction::zeros();
            reading[VELOCITY + axis] = 1.0;
            for k in 0..3 {
                reading[LEVER + k] = -arm[(axis, k)];
            }
            let innovation = expected[axis] - self.state.velocity[axis];
            self.update(&reading, innovation, sigma * sigma, &mut correction, Considered::HeadingAndBias);
        }
        self.apply(&correction);
    }

    /// The elevator has stopped: no vertical velocity either. `sigma` in m/s.
    pub fn update_zero_vertical_velocity(&mut self, sigma: f32) {
        let mut reading = Direction::zeros();
        reading[VELOCITY + 2] = 1.0;
        let mut correction = Direction::zeros();
        let innovation = -self.state.velocity.z;
        self.update(&reading, innovation, sigma * sigma, &mut correction, Considered::HeadingAndBias);
        self.apply(&correction);
    }

    /// The foot stands `height` above the last re-base (H4). **Units:** m. `part` is the part of the whole knowledge that
    /// this update carries, when it is repeated.
    pub fn update_height(&mut self, height: f32, part: f32) {
        let sigma = self.parameters.height_sigma;
        let mut reading = Direction::zeros();
        reading[POSITION + 2] = 1.0;
        let mut correction = Direction::zeros();
        let innovation = height - self.state.position.z;
        let variance = sigma * sigma / part.clamp(1e-3, 1.0);
        self.update(&reading, innovation, variance, &mut correction, Considered::HeadingAndBias);
        self.apply(&correction);
    }

    /// A rest: its mean rate is bias, its mean specific force the vertical (H1). **Units:** rad/s, m/s²; **Frame:** sensor;
    /// both with the present biases taken out.
    pub fn update_rest(&mut self, gyro: &Vector3<f32>, bias_sigma: f32, accel: &Vector3<f32>) {
        let sigma = self.parameters.gravity_sigma;
        let up = self.state.up() * STANDARD_GRAVITY_M_S2;
        let turned = up.cross_matrix();
        let mut correction = Direction::zeros();
        for axis in 0..3 {
            let mut reading = Direction::zeros();
            reading[GYRO_BIAS + axis] = 1.0;
            self.update(&reading, gyro[axis], bias_sigma * bias_sigma, &mut correction, Considered::Nothing);
            let mut reading = Direction::zeros();
            for k in 0..3 {
                reading[ROTATION + k] = turned[(axis, k)];
            }
            reading[ACCEL_BIAS + axis] = 1.0;
            self.update(&reading, accel[axis] - up[axis], sigma * sigma, &mut correction, Considered::Nothing);
        }
        // A foot that leans a little still feels all of gravity: the strength says more of the bias than the direction does.
        let mut reading = Direction::zeros();
        for (axis, part) in self.state.up().iter().enumerate() {
            reading[ACCEL_BIAS + axis] = *part;
        }
        let excess = libm::sqrtf(accel.norm_squared()) - STANDARD_GRAVITY_M_S2;
        let sigma = self.parameters.force_sigma;
        self.update(&reading, excess, sigma * sigma, &mut correction, Considered::Nothing);
        self.apply(&correction);
    }

    /// One linear measurement `reading . error = innovation`. The correction is gathered, so that several measurements of
    /// one moment see the same state.
    fn update(
        &mut self,
        reading: &Direction,
        innovation: f32,
        variance: f32,
        correction: &mut Direction,
        considered: Considered,
    ) {
        let shared = self.covariance_with(reading);
        let total = reading.dot(&shared) + variance;
        if !(total > 0.0 && total.is_finite() && innovation.is_finite()) {
            self.repair();
            return;
        }
        let mut gain = shared / total;
        if let Considered::HeadingAndBias = considered {
            let up = self.state.up();
            let p = &self.parameters;
            let shares =
                [(ROTATION, p.heading_share), (GYRO_BIAS, p.vertical_bias_share), (ACCEL_BIAS, p.force_bias_share)];
            for (first, share) in shares {
                let part = gain.fixed_rows::<3>(first).dot(&up) * (1.0 - share);
                for axis in 0..3 {
                    gain[first + axis] -= up[axis] * part;
                }
            }
        }
        *correction += gain * (innovation - reading.dot(correction));
        // Joseph's form, which holds for any gain: P - k (P h)^T - (P h) k^T + s k k^T.
        for j in 0..FREEDOMS {
            let (gain_j, shared_j) = (gain[j], shared[j]);
            for i in j..FREEDOMS {
                let less = gain[i] * shared_j + shared[i] * gain_j - total * gain[i] * gain_j;
                self.covariance[(i, j)] -= less;
                self.covariance[(j, i)] = self.covariance[(i, j)];
            }
        }
        if (0..FREEDOMS).any(|i| self.covariance[(i, i)].is_nan() || self.covariance[(i, i)] < 0.0) {
            self.repair();
        }
    }

    /// `P h`. A measurement sees but a few components of the error: the rest of the covariance would be added as nothing.
    fn covariance_with(&self, reading: &Direction) -> Direction {
        let mut shared = Direction::zeros();
        for (column, part) in self.covariance.column_iter().zip(reading.iter()) {
            if *part != 0.0 {
                shared += column * *part;
            }
        }
        shared
    }

    fn apply(&mut self, correction: &Direction) {
        let part = |first: usize| Vector3::new(correction[first], correction[first + 1], correction[first + 2]);
        self.state.attitude = so3::box_plus(&self.state.attitude, &part(ROTATION));
        self.state.position += part(POSITION);
        self.state.velocity += part(VELOCITY);
        self.gyro_bias += part(GYRO_BIAS);
        self.accel_bias += part(ACCEL_BIAS);
        self.lever += part(LEVER);
    }

    /// The change since the last re-base.
    pub fn change(&self) -> Change {
        rebase::change(&self.reference, &self.state, &self.covariance)
    }

    /// Makes the foot the new origin. Returns the change since the last one.
    pub fn rebase(&mut self) -> Change {
        self.repaired += u32::from(covariance::repair_if_needed(&mut self.covariance));
        let change = self.change();
        rebase::rebase(&mut self.state, &mut self.covariance, change.turn);
        self.reference = self.state.attitude;
        change
    }

    /// The ground under the standing foot has begun to move at the vertical velocity `velocity`, known to `sigma`: an
    /// elevator. **Units:** m/s.
    pub fn begin_ride(&mut self, velocity: f32, sigma: f32) {
        self.state.velocity.z += velocity;
        self.covariance[(VELOCITY + 2, VELOCITY + 2)] += sigma * sigma;
    }

    fn repair(&mut self) {
        covariance::repair(&mut self.covariance);
        self.repaired = self.repaired.saturating_add(1);
    }

    fn transform_block(&mut self, first: usize, by: &Matrix3<f32>) {
        let rows = by * self.covariance.fixed_rows::<3>(first);
        self.covariance.fixed_rows_mut::<3>(first).copy_from(&rows);
        let columns = self.covariance.fixed_columns::<3>(first) * by.transpose();
        self.covariance.fixed_columns_mut::<3>(first).copy_from(&columns);
    }

    /// Attitude, position since the last re-base, velocity.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The covariance of the error.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// Whether every value is a number.
    pub fn is_finite(&self) -> bool {
        let vectors = [self.state.position, self.state.velocity, self.gyro_bias, self.accel_bias, self.lever];
        self.state.attitude.coords.iter().chain(vectors.iter().flatten()).all(|value| value.is_finite())
    }

    /// The speed of the foot; without doubt it has three standard deviations less.
    pub fn speed(&self) -> Speed {
        let variance: f32 = (VELOCITY..VELOCITY + 3).map(|axis| self.covariance[(axis, axis)].max(0.0)).sum();
        let likely = libm::sqrtf(self.state.velocity.norm_squared());
        Speed { likely, certain: (likely - 3.0 * libm::sqrtf(variance)).max(0.0) }
    }

    /// Gyroscope bias.
    pub fn gyro_bias(&self) -> GyroBias {
        GyroBias(self.gyro_bias)
    }

    /// Accelerometer bias.
    pub fn accel_bias(&self) -> AccelBias {
        AccelBias(self.accel_bias)
    }

    /// Lever arm from the pivot of the standing foot to the sensor. **Units:** m; **Frame:** sensor.
    pub fn lever(&self) -> Vector3<f32> {
        self.lever
    }

    /// How often the covariance had to be repaired.
    pub fn repaired(&self) -> u32 {
        self.repaired
    }
}

/// What an update may not freely correct.
#[derive(Clone, Copy)]
enum Considered {
    Nothing,
    HeadingAndBias,
}

/// Sigma points are drawn at least this far out, so that their difference keeps its digits. **Units:** rad.
const LEAST_SPREAD: f32 = 1e-3;
/// Keeps the position from being known better than `f32` can say. **Units:** m²/s.
const POSITION_NOISE: f32 = 1e-8;
/// A hole hides no more than this: the foot comes to stand again. **Units:** s.
const LONGEST_GAP_S: f32 = 2.0;

/// When in an unseen time the foot set out is anyone's guess: standard deviation of an even spread. **Units:** 1, of that time.
const SET_OUT: f32 = 0.29;

/// A day: no bias drifts for longer. **Units:** s.
const LONGEST_REST_S: f32 = 86_400.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::covariance::{repair, square_root};
    use crate::preintegration::{self, Preintegrator};
    use crate::sample::ImuSample;
    use crate::time::Micros;
    use proptest::prelude::*;
    use std::vec::Vec;

    const UP: Vector3<f32> = Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2);

    fn started(accel: &Vector3<f32>) -> PivotFilter {
        let mut filter = PivotFilter::new(&Parameters::default());
        filter.start(accel, Some((Vector3::zeros(), 4e-4)));
        filter
    }

    /// Increments of a sensor that rocks about a pivot at rest: angle `0.1 sin 5 t` about y. `lever` from the pivot.
    fn rocking(lever: &Vector3<f32>, seconds: f32) -> Vec<Increment> {
        swaying(0.1, lever, seconds)
    }

    /// The same with an angle of `amplitude`.
    fn swaying(amplitude: f32, lever: &Vector3<f32>, seconds: f32) -> Vec<Increment> {
        let mut integrator = Preintegrator::new(&preintegration::Parameters::default());
        (0..(seconds * 500.0) as i64)
            .filter_map(|i| {
                let t = i as f32 * 0.002;
                let (sin, cos) = libm::sincosf(5.0 * t);
                let turned = so3::exp(&Vector3::new(0.0, amplitude * sin, 0.0));
                let rate = Vector3::new(0.0, 5.0 * amplitude * cos, 0.0);
                let change = Vector3::new(0.0, -25.0 * amplitude * sin, 0.0);
                let accel = turned.inverse() * UP + change.cross(lever) + rate.cross(&rate.cross(lever));
                let sample = ImuSample::new(Micros(i * 2_000), accel.into(), rate.into());
                integrator.push(&sample, GyroBias::zero(), AccelBias::zero())
            })
            .collect()
    }

    #[test]
    fn the_lever_arm_is_found_where_the_rocking_shows_it() {
        let lever = Vector3::new(0.04, 0.0, 0.09);
        let mut filter = started(&UP);
        for increment in rocking(&lever, 20.0) {
            filter.predict(&increment);
            filter.update_zero_velocity(0.01, false);
        }
        // 20 s of a sensor without noise; the axis of the rocking itself shows nothing.
        let error = filter.lever() - lever;
        assert!(error.x.abs() < 0.004 && error.z.abs() < 0.004, "{:?}", filter.lever());
        assert!(filter.covariance()[(LEVER + 2, LEVER + 2)] < 1e-4);
        assert!(filter.covariance()[(LEVER + 1, LEVER + 1)] > 5e-3);
    }

    #[test]
    fn the_prediction_is_the_derivative_of_the_motion() {
        let mut filter = started(&Vector3::new(1.0, 2.0, 9.0));
        filter.state.velocity = Vector3::new(1.0, -0.5, 0.3);
        let increment = Increment {
            turn: so3::exp(&Vector3::new(0.02, -0.05, 0.03)),
            velocity: Vector3::new(0.2, -0.1, 0.15),
            position: Vector3::new(0.001, -0.0005, 0.0008),
            ..rocking(&Vector3::zeros(), 0.1)[0]
        };
        let dt = increment.duration();
        let moved = |filter: &PivotFilter, gyro: Vector3<f32>, accel: Vector3<f32>| {
            let mut next = filter.clone();
            let mut increment = increment;
            increment.turn *= so3::exp(&(-gyro * dt));
            increment.velocity -= accel * dt;
            next.predict(&increment);
            next.state
        };
        let nominal = moved(&filter, Vector3::zeros(), Vector3::zeros());
        // Column by column, by a small step in each error.
        let mut expected = Covariance::identity();
        for column in 0..LEVER {
            let mut changed = filter.clone();
            let mut direction = Direction::zeros();
            let size = 0.02;
            direction[column] = size;
            let (mut gyro, mut accel) = (Vector3::zeros(), Vector3::zeros());
            if (GYRO_BIAS..ACCEL_BIAS).contains(&column) {
                gyro[column - GYRO_BIAS] = size;
            } else if column >= ACCEL_BIAS {
                accel[column - ACCEL_BIAS] = size;
            } else {
                changed.apply(&direction);
            }
            let difference = moved(&changed, gyro, accel).box_minus(&nominal) / size;
            for row in 0..GYRO_BIAS {
                expected[(row, column)] = difference[row];
            }
        }
        let before = Covariance::from_fn(|i, j| if i == j { 1.0 } else { 0.01 * ((i + j) % 7) as f32 });
        filter.covariance = before;
        let predicted = {
            let (velocity_turn, _) = filter.turned(&increment.velocity, &filter.spread());
            let (position_turn, _) = filter.turned(&increment.position, &filter.spread());
            let rotation = filter.state.attitude.to_rotation_matrix();
            let back = increment.turn.inverse().to_rotation_matrix();
            filter.propagate(back.matrix(), &velocity_turn, &position_turn, &(rotation.matrix() * -dt), dt);
            filter.covariance
        };
        let wanted = expected * before * expected.transpose();
        // Sigma points one radian out against a derivative: sin(1) for 1 in what the rotation (0.25 m/s) does.
        assert!((predicted - wanted).amax() < 0.25 * 0.25, "{}", (predicted - wanted).amax());
        let linear = |m: &Covariance| m.fixed_view::<12, 12>(VELOCITY, VELOCITY).into_owned();
        assert!((linear(&predicted) - linear(&wanted)).fixed_view::<9, 9>(3, 3).amax() < 1e-4);
    }

    #[test]
    fn zero_velocity_leaves_considered_heading_and_bias_alone() {
        let mut filter = started(&UP);
        filter.parameters.heading_share = 0.0;
        let increments = rocking(&Vector3::new(0.0, 0.0, 0.1), 2.0);
        for increment in &increments {
            filter.predict(increment);
        }
        filter.state.velocity = Vector3::new(0.4, -0.3, 0.2);
        let before = filter.clone();
        filter.update_zero_velocity(0.01, false);
        assert!(so3::turn(&before.state.attitude, &filter.state.attitude).abs() < 1e-4);
        let up = before.state.up();
        assert!((filter.gyro_bias - before.gyro_bias).dot(&up).abs() < 1e-7);
        assert!(filter.state.velocity.norm() < 0.1);
        // Its uncertainty is not lost either: nothing was learnt.
        let heading = |filter: &PivotFilter| filter.change().covariance[(3, 3)];
        assert!((heading(&filter) / heading(&before) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn in_an_elevator_the_vertical_velocity_is_free() {
        let mut filter = started(&UP);
        filter.state.velocity = Vector3::new(0.1, 0.1, 1.5);
        filter.update_zero_velocity(0.01, true);
        assert!((filter.state.velocity.z - 1.5).abs() < 1e-3);
    }

    #[test]
    fn a_rest_shows_the_bias_and_the_vertical() {
        let mut filter = started(&Vector3::new(0.0, 0.02, STANDARD_GRAVITY_M_S2));
        let bias = Vector3::new(2e-4, -3e-4, 4e-4);
        for _ in 0..200 {
            let gyro = bias - filter.gyro_bias;
            let accel = UP - filter.accel_bias;
            filter.update_rest(&gyro, 4e-4, &accel);
        }
        assert!((filter.gyro_bias - bias).norm() < 2e-5);
        // Tilt and horizontal accelerometer bias cannot be told apart at rest; together they explain what is seen.
        let seen = filter.state.up() * STANDARD_GRAVITY_M_S2 + filter.accel_bias;
        assert!((seen - UP).norm() < 2e-3);
    }

    /// Level strides whose heel is still falling, by 30 mm/s, when it is taken for standing. The next stride then seems to
    /// end 30 mm/s too fast.
    fn bent_by_level_strides(strides: usize, parameters: &Parameters) -> PivotFilter {
        let mut filter = PivotFilter::new(parameters);
        filter.start(&UP, Some((Vector3::zeros(), 4e-4)));
        for _ in 0..strides {
            for increment in &swaying(0.0, &Vector3::zeros(), 1.0) {
                filter.predict(increment);
            }
            filter.state.velocity.z += 0.03;
            filter.update_zero_velocity(0.01, false);
            filter.update_height(0.0, 1.0);
            filter.rebase();
        }
        filter
    }

    fn bias_along_the_vertical(filter: &PivotFilter) -> f32 {
        filter.accel_bias.dot(&filter.state.up())
    }

    #[test]
    fn level_strides_bend_the_bias_that_a_rest_has_shown_but_little() {
        let believed = Parameters { force_bias_share: 1.0, force_sigma: 0.1, ..Parameters::default() };
        let ignored = Parameters { force_bias_share: 0.0, ..Parameters::default() };
        let bent = |parameters| bias_along_the_vertical(&bent_by_level_strides(5, parameters));
        let [free, default, held] = [&believed, &Parameters::default(), &ignored].map(bent);
        assert!(free > 0.02 && default < 0.67 * free, "{free} {default}");
        assert!(held.abs() < 1e-3, "{held}");
    }

    #[test]
    fn a_rest_shows_the_bias_along_the_vertical_again() {
        let mut filter = bent_by_level_strides(40, &Parameters::default());
        let rest = Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2 - 0.02);
        for _ in 0..200 {
            let turned = filter.state.attitude.inverse() * rest;
            filter.update_rest(&Vector3::zeros(), 4e-4, &(turned - filter.accel_bias));
        }
        let bias = bias_along_the_vertical(&filter);
        // Two hundred rests weigh ten times what strides have bent.
        assert!((bias + 0.02).abs() < 2e-3, "{bias}");
    }

    /// A month of walking in ten minutes' worth of strides would take too long here; what must not grow shows in an hour.
    #[test]
    fn nothing_grows_over_thousands_of_steps() {
        let stance = rocking(&Vector3::new(0.0, 0.0, 0.08), 0.4);
        let mut filter = started(&UP);
        let mut early = None;
        for step in 0..3_000 {
            for increment in &stance {
                filter.predict(increment);
                filter.update_zero_velocity(0.01, false);
            }
            filter.update_height(0.0, 1.0);
            let change = filter.rebase();
            assert!(square_root(&change.covariance).is_some());
            if step == 100 {
                early = Some(change.covariance);
            }
            if step == 2_999 {
                let growth = change.covariance.trace() / early.unwrap().trace();
                assert!((0.5..1.2).contains(&growth), "{growth}");
            }
        }
        assert_eq!(filter.repaired(), 0);
        assert!(filter.is_finite());
    }

    proptest! {
        #[test]
        fn the_covariance_stays_one_whatever_comes(
            steps in proptest::collection::vec((0_usize..6, proptest::array::uniform6(-30.0_f32..30.0), 1e-3_f32..1.0), 1..60),
        ) {
            let mut filter = started(&UP);
            for (what, v, sigma) in steps {
                let accel = Vector3::new(v[0], v[1], v[2]);
                let gyro = Vector3::new(v[3], v[4], v[5]) * 0.3;
                match what {
                    0 => filter.update_zero_velocity(sigma, v[0] > 0.0),
                    1 => filter.update_height(v[0] * 0.01, sigma),
                    2 => filter.update_rest(&gyro, sigma, &accel),
                    3 => { filter.rebase(); }
                    _ => {
                        let mut integrator = Preintegrator::new(&preintegration::Parameters::default());
                        for i in 0..4 {
                            let sample = ImuSample::new(Micros(i * 5_000), (accel + UP).into(), gyro.into());
                            if let Some(increment) = integrator.push(&sample, filter.gyro_bias(), filter.accel_bias()) {
                                filter.predict(&increment);
                            }
                        }
                    }
                }
                prop_assert!(filter.is_finite());
                let m = filter.covariance;
                prop_assert_eq!(m, m.transpose());
                prop_assert!((0..FREEDOMS).all(|i| m[(i, i)] >= 0.0));
            }
            let change = filter.rebase();
            prop_assert!((0..4).all(|i| change.covariance[(i, i)] >= 0.0));
            let mut repaired = filter.covariance;
            repair(&mut repaired);
            prop_assert!(repaired.iter().all(|value| value.is_finite()));
        }
    }
}
