//! What does the ground do? Decides from the motion itself, where no map says it, which pseudo-measurements hold.
//!
//! * A stride that ends within some centimetres of the height it began at was on a level floor: the height is held there
//!   (H4), or it would drift by some centimetres per stride. A stride on stairs ends a riser or two away, and is left alone.
//! * A foot that stands, does not turn, and is pushed up or down all the same stands in an elevator: its vertical velocity
//!   is left free (H5) until it is near zero again and nothing pushes.

use crate::step::FloorMode;

/// Settings of [`Ground`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// A stride that rises or falls by less is level. **Units:** m.
    pub level_m: f32,
    /// The same in standard deviations of the height, where these are more. **Units:** 1.
    pub level_sigmas: f32,
    /// But a stride that rises or falls by this is not level. **Units:** m.
    pub riser_m: f32,
    /// The foot must have stood this long before its height counts. **Units:** s.
    pub settle_s: f32,
    /// Standing for this long may be standing in an elevator. **Units:** s.
    pub ride_after_s: f32,
    /// Vertical acceleration that an elevator starts with. **Units:** m/s².
    pub ride_accel: f32,
    /// A foot that turns faster is not simply standing. **Units:** rad/s.
    pub ride_rate: f32,
    /// Slower than this the elevator may have stopped. **Units:** m/s.
    pub stop_speed: f32,
    /// Pushed by less than this it may have stopped. **Units:** m/s².
    pub stop_accel: f32,
    /// It has stopped when both hold for this long. **Units:** s.
    pub stop_s: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            level_m: 0.06,
            level_sigmas: 3.0,
            riser_m: 0.09,
            settle_s: 0.06,
            ride_after_s: 0.6,
            ride_accel: 0.15,
            ride_rate: 5.0_f32.to_radians(),
            stop_speed: 0.25,
            stop_accel: 0.06,
            stop_s: 0.8,
        }
    }
}

/// What is seen of a standing foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Time since the last sight. **Units:** s.
    pub dt: f32,
    /// How long the foot has stood; `None` while it moves. **Units:** s.
    pub standing: Option<f32>,
    /// Vertical acceleration, gravity taken out. **Units:** m/s²; **Frame:** world.
    pub acceleration: f32,
    /// Angular rate. **Units:** rad/s.
    pub rate: f32,
    /// Vertical velocity. **Units:** m/s; **Frame:** world.
    pub velocity: f32,
    /// Height above the last stance. **Units:** m.
    pub height: f32,
    /// Standard deviation of the height. **Units:** m.
    pub height_sigma: f32,
}

/// What follows for the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// What the ground does.
    pub mode: FloorMode,
    /// The height of the last stance holds now.
    pub hold_height: bool,
    /// The foot rides in an elevator now.
    pub riding: bool,
    /// An elevator ride began, and is recognised with this sight: the vertical velocity it has reached. **Units:** m/s.
    pub ride_begins: Option<f32>,
    /// An elevator ride ended with this sight.
    pub ride_ends: bool,
}

/// Time constant of the vertical acceleration. **Units:** s.
const SMOOTHING_S: f32 = 0.15;

/// A smoothed vertical acceleration beyond this may be the beginning of a ride. **Units:** m/s².
const FELT: f32 = 0.02;

/// Follows the ground.
#[derive(Clone, Debug)]
pub struct Ground {
    parameters: Parameters,
    commanded: Option<FloorMode>,
    push: f32,
    /// Velocity that the present push, if it is one, has given so far. **Units:** m/s.
    gained: f32,
    riding: bool,
    stopped_for: f32,
    /// What the stride that ends with this stance did.
    stride: Option<FloorMode>,
}

