//! What a phone measures.

use nalgebra::Vector3;
use sohle_shared::time::Micros;

/// One moment of a phone. **Frame:** the phone's, x to the right of the screen, y to its top, z out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhoneSample {
    /// When.
    pub time: Micros,
    /// Specific force. **Units:** m/s².
    pub accel: Vector3<f64>,
    /// Angular rate. **Units:** rad/s.
    pub gyro: Vector3<f64>,
    /// Magnetic field. **Units:** µT.
    pub magnetic: Option<Vector3<f64>>,
    /// Air pressure. **Units:** hPa.
    pub pressure: Option<f64>,
}

/// Where the person was at a moment, as it was surveyed or as a source of positions says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayPoint {
    /// When.
    pub time: Micros,
    /// **Units:** m; **Frame:** that of the recording.
    pub place: [f64; 2],
}

/// A recorded walk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhoneRecording {
    /// In order of time.
    pub samples: Vec<PhoneSample>,
    /// Surveyed, in order of time.
    pub way_points: Vec<WayPoint>,
    /// What a source of positions said, in order of time; most recordings have none.
    pub positions: Vec<WayPoint>,
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be read.
    #[error("{file} cannot be read")]
    File {
        /// Its name.
        file: String,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// A line that is none.
    #[error("{file}, line {line}: {what}")]
    Line {
        /// Its name.
        file: String,
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// Of no kind that can be read.
    #[error("{file} is no recording of a phone")]
    Unknown {
        /// Its name.
        file: String,
    },
    /// Nothing to track.
    #[error("{file} has no samples of {what}")]
    Empty {
        /// Its name.
        file: String,
        /// Of which sensor.
        what: &'static str,
    },
}

/// The text of a file.
pub(super) fn text_of(path: &std::path::Path) -> Result<String, ReadError> {
    let name = path.display().to_string();
    std::fs::read_to_string(path).map_err(|source| ReadError::File { file: name, source })
}

/// Parses a number that is one.
pub(super) fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("'{}' is no number", text.trim())),
    }
}

/// A moment from milliseconds since 1970.
pub(super) fn milliseconds(text: &str) -> Result<Micros, String> {
    let value = number(text)?;
    // Beyond the year 5000 the microseconds of the time would not be exact any more.
    if (0.0..1e14).contains(&value) {
        Ok(Micros((value * 1e3).round() as i64))
    } else {
        Err(format!("'{text}' is no time"))
    }
}
