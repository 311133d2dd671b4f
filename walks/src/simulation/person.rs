//! The person who walks: size, pace, habits.

/// Which foot carries the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Foot {
    /// The left foot.
    Left,
    /// The right foot.
    #[default]
    Right,
}

impl Foot {
    /// Direction from the body to this foot: +1 to the left, -1 to the right.
    pub const fn side(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A walking person. A stride is two steps: from one stance of the instrumented foot to its next.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Person {
    /// Which foot carries the sensor.
    pub foot: Foot,
    /// Body height. **Units:** m.
    pub height: f64,
    /// Stride length at the normal pace as a multiple of the body height.
    pub stride: f64,
    /// Strides per second at the normal pace. **Units:** Hz.
    pub cadence: f64,
    /// Distance between the lines on which the two feet walk. **Units:** m.
    pub step_width: f64,
    /// Angle by which the toes point outwards. **Units:** rad.
    pub toe_out: f64,
    /// How far the foot pitches, as a multiple of the usual.
    pub pitch: f64,
    /// How high the foot is lifted, as a multiple of the usual.
    pub clearance: f64,
    /// How hard the foot meets the ground, as a multiple of the usual.
    pub impact: f64,
    /// How much the standing foot rocks, as a multiple of the usual.
    pub rocking: f64,
    /// How much longer the foot stands than usual, as a share of the stride time. Not negative.
    pub linger: f64,
    /// Standard deviation of a stride's length and of its time, as a share of them.
    pub variability: f64,
}

impl Default for Person {
    fn default() -> Self {
        Self {
            foot: Foot::Right,
            height: 1.76,
            stride: 0.76,
            cadence: 0.86,
            step_width: 0.12,
            toe_out: 0.10,
            pitch: 1.0,
            clearance: 1.0,
            impact: 1.0,
            rocking: 1.0,
            linger: 0.0,
            variability: 0.03,
        }
    }
}

impl Person {
    /// Short, quick steps, a flat and quiet foot.
    pub fn a() -> Self {
        Self {
            foot: Foot::Left,
            height: 1.60,
            stride: 0.74,
            cadence: 0.93,
            step_width: 0.09,
            toe_out: 0.04,
            pitch: 0.88,
            clearance: 0.85,
            impact: 0.75,
            rocking: 0.85,
            linger: 0.03,
            variability: 0.02,
        }
    }

    /// The usual.
    pub fn b() -> Self {
        Self::default()
    }

    /// Long, slow, uneven strides, a high swing, a hard heel, toes well out.
    pub fn c() -> Self {
        Self {
            foot: Foot::Right,
            height: 1.93,
            stride: 0.79,
            cadence: 0.80,
            step_width: 0.16,
            toe_out: 0.22,
            pitch: 1.10,
            clearance: 1.20,
            impact: 1.2,
            rocking: 1.15,
            linger: 0.0,
            variability: 0.05,
        }
    }

    /// The three of the detector test.
    pub fn all() -> [Self; 3] {
        [Self::a(), Self::b(), Self::c()]
    }
}
