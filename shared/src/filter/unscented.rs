//! The document's filter: an unscented Kalman filter on the manifold of attitude, position and velocity.
//!
//! Between stances [`UnscentedFilter::predict`] takes every sample in. What is known of a foot that stands comes in
//! as pseudo-measurements: gravity points down (H1), the foot does not move (H2, in an elevator only not sideways: H5),
//! it is where it began (H3) or on a floor of known height (H4).
//!
//! # Source
//! Foot, 4.1.4 (the filter, after Hertzberg et al.), 4.3 (the state), 4.4 (the models). Sigma points are drawn for the
//! state and both measurements together, 15 degrees of freedom and 31 points in the prediction, 19 in an update.
//!
//! A covariance that has lost positive definiteness is repaired and counted. A sample or a measurement whose result
//! would not be a number is refused and counted; nothing leads to a panic or to a value that is not a number.

use super::covariance::{LARGEST, add_outer, divide, limit_variance, mirror, repair, repaired_square_root};
use super::rebase::{self, Change};
use super::state::{Difference, FREEDOMS, POSITION, ROTATION, State, VELOCITY};
use crate::sample::{AccelCorrected, GyroCorrected, STANDARD_GRAVITY_M_S2};
use crate::so3;
use crate::step::FloorMode;
use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};

/// Covariance of a [`State`], in the order of [`Difference`].
pub type Covariance = SMatrix<f32, FREEDOMS, FREEDOMS>;

/// Sigma points of state, gyroscope and accelerometer together.
const POINTS: usize = 2 * (FREEDOMS + 6) + 1;
/// Turns of the iteration for the mean (Foot, 4.52); it converges to a rounding in three.
const MEAN_TURNS: usize = 8;
/// The mean has been found when its rotation moves by less. **Units:** rad.
const MEAN_FOUND: f32 = 1e-7;
/// A rotation variance is held at this. **Units:** rad². Three axes of it make a sigma point of 3 rad, and no rotation
/// vector is longer than pi.
const LARGEST_ROTATION: f32 = 3.0;

/// Noise and trust. Variances, as the document states them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Variance of every component of the state at the start (4.59). **Units:** rad², m², (m/s)².
    pub start: f32,
    /// Growth of the variance of the rotation (4.67). **Units:** rad²/s.
    pub rotation_noise: f32,
    /// Growth of the variance of the position (4.68). **Units:** m²/s.
    pub position_noise: f32,
    /// Growth of the variance of the velocity (4.68). **Units:** (m/s)²/s.
    pub velocity_noise: f32,
    /// Variance of a sample of the gyroscope (4.71). **Units:** (rad/s)².
    pub gyro: f32,
    /// Variance of a sample of the accelerometer (4.72). **Units:** (m/s²)².
    pub accel: f32,
    /// Variance of H1 (4.75). **Units:** (m/s²)².
    pub gravity: f32,
    /// Variance of H2 in INIT (4.78). **Units:** (m/s)².
    pub init_velocity: f32,
    /// Variance of H3 (4.78). **Units:** m².
    pub init_position: f32,
    /// Variance of H2 and H5 in a stance (4.79). **Units:** (m/s)².
    pub stance_velocity: f32,
    /// Variance of H4 (4.80). **Units:** m².
    pub height: f32,
}

impl Parameters {
    /// The values of the document.
    pub fn documented() -> Self {
        Self {
            start: 1.0,
            rotation_noise: 1e-4,
            position_noise: 1e-3,
            velocity_noise: 1e-3,
            gyro: 2.3882e-5,
            accel: 1e-2,
            gravity: 1.0,
            init_velocity: 1e-4,
            init_position: 1e-4,
            stance_velocity: 1e-1,
            height: 1e-1,
        }
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Self::documented()
    }
}

/// The filter.
#[derive(Clone, Debug)]
pub struct UnscentedFilter {
    parameters: Parameters,
    state: State,
    covariance: Covariance,
    gravity: f32,
    /// Attitude at the last re-base.
    reference: UnitQuaternion<f32>,
    repaired: u32,
    refused: u32,
}

