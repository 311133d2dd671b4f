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
