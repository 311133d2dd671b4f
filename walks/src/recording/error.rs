//! What can be wrong with a recording or with the description of one. Every message is one line.

use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// A recording could not be read or written: which one, and why.
#[derive(Debug, Error)]
#[error("{}", one_line(&format!("{}: {problem}", path.display())))]
pub struct RecordingError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: Problem,
}

/// What is wrong with a recording.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The operating system refused.
    #[error("{}", said(.0))]
    Io(#[from] io::Error),
    /// A directory where a file was expected.
    #[error("is a directory, expected a recording")]
    Directory,
    /// No bytes.
    #[error("the file is empty")]
    Empty,
    /// The file has structure but no samples.
    #[error("no samples: {0}")]
    NoSamples(String),
    /// The file ends in the middle of something.
    #[error("truncated: {0}")]
    Truncated(String),
    /// The bytes do not follow the format.
    #[error("{0}")]
    Malformed(String),
    /// Nothing tells which profile the file follows.
    #[error("{0}")]
    Unrecognised(String),
    /// The profile names a column that is not there.
    #[error("no column {wanted} for {purpose}; the file has: {present}")]
    MissingColumn {
        /// The column asked for.
        wanted: String,
        /// What it is needed for.
        purpose: &'static str,
        /// The columns that are there.
        present: String,
    },
    /// The mapping lacks a key.
    #[error("the mapping does not say {0}")]
    Incomplete(&'static str),
    /// A value that is no finite number.
    #[error("{place}: {what}")]
    Value {
        /// Line or row (counted from 1) and column.
        place: String,
        /// What is there instead of a number.
        what: String,
    },
    /// Time runs backwards.
    #[error("{place}: time runs backwards by {seconds:.3} s, at most {MOST_BACKWARDS_S} s is taken for jitter")]
    Backwards {
        /// Line or row, counted from 1.
        place: String,
        /// How far. **Units:** s.
        seconds: f64,
    },
    /// The values are not in the unit the profile states.
    #[error("{0}")]
    Unit(String),
}

/// Time may step back this far before a recording is refused: more is no jitter of a clock. **Units:** s.
pub const MOST_BACKWARDS_S: f64 = 1.0;

/// The plain name of the usual refusals, the system's own words for the others.
fn said(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file or directory".into(),
        io::ErrorKind::PermissionDenied => "no permission".into(),
        _ => error.to_string(),
    }
}

/// Names from a file may hold anything; a message holds no control characters.
fn one_line(message: &str) -> String {
    message.replace(char::is_control, "\u{fffd}")
}

/// A profile could not be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// No profile has this name.
    #[error("unknown profile '{name}'; known: {known}, or a file FILE.toml")]
    Unknown {
        /// The name given.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The profile's file could not be read.
    #[error("{}: {}", path.display(), said(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The refusal.
        source: io::Error,
    },
    /// The profile's file says something that cannot be.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Where and what, in one line.
        message: String,
    },
    /// A mapping inside another file contradicts itself.
    #[error("mapping: {0}")]
    Mapping(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_refusals_have_plain_names() {
        let told = |kind| RecordingError { path: "walk.csv".into(), problem: io::Error::from(kind).into() }.to_string();
        assert_eq!(told(io::ErrorKind::PermissionDenied), "walk.csv: no permission");
        assert_eq!(told(io::ErrorKind::NotFound), "walk.csv: no such file or directory");
        assert_eq!(told(io::ErrorKind::TimedOut), "walk.csv: timed out");
    }
}