impl UnscentedFilter {
    /// A filter at its start values: level, at rest, under standard gravity.
    pub fn new(parameters: &Parameters) -> Self {
        let mut filter = Self {
            parameters: *parameters,
            state: State::at_rest(UnitQuaternion::identity()),
            covariance: Covariance::zeros(),
            gravity: STANDARD_GRAVITY_M_S2,
            reference: UnitQuaternion::identity(),
            repaired: 0,
            refused: 0,
        };
        filter.start(UnitQuaternion::identity(), STANDARD_GRAVITY_M_S2);
        filter
    }

    /// Begins anew at rest in the origin, with the document's start covariance (4.57 - 4.59). **Units:** `gravity` is the
    /// magnitude measured at rest (4.73), m/s².
    ///
    /// The document starts with the identity, whatever the mounting, and leaves the rest to H1. That takes longer the
    /// further the sensor is tilted, and does not succeed for one that lies exactly on its back; [`so3::level`] gives an
    /// attitude that suits every mounting.
    pub fn start(&mut self, attitude: UnitQuaternion<f32>, gravity: f32) {
        self.state = State::at_rest(so3::renormalised(&attitude));
        self.covariance = Covariance::from_diagonal_element(self.parameters.start);
        repair(&mut self.covariance);
        limit(&mut self.covariance);
        self.gravity = if gravity.is_finite() { gravity } else { STANDARD_GRAVITY_M_S2 };
        self.reference = self.state.attitude;
        self.repaired = 0;
        self.refused = 0;
    }

    /// Takes one sample in that stands for the `dt` before it. **Units:** s. No time, or time running backwards, changes
    /// nothing.
    ///
    /// # Source
    /// Foot, 4.39 - 4.42 with the augmented state 4.69, 4.70 and the models 4.62 - 4.68.
    pub fn predict(&mut self, gyro: GyroCorrected, accel: AccelCorrected, dt: f32) {
        if dt <= 0.0 {
            return;
        }
        if !(gyro.0.iter().chain(&accel.0).all(|value| value.is_finite()) && dt.is_finite()) {
            self.refused = self.refused.saturating_add(1);
            return;
        }
        let root = self.square_root();
        let points = self.predicted_points(&root, &gyro.0, &accel.0, dt);
        let state = mean(&points);
        let Parameters { rotation_noise, position_noise, velocity_noise, .. } = self.parameters;
        let mut covariance = Covariance::zeros();
        for point in &points {
            add_outer(&mut covariance, &point.box_minus(&state), 0.5);
        }
        mirror(&mut covariance);
        for axis in 0..3 {
            covariance[(ROTATION + axis, ROTATION + axis)] += rotation_noise * dt;
            covariance[(POSITION + axis, POSITION + axis)] += position_noise * dt;
            covariance[(VELOCITY + axis, VELOCITY + axis)] += velocity_noise * dt;
        }
        self.accept(state, covariance);
    }

