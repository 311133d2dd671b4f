//! CSV of the motion-capture walk (Constrained-ZUPT-FGO): the profile `ucr`.
//!
//! m/s², rad/s, a running number in place of a time: 60 Hz.

use super::mapping::{Mapping, named};
use super::unit::{AccelUnit, GyroUnit};

/// The columns of the profile.
pub(super) fn mapping() -> Mapping {
    Mapping {
        rate_hz: Some(60.0),
        accel: named(["acc_x", "acc_y", "acc_z"]),
        accel_unit: Some(AccelUnit::MetrePerSecond2),
        gyro: named(["gyro_x", "gyro_y", "gyro_z"]),
        gyro_unit: Some(GyroUnit::RadianPerSecond),
        ..Mapping::default()
    }
}
