//! The tracker: inertial samples in, one [`Step`] per stance out.
//!
//! RESET, INIT, TRACKING as in Foot, 4.4.2: gravity and gyroscope bias are taken at rest, then every sample is
//! integrated and every stance corrects the integration.

use crate::sample::ImuSample;
use crate::step::Step;

/// All settings of a tracker.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Parameters {}

impl Parameters {
    /// The settings of the source document (Foot, chapter 4).
    pub fn documented() -> Self {
        Self {}
    }
}

/// What the tracker is doing (Foot, 4.4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing seen yet.
    Reset,
    /// Waiting for the foot to rest.
    Init,
    /// Following the foot.
    Tracking,
}

/// What one sample led to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// State after the sample.
    pub state: State,
    /// Whether the foot stands.
    pub stance: bool,
    /// The step that the sample completed. The step with index 0 marks the stance the walk starts from; its
    /// displacement and turn are zero.
    pub step: Option<Step>,
}

/// What went wrong or was unusual since the reset. Nothing of it stops the tracker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counters {
    /// Samples taken in.
    pub samples: u64,
    /// Samples refused because a value was not finite.
    pub not_finite: u32,
    /// Samples refused because their time was that of the one before.
    pub repeated: u32,
    /// Samples refused because their time lay before that of the one before.
    pub backwards: u32,
    /// Holes in the time line too long to be bridged without loss.
    pub gaps: u32,
    /// Samples with an accelerometer axis at the end of its range.
    pub accel_clipped: u32,
    /// Samples with a gyroscope axis at the end of its range.
    pub gyro_clipped: u32,
    /// Covariances that had lost positive definiteness and were repaired.
    pub repaired: u32,
}

/// From samples to steps.
#[derive(Clone, Debug)]
pub struct Tracker {
    counters: Counters,
}

impl Tracker {
    /// A tracker in state RESET.
    pub fn new(_parameters: &Parameters) -> Self {
        Self { counters: Counters::default() }
    }

    /// Takes one sample in. Never panics; a sample that cannot be used is counted and changes nothing.
    pub fn push(&mut self, _sample: &ImuSample) -> Output {
        self.counters.samples += 1;
        Output { state: State::Reset, stance: false, step: None }
    }

    /// Ends the recording: the step of a stance that has not ended yet.
    pub fn finish(&mut self) -> Option<Step> {
        None
    }

    /// What was unusual since the reset.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Where the foot is now, since the reset. **Units:** m; **Frame:** world (z up, origin and heading of the start).
    pub fn position(&self) -> [f64; 3] {
        [0.0; 3]
    }
}
