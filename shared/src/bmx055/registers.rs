//! Register addresses and values of the three dies.
//!
//! Sources: the accelerometer is of the BMA255 class, the gyroscope a BMG160, whose registers the data sheet of the BMI088
//! (BST-BMI088-DS000-19, chapter 5.5) describes with the same numbers; Bosch's published headers of both; the
//! magnetometer is of the BMM150 class (BST-BMM150-DS001, chapter 5). What no source at hand confirms is marked so.

/// Set in the address of a read (BMI088, 6.1.1).
pub const READ: u8 = 0x80;

/// Registers that accelerometer and gyroscope share.
pub mod both {
    /// Identification (BMI088, 5.5.1).
    pub const CHIP_ID: u8 = 0x00;
    /// x, y, z, each least significant byte first (BMI088, 5.5.2).
    pub const DATA: u8 = 0x02;
    /// Bit 7: frames were lost since [`FIFO_CONFIG_1`] was written; bits 6 to 0: frames stored (BMI088, 5.5.4).
    pub const FIFO_STATUS: u8 = 0x0E;
    /// Of [`FIFO_STATUS`].
    pub const FIFO_OVERRUN: u8 = 0x80;
    /// Range (BMI088, 5.5.5).
    pub const RANGE: u8 = 0x0F;
    /// Bandwidth and data rate (BMI088, 5.5.6).
    pub const BANDWIDTH: u8 = 0x10;
    /// Power mode; zero is normal (BMI088, 5.5.7).
    pub const POWER: u8 = 0x11;
    /// Bit 7: data without the low-pass filter.
    pub const HIGH_BANDWIDTH: u8 = 0x13;
    /// Soft reset by [`RESET_COMMAND`] (BMI088, 5.5.8).
    pub const RESET: u8 = 0x14;
    /// Of [`RESET`].
    pub const RESET_COMMAND: u8 = 0xB6;
    /// Mode of the FIFO; a write clears the overrun (BMI088, 5.5.16).
    pub const FIFO_CONFIG_1: u8 = 0x3E;
    /// Of [`FIFO_CONFIG_1`]: when full, the oldest frame makes room.
    pub const FIFO_STREAM: u8 = 0x80;
    /// Of [`FIFO_CONFIG_1`]: the bits of the mode.
    pub const FIFO_MODE: u8 = 0xC0;
    /// Of [`FIFO_CONFIG_1`]: when full, it stops.
    pub const FIFO_STOP: u8 = 0x40;
    /// The frames, oldest first; the address does not advance (BMI088, 5.5.17).
    pub const FIFO_DATA: u8 = 0x3F;
}

/// Accelerometer (BMA255 class).
pub mod accel {
    /// Value of the identification.
    pub const ID: u8 = 0xFA;
    /// Time from a soft reset to the first access. **Units:** microseconds.
    pub const BOOT_US: u32 = 1_800;
    /// Frames that the FIFO holds.
    pub const FIFO_DEPTH: usize = 32;
    /// Temperature, two's complement. **Units:** 0.5 K from 23 °C.
    pub const TEMPERATURE: u8 = 0x08;
    /// Enables interrupts.
    pub const INT_EN_1: u8 = 0x17;
    /// Of [`INT_EN_1`].
    pub const INT_EN_1_WATERMARK: u8 = 0x40;
    /// Maps interrupts to pins.
    pub const INT_MAP_1: u8 = 0x1A;
    /// Of [`INT_MAP_1`]: watermark on pin INT1.
    pub const INT_MAP_1_WATERMARK: u8 = 0x02;
    /// Level and driver of the pins.
    pub const INT_OUT: u8 = 0x20;
    /// Of [`INT_OUT`]: INT1 push-pull, high when active.
    pub const INT_OUT_INT1_HIGH: u8 = 0x01;
    /// Of [`POWER`](super::both::POWER): sleeps, and wakes up for a reading each time the sleep of bits 4 to 1 is over.
    pub const POWER_LOW: u8 = 0x40;
    /// Of [`POWER`](super::both::POWER): sleeps for 10 ms.
    pub const POWER_SLEEP_10_MS: u8 = 0x0A << 1;
    /// Enables interrupts of motion.
    pub const INT_EN_0: u8 = 0x16;
    /// Of [`INT_EN_0`]: the slope of x, y or z.
    pub const INT_EN_0_SLOPE: u8 = 0x07;
    /// Maps interrupts of motion to pin INT1.
    pub const INT_MAP_0: u8 = 0x19;
    /// Of [`INT_MAP_0`].
    pub const INT_MAP_0_SLOPE: u8 = 0x04;
    /// How long an interrupt of motion lasts; bit 7 ends it.
    pub const INT_LATCH: u8 = 0x21;
    /// Of [`INT_LATCH`]: until it is ended.
    pub const INT_LATCH_FOREVER: u8 = 0x0F;
    /// Of [`INT_LATCH`]: ends it now; reads as 0.
    pub const INT_LATCH_END: u8 = 0x80;
    /// Bits 1 and 0: one more slope than this must lie above the threshold, one after the other.
    pub const SLOPE_DURATION: u8 = 0x27;
    /// Difference between one reading and the next on an axis that is motion when exceeded. **Units:** 4 counts: 3.91 mg
    /// at ±2 g, 31.25 mg at ±16 g; not confirmed for this package.
    pub const SLOPE_THRESHOLD: u8 = 0x28;
    /// Watermark of the FIFO.
    pub const FIFO_WATERMARK: u8 = 0x30;
    /// Self-test: axis in bits 1 and 0 (1 is x), sign in bit 2, amplitude in bit 4.
    pub const SELF_TEST: u8 = 0x32;
    /// Of [`SELF_TEST`].
    pub const SELF_TEST_POSITIVE: u8 = 0x04;
    /// Of [`SELF_TEST`].
    pub const SELF_TEST_HIGH: u8 = 0x10;
}

