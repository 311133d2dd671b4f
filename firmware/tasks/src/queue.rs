//! What was read of the sensor and waits for the tracker.
//!
//! A batch has room for a whole FIFO and holds a half or a quarter of one: here its frames lie behind those of the batch
//! before, so that as much waits in half the memory.

use heapless::{Deque, Vec};
use sohle_shared::bmx055::{Batch, Die};
use sohle_shared::time::Micros;

/// Batches that may wait: both dies fill 250 in a second.
const BATCHES: usize = 26;
/// Their frames: both dies take 4000 in a second.
const FRAMES: usize = 416;
/// Told beside the batches and waiting: the sensor can fall asleep and wake once before its being asleep is known.
const EVENTS: usize = 2;

/// What is told.
#[expect(clippy::large_enum_variant, reason = "there is no heap on the shoe, and nearly all are batches")]
pub(crate) enum Sensed {
    /// A die was read.
    Batch(Batch),
    /// The sensor was put to sleep.
    Asleep,
    /// It was woken at this time.
    Woken(Micros),
}

/// The same, without the frames.
enum Head {
    Batch { die: Die, sequence: u32, stamp: Micros, lost: bool, temperature: Option<i8>, frames: u8 },
    Asleep,
    Woken(Micros),
}

/// What waits, the oldest first.
pub(crate) struct Queue {
    heads: Deque<Head, { BATCHES + EVENTS }>,
    frames: Deque<[i16; 3], FRAMES>,
}

impl Queue {
    pub(crate) const fn new() -> Self {
        Self { heads: Deque::new(), frames: Deque::new() }
    }

    /// Adds a batch; false when there is no room, and nothing has changed.
    pub(crate) fn offer(&mut self, batch: &Batch) -> bool {
        let room = self.heads.len() < BATCHES && batch.frames.len() <= FRAMES - self.frames.len();
        if room {
            let Batch { die, sequence, stamp, lost, temperature, ref frames } = *batch;
            self.frames.extend(frames.iter().copied());
            // No longer than a FIFO.
            let frames = frames.len() as u8;
            // There is room.
            let _ = self.heads.push_back(Head::Batch { die, sequence, stamp, lost, temperature, frames });
        }
        room
    }

    /// The sensor fell asleep, or woke at a time; false when there is no room.
    pub(crate) fn tell(&mut self, woken: Option<Micros>) -> bool {
        self.heads.push_back(woken.map_or(Head::Asleep, Head::Woken)).is_ok()
    }

    /// Takes the oldest out.
    pub(crate) fn take(&mut self) -> Option<Sensed> {
        Some(match self.heads.pop_front()? {
            Head::Batch { die, sequence, stamp, lost, temperature, frames: count } => {
                let mut frames = Vec::new();
                for _ in 0..count {
                    // So many were put in, and no more than a batch holds.
                    let _ = self.frames.pop_front().map(|frame| frames.push(frame));
                }
                Sensed::Batch(Batch { die, sequence, stamp, lost, temperature, frames })
            }
            Head::Asleep => Sensed::Asleep,
            Head::Woken(time) => Sensed::Woken(time),
        })
    }
}
