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

#[cfg(test)]
mod tests {
    use super::super::{Profile, recordings_dir};

    #[test]
    fn the_short_walk_is_recognised_and_read() {
        let Some(folder) = recordings_dir() else { return };
        let walk = super::super::open(&folder.join("foot_xio/short_walk.csv"), None).unwrap();
        assert_eq!((walk.name.as_str(), walk.samples.len()), ("short_walk", 16_539));
        assert_eq!(walk.metadata.get("profile").map(String::as_str), Some("xio"));
        // The median of the stamps; the mean, 397.4 Hz, counts the repeats too.
        assert!((walk.rate_hz() - 398.3).abs() < 0.2, "{}", walk.rate_hz());
        assert!((walk.duration_s() - 41.618_030).abs() < 1e-6);
        assert_eq!(walk.irregularities.repeated, 205);
        assert_eq!(walk.samples[1].time, walk.samples[2].time);
        // -0.4937814 g and -0.1428319 deg/s.
        assert!((walk.samples[0].accel.0.x + 4.842_341).abs() < 1e-6);
        assert!((walk.samples[0].gyro.0.x + 0.002_492_887).abs() < 1e-9);
        let gravity = walk.gravity_at_rest().unwrap();
        assert!((gravity - 9.81).abs() < 0.03 * 9.81, "{gravity}");
        assert_eq!(walk.irregularities.accel_clipped + walk.irregularities.gyro_clipped, 0);
    }

    #[test]
    fn a_mapping_turns_the_axes_of_the_recognised_layout() {
        let text = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),\
                    Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n0,0,90,0,0,0,1\n0.01,0,0,0,0,0,1\n";
        let mapping = toml::from_str("axes = ['z', 'x', 'y']").unwrap();
        let walk = super::super::read("a.csv".as_ref(), text.as_bytes(), Some(&Profile { mapping })).unwrap();
        assert_eq!(walk.samples[0].accel.0.as_slice(), [9.80665, 0.0, 0.0]);
        assert_eq!(walk.samples[0].gyro.0.as_slice(), [0.0, 0.0, std::f32::consts::FRAC_PI_2]);
    }
}
