//! What is known of a walk from elsewhere: surveyed stances, motion capture, counted strides, a closed loop.
//!
//! A truth is data in the project's units, in the clock of the recording; where it was read from is the business of
//! [`loading`](super::loading).

use crate::recording::SimulatedTruth;
use sohle_shared::time::Micros;

/// Everything known about one walk. What is not known is left out and not judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Where the foot was at an instant of each stance, in order of time.
    pub positions: Option<Vec<Surveyed>>,
    /// Where the foot was all the time.
    pub track: Option<Reference>,
    /// Lengths of single strides.
    pub strides: Option<Vec<KnownStride>>,
    /// True intervals of standing, each to be found once.
    pub stances: Option<Vec<(Micros, Micros)>>,
    /// Whether the foot stood or moved, instant by instant.
    pub still: Option<Vec<(Micros, bool)>>,
    /// Whether the walk ends where it starts.
    pub closed_loop: bool,
    /// Strides of the foot with the sensor, counted by somebody.
    pub stride_count: Option<usize>,
    /// Height of the end above the start. **Units:** m.
    pub height_change: Option<f64>,
    /// Whether the height climbed is of interest although nobody has measured it.
    pub height_reported: bool,
}

impl From<&SimulatedTruth> for Truth {
    /// All that a simulation knows: the way of the foot, its stances, the height it ends at.
    fn from(simulated: &SimulatedTruth) -> Self {
        let points = simulated.poses.iter().map(|pose| (pose.time, [pose.position[0], pose.position[1]])).collect();
        let ends = simulated.poses.first().zip(simulated.poses.last());
        Self {
            track: Some(Reference { points, clock_search: None }),
            stances: Some(simulated.stances.iter().map(|stance| (stance.start, stance.end)).collect()),
            height_change: ends.map(|(first, last)| last.position[2] - first.position[2]),
            ..Self::default()
        }
    }
}

/// A surveyed stance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surveyed {
    /// An instant at which the foot stood there.
    pub time: Micros,
    /// Where. **Units:** m; **Frame:** any, right-handed.
    pub position: [f64; 2],
}

/// A continuous reference, as motion capture gives it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reference {
    /// In order of time. **Units:** m; **Frame:** any, right-handed, z up.
    pub points: Vec<(Micros, [f64; 2])>,
    /// How far its clock may be off from that of the recording; the offset is estimated. **Units:** s.
    pub clock_search: Option<f64>,
}

/// A stride of known length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownStride {
    /// An instant of the stance it starts from.
    pub start: Micros,
    /// An instant of the stance it leads to.
    pub end: Micros,
    /// Horizontal distance of both. **Units:** m.
    pub length: f64,
}

impl Reference {
    /// Where the foot was at `time`, between the points in a straight line; `None` outside of them. **Units:** m.
    pub fn at(&self, time: Micros) -> Option<[f64; 2]> {
        let after = self.points.partition_point(|point| point.0 < time);
        let &(after_time, after_position) = self.points.get(after)?;
        if after_time == time {
            return Some(after_position);
        }
        let (before_time, before_position) = self.points[after.checked_sub(1)?];
        let part = (time - before_time) as f64 / (after_time - before_time) as f64;
        Some([0, 1].map(|axis| before_position[axis] + part * (after_position[axis] - before_position[axis])))
    }

    /// The same reference with `offset` added to its times. **Units:** microseconds.
    #[must_use]
    pub fn shifted(&self, offset: i64) -> Self {
        let points = self.points.iter().map(|&(time, position)| (time + offset, position)).collect();
        Self { points, clock_search: self.clock_search }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_is_read_between_its_points_and_not_beyond() {
        let reference =
            Reference { points: vec![(Micros(10), [0.0, 0.0]), (Micros(20), [1.0, -2.0])], clock_search: None };
        assert_eq!(reference.at(Micros(15)), Some([0.5, -1.0]));
        assert_eq!(reference.at(Micros(20)), Some([1.0, -2.0]));
        assert_eq!(reference.at(Micros(10)), Some([0.0, 0.0]));
        assert_eq!(reference.at(Micros(9)), None);
        assert_eq!(reference.at(Micros(21)), None);
        assert_eq!(reference.shifted(5).at(Micros(20)), Some([0.5, -1.0]));
    }
}
