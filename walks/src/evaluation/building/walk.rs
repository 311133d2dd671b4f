//! A simulated walk in a building: the steps that the shoe tells, and where the foot really was.

use crate::building::{Building, Error, route};
use crate::simulation::{Person, Route, Scenario, SensorModel, Simulation};
use nalgebra::Vector3;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Parameters, Tracker};

/// A walk to be followed.
#[derive(Clone, Debug)]
pub struct Walk {
    /// The steps; the first marks the start.
    pub steps: Vec<Step>,
    /// Where the sensor was at the end of each. **Units:** m; **Frame:** building.
    pub truth: Vec<Vector3<f64>>,
}

/// Who walks, and with which chance.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// Who.
    pub person: Person,
    /// All that is random follows from it.
    pub seed: u64,
}

/// Samples in a second: the tracker is the same at each rate, and a fast simulation allows many walks.
const RATE_HZ: f64 = 400.0;

impl Walk {
    /// Walks through rooms: `stops` as for [`route::plan`].
    ///
    /// # Errors
    /// As [`route::plan`].
    pub fn through(building: &Building, stops: &[&str], walker: &Walker) -> Result<Self, Error> {
        Self::along(&Route::through(building, &route::plan(building, stops)?)?, walker)
    }

    /// Walks along a route.
    ///
    /// # Errors
    /// When the simulation refuses the route.
    pub fn along(route: &Route, walker: &Walker) -> Result<Self, Error> {
        let mut sensor = SensorModel::bmx055_calibrated();
        (sensor.accel.rate, sensor.gyro.rate) = (RATE_HZ, RATE_HZ);
        let scenario =
            Scenario { seed: walker.seed, person: walker.person, sensor, route: route.clone(), ..Scenario::default() };
        let simulation = Simulation::new(&scenario).map_err(|error| Error::Model(error.to_string()))?;
        let mut tracker = Tracker::new(&Parameters::default());
        let mut walk = Self { steps: Vec::new(), truth: Vec::new() };
        // Steps are told some samples after their stance has ended.
        let mut poses: Vec<(Micros, [f64; 3])> = Vec::new();
        for moment in simulation {
            poses.push((moment.sample.time, moment.truth.position));
            if let Some(step) = tracker.push(&moment.sample).step {
                let at = poses.partition_point(|(time, _)| *time < step.stance_end).min(poses.len() - 1);
                walk.truth.push(Vector3::from(poses[at].1));
                walk.steps.push(step);
            }
        }
        Ok(walk)
    }

    /// Length of the true way from stance to stance. **Units:** m.
    pub fn length(&self) -> f64 {
        self.truth.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}
