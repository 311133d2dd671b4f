//! Recorded walks: reading every known format into one [`Recording`], and the project's own format.
//!
//! A recording's path is enough for a file whose layout is recognised from its content; otherwise a [`Profile`] names
//! the layout or describes it (see [`mapping`] for how a user writes one).

pub mod axes;
mod check;
pub mod counts;
pub mod error;
mod fix;
#[cfg(test)]
mod fuzz;
mod gaitmap;
pub mod heard;
mod koroglu;
pub mod live;
pub mod mapping;
pub mod mat;
pub mod mcap;
mod message;
mod of_phone;
mod openshoe;
mod plain;
pub mod profile;
pub mod scene;
mod table;
mod text;
pub mod truth;
mod ucr;
pub mod unit;
mod xio;

pub use error::{Problem, ProfileError, RecordingError};
pub use mapping::Mapping;
pub use profile::{Preset, Profile, Source};
pub use truth::{SimulatedTruth, TruthPose, TruthStance};

use crate::fixes::Fix;
use sohle_shared::sample::ImuSample;
use sohle_shared::step::Step;
use sohle_shared::tracker::Order;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
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
    /// What other sources said of the place, in the order of the file; only from the project's own format.
    pub fixes: Vec<Fix>,
    /// What came of computing a live walk again; only from the project's own format, and only if the shoe's counts are in it.
    pub again: Option<live::Agreement>,
    /// Orders that the tracker on the shoe got, each with the number of samples before it; only of a live walk whose counts
    /// are in it.
    pub orders: Vec<(usize, Order)>,
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

/// Metadata that names the building whose frame the truth of a recording is in.
const BUILDING: &str = "building";

impl Recording {
    /// The truth, if it is that of a walk in the building of this name.
    pub fn truth_in(&self, building: &str) -> Option<&SimulatedTruth> {
        let there = self.metadata.get(BUILDING).is_some_and(|name| name == building);
        self.truth.as_ref().filter(|truth| there && !truth.poses.is_empty())
    }

    /// When the clock of its times was zero, if that is known. **Units:** microseconds since the beginning of 1970.
    pub fn began_us(&self) -> Option<i64> {
        self.metadata.get(live::BEGAN).and_then(|began| began.parse().ok())
    }

    /// Usual number of samples in a second. **Units:** Hz; 0 with fewer than two moments.
    pub fn rate_hz(&self) -> f64 {
        table::usual_period(&self.samples).map_or(0.0, |period| 1.0 / period)
    }

    /// Time from the first sample to the last. **Units:** s.
    pub fn duration_s(&self) -> f64 {
        match (self.samples.first(), self.samples.last()) {
            (Some(first), Some(last)) => (last.time - first.time) as f64 * 1e-6,
            _ => 0.0,
        }
    }

    /// What the accelerometer reads in the stillest second, or stance if there is no such second. **Units:** m/s².
    pub fn gravity_at_rest(&self) -> Option<f64> {
        check::rest(&self.samples).map(|rest| rest.accel)
    }
}

/// Reads the recording at `path`. Without a profile the layout is recognised from the content.
pub fn open(path: &Path, profile: Option<&Profile>) -> Result<Recording, RecordingError> {
    let source = open_file(path)?;
    read(path, source, profile)
}

/// Opens a recording's file, for [`read`].
pub fn open_file(path: &Path) -> Result<File, RecordingError> {
    let refused = |problem| RecordingError { path: path.into(), problem };
    if path.is_dir() {
        return Err(refused(Problem::Directory));
    }
    File::open(path).map_err(|error| refused(error.into()))
}

/// Reads a recording from the bytes of `source`; `path` gives it its name and stands in its errors.
pub fn read(path: &Path, source: impl Read, profile: Option<&Profile>) -> Result<Recording, RecordingError> {
    let mapping = profile.map(|profile| profile.mapping.clone()).unwrap_or_default();
    let mut recording = read_bytes(source, mapping).map_err(|problem| RecordingError { path: path.into(), problem })?;
    // An imported recording has no name yet; the project's own has one.
    if recording.name.is_empty() {
        let text = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned());
        recording.name = text(path.file_stem()).unwrap_or_default();
        recording.metadata.extend(text(path.file_name()).map(|file| ("file".to_owned(), file)));
    }
    Ok(recording)
}

/// The first bytes of HDF5, which MATLAB uses since version 7.3.
const HDF5_MAGIC: &[u8] = b"\x89HDF\r\n";
/// So much of a file is looked at to recognise its layout. **Units:** bytes.
const HEAD: u64 = 1 << 16;

fn read_bytes(mut source: impl Read, mapping: Mapping) -> Result<Recording, Problem> {
    let mut head = Vec::new();
    source.by_ref().take(HEAD).read_to_end(&mut head)?;
    let rest = head.as_slice().chain(source);
    if head.is_empty() {
        return Err(Problem::Empty);
    }
    if head.starts_with(mcap::MAGIC) {
        if mapping != Mapping::default() {
            return Err(Problem::Malformed("an MCAP says itself what is in it, it takes no profile".into()));
        }
        return mcap::read(BufReader::new(rest));
    }
    if head.starts_with(mat::MAGIC) {
        return mat::read(rest, mapping);
    }
    if head.starts_with(mat::MAGIC_OF_LATER) || head.starts_with(HDF5_MAGIC) {
        return Err(Problem::Malformed("a MATLAB 7.3 (HDF5) file, expected MATLAB v5: save it with '-v7'".into()));
    }
    if let Some(place) = head.iter().position(|&byte| byte == 0) {
        return Err(Problem::Malformed(format!("neither text nor MCAP nor MATLAB v5: a zero at byte {place}")));
    }
    let mapping = complete(mapping, |mapping| text::recognise(&head, mapping))?;
    text::read(BufReader::new(rest), &mapping).map(|recording| named(recording, &mapping))
}

/// Fills a mapping up from its base, or from the preset that `recognise` finds if it needs one.
fn complete(mapping: Mapping, recognise: impl Fn(&Mapping) -> Result<Preset, Problem>) -> Result<Mapping, Problem> {
    let base = match mapping.base {
        Some(base) => base,
        None if mapping.accel.is_some() && mapping.gyro.is_some() => return Ok(mapping),
        None => recognise(&mapping)?,
    };
    Ok(Mapping { base: Some(base), ..mapping.over(base.mapping()) })
}

/// Notes where a recording came from.
fn named(mut recording: Recording, mapping: &Mapping) -> Recording {
    let profile = mapping.base.map_or("mapping", Preset::name);
    recording.metadata.insert("profile".into(), profile.into());
    recording
}
