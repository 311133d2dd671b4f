//! Messages that wait for the line as the frames they will be: as long as each is, not as long as one can be.

use crate::wire::frame::{self, FRAME_MAX};
use crate::wire::message::FromShoe;
use heapless::Deque;

/// Frames in `BYTES` bytes, the oldest first.
#[derive(Debug)]
pub(super) struct Frames<const BYTES: usize> {
    /// Each without its first zero, which the last one of the frame before stands for.
    bytes: Deque<u8, BYTES>,
}

impl<const BYTES: usize> Frames<BYTES> {
    pub(super) const fn new() -> Self {
        Self { bytes: Deque::new() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    pub(super) fn clear(&mut self) {
        self.bytes.clear();
    }

    /// Adds a message; false when there is no room, and nothing has changed.
    #[inline(never)]
    pub(super) fn push(&mut self, message: &FromShoe) -> bool {
        let mut buffer = [0; FRAME_MAX];
        // Every message fits, as the tests of the wire show.
        let Ok([_, frame @ ..]) = frame::encode(message, &mut buffer) else { return false };
        let fits = frame.len() <= BYTES - self.bytes.len();
        if fits {
            self.bytes.extend(frame);
        }
        fits
    }

    /// Takes the oldest frame out.
    pub(super) fn pop<'a>(&mut self, buffer: &'a mut [u8; FRAME_MAX]) -> Option<&'a [u8]> {
        if self.bytes.is_empty() {
            return None;
        }
        buffer[0] = 0;
        let mut length = 1;
        // None was longer than the buffer when it was made.
        while let Some((place, byte)) = buffer.get_mut(length).zip(self.bytes.pop_front()) {
            *place = byte;
            length += 1;
            if byte == 0 {
                break;
            }
        }
        buffer.get(..length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Micros;
    use crate::wire::message::{Level, Log, text};

    fn log(line: &str) -> FromShoe {
        FromShoe::Log(Log { time: Micros(5), level: Level::Info, text: text(line) })
    }

    #[test]
    fn frames_come_out_as_they_were_made() {
        let mut frames = Frames::<64>::new();
        let lines = ["", "a line", "and another one"];
        // Several times around the ring.
        for round in 0..20 {
            for line in lines {
                assert!(frames.push(&log(line)), "{round}");
            }
            for line in lines {
                let mut buffer = [0; FRAME_MAX];
                let mut expected = [0; FRAME_MAX];
                assert_eq!(frames.pop(&mut buffer), frame::encode(&log(line), &mut expected).ok());
            }
            assert!(frames.is_empty() && frames.pop(&mut [0; FRAME_MAX]).is_none());
        }
    }

    #[test]
    fn without_room_nothing_changes() {
        let mut frames = Frames::<64>::new();
        assert!(frames.push(&log("a line")));
        assert!(!frames.push(&log("a line that is longer than what is left of the room")));
        let mut expected = [0; FRAME_MAX];
        assert_eq!(frames.pop(&mut [0; FRAME_MAX]), frame::encode(&log("a line"), &mut expected).ok());
        assert!(frames.is_empty());
    }
}
