//! The two dies of the sensor on the moving foot: what each has in its registers, when its own clock says so.

use super::error::Error;
use super::motion::{Kinematics, Motion};
use super::scenario::Scenario;
use super::sensor::{SensorModel, Unit};
use crate::recording::{TruthPose, TruthStance};
use sohle_shared::sample::Counts;
use sohle_shared::time::Micros;

/// What one die yields at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Specific force in counts.
    Accel(Counts),
    /// Angular rate in counts.
    Gyro {
        /// The counts.
        counts: Counts,
        /// The truth at this moment.
        truth: TruthPose,
        /// Number of the last stance that has begun; 0 is the one the walk starts from.
        step: u32,
    },
    /// Temperature as the accelerometer tells it. **Units:** 0.5 K, 0 at 23 °C.
    Temperature(i8),
}

/// Time between two temperature readings. **Units:** s.
const TEMPERATURE_S: f64 = 1.0;

/// Readings of both dies in the order of time, as an iterator over `(seconds, reading)`.
#[derive(Debug)]
pub struct Dies {
    motion: Motion,
    model: SensorModel,
    unit: Unit,
    gravity: f64,
    temperature: f64,
    temperature_index: u64,
    until: f64,
}

impl Dies {
    /// The readings of `scenario`.
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        Ok(Self {
            motion: scenario.motion()?,
            model: scenario.sensor,
            unit: Unit::new(&scenario.sensor, scenario.seed),
            gravity: scenario.gravity,
            temperature: scenario.sensor.temperature_at(0.0),
            temperature_index: 0,
            until: scenario.duration.unwrap_or(f64::INFINITY),
        })
    }

    /// The unit with the errors that were drawn for it.
    pub fn unit(&self) -> &Unit {
        &self.unit
    }

    /// The next stance that has ended by `time`, each once; at the end of the readings, every one that is left.
    /// **Units:** s.
    pub fn stance_ended(&mut self, time: f64) -> Option<TruthStance> {
        self.motion.stance_ended(time)
    }
}

impl Iterator for Dies {
    type Item = (f64, Reading);

    fn next(&mut self) -> Option<Self::Item> {
        let (accel, gyro) = (self.unit.accel.due(), self.unit.gyro.due());
        let temperature = self.temperature_index as f64 * TEMPERATURE_S;
        let time = accel.min(gyro).min(temperature);
        if time >= self.until || !self.motion.advance(time) {
            self.motion.end(self.until);
            return None;
        }
        if temperature <= time {
            self.temperature_index += 1;
            self.temperature = self.model.temperature_at(time);
            self.unit.accel.wander(TEMPERATURE_S);
            self.unit.gyro.wander(TEMPERATURE_S);
            // In range by the clamp, whole by the rounding.
            let steps = libm::round((self.temperature - 23.0) * 2.0).clamp(-127.0, 127.0) as i8;
            return Some((time, Reading::Temperature(steps)));
        }
        let now = self.motion.at(time);
        let force = now.specific_force(self.gravity);
        if accel <= gyro {
            return Some((time, Reading::Accel(self.unit.accel.read(&force, self.temperature))));
        }
        let rate = now.rate + self.unit.gyro_per_accel * force;
        let counts = self.unit.gyro.read(&rate, self.temperature);
        let (stance, step) = self.motion.stance(time);
        Some((time, Reading::Gyro { counts, truth: pose(time, &now, stance), step }))
    }
}

fn pose(time: f64, now: &Kinematics, stance: bool) -> TruthPose {
    let q = now.attitude.quaternion();
    TruthPose {
        time: Micros::from_seconds(time),
        position: now.position.into(),
        velocity: now.velocity.into(),
        attitude: [q.w, q.i, q.j, q.k],
        stance,
    }
}
