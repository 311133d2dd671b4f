//! What is read of a die at once: register counts with the time of their interrupt.
//!
//! Everything after the driver is a function of the sequence of batches alone, so batches that were recorded lead to the
//! same steps, bit for bit, as on the shoe.

use crate::time::Micros;
use heapless::Vec;

/// Frames that one batch holds: the accelerometer's whole FIFO.
pub const BATCH_FRAMES: usize = 32;

/// A die of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum Die {
    /// Accelerometer.
    Accel,
    /// Gyroscope.
    Gyro,
}

/// Register counts as they came out of the FIFO of one die.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Batch {
    /// Where they come from.
    pub die: Die,
    /// Number of the first frame since the boot; a jump tells how many are missing, as far as that is known.
    pub sequence: u32,
    /// When the last frame was taken, as far as the interrupt of the FIFO tells: never before, at most some interrupt
    /// latencies after.
    pub stamp: Micros,
    /// Frames before these were lost: the FIFO had run over, or the die was set up anew.
    pub lost: bool,
    /// Temperature as it was read last. **Units:** 0.5 K from 23 °C.
    pub temperature: Option<i8>,
    /// x, y, z. **Units:** least significant bits; **Frame:** sensor.
    pub frames: Vec<[i16; 3], BATCH_FRAMES>,
}

/// How often something happened on one die since the boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct DieCounters {
    /// Frames read.
    pub frames: u32,
    /// Times the FIFO had run over.
    pub overruns: u32,
    /// Frames of the FIFO that carried no reading (0x8000).
    pub invalid_frames: u32,
    /// Interrupts of the FIFO that did not come.
    pub missed_interrupts: u32,
    /// Transfers on the bus that failed.
    pub bus_errors: u32,
    /// Chip identifications that were not the die's.
    pub bad_ids: u32,
    /// Registers that did not read back as written.
    pub readback_errors: u32,
    /// Times the die was set up anew.
    pub restarts: u32,
}

impl DieCounters {
    /// Nothing has happened.
    pub const NONE: Self = Self {
        frames: 0,
        overruns: 0,
        invalid_frames: 0,
        missed_interrupts: 0,
        bus_errors: 0,
        bad_ids: 0,
        readback_errors: 0,
        restarts: 0,
    };
}
