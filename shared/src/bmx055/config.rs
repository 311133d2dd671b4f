//! How the dies are set up, and what a count is worth then.

use super::batch::BATCH_FRAMES;
use super::registers::{accel, both, gyro};
use crate::sample::STANDARD_GRAVITY_M_S2;

/// Range of the accelerometer. The discriminant is the register's value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
#[repr(u8)]
pub enum AccelRange {
    /// ±2 g.
    G2 = 0x03,
    /// ±4 g.
    G4 = 0x05,
    /// ±8 g.
    G8 = 0x08,
    /// ±16 g; what the strike of a heel needs.
    #[default]
    G16 = 0x0C,
}

/// Bandwidth of the accelerometer; it delivers twice as many frames in a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
#[repr(u8)]
pub enum AccelBandwidth {
    /// 7.81 Hz.
    Hz8 = 0x08,
    /// 15.63 Hz.
    Hz16 = 0x09,
    /// 31.25 Hz.
    Hz31 = 0x0A,
    /// 62.5 Hz.
    Hz63 = 0x0B,
    /// 125 Hz.
    Hz125 = 0x0C,
    /// 250 Hz.
    Hz250 = 0x0D,
    /// 500 Hz.
    Hz500 = 0x0E,
    /// 1000 Hz.
    Hz1000 = 0x0F,
    /// No low-pass filter, 2000 frames in a second.
    #[default]
    Unfiltered = 0x1F,
}

/// Range of the gyroscope. The discriminant is the register's value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
#[repr(u8)]
pub enum GyroRange {
    /// ±2000 °/s; what a foot needs.
    #[default]
    Dps2000 = 0,
    /// ±1000 °/s.
    Dps1000 = 1,
    /// ±500 °/s.
    Dps500 = 2,
    /// ±250 °/s.
    Dps250 = 3,
    /// ±125 °/s.
    Dps125 = 4,
}

/// Data rate and bandwidth of the gyroscope. The discriminant is the register's value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
#[repr(u8)]
pub enum GyroBandwidth {
    /// 2000 frames in a second, 523 Hz.
    #[default]
    Hz523 = 0,
    /// 2000 frames in a second, 230 Hz.
    Hz230 = 1,
    /// 1000 frames in a second, 116 Hz.
    Hz116 = 2,
    /// 400 frames in a second, 47 Hz.
    Hz47 = 3,
    /// 200 frames in a second, 23 Hz.
    Hz23 = 4,
    /// 100 frames in a second, 12 Hz.
    Hz12 = 5,
    /// 200 frames in a second, 64 Hz.
    Hz64 = 6,
    /// 100 frames in a second, 32 Hz.
    Hz32 = 7,
}

/// Setting of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct AccelConfig {
    /// Largest specific force.
    pub range: AccelRange,
    /// Bandwidth and data rate.
    pub bandwidth: AccelBandwidth,
    /// Frames from one interrupt to the next: 1 to [`AccelConfig::WATERMARK_MAX`].
    pub watermark: u8,
}

/// Setting of the gyroscope.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct GyroConfig {
    /// Largest angular rate.
    pub range: GyroRange,
    /// Bandwidth and data rate.
    pub bandwidth: GyroBandwidth,
    /// Frames from one interrupt to the next: 1 to [`GyroConfig::WATERMARK_MAX`].
    pub watermark: u8,
}

/// Setting of the dies that feed the tracker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Config {
    /// Accelerometer.
    pub accel: AccelConfig,
    /// Gyroscope.
    pub gyro: GyroConfig,
}

impl Default for AccelConfig {
    /// ±16 g, unfiltered, an interrupt every 8 ms: the FIFO lasts for 16 ms.
    fn default() -> Self {
        Self { range: AccelRange::default(), bandwidth: AccelBandwidth::default(), watermark: 16 }
    }
}

impl Default for GyroConfig {
    /// ±2000 °/s, 2000 frames in a second, an interrupt every 8 ms: the FIFO lasts for 49 ms.
    fn default() -> Self {
        Self { range: GyroRange::default(), bandwidth: GyroBandwidth::default(), watermark: 16 }
    }
}

impl AccelConfig {
    /// Bits of a reading, two's complement.
    pub const BITS: u32 = 12;

    /// Highest watermark: two frames before the FIFO runs over.
    pub const WATERMARK_MAX: u8 = accel::FIFO_DEPTH as u8 - 2;

    /// Weight of a count (BMA255: 1024 counts to 1 g at ±2 g). **Units:** m/s².
    pub fn scale(&self) -> f32 {
        let counts_per_g = match self.range {
            AccelRange::G2 => 1024.0,
            AccelRange::G4 => 512.0,
            AccelRange::G8 => 256.0,
            AccelRange::G16 => 128.0,
        };
        STANDARD_GRAVITY_M_S2 / counts_per_g
    }

