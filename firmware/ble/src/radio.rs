//! What passes between the tracker and the radio.

use core::cell::{Cell, RefCell};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant};
use heapless::Vec;
use portable_atomic::{AtomicBool, AtomicU8, Ordering};
use sohle_shared::bonds::Bonds;
use sohle_shared::wire::bluetooth::STATUS_MAX;
use sohle_shared::wire::message::{FromShoe, Level, Status};
use sohle_tasks::{Air, Happening};

/// Bytes that may wait for the laptop: all that is sent in 100 ms while the counts of the sensor are recorded.
const OUT: usize = 4_096;
/// Bytes of the laptop that may wait: two of its longest messages.
const IN: usize = 512;
/// The window for pairing is never open for longer.
const LONGEST_WINDOW: Duration = Duration::from_secs(600);

/// What passes between the tracker and the radio. One, in a `static`.
pub struct Radio {
    /// A laptop listens.
    open: AtomicBool,
    pub(crate) out: Pipe<CriticalSectionRawMutex, OUT>,
    received: Pipe<CriticalSectionRawMutex, IN>,
    news: Channel<CriticalSectionRawMutex, Happening, 4>,
    pub(crate) status: Mutex<CriticalSectionRawMutex, RefCell<Vec<u8, STATUS_MAX>>>,
    pub(crate) status_changed: Signal<CriticalSectionRawMutex, ()>,
    /// Charge of the battery. **Units:** %.
    pub(crate) battery: AtomicU8,
    hurry: AtomicBool,
    pub(crate) hurry_changed: Signal<CriticalSectionRawMutex, ()>,
    /// Others may pair until then.
    window: Mutex<CriticalSectionRawMutex, Cell<Instant>>,
    /// The window was opened.
    pub(crate) window_opened: Signal<CriticalSectionRawMutex, ()>,
}

impl Radio {
    /// Nobody is there.
    pub const fn new() -> Self {
        Self {
            open: AtomicBool::new(false),
            out: Pipe::new(),
            received: Pipe::new(),
            news: Channel::new(),
            status: Mutex::new(RefCell::new(Vec::new())),
            status_changed: Signal::new(),
            battery: AtomicU8::new(0),
            hurry: AtomicBool::new(false),
            hurry_changed: Signal::new(),
            window: Mutex::new(Cell::new(Instant::MIN)),
            window_opened: Signal::new(),
        }
    }

    /// Whether others may pair now.
    pub fn lets_pair(&self) -> bool {
        Instant::now() < self.window.lock(Cell::get)
    }

    /// A laptop listens from now on, or it does not any more: then what waited for it is gone.
    pub(crate) async fn open(&self, open: bool) {
        if self.open.swap(open, Ordering::Relaxed) == open {
            return;
        }
        self.out.clear();
        self.news.send(if open { Happening::Opened } else { Happening::Closed }).await;
    }

    /// Bytes of the laptop.
    pub(crate) async fn receive(&self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let length = self.received.write(bytes).await;
            bytes = bytes.get(length..).unwrap_or_default();
        }
    }

    /// These devices have paired.
    pub(crate) async fn keep(&self, bonds: &Bonds) {
        self.news.send(Happening::Paired(bonds.clone())).await;
    }

    /// A line for the log; lost when too many are said at once.
    pub(crate) fn say(&self, level: Level, line: &'static str) {
        // The log is no place to wait for.
        let _ = self.news.try_send(Happening::Said(level, line));
    }

    /// Whether much is to be sent.
    pub(crate) fn is_in_hurry(&self) -> bool {
        self.hurry.load(Ordering::Relaxed)
    }
}

impl Default for Radio {
    fn default() -> Self {
        Self::new()
    }
}

impl Air for Radio {
    async fn happening(&self, bytes: &mut [u8]) -> Happening {
        match select(self.news.receive(), self.received.read(bytes)).await {
            Either::First(happening) => happening,
            Either::Second(length) => Happening::Bytes(length),
        }
    }

    fn is_open(&self) -> bool {
        self.open.load(Ordering::Relaxed)
    }

    fn room(&self) -> usize {
        self.out.free_capacity()
    }

    fn send(&self, mut frame: &[u8]) {
        // There is room, since nobody else writes, but it may lie in two pieces.
        while let Ok(written @ 1..) = self.out.try_write(frame) {
            frame = frame.get(written..).unwrap_or_default();
        }
    }

    fn tell(&self, status: &Status) {
        if let Some(volts) = status.battery {
            self.battery.store(charge(volts), Ordering::Relaxed);
        }
        let mut bytes = [0; STATUS_MAX];
        // The longest fits, as a test shows.
        let Ok(message) = postcard::to_slice(&FromShoe::Status(*status), &mut bytes) else { return };
        self.status.lock(|kept| {
            let mut kept = kept.borrow_mut();
            kept.clear();
            let _ = kept.extend_from_slice(message);
        });
        self.status_changed.signal(());
    }

    fn hurry(&self, hurry: bool) {
        if self.hurry.swap(hurry, Ordering::Relaxed) != hurry {
            self.hurry_changed.signal(());
        }
    }

    fn let_pair(&self, seconds: u16) {
        let time = Duration::from_secs(seconds.into()).min(LONGEST_WINDOW);
        self.window.lock(|window| window.set(Instant::now() + time));
        self.window_opened.signal(());
    }
}

/// Charge of a lithium cell at this voltage, as far as a voltage tells: a straight line from 3.3 to 4.15 V. **Units:** %.
fn charge(volts: f32) -> u8 {
    // Saturates, also for what is no number.
    ((volts - 3.3) * (100.0 / 0.85)).clamp(0.0, 100.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_charge_is_between_empty_and_full() {
        assert_eq!([0.0, 3.3, 3.73, 4.15, 9.0, f32::NAN].map(charge), [0, 0, 50, 100, 100, 0]);
    }

    #[test]
    fn the_longest_status_fits() {
        let radio = Radio::new();
        radio.tell(&Status::longest());
        let length = radio.status.lock(|bytes| bytes.borrow().len());
        assert!(length > 150 && length <= STATUS_MAX, "{length}");
    }
}
