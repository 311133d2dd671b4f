//! What passes between the loops.

use core::cell::Cell;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use embedded_io_async::Write;
use portable_atomic::{AtomicU32, Ordering};
use sohle_shared::bmx055::{Batch, DieCounters};
use sohle_shared::time::Micros;

/// Batches that may wait for [`process`](crate::process()): both dies fill 250 in a second.
const BATCHES: usize = 26;
/// Bytes that may wait for the line: 22 ms at 921 600 baud.
const BYTES: usize = 2_048;

/// What [`sense`](crate::sense()) tells.
#[expect(clippy::large_enum_variant, reason = "there is no heap on the shoe, and nearly all are batches")]
pub(crate) enum Sensed {
    /// A die was read.
    Batch(Batch),
    /// The sensor was put to sleep.
    Asleep,
    /// It was woken at this time.
    Woken(Micros),
}

/// What passes between the loops. One, in a `static`.
pub struct Traffic {
    pub(crate) sensed: Channel<CriticalSectionRawMutex, Sensed, BATCHES>,
    /// Whether the sensor is to sleep.
    pub(crate) rest: Signal<CriticalSectionRawMutex, bool>,
    pub(crate) bytes: Pipe<CriticalSectionRawMutex, BYTES>,
    counters: Mutex<CriticalSectionRawMutex, Cell<[DieCounters; 2]>>,
    /// Batches that found the queue full.
    lost: AtomicU32,
    /// Counts up with each round of [`sense`](crate::sense()).
    rounds: AtomicU32,
}

impl Traffic {
    /// Nothing waits.
    pub const fn new() -> Self {
        Self {
            sensed: Channel::new(),
            rest: Signal::new(),
            bytes: Pipe::new(),
            counters: Mutex::new(Cell::new([DieCounters::NONE; 2])),
            lost: AtomicU32::new(0),
            rounds: AtomicU32::new(0),
        }
    }

    /// Queues a batch; without room it is lost and counted, and the tracker sees a gap.
    pub(crate) fn offer(&self, batch: &Batch) {
        if self.sensed.try_send(Sensed::Batch(batch.clone())).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(crate) fn tell(&self, counters: [DieCounters; 2]) {
        self.counters.lock(|cell| cell.set(counters));
        self.rounds.fetch_add(1, Ordering::Relaxed);
    }

    /// The next batch that was read, for who looks at them without a shoe.
    pub async fn receive(&self) -> Batch {
        loop {
            if let Sensed::Batch(batch) = self.sensed.receive().await {
                return batch;
            }
        }
    }

    /// Of accelerometer and gyroscope.
    pub fn counters(&self) -> [DieCounters; 2] {
        self.counters.lock(Cell::get)
    }

    /// How often [`sense`](crate::sense()) has gone round.
    pub(crate) fn rounds(&self) -> u32 {
        self.rounds.load(Ordering::Relaxed)
    }

    /// Batches lost because the queue was full.
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Default for Traffic {
    fn default() -> Self {
        Self::new()
    }
}

/// Empties the bytes that wait into the line, for ever.
pub async fn send(traffic: &Traffic, mut line: impl Write) -> ! {
    let mut buffer = [0; 256];
    loop {
        let length = traffic.bytes.read(&mut buffer).await;
        // What a broken line swallows is sent again, or was not worth it.
        let _ = line.write_all(buffer.get(..length).unwrap_or_default()).await;
    }
}
