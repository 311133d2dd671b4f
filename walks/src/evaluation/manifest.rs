//! The manifest: which recordings there are, how to read them, what is known of each, and what is asked of them together.
//!
//! A TOML file, described for its writers in `docs/manifest.md`. Everything in it is checked when it is read, so that a
//! mistake is told before the first recording is tracked.

use super::group::Group;
use super::source::TruthSource;
use crate::recording::mapping::Mapping;
use crate::recording::{Profile, ProfileError, Source, recordings_dir};
use crate::simulation::Scenario;
use crate::toml_file::{self, TomlFileError};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a manifest is refused.
#[derive(Debug, Error)]
pub enum ManifestError {
    /// The file cannot be read, or what stands in it is not a manifest.
    #[error(transparent)]
    File(#[from] TomlFileError),
    /// Its parts contradict each other.
    #[error("manifest {}: {message}", path.display())]
    Contradiction {
        /// Which file.
        path: PathBuf,
        /// What is wrong and what was expected.
        message: String,
    },
}

/// A manifest as written.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The walks.
    #[serde(default, rename = "recording")]
    pub recordings: Vec<Entry>,
    /// Figures over several walks.
    #[serde(default, rename = "group")]
    pub groups: Vec<Group>,
    /// Where files come from; only needed for files that are fetched.
    #[serde(default, rename = "file")]
    pub files: Vec<File>,
    /// Folder of the manifest; paths are relative to it.
    #[serde(skip)]
    folder: PathBuf,
}

/// A recorded walk.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// How the walk is called in every output.
    pub name: String,
    /// A sentence for readers of the manifest.
    pub about: Option<String>,
    /// The file with the samples.
    pub path: Option<PathBuf>,
    /// In place of a file: a walk to be simulated, which brings its truth.
    pub simulate: Option<SimulateSource>,
    /// Preset or mapping file, see [`Source::profile`].
    pub profile: Option<String>,
    /// What differs from the profile.
    pub mapping: Option<Mapping>,
    /// What is known of the sensor, as `sohle calibrate` writes it.
    pub calibration: Option<PathBuf>,
    /// What is known of the walk.
    #[serde(default)]
    pub truth: TruthSource,
}

/// A walk to be simulated: one of `detector_test` and `scenario`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulateSource {
    /// Name of one of [`Scenario::detector_tests`].
    pub detector_test: Option<String>,
    /// A scenario file as `sohle simulate --print` writes it, beside the manifest.
    pub scenario: Option<PathBuf>,
    /// All that is random follows from it.
    pub seed: Option<u64>,
}

/// Where a file comes from.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Where it lies, as in the recordings.
    pub path: PathBuf,
    /// Of the whole file, hexadecimal.
    pub sha256: String,
    /// SPDX expression, or a word on where the licence is stated.
    pub licence: String,
    /// Where it can be had.
    pub upstream: Upstream,
}

/// A file in a public repository.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Upstream {
    /// Web address of the repository.
    pub repository: String,
    /// Full commit.
    pub commit: String,
    /// Path in the repository.
    pub path: String,
}

impl Manifest {
    /// Reads and checks a manifest.
    pub fn read(path: &Path) -> Result<Self, ManifestError> {
        let mut manifest: Self = toml_file::read("manifest", path)?;
        manifest.folder = path.parent().map(Path::to_owned).unwrap_or_default();
        manifest.check().map_err(|message| ManifestError::Contradiction { path: path.to_owned(), message })?;
        Ok(manifest)
    }

    /// Where `path` lies: beside the manifest, or in the folder of third-party recordings.
    pub fn locate(&self, path: &Path) -> Option<PathBuf> {
        let beside = self.folder.join(path);
        if beside.exists() {
            return Some(beside);
        }
        recordings_dir().map(|folder| folder.join(path)).filter(|path| path.exists())
    }

    /// How the samples of `entry` are to be read.
    pub fn profile(&self, entry: &Entry) -> Result<Profile, ProfileError> {
        let path = entry.path.clone().unwrap_or_default();
        Source { path, profile: entry.profile.clone(), mapping: entry.mapping.clone() }.resolve(&self.folder)
    }

    /// The walk that `source` asks for, or why there is none.
    pub fn scenario(&self, source: &SimulateSource) -> Result<Scenario, String> {
        let seed = source.seed.unwrap_or(1);
        match (&source.detector_test, &source.scenario) {
            (Some(wanted), None) => {
                let tests = Scenario::detector_tests(seed);
                let known: Vec<&str> = tests.iter().map(|(name, _)| name.as_str()).collect();
                let unknown = format!("'{wanted}' is no detector test; known: {}", known.join(", "));
                tests.into_iter().find(|(name, _)| name == wanted).map(|(_, scenario)| scenario).ok_or(unknown)
            }
            (None, Some(file)) => {
                let path = self.folder.join(file);
                let told = |message: String| format!("scenario {}: {message}", path.display());
                let text = std::fs::read_to_string(&path).map_err(|error| told(error.to_string()))?;
                let scenario = Scenario::from_toml(&text).map_err(|error| told(error.to_string()))?;
                Ok(Scenario { seed: source.seed.unwrap_or(scenario.seed), ..scenario })
            }
            _ => Err("give either detector_test or scenario".into()),
        }
    }

