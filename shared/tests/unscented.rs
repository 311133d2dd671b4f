//! The document's filter against a plain linearised Kalman filter in `f64`, and its symmetries, on a simulated walk of
//! which everything is known.

use nalgebra::{Matrix3, SMatrix, UnitQuaternion, Vector3};
use sohle_shared::filter::unscented::{Parameters, UnscentedFilter};
use sohle_shared::sample::{AccelCorrected, GyroCorrected};
use sohle_shared::step::FloorMode;
use sohle_shared::{filter::rebase::Change, so3};

const DT: f64 = 0.0025;
const G: f64 = 9.81;
const REST: f64 = 0.5;
const SWING: f64 = 0.7;
const STRIDES: usize = 4;
/// A stride is 1.2 m long and turns the foot by 0.3 rad.
const LENGTH: f64 = 1.2;
const TURN: f64 = 0.3;

type Cov = SMatrix<f64, 9, 9>;

/// One sample with the truth at its end.
#[derive(Clone)]
struct Moment {
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
    standing: bool,
    attitude: UnitQuaternion<f64>,
    position: Vector3<f64>,
}

/// Attitude and velocity of a foot with the sensor's axes along the foot's, walking strides of a rest and a swing.
fn pose(t: f64) -> (UnitQuaternion<f64>, Vector3<f64>, bool) {
    let stride = (t / (REST + SWING)).floor();
    let s = ((t - stride * (REST + SWING) - REST) / SWING).clamp(0.0, 1.0);
    let tau = std::f64::consts::TAU;
    let eased = s - (tau * s).sin() / tau;
    let heading = TURN * (stride + eased);
    let pitch = 0.7 * (tau * eased).sin() * (std::f64::consts::PI * s).sin();
    let forward = LENGTH / SWING * (1.0 - (tau * s).cos());
    let lift = 0.15 / SWING * tau * (tau * s).sin() * (1.0 - (tau * s).cos());
    let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let attitude = yaw * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), pitch);
    (attitude, yaw * Vector3::new(forward, 0.0, lift), s == 0.0 || s == 1.0)
}

/// The walk as samples that, put through the document's motion model without error, give the truth.
fn walk() -> Vec<Moment> {
    let count = (STRIDES as f64 * (REST + SWING) / DT) as usize + (0.4 / DT) as usize;
    let mut position = Vector3::zeros();
    let (mut attitude, mut velocity, _) = pose(0.0);
    (1..=count)
        .map(|i| {
            let (next_attitude, next_velocity, standing) = pose(i as f64 * DT);
            let gyro = (attitude.inverse() * next_attitude).scaled_axis() / DT;
            let acceleration = (next_velocity - velocity) / DT;
            let accel = next_attitude.inverse() * (acceleration + Vector3::z() * G);
            position += 0.5 * DT * (velocity + next_velocity);
            (attitude, velocity) = (next_attitude, next_velocity);
            Moment { gyro, accel, standing, attitude, position }
        })
        .collect()
}

/// The walk as a sensor with a constant bias and noise sees it; deterministic.
fn measured() -> Vec<Moment> {
    let mut state = 7_u32;
    let mut noise = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / 16_777_216.0 - 0.5
    };
    let mut vector = move |scale: f64| Vector3::new(noise(), noise(), noise()) * scale;
    walk()
        .into_iter()
        .map(|moment| Moment {
            gyro: moment.gyro + vector(0.02) + Vector3::new(0.01, -0.008, 0.006),
            accel: moment.accel + vector(0.3) + Vector3::new(0.05, -0.04, 0.06),
            ..moment
        })
        .collect()
}

/// The document's values with a start that is small enough for a linearisation.
fn parameters() -> Parameters {
    Parameters { start: 1e-4, ..Parameters::documented() }
}

/// The walk through the document's filter, for a sensor turned by `mounting` in the foot and a world turned by `yaw`.
/// The results with the filter at the end.
fn unscented(walk: &[Moment], mounting: UnitQuaternion<f32>, yaw: f32) -> UnscentedFilter {
    let mut filter = UnscentedFilter::new(&parameters());
    filter.start(so3::rotation_about_z(yaw) * mounting, G as f32);
    for moment in walk {
        let gyro = GyroCorrected(mounting.inverse() * moment.gyro.cast::<f32>());
        let accel = AccelCorrected(mounting.inverse() * moment.accel.cast::<f32>());
        filter.predict(gyro, accel, DT as f32);
        if moment.standing {
            filter.stand(accel, FloorMode::Level, 0.0);
        }
    }
    assert_eq!((filter.repaired(), filter.refused()), (0, 0));
    filter
}