    /// Time from one frame to the next by the data sheet. **Units:** microseconds.
    pub fn period_us(&self) -> u32 {
        period_of_accel(self.bandwidth_bits())
    }

    /// The watermark within its limits.
    pub(super) fn watermark_bits(&self) -> u8 {
        self.watermark.clamp(1, Self::WATERMARK_MAX)
    }

    pub(super) fn bandwidth_bits(&self) -> u8 {
        self.bandwidth as u8 & 0x0F
    }

    /// Bits of [`both::HIGH_BANDWIDTH`].
    pub(super) fn high_bandwidth_bits(&self) -> u8 {
        if self.bandwidth == AccelBandwidth::Unfiltered { 0x80 } else { 0 }
    }
}

impl GyroConfig {
    /// Bits of a reading, two's complement.
    pub const BITS: u32 = 16;

    /// Highest watermark: what is read at once.
    pub const WATERMARK_MAX: u8 = BATCH_FRAMES as u8;

    /// Weight of a count (BMI088, table 5: 16.384 counts to 1 °/s at ±2000 °/s). **Units:** rad/s.
    pub fn scale(&self) -> f32 {
        let largest = match self.range {
            GyroRange::Dps2000 => 2000.0,
            GyroRange::Dps1000 => 1000.0,
            GyroRange::Dps500 => 500.0,
            GyroRange::Dps250 => 250.0,
            GyroRange::Dps125 => 125.0_f32,
        };
        largest.to_radians() / 32_768.0
    }

    /// Time from one frame to the next by the data sheet. **Units:** microseconds.
    pub fn period_us(&self) -> u32 {
        period_of_gyro(self.bandwidth as u8)
    }

    /// The watermark within its limits.
    pub(super) fn watermark_bits(&self) -> u8 {
        self.watermark.clamp(1, Self::WATERMARK_MAX)
    }
}

/// Period that belongs to the value of the accelerometer's [`both::BANDWIDTH`]; below 8 and above 15 the ends hold.
/// **Units:** microseconds.
pub(super) fn period_of_accel(bits: u8) -> u32 {
    64_000 >> (bits & 0x1F).clamp(8, 15).saturating_sub(8)
}

/// Period that belongs to the value of the gyroscope's [`both::BANDWIDTH`]. **Units:** microseconds.
pub(super) fn period_of_gyro(bits: u8) -> u32 {
    match bits & 0x07 {
        0 | 1 => 500,
        2 => 1_000,
        3 => 2_500,
        4 | 6 => 5_000,
        _ => 10_000,
    }
}

/// A register, the value it gets, and the bits of it that read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Setting {
    pub register: u8,
    pub value: u8,
    pub mask: u8,
}

const fn setting(register: u8, value: u8, mask: u8) -> Setting {
    Setting { register, value, mask }
}

/// Registers written to either die.
pub(super) const SETTINGS: usize = 10;

/// Registers written to the accelerometer for its sleep.
pub(super) const ASLEEP: usize = 10;

/// Change of a reading from that of the rest that is motion, however slowly it came: 47 mg, as when the foot tilts by 2.7°.
/// **Units:** counts at ±16 g.
const SHIFT: i16 = 6;

impl AccelConfig {
    /// In the order in which they are written: the FIFO last, so that it starts empty with everything else in place.
    pub(super) fn settings(&self) -> [Setting; SETTINGS] {
        [
            setting(both::POWER, 0, 0xE0),
            setting(both::RANGE, self.range as u8, 0x0F),
            setting(both::BANDWIDTH, self.bandwidth_bits(), 0x1F),
            setting(both::HIGH_BANDWIDTH, self.high_bandwidth_bits(), 0xC0),
            setting(accel::SELF_TEST, 0, 0x07),
            setting(accel::INT_OUT, accel::INT_OUT_INT1_HIGH, 0x0F),
            setting(accel::INT_MAP_1, accel::INT_MAP_1_WATERMARK, 0xFF),
            setting(accel::FIFO_WATERMARK, self.watermark_bits(), 0x3F),
            setting(accel::INT_EN_1, accel::INT_EN_1_WATERMARK, 0x7F),
            setting(both::FIFO_CONFIG_1, both::FIFO_STREAM, 0xC3),
        ]
    }

