//! How far the shoe's time is, for whoever runs the emulator, and how fast it passes: the third serial line.
//!
//! The shoe sends its seconds since the power came, modulo 256, about once in each. A byte that comes makes it hurry for ten times as
//! many seconds: what the processor would wait for does not take any time then, what it computes does.

use super::interrupt::{self, Irq};
use super::uart::Uart;
use core::cell::Cell;
use critical_section::Mutex;
use embassy_time::{Duration, Instant};

const LINE: Uart = Uart::THIRD;

/// It hurries until then.
static UNTIL: Mutex<Cell<Instant>> = Mutex::new(Cell::new(Instant::MIN));

/// Switches the line on.
pub fn start() {
    LINE.start();
    interrupt::enable(Irq::PACE_RECEIVED, 64);
}

/// A byte has come.
pub fn on_received() {
    LINE.clear();
    while let Some(tens) = LINE.take() {
        let until = Instant::now() + Duration::from_secs(10 * u64::from(tens));
        critical_section::with(|cs| UNTIL.borrow(cs).set(until));
    }
}

/// Whether it hurries.
pub fn hurries() -> bool {
    Instant::now() < critical_section::with(|cs| UNTIL.borrow(cs).get())
}

/// Tells how far the shoe's time is.
pub fn tell() {
    // Where nobody listens, it is lost.
    LINE.offer((Instant::now().as_secs() % 256) as u8);
}
