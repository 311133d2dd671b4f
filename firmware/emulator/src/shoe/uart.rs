//! The serial lines of the emulated machine, by interrupt: one to the laptop, one to the Bluetooth controller, and the
//! registers of a third for [`pace`](super::pace).
//!
//! Registers: Arm Cortex-M System Design Kit, technical reference manual (DDI 0479), "APB UART"; addresses: Arm application
//! note 386. The emulator moves a byte at once, whatever the baud rate: sending is paced here to that of a real line.

use super::interrupt::{self, Irq};
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::{ErrorType, Read, Write};

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

/// The registers of a UART, by the address of the first.
pub struct Uart(usize);

impl Uart {
    /// The third, which only [`pace`](super::pace) uses.
    pub const THIRD: Self = Self(0x4000_6000);

    fn write(&self, register: usize, value: u32) {
        // SAFETY: the register is inside the UART's block, which has one user.
        unsafe { (self.0 as *mut u32).add(register).write_volatile(value) }
    }

    fn read(&self, register: usize) -> u32 {
        // SAFETY: as above.
        unsafe { (self.0 as *mut u32).add(register).read_volatile() }
    }

    /// Switches it on, with an interrupt for each byte that comes.
    pub fn start(&self) {
        self.write(DIVIDER, 27);
        self.write(CONTROL, SEND_ENABLE | RECEIVE_ENABLE | RECEIVE_INTERRUPT);
    }

    /// Sends a byte if there is room for it.
    pub fn offer(&self, byte: u8) -> bool {
        let room = self.read(STATE) & STATE_FULL == 0;
        if room {
            self.write(DATA, u32::from(byte));
        }
        room
    }

    /// No interrupt waits any more; a byte that comes later raises it again.
    pub fn clear(&self) {
        self.write(CLEAR, 0b10);
    }

    /// Takes a byte that has come.
    pub fn take(&self) -> Option<u8> {
        (self.read(STATE) & STATE_RECEIVED != 0).then(|| self.read(DATA) as u8)
    }
}

/// A serial line.
pub struct Line {
    uart: Uart,
    interrupt: Irq,
    /// Who is at the other end waits while there is no room.
    handshake: bool,
    /// Bytes that have come and wait.
    received: Pipe<CriticalSectionRawMutex, 1_024>,
    /// Something has come.
    used: AtomicBool,
}

/// To the laptop.
pub static LAPTOP: Line = Line::new(0x4000_4000, Irq::UART_RECEIVED, false);
/// To the Bluetooth controller. The emulator hands over a byte when the one before was taken, as a line with RTS and CTS
/// does.
#[cfg(feature = "ble")]
pub static HCI: Line = Line::new(0x4000_5000, Irq::HCI_RECEIVED, true);

impl Line {
    const fn new(address: usize, interrupt: Irq, handshake: bool) -> Self {
        Self { uart: Uart(address), interrupt, handshake, received: Pipe::new(), used: AtomicBool::new(false) }
    }

    /// Switches the line on.
    pub fn start(&'static self) -> (Receiver, Sender) {
        self.uart.start();
        interrupt::enable(self.interrupt, 64);
        (Receiver(self), Sender { line: self, free: Instant::MIN })
    }

    /// A byte has come. Without room and handshake it is lost.
    pub fn on_received(&self) {
        // First: a byte that comes after the last look must raise it again.
        self.uart.clear();
        self.used.store(true, Ordering::Relaxed);
        self.take();
    }

    /// Whether anything has come since the start.
    #[cfg(feature = "ble")]
    pub fn was_used(&self) -> bool {
        self.used.load(Ordering::Relaxed)
    }

    fn take(&self) {
        while !(self.handshake && self.received.is_full())
            && let Some(byte) = self.uart.take()
        {
            let _ = self.received.try_write(&[byte]);
        }
    }
}

/// The bytes of the other end.
pub struct Receiver(&'static Line);

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let length = self.0.received.read(buffer).await;
        if self.0.handshake {
            // One may wait for which there was no room.
            critical_section::with(|_| self.0.take());
        }
        Ok(length)
    }
}

/// The bytes for the other end.
pub struct Sender {
    line: &'static Line,
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
            while !self.line.uart.offer(byte) {}
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
