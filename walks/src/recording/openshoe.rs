//! OpenShoe text, in both variants.
//!
//! `openshoe250`: MicroStrain 3DM-GX2 in the sole. A data line starts with `0x`; accelerometer in g (columns 2 to 4),
//! gyroscope in rad/s (5 to 7), and a counter of 19.6608 MHz (8), 78720 ticks or 4.0039 ms for each sample. The counter
//! is set back about once a second; such a line counts as one usual sample. Range 18 g, 1200 deg/s (upstream's
//! `readme.m`).
//!
//! `openshoe820`: ADIS16367 under the heel. Six columns without a header, m/s² and rad/s, and no time: 820 Hz. A file
//! like this cannot be told from any other six columns and is therefore never recognised without being named.

use super::mapping::{Column, Mapping, Separator, numbered};
use super::unit::{AccelUnit, GyroUnit, TimeUnit};

/// **Units:** Hz.
const COUNTER_HZ: f64 = 19_660_800.0;

/// The columns of `openshoe250`.
pub(super) fn mapping_250() -> Mapping {
    Mapping {
        separator: Some(Separator::Whitespace),
        line_start: Some("0x".into()),
        time: Some(Column::Number(8)),
        time_unit: Some(TimeUnit::PerTick(1.0 / COUNTER_HZ)),
        counter: Some(true),
        accel: numbered(2),
        accel_unit: Some(AccelUnit::G),
        gyro: numbered(5),
        gyro_unit: Some(GyroUnit::RadianPerSecond),
        accel_range_g: Some(18.0),
        gyro_range_deg_s: Some(1200.0),
        ..Mapping::default()
    }
}

/// The columns of `openshoe820`.
pub(super) fn mapping_820() -> Mapping {
    Mapping {
        separator: Some(Separator::Character(b',')),
        header_lines: Some(0),
        rate_hz: Some(820.0),
        accel: numbered(1),
        accel_unit: Some(AccelUnit::MetrePerSecond2),
        gyro: numbered(4),
        gyro_unit: Some(GyroUnit::RadianPerSecond),
        accel_range_g: Some(18.0),
        gyro_range_deg_s: Some(1200.0),
        ..Mapping::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Preset, open, read, recordings_dir};

    #[test]
    fn the_loops_with_a_counter_are_recognised_and_read() {
        let Some(folder) = recordings_dir() else { return };
        for (file, count, first) in [("2", 16_420, -0.105_817_76), ("44", 12_239, -0.016_719_40)] {
            let path = folder.join(format!("foot_openshoe250/Measurement_100521_{file}.txt"));
            let walk = open(&path, None).unwrap();
            assert_eq!(walk.samples.len(), count);
            // 78720 ticks of 19.6608 MHz for each sample. The counter is set back about once a second; the stamps of
            // the PC agree with a regular rate to 1e-4 over the walk.
            let expected = (count - 1) as f64 * 78_720.0 / 19_660_800.0;
            assert!((walk.duration_s() / expected - 1.0).abs() < 1e-4, "{}", walk.duration_s());
            assert_eq!((walk.irregularities.backwards, walk.irregularities.gaps), (0, 0));
            assert!((walk.rate_hz() - 249.76).abs() < 0.02, "{}", walk.rate_hz());
            assert!((f64::from(walk.samples[0].accel.0.x) - first * 9.80665).abs() < 1e-6);
            let gravity = walk.gravity_at_rest().unwrap();
            assert!((gravity - 9.81).abs() < 0.03 * 9.81, "{gravity}");
        }
    }

    #[test]
    fn the_loop_without_times_needs_its_profile() {
        let Some(folder) = recordings_dir() else { return };
        let path = folder.join("foot_openshoe820/OpenShoeDataSet.txt");
        let message = open(&path, None).unwrap_err().to_string();
        assert!(message.contains("6 columns without names; name a profile (csv, "), "{message}");
        let walk = open(&path, Some(&Preset::Openshoe820.into())).unwrap();
        assert_eq!(walk.samples.len(), 51_055);
        assert!((walk.duration_s() - 51_054.0 / 820.0).abs() < 1e-6);
        assert_eq!(walk.samples[0].accel.0.z, 9.862_508);
    }

    #[test]
    fn lines_that_are_no_data_are_passed_over() {
        let line = |count: u32| format!("  0xcb -0.1 +0.15 +0.99 +0.001 +0.002 +0.003 {count} 0x15fd 1\r\n");
        let text = format!("\r\nInertial data.\r\n\r\nHeader: a_x [g]:\r\n{}{}{}", line(500), line(79_220), line(10));
        let walk = read("data_inert.txt".as_ref(), text.as_bytes(), None).unwrap();
        assert_eq!(walk.samples.iter().map(|sample| sample.time.0).collect::<Vec<_>>(), [0, 4004, 8008]);
    }
}
