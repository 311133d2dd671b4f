//! Samples summed up to increments: what the filter needs of some ten milliseconds, at the cost of a few products per
//! sample.
//!
//! The strapdown integration runs at the rate of the sensor, so nothing of a heel strike is lost; the filter and the
//! stance detector run once per increment. An increment is expressed in the sensor frame of its first moment, so it does
//! not depend on any state (Forster et al., "On-manifold preintegration for real-time visual-inertial odometry", IEEE
//! Trans. Robotics 33(1), 2017, without the bias Jacobians: a bias changes too little within an increment). The turn of
//! an interval has a coning term (Bortz, "A new mathematical formulation for strapdown inertial navigation", IEEE Trans.
//! Aerospace and Electronic Systems 7(1), 1971), so that a slow sensor loses little of a foot that turns about two axes.

use crate::sample::{AccelBias, ClippedSamples, GyroBias, ImuSample};
use crate::so3;
use crate::time::Micros;
use nalgebra::{UnitQuaternion, Vector3};

/// How samples are gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Length of an increment; of slower sensors, each sample is one. **Units:** s.
    pub period_s: f32,
    /// A hole longer than this is not bridged: what the foot did in it is unknown. **Units:** s.
    pub gap_s: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { period_s: 0.01, gap_s: 0.1 }
    }
}

/// The sum of some samples. Biases have been taken out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Increment {
    /// End of the increment before.
    pub start: Micros,
    /// Time of its last sample.
    pub end: Micros,
    /// Number of samples.
    pub samples: u16,
    /// Turn of the sensor. **Frame:** from the sensor frame at the end to that at the start.
    pub turn: UnitQuaternion<f32>,
    /// Integral of the specific force. **Units:** m/s; **Frame:** sensor, at the start.
    pub velocity: Vector3<f32>,
    /// Double integral of the specific force. **Units:** m; **Frame:** sensor, at the start.
    pub position: Vector3<f32>,
    /// Sum of the specific forces. **Units:** m/s²; **Frame:** sensor.
    pub accel_sum: Vector3<f32>,
    /// Sum of their squares. **Units:** m²/s⁴.
    pub accel_square_sum: f32,
    /// Sum of the angular rates. **Units:** rad/s; **Frame:** sensor.
    pub gyro_sum: Vector3<f32>,
    /// Sum of their squares. **Units:** rad²/s².
    pub gyro_square_sum: f32,
    /// Sum of the squared jumps of the specific force from sample to sample: what an impact leaves between the samples.
    /// **Units:** m²/s⁴.
    pub accel_jump: f32,
    /// Sum of the squared jumps of the angular rate. **Units:** rad²/s².
    pub gyro_jump: f32,
    /// Sum of the squared intervals at which the accelerometer was clipped. **Units:** s².
    pub accel_clipped: f32,
    /// Sum of the squared intervals at which the gyroscope was clipped. **Units:** s².
    pub gyro_clipped: f32,
    /// How many samples were clipped.
    pub clipped: ClippedSamples,
    /// The increment is a hole in the samples, and nothing is known of it but its length.
    pub gap: bool,
    /// It begins with a hole in which the foot set out from a rest.
    pub sets_out: bool,
}

impl Increment {
    fn empty(start: Micros) -> Self {
        Self {
            start,
            end: start,
            samples: 0,
            turn: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            position: Vector3::zeros(),
            accel_sum: Vector3::zeros(),
            accel_square_sum: 0.0,
            gyro_sum: Vector3::zeros(),
            gyro_square_sum: 0.0,
            accel_jump: 0.0,
            gyro_jump: 0.0,
            accel_clipped: 0.0,
            gyro_clipped: 0.0,
            clipped: ClippedSamples::default(),
            gap: false,
            sets_out: false,
        }
    }

    /// **Units:** s.
    pub fn duration(&self) -> f32 {
        self.end.since(self.start)
    }

    /// Mean specific force. **Units:** m/s²; **Frame:** sensor.
    pub fn accel_mean(&self) -> Vector3<f32> {
        self.accel_sum / f32::from(self.samples.max(1))
    }

    /// Mean angular rate. **Units:** rad/s; **Frame:** sensor.
    pub fn gyro_mean(&self) -> Vector3<f32> {
        self.gyro_sum / f32::from(self.samples.max(1))
    }
}

/// Gathers samples into increments.
#[derive(Clone, Debug)]
pub struct Preintegrator {
    parameters: Parameters,
    last: Option<ImuSample>,
    current: Option<Increment>,
    stood: bool,
}

