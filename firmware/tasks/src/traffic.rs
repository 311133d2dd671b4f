//! What passes between the loops.

use crate::queue::{Queue, Sensed};
use core::cell::{Cell, RefCell};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use embedded_io_async::Write;
use portable_atomic::{AtomicU32, Ordering};
use sohle_shared::bmx055::{Batch, DieCounters};
use sohle_shared::time::Micros;

/// Bytes that may wait for the line: 22 ms at 921 600 baud.
const BYTES: usize = 2_048;

/// What passes between the loops. One, in a `static`.
pub struct Traffic {
    sensed: Mutex<CriticalSectionRawMutex, RefCell<Queue>>,
    /// Something was put into the queue.
    filled: Signal<CriticalSectionRawMutex, ()>,
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
            sensed: Mutex::new(RefCell::new(Queue::new())),
            filled: Signal::new(),
            rest: Signal::new(),
            bytes: Pipe::new(),
            counters: Mutex::new(Cell::new([DieCounters::NONE; 2])),
            lost: AtomicU32::new(0),
            rounds: AtomicU32::new(0),
        }
    }

    /// Queues a batch; without room it is lost and counted, and the tracker sees a gap.
    pub(crate) fn offer(&self, batch: &Batch) {
        self.put(|queue| queue.offer(batch));
    }

    /// Queues that the sensor fell asleep, or woke at a time. There is room: asleep, nothing else comes into the queue.
    pub(crate) fn tell_sleep(&self, woken: Option<Micros>) {
        self.put(|queue| queue.tell(woken));
    }

    fn put(&self, put: impl FnOnce(&mut Queue) -> bool) {
        if !self.sensed.lock(|queue| put(&mut queue.borrow_mut())) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        self.filled.signal(());
    }

    /// The oldest of what was queued.
    pub(crate) async fn sensed(&self) -> Sensed {
        loop {
            if let Some(sensed) = self.sensed.lock(|queue| queue.borrow_mut().take()) {
                return sensed;
            }
            self.filled.wait().await;
        }
    }

    pub(crate) fn tell(&self, counters: [DieCounters; 2]) {
        self.counters.lock(|cell| cell.set(counters));
        self.rounds.fetch_add(1, Ordering::Relaxed);
    }

    /// The next batch that was read, for who looks at them without a shoe.
    pub async fn receive(&self) -> Batch {
        loop {
            if let Sensed::Batch(batch) = self.sensed().await {
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
