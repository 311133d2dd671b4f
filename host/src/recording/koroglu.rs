//! The surveyed walks and the counted strides (MicroStrain 3DM-GX5-25, 200 Hz), in three forms.
//!
//! `koroglu-mat`: MATLAB v5 file with `timestamps` (s) and `imu_data` (accelerometer m/s², gyroscope rad/s).
//! `koroglu-csv`: the same as CSV. `sensorconnect`: as exported by MicroStrain's SensorConnect, accelerometer in g,
//! gyroscope in rad/s, the sensor's serial number in every column's name. The gyroscope clips at 500 deg/s.

use super::mapping::{Column, Mapping, named};
use super::unit::{AccelUnit, GyroUnit, TimeUnit};

/// What the three forms share.
fn sensor() -> Mapping {
    Mapping {
        time_unit: Some(TimeUnit::Second),
        accel_unit: Some(AccelUnit::MetrePerSecond2),
        gyro_unit: Some(GyroUnit::RadianPerSecond),
        gyro_range_deg_s: Some(500.0),
        ..Mapping::default()
    }
}

/// The variables of `koroglu-mat`; a column of a variable is named by its number.
pub(super) fn mat_mapping() -> Mapping {
    Mapping {
        time: Some(Column::Name("timestamps".into())),
        accel: named(["imu_data.1", "imu_data.2", "imu_data.3"]),
        gyro: named(["imu_data.4", "imu_data.5", "imu_data.6"]),
        ..sensor()
    }
}

/// The columns of `koroglu-csv`.
pub(super) fn csv_mapping() -> Mapping {
    Mapping {
        time: Some(Column::Name("t_s".into())),
        accel: named(["acc_x_mps2", "acc_y_mps2", "acc_z_mps2"]),
        gyro: named(["gyr_x_radps", "gyr_y_radps", "gyr_z_radps"]),
        ..sensor()
    }
}

/// The columns of `sensorconnect`.
pub(super) fn sensorconnect_mapping() -> Mapping {
    Mapping {
        time: Some(Column::Name("Time".into())),
        accel: named(["*:scaledAccelX", "*:scaledAccelY", "*:scaledAccelZ"]),
        accel_unit: Some(AccelUnit::G),
        gyro: named(["*:scaledGyroX", "*:scaledGyroY", "*:scaledGyroZ"]),
        ..sensor()
    }
}
