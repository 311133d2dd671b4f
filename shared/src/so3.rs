//! Rotations: the group SO(3) as unit quaternions, its exponential and logarithm, and what a level floor needs of it.
//!
//! # Frame
//! An attitude `Q` turns sensor vectors into the world: `v_g = Q v_l` (Foot, 4.56). The world's z axis points up.
//!
//! The functions take and give `f32` and cost little on a processor without trigonometry: rotations of up to 2 rad,
//! which is every sigma point and every sample, go through polynomials. No input leads to a panic or, where the result
//! is a rotation, to a value that is not a number: what has no meaning becomes the identity.

use core::f32::consts::PI;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// A unit quaternion from its parts; the caller knows that the norm is 1 to rounding.
fn unit(w: f32, x: f32, y: f32, z: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
}

/// The rotation by the angle `|v|` about the direction of `v`, right-handed. **Units:** rad.
///
/// # Source
/// Foot, 4.24 - 4.27 (`Rot`), as a quaternion `(cos |v|/2, v/|v| sin |v|/2)`. Up to 2 rad by the Taylor polynomials of
/// cosine and sine, whose first terms left out are below 3e-8 there; above by `libm`.
pub fn exp(v: &Vector3<f32>) -> UnitQuaternion<f32> {
    let h2 = 0.25 * v.norm_squared();
    if h2 <= 1.0 {
        let cos = 1.0 - h2 * (0.5 - h2 * (1.0 / 24.0 - h2 * (1.0 / 720.0 - h2 * (1.0 / 40_320.0 - h2 / 3_628_800.0))));
        let sinc = 1.0 - h2 * (1.0 / 6.0 - h2 * (1.0 / 120.0 - h2 * (1.0 / 5_040.0 - h2 / 362_880.0)));
        let s = 0.5 * sinc;
        return unit(cos, v.x * s, v.y * s, v.z * s);
    }
    let angle = libm::sqrtf(v.norm_squared());
    if !angle.is_finite() {
        return UnitQuaternion::identity();
    }
    let (sin, cos) = libm::sincosf(0.5 * angle);
    let s = sin / angle;
    unit(cos, v.x * s, v.y * s, v.z * s)
}

/// The rotation vector of the shorter way to `q`: `exp(log(q))` is the rotation `q`, `|log(q)| <= pi`. **Units:** rad.
///
/// `q` and `-q` are the same rotation and give the same vector. A half turn has two rotation vectors; the one whose first
/// non-zero component is positive is taken. `q` need not be exactly of norm 1.
///
/// # Source
/// Foot, 4.28, 4.29 (`aRot`). The arc cosine there loses half of the digits near 0 and near pi; the arc tangent of the
/// vector part over the real part keeps them.
pub fn log(q: &UnitQuaternion<f32>) -> Vector3<f32> {
    let mut w = q.w;
    let mut u = Vector3::new(q.i, q.j, q.k);
    if w < 0.0 || (w == 0.0 && first_non_zero(&u) < 0.0) {
        w = -w;
        u = -u;
    }
    let n2 = u.norm_squared();
    let w2 = w * w;
    if n2 <= 0.01 * w2 {
        // Series of atan(t)/t, t = |u|/w <= 0.1: the first term left out is 1.2e-9.
        let t2 = n2 / w2;
        return u * (2.0 / w * (1.0 - t2 * (1.0 / 3.0 - t2 * (0.2 - t2 / 7.0))));
    }
    let n = libm::sqrtf(n2);
    u * (2.0 * libm::atan2f(n, w) / n)
}

/// The component that decides the sign of a rotation vector.
fn first_non_zero(v: &Vector3<f32>) -> f32 {
    v.iter().copied().find(|&x| x != 0.0).unwrap_or(0.0)
}

/// `q [+] d`: the attitude `q` turned by `d` in the sensor frame, of norm 1 again. **Units:** rad.
///
/// # Source
/// Foot, 4.36: `Q Rot(d)`.
pub fn box_plus(q: &UnitQuaternion<f32>, d: &Vector3<f32>) -> UnitQuaternion<f32> {
    renormalised(&(q * exp(d)))
}