impl Ground {
    /// On a level floor.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            parameters: *parameters,
            commanded: None,
            push: 0.0,
            gained: 0.0,
            riding: false,
            stopped_for: 0.0,
            stride: None,
        }
    }

    /// A map knows what the ground does, or (`None`) no longer does.
    pub fn command(&mut self, mode: Option<FloorMode>) {
        self.commanded = mode;
    }

    /// Whether the foot stands in an elevator that moves.
    pub fn rides(&self) -> bool {
        self.riding
    }

    /// Takes a sight in.
    pub fn observe(&mut self, sight: &Sight) -> Finding {
        let p = self.parameters;
        let Some(standing) = sight.standing else {
            let ride_ends = core::mem::take(&mut self.riding);
            self.push = 0.0;
            self.gained = 0.0;
            self.stride = None;
            return Finding { mode: self.mode(), hold_height: false, riding: false, ride_begins: None, ride_ends };
        };
        self.push += (sight.acceleration - self.push) * (sight.dt / SMOOTHING_S).min(1.0);
        // A standing foot is held at zero velocity until it is known to ride: what the push gives meanwhile is kept here.
        let pushed = libm::fabsf(self.push) > FELT && self.push * sight.acceleration > 0.0;
        self.gained = if pushed { self.gained + sight.acceleration * sight.dt } else { 0.0 };
        let was_riding = self.riding;
        self.follow_ride(sight, standing);

        if self.stride.is_none() && standing >= p.settle_s && !self.riding {
            let level = p.level_m.max(p.level_sigmas * sight.height_sigma).min(p.riser_m);
            let flat = libm::fabsf(sight.height) < level;
            self.stride = Some(if flat { FloorMode::Level } else { FloorMode::Stairs });
        }
        let mode = self.mode();
        Finding {
            mode,
            hold_height: mode == FloorMode::Level && standing >= p.settle_s,
            riding: self.riding,
            ride_begins: (self.riding && !was_riding).then_some(self.gained),
            ride_ends: was_riding && !self.riding,
        }
    }

    fn follow_ride(&mut self, sight: &Sight, standing: f32) {
        let p = &self.parameters;
        if !self.riding {
            let may = standing >= p.ride_after_s && sight.rate < p.ride_rate;
            let pushed = libm::fabsf(self.push) > p.ride_accel;
            let forbidden = matches!(self.commanded, Some(FloorMode::Level | FloorMode::Stairs));
            if may && pushed && !forbidden {
                self.riding = true;
                self.stopped_for = 0.0;
            }
        } else if libm::fabsf(sight.velocity) < p.stop_speed && libm::fabsf(self.push) < p.stop_accel {
            self.stopped_for += sight.dt;
            if self.stopped_for >= p.stop_s {
                self.riding = false;
                // Where it stopped is a new floor: nothing is known of its height.
                self.stride = Some(FloorMode::Elevator);
            }
        } else {
            self.stopped_for = 0.0;
        }
    }

    /// The foot has been re-based: heights count from here.
    pub fn rebased(&mut self) {
        if self.stride.is_some() {
            self.stride = Some(FloorMode::Level);
        }
    }

    /// What the ground does.
    pub fn mode(&self) -> FloorMode {
        if self.riding {
            return FloorMode::Elevator;
        }
        self.commanded.or(self.stride).unwrap_or(FloorMode::Level)
    }

    /// Forgets everything but what a map commanded.
    pub fn reset(&mut self) {
        *self = Self { commanded: self.commanded, ..Self::new(&self.parameters) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight(standing: f32, height: f32) -> Sight {
        Sight {
            dt: 0.01,
            standing: Some(standing),
            acceleration: 0.0,
            rate: 0.0,
            velocity: 0.0,
            height,
            height_sigma: 0.01,
        }
    }

    #[test]
    fn drift_is_level_and_risers_are_stairs() {
        for (height, mode) in
            [(0.03, FloorMode::Level), (-0.05, FloorMode::Level), (0.15, FloorMode::Stairs), (-0.34, FloorMode::Stairs)]
        {
            let mut ground = Ground::new(&Parameters::default());
            assert!(!ground.observe(&sight(0.02, height)).hold_height);
            let finding = ground.observe(&sight(0.1, height));
            assert_eq!((finding.mode, finding.hold_height), (mode, mode == FloorMode::Level), "{height} m");
        }
    }

    #[test]
    fn the_map_knows_better() {
        let mut ground = Ground::new(&Parameters::default());
        ground.command(Some(FloorMode::Stairs));
        assert!(!ground.observe(&sight(0.1, 0.01)).hold_height);
        ground.command(Some(FloorMode::Level));
        assert!(ground.observe(&sight(0.1, 0.2)).hold_height);
    }

    #[test]
    fn a_ride_begins_with_a_push_and_ends_when_it_stops() {
        let mut ground = Ground::new(&Parameters::default());
        let (mut velocity, mut modes, mut ends) = (0.0, [0; 2], 0);
        for i in 0..1200 {
            // Stands 1 s, speeds up for 1 s, travels for 5 s, slows down for 1 s, stands.
            let acceleration = match i {
                100..200 => 0.8,
                700..800 => -0.8,
                _ => 0.0,
            };
            velocity += acceleration * 0.01;
            let finding = ground.observe(&Sight { acceleration, velocity, ..sight(i as f32 * 0.01, 0.0) });
            if let Some(gained) = finding.ride_begins {
                assert!((gained - velocity).abs() < 1e-5);
            }
            modes[usize::from(finding.riding)] += 1;
            ends += usize::from(finding.ride_ends);
        }
        assert_eq!(ends, 1);
        // From 0.03 s into the push to 0.8 s after the last one has died away.
        assert!((760..860).contains(&modes[1]), "{modes:?}");
    }
}
