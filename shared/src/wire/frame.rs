//! Messages as bytes on a line, and back, whatever the line does to them.
//!
//! A frame is `0 COBS(postcard bytes, CRC-32 of them, little-endian) 0`. No byte inside is zero, so the next zero is
//! always a boundary: after garbage, or when the end of a frame is damaged, the frame after it is whole. Two frames may
//! share a zero or not.
//!
//! # Source
//! Cheshire and Baker, "Consistent overhead byte stuffing", IEEE/ACM Trans. Networking 7(2), 1999. CRC-32/ISO-HDLC
//! (IEEE 802.3): a random frame passes once in 4e9, and any three bit errors in a frame of this length are found
//! (Koopman, "32-bit cyclic redundancy codes for Internet applications", DSN 2002).

use crate::checksum::CRC32;
use cobs::{DecodeResult, DecoderState};
use core::fmt;
use postcard::ser_flavors::{Cobs, Slice, crc::CrcModifier};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bytes of the checksum.
const CRC_BYTES: usize = 4;

/// No message is longer. **Units:** bytes, before the checksum.
pub const MESSAGE_MAX: usize = 320;

/// No frame is longer: an overhead of one byte for each 254, a checksum and two zeros. **Units:** bytes.
pub const FRAME_MAX: usize = cobs::max_encoding_length(MESSAGE_MAX + CRC_BYTES) + 2;

/// The message does not fit the buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

impl fmt::Display for TooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the message does not fit the buffer for its frame")
    }
}

impl core::error::Error for TooLong {}

/// The message as a frame; [`FRAME_MAX`] bytes are enough for every message of this protocol.
pub fn encode<'a, M: Serialize + ?Sized>(message: &M, buffer: &'a mut [u8]) -> Result<&'a [u8], TooLong> {
    let (first, rest) = buffer.split_first_mut().ok_or(TooLong)?;
    *first = 0;
    let stuffed = Cobs::try_new(Slice::new(rest)).map_err(|_| TooLong)?;
    let checked = CrcModifier::new(stuffed, CRC32.digest());
    let length = postcard::serialize_with_flavor(message, checked).map_err(|_| TooLong)?.len();
    buffer.get(..length + 1).ok_or(TooLong)
}

/// Why a frame was no message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// The byte stuffing points beyond the end of the frame.
    Stuffing,
    /// The checksum is that of other bytes.
    Checksum,
    /// The frame is longer than any message of this protocol.
    TooLong,
    /// The checksum is right, but this program knows no such message.
    Unknown,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Stuffing => "the byte stuffing of the frame points beyond its end",
            Self::Checksum => "the checksum of the frame is that of other bytes",
            Self::TooLong => "the frame is longer than any message",
            Self::Unknown => "the frame carries a message that this program does not know",
        })
    }
}

impl core::error::Error for FrameError {}

/// How many frames came, and how many of them were no messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, postcard_schema::Schema)]
pub struct FrameCounters {
    /// Messages.
    pub good: u32,
    /// [`FrameError::Stuffing`].
    pub stuffing: u32,
    /// [`FrameError::Checksum`].
    pub checksum: u32,
    /// [`FrameError::TooLong`].
    pub too_long: u32,
    /// [`FrameError::Unknown`].
    pub unknown: u32,
}

impl FrameCounters {
    fn count(&mut self, error: FrameError) {
        let counter = match error {
            FrameError::Stuffing => &mut self.stuffing,
            FrameError::Checksum => &mut self.checksum,
            FrameError::TooLong => &mut self.too_long,
            FrameError::Unknown => &mut self.unknown,
        };
        *counter = counter.saturating_add(1);
    }

    /// Frames that were no messages.
    pub fn bad(&self) -> u32 {
        self.stuffing.saturating_add(self.checksum).saturating_add(self.too_long).saturating_add(self.unknown)
    }
}

/// Finds the messages in a stream of bytes, in whatever pieces it comes. `N` is the length of the longest message with its
/// checksum; it never panics, and every zero makes it start anew.
#[derive(Debug)]
pub struct Decoder<const N: usize> {
    frame: [u8; N],
    length: usize,
    stuffing: DecoderState,
    too_long: bool,
    counters: FrameCounters,
}

/// A decoder for messages of any length that this protocol has.
pub type AnyDecoder = Decoder<{ MESSAGE_MAX + CRC_BYTES }>;

impl<const N: usize> Decoder<N> {
    /// Before the first byte.
    pub const fn new() -> Self {
        let counters = FrameCounters { good: 0, stuffing: 0, checksum: 0, too_long: 0, unknown: 0 };
        Self { frame: [0; N], length: 0, stuffing: DecoderState::Idle, too_long: false, counters }
    }

    /// Takes bytes from the front of `bytes` until a frame ends; `None` when they are used up.
    pub fn next<M: DeserializeOwned>(&mut self, bytes: &mut &[u8]) -> Option<Result<M, FrameError>> {
        while let Some((&byte, rest)) = bytes.split_first() {
            *bytes = rest;
            let outcome = match self.stuffing.feed(byte) {
                Ok(DecodeResult::NoData) => continue,
                Ok(DecodeResult::DataContinue(byte)) => {
                    match self.frame.get_mut(self.length) {
                        Some(place) => *place = byte,
                        None => self.too_long = true,
                    }
                    self.length += usize::from(!self.too_long);
                    continue;
                }
                _ if self.too_long => Err(FrameError::TooLong),
                Ok(DecodeResult::DataComplete) => self.message(),
                Err(_) => Err(FrameError::Stuffing),
            };
            self.length = 0;
            self.too_long = false;
            match &outcome {
                Ok(_) => self.counters.good = self.counters.good.saturating_add(1),
                Err(error) => self.counters.count(*error),
            }
            return Some(outcome);
        }
        None
    }

