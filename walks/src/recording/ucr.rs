//! CSV of the motion-capture walk (Constrained-ZUPT-FGO): the profile `ucr`.
//!
//! m/s², rad/s, a running number in place of a time: 60 Hz.

use super::mapping::{Mapping, named};
use super::unit::{AccelUnit, GyroUnit};

/// The column by which such a file is recognised.
pub(super) const SIGNATURE: &str = "is_zero_vel";

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

#[cfg(test)]
mod tests {
    use super::super::{open, recordings_dir};

    #[test]
    fn the_walk_is_recognised_and_read() {
        let Some(folder) = recordings_dir() else { return };
        let walk = open(&folder.join("foot_ucr_mocap/imuMeasLeft.csv"), None).unwrap();
        assert_eq!(walk.samples.len(), 7201);
        assert!((walk.duration_s() - 120.0).abs() < 1e-6);
        assert_eq!(walk.samples[0].accel.0.x, 0.331_804_215_9_f64 as f32);
        let gravity = walk.gravity_at_rest().unwrap();
        assert!((gravity - 9.81).abs() < 0.02 * 9.81, "{gravity}");
    }
}
