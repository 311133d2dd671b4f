//! How a foot moves through one stride, for each gait: a table of shapes over the phase of the stride.
//!
//! A stride runs from the middle of one stance (phase 0) to the middle of the next (phase 1). The shoe turns about its
//! ball while the heel rises and about its heel after the heel strike; in between it swings freely. `advance` and `lift`
//! are the path of the sole's reference point apart from these turns, so that a shoe of any length and a sensor anywhere
//! on it stay consistent with the floor. Walking, running and climbing were drawn after the median stride of recordings
//! of a foot (levelled, turned into the direction of the stride); descending and side-stepping after what the geometry
//! of a stair and of a small step asks for.

use super::profile::Controls;

/// Ways to cover ground on foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Gait {
    /// Walking at one's own normal pace.
    #[default]
    Walk,
    /// Walking fast.
    Fast,
    /// Running at a jogger's speed.
    Run,
}

/// Distance from the point of the sole below the instep to the ball, about which the shoe turns as the heel rises.
/// **Units:** m.
pub const BALL_M: f64 = 0.06;
/// The same to the heel, about which it turns after the heel strike. **Units:** m; behind, therefore negative.
pub const HEEL_M: f64 = -0.14;

/// One gait. The tables hold 41 values, one for each fortieth of the stride.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Stride length as a multiple of the person's normal stride.
    pub length: f64,
    /// Stride time as a multiple of the person's normal stride time.
    pub time: f64,
    /// Pitch of the sole, nose up positive. **Units:** degrees.
    pub pitch: &'static Controls,
    /// Share of the horizontal way covered.
    pub advance: &'static Controls,
    /// Height above the straight way. **Units:** m.
    pub lift: &'static Controls,
    /// Share of the difference in height covered, if there is one.
    pub climb: &'static Controls,
    /// Phases between which the turning point moves from ball to heel and back again, if the heel strikes first.
    pub heel_first: Option<[f64; 4]>,
    /// Phases between which the foot turns to its next heading.
    pub turning: [f64; 2],
    /// Phase at which the stance that a stride starts from ends: pitch or speed become noticeable.
    pub stance_until: f64,
    /// Phase at which the next stance begins: the sole is flat again.
    pub stance_from: f64,
    /// Phase of the largest pitch downwards, at which the heading changes fastest.
    pub toe_off: f64,
    /// Phase of the first contact with the ground.
    pub contact: f64,
    /// Peak acceleration of the vibration that the contact causes. **Units:** m/s².
    pub impact: f64,
    /// Residual rocking of the standing foot, root mean square about pitch and about roll. **Units:** rad/s.
    pub rocking: f64,
    /// How far the foot swings out sideways. **Units:** m.
    pub sideways: f64,
    /// Roll at push-off and at contact, sole turned outwards positive. **Units:** degrees.
    pub roll: [f64; 2],
}

/// Walking. Source: recordings of the surveyed walks 32 and 39, median of 141 strides.
pub const WALK: Shape = Shape {
    length: 1.0,
    time: 1.0,
    pitch: &WALK_PITCH,
    advance: &WALK_ADVANCE,
    lift: &WALK_LIFT,
    climb: &WALK_ADVANCE,
    heel_first: Some([0.40, 0.62, 0.86, 0.98]),
    turning: [0.40, 0.72],
    stance_until: 0.18,
    stance_from: 0.85,
    toe_off: 0.43,
    contact: 0.735,
    impact: 75.0,
    rocking: 0.17,
    sideways: 0.02,
    roll: [5.0, -6.0],
};

/// Walking fast: the same shape, larger and quicker. Source: recording `openshoe250` at 7 km/h.
pub const FAST: Shape =
    Shape { length: 1.22, time: 0.81, impact: 80.0, rocking: 0.24, stance_until: 0.16, stance_from: 0.86, ..WALK };

/// Running. Source: recording of the surveyed run 34, median of 22 strides.
pub const RUN: Shape = Shape {
    length: 1.36,
    time: 0.71,
    pitch: &RUN_PITCH,
    advance: &RUN_ADVANCE,
    lift: &RUN_LIFT,
    climb: &RUN_ADVANCE,
    heel_first: Some([0.42, 0.66, 0.88, 0.98]),
    turning: [0.36, 0.74],
    stance_until: 0.07,
    stance_from: 0.90,
    toe_off: 0.42,
    contact: 0.80,
    impact: 85.0,
    rocking: 0.50,
    sideways: 0.03,
    roll: [6.0, -8.0],
};