    fn message<M: DeserializeOwned>(&self) -> Result<M, FrameError> {
        let frame = self.frame.get(..self.length).unwrap_or_default();
        let (message, sum) = frame.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::Checksum)?;
        if CRC32.checksum(message) != u32::from_le_bytes(*sum) {
            return Err(FrameError::Checksum);
        }
        match postcard::take_from_bytes(message) {
            Ok((message, [])) => Ok(message),
            _ => Err(FrameError::Unknown),
        }
    }

    /// Forgets the beginning of a frame: the line was opened anew.
    pub fn restart(&mut self) {
        self.stuffing = DecoderState::Idle;
        self.length = 0;
        self.too_long = false;
    }

    /// What came so far.
    pub fn counters(&self) -> &FrameCounters {
        &self.counters
    }
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    type Message = (u32, heapless::Vec<u8, 310>);

    fn frame(message: &Message) -> Vec<u8> {
        encode(message, &mut [0; FRAME_MAX]).unwrap().to_vec()
    }

    fn decode(decoder: &mut AnyDecoder, mut bytes: &[u8]) -> Vec<Result<Message, FrameError>> {
        core::iter::from_fn(|| decoder.next(&mut bytes)).collect()
    }

    fn message() -> impl Strategy<Value = Message> {
        let bytes = proptest::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 0..300);
        (any::<u32>(), bytes.prop_map(|bytes| heapless::Vec::from_slice(&bytes).unwrap()))
    }

    #[test]
    fn each_kind_of_bad_frame_is_told_and_the_next_frame_is_whole() {
        let good: Message = (7, heapless::Vec::from_slice(&[1, 0, 2]).unwrap());
        let mut damaged = frame(&good);
        damaged[3] ^= 0x10;
        let mut unknown = [0; 32];
        let unknown = encode(&(7_u8, 200_u8), &mut unknown).unwrap();
        let cases: [(&[u8], FrameError); 5] = [
            (&[0, 200, 1, 0], FrameError::Stuffing),
            (&damaged, FrameError::Checksum),
            (&[0, 3, 1, 2, 0], FrameError::Checksum),
            (&[1; 400], FrameError::TooLong),
            (unknown, FrameError::Unknown),
        ];
        let mut decoder = AnyDecoder::new();
        for (bytes, error) in cases {
            let stream = [bytes, &frame(&good)].concat();
            assert_eq!(decode(&mut decoder, &stream), [Err(error), Ok(good.clone())], "{error}");
        }
        let counters = FrameCounters { good: 5, stuffing: 1, checksum: 2, too_long: 1, unknown: 1 };
        assert_eq!((*decoder.counters(), decoder.counters().bad()), (counters, 5));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert_eq!(encode(&[[9_u8; 20]; 20], &mut [0; FRAME_MAX]), Err(TooLong));
        for size in 0..8 {
            assert_eq!(
                encode(&(), &mut [0; 8][..size]),
                if size < 7 { Err(TooLong) } else { Ok(&[0, 1, 1, 1, 1, 1, 0][..]) }
            );
        }
    }

    #[test]
    fn a_line_opened_anew_does_not_spoil_the_first_frame() {
        let good: Message = (7, heapless::Vec::from_slice(&[1, 0, 2]).unwrap());
        let mut decoder = AnyDecoder::new();
        assert!(decode(&mut decoder, &[0, 77, 1]).is_empty());
        decoder.restart();
        assert_eq!(decode(&mut decoder, &frame(&good)), [Ok(good)]);
    }

    proptest! {
        #[test]
        fn messages_survive_any_chunking(messages in proptest::collection::vec(message(), 1..8), chunk in 1_usize..50) {
            let stream = messages.iter().flat_map(frame).collect::<Vec<_>>();
            let mut decoder = AnyDecoder::new();
            let decoded: Vec<_> = stream.chunks(chunk).flat_map(|chunk| decode(&mut decoder, chunk)).collect();
            prop_assert_eq!(decoded, messages.into_iter().map(Ok).collect::<Vec<_>>());
            prop_assert_eq!(decoder.counters().bad(), 0);
        }

        #[test]
        fn damage_costs_the_frames_it_touches_and_no_other(
            messages in proptest::collection::vec(message(), 3..8),
            at in any::<proptest::sample::Index>(),
            bit in 0..8_u32,
            kind in 0..3_u8,
        ) {
            let frames: Vec<_> = messages.iter().map(frame).collect();
            let mut stream = frames.concat();
            let at = at.index(stream.len());
            match kind {
                0 => stream[at] ^= 1 << bit,
                1 => { stream.remove(at); }
                _ => stream.insert(at, bit as u8),
            }
            let mut decoder = AnyDecoder::new();
            let good: Vec<_> = decode(&mut decoder, &stream).into_iter().flatten().collect();
            // The frame that was touched.
            let mut end = 0;
            let touched = frames.iter().position(|frame| { end += frame.len(); at < end }).unwrap();
            let untouched: Vec<_> = messages.iter().enumerate().filter(|(i, _)| *i != touched).map(|(_, message)| message.clone()).collect();
            // A frame of which a delimiter was touched may survive; nothing else may come instead.
            prop_assert!(good == untouched || good == messages, "{} of {}", good.len(), messages.len());
        }

        #[test]
        fn no_bytes_panic(chunks in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..100), 0..20)) {
            let mut decoder = Decoder::<16>::new();
            for chunk in &chunks {
                let mut bytes = &chunk[..];
                while decoder.next::<Message>(&mut bytes).is_some() {}
                prop_assert!(bytes.is_empty());
            }
        }
    }
}
