//! Which floor mode the shoe should have, as the map knows it (Foot, 4.4.2.2; SPEC section 3, last point).
//!
//! The shoe holds the height on a level floor (H4), lets it free on stairs, and in an elevator lets the vertical velocity
//! free too (H5). It finds out by itself, from the motion; where the map knows better, the shoe is told.

use sohle_shared::step::FloorMode;

/// What the map tells the shoe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum Steering {
    /// Stairs and elevators, and a level floor where neither is within reach (the document's way)
    #[default]
    Document,
    /// Stairs and elevators; everywhere else the shoe decides from the motion
    Connectors,
    /// Nothing: the shoe decides from the motion
    Off,
}

/// Where the particles are, as shares of their weight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// In stairs and on ramps.
    pub stairs: f64,
    /// In elevators.
    pub elevator: f64,
    /// Within a stride of stairs, a ramp or an elevator, or in one.
    pub near: f64,
}

/// In something from this share on, and no longer below the second.
const ENTERED: f64 = 0.5;
const LEFT: f64 = 0.2;
/// A share of the cloud that is of no account.
const NOBODY: f64 = 0.01;
/// Steps in a row that have to be far from everything that climbs before the height is held.
const CLEAR_STEPS: u32 = 3;

/// Decides, with hysteresis, after each step.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FloorModes {
    steering: Steering,
    mode: Option<FloorMode>,
    clear: u32,
}

impl FloorModes {
    /// Nothing is known of the place yet.
    pub fn new(steering: Steering) -> Self {
        Self { steering, ..Self::default() }
    }

    /// Whether the shoe is told anything at all.
    pub fn steers(&self) -> bool {
        self.steering != Steering::Off
    }

    /// The mode wanted now; `None` leaves it to the shoe.
    pub fn mode(&self) -> Option<FloorMode> {
        self.mode
    }

    /// Takes in where the particles are after a step; `None` when the place is not known.
    pub fn take(&mut self, shares: Option<Shares>) -> Option<FloorMode> {
        self.clear = match shares {
            Some(shares) if shares.near <= NOBODY => self.clear.saturating_add(1),
            _ => 0,
        };
        self.mode = match (self.steering, shares) {
            (Steering::Off, _) | (_, None) => None,
            (steering, Some(shares)) => self.of(steering, shares),
        };
        self.mode
    }

    fn of(&self, steering: Steering, shares: Shares) -> Option<FloorMode> {
        let inside = |share: f64, mode| {
            let stays = self.mode == Some(mode) && share >= LEFT;
            (share >= ENTERED || stays).then_some(mode)
        };
        // The present one first: who leaves an elevator for stairs goes over the floor between them anyway.
        let (stairs, elevator) =
            (inside(shares.stairs, FloorMode::Stairs), inside(shares.elevator, FloorMode::Elevator));
        let level = steering == Steering::Document && self.clear >= CLEAR_STEPS;
        let present = [stairs, elevator].into_iter().flatten().find(|mode| self.mode == Some(*mode));
        present.or(elevator).or(stairs).or(level.then_some(FloorMode::Level))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(modes: &mut FloorModes, shares: [f64; 3], times: usize) -> Option<FloorMode> {
        let [stairs, elevator, near] = shares;
        (0..times).map(|_| modes.take(Some(Shares { stairs, elevator, near }))).last().flatten()
    }

    #[test]
    fn a_walk_over_stairs_and_into_an_elevator_gets_each_mode_in_time_and_once() {
        let mut modes = FloorModes::new(Steering::Document);
        assert_eq!(modes.take(None), None);
        assert_eq!(after(&mut modes, [0.0, 0.0, 0.0], 2), None, "not before it is sure");
        assert_eq!(after(&mut modes, [0.0, 0.0, 0.0], 1), Some(FloorMode::Level));
        // A stride before the stairs the height is no longer held, or the first tread would be lost.
        assert_eq!(after(&mut modes, [0.0, 0.0, 0.3], 1), None);
        assert_eq!(after(&mut modes, [0.45, 0.0, 1.0], 1), None);
        assert_eq!(after(&mut modes, [0.6, 0.0, 1.0], 1), Some(FloorMode::Stairs));
        assert_eq!(after(&mut modes, [0.3, 0.0, 1.0], 5), Some(FloorMode::Stairs), "no flicker at the border");
        assert_eq!(after(&mut modes, [0.1, 0.0, 1.0], 1), None);
        assert_eq!(after(&mut modes, [0.3, 0.0, 1.0], 5), None, "nor back");
        assert_eq!(after(&mut modes, [0.0, 0.9, 1.0], 1), Some(FloorMode::Elevator));
        assert_eq!(modes.take(None), None, "who is lost decides alone");
    }

    #[test]
    fn less_steering_says_less() {
        let mut modes = FloorModes::new(Steering::Connectors);
        assert_eq!(after(&mut modes, [0.0, 0.0, 0.0], 9), None);
        assert_eq!(after(&mut modes, [0.9, 0.0, 1.0], 1), Some(FloorMode::Stairs));
        assert_eq!(after(&mut FloorModes::new(Steering::Off), [1.0, 0.0, 1.0], 9), None);
    }
}