    /// The sigma points of state, angular rate and specific force, each moved on by `dt`.
    ///
    /// The joint covariance (4.70) has no entries between its three blocks, so neither has its square root: a point
    /// differs from the mean either in the state or in one axis of one measurement.
    fn predicted_points(
        &self,
        root: &Covariance,
        gyro: &Vector3<f32>,
        accel: &Vector3<f32>,
        dt: f32,
    ) -> [State; POINTS] {
        let gyro_sigma = libm::sqrtf(self.parameters.gyro);
        let accel_sigma = libm::sqrtf(self.parameters.accel);
        let turn = so3::exp(&(gyro * dt));
        let mut points = [self.state.advanced(&turn, accel, self.gravity, dt); POINTS];
        let mut next = points.iter_mut().skip(1);
        let mut draw = |point: State| {
            if let Some(slot) = next.next() {
                *slot = point;
            }
        };
        for column in root.column_iter() {
            for d in [column.into_owned(), -column] {
                draw(self.state.box_plus(&d).advanced(&turn, accel, self.gravity, dt));
            }
        }
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut rate = *gyro;
                rate[axis] += sign * gyro_sigma;
                draw(self.state.advanced(&so3::exp(&(rate * dt)), accel, self.gravity, dt));
                let mut force = *accel;
                force[axis] += sign * accel_sigma;
                draw(self.state.advanced(&turn, &force, self.gravity, dt));
            }
        }
        points
    }

    /// INIT: the foot is flat and still where it began. H1, H2 and H3 with the covariances of 4.75 and 4.78.
    pub fn initialise(&mut self, accel: AccelCorrected) {
        self.update_gravity(accel);
        self.update_zero_velocity(libm::sqrtf(self.parameters.init_velocity));
        self.update_zero_position();
    }

    /// The foot stands (4.4.2.2): H1, then as the ground asks H2 and H4 (level, `height` above the origin), H2 (stairs)
    /// or H5 (elevator). **Units:** m.
    pub fn stand(&mut self, accel: AccelCorrected, ground: FloorMode, height: f32) {
        self.update_gravity(accel);
        let sigma = libm::sqrtf(self.parameters.stance_velocity);
        match ground {
            FloorMode::Level => {
                self.update_zero_velocity(sigma);
                self.update_height(height);
            }
            FloorMode::Stairs => self.update_zero_velocity(sigma),
            FloorMode::Elevator => self.update_horizontal_velocity(sigma),
        }
    }

    /// H1: the accelerometer reads gravity alone (4.74, 4.75).
    pub fn update_gravity(&mut self, accel: AccelCorrected) {
        let gravity = self.gravity;
        self.update(&accel.0, self.parameters.gravity, |state| state.up() * gravity);
    }

    /// H2: the foot does not move (4.76). **Units:** `sigma` is the standard deviation, m/s.
    pub fn update_zero_velocity(&mut self, sigma: f32) {
        self.update(&Vector3::zeros(), sigma * sigma, |state| state.velocity);
    }

    /// H3: the foot is in the origin (4.77, 4.78).
    pub fn update_zero_position(&mut self) {
        self.update(&Vector3::zeros(), self.parameters.init_position, |state| state.position);
    }

    /// H4: the foot is on a floor at this height above the origin (4.80). **Units:** m.
    pub fn update_height(&mut self, height: f32) {
        self.update(&SVector::<f32, 1>::new(height), self.parameters.height, |state| [state.position.z].into());
    }

    /// H5: the foot does not move sideways (4.81). **Units:** `sigma` is the standard deviation, m/s.
    pub fn update_horizontal_velocity(&mut self, sigma: f32) {
        self.update(&SVector::<f32, 2>::zeros(), sigma * sigma, |state| state.velocity.xy());
    }

    /// One correction by a measurement `z` of `model`, each component with the same variance.
    ///
    /// # Source
    /// Foot, 4.43 - 4.50. The differences of the sigma points to their mean in 4.47 are the columns they were drawn
    /// with, by axiom 4.35.
    fn update<const M: usize>(
        &mut self,
        z: &SVector<f32, M>,
        variance: f32,
        model: impl Fn(&State) -> SVector<f32, M>,
    ) {
        if !(variance >= 0.0 && variance.is_finite() && z.iter().all(|value| value.is_finite())) {
            self.refused = self.refused.saturating_add(1);
            return;
        }
        let root = self.square_root();
        let centre = model(&self.state);
        let read: [[SVector<f32, M>; 2]; FREEDOMS] = core::array::from_fn(|i| {
            let column: Difference = root.column(i).into_owned();
            [column, -column].map(|d| model(&self.state.box_plus(&d)))
        });
        let sum = read.iter().flatten().fold(centre, |sum, z| sum + z);
        let expected = sum / (2 * FREEDOMS + 1) as f32;
        let mut spread = SMatrix::<f32, M, M>::zeros();
        let mut joint = SMatrix::<f32, FREEDOMS, M>::zeros();
        add_outer(&mut spread, &(centre - expected), 0.5);
        for (i, [plus, minus]) in read.iter().enumerate() {
            add_outer(&mut spread, &(plus - expected), 0.5);
            add_outer(&mut spread, &(minus - expected), 0.5);
            joint += root.column(i) * (0.5 * (plus - minus)).transpose();
        }
        mirror(&mut spread);
        for component in 0..M {
            spread[(component, component)] += variance;
        }
        let (spread_root, repaired) = repaired_square_root(&mut spread);
        self.repaired = self.repaired.saturating_add(u32::from(repaired));
        let gain = divide(&joint, &spread_root);
        let correction: Difference = gain * (z - expected);
        let state = self.state.box_plus(&correction);
        // K Szz K^T, as the outer products of the columns of K L.
        let mut covariance = self.covariance;
        let taken = gain * spread_root;
        for column in taken.column_iter() {
            add_outer(&mut covariance, &column.into_owned(), -1.0);
        }
        mirror(&mut covariance);
        self.accept(state, covariance);
    }

    /// The square root of the covariance, which is repaired first if it has none.
    fn square_root(&mut self) -> Covariance {
        let (root, repaired) = repaired_square_root(&mut self.covariance);
        self.repaired = self.repaired.saturating_add(u32::from(repaired));
        root
    }

    /// Goes on with a result, unless it is not made of numbers that leave room for the next.
    fn accept(&mut self, state: State, mut covariance: Covariance) {
        if !(state.is_within(LARGEST) && covariance.iter().all(|value| value.is_finite())) {
            self.refused = self.refused.saturating_add(1);
            return;
        }
        limit(&mut covariance);
        self.state = state;
        self.covariance = covariance;
    }

    /// The change since the last re-base or start.
    pub fn change(&self) -> Change {
        rebase::change(&self.reference, &self.state, &self.covariance)
    }

    /// Makes the place and the heading of the foot the new origin, known exactly, and returns the change since the last.
    /// The world is turned by the turn of that change (see [`rebase`]).
    pub fn rebase(&mut self) -> Change {
        let change = self.change();
        rebase::rebase(&mut self.state, &mut self.covariance, change.turn);
        limit(&mut self.covariance);
        self.reference = self.state.attitude;
        change
    }

    /// Attitude, position and velocity. **Frame:** heading frame of the last re-base.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Covariance of the state: rotation (sensor frame), position, velocity. **Units:** rad, m, m/s, squared.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// How many matrices had lost positive definiteness and were repaired, since the start.
    pub fn repaired(&self) -> u32 {
        self.repaired
    }

    /// How many samples and measurements were refused because their result would not be a number, since the start.
    pub fn refused(&self) -> u32 {
        self.refused
    }
}