/// The same models linearised about the mean: an error-state extended Kalman filter.
struct Linearised {
    attitude: UnitQuaternion<f64>,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    covariance: Cov,
}

impl Linearised {
    fn predict(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, p: &Parameters) {
        let turn = UnitQuaternion::from_scaled_axis(gyro * DT);
        self.attitude *= turn;
        let acceleration = self.attitude * accel - Vector3::z() * G;
        self.position += self.velocity * DT + acceleration * (0.5 * DT * DT);
        self.velocity += acceleration * DT;
        let r = self.attitude.to_rotation_matrix().into_inner();
        let lever = -r * accel.cross_matrix();
        let mut f = Cov::identity();
        let back = turn.inverse().to_rotation_matrix().into_inner();
        f.fixed_view_mut::<3, 3>(0, 0).copy_from(&back);
        f.fixed_view_mut::<3, 3>(3, 0).copy_from(&(lever * back * (0.5 * DT * DT)));
        f.fixed_view_mut::<3, 3>(6, 0).copy_from(&(lever * back * DT));
        f.fixed_view_mut::<3, 3>(3, 6).copy_from(&(Matrix3::identity() * DT));
        let mut n = SMatrix::<f64, 9, 6>::zeros();
        n.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * DT));
        n.fixed_view_mut::<3, 3>(3, 0).copy_from(&(lever * (0.5 * DT * DT * DT)));
        n.fixed_view_mut::<3, 3>(6, 0).copy_from(&(lever * (DT * DT)));
        n.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r * (0.5 * DT * DT)));
        n.fixed_view_mut::<3, 3>(6, 3).copy_from(&(r * DT));
        let (g, a) = (f64::from(p.gyro), f64::from(p.accel));
        let noise = SMatrix::<f64, 6, 6>::from_diagonal(&[g, g, g, a, a, a].into());
        let growth = [p.rotation_noise, p.position_noise, p.velocity_noise];
        let grown = Cov::from_diagonal(&nalgebra::SVector::from_fn(|i, _| f64::from(growth[i / 3]) * DT));
        self.covariance = f * self.covariance * f.transpose() + n * noise * n.transpose() + grown;
    }

    fn correct<const M: usize>(&mut self, h: SMatrix<f64, M, 9>, off: nalgebra::SVector<f64, M>, variance: f32) {
        let spread =
            h * self.covariance * h.transpose() + SMatrix::<f64, M, M>::from_diagonal_element(f64::from(variance));
        // Each component has the same variance, so the inverse by iteration of a well conditioned matrix is exact enough:
        // X <- X (2 - S X), quadratic.
        let mut inverse = SMatrix::<f64, M, M>::from_diagonal_element(1.0 / spread.trace());
        for _ in 0..60 {
            inverse = inverse * (SMatrix::<f64, M, M>::from_diagonal_element(2.0) - spread * inverse);
        }
        let gain = self.covariance * h.transpose() * inverse;
        let d = gain * off;
        self.attitude *= UnitQuaternion::from_scaled_axis(Vector3::new(d[0], d[1], d[2]));
        self.position += Vector3::new(d[3], d[4], d[5]);
        self.velocity += Vector3::new(d[6], d[7], d[8]);
        self.covariance -= gain * spread * gain.transpose();
    }

    fn stand(&mut self, accel: &Vector3<f64>, p: &Parameters) {
        let down = self.attitude.inverse() * Vector3::z() * G;
        let mut h = SMatrix::<f64, 3, 9>::zeros();
        h.fixed_view_mut::<3, 3>(0, 0).copy_from(&down.cross_matrix());
        self.correct(h, accel - down, p.gravity);
        let mut h = SMatrix::<f64, 3, 9>::zeros();
        h.fixed_view_mut::<3, 3>(0, 6).copy_from(&Matrix3::identity());
        self.correct(h, -self.velocity, p.stance_velocity);
        let mut h = SMatrix::<f64, 1, 9>::zeros();
        h[5] = 1.0;
        self.correct(h, [-self.position.z].into(), p.height);
    }
}

fn linearised(walk: &[Moment]) -> Linearised {
    let p = parameters();
    let mut filter = Linearised {
        attitude: UnitQuaternion::identity(),
        position: Vector3::zeros(),
        velocity: Vector3::zeros(),
        covariance: Cov::from_diagonal_element(f64::from(p.start)),
    };
    for moment in walk {
        filter.predict(&moment.gyro, &moment.accel, &p);
        if moment.standing {
            filter.stand(&moment.accel, &p);
        }
    }
    filter
}

