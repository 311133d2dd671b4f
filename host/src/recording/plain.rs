//! Plain CSV: the profile `csv`.
//!
//! Without a mapping the columns are expected under the project's own names, in its own units: `time_s`, `accel_x`,
//! `accel_y`, `accel_z` (m/s²), `gyro_x`, `gyro_y`, `gyro_z` (rad/s).

use super::mapping::{Column, Mapping, named};
use super::unit::{AccelUnit, GyroUnit, TimeUnit};

/// The columns of the profile.
pub(super) fn mapping() -> Mapping {
    Mapping {
        time: Some(Column::Name("time_s".into())),
        time_unit: Some(TimeUnit::Second),
        accel: named(["accel_x", "accel_y", "accel_z"]),
        accel_unit: Some(AccelUnit::MetrePerSecond2),
        gyro: named(["gyro_x", "gyro_y", "gyro_z"]),
        gyro_unit: Some(GyroUnit::RadianPerSecond),
        ..Mapping::default()
    }
}
