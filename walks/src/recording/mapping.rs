//! How the columns of a file become inertial samples: the part of a recording's description that a user writes.
//!
//! A mapping is a TOML table, either a file of its own (`--profile FILE.toml`) or part of an evaluation manifest. Every
//! key may be left out; what is left out comes from the profile named by `base` or, without one, from the profile that
//! the file's content is recognised as.
//!
//! ```toml
//! # A plain CSV file: comma, one header line, milliseconds, g, deg/s.
//! time = "timestamp"                # column, by name or by number (the first is 1)
//! time_unit = "ms"                  # s, ms, us, ns, or a number of seconds for each tick
//! accel = ["ax", "ay", "az"]
//! accel_unit = "g"                  # m/s2, g, mg, or a number of m/s² for each bit
//! gyro = ["gx", "gy", "gz"]
//! gyro_unit = "deg/s"               # rad/s, deg/s, mrad/s, mdeg/s, or a number of rad/s for each bit
//! axes = ["-y", "x", "z"]           # the new x is the recorded -y, ...
//! accel_range_g = 16.0              # readings at the end of the sensor's range are marked as clipped
//! gyro_range_deg_s = 2000.0
//! ```
//!
//! The remaining keys: `rate_hz` in place of a time column; `counter = true` for a time column that falls back to a
//! smaller value now and then (a step back then counts as one usual step forward); `separator` (one character, or
//! `"whitespace"`); `skip_lines` before the header; `header_lines` (0, 1 or 2; the names of two lines are joined by a
//! point: `left_sensor.acc_x`); `comment`, which lines to skip start with; `line_start`, which lines to read start with.
//! Where names vary from file to file, a `*` in front of a column's name stands for anything: `"*:scaledAccelX"`.

use super::axes::Axes;
use super::profile::Preset;
use super::unit::{AccelUnit, GyroUnit, TimeUnit};
use serde::{Deserialize, Serialize};

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Column {
    /// By place; the first is 1.
    Number(usize),
    /// By name; a leading `*` stands for anything.
    Name(String),
}

impl Column {
    /// Whether a column of this name and place (from 0) is meant.
    pub fn fits(&self, name: &str, index: usize) -> bool {
        match self {
            Self::Number(number) => *number == index + 1,
            Self::Name(wanted) => match wanted.strip_prefix('*') {
                Some(end) => name.ends_with(end),
                None => name == wanted,
            },
        }
    }
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "number {number}"),
            Self::Name(name) => write!(f, "'{name}'"),
        }
    }
}

/// What stands between two values of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Separator {
    /// Any number of blanks and tabs.
    Whitespace,
    /// One ASCII character.
    Character(u8),
}

impl TryFrom<String> for Separator {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.as_bytes() {
            b"whitespace" | b" " => Ok(Self::Whitespace),
            b"\"" | b"\n" | b"\r" => Err("a quote or the end of a line cannot separate columns".into()),
            &[character] if character.is_ascii() => Ok(Self::Character(character)),
            _ => Err(format!("separator '{text}' is neither one ASCII character nor \"whitespace\"")),
        }
    }
}

impl From<Separator> for String {
    fn from(separator: Separator) -> Self {
        match separator {
            Separator::Whitespace => "whitespace".into(),
            Separator::Character(character) => char::from(character).into(),
        }
    }
}

/// A description of a file's columns, see the [module](self). Keys left out are taken from the profile below.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mapping {
    /// The profile that fills in what is left out here.
    pub base: Option<Preset>,
    /// Between two values. Found from the first line of data when left out.
    pub separator: Option<Separator>,
    /// Lines to skip before the header.
    pub skip_lines: Option<usize>,
    /// Lines of column names: 0, 1 or 2.
    pub header_lines: Option<usize>,
    /// Lines that start with this are skipped.
    pub comment: Option<String>,
    /// Only lines that start with this (after blanks) hold data; there is no header then.
    pub line_start: Option<String>,
    /// The time column. Excludes `rate_hz`.
    pub time: Option<Column>,
    /// Unit of the time column.
    pub time_unit: Option<TimeUnit>,
    /// The time column is a counter that starts again now and then.
    pub counter: Option<bool>,
    /// Samples come at this rate, whatever a time column says. **Units:** Hz.
    pub rate_hz: Option<f64>,
    /// Accelerometer columns x, y, z.
    pub accel: Option<[Column; 3]>,
    /// Their unit.
    pub accel_unit: Option<AccelUnit>,
    /// Gyroscope columns x, y, z.
    pub gyro: Option<[Column; 3]>,
    /// Their unit.
    pub gyro_unit: Option<GyroUnit>,
    /// Which recorded axis becomes which.
    pub axes: Option<Axes>,
    /// End of the accelerometer's range. **Units:** g.
    pub accel_range_g: Option<f64>,
    /// End of the gyroscope's range. **Units:** deg/s.
    pub gyro_range_deg_s: Option<f64>,
}