/// `to [-] from`: the turn in the sensor frame that leads from one attitude to the other. **Units:** rad.
///
/// # Source
/// Foot, 4.37: `aRot(Q1^-1 Q2)`.
pub fn box_minus(to: &UnitQuaternion<f32>, from: &UnitQuaternion<f32>) -> Vector3<f32> {
    log(&(from.inverse() * to))
}

/// The same rotation with norm 1 to rounding. Cheap when the norm is near 1 already, as after a product.
pub fn renormalised(q: &UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    let n2 = q.coords.norm_squared();
    if (n2 - 1.0).abs() < 1e-5 {
        // One step of Newton's method for 1/sqrt leaves a relative error of 3/8 (n2 - 1)^2: 4e-11 at the bound.
        return UnitQuaternion::new_unchecked(q.quaternion() * (1.5 - 0.5 * n2));
    }
    // Scaled first, so that no square overflows or vanishes.
    let scaled = q.coords / q.coords.amax();
    let n = libm::sqrtf(scaled.norm_squared());
    if n.is_finite() { UnitQuaternion::new_unchecked((scaled / n).into()) } else { UnitQuaternion::identity() }
}

/// The rotation about the world's vertical, counter-clockwise from above. **Units:** rad.
pub fn rotation_about_z(angle: f32) -> UnitQuaternion<f32> {
    exp(&Vector3::new(0.0, 0.0, angle))
}

/// How far a foot turned about the vertical between two attitudes: counter-clockwise from above, in (-pi, pi].
/// **Units:** rad.
///
/// It is the twist about z of the turn `to from^-1`, taken in the world, so it does not depend on how the sensor is fixed
/// to the shoe, and there is no attitude in which it breaks down, only turns: one of half a turn about a horizontal axis
/// has no twist, and gives 0.
///
/// # Source
/// SPEC section 8, decision 5, in place of Foot, 5.9. Swing-twist decomposition.
pub fn turn(from: &UnitQuaternion<f32>, to: &UnitQuaternion<f32>) -> f32 {
    let d = to * from.inverse();
    let (w, z) = if d.w < 0.0 { (-d.w, -d.k) } else { (d.w, d.k) };
    let angle = 2.0 * libm::atan2f(z, w);
    if angle <= -PI { PI } else { angle }
}

