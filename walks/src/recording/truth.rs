//! What a simulated walk knows about itself: where the foot really was.
//!
//! Written by the simulator beside the samples and read back from our own recordings. A stride needs no type of its
//! own: it is the change between two neighbouring stances, see [`SimulatedTruth::strides`].

use sohle_shared::time::Micros;

/// Where the foot was when a sample was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthPose {
    /// When; the time of a sample.
    pub time: Micros,
    /// Where. **Units:** m; **Frame:** world, z up, origin at the start.
    pub position: [f64; 3],
    /// How fast. **Units:** m/s; **Frame:** world.
    pub velocity: [f64; 3],
    /// Unit quaternion (w, x, y, z) that turns sensor vectors into the world.
    pub attitude: [f64; 4],
    /// Whether the foot stands at this moment.
    pub stance: bool,
}

/// A time during which the foot stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthStance {
    /// First moment.
    pub start: Micros,
    /// Last moment.
    pub end: Micros,
    /// Where the sensor was at the end. **Units:** m; **Frame:** world.
    pub position: [f64; 3],
    /// Direction the foot pointed in at the end, about the vertical, from the world's x axis. **Units:** rad.
    pub heading: f64,
    /// Whether the sensor was truly at rest in the world; not so in an elevator or on a rolling foot.
    pub still: bool,
}

/// The change from one stance to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthStride {
    /// Last moment of the stance it starts from.
    pub start: Micros,
    /// First moment of the stance it leads to.
    pub end: Micros,
    /// **Units:** m; **Frame:** heading frame of the stance it starts from (x ahead, y left, z up).
    pub displacement: [f64; 3],
    /// Change of heading, counter-clockwise from above. **Units:** rad, in (-pi, pi].
    pub turn: f64,
}

/// Everything known about a simulated walk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimulatedTruth {
    /// One for each sample.
    pub poses: Vec<TruthPose>,
    /// In order of time.
    pub stances: Vec<TruthStance>,
}

impl SimulatedTruth {
    /// The strides between the stances.
    pub fn strides(&self) -> impl Iterator<Item = TruthStride> + '_ {
        self.stances.windows(2).filter_map(|pair| match pair {
            [from, to] => Some(stride(from, to)),
            _ => None,
        })
    }
}

fn stride(from: &TruthStance, to: &TruthStance) -> TruthStride {
    let [dx, dy, dz] = [0, 1, 2].map(|axis| to.position[axis] - from.position[axis]);
    let (sin, cos) = from.heading.sin_cos();
    let turn = to.heading - from.heading;
    TruthStride {
        start: from.end,
        end: to.start,
        displacement: [cos * dx + sin * dy, cos * dy - sin * dx, dz],
        turn: turn - std::f64::consts::TAU * ((turn - std::f64::consts::PI) / std::f64::consts::TAU).ceil(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn stance(second: f64, position: [f64; 3], heading: f64) -> TruthStance {
        let start = Micros::from_seconds(second);
        TruthStance { start, end: start + 300_000, position, heading, still: true }
    }

    #[test]
    fn a_stride_is_seen_from_the_stance_it_starts_from() {
        let truth = SimulatedTruth {
            poses: Vec::new(),
            // Walks north, then turns left through the end of the circle.
            stances: vec![
                stance(0.0, [1.0, 1.0, 0.0], FRAC_PI_2),
                stance(1.0, [1.0, 2.5, 0.1], PI),
                stance(2.0, [0.0, 2.5, 0.1], -FRAC_PI_2),
            ],
        };
        let strides: Vec<_> = truth.strides().collect();
        assert_eq!(strides.len(), 2);
        let [ahead, left, up] = strides[0].displacement;
        // Rounding of a rotation by a quarter turn in f64.
        assert!((ahead - 1.5).abs() < 1e-12 && left.abs() < 1e-12 && (up - 0.1).abs() < 1e-12);
        assert!((strides[0].turn - FRAC_PI_2).abs() < 1e-12);
        assert!((strides[1].turn - FRAC_PI_2).abs() < 1e-12, "{}", strides[1].turn);
        assert_eq!((strides[0].start, strides[0].end), (Micros(300_000), Micros(1_000_000)));
    }
}
