//! Profiles: names for the layouts of known recordings, and files that describe others.

use super::error::{ProfileError, RecordingError};
use super::mapping::{Column, Mapping};
use super::{Recording, gaitmap, koroglu, openshoe, plain, ucr, xio};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A layout known by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// CSV with the project's own column names, or any others by a mapping, see [`plain`].
    Csv,
    /// gaitmap CSV, left foot, see [`gaitmap`].
    GaitmapLeft,
    /// gaitmap CSV, right foot, see [`gaitmap`].
    GaitmapRight,
    /// CSV of the surveyed walks, see [`koroglu`].
    KorogluCsv,
    /// MATLAB file of the surveyed walks, see [`koroglu`].
    KorogluMat,
    /// OpenShoe text with a counter, 250 Hz, see [`openshoe`].
    Openshoe250,
    /// OpenShoe text without times, 820 Hz, see [`openshoe`].
    Openshoe820,
    /// MicroStrain SensorConnect CSV, see [`koroglu`].
    Sensorconnect,
    /// CSV of the motion-capture walk, see [`ucr`].
    Ucr,
    /// x-io CSV, see [`xio`].
    Xio,
}

impl Preset {
    /// All of them, in alphabetical order.
    pub const ALL: [Self; 10] = [
        Self::Csv,
        Self::GaitmapLeft,
        Self::GaitmapRight,
        Self::KorogluCsv,
        Self::KorogluMat,
        Self::Openshoe250,
        Self::Openshoe820,
        Self::Sensorconnect,
        Self::Ucr,
        Self::Xio,
    ];

    /// The name used on the command line and in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::GaitmapLeft => "gaitmap-left",
            Self::GaitmapRight => "gaitmap-right",
            Self::KorogluCsv => "koroglu-csv",
            Self::KorogluMat => "koroglu-mat",
            Self::Openshoe250 => "openshoe250",
            Self::Openshoe820 => "openshoe820",
            Self::Sensorconnect => "sensorconnect",
            Self::Ucr => "ucr",
            Self::Xio => "xio",
        }
    }

    /// The preset of this name.
    pub fn of_name(name: &str) -> Result<Self, ProfileError> {
        Self::ALL
            .into_iter()
            .find(|preset| preset.name() == name)
            .ok_or_else(|| ProfileError::Unknown { name: name.into(), known: known() })
    }

    /// Whether a file with these column names is surely of this kind.
    pub(super) fn fits(self, names: &[String]) -> bool {
        let mapping = self.mapping();
        let mut columns =
            mapping.time.iter().chain(mapping.accel.iter().flatten()).chain(mapping.gyro.iter().flatten());
        let named = |column: &Column| {
            matches!(column, Column::Name(_)) && names.iter().enumerate().any(|(index, name)| column.fits(name, index))
        };
        // The other names of `ucr` are too common to stand for its rate.
        columns.all(named) && (self != Self::Ucr || names.iter().any(|name| name == ucr::SIGNATURE))
    }

    /// The columns, units and range it stands for.
    pub fn mapping(self) -> Mapping {
        match self {
            Self::Csv => plain::mapping(),
            Self::GaitmapLeft => gaitmap::mapping("left_sensor"),
            Self::GaitmapRight => gaitmap::mapping("right_sensor"),
            Self::KorogluCsv => koroglu::csv_mapping(),
            Self::KorogluMat => koroglu::mat_mapping(),
            Self::Openshoe250 => openshoe::mapping_250(),
            Self::Openshoe820 => openshoe::mapping_820(),
            Self::Sensorconnect => koroglu::sensorconnect_mapping(),
            Self::Ucr => ucr::mapping(),
            Self::Xio => xio::mapping(),
        }
    }
}

/// The names of all presets, in one line.
pub fn known() -> String {
    Preset::ALL.map(Preset::name).join(", ")
}

/// How to read a recording: a mapping, which may lean on a preset by its `base`. The default says nothing: the layout
/// is recognised from the file's content.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// What is said about the columns.
    pub mapping: Mapping,
}

impl From<Preset> for Profile {
    fn from(preset: Preset) -> Self {
        Self { mapping: Mapping { base: Some(preset), ..Mapping::default() } }
    }
}