/// The shortest rotation that brings the direction `up`, given in the sensor frame, onto the world's +z: the attitude of
/// a resting sensor whose accelerometer reads `up`. **Units:** any; only the direction counts.
///
/// Any mounting: a sensor lying exactly on its back is turned about its x axis. Without a direction (zero, or not finite)
/// the result is the identity.
pub fn level(up: &Vector3<f32>) -> UnitQuaternion<f32> {
    // Scaled first, so that no square overflows or vanishes.
    let largest = up.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return UnitQuaternion::identity();
    }
    let scaled = up / largest;
    let a = scaled / libm::sqrtf(scaled.norm_squared());
    if !a.iter().all(|x| x.is_finite()) {
        return UnitQuaternion::identity();
    }
    if a.z >= 0.0 {
        let w = libm::sqrtf(0.5 * (1.0 + a.z));
        return unit(w, 0.5 * a.y / w, -0.5 * a.x / w, 0.0);
    }
    // Beyond the horizontal 1 + a.z would lose its digits; the horizontal part carries them. It is taken before the
    // division, since its square may be too small for the format.
    let largest = a.x.abs().max(a.y.abs());
    if largest == 0.0 {
        return unit(0.0, 1.0, 0.0, 0.0);
    }
    let (x, y) = (a.x / largest, a.y / largest);
    let horizontal = libm::sqrtf(x * x + y * y);
    let sin = libm::sqrtf(0.5 * (1.0 - a.z));
    unit(0.5 * horizontal * largest / sin, sin * y / horizontal, -sin * x / horizontal, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::{FRAC_PI_2, TAU};
    use nalgebra::Vector4;
    use proptest::prelude::*;

    /// Rounding of one product of two unit quaternions: four products and sums of at most 1, each to 6e-8.
    const ROUNDING: f32 = 5e-7;

    fn vector(range: f32) -> impl Strategy<Value = Vector3<f32>> {
        (-range..range, -range..range, -range..range).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    /// Rotation vectors of up to `range` with lengths over many decades.
    fn spread(range: f32) -> impl Strategy<Value = Vector3<f32>> {
        (vector(1.0), -8.0_f32..0.0).prop_filter_map("no direction", move |(v, decade)| {
            let n = v.norm();
            (n > 1e-3).then(|| v / n * (range * libm::powf(10.0, decade)))
        })
    }

    fn rotation() -> impl Strategy<Value = UnitQuaternion<f32>> {
        (-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0).prop_filter_map("too short", |(w, x, y, z)| {
            let n = Vector4::new(w, x, y, z).norm();
            (n > 0.1).then(|| unit(w / n, x / n, y / n, z / n))
        })
    }

    /// Distance of two rotations as quaternions, whichever sign they have; about half the angle between them.
    fn distance(a: &UnitQuaternion<f32>, b: &UnitQuaternion<f32>) -> f32 {
        (a.coords - b.coords).norm().min((a.coords + b.coords).norm())
    }

    fn to_f64(q: &UnitQuaternion<f32>) -> nalgebra::Rotation3<f64> {
        UnitQuaternion::new_normalize(q.quaternion().cast::<f64>()).to_rotation_matrix()
    }

    proptest! {
        #[test]
        fn the_identity_changes_nothing(q in rotation()) {
            prop_assert!(distance(&(q * exp(&Vector3::zeros())), &q) == 0.0);
            prop_assert!(distance(&(exp(&Vector3::zeros()) * q), &q) == 0.0);
        }

        #[test]
        fn the_inverse_undoes(q in rotation(), v in vector(3.0)) {
            prop_assert!(distance(&(q * q.inverse()), &UnitQuaternion::identity()) < ROUNDING);
            // The polynomials are even and odd in v, so the inverse of exp is exp of the opposite to the last bit.
            prop_assert_eq!(exp(&v).inverse(), exp(&-v));
        }

        #[test]
        fn composition_is_associative(a in rotation(), b in rotation(), c in rotation()) {
            prop_assert!(distance(&((a * b) * c), &(a * (b * c))) < 2.0 * ROUNDING);
        }

        #[test]
        fn exp_is_rodrigues_formula(v in spread(6.0)) {
            let q = exp(&v);
            let truth = nalgebra::Rotation3::<f64>::new(v.cast());
            // Elements of a rotation matrix change by at most the angle: a few roundings of the quaternion, twice.
            prop_assert!((to_f64(&q).matrix() - truth.matrix()).amax() < 6e-7);
            prop_assert!((q.coords.norm() - 1.0).abs() < 4e-7);
        }

        #[test]
        fn log_undoes_exp_up_to_pi(v in spread(PI - 1e-5)) {
            // Relative: the smallest rotations keep all their digits. Near pi the half angle is rounded to 1.2e-7, which
            // is 2.4e-7 of the angle, and the direction to as much.
            prop_assert!((log(&exp(&v)) - v).norm() <= 6e-7 * v.norm());
        }

        #[test]
        fn exp_undoes_log(q in rotation()) {
            prop_assert!(distance(&exp(&log(&q)), &q) < ROUNDING);
            prop_assert!(log(&q).norm() <= PI + 1e-6);
        }

        #[test]
        fn log_has_no_sign(q in rotation()) {
            prop_assert_eq!(log(&q), log(&unit(-q.w, -q.i, -q.j, -q.k)));
        }

        #[test]
        fn axiom_4_33_adding_nothing(q in rotation()) {
            prop_assert!(distance(&box_plus(&q, &Vector3::zeros()), &q) < ROUNDING);
        }

        #[test]
        fn axiom_4_34_adding_the_difference(x in rotation(), y in rotation()) {
            prop_assert!(distance(&box_plus(&x, &box_minus(&y, &x)), &y) < 3.0 * ROUNDING);
        }

        #[test]
        fn axiom_4_35_the_difference_of_a_sum(x in rotation(), d in vector(1.8)) {
            // |d| < 1.8 sqrt(3) < pi. The error of the product is of the size of 1, not of d: absolute.
            prop_assert!((box_minus(&box_plus(&x, &d), &x) - d).norm() < 3e-6);
        }

        #[test]
        fn renormalising_brings_any_length_to_one(q in rotation(), s in 1e-3_f32..1e3) {
            let long = UnitQuaternion::new_unchecked(q.quaternion() * s);
            let back = renormalised(&long);
            prop_assert!((back.coords.norm() - 1.0).abs() < 3e-7);
            prop_assert!(distance(&back, &q) < ROUNDING);
        }

        #[test]
        fn levelling_brings_up_to_z(v in spread(1.0), size in -30.0_f32..30.0) {
            let up = v.normalize();
            let q = level(&(up * libm::powf(10.0, size)));
            prop_assert!((q * up - Vector3::z()).norm() < 1e-6);
            prop_assert!((q.coords.norm() - 1.0).abs() < 4e-7);
            // The shortest rotation has no part about the vertical.
            prop_assert!(q.k == 0.0);
        }

        #[test]
        fn the_turn_is_that_about_the_vertical(from in rotation(), angle in -3.1_f32..3.1) {
            prop_assert!((turn(&from, &(rotation_about_z(angle) * from)) - angle).abs() < 3e-6);
        }

        #[test]
        fn the_turn_does_not_depend_on_the_mounting(a in rotation(), b in rotation(), mounting in rotation()) {
            let d = b * a.inverse();
            prop_assume!(d.w * d.w + d.k * d.k > 0.01);
            let difference = turn(&a, &b) - turn(&(a * mounting), &(b * mounting));
            // The twist is at most 1/0.1 times as sensitive as the turn itself.
            prop_assert!((difference - TAU * libm::roundf(difference / TAU)).abs() < 20.0 * ROUNDING);
        }

        #[test]
        fn nothing_is_not_a_number(bits in proptest::array::uniform4(any::<u32>())) {
            let [x, y, z, w] = bits.map(f32::from_bits);
            let v = Vector3::new(x, y, z);
            for q in [exp(&v), level(&v), renormalised(&unit(w, x, y, z)), rotation_about_z(w)] {
                prop_assert!((q.coords.norm() - 1.0).abs() < 1e-6, "{q:?}");
            }
        }
    }

    #[test]
    fn a_long_chain_of_small_turns_keeps_its_norm() {
        let d = Vector3::new(1e-3, -2e-3, 3e-3);
        let q = (0..1_000_000).fold(UnitQuaternion::identity(), |q, _| box_plus(&q, &d));
        assert!((q.coords.norm() - 1.0).abs() < 2e-7);
    }

    #[test]
    fn half_turns_have_one_rotation_vector() {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, -0.8, 0.0)] {
            let q = unit(0.0, axis.x, axis.y, axis.z);
            assert!((log(&q) - axis * PI).norm() < 1e-6);
            assert_eq!(log(&q), log(&unit(0.0, -axis.x, -axis.y, -axis.z)));
        }
    }

    #[test]
    fn a_sensor_on_its_back_or_on_its_side_is_levelled() {
        let back = level(&Vector3::new(0.0, 0.0, -9.81));
        assert_eq!(back, unit(0.0, 1.0, 0.0, 0.0));
        let nearly = Vector3::new(1e-30, -2e-30, -1.0);
        assert!((level(&nearly) * nearly - Vector3::z()).norm() < 1e-6);
        let x_up = level(&Vector3::new(9.81, 0.0, 0.0));
        assert!((x_up * Vector3::x() - Vector3::z()).norm() < 1e-6);
        assert!((log(&x_up) - Vector3::new(0.0, -FRAC_PI_2, 0.0)).norm() < 1e-6);
    }

    #[test]
    fn no_direction_is_level() {
        for up in [Vector3::zeros(), Vector3::new(0.0, f32::NAN, 1.0), Vector3::new(f32::INFINITY, 0.0, 0.0)] {
            assert_eq!(level(&up), UnitQuaternion::identity());
        }
    }

    #[test]
    fn a_turn_right_round_is_none_and_half_of_it_is_positive() {
        let q = rotation_about_z(TAU);
        assert!(turn(&UnitQuaternion::identity(), &q).abs() < 1e-6);
        let half = unit(0.0, 0.0, 0.0, -1.0);
        assert!((turn(&UnitQuaternion::identity(), &half) - PI).abs() < 1e-6);
        let over = unit(0.0, 1.0, 0.0, 0.0);
        assert_eq!(turn(&UnitQuaternion::identity(), &over), 0.0);
    }
}