/// Gyroscope (BMG160; BMI088, chapter 5.5).
pub mod gyro {
    /// Value of the identification.
    pub const ID: u8 = 0x0F;
    /// Time from a soft reset to the first access (5.5.8). **Units:** microseconds.
    pub const BOOT_US: u32 = 30_000;
    /// Frames that the FIFO holds (4.9.4).
    pub const FIFO_DEPTH: usize = 100;
    /// The same in stream mode (4.9.4).
    pub const FIFO_DEPTH_STREAM: usize = 99;
    /// Of [`POWER`](super::both::POWER): measures nothing and keeps its registers; takes no write but of this register and
    /// of the reset (5.5.7).
    pub const POWER_SUSPEND: u8 = 0x80;
    /// Enables interrupts (5.5.9).
    pub const INT_EN_0: u8 = 0x15;
    /// Of [`INT_EN_0`].
    pub const INT_EN_0_FIFO: u8 = 0x40;
    /// Level and driver of the pins; open-drain after a reset (5.5.10).
    pub const INT_EN_1: u8 = 0x16;
    /// Of [`INT_EN_1`]: INT3 of the package push-pull, high when active.
    pub const INT_EN_1_INT1_HIGH: u8 = 0x01;
    /// Maps interrupts to pins (5.5.11).
    pub const INT_MAP_1: u8 = 0x18;
    /// Of [`INT_MAP_1`]: FIFO on INT3 of the package.
    pub const INT_MAP_1_FIFO: u8 = 0x04;
    /// Enables the watermark (5.5.12).
    pub const FIFO_WM_EN: u8 = 0x1E;
    /// Of [`FIFO_WM_EN`].
    pub const FIFO_WM_EN_ON: u8 = 0x88;
    /// Self-test: bit 0 starts it, bit 1 it is done, bit 2 it failed, bit 4 the rate is in order (5.5.14).
    pub const SELF_TEST: u8 = 0x3C;
    /// Of [`SELF_TEST`].
    pub const SELF_TEST_START: u8 = 0x01;
    /// Of [`SELF_TEST`].
    pub const SELF_TEST_READY: u8 = 0x02;
    /// Of [`SELF_TEST`].
    pub const SELF_TEST_FAILED: u8 = 0x04;
    /// Of [`SELF_TEST`].
    pub const SELF_TEST_RATE_OK: u8 = 0x10;
    /// Watermark of the FIFO; a write empties it (5.5.15).
    pub const FIFO_WATERMARK: u8 = 0x3D;
}

/// Magnetometer (BMM150, chapter 5); not confirmed for this package but for the identification.
pub mod mag {
    /// Identification; readable when [`POWER`] is on.
    pub const CHIP_ID: u8 = 0x40;
    /// Value of the identification.
    pub const ID: u8 = 0x32;
    /// Time from power on to the first access. **Units:** microseconds.
    pub const BOOT_US: u32 = 3_000;
    /// x, y (13 bits), z (15 bits), hall resistance (14 bits), left-justified, least significant byte first.
    pub const DATA: u8 = 0x42;
    /// Bit 0 of the hall resistance: a reading is there that was not read yet.
    pub const READY: u8 = 0x01;
    /// Bit 0: power on.
    pub const POWER: u8 = 0x4B;
    /// Of [`POWER`].
    pub const POWER_ON: u8 = 0x01;
    /// Mode of operation in bits 2 and 1.
    pub const MODE: u8 = 0x4C;
    /// Of [`MODE`]: one reading, then sleep.
    pub const MODE_FORCED: u8 = 0x02;
}