impl Preintegrator {
    /// Nothing gathered yet.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, last: None, current: None, stood: false }
    }

    /// No samples came because the sensor did not move, until `time`: its last sample holds until then, and the foot sets out
    /// from there. Without a sample, or when the last one is as late, nothing changes.
    pub fn stood_until(&mut self, time: Micros) {
        if let Some(last) = self.last.as_mut().filter(|last| last.time < time) {
            last.time = time;
            self.current = None;
            self.stood = true;
        }
    }

    /// Takes a sample in that is later than the one before, and hands out the increment it completes. The first sample
    /// only starts the clock.
    pub fn push(&mut self, sample: &ImuSample, gyro_bias: GyroBias, accel_bias: AccelBias) -> Option<Increment> {
        let last = self.last.replace(*sample)?;
        let sets_out = core::mem::take(&mut self.stood);
        let dt = sample.time.since(last.time);
        if dt > self.parameters.gap_s {
            let start = self.current.take().map_or(last.time, |unfinished| unfinished.start);
            return Some(Increment { end: sample.time, gap: true, ..Increment::empty(start) });
        }
        let gyro = sample.gyro.corrected(gyro_bias).0;
        let accel = sample.accel.corrected(accel_bias).0;
        let gyro_before = last.gyro.corrected(gyro_bias).0;
        let accel_before = last.accel.corrected(accel_bias).0;

        let increment = self.current.get_or_insert_with(|| Increment::empty(last.time));
        // Trapezoidal rule, for the forces in the frame of the increment. Over a swing, which begins and ends near zero, it is
        // far better than its order: its errors are differences that cancel. What does not cancel is what a turning axis makes
        // of them. A rate linear in time leaves 1/12 of the product; that the rule cuts the peaks of the rates leaves as much.
        let known = !(sample.clipped.gyro || last.clipped.gyro);
        let coning = gyro_before.cross(&gyro) * if known { dt * dt / 6.0 } else { 0.0 };
        let turn = (gyro + gyro_before) * (0.5 * dt) + coning;
        let before = increment.turn * accel_before;
        increment.turn *= so3::exp(&turn);
        let after = increment.turn * accel;
        increment.position += increment.velocity * dt + (before * 2.0 + after) * (dt * dt / 6.0);
        increment.velocity += (before + after) * (0.5 * dt);

        increment.sets_out |= sets_out;
        increment.end = sample.time;
        increment.samples = increment.samples.saturating_add(1);
        increment.accel_sum += accel;
        increment.accel_square_sum += accel.norm_squared();
        increment.gyro_sum += gyro;
        increment.gyro_square_sum += gyro.norm_squared();
        increment.accel_jump += (accel - accel_before).norm_squared();
        increment.gyro_jump += (gyro - gyro_before).norm_squared();
        increment.accel_clipped += if sample.clipped.accel { dt * dt } else { 0.0 };
        increment.gyro_clipped += if sample.clipped.gyro { dt * dt } else { 0.0 };
        increment.clipped.count(sample.clipped);

        // Half an interval early or late is as near to the period as the samples allow.
        if increment.duration() + 0.5 * dt < self.parameters.period_s {
            return None;
        }
        let mut done = self.current.take()?;
        done.turn = so3::renormalised(&done.turn);
        Some(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Clipped;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn gather(samples: &[ImuSample]) -> Vec<Increment> {
        let mut integrator = Preintegrator::new(&Parameters::default());
        samples.iter().filter_map(|sample| integrator.push(sample, GyroBias::zero(), AccelBias::zero())).collect()
    }

    fn constant(rate: i64, seconds: i64, accel: [f32; 3], gyro: [f32; 3]) -> Vec<ImuSample> {
        (0..=rate * seconds).map(|i| ImuSample::new(Micros(i * 1_000_000 / rate), accel, gyro)).collect()
    }

    #[test]
    fn increments_are_as_long_as_the_rate_allows() {
        for (rate, samples) in [(60, 1), (100, 1), (200, 2), (240, 2), (400, 4), (820, 8), (2_000, 20)] {
            let increments = gather(&constant(rate, 1, [0.0; 3], [0.0; 3]));
            assert!(increments.iter().all(|increment| increment.samples == samples), "{rate} Hz");
            assert!(increments.windows(2).all(|pair| pair[0].end == pair[1].start), "{rate} Hz");
        }
    }

    #[test]
    fn a_turning_sensor_in_free_space_sums_to_a_circle() {
        // A force that turns with the sensor: its integral over the angle t is (sin t, 1 - cos t).
        let increments = gather(&constant(2_000, 1, [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]));
        let (mut turn, mut velocity) = (UnitQuaternion::identity(), Vector3::zeros());
        for increment in &increments {
            velocity += turn * increment.velocity;
            turn *= increment.turn;
        }
        let expected = Vector3::new(libm::sinf(2.0), 1.0 - libm::cosf(2.0), 0.0) / 2.0;
        // 2000 roundings of a velocity below 1.
        assert!((velocity - expected).norm() < 2e-5);
        assert!((so3::log(&turn) - Vector3::new(0.0, 0.0, 2.0)).norm() < 2e-5);
    }

    /// Errors of attitude and velocity at the end of a motion in free space that ends at rest, sampled at 60 Hz.
    fn integrated(seconds: f32, motion: impl Fn(f32) -> (UnitQuaternion<f32>, Vector3<f32>)) -> (f32, f32) {
        let (period, fine) = (1.0 / 60.0, 1e-3);
        let samples: Vec<_> = (0..=(seconds / period + 0.5) as i64)
            .map(|i| {
                let time = i as f32 * period;
                let (before, after) = (motion(time - 0.5 * fine).0, motion(time + 0.5 * fine).0);
                let (attitude, acceleration) = motion(time);
                let rate = so3::box_minus(&after, &before) / fine;
                let force = attitude.inverse_transform_vector(&acceleration);
                ImuSample::new(Micros::from_seconds(f64::from(time)), force.into(), rate.into())
            })
            .collect();
        let (mut attitude, mut velocity) = (motion(0.0).0, Vector3::zeros());
        for increment in gather(&samples) {
            velocity += attitude * increment.velocity;
            attitude *= increment.turn;
        }
        (so3::box_minus(&attitude, &motion(seconds).0).norm(), velocity.norm())
    }

    #[test]
    fn an_axis_that_turns_costs_a_slow_sensor_no_attitude() {
        // Coning by 0.2 rad, three times a second. The rates alone drift by
        // 3 Hz * pi * 0.2^2 * (2 pi 3/60)^2/3 = 12 mrad/s; a tenth of that may be left.
        let cone = |time: f32| {
            let (sin, cos) = libm::sincosf(core::f32::consts::TAU * 3.0 * time);
            (so3::exp(&(Vector3::new(cos, sin, 0.0) * 0.2)), Vector3::zeros())
        };
        let (angle, _) = integrated(10.0, cone);
        assert!(angle < 0.012, "{angle} rad after 10 s");
    }

    #[test]
    fn a_swing_sampled_at_60_hz_ends_at_rest() {
        // 1.4 m in 0.6 s on a path of minimum jerk, the foot pitching by a radian to and fro: peaks of 23 m/s^2, 10 rad/s.
        let swing = |time: f32| {
            let u = (time / 0.6).clamp(0.0, 1.0);
            let acceleration = 1.4 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / 0.36;
            let w = u * (1.0 - u);
            let pitch = 60.0 * w * w * w * (1.0 - 2.0 * u) * 4.0;
            (so3::exp(&Vector3::new(0.1, pitch, 0.0)), Vector3::new(acceleration, 0.0, 0.0))
        };
        let (angle, speed) = integrated(0.6, swing);
        // With the force turned by the attitude between the samples instead of at them: 0.041 m/s.
        assert!(angle < 1e-3 && speed < 0.015, "{angle} rad, {speed} m/s");
    }

    #[test]
    fn a_hole_is_told_and_nothing_is_integrated_over_it() {
        let mut samples = constant(200, 1, [0.0, 0.0, 9.81], [0.0; 3]);
        samples.retain(|sample| !(400_000..700_000).contains(&sample.time.0));
        let increments = gather(&samples);
        let holes: Vec<_> = increments.iter().filter(|increment| increment.gap).collect();
        assert_eq!(holes.len(), 1);
        assert_eq!((holes[0].start, holes[0].end), (Micros(390_000), Micros(700_000)));
        assert_eq!(holes[0].velocity, Vector3::zeros());
    }

    #[test]
    fn clipping_and_impacts_are_summed() {
        let mut samples = constant(200, 1, [0.0, 0.0, 9.81], [0.0; 3]);
        samples[101].clipped = Clipped { accel: true, gyro: false };
        samples[101].accel.0.x = 157.0;
        let increments = gather(&samples);
        let struck: Vec<_> = increments.iter().filter(|increment| increment.accel_jump > 0.0).collect();
        // Up in one increment; down in the same or in the next.
        assert!(!struck.is_empty() && struck.len() <= 2);
        let jumps: f32 = struck.iter().map(|increment| increment.accel_jump).sum();
        assert!((jumps - 2.0 * 157.0 * 157.0).abs() < 1.0);
        assert!((struck[0].accel_clipped - 2.5e-5).abs() < 1e-9);
        assert_eq!(struck[0].gyro_clipped, 0.0);
        assert_eq!(struck[0].clipped, ClippedSamples { accel: 1, gyro: 0 });
    }

    proptest! {
        #[test]
        fn no_time_is_lost(gaps in proptest::collection::vec(1_i64..300_000, 2..200)) {
            let mut time = 0;
            let samples: Vec<_> = gaps.iter().map(|gap| {
                time += gap;
                ImuSample::new(Micros(time), [0.0; 3], [0.0; 3])
            }).collect();
            let increments = gather(&samples);
            prop_assert!(increments.windows(2).all(|pair| pair[0].end == pair[1].start));
        }
    }
}
