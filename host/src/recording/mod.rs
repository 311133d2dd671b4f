//! Recorded walks: reading every known format into one [`Recording`], and the project's own format.
//!
//! A recording's path is enough for a file whose layout is recognised from its content; otherwise a [`Profile`] names
//! the layout or describes it (see [`mapping`] for how a user writes one).

pub mod axes;
pub mod error;
mod gaitmap;
mod koroglu;
pub mod mapping;
mod openshoe;
mod plain;
pub mod profile;
pub mod truth;
mod ucr;
pub mod unit;
mod xio;

pub use error::{Problem, ProfileError, RecordingError};
pub use mapping::Mapping;
pub use profile::{Preset, Profile, Source};
pub use truth::{SimulatedTruth, TruthPose, TruthStance};

use sohle_shared::sample::ImuSample;
use sohle_shared::step::Step;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where the ranges of the sensor end, as far as known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorRange {
    /// **Units:** m/s².
    pub accel: Option<f32>,
    /// **Units:** rad/s.
    pub gyro: Option<f32>,
}

/// What is irregular about the samples. All of them stay in; the tracker deals with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Irregularities {
    /// Samples with the time stamp of the one before.
    pub repeated: usize,
    /// Samples with a time stamp before that of the one before.
    pub backwards: usize,
    /// Steps of time longer than 2.5 usual ones.
    pub gaps: usize,
    /// The longest step of time. **Units:** microseconds.
    pub longest_gap_us: i64,
    /// Samples with an accelerometer axis at the end of its range.
    pub accel_clipped: usize,
    /// Samples with a gyroscope axis at the end of its range.
    pub gyro_clipped: usize,
}

/// A recorded or simulated walk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Short name; that of the file unless it says otherwise.
    pub name: String,
    /// In the order of the file.
    pub samples: Vec<ImuSample>,
    /// Where the sensor clips.
    pub range: SensorRange,
    /// What a simulation knows about the walk; only from the project's own format.
    pub truth: Option<SimulatedTruth>,
    /// Steps recorded with the samples; only from the project's own format.
    pub steps: Vec<Step>,
    /// What else is known: where it came from, parameters, seeds, versions.
    pub metadata: BTreeMap<String, String>,
    /// What is irregular about the samples.
    pub irregularities: Irregularities,
}

/// The folder of third-party recordings, if there is one: `SOHLE_RECORDINGS`, else `recordings/` in the project's
/// folder (filled by `cargo xtask recordings`), else `../shared/recordings` beside it.
pub fn recordings_dir() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("SOHLE_RECORDINGS") {
        return Some(PathBuf::from(named)).filter(|path| path.is_dir());
    }
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).parent()?;
    [project.join("recordings"), project.join("../shared/recordings")].into_iter().find(|path| path.is_dir())
}
