//! x-io Technologies' CSV (NGIMU, Gait-Tracking): the profile `xio`.
//!
//! Time in seconds, gyroscope in deg/s, accelerometer in g; range 16 g and 2000 deg/s. The radio repeats samples and
//! stamps now and then; both stay in.

use super::mapping::{Column, Mapping, named};
use super::unit::{AccelUnit, GyroUnit, TimeUnit};

/// The columns of the profile.
pub(super) fn mapping() -> Mapping {
    Mapping {
        time: Some(Column::Name("Time (s)".into())),
        time_unit: Some(TimeUnit::Second),
        accel: named(["Accelerometer X (g)", "Accelerometer Y (g)", "Accelerometer Z (g)"]),
        accel_unit: Some(AccelUnit::G),
        gyro: named(["Gyroscope X (deg/s)", "Gyroscope Y (deg/s)", "Gyroscope Z (deg/s)"]),
        gyro_unit: Some(GyroUnit::DegreePerSecond),
        accel_range_g: Some(16.0),
        gyro_range_deg_s: Some(2000.0),
        ..Mapping::default()
    }
}
