//! The tracker: inertial samples in, one [`Step`] per stance out.
//!
//! RESET, INIT, TRACKING as in Foot, 4.4.2: at rest the vertical and the biases are taken, then every sample is integrated
//! and every stance corrects the integration. Two ways lead from samples to steps, chosen by [`Method`]: the source
//! document's, and the project's own, which is the default because it measures better.
//!
//! Whatever comes in, a tracker does not panic and does not stop: a sample it cannot use is counted and passed over, and a
//! filter that has lost itself starts anew at the next rest or stance.

mod documented;
pub mod ground;
mod own;
pub mod stride;

use crate::filter::pivot;
use crate::preintegration;
use crate::rest;
use crate::sample::ImuSample;
use crate::stance::adaptive;
use crate::step::{FloorMode, Step};
use crate::time::Micros;
use documented::Documented;
use nalgebra::{UnitQuaternion, Vector3};
use own::Own;

/// The way from samples to steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Method {
    /// The project's own: increments, adaptive detector, pivot filter.
    #[default]
    Pivot,
    /// The document's: an unscented filter on each sample, and one of the detectors by threshold.
    Unscented,
}

/// The detector of [`Method::Unscented`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Detector {
    /// The document's (Foot, 4.5).
    #[default]
    Documented,
    /// Stance hypothesis optimal estimation.
    Shoe,
    /// Angular rate energy.
    Ared,
    /// Acceleration moving variance.
    Amv,
    /// Acceleration magnitude.
    Mag,
    /// The project's own, from the samples alone.
    Adaptive,
}

/// All settings of a tracker. Those of the method that is not chosen have no effect.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Parameters {
    /// The way from samples to steps.
    pub method: Method,
    /// When no rest comes, the tracker starts in motion after this time. **Units:** s. Method `pivot`.
    pub start_after_s: f32,
    /// How samples are gathered. Method `pivot`.
    pub preintegration: preintegration::Parameters,
    /// When the foot stands. Method `pivot`, and detector `adaptive`.
    pub stance: adaptive::Parameters,
    /// When it is at rest. Method `pivot`.
    pub rest: rest::Parameters,
    /// The filter. Method `pivot`.
    pub filter: pivot::Parameters,
    /// What the ground does. Both methods.
    pub ground: ground::Parameters,
    /// What a step is. Both methods.
    pub steps: stride::Parameters,
    /// Method `unscented`.
    pub document: documented::Parameters,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::Pivot,
            start_after_s: 3.0,
            preintegration: Default::default(),
            stance: Default::default(),
            rest: Default::default(),
            filter: Default::default(),
            ground: Default::default(),
            steps: Default::default(),
            document: Default::default(),
        }
    }
}

impl Parameters {
    /// The settings of the source document (Foot, chapter 4).
    pub fn documented() -> Self {
        Self { method: Method::Unscented, ..Self::default() }
    }
}

pub use documented::Parameters as DocumentParameters;

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
    /// Whether the foot stands where the last step ended: its stance goes on though it has been told of.
    pub reported: bool,
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
    /// Times the tracker lost itself and started anew.
    pub restarts: u32,
}

/// From samples to steps.
#[derive(Clone, Debug)]
pub struct Tracker {
    parameters: Parameters,
    way: Way,
    counters: Counters,
    last: Option<Micros>,
}

#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "without a heap the larger one cannot be boxed, and there is one tracker"
)]
enum Way {
    Own(Own),
    Documented(Documented),
}

impl Tracker {
    /// A tracker in state RESET.
    pub fn new(parameters: &Parameters) -> Self {
        let way = match parameters.method {
            Method::Pivot => Way::Own(Own::new(parameters)),
            Method::Unscented => Way::Documented(Documented::new(parameters)),
        };
        Self { parameters: *parameters, way, counters: Counters::default(), last: None }
    }

    /// Back to RESET, as new. What a map commanded is forgotten too.
    pub fn reset(&mut self) {
        *self = Self::new(&self.parameters);
    }

    /// Takes one sample in. Never panics; a sample that cannot be used is counted and changes nothing.
    pub fn push(&mut self, sample: &ImuSample) -> Output {
        self.counters.samples += 1;
        if !self.usable(sample) {
            return Output { state: self.state(), stance: false, reported: false, step: None };
        }
        self.last = Some(sample.time);
        self.counters.accel_clipped += u32::from(sample.clipped.accel);
        self.counters.gyro_clipped += u32::from(sample.clipped.gyro);
        match &mut self.way {
            Way::Own(own) => own.push(sample, &mut self.counters),
            Way::Documented(documented) => documented.push(sample, &mut self.counters),
        }
    }

    fn usable(&mut self, sample: &ImuSample) -> bool {
        if !sample.is_finite() {
            self.counters.not_finite += 1;
            return false;
        }
        match self.last.map(|last| sample.time - last) {
            Some(0) => self.counters.repeated += 1,
            Some(passed) if passed < 0 => self.counters.backwards += 1,
            _ => return true,
        }
        false
    }

    /// Ends the recording: the step of a stance that has not ended yet.
    pub fn finish(&mut self) -> Option<Step> {
        match &mut self.way {
            Way::Own(own) => own.finish(&mut self.counters),
            Way::Documented(documented) => documented.finish(&mut self.counters),
        }
    }

    /// Tells what the ground does, as a map knows it (H4, H5); `None` leaves it to the tracker again.
    pub fn command_floor_mode(&mut self, mode: Option<FloorMode>) {
        match &mut self.way {
            Way::Own(own) => own.command(mode),
            Way::Documented(documented) => documented.command(mode),
        }
    }

    /// What the tracker is doing.
    pub fn state(&self) -> State {
        match &self.way {
            Way::Own(own) => own.phase(),
            Way::Documented(documented) => documented.phase(),
        }
    }

    /// What was unusual since the reset.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    fn foot(&self) -> &crate::filter::state::State {
        match &self.way {
            Way::Own(own) => own.foot(),
            Way::Documented(documented) => documented.foot(),
        }
    }

    /// Where the foot is now, since the stance of the last step. **Units:** m; **Frame:** heading frame of that stance, as
    /// the next step will be.
    pub fn displacement(&self) -> Vector3<f32> {
        self.foot().position
    }

    /// Attitude of the sensor now. **Frame:** from the sensor to that of [`Tracker::displacement`].
    pub fn attitude(&self) -> UnitQuaternion<f32> {
        self.foot().attitude
    }

    /// Velocity of the sensor now. **Units:** m/s; **Frame:** that of [`Tracker::displacement`].
    pub fn velocity(&self) -> Vector3<f32> {
        self.foot().velocity
    }
}
