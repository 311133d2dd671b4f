//! What changed since the foot last stood, and the new beginning it makes.
//!
//! Neither the position nor the heading of the foot can be observed, so their variances grow without bound (Foot,
//! 4.4.2.2, ends with this as an open problem). They need not be known: a step is the change from one stance to the next.
//! At the end of each stance the filter therefore makes the place and the heading of the foot its new origin, which it
//! knows exactly, and goes on from there.
//!
//! # Frame
//! The filter's world is the heading frame of the last re-base (see [`crate::step`]): origin at the foot, z up, and with
//! each re-base turned by the turn of the foot since the one before. What the first one calls x is arbitrary.

use super::state::{FREEDOMS, POSITION, ROTATION, State, VELOCITY};
use crate::so3;
use nalgebra::{Matrix3, Matrix3x2, Matrix4, SMatrix, UnitQuaternion, Vector3};

/// The change of the foot since the last re-base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// **Units:** m; **Frame:** heading frame of the last re-base.
    pub displacement: Vector3<f32>,
    /// Turn about the vertical, counter-clockwise from above. **Units:** rad, in (-pi, pi].
    pub turn: f32,
    /// Covariance of (x, y, z, turn). **Units:** m², m rad, rad²; **Frame:** as the displacement.
    pub covariance: Matrix4<f32>,
}

impl Change {
    /// Whether every value is a number.
    pub fn is_finite(&self) -> bool {
        let numbers = self.displacement.iter().chain(&self.covariance).chain([&self.turn]);
        numbers.into_iter().all(|value| value.is_finite())
    }
}

/// The change from the attitude `reference`, at the origin, to `state`. `covariance` is that of the state; a filter may have
/// more states behind these nine, which stay as they are.
pub fn change<const N: usize>(
    reference: &UnitQuaternion<f32>,
    state: &State,
    covariance: &SMatrix<f32, N, N>,
) -> Change {
    // The error of the heading is the part of the rotation error about the vertical.
    let mut reading = SMatrix::<f32, 4, N>::zeros();
    reading.fixed_view_mut::<3, 3>(0, POSITION).copy_from(&Matrix3::identity());
    reading.fixed_view_mut::<1, 3>(3, ROTATION).copy_from(&state.up().transpose());
    let mut read = reading * covariance * reading.transpose();
    // What is known exactly may come out of the sum a rounding below zero.
    super::covariance::symmetrise(&mut read);
    super::covariance::repair_if_needed(&mut read);
    Change { displacement: state.position, turn: so3::turn(reference, &state.attitude), covariance: read }
}

