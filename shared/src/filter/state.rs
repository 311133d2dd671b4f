//! Attitude, position and velocity of the foot as one point of a manifold, and how a sample moves it on.

use crate::so3;
use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};

/// Degrees of freedom of a [`State`]; errors are ordered rotation, position, velocity.
pub const FREEDOMS: usize = 9;
/// First component of the rotation error. **Units:** rad; **Frame:** sensor.
pub const ROTATION: usize = 0;
/// First component of the position error. **Units:** m; **Frame:** world.
pub const POSITION: usize = 3;
/// First component of the velocity error. **Units:** m/s; **Frame:** world.
pub const VELOCITY: usize = 6;

/// A difference of two states.
pub type Difference = SVector<f32, FREEDOMS>;

/// Where the foot is and how it moves (Foot, 4.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Turns sensor vectors into the world.
    pub attitude: UnitQuaternion<f32>,
    /// **Units:** m; **Frame:** world, z up.
    pub position: Vector3<f32>,
    /// **Units:** m/s; **Frame:** world, z up.
    pub velocity: Vector3<f32>,
}

/// Standard deviation of the vector that begins at component `first` of an error: root of the sum of its three variances.
pub fn sigma<const N: usize>(covariance: &SMatrix<f32, N, N>, first: usize) -> f32 {
    libm::sqrtf((first..first + 3).map(|axis| covariance[(axis, axis)].max(0.0)).sum())
}

impl State {
    /// At rest in the origin. Foot, 4.57 and 4.58 with the identity for the attitude.
    pub fn at_rest(attitude: UnitQuaternion<f32>) -> Self {
        Self { attitude, position: Vector3::zeros(), velocity: Vector3::zeros() }
    }

    /// `X [+] d` (Foot, 4.60).
    pub fn box_plus(&self, d: &Difference) -> Self {
        Self {
            attitude: so3::box_plus(&self.attitude, &part(d, ROTATION)),
            position: self.position + part(d, POSITION),
            velocity: self.velocity + part(d, VELOCITY),
        }
    }

    /// `X [-] other` (Foot, 4.61).
    pub fn box_minus(&self, other: &Self) -> Difference {
        let r = so3::box_minus(&self.attitude, &other.attitude);
        let p = self.position - other.position;
        let v = self.velocity - other.velocity;
        Difference::from([r.x, r.y, r.z, p.x, p.y, p.z, v.x, v.y, v.z])
    }

    /// The state after `dt` in which the sensor turned by `turn` and measured the specific force `accel`.
    /// **Units:** m/s², s; **Frame:** sensor. `gravity` is the magnitude.
    ///
    /// # Source
    /// Foot, 4.62 - 4.65.
    pub fn advanced(&self, turn: &UnitQuaternion<f32>, accel: &Vector3<f32>, gravity: f32, dt: f32) -> Self {
        let attitude = so3::renormalised(&(self.attitude * turn));
        let acceleration = attitude * accel - Vector3::new(0.0, 0.0, gravity);
        Self {
            attitude,
            position: self.position + self.velocity * dt + acceleration * (0.5 * dt * dt),
            velocity: self.velocity + acceleration * dt,
        }
    }

    /// The vertical as the sensor sees it: of length 1, pointing up. **Frame:** sensor.
    pub fn up(&self) -> Vector3<f32> {
        self.attitude.inverse() * Vector3::z()
    }

    /// Whether position and velocity are made of numbers, and neither is longer than `bound`: so that no turn of the world
    /// takes a component beyond it. **Units:** m and m/s.
    pub fn is_within(&self, bound: f32) -> bool {
        let vectors = [&self.position, &self.velocity];
        vectors.iter().all(|vector| vector.norm_squared() <= bound * bound)
            && self.attitude.coords.iter().all(|value| value.is_finite())
    }
}

/// The three components of a difference that begin at `first`.
pub fn part(d: &Difference, first: usize) -> Vector3<f32> {
    Vector3::new(d[first], d[first + 1], d[first + 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::FRAC_PI_2;
    use proptest::prelude::*;

    fn state() -> impl Strategy<Value = State> {
        proptest::array::uniform9(-1.0_f32..1.0).prop_map(|d| State {
            attitude: so3::exp(&(Vector3::new(d[0], d[1], d[2]) * 1.8)),
            position: Vector3::new(d[3], d[4], d[5]),
            velocity: Vector3::new(d[6], d[7], d[8]),
        })
    }

    /// A few roundings of values of size 1, twice the angle of a quaternion.
    const ROUNDING: f32 = 3e-6;

    proptest! {
        #[test]
        fn axiom_4_33_adding_nothing(x in state()) {
            prop_assert!(x.box_plus(&Difference::zeros()).box_minus(&x).norm() < ROUNDING);
        }

        #[test]
        fn axiom_4_34_adding_the_difference(x in state(), y in state()) {
            prop_assert!(y.box_minus(&x.box_plus(&y.box_minus(&x))).norm() < ROUNDING);
        }

        #[test]
        fn axiom_4_35_the_difference_of_a_sum(x in state(), d in proptest::array::uniform9(-1.0_f32..1.0)) {
            let d = Difference::from(d);
            prop_assert!((x.box_plus(&d).box_minus(&x) - d).norm() < ROUNDING);
        }
    }

    #[test]
    fn a_sensor_lying_on_its_side_accelerates_to_the_front() {
        // x of the sensor points up, its z to the world's -x: 1 m/s² along -z of the sensor on top of gravity.
        let side = so3::exp(&Vector3::new(0.0, -FRAC_PI_2, 0.0));
        let rest = State::at_rest(side);
        assert!((rest.up() - Vector3::x()).norm() < 1e-6);
        let moved = rest.advanced(&UnitQuaternion::identity(), &Vector3::new(9.81, 0.0, -1.0), 9.81, 0.1);
        assert!((moved.velocity - Vector3::new(0.1, 0.0, 0.0)).norm() < 1e-6);
        assert!((moved.position - Vector3::new(0.005, 0.0, 0.0)).norm() < 1e-7);
    }
}