/// Climbing stairs. Source: recording of one flight of stairs, left foot, median of 17 strides.
pub const UP: Shape = Shape {
    length: 1.0,
    time: 0.87,
    pitch: &UP_PITCH,
    advance: &UP_ADVANCE,
    lift: &UP_LIFT,
    climb: &UP_CLIMB,
    heel_first: None,
    turning: [0.42, 0.74],
    stance_until: 0.24,
    stance_from: 0.84,
    toe_off: 0.52,
    contact: 0.78,
    impact: 40.0,
    rocking: 0.08,
    sideways: 0.02,
    roll: [4.0, -3.0],
};

/// Descending stairs: the forefoot touches first.
pub const DOWN: Shape = Shape {
    length: 1.0,
    time: 0.84,
    pitch: &DOWN_PITCH,
    advance: &DOWN_ADVANCE,
    lift: &DOWN_LIFT,
    climb: &DOWN_CLIMB,
    heel_first: None,
    turning: [0.38, 0.70],
    stance_until: 0.18,
    stance_from: 0.87,
    toe_off: 0.40,
    contact: 0.755,
    impact: 50.0,
    rocking: 0.09,
    sideways: 0.02,
    roll: [4.0, -4.0],
};

/// A small step to the side or on the spot.
pub const SIDE: Shape = Shape {
    length: 0.32,
    time: 0.85,
    pitch: &SIDE_PITCH,
    advance: &SIDE_ADVANCE,
    lift: &SIDE_LIFT,
    climb: &SIDE_ADVANCE,
    heel_first: None,
    turning: [0.32, 0.66],
    stance_until: 0.22,
    stance_from: 0.80,
    toe_off: 0.35,
    contact: 0.68,
    impact: 16.0,
    rocking: 0.07,
    sideways: 0.0,
    roll: [4.0, -4.0],
};

impl Gait {
    /// The shapes of this gait.
    pub const fn shape(self) -> &'static Shape {
        match self {
            Self::Walk => &WALK,
            Self::Fast => &FAST,
            Self::Run => &RUN,
        }
    }
}

