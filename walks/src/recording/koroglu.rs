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

#[cfg(test)]
mod tests {
    use super::super::{Recording, open, recordings_dir};
    use std::path::Path;

    fn read(folder: &Path, file: &str) -> Recording {
        open(&folder.join(file), None).unwrap()
    }

    #[test]
    fn the_matlab_file_and_its_csv_twin_hold_the_same() {
        let Some(folder) = recordings_dir() else { return };
        for (walk, count, seconds) in [
            (31, 8549, 42.738_857),
            (32, 14_601, 72.996_857),
            (34, 5200, 25.993_977),
            (36, 14_000, 69.992_676),
            (39, 20_000, 99.991_18),
        ] {
            let mat = read(&folder, &format!("foot_koroglu_gcp/SensorConnectData_{walk}_LLIO.mat"));
            let csv = read(&folder, &format!("foot_koroglu_gcp/exp{walk}_imu.csv"));
            assert_eq!((mat.samples.len(), csv.samples.len()), (count, count));
            assert!((mat.duration_s() - seconds).abs() < 2e-6);
            assert!((mat.rate_hz() - 200.0).abs() < 0.1);
            assert_eq!(mat.range, csv.range);
            for (one, other) in mat.samples.iter().zip(&csv.samples) {
                // The CSV holds six decimals.
                assert!((one.time - other.time).abs() <= 1);
                assert!((one.accel.0 - other.accel.0).amax() < 5e-6 && (one.gyro.0 - other.gyro.0).amax() < 2e-6);
            }
            let gravity = mat.gravity_at_rest().unwrap();
            assert!((gravity - 9.81).abs() < 0.02 * 9.81, "{walk}: {gravity}");
            // The walks stay inside the range but for single kicks; the run does not.
            assert_eq!(mat.irregularities.gyro_clipped > 30, walk == 34, "{walk}: {:?}", mat.irregularities);
        }
    }

    #[test]
    fn the_counted_walks_are_in_g() {
        let Some(folder) = recordings_dir() else { return };
        for (walk, count) in [(17, 6601), (18, 7800), (20, 16_601)] {
            let walk = read(&folder, &format!("foot_koroglu_count/SensorConnectData_{walk}.csv"));
            assert_eq!(walk.samples.len(), count);
            assert_eq!(walk.metadata.get("profile").map(String::as_str), Some("sensorconnect"));
            let gravity = walk.gravity_at_rest().unwrap();
            assert!((gravity - 9.81).abs() < 0.02 * 9.81, "{gravity}");
        }
    }

    #[test]
    fn the_truth_beside_the_samples_can_be_read() {
        let Some(folder) = recordings_dir() else { return };
        let file = folder.join("foot_koroglu_gcp/SensorConnectData_31_LLIO.mat");
        let variables = super::super::mat::variables(&file).unwrap();
        let (strides, points) = (&variables["strideIndex"], &variables["GCP_wcf"]);
        assert_eq!((strides.rows, strides.columns, points.rows.max(points.columns)), (34, 1, 34), "{points:?}");
    }
}