    /// The recordings called `names` only, in the order of the manifest, and the groups that have one of them; everything
    /// without names.
    pub fn only(mut self, names: &[String]) -> Result<Self, String> {
        if let Some(unknown) = names.iter().find(|name| !self.recordings.iter().any(|entry| entry.name == **name)) {
            return Err(format!("no recording '{unknown}' in the manifest; known: {}", self.names()));
        }
        if !names.is_empty() {
            self.recordings.retain(|entry| names.contains(&entry.name));
            self.groups.retain(|group| group.recordings.iter().any(|name| names.contains(name)));
        }
        Ok(self)
    }

    fn names(&self) -> String {
        self.recordings.iter().map(|entry| entry.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    fn check(&self) -> Result<(), String> {
        if self.recordings.is_empty() {
            return Err("lists no [[recording]]".into());
        }
        for (index, entry) in self.recordings.iter().enumerate() {
            let wrong = |message: String| format!("recording '{}': {message}", entry.name);
            if entry.name.trim().is_empty() {
                return Err(format!("recording number {} has an empty name", index + 1));
            }
            if self.recordings[..index].iter().any(|other| other.name == entry.name) {
                return Err(wrong("the name is used twice".into()));
            }
            match (&entry.path, &entry.simulate) {
                (Some(_), None) => self.profile(entry).map(drop).map_err(|error| wrong(error.to_string()))?,
                (None, Some(_)) if entry.profile.is_some() || entry.mapping.is_some() => {
                    return Err(wrong("profile and mapping belong to a path, not to a simulated walk".into()));
                }
                (None, Some(source)) => {
                    self.scenario(source).map(drop).map_err(|message| wrong(format!("simulate: {message}")))?;
                }
                _ => return Err(wrong("give either a path or simulate".into())),
            }
            entry.truth.check().map_err(wrong)?;
            if let Some(other) = &entry.truth.same_height_as
                && (*other == entry.name || !self.recordings.iter().any(|entry| entry.name == *other))
            {
                return Err(wrong(format!(
                    "same_height_as = '{other}' is no other recording; known: {}",
                    self.names()
                )));
            }
        }
        for group in &self.groups {
            for name in &group.recordings {
                if !self.recordings.iter().any(|entry| entry.name == *name) {
                    return Err(format!("group '{}': no recording '{name}'; known: {}", group.name, self.names()));
                }
            }
            if group.recordings.is_empty() {
                return Err(format!("group '{}' lists no recordings", group.name));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::source::Paths;

    fn project() -> Manifest {
        Manifest::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/recordings.toml")).unwrap()
    }

    #[test]
    fn the_projects_manifest_is_in_order() {
        let manifest = project();
        assert_eq!(manifest.recordings.len(), 26);
        for (index, file) in manifest.files.iter().enumerate() {
            assert!(manifest.files[..index].iter().all(|other| other.path != file.path), "{}", file.path.display());
        }
    }

    #[test]
    fn every_file_it_needs_has_an_origin() {
        let manifest = project();
        let known = |path: &Path| manifest.files.iter().any(|file| file.path == path);
        for entry in &manifest.recordings {
            assert!(entry.path.iter().all(|path| known(path)), "{}", entry.name);
            for paths in entry.truth.paths() {
                let any = match paths {
                    Paths::One(path) => known(path),
                    Paths::Any(paths) => paths.iter().any(|path| known(path)),
                };
                assert!(any, "{}: {paths:?}", entry.name);
            }
        }
    }

    #[test]
    fn the_examples_of_the_documentation_are_read() {
        let text = include_str!("../../../docs/manifest.md");
        let mut examples = 0;
        for example in text.split("```toml\n").skip(1).filter_map(|part| part.split("```").next()) {
            // A part of an entry needs the entry around it, and a group its recordings.
            let around = "[[recording]]\nname = \"corridor back\"\npath = \"x.csv\"\n";
            let entry = if example.starts_with("[recording.") { example } else { "" };
            let track = if example.contains("truth.strides") {
                "truth.track = { path = \"t.csv\", at = { rate_hz = 1.0 }, x = 1, y = 2 }\n"
            } else {
                ""
            };
            let rest = if entry.is_empty() { example } else { "" };
            let shortest = text.split("```toml\n").nth(1).and_then(|part| part.split("```").next()).unwrap();
            let shortest = if rest == shortest { "" } else { shortest };
            let whole = format!("{around}{track}{entry}\n{shortest}\n{rest}");
            let manifest: Manifest = toml::from_str(&whole).unwrap_or_else(|error| panic!("{error}\n{whole}"));
            manifest.check().unwrap_or_else(|error| panic!("{error}\n{whole}"));
            examples += 1;
        }
        assert_eq!(examples, 5);
    }
}
