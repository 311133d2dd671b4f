//! Where the person goes: a list of legs, each a walk, a flight of stairs, a ride, a stand or a side step; and where the
//! sensor is laid down for a calibration.
//!
//! A route is plain data. It can be written by hand in a scenario file and will be made from a building's plan by
//! whoever knows the building; the simulation needs no building.

use super::error::Error;
use super::gait::Gait;

/// One leg of a route. The person starts it where the previous leg ended.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Leg {
    /// On foot along straight lines through points, on the level; corners are rounded.
    Walk {
        /// The points. **Units:** m; **Frame:** world.
        to: Vec<[f64; 2]>,
        /// How.
        #[serde(default)]
        gait: Gait,
        /// Speed as a multiple of the gait's usual one.
        #[serde(default = "one")]
        pace: f64,
    },
    /// A straight flight of stairs in the direction the person faces.
    Stairs {
        /// Number of risers, up positive, down negative.
        steps: i32,
        /// Height of a riser. **Units:** m.
        #[serde(default = "riser")]
        riser: f64,
        /// Depth of a tread. **Units:** m.
        #[serde(default = "tread")]
        tread: f64,
        /// Direction of the flight; without it, the direction the person faces. **Units:** rad; **Frame:** world,
        /// counter-clockwise from x.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        heading: Option<f64>,
        /// Speed as a multiple of the usual one.
        #[serde(default = "one")]
        pace: f64,
    },
    /// Standing in an elevator that moves.
    Ride {
        /// Height gained, negative downwards. **Units:** m.
        rise: f64,
        /// Largest acceleration. **Units:** m/s².
        #[serde(default = "acceleration")]
        acceleration: f64,
        /// Largest speed. **Units:** m/s.
        #[serde(default = "speed")]
        speed: f64,
    },
    /// Standing.
    Stand {
        /// How long. **Units:** s.
        seconds: f64,
    },
    /// Stepping sideways without turning.
    SideStep {
        /// How far to the left, to the right if negative. **Units:** m.
        left: f64,
    },
    /// Turning on the spot.
    Turn {
        /// The direction to face. **Units:** rad; **Frame:** world, counter-clockwise from x.
        heading: f64,
    },
    /// A hand takes the sensor up and lays it down in another attitude, a little off. So it sits from then on.
    Lay {
        /// What is to point upwards, of any length. **Frame:** sensor.
        up: [f64; 3],
        /// How long it lies there, perfectly still. **Units:** s.
        seconds: f64,
    },
}

const fn one() -> f64 {
    1.0
}
const fn riser() -> f64 {
    0.17
}
const fn tread() -> f64 {
    0.29
}
const fn acceleration() -> f64 {
    0.8
}
const fn speed() -> f64 {
    1.5
}

impl Leg {
    /// A walk to a point at the usual speed. **Units:** m; **Frame:** world.
    pub fn walk(x: f64, y: f64) -> Self {
        Self::with_gait(Gait::Walk, vec![[x, y]])
    }

    /// A way on foot through points at the gait's usual speed. **Units:** m; **Frame:** world.
    pub fn with_gait(gait: Gait, to: Vec<[f64; 2]>) -> Self {
        Self::Walk { to, gait, pace: 1.0 }
    }

    /// A flight of usual stairs straight ahead.
    pub fn stairs(steps: i32) -> Self {
        Self::Stairs { steps, riser: riser(), tread: tread(), heading: None, pace: 1.0 }
    }

    /// A ride in a usual elevator. **Units:** m.
    pub fn ride(rise: f64) -> Self {
        Self::Ride { rise, acceleration: acceleration(), speed: speed() }
    }

    fn check(&self) -> Result<(), (&'static str, f64)> {
        let positive = |what, value: f64| if value > 0.0 && value < 1e6 { Ok(()) } else { Err((what, value)) };
        let finite = |what, value: f64| if value.abs() < 1e6 { Ok(()) } else { Err((what, value)) };
        match self {
            Self::Walk { to, pace, .. } => {
                to.iter().flatten().try_for_each(|&value| finite("a coordinate", value))?;
                positive("pace", *pace)
            }
            Self::Stairs { riser, tread, heading, pace, .. } => {
                positive("riser", *riser)?;
                positive("tread", *tread)?;
                finite("heading", heading.unwrap_or(0.0))?;
                positive("pace", *pace)
            }
            Self::Ride { rise, acceleration, speed } => {
                finite("rise", *rise)?;
                positive("acceleration", *acceleration)?;
                positive("speed", *speed)
            }
            Self::Stand { seconds } => positive("seconds", *seconds),
            Self::SideStep { left } => finite("left", *left),
            Self::Turn { heading } => finite("heading", *heading),
            Self::Lay { up, seconds } => {
                up.iter().try_for_each(|&value| finite("up", value))?;
                positive("the length of up", up.iter().map(|value| value.abs()).sum())?;
                positive("seconds", *seconds)
            }
        }
    }
}

/// Where the person starts and goes.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Route {
    /// The building whose frame the world is, if it is one's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub building: Option<String>,
    /// Where the person stands at first. **Units:** m; **Frame:** world, z up.
    pub start: [f64; 3],
    /// Where the person faces at first. **Units:** rad; **Frame:** world, counter-clockwise from x.
    pub heading: f64,
    /// Whether the legs are gone through again and again.
    pub endless: bool,
    /// The legs, in order.
    pub legs: Vec<Leg>,
}

impl Route {
    /// Refuses numbers that no route can have.
    pub fn check(&self) -> Result<(), Error> {
        for &value in self.start.iter().chain([&self.heading]) {
            if !value.is_finite() {
                return Err(Error::Value { place: "route".into(), what: "start or heading", value });
            }
        }
        for (index, leg) in self.legs.iter().enumerate() {
            leg.check().map_err(|(what, value)| Error::Value {
                place: format!("route, leg {}", index + 1),
                what,
                value,
            })?;
        }
        Ok(())
    }
}