    /// What makes it sleep, in this order: no FIFO, and a reading of 62.5 Hz each 18 ms. A slope of more than 31 mg between
    /// two readings raises INT1 and keeps it up. The noise of a slope is 4 mg: 1.7 mg of the sensor, the rest of the rounding.
    pub(super) fn asleep(&self) -> [Setting; ASLEEP] {
        let threshold = 1 << self.finer();
        [
            setting(accel::INT_EN_1, 0, 0x7F),
            setting(both::FIFO_CONFIG_1, 0, 0xC3),
            setting(both::HIGH_BANDWIDTH, 0, 0xC0),
            setting(both::BANDWIDTH, AccelBandwidth::Hz63 as u8, 0x1F),
            setting(accel::SLOPE_DURATION, 0, 0x03),
            setting(accel::SLOPE_THRESHOLD, threshold, 0xFF),
            setting(accel::INT_MAP_0, accel::INT_MAP_0_SLOPE, 0xFF),
            setting(accel::INT_EN_0, accel::INT_EN_0_SLOPE, 0x07),
            setting(accel::INT_LATCH, accel::INT_LATCH_END | accel::INT_LATCH_FOREVER, 0x0F),
            setting(both::POWER, accel::POWER_LOW | accel::POWER_SLEEP_10_MS, 0xFE),
        ]
    }

    /// As [`SHIFT`], in the range that is set. **Units:** counts.
    pub(super) fn shift(&self) -> i16 {
        SHIFT << self.finer()
    }

    /// How often the range is half of ±16 g.
    fn finer(&self) -> u32 {
        match self.range {
            AccelRange::G16 => 0,
            AccelRange::G8 => 1,
            AccelRange::G4 => 2,
            AccelRange::G2 => 3,
        }
    }
}

impl GyroConfig {
    /// As those of the accelerometer.
    pub(super) fn settings(&self) -> [Setting; SETTINGS] {
        [
            setting(both::POWER, 0, 0xA0),
            setting(both::RANGE, self.range as u8, 0x07),
            setting(both::BANDWIDTH, self.bandwidth as u8, 0x0F),
            setting(both::HIGH_BANDWIDTH, 0, 0xC0),
            setting(gyro::INT_EN_1, gyro::INT_EN_1_INT1_HIGH, 0x0F),
            setting(gyro::INT_MAP_1, gyro::INT_MAP_1_FIFO, 0xFF),
            setting(gyro::FIFO_WM_EN, gyro::FIFO_WM_EN_ON, 0x88),
            setting(gyro::FIFO_WATERMARK, self.watermark_bits(), 0x7F),
            setting(gyro::INT_EN_0, gyro::INT_EN_0_FIFO, 0xC0),
            setting(both::FIFO_CONFIG_1, both::FIFO_STREAM, 0xC3),
        ]
    }
}

/// What makes the gyroscope sleep.
pub(super) const GYRO_ASLEEP: Setting = setting(both::POWER, gyro::POWER_SUSPEND, 0xA0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_worth_what_the_data_sheet_says() {
        // Bosch's table of the BMA255: 9577, 19154, 38307, 76614 um/s^2 for each count, rounded to 1 um/s^2.
        for (range, weight) in [
            (AccelRange::G2, 9_577e-6),
            (AccelRange::G4, 19_154e-6),
            (AccelRange::G8, 38_307e-6),
            (AccelRange::G16, 76_614e-6),
        ] {
            assert!((AccelConfig { range, ..Default::default() }.scale() - weight).abs() < 0.6e-6);
        }
        // BMI088, table 5: counts to 1 deg/s, given with three digits after the point.
        for (range, counts) in [
            (GyroRange::Dps2000, 16.384_f32),
            (GyroRange::Dps1000, 32.768),
            (GyroRange::Dps500, 65.536),
            (GyroRange::Dps250, 131.072),
            (GyroRange::Dps125, 262.144),
        ] {
            let scale = GyroConfig { range, ..Default::default() }.scale();
            assert!((scale * counts - 1_f32.to_radians()).abs() < 1e-7);
        }
    }

    #[test]
    fn periods_are_those_of_the_data_rates() {
        let accel = |bandwidth| AccelConfig { bandwidth, ..Default::default() }.period_us();
        assert_eq!(accel(AccelBandwidth::Hz8), 64_000);
        assert_eq!(accel(AccelBandwidth::Hz125), 4_000);
        assert_eq!(accel(AccelBandwidth::Hz1000), 500);
        assert_eq!(accel(AccelBandwidth::Unfiltered), 500);
        let gyro = |bandwidth| GyroConfig { bandwidth, ..Default::default() }.period_us();
        assert_eq!(gyro(GyroBandwidth::Hz523), 500);
        assert_eq!(gyro(GyroBandwidth::Hz47), 2_500);
        assert_eq!(gyro(GyroBandwidth::Hz64), 5_000);
        assert_eq!(gyro(GyroBandwidth::Hz32), 10_000);
    }

    #[test]
    fn a_watermark_out_of_bounds_is_brought_into_them() {
        let accel = |watermark| AccelConfig { watermark, ..Default::default() }.watermark_bits();
        assert_eq!([accel(0), accel(16), accel(255)], [1, 16, 30]);
        let gyro = |watermark| GyroConfig { watermark, ..Default::default() }.watermark_bits();
        assert_eq!([gyro(0), gyro(20), gyro(99)], [1, 20, 32]);
    }
}