/// Moves the origin to the foot and turns the world by `turn`: place and heading are known exactly from here on, tilt and
/// velocity as well as before.
///
/// The covariance goes through the derivative of this change, so it stays positive. What was not known of the heading is
/// not known of the direction of the velocity afterwards, and stays there.
pub fn rebase<const N: usize>(state: &mut State, covariance: &mut SMatrix<f32, N, N>, turn: f32) {
    let up = state.up();
    // What is left of a rotation error without its part about the vertical. As a product of the horizontal axes it has rank
    // two to rounding even where an axis of the sensor is almost vertical; 1 - up up^T has not.
    let sensor_from_world = state.attitude.inverse();
    let horizontal = Matrix3x2::from_columns(&[sensor_from_world * Vector3::x(), sensor_from_world * Vector3::y()]);
    let back = so3::rotation_about_z(-turn);
    let back_matrix = back.to_rotation_matrix();
    let sideways = back * Vector3::z().cross(&state.velocity);
    // The derivative of what is turned and mixed; of the states behind it, it is the identity.
    let mut derivative = SMatrix::<f32, FREEDOMS, FREEDOMS>::zeros();
    derivative.fixed_view_mut::<3, 3>(ROTATION, ROTATION).copy_from(&(horizontal * horizontal.transpose()));
    derivative.fixed_view_mut::<3, 3>(VELOCITY, ROTATION).copy_from(&(-sideways * up.transpose()));
    derivative.fixed_view_mut::<3, 3>(VELOCITY, VELOCITY).copy_from(back_matrix.matrix());
    // Column by column, then row by row: each is a function of itself alone.
    for j in 0..N {
        let mixed = derivative * covariance.fixed_view::<FREEDOMS, 1>(0, j);
        covariance.fixed_view_mut::<FREEDOMS, 1>(0, j).copy_from(&mixed);
    }
    for i in 0..N {
        let mixed = derivative * covariance.fixed_view::<1, FREEDOMS>(i, 0).transpose();
        covariance.fixed_view_mut::<1, FREEDOMS>(i, 0).tr_copy_from(&mixed);
    }
    super::covariance::symmetrise(covariance);
    *state = State {
        attitude: so3::renormalised(&(back * state.attitude)),
        position: Vector3::zeros(),
        velocity: back * state.velocity,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::covariance::repaired_square_root;
    use proptest::prelude::*;

    type Covariance = SMatrix<f32, FREEDOMS, FREEDOMS>;

    fn rotation() -> impl Strategy<Value = UnitQuaternion<f32>> {
        proptest::array::uniform3(-1.8_f32..1.8).prop_map(|v| so3::exp(&v.into()))
    }

    fn covariance() -> impl Strategy<Value = Covariance> {
        proptest::array::uniform32(-0.1_f32..0.1).prop_map(|entries| {
            let a = Covariance::from_fn(|i, j| entries[(7 * i + 5 * j + i * j) % 32]);
            a * a.transpose() + Covariance::from_diagonal_element(1e-4)
        })
    }

    proptest! {
        #[test]
        fn afterwards_place_and_heading_are_known(
            attitude in rotation(), m in covariance(), v in proptest::array::uniform3(-0.1_f32..0.1), turn in -3.0_f32..3.0,
        ) {
            let velocity = Vector3::from(v);
            let mut state = State { attitude, position: Vector3::new(1.0, 2.0, 3.0), velocity };
            let mut known = m;
            rebase(&mut state, &mut known, turn);
            prop_assert_eq!(state.position, Vector3::zeros());
            prop_assert!(known.fixed_view::<3, 9>(POSITION, 0).iter().all(|&x| x == 0.0));
            prop_assert_eq!(known, known.transpose());
            let heading = change(&state.attitude, &state, &known).covariance[(3, 3)];
            prop_assert!(heading.abs() < 1e-6 * m.fixed_view::<3, 3>(0, 0).trace());
            prop_assert!(!repaired_square_root(&mut known).1);
            // The tilt is known as well as before.
            let across = attitude.inverse() * Vector3::x();
            let tilt = |m: &Covariance, axis: &Vector3<f32>| (axis.transpose() * m.fixed_view::<3, 3>(0, 0) * axis)[0];
            prop_assert!((tilt(&known, &across) - tilt(&m, &across)).abs() < 1e-5 * tilt(&m, &across).max(1e-3));
            // The foot turned the other way round in the new frame; its tilt is as it was.
            prop_assert!((so3::turn(&attitude, &state.attitude) + turn).abs() < 1e-5);
            prop_assert!((state.up() - attitude.inverse() * Vector3::z()).norm() < 1e-6);
        }

        #[test]
        fn any_axis_of_the_sensor_may_point_up(m in covariance(), axis in 0_usize..3, sign in 0_usize..2, tilt in -8.0_f32..-1.0) {
            let mut up = Vector3::zeros();
            up[axis] = if sign == 0 { 1.0 } else { -1.0 };
            up[(axis + 1) % 3] = libm::powf(10.0, tilt);
            let mut state = State::at_rest(so3::level(&up));
            let mut known = m;
            rebase(&mut state, &mut known, 0.3);
            prop_assert!(!repaired_square_root(&mut known).1);
        }

        #[test]
        fn steps_laid_end_to_end_are_the_walk(turns in proptest::collection::vec((-1.0_f32..1.0, 0.0_f32..1.5), 1..20)) {
            let mounting = so3::level(&Vector3::new(5.6, 1.7, -7.9));
            let (mut heading, mut place) = (0.0_f32, Vector3::zeros());
            let (mut whole, mut stepped) = (State::at_rest(mounting), State::at_rest(mounting));
            let mut reference = mounting;
            for (turn, length) in turns {
                for state in [&mut whole, &mut stepped] {
                    let ahead = so3::turn(&mounting, &state.attitude);
                    state.position += so3::rotation_about_z(ahead) * Vector3::new(length, 0.0, 0.0);
                    state.attitude = so3::rotation_about_z(turn) * state.attitude;
                }
                let step = change(&reference, &stepped, &Covariance::identity());
                place += so3::rotation_about_z(heading) * step.displacement;
                heading += step.turn;
                rebase(&mut stepped, &mut Covariance::identity(), step.turn);
                reference = stepped.attitude;
            }
            // Twenty steps of rounding, on up to 30 m.
            prop_assert!((place - whole.position).norm() < 2e-4);
        }
    }

    #[test]
    fn the_covariance_of_the_turn_is_that_about_the_vertical() {
        // x of the sensor points up: the heading is the rotation about its x axis.
        let state = State::at_rest(so3::level(&Vector3::x()));
        let variances = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let m = Covariance::from_diagonal(&variances.into());
        let read = change(&state.attitude, &state, &m).covariance;
        assert!((read - Matrix4::from_diagonal(&[4.0, 5.0, 6.0, 1.0].into())).amax() < 1e-5);
    }
}