const WALK_PITCH: Controls = [
    0.0, 0.0, 0.0, -0.5, -1.0, -1.5, -2.2, -3.2, -4.5, -6.5, -9.5, -14.0, -21.0, -33.0, -47.5, -57.5, -61.5, -62.0,
    -60.5, -57.0, -51.5, -44.0, -34.5, -24.0, -13.0, -1.5, 9.5, 21.0, 28.5, 31.0, 29.5, 21.5, 11.0, 5.0, 3.0, 1.8, 1.0,
    0.4, 0.0, 0.0, 0.0,
];
const WALK_ADVANCE: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.002, 0.014, 0.05, 0.10, 0.158, 0.228,
    0.306, 0.388, 0.470, 0.554, 0.638, 0.723, 0.812, 0.897, 0.957, 0.987, 0.998, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
    1.0, 1.0, 1.0,
];
const WALK_LIFT: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.006, 0.031, 0.062, 0.086, 0.104, 0.124,
    0.147, 0.157, 0.150, 0.121, 0.087, 0.057, 0.034, 0.020, 0.014, 0.009, 0.002, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0,
];
const RUN_PITCH: Controls = [
    0.0, 0.0, 0.0, -0.8, -2.0, -4.5, -9.0, -15.5, -23.0, -31.0, -39.5, -48.0, -55.5, -62.0, -67.0, -70.0, -72.0, -73.0,
    -70.0, -65.0, -58.5, -51.0, -42.0, -32.0, -21.5, -10.5, 1.5, 13.0, 22.0, 27.0, 30.0, 32.5, 30.0, 19.5, 9.0, 3.2,
    1.2, 0.4, 0.0, 0.0, 0.0,
];
const RUN_ADVANCE: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.004, 0.014, 0.034, 0.064, 0.098, 0.137, 0.185, 0.243,
    0.308, 0.376, 0.447, 0.515, 0.583, 0.653, 0.729, 0.806, 0.871, 0.921, 0.956, 0.981, 0.995, 1.0, 1.0, 1.0, 1.0, 1.0,
    1.0, 1.0, 1.0,
];
const RUN_LIFT: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.004, 0.016, 0.034, 0.054, 0.074, 0.092, 0.102, 0.106,
    0.107, 0.115, 0.129, 0.141, 0.145, 0.133, 0.105, 0.073, 0.046, 0.033, 0.030, 0.028, 0.022, 0.010, 0.002, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0,
];
const UP_PITCH: Controls = [
    0.0, 0.0, 0.0, -0.4, -0.8, -1.3, -1.9, -2.8, -3.6, -4.7, -6.0, -8.0, -10.6, -14.3, -19.6, -26.0, -32.3, -39.2,
    -45.6, -49.3, -51.9, -53.5, -53.0, -50.4, -45.1, -38.2, -30.2, -21.7, -12.7, -5.8, -2.3, -1.9, -1.1, -0.4, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
];
const UP_ADVANCE: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.005, 0.012, 0.018, 0.024, 0.036,
    0.060, 0.097, 0.157, 0.235, 0.331, 0.434, 0.538, 0.644, 0.748, 0.849, 0.933, 0.983, 0.998, 1.0, 1.0, 1.0, 1.0, 1.0,
    1.0, 1.0, 1.0,
];
const UP_CLIMB: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.005, 0.035, 0.11, 0.23, 0.37,
    0.51, 0.63, 0.74, 0.83, 0.90, 0.95, 0.98, 0.995, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
];
const UP_LIFT: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.001, 0.003, 0.006, 0.008,
    0.012, 0.014, 0.016, 0.018, 0.020, 0.022, 0.026, 0.028, 0.030, 0.026, 0.015, 0.006, 0.002, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0,
];
const DOWN_PITCH: Controls = [
    0.0, 0.0, 0.0, -0.4, -0.8, -1.4, -2.2, -3.4, -5.0, -7.5, -11.0, -16.0, -22.0, -29.0, -36.0, -41.5, -44.0, -43.0,
    -38.5, -32.0, -24.0, -16.0, -10.0, -7.0, -7.0, -9.5, -13.0, -16.0, -17.5, -17.0, -14.0, -9.5, -5.5, -2.8, -1.4,
    -0.7, -0.3, 0.0, 0.0, 0.0, 0.0,
];
const DOWN_ADVANCE: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.010, 0.035, 0.080, 0.145, 0.225, 0.315,
    0.41, 0.51, 0.61, 0.70, 0.78, 0.85, 0.91, 0.955, 0.985, 0.998, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
    1.0,
];
const DOWN_CLIMB: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01, 0.03, 0.07, 0.13,
    0.21, 0.31, 0.42, 0.54, 0.66, 0.78, 0.89, 0.965, 0.995, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
];
const DOWN_LIFT: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.005, 0.020, 0.042, 0.060, 0.068, 0.066,
    0.055, 0.038, 0.022, 0.010, 0.003, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
];
const SIDE_PITCH: Controls = [
    0.0, 0.0, 0.0, -0.3, -0.6, -1.0, -1.6, -2.5, -4.0, -6.5, -10.0, -14.0, -18.0, -21.0, -22.0, -21.0, -18.5, -15.0,
    -11.5, -8.5, -6.0, -4.0, -2.5, -1.0, 0.5, 2.0, 3.0, 3.2, 2.6, 1.6, 0.8, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0,
];
const SIDE_ADVANCE: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.005, 0.02, 0.05, 0.10, 0.17, 0.26, 0.36, 0.47, 0.58,
    0.69, 0.79, 0.87, 0.93, 0.97, 0.99, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0,
];
const SIDE_LIFT: Controls = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.003, 0.012, 0.026, 0.039, 0.047, 0.050, 0.050, 0.049,
    0.047, 0.043, 0.037, 0.029, 0.020, 0.011, 0.004, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::profile::INTERVALS;

    #[test]
    fn every_table_starts_and_ends_at_rest() {
        for shape in [&WALK, &FAST, &RUN, &UP, &DOWN, &SIDE] {
            for (table, end) in [(shape.pitch, 0.0), (shape.advance, 1.0), (shape.lift, 0.0), (shape.climb, 1.0)] {
                assert!(table[..3].iter().all(|&value| value == 0.0));
                assert!(table[INTERVALS - 2..].iter().all(|&value| value == end));
            }
            assert!(shape.stance_until < 0.3 && shape.stance_from > shape.contact && shape.stance_from < 1.0);
        }
    }
}