/// Holds every variance where the format can carry it.
fn limit(covariance: &mut Covariance) {
    for i in 0..FREEDOMS {
        limit_variance(covariance, i, if i < POSITION { LARGEST_ROTATION } else { LARGEST });
    }
}

/// The mean of sigma points on the manifold (Foot, 4.51 - 4.53). Vectors add, so only the rotation needs the iteration.
fn mean(points: &[State; POINTS]) -> State {
    let mut mean = points[0];
    for _ in 0..MEAN_TURNS {
        let sum = points.iter().fold(Difference::zeros(), |sum, point| sum + point.box_minus(&mean));
        let step = sum / POINTS as f32;
        mean = mean.box_plus(&step);
        if step.fixed_rows::<3>(ROTATION).norm_squared() < MEAN_FOUND * MEAN_FOUND {
            break;
        }
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::covariance::square_root;
    use proptest::prelude::*;

    const DT: f32 = 0.005;
    const G: f32 = 9.81;

    fn rate(v: [f32; 3]) -> GyroCorrected {
        GyroCorrected(v.into())
    }

    fn force(v: [f32; 3]) -> AccelCorrected {
        AccelCorrected(v.into())
    }

    /// Stands still with the vertical along `up` of the sensor, and initialises.
    fn initialised(start: UnitQuaternion<f32>, up: Vector3<f32>, samples: usize) -> UnscentedFilter {
        let mut filter = UnscentedFilter::new(&Parameters::documented());
        filter.start(start, G);
        for _ in 0..samples {
            filter.predict(rate([0.0; 3]), AccelCorrected(up * G), DT);
            filter.initialise(AccelCorrected(up * G));
        }
        filter
    }

    /// Whether the filter holds nothing but numbers and a covariance.
    fn is_sound(filter: &UnscentedFilter) -> bool {
        let mut covariance = filter.covariance;
        // A re-base turns the velocity, which rounds its length.
        filter.state.is_within(LARGEST * (1.0 + 1e-6))
            && (filter.state.attitude.coords.norm() - 1.0).abs() < 1e-5
            && covariance == covariance.transpose()
            && covariance.iter().all(|value| value.is_finite())
            && square_root(&{
                repaired_square_root(&mut covariance);
                covariance
            })
            .is_some()
    }

    #[test]
    fn initialisation_finds_the_tilt_from_the_documents_start_and_leaves_the_heading_open() {
        for up in [Vector3::new(0.5, 0.3, 0.8), Vector3::new(-0.9, 0.2, 0.1), Vector3::z()] {
            let up = up.normalize();
            let filter = initialised(UnitQuaternion::identity(), up, 400);
            let error = filter.state.attitude * up;
            // The document's H1 has a standard deviation of 1 m/s², a tenth of a radian: 400 samples leave 5 mrad.
            assert!((error - Vector3::z()).norm() < 5e-3, "{up:?}: {error:?}");
            if up == Vector3::z() {
                assert!(filter.change().covariance[(3, 3)] > 1.0);
            }
            let across = filter.state.attitude.inverse() * Vector3::x();
            let tilt = (across.transpose() * filter.covariance.fixed_view::<3, 3>(0, 0) * across)[0];
            assert!(tilt < 1e-3, "{up:?}: the variance of the tilt is {tilt}");
            assert!(filter.state.position.norm() < 0.02 && filter.state.velocity.norm() < 0.02);
            assert_eq!((filter.repaired(), filter.refused()), (0, 0));
        }
    }

    #[test]
    fn a_levelled_start_is_right_for_every_mounting() {
        for up in [-Vector3::z(), Vector3::x(), -Vector3::x(), Vector3::y(), Vector3::new(0.57, 0.17, -0.8)] {
            let up = up.normalize();
            let filter = initialised(so3::level(&up), up, 100);
            assert!((filter.state.attitude * up - Vector3::z()).norm() < 1e-4);
            assert!(filter.state.position.norm() < 1e-3 && filter.state.velocity.norm() < 1e-3);
        }
    }

    #[test]
    fn standing_holds_everything_but_the_heading() {
        let mut filter = initialised(UnitQuaternion::identity(), Vector3::z(), 100);
        filter.rebase();
        let mut noise = 1_u32;
        let mut next = || {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 8) as f32 / 16_777_216.0 - 0.5
        };
        for _ in 0..12_000 {
            // Even noise of the document's variances: the width is sqrt(12) standard deviations.
            let gyro = rate([next() * 0.017, next() * 0.017, next() * 0.017]);
            let accel = force([next() * 0.35, next() * 0.35, G + next() * 0.35]);
            filter.predict(gyro, accel, DT);
            filter.stand(accel, FloorMode::Level, 0.0);
        }
        let state = filter.state();
        assert!((state.up() - Vector3::z()).norm() < 5e-3);
        // 143 samples of 0.1 m/s² over 5 ms within the memory of H2 (gain 0.007): 4e-3 m/s for an axis, times four; and a
        // minute of that for the position.
        assert!(state.velocity.norm() < 0.02 && state.position.norm() < 0.2);
        // A minute of 1e-4 rad²/s, and 12 000 samples of 2.4e-5 (rad/s)² over 5 ms each. H1 to H4 leave the heading alone, up to
        // second order in the tilt.
        let expected = 60.0 * 1e-4 + 12_000.0 * 2.3882e-5 * DT * DT;
        let heading = filter.change().covariance[(3, 3)];
        assert!((heading - expected).abs() < 0.02 * expected, "{heading} against {expected}");
        assert_eq!((filter.repaired(), filter.refused()), (0, 0));
    }

    #[test]
    fn in_an_elevator_the_vertical_velocity_is_free() {
        let ride = |ground: FloorMode| {
            let mut filter = initialised(UnitQuaternion::identity(), Vector3::z(), 200);
            filter.rebase();
            // 2 s of 0.5 m/s² upwards while the foot stands.
            for _ in 0..400 {
                filter.predict(rate([0.0; 3]), force([0.0, 0.0, G + 0.5]), DT);
                filter.stand(force([0.0, 0.0, G + 0.5]), ground, 0.0);
            }
            *filter.state()
        };
        let elevator = ride(FloorMode::Elevator);
        // The only loss is that of f32 over 400 sums.
        assert!((elevator.velocity - Vector3::new(0.0, 0.0, 1.0)).norm() < 1e-3);
        assert!((elevator.position - Vector3::new(0.0, 0.0, 1.0)).norm() < 1e-3);
        // On stairs the zero velocity holds it back: the gain settles at sqrt(5e-6 / 0.1) for each sample, behind which
        // 0.5 m/s² lags 0.36 m/s. On the level the height does as well.
        assert!(ride(FloorMode::Stairs).velocity.z < 0.4);
        assert!(ride(FloorMode::Level).position.z < ride(FloorMode::Stairs).position.z);
    }

    #[test]
    fn a_known_height_draws_the_foot_there() {
        let mut filter = initialised(UnitQuaternion::identity(), Vector3::z(), 200);
        for _ in 0..2_000 {
            filter.predict(rate([0.0; 3]), force([0.0, 0.0, G]), DT);
        }
        let before = *filter.state();
        for _ in 0..2_000 {
            filter.update_height(3.2);
        }
        assert!((filter.state().position.z - 3.2).abs() < 0.02);
        assert!((filter.state().position.xy() - before.position.xy()).norm() < 0.02);
    }

    #[test]
    fn what_would_not_be_a_number_is_refused_and_counted() {
        let mut filter = initialised(UnitQuaternion::identity(), Vector3::z(), 10);
        let before = filter.clone();
        filter.predict(rate([f32::NAN, 0.0, 0.0]), force([0.0, 0.0, G]), DT);
        filter.predict(rate([0.0; 3]), force([0.0, f32::INFINITY, G]), DT);
        filter.predict(rate([0.0; 3]), force([0.0, 0.0, G]), f32::NAN);
        filter.update_height(f32::NAN);
        filter.update_zero_velocity(f32::NAN);
        assert_eq!((filter.state, filter.covariance), (before.state, before.covariance));
        assert_eq!(filter.refused(), 5);
        filter.predict(rate([0.0; 3]), force([0.0, 0.0, G]), 0.0);
        filter.predict(rate([0.0; 3]), force([0.0, 0.0, G]), -1.0);
        assert_eq!((filter.state, filter.refused()), (before.state, 5));
    }

    #[test]
    fn a_lost_covariance_is_repaired_and_counted() {
        let mut filter = initialised(UnitQuaternion::identity(), Vector3::z(), 10);
        filter.covariance[(8, 5)] = 3.0;
        filter.covariance[(5, 8)] = 3.0;
        filter.predict(rate([0.0; 3]), force([0.0, 0.0, G]), DT);
        assert_eq!(filter.repaired(), 1);
        assert!(is_sound(&filter));
    }

    #[test]
    fn steps_without_end_keep_their_covariance() {
        let mut filter = initialised(UnitQuaternion::identity(), Vector3::z(), 200);
        let mut early = filter.rebase();
        for step in 0..4_000 {
            // Half a second of swing in 25 samples: forwards, with a pitch there and back and a slow turn.
            for i in 0..25 {
                let (sin, cos) = libm::sincosf(core::f32::consts::TAU * (i as f32 + 0.5) / 25.0);
                let tilt = 0.5 * (1.0 - cos);
                let (s, c) = libm::sincosf(tilt);
                let pull = 15.0 * sin;
                filter.predict(
                    rate([0.0, 3.0 * sin * core::f32::consts::TAU / 6.0, 0.1 * cos]),
                    force([c * pull - s * G, 0.0, c * G + s * pull]),
                    0.02,
                );
            }
            for _ in 0..15 {
                filter.predict(rate([0.0; 3]), force([0.0, 0.0, G]), 0.02);
                filter.stand(force([0.0, 0.0, G]), FloorMode::Level, 0.0);
            }
            let change = filter.rebase();
            if step == 20 {
                early = change;
            }
            if step > 20 {
                assert!((change.covariance - early.covariance).amax() < 0.02 * early.covariance.amax(), "step {step}");
                assert!((change.displacement - early.displacement).norm() < 0.02, "step {step}");
            }
        }
        assert!(is_sound(&filter));
        assert_eq!((filter.repaired(), filter.refused()), (0, 0));
    }

    /// One call of the filter's interface.
    #[derive(Clone, Copy, Debug)]
    enum Call {
        Predict([f32; 7]),
        Gravity([f32; 3]),
        ZeroVelocity(f32),
        ZeroPosition,
        Height(f32),
        HorizontalVelocity(f32),
        Rebase,
        Stand([f32; 3], f32),
    }

    /// Any value of the format, half of the time one of a size that a sensor may have.
    fn value() -> impl Strategy<Value = f32> {
        prop_oneof![-40.0_f32..40.0, any::<f32>(), Just(f32::NAN), Just(f32::INFINITY), Just(0.0), Just(1e20)]
    }

    fn call() -> impl Strategy<Value = Call> {
        prop_oneof![
            4 => proptest::array::uniform7(value()).prop_map(Call::Predict),
            2 => (proptest::array::uniform6(-40.0_f32..40.0), 1e-4_f32..2.0)
                .prop_map(|([a, b, c, d, e, f], dt)| Call::Predict([a, b, c, d, e, f, dt])),
            1 => proptest::array::uniform3(value()).prop_map(Call::Gravity),
            1 => value().prop_map(Call::ZeroVelocity),
            1 => Just(Call::ZeroPosition),
            1 => value().prop_map(Call::Height),
            1 => value().prop_map(Call::HorizontalVelocity),
            1 => Just(Call::Rebase),
            1 => (proptest::array::uniform3(value()), value()).prop_map(|(accel, height)| Call::Stand(accel, height)),
        ]
    }

    proptest! {
        #[test]
        fn hostile_calls_leave_it_sound(
            calls in proptest::collection::vec(call(), 1..40),
            start in proptest::array::uniform4(value()),
            gravity in value(),
        ) {
            let mut filter = UnscentedFilter::new(&Parameters::documented());
            let [w, x, y, z] = start;
            filter.start(UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)), gravity);
            for call in calls {
                match call {
                    Call::Predict([a, b, c, d, e, f, dt]) => filter.predict(rate([a, b, c]), force([d, e, f]), dt),
                    Call::Gravity(accel) => filter.update_gravity(force(accel)),
                    Call::ZeroVelocity(sigma) => filter.update_zero_velocity(sigma),
                    Call::ZeroPosition => filter.update_zero_position(),
                    Call::Height(height) => filter.update_height(height),
                    Call::HorizontalVelocity(sigma) => filter.update_horizontal_velocity(sigma),
                    Call::Stand(accel, height) => filter.stand(force(accel), FloorMode::Level, height),
                    Call::Rebase => {
                        let change = filter.rebase();
                        prop_assert!(change.displacement.iter().all(|value| value.is_finite()), "{call:?}: {change:?}");
                        prop_assert!(change.turn.is_finite() && change.covariance.iter().all(|value| value.is_finite()));
                    }
                }
                prop_assert!(is_sound(&filter), "after {call:?}: {filter:?}");
            }
        }

        #[test]
        fn hostile_parameters_leave_it_sound(values in proptest::array::uniform11(value())) {
            let [start, rotation_noise, position_noise, velocity_noise, gyro, accel, gravity, a, b, c, height] = values;
            let mut filter = UnscentedFilter::new(&Parameters {
                start, rotation_noise, position_noise, velocity_noise, gyro, accel, gravity,
                init_velocity: a, init_position: b, stance_velocity: c, height,
            });
            for _ in 0..5 {
                filter.predict(rate([0.1, 0.2, 0.3]), force([0.0, 1.0, G]), DT);
                filter.initialise(force([0.0, 1.0, G]));
                filter.stand(force([0.0, 1.0, G]), FloorMode::Level, 0.0);
                prop_assert!(is_sound(&filter), "{filter:?}");
            }
        }
    }
}
