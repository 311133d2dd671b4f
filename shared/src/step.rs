//! The [`Step`]: what the shoe tells the laptop, once per stance.
//!
//! # Frame
//! A step is expressed in the *heading frame* of the previous stance: z up, x along the heading the foot had when that
//! stance ended, y to the left, origin at the foot. It therefore needs no world frame, and whoever receives it (particle
//! filter, graph, fusion) turns it by the heading it believes in (SPEC section 8, decisions 4 and 5). The heading of the
//! foot is defined up to a constant that depends on how the sensor sits on the shoe; only turns matter.

use crate::sample::ClippedSamples;
use crate::time::Micros;
use nalgebra::{Matrix4, Vector3};

/// What the ground under the foot does; decides which pseudo-measurements hold (Foot, 4.4.2.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum FloorMode {
    /// On a level floor: its height is known (H4).
    #[default]
    Level,
    /// On stairs or a ramp: the height is free.
    Stairs,
    /// In an elevator: vertical velocity and height are free, horizontal velocity is zero in stance (H5).
    Elevator,
}

/// What should be known before a step is trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepQuality {
    /// The accelerometer stood at the end of its range during the swing.
    pub accel_clipped: bool,
    /// The gyroscope stood at the end of its range during the swing.
    pub gyro_clipped: bool,
    /// Samples were missing: a gap longer than the tracker bridges without loss.
    pub gap: bool,
    /// The swing took so long that a stance was probably missed.
    pub long_swing: bool,
    /// The stance was never quite still (running, a moving floor): its zero-velocity updates were weak.
    pub weak_stance: bool,
    /// The covariance had to be repaired since the previous step.
    pub repaired: bool,
}

/// The change from the end of the previous stance to the end of this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Counts up by one with each step since the tracker was reset.
    pub index: u32,
    /// First moment of the stance that ends this step.
    pub stance_start: Micros,
    /// Last moment of it.
    pub stance_end: Micros,
    /// From the previous stance to this one. **Units:** m; **Frame:** heading frame of the previous stance.
    pub displacement: Vector3<f32>,
    /// Change of the heading about the vertical, counter-clockwise from above. **Units:** rad, in (-pi, pi].
    pub turn: f32,
    /// Covariance of (x, y, z, turn). **Units:** m², m rad, rad²; **Frame:** as the displacement.
    pub covariance: Matrix4<f32>,
    /// What the ground did during this step, as far as the tracker or the map knew.
    pub mode: FloorMode,
    /// What should be known before the step is trusted.
    pub quality: StepQuality,
    /// How many samples stood at the end of a range since the previous step.
    pub clipped: ClippedSamples,
}

impl Step {
    /// Horizontal length. **Units:** m.
    pub fn length(&self) -> f32 {
        libm::sqrtf(self.displacement.x * self.displacement.x + self.displacement.y * self.displacement.y)
    }
}
