//! How the phone is held: where up is, and how fast it turns about it.

use super::sample::PhoneSample;
use nalgebra::{UnitQuaternion, Vector3};

/// Settings of [`Attitude`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How long the accelerometer takes to correct the vertical. **Units:** s.
    pub correct_s: f64,
    /// At rest, the gyroscope shows its bias: least time. **Units:** s.
    pub rest_s: f64,
    /// At rest, rates deviate from their mean by no more. **Units:** rad/s.
    pub rest_rate: f64,
    /// At rest, the mean rate is no larger: a turn-table is no rest. **Units:** rad/s.
    pub largest_bias: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { correct_s: 2.0, rest_s: 0.7, rest_rate: 0.03, largest_bias: 0.05 }
    }
}

/// Follows the vertical in the phone, and the heading.
#[derive(Clone, Debug)]
pub struct Attitude {
    parameters: Parameters,
    up: Option<Vector3<f64>>,
    bias: Vector3<f64>,
    heading: f64,
    rest: Rest,
}

/// A stretch of time in which nothing turns.
#[derive(Clone, Copy, Debug, Default)]
struct Rest {
    seconds: f64,
    count: f64,
    mean: Vector3<f64>,
}

impl Attitude {
    /// Nothing is known yet.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, up: None, bias: Vector3::zeros(), heading: 0.0, rest: Rest::default() }
    }

    /// Takes in a sample, `dt` seconds after the last.
    pub fn push(&mut self, sample: &PhoneSample, dt: f64) {
        self.look_for_rest(&sample.gyro, dt);
        let rate = sample.gyro - self.bias;
        let length = sample.accel.norm();
        let measured = if length > 1e-3 { sample.accel / length } else { self.up() };
        let up = match self.up {
            None => measured,
            Some(up) => {
                let turned = UnitQuaternion::from_scaled_axis(rate * -dt) * up;
                let part = (dt / self.parameters.correct_s).min(1.0);
                let mixed = turned + (measured - turned) * part;
                mixed.try_normalize(1e-6).unwrap_or(turned)
            }
        };
        self.up = Some(up);
        self.heading += rate.dot(&up) * dt;
    }

    fn look_for_rest(&mut self, rate: &Vector3<f64>, dt: f64) {
        let p = &self.parameters;
        let rest = &mut self.rest;
        let still = rest.count == 0.0 || (rate - rest.mean).norm() < p.rest_rate;
        if !still || rate.norm() > p.largest_bias + p.rest_rate {
            *rest = Rest::default();
            return;
        }
        rest.seconds += dt;
        rest.count += 1.0;
        rest.mean += (rate - rest.mean) / rest.count;
        if rest.seconds >= p.rest_s && rest.mean.norm() <= p.largest_bias {
            self.bias = rest.mean;
        }
    }

    /// Unit vector upwards. **Frame:** phone.
    pub fn up(&self) -> Vector3<f64> {
        self.up.unwrap_or_else(Vector3::z)
    }

    /// Angle turned about the vertical since the start, counter-clockwise from above. **Units:** rad, not wrapped.
    pub fn heading(&self) -> f64 {
        self.heading
    }

    /// Bias of the gyroscope, as the last rest has shown it. **Units:** rad/s; **Frame:** phone.
    pub fn bias(&self) -> Vector3<f64> {
        self.bias
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::time::Micros;
    use std::f64::consts::PI;

    fn sample(accel: Vector3<f64>, gyro: Vector3<f64>) -> PhoneSample {
        PhoneSample { time: Micros(0), accel, gyro, magnetic: None, pressure: None }
    }

    #[test]
    fn a_tilted_phone_still_turns_about_the_vertical() {
        let up = Vector3::new(0.3, 0.5, 0.8).normalize();
        let mut attitude = Attitude::new(&Parameters::default());
        // Half a turn in two seconds.
        for _ in 0..200 {
            attitude.push(&sample(up * 9.81, up * (PI / 2.0)), 0.01);
        }
        assert!((attitude.heading() - PI).abs() < 1e-9, "{}", attitude.heading());
        assert!((attitude.up() - up).norm() < 1e-9);
    }

    #[test]
    fn tilting_it_does_not_turn_the_heading() {
        let mut attitude = Attitude::new(&Parameters::default());
        for i in 0..300 {
            let tilt = 0.5 * (i as f64 * 0.02).sin();
            let accel = UnitQuaternion::from_scaled_axis(Vector3::x() * -tilt) * Vector3::z() * 9.81;
            attitude.push(&sample(accel, Vector3::x() * (0.5 * 2.0 * (i as f64 * 0.02).cos())), 0.01);
        }
        assert!(attitude.heading().abs() < 0.02, "{}", attitude.heading());
    }

    #[test]
    fn a_rest_shows_the_bias_and_a_slow_turn_does_not() {
        let bias = Vector3::new(0.01, -0.005, 0.02);
        let mut attitude = Attitude::new(&Parameters::default());
        (0..100).for_each(|_| attitude.push(&sample(Vector3::z() * 9.81, bias), 0.01));
        assert!((attitude.bias() - bias).norm() < 1e-9);
        (0..100).for_each(|_| attitude.push(&sample(Vector3::z() * 9.81, bias + Vector3::z() * 0.2), 0.01));
        assert!((attitude.bias() - bias).norm() < 1e-9);
    }
}
