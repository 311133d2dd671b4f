//! The document's way from samples to steps (Foot, chapter 4): the unscented filter on each sample, and a detector by
//! threshold. The other classical detectors can stand in for the document's, as baselines.
//!
//! Without the feature `documented` only its settings are here: the boards have no room for the rest.

#[cfg(feature = "documented")]
mod way;

use super::Detector;
use crate::filter::unscented;
use crate::stance;
#[cfg(feature = "documented")]
pub(super) use way::Documented;

/// Settings of the document's way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Which detector tells the stances.
    pub detector: Detector,
    /// Samples that gravity is taken from (4.73).
    pub gravity_samples: u16,
    /// How long INIT goes on after that, if the foot stays still. **Units:** s.
    pub init_s: f32,
    /// The filter.
    pub filter: unscented::Parameters,
    /// Detector `documented`; its thresholds for standing also tell whether the foot is still in INIT.
    pub documented: stance::documented::Parameters,
    /// Detector `shoe`.
    pub shoe: stance::shoe::Parameters,
    /// Detector `ared`.
    pub ared: stance::ared::Parameters,
    /// Detector `amv`.
    pub amv: stance::amv::Parameters,
    /// Detector `mag`.
    pub mag: stance::mag::Parameters,
}

impl Default for Parameters {
    /// The document's values (table 4.1, 4.66 - 4.80).
    fn default() -> Self {
        Self {
            detector: Detector::Documented,
            gravity_samples: 100,
            init_s: 0.5,
            filter: Default::default(),
            documented: Default::default(),
            shoe: Default::default(),
            ared: Default::default(),
            amv: Default::default(),
            mag: Default::default(),
        }
    }
}