impl Mapping {
    /// This mapping, with `below` where it says nothing.
    #[must_use]
    pub fn over(self, below: Self) -> Self {
        // A rate replaces the time column below and the reverse; the unit goes with its column.
        let own_time = self.time.is_some() || self.rate_hz.is_some();
        Self {
            base: self.base.or(below.base),
            separator: self.separator.or(below.separator),
            skip_lines: self.skip_lines.or(below.skip_lines),
            header_lines: self.header_lines.or(below.header_lines),
            comment: self.comment.or(below.comment),
            line_start: self.line_start.or(below.line_start),
            time: if own_time { self.time } else { below.time },
            time_unit: self.time_unit.or(if own_time { None } else { below.time_unit }),
            counter: self.counter.or(if own_time { None } else { below.counter }),
            rate_hz: if own_time { self.rate_hz } else { below.rate_hz },
            accel: self.accel.or(below.accel),
            accel_unit: self.accel_unit.or(below.accel_unit),
            gyro: self.gyro.or(below.gyro),
            gyro_unit: self.gyro_unit.or(below.gyro_unit),
            axes: self.axes.or(below.axes),
            accel_range_g: self.accel_range_g.or(below.accel_range_g),
            gyro_range_deg_s: self.gyro_range_deg_s.or(below.gyro_range_deg_s),
        }
    }

    /// Refuses what contradicts itself, in one line.
    pub fn validate(&self) -> Result<(), String> {
        if self.time.is_some() && self.rate_hz.is_some() {
            return Err("give either a time column or rate_hz, not both".into());
        }
        let positive = [
            ("rate_hz", self.rate_hz),
            ("accel_range_g", self.accel_range_g),
            ("gyro_range_deg_s", self.gyro_range_deg_s),
        ];
        for (key, value) in positive {
            if value.is_some_and(|value| !(value.is_finite() && value > 0.0)) {
                return Err(format!("{key} must be above 0, not {}", value.unwrap_or_default()));
            }
        }
        if self.header_lines.is_some_and(|lines| lines > 2) {
            return Err("header_lines must be 0, 1 or 2".into());
        }
        if self.comment.as_deref() == Some("") || self.line_start.as_deref() == Some("") {
            return Err("comment and line_start must not be empty; leave them out instead".into());
        }
        let columns = self.time.iter().chain(self.accel.iter().flatten()).chain(self.gyro.iter().flatten());
        for column in columns {
            if *column == Column::Number(0) {
                return Err("columns are counted from 1".into());
            }
        }
        Ok(())
    }
}

/// Three columns by name.
pub(super) fn named(names: [&str; 3]) -> Option<[Column; 3]> {
    Some(names.map(|name| Column::Name(name.into())))
}

/// Three neighbouring columns by number, from `first` on.
pub(super) fn numbered(first: usize) -> Option<[Column; 3]> {
    Some([0, 1, 2].map(|offset| Column::Number(first + offset)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_of_the_documentation_is_read() {
        let text = include_str!("mapping.rs");
        let example: String = text
            .lines()
            .skip_while(|line| *line != "//! ```toml")
            .skip(1)
            .take_while(|line| *line != "//! ```")
            .map(|line| line.trim_start_matches("//!").trim_start().to_owned() + "\n")
            .collect();
        let mapping: Mapping = toml::from_str(&example).unwrap();
        mapping.validate().unwrap();
        assert_eq!(mapping.time, Some(Column::Name("timestamp".into())));
        assert_eq!(mapping.gyro_unit, Some(GyroUnit::DegreePerSecond));
        assert_eq!(toml::from_str::<Mapping>(&toml::to_string(&mapping).unwrap()).unwrap(), mapping);
    }

    #[test]
    fn an_unknown_key_is_refused() {
        let error = toml::from_str::<Mapping>("acel_unit = \"g\"").unwrap_err();
        assert!(error.message().contains("acel_unit"), "{error}");
    }

    #[test]
    fn a_rate_replaces_the_time_column_below() {
        let below = Mapping {
            time: Some(Column::Number(1)),
            time_unit: Some(TimeUnit::Millisecond),
            accel_range_g: Some(16.0),
            ..Mapping::default()
        };
        let mapping = Mapping { rate_hz: Some(100.0), ..Mapping::default() }.over(below.clone());
        assert_eq!((mapping.time, mapping.time_unit, mapping.rate_hz), (None, None, Some(100.0)));
        assert_eq!(mapping.accel_range_g, Some(16.0));
        let unit_only = Mapping { time_unit: Some(TimeUnit::Second), ..Mapping::default() }.over(below);
        assert_eq!((unit_only.time, unit_only.time_unit), (Some(Column::Number(1)), Some(TimeUnit::Second)));
    }

    #[test]
    fn contradictions_are_told() {
        let bad = [
            ("time = 1\nrate_hz = 100.0", "either"),
            ("rate_hz = 0.0", "above 0"),
            ("accel_range_g = nan", "above 0"),
            ("header_lines = 3", "0, 1 or 2"),
            ("time = 0", "from 1"),
            ("comment = \"\"", "empty"),
        ];
        for (text, part) in bad {
            let message = toml::from_str::<Mapping>(text).unwrap().validate().unwrap_err();
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
