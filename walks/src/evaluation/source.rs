//! Where the truth of a walk stands: what a manifest says of truth files, checked but not yet read.

use crate::recording::mapping::{Column, Separator};
use crate::recording::unit::TimeUnit;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What is known of a walk, and where it stands.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthSource {
    /// Positions of stances.
    pub positions: Option<PointsSource>,
    /// Motion capture.
    pub track: Option<PointsSource>,
    /// Lengths of strides.
    pub strides: Option<StridesSource>,
    /// Labels of standing.
    pub still: Option<StillSource>,
    /// The truth that the recording itself carries (a simulated walk).
    #[serde(default)]
    pub simulated: bool,
    /// The walk ends where it starts.
    #[serde(default)]
    pub closed_loop: bool,
    /// Strides of the foot with the sensor.
    pub stride_count: Option<usize>,
    /// Height of the end above the start. **Units:** m.
    pub height_change_m: Option<f64>,
    /// Another recording of the same walk, that of the other foot: both climb the same height.
    pub same_height_as: Option<String>,
}

/// A path, or several of which the first that exists is taken.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged, expecting = "expected a path or a list of paths")]
pub enum Paths {
    /// The only one.
    One(PathBuf),
    /// Alternatives with the same content.
    Any(Vec<PathBuf>),
}

/// How a table of text is laid out.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Layout {
    /// Between two values; a comma if left out.
    pub separator: Option<Separator>,
    /// Lines to skip before the header.
    pub skip_lines: usize,
    /// Lines of column names, 0, 1 or 2; 1 if left out. The names of two lines are joined by a point.
    pub header_lines: Option<usize>,
    /// Lines that start with this are skipped.
    pub comment: Option<String>,
}

/// When the lines of a truth were true. Exactly one of `time`, `index` and `rate_hz`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Instants {
    /// Column of times in the clock of the recording.
    pub time: Option<Column>,
    /// Unit of the time column; seconds if left out.
    pub time_unit: Option<TimeUnit>,
    /// Column of numbers of samples of the recording.
    pub index: Option<Column>,
    /// Number of the first sample; 0 if left out.
    pub first_index: usize,
    /// Lines each second, the first with the first sample. **Units:** Hz.
    pub rate_hz: Option<f64>,
    /// Added to the times. **Units:** s.
    pub offset_s: f64,
}

/// Which horizontal axis of a truth is reversed against a right-handed frame with z up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mirrored {
    /// None.
    #[default]
    No,
    /// x.
    X,
    /// y.
    Y,
}

/// Unit of lengths in a truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum LengthUnit {
    /// Metres.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
}

impl LengthUnit {
    /// What one unit is. **Units:** m.
    pub fn factor(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 1e-2,
            Self::Millimetre => 1e-3,
        }
    }
}

/// Where positions stand: a line for each.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointsSource {
    /// The file.
    pub path: Paths,
    /// How it is laid out.
    #[serde(default)]
    pub layout: Layout,
    /// When the foot was there.
    pub at: Instants,
    /// Column.
    pub x: Column,
    /// Column.
    pub y: Column,
    /// Unit of both.
    #[serde(default)]
    pub unit: LengthUnit,
    /// Whether the frame is left-handed.
    #[serde(default)]
    pub mirrored: Mirrored,
    /// Estimates the offset of the clock within so much either way; of a continuous reference only. **Units:** s.
    pub clock_search_s: Option<f64>,
}

/// Where lengths of strides stand: a line for each.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StridesSource {
    /// The file.
    pub path: Paths,
    /// How it is laid out.
    #[serde(default)]
    pub layout: Layout,
    /// Column of the instants of the stances the strides start from.
    pub start: Column,
    /// Column of the instants of the stances they lead to.
    pub end: Column,
    /// Unit of both; seconds if left out.
    pub time_unit: Option<TimeUnit>,
    /// Column of lengths; the distance in the reference track if left out.
    pub length: Option<Column>,
    /// Unit of the lengths.
    #[serde(default)]
    pub unit: LengthUnit,
    /// Only lines with these values in these columns.
    #[serde(default, rename = "where")]
    pub only: BTreeMap<String, String>,
}

