//! The FIFO of a die: depth, modes, overrun, and what a read does to it.

use crate::bmx055::registers::{both, gyro};
use heapless::Deque;

/// Bytes of a frame.
pub(super) const FRAME: usize = 6;

/// What comes out when nothing is stored: 0x8000 on every axis (BMI088, 5.5.17).
pub(super) const EMPTY: [u8; FRAME] = [0x00, 0x80, 0x00, 0x80, 0x00, 0x80];

/// Frames, and how far the oldest was read.
#[derive(Debug, Default)]
pub(super) struct Fifo {
    frames: Deque<[u8; FRAME], { gyro::FIFO_DEPTH }>,
    /// Bytes of the oldest frame that were read in this transaction.
    read: usize,
    pub overrun: bool,
}

impl Fifo {
    /// Frames stored.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Empties it; the overrun is over.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// A frame comes in. `mode` holds the bits of [`both::FIFO_MODE`], `depth` the frames that have room.
    pub fn push(&mut self, frame: [u8; FRAME], mode: u8, depth: usize) {
        let depth = if mode & both::FIFO_MODE == 0 { 1 } else { depth };
        if self.frames.len() >= depth {
            // Bypass holds the newest frame and knows no overrun.
            self.overrun |= mode & both::FIFO_MODE != 0;
            if mode & both::FIFO_MODE == both::FIFO_STOP {
                return;
            }
            self.frames.pop_front();
            self.read = 0;
        }
        // There is room: `depth` is at most the capacity.
        let _ = self.frames.push_back(frame);
    }

    /// The next byte of the oldest frame.
    pub fn read(&mut self) -> u8 {
        let frame = self.frames.front().unwrap_or(&EMPTY);
        let byte = frame.get(self.read).copied().unwrap_or_default();
        self.read += 1;
        if self.read == FRAME {
            self.read = 0;
            self.frames.pop_front();
        }
        byte
    }

    /// The transaction is over: a frame that was read in part is lost (BMI088, 5.5.17).
    pub fn release(&mut self) {
        if self.read > 0 {
            self.read = 0;
            self.frames.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(frames: u8, mode: u8, depth: usize) -> Fifo {
        let mut fifo = Fifo::default();
        for index in 0..frames {
            fifo.push([index; FRAME], mode, depth);
        }
        fifo
    }

    #[test]
    fn a_stream_loses_the_oldest_and_a_stopping_fifo_the_newest() {
        let mut stream = filled(34, both::FIFO_STREAM, 32);
        assert_eq!((stream.len(), stream.overrun, stream.read()), (32, true, 2));
        let mut stop = filled(34, both::FIFO_STOP, 32);
        assert_eq!((stop.len(), stop.overrun, stop.read()), (32, true, 0));
        let mut bypass = filled(3, 0, 32);
        assert_eq!((bypass.len(), bypass.overrun, bypass.read()), (1, false, 2));
    }

    #[test]
    fn a_frame_read_in_part_is_lost() {
        let mut fifo = filled(3, both::FIFO_STREAM, 32);
        for _ in 0..=FRAME {
            fifo.read();
        }
        fifo.release();
        assert_eq!((fifo.len(), fifo.read()), (1, 2));
    }

    #[test]
    fn an_empty_fifo_gives_the_mark_for_it() {
        let mut fifo = Fifo::default();
        assert_eq!(core::array::from_fn::<u8, FRAME, _>(|_| fifo.read()), EMPTY);
        assert_eq!(fifo.len(), 0);
    }
}
