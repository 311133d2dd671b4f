//! gaitmap CSV: the profiles `gaitmap-left` and `gaitmap-right`.
//!
//! Both feet in one file, two header lines (sensor, axis) in either order of columns; m/s², deg/s, 204.8 Hz. The first
//! column counts samples or seconds, depending on the file, and is not used. Range 16 g, 2000 deg/s (NilsPod).

use super::mapping::{Column, Mapping};
use super::unit::{AccelUnit, GyroUnit};

/// The columns of one foot; `sensor` is the first line's name for it.
pub(super) fn mapping(sensor: &str) -> Mapping {
    let columns = |kind: &str| Some(["x", "y", "z"].map(|axis| Column::Name(format!("{sensor}.{kind}_{axis}"))));
    Mapping {
        header_lines: Some(2),
        rate_hz: Some(204.8),
        accel: columns("acc"),
        accel_unit: Some(AccelUnit::MetrePerSecond2),
        gyro: columns("gyr"),
        gyro_unit: Some(GyroUnit::DegreePerSecond),
        accel_range_g: Some(16.0),
        gyro_range_deg_s: Some(2000.0),
        ..Mapping::default()
    }
}