/// Where labels of standing stand: a line for each instant.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StillSource {
    /// The file.
    pub path: Paths,
    /// How it is laid out.
    #[serde(default)]
    pub layout: Layout,
    /// When.
    pub at: Instants,
    /// Column; 0 means moving, anything else standing.
    pub label: Column,
}

impl TruthSource {
    /// Every path it reads.
    pub fn paths(&self) -> impl Iterator<Item = &Paths> {
        let positions = self.positions.iter().map(|source| &source.path);
        let track = self.track.iter().map(|source| &source.path);
        let strides = self.strides.iter().map(|source| &source.path);
        positions.chain(track).chain(strides).chain(self.still.iter().map(|source| &source.path))
    }

    /// Refuses what contradicts itself, in one line.
    pub fn check(&self) -> Result<(), String> {
        let instants = [
            ("positions", self.positions.as_ref().map(|source| (&source.at, &source.layout))),
            ("track", self.track.as_ref().map(|source| (&source.at, &source.layout))),
            ("still", self.still.as_ref().map(|source| (&source.at, &source.layout))),
        ];
        for (kind, source) in instants {
            if let Some((at, layout)) = source {
                at.check().map_err(|message| format!("truth.{kind}.at: {message}"))?;
                layout.check().map_err(|message| format!("truth.{kind}.layout: {message}"))?;
            }
        }
        if let Some(strides) = &self.strides {
            strides.layout.check().map_err(|message| format!("truth.strides.layout: {message}"))?;
            if strides.length.is_none() && self.track.is_none() {
                return Err("truth.strides: give a column 'length', or a truth.track to measure the strides in".into());
            }
        }
        if self.positions.is_some() && self.track.is_some() {
            return Err("truth: give either positions or a track, not both".into());
        }
        if self.simulated && (self.positions.is_some() || self.track.is_some()) {
            return Err("truth: a simulated walk brings its own positions".into());
        }
        for paths in self.paths() {
            if matches!(paths, Paths::Any(list) if list.is_empty()) {
                return Err("truth: a list of paths is empty".into());
            }
        }
        if self.positions.as_ref().is_some_and(|positions| positions.clock_search_s.is_some()) {
            return Err("truth.positions: clock_search_s needs a continuous truth.track".into());
        }
        let search = self.track.as_ref().and_then(|track| track.clock_search_s);
        if search.is_some_and(|search| !(0.0..=MOST_CLOCK_SEARCH_S).contains(&search)) {
            return Err(format!("truth.track.clock_search_s must lie between 0 and {MOST_CLOCK_SEARCH_S}"));
        }
        if self.height_change_m.is_some_and(|height| !height.is_finite()) {
            return Err("truth.height_change_m must be a number".into());
        }
        Ok(())
    }
}

/// Clocks further apart are a mistake, not an offset, and the search would take minutes. **Units:** s.
const MOST_CLOCK_SEARCH_S: f64 = 60.0;

impl Layout {
    fn check(&self) -> Result<(), String> {
        match self.header_lines {
            Some(lines) if lines > 2 => Err("header_lines must be 0, 1 or 2".into()),
            _ => Ok(()),
        }
    }
}

impl Instants {
    fn check(&self) -> Result<(), String> {
        let given = [self.time.is_some(), self.index.is_some(), self.rate_hz.is_some()];
        if given.iter().filter(|given| **given).count() != 1 {
            return Err("give one of time, index and rate_hz".into());
        }
        if self.rate_hz.is_some_and(|rate| !(rate.is_finite() && rate > 0.0)) {
            return Err("rate_hz must be above 0".into());
        }
        if self.time_unit.is_some() && self.time.is_none() {
            return Err("time_unit needs a column 'time'".into());
        }
        if self.first_index != 0 && self.index.is_none() {
            return Err("first_index needs a column 'index'".into());
        }
        if !self.offset_s.is_finite() {
            return Err("offset_s must be a number".into());
        }
        Ok(())
    }
}
