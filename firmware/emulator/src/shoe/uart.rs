//! The serial line of the emulated machine, by interrupt.
//!
//! Registers: Arm Cortex-M System Design Kit, technical reference manual (DDI 0479), "APB UART". The emulator moves a byte at
//! once, whatever the baud rate: sending is paced here to that of a real line.

use super::interrupt::{self, Irq};
use core::convert::Infallible;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::{ErrorType, Read, Write};

/// Bytes that have come and wait.
static RECEIVED: Pipe<CriticalSectionRawMutex, 1_024> = Pipe::new();

const UART: *mut u32 = 0x4000_4000 as *mut u32;
/// Registers, as offsets in words.
const DATA: usize = 0;
const STATE: usize = 1;
const CONTROL: usize = 2;
const CLEAR: usize = 3;
const DIVIDER: usize = 4;

const STATE_FULL: u32 = 1 << 0;
const STATE_RECEIVED: u32 = 1 << 1;
const SEND_ENABLE: u32 = 1 << 0;
const RECEIVE_ENABLE: u32 = 1 << 1;
const RECEIVE_INTERRUPT: u32 = 1 << 3;

/// A byte is ten bits at 921 600 baud.
const BYTES_PER_S: u64 = 92_160;

fn write(register: usize, value: u32) {
    // SAFETY: the register is inside the UART's block, which only this module uses.
    unsafe { UART.add(register).write_volatile(value) }
}

fn read(register: usize) -> u32 {
    // SAFETY: as above.
    unsafe { UART.add(register).read_volatile() }
}

/// Switches the line on.
pub fn start() -> (Receiver, Sender) {
    write(DIVIDER, 27);
    write(CONTROL, SEND_ENABLE | RECEIVE_ENABLE | RECEIVE_INTERRUPT);
    interrupt::enable(Irq::UART_RECEIVED, 64);
    (Receiver, Sender { free: Instant::MIN })
}

/// A byte has come. Without room it is lost, as it would be on a line without handshake.
pub fn on_received() {
    // First: a byte that comes after the last look must raise it again.
    write(CLEAR, 0b10);
    while read(STATE) & STATE_RECEIVED != 0 {
        let _ = RECEIVED.try_write(&[read(DATA) as u8]);
    }
}

/// The bytes of the laptop.
pub struct Receiver;

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(RECEIVED.read(buffer).await)
    }
}

/// The bytes for the laptop.
pub struct Sender {
    /// When a real line would have sent all so far.
    free: Instant,
}

impl ErrorType for Sender {
    type Error = Infallible;
}

impl Write for Sender {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Timer::at(self.free).await;
        for &byte in bytes {
            while read(STATE) & STATE_FULL != 0 {}
            write(DATA, u32::from(byte));
        }
        let duration = Duration::from_micros(bytes.len() as u64 * 1_000_000 / BYTES_PER_S);
        self.free = Instant::now() + duration;
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Timer::at(self.free).await;
        Ok(())
    }
}
