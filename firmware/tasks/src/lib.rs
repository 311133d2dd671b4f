//! The loops of the shoe's firmware, without the board.
//!
//! [`sense`] reads the sensor and runs at the priority of an interrupt; [`process`] makes steps of what was read, talks to
//! the laptop and may be late, because a queue of 100 ms lies between the two; [`send`] empties the bytes that wait into the
//! line. A real board and the emulated one differ in what they give to these: bus, pins, serial line, flash and clock.
#![no_std]

mod air;
mod process;
mod queue;
mod sense;
mod traffic;

pub use air::{Air, Happening, NoAir};
pub use process::{Board, BoardHealth, process};
pub use sense::sense;
pub use traffic::{Traffic, send};

use embassy_time::Instant;
use sohle_shared::time::Micros;

/// The time since the boot.
pub fn now() -> Micros {
    // 2^63 µs are 292 000 years.
    Micros(Instant::now().as_micros() as i64)
}

/// The executor's clock at `time`; the boot for a time before it.
pub fn instant(time: Micros) -> Instant {
    Instant::from_micros(time.0.max(0) as u64)
}
