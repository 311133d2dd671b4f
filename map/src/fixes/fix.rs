//! What a source of positions says.

use nalgebra::Matrix2;
use sohle_shared::time::Micros;
use std::sync::Arc;

/// The frame that a source speaks in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Frame {
    /// Metres of the building.
    Building,
    /// Longitude and latitude in degrees, WGS 84 (EPSG:4326, in this order); the covariance in metres east and north.
    Geographic,
    /// Easting and northing of a UTM zone of WGS 84 by its EPSG code. **Units:** m.
    Utm(u32),
}

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measured {
    /// A place.
    Position {
        /// In the frame of the fix.
        place: [f64; 2],
        /// Covariance of the place. **Units:** m², along the axes of the frame.
        covariance: Matrix2<f64>,
    },
    /// The distance to an anchor whose place is known.
    Range {
        /// In the frame of the fix.
        anchor: [f64; 2],
        /// How much higher the anchor is than what is carried. **Units:** m.
        above_m: f64,
        /// In space. **Units:** m.
        metres: f64,
        /// Standard deviation. **Units:** m.
        sigma_m: f64,
    },
}

/// How much too long a range of UWB is, and how far it is off beyond that (standard deviation): median and median deviation of
/// those that `sohle evaluate --suite fixes` looks at. **Units:** m.
pub const RANGE_OFFSET_M: f64 = 0.07;
/// See [`RANGE_OFFSET_M`]. **Units:** m.
pub const RANGE_SIGMA_M: f64 = 0.42;

impl Measured {
    /// A range of UWB of whose errors nobody says anything: they are what is usual. **Units:** m.
    pub fn usual_range(anchor: [f64; 2], above_m: f64, metres: f64) -> Self {
        // What is shorter than the offset is a range all the same.
        let metres = metres - RANGE_OFFSET_M.min(0.5 * metres);
        Self::Range { anchor, above_m, metres, sigma_m: RANGE_SIGMA_M }
    }
}

/// A position, or a distance, as its source says it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fix {
    /// When it was measured, by the clock of the steps.
    pub time: Micros,
    /// When it arrived, by the same clock; not before it was measured.
    pub arrived: Micros,
    /// Who says so.
    pub source: Arc<str>,
    /// The frame of what was measured.
    pub frame: Frame,
    /// What was measured.
    pub measured: Measured,
    /// Number of the floor, if the source knows it.
    pub floor: Option<i32>,
}