impl Profile {
    /// The profile meant by `text`: the path of a TOML file, or the name of a preset.
    pub fn parse(text: &str) -> Result<Self, ProfileError> {
        if Path::new(text).extension().is_some_and(|extension| extension == "toml") {
            Self::from_file(Path::new(text))
        } else {
            Preset::of_name(text).map(Self::from)
        }
    }

    /// Reads a mapping from a TOML file.
    pub fn from_file(path: &Path) -> Result<Self, ProfileError> {
        let text = std::fs::read_to_string(path).map_err(|source| ProfileError::Io { path: path.into(), source })?;
        let refused = |message| ProfileError::File { path: path.into(), message };
        let mapping: Mapping = toml::from_str(&text).map_err(|error| {
            let line =
                error.span().map_or(1, |span| 1 + text.bytes().take(span.start).filter(|&byte| byte == b'\n').count());
            refused(format!("line {line}: {}", error.message().replace('\n', " ")))
        })?;
        mapping.validate().map_err(refused)?;
        Ok(Self { mapping })
    }
}

/// Where a recording is and how to read it: the part of a manifest entry that this module understands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// The file, relative to the place the manifest says.
    pub path: PathBuf,
    /// A preset's name or a mapping's file (relative to the same place); recognised from the content when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// What differs from the profile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mapping: Option<Mapping>,
}

impl Source {
    /// The profile, with the mapping laid over it; files are looked for in `directory`.
    pub fn resolve(&self, directory: &Path) -> Result<Profile, ProfileError> {
        let below = match &self.profile {
            None => Profile::default(),
            Some(text) if text.ends_with(".toml") => Profile::from_file(&directory.join(text))?,
            Some(text) => Preset::of_name(text)?.into(),
        };
        let mapping = self.mapping.clone().unwrap_or_default().over(below.mapping);
        mapping.validate().map_err(ProfileError::Mapping)?;
        Ok(Profile { mapping })
    }

    /// Reads the recording; a relative path starts at `directory`.
    pub fn open(&self, directory: &Path) -> Result<Recording, SourceError> {
        let profile = self.resolve(directory)?;
        Ok(super::open(&directory.join(&self.path), Some(&profile))?)
    }
}

/// A [`Source`] could not be read: because of its description or because of its file.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub enum SourceError {
    /// The description.
    Profile(#[from] ProfileError),
    /// The file.
    Recording(#[from] RecordingError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_found_by_its_name_and_is_valid() {
        for preset in Preset::ALL {
            assert_eq!(Preset::of_name(preset.name()).unwrap(), preset);
            preset.mapping().validate().unwrap();
            assert_eq!(serde_json::to_value(preset).unwrap(), preset.name());
        }
    }

    #[test]
    fn an_unknown_profile_lists_the_known_ones() {
        let message = Profile::parse("xsens").unwrap_err().to_string();
        assert!(message.starts_with("unknown profile 'xsens'; known: csv, gaitmap-left, "), "{message}");
    }

    #[test]
    fn a_profile_file_is_read_and_its_faults_are_told_with_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        std::fs::write(&path, "base = \"xio\"\naxes = [\"y\", \"-x\", \"z\"]\n").unwrap();
        let profile = Profile::parse(path.to_str().unwrap()).unwrap();
        assert_eq!(profile.mapping.base, Some(Preset::Xio));
        for (text, part) in [
            ("base = \"xio\"\nspeed = 3\n", "line 2: unknown field `speed`"),
            ("\n\naccel_unit = \"G\"\n", "line 3: 'G' is no accelerometer unit"),
            ("rate_hz = -5\n", "rate_hz must be above 0, not -5"),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = Profile::from_file(&path).unwrap_err().to_string();
            assert!(message.contains(part) && !message.contains('\n'), "{message}");
        }
        let message = Profile::parse("/nowhere/at/all.toml").unwrap_err().to_string();
        assert_eq!(message, "/nowhere/at/all.toml: no such file or directory");
    }

    #[test]
    fn a_source_lays_its_mapping_over_the_profile() {
        let text = "path = \"walk.csv\"\nprofile = \"xio\"\nmapping = { accel_range_g = 8.0 }";
        let source: Source = toml::from_str(text).unwrap();
        let profile = source.resolve(Path::new(".")).unwrap();
        assert_eq!((profile.mapping.base, profile.mapping.accel_range_g), (Some(Preset::Xio), Some(8.0)));
        assert!(toml::from_str::<Source>("path = \"walk.csv\"\nunits = \"g\"").is_err());
    }
}
