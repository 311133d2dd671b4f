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

#[cfg(test)]
mod tests {
    use super::super::{Preset, open, read, recordings_dir};

    #[test]
    fn both_feet_of_both_layouts_are_read() {
        let Some(folder) = recordings_dir() else { return };
        let cases = [
            ("imu_sample", Preset::GaitmapLeft, 7928, 0.880_810_706_6),
            ("imu_sample", Preset::GaitmapRight, 7928, 0.311_552_590_4),
            ("imu_sample_healthy_stair_up", Preset::GaitmapLeft, 5130, -7.492_718_317_5),
            ("imu_sample_healthy_stair_up", Preset::GaitmapRight, 5130, -7.048_681_667_5),
        ];
        for (file, foot, count, first) in cases {
            let walk = open(&folder.join(format!("foot_gaitmap/{file}.csv")), Some(&foot.into())).unwrap();
            assert_eq!(walk.samples.len(), count);
            assert_eq!(walk.samples[0].accel.0.x, first as f32);
            assert!((walk.duration_s() - (count - 1) as f64 / 204.8).abs() < 1e-6);
            // Peaks of 155 m/s² and more are the end of 16 g.
            assert!(walk.irregularities.accel_clipped > 0 && walk.irregularities.gyro_clipped == 0);
            let gravity = walk.gravity_at_rest().unwrap();
            // The left sensor of the walk reads 9.47 at rest.
            assert!((gravity - 9.81).abs() < 0.04 * 9.81, "{gravity}");
        }
    }

    #[test]
    fn without_a_profile_it_is_asked_which_foot() {
        let head = ",left_sensor,left_sensor,left_sensor,left_sensor,left_sensor,left_sensor,right_sensor,right_sensor,\
                    right_sensor,right_sensor,right_sensor,right_sensor\n,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z,\
                    gyr_x,gyr_y,gyr_z\n0.0,1,2,3,4,5,6,7,8,9,10,11,12\n";
        let message = read("feet.csv".as_ref(), head.as_bytes(), None).unwrap_err().to_string();
        assert!(
            message.ends_with("fits more than one profile (gaitmap-left, gaitmap-right); name one of them"),
            "{message}"
        );
    }
}