#[test]
fn the_motion_model_follows_a_walk_without_error() {
    let walk = walk();
    let mut filter = UnscentedFilter::new(&Parameters {
        start: 0.0,
        rotation_noise: 0.0,
        position_noise: 0.0,
        velocity_noise: 0.0,
        gyro: 0.0,
        accel: 0.0,
        ..Parameters::documented()
    });
    filter.start(UnitQuaternion::identity(), G as f32);
    for moment in &walk {
        filter.predict(GyroCorrected(moment.gyro.cast()), AccelCorrected(moment.accel.cast()), DT as f32);
    }
    let end = walk.last().unwrap();
    // The rounding of 2000 turns of the attitude, each to 1e-7, tilts gravity by some 1e-5 for 5 s.
    assert!((filter.state().position.cast::<f64>() - end.position).norm() < 2e-3);
    assert!(filter.state().attitude.cast::<f64>().angle_to(&end.attitude) < 3e-5);
}

#[test]
fn it_agrees_with_a_linearised_filter_in_double_precision() {
    let walk = measured();
    let unscented = unscented(&walk, UnitQuaternion::identity(), 0.0);
    let linear = linearised(&walk);
    let state = unscented.state();
    // The filters differ by the second order of the spread of the tilt, 1e-4 rad², on accelerations of some 10 m/s² and
    // on the track's error, and by the rounding of f32: 1e-5 rad of tilt is 5e-5 m in a swing.
    let apart = (state.position.cast::<f64>() - linear.position).norm();
    let moved = (linear.position - walk.last().unwrap().position).norm();
    assert!(moved > 0.03, "the biases do not show: {moved}");
    assert!(apart < 5e-4, "{apart}");
    assert!(state.attitude.cast::<f64>().angle_to(&linear.attitude) < 3e-5);
    assert!((state.velocity.cast::<f64>() - linear.velocity).norm() < 5e-4);
    let mut worst = 0.0_f64;
    for i in 0..9 {
        for j in 0..9 {
            let scale = (linear.covariance[(i, i)] * linear.covariance[(j, j)]).sqrt();
            let difference = f64::from(unscented.covariance()[(i, j)]) - linear.covariance[(i, j)];
            worst = worst.max(difference.abs() / scale);
        }
    }
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn turning_the_world_changes_nothing_but_the_heading() {
    let walk = measured();
    let plain = unscented(&walk, UnitQuaternion::identity(), 0.0);
    for yaw in [0.5, -2.0, 3.1] {
        let turned = unscented(&walk, UnitQuaternion::identity(), yaw);
        let back = so3::rotation_about_z(-yaw);
        same(&plain.change(), &turned.change(), &back);
    }
}

#[test]
fn the_mounting_changes_nothing() {
    let walk = measured();
    let plain = unscented(&walk, UnitQuaternion::identity(), 0.0);
    for up in [-Vector3::z(), Vector3::x(), Vector3::new(5.6, 1.7, -7.9)] {
        let turned = unscented(&walk, so3::level(&up), 0.0);
        same(&plain.change(), &turned.change(), &UnitQuaternion::identity());
    }
}

/// Two ways to the same change. Sigma points along other axes differ in the second order of the spread, as does the
/// linearised filter; f32 rounds the rest.
fn same(plain: &Change, other: &Change, back: &UnitQuaternion<f32>) {
    assert!((back * other.displacement - plain.displacement).norm() < 3e-4);
    assert!((other.turn - plain.turn).abs() < 1e-4);
    let turn = |change: &Change| change.covariance[(3, 3)];
    assert!((turn(other) - turn(plain)).abs() < 1e-3 * turn(plain));
}

#[test]
fn steps_laid_end_to_end_are_the_walk() {
    let walk = walk();
    let mut filter = UnscentedFilter::new(&parameters());
    filter.start(UnitQuaternion::identity(), G as f32);
    let (mut place, mut heading, mut stood) = (Vector3::zeros(), 0.0, true);
    for moment in &walk {
        let accel = AccelCorrected(moment.accel.cast());
        if stood && !moment.standing {
            let change = filter.rebase();
            place += so3::rotation_about_z(heading) * change.displacement;
            heading += change.turn;
        }
        stood = moment.standing;
        filter.predict(GyroCorrected(moment.gyro.cast()), accel, DT as f32);
        if moment.standing {
            filter.stand(accel, FloorMode::Level, 0.0);
        }
    }
    let change = filter.rebase();
    place += so3::rotation_about_z(heading) * change.displacement;
    heading += change.turn;
    let end = walk.last().unwrap();
    // As above: the rounding of f32 tilts gravity by some 1e-5.
    assert!((place.cast::<f64>() - end.position).norm() < 5e-4);
    assert!((heading - (STRIDES as f32) * TURN as f32).abs() < 1e-4);
}
