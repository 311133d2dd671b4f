//! Frames that no copy brought whole, put together from several damaged ones.
//!
//! What the shoe sends again comes with other bits wrong. Of three copies or more, each bit is what most of them say; the
//! checksum tells whether that is a message. Where one bit in a hundred is wrong, a step comes whole once in a hundred
//! times, but three copies of it give it nine times in ten.
//!
//! # Source
//! Sindhu, "Retransmission error control with memory", IEEE Trans. Communications 25(5), 1977; the vote is that of Chase,
//! "Code combining", IEEE Trans. Communications 33(5), 1985, for bits that are all trusted alike.

use sohle_shared::wire::frame::{AnyDecoder, FRAME_MAX, FrameCounters, FrameError};
use sohle_shared::wire::message::FromShoe;
use std::collections::VecDeque;

/// Damaged frames kept: more than a shoe sends between two copies of a step, however many wait.
const KEPT: usize = 256;
/// Copies of one frame differ in fewer than one in so many bits: in one in fifty where one in a hundred is wrong. Another
/// number in the same message changes half of the bits of its checksum, which is more in each but the longest.
const ALIKE: usize = 20;
/// Copies that a vote needs.
const COPIES: usize = 3;

/// Finds the shoe's messages in a stream of bytes, in whatever pieces it comes, and in the frames that were damaged.
#[derive(Debug, Default)]
pub struct Decoder {
    decoder: AnyDecoder,
    /// The frame that has begun, as it came. Zeros are not part of it.
    frame: Vec<u8>,
    damaged: VecDeque<Vec<u8>>,
    mended: u64,
}

impl Decoder {
    /// Takes bytes from the front of `bytes` until a frame ends; `None` when they are used up.
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Result<FromShoe, FrameError>> {
        let before = *bytes;
        let outcome = self.decoder.next(bytes);
        let taken = before.iter().take(before.len() - bytes.len());
        // One byte more than the longest frame says that it was longer.
        let room = FRAME_MAX + 1 - self.frame.len();
        self.frame.extend(taken.filter(|&&byte| byte != 0).take(room));
        let outcome = outcome?;
        let frame = std::mem::take(&mut self.frame);
        match outcome {
            Err(error @ (FrameError::Stuffing | FrameError::Checksum)) if frame.len() <= FRAME_MAX => {
                Some(self.mend(frame).ok_or(error))
            }
            outcome => Some(outcome),
        }
    }

    /// The message of which this is another damaged copy, if there are enough of them. They are forgotten then.
    fn mend(&mut self, frame: Vec<u8>) -> Option<FromShoe> {
        let mut copies = vec![&frame];
        copies.extend(self.damaged.iter().rev().filter(|other| alike(&frame, other)));
        // The latest first: those before may be of a message that was nearly the same.
        let message = (COPIES..=copies.len()).find_map(|count| message(&vote(&copies[..count])));
        if message.is_some() {
            self.damaged.retain(|other| !alike(&frame, other));
            self.mended += 1;
        } else {
            if self.damaged.len() == KEPT {
                self.damaged.pop_front();
            }
            self.damaged.push_back(frame);
        }
        message
    }

    /// Forgets all that came: the line was opened anew.
    pub fn restart(&mut self) {
        self.decoder.restart();
        self.frame.clear();
        self.damaged.clear();
    }

    /// What came so far; frames that were put together count as damaged.
    pub fn counters(&self) -> &FrameCounters {
        self.decoder.counters()
    }

    /// Messages that were put together.
    pub fn mended(&self) -> u64 {
        self.mended
    }
}

fn alike(one: &[u8], other: &[u8]) -> bool {
    let different = || one.iter().zip(other).map(|(a, b)| (a ^ b).count_ones() as usize).sum::<usize>();
    one.len() == other.len() && different() * ALIKE < one.len() * 8
}

/// What most copies say of each bit; the first where they are even. All are of the same length.
fn vote(copies: &[&Vec<u8>]) -> Vec<u8> {
    let bit = |at: usize, mask: u8| {
        let set = copies.iter().filter(|copy| copy[at] & mask != 0).count();
        match (2 * set).cmp(&copies.len()) {
            std::cmp::Ordering::Less => 0,
            std::cmp::Ordering::Equal => copies[0][at] & mask,
            std::cmp::Ordering::Greater => mask,
        }
    };
    (0..copies[0].len()).map(|at| (0..8).fold(0, |byte, place| byte | bit(at, 1 << place))).collect()
}

fn message(frame: &[u8]) -> Option<FromShoe> {
    let bytes = [frame, &[0]].concat();
    AnyDecoder::new().next(&mut &bytes[..])?.ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::random::{Purpose, Random};
    use proptest::prelude::*;
    use sohle_shared::time::Micros;
    use sohle_shared::wire::frame::encode;
    use sohle_shared::wire::message::{SentStep, TimeReply};
    use sohle_shared::wire::packed::PackedStep;

    fn step(id: u32) -> FromShoe {
        let mut random = Random::new(u64::from(id), Purpose::MadeUpSteps);
        let step = PackedStep::pack(&crate::link::endurance::step(id, Micros(1_000_000), &mut random));
        FromShoe::Step(SentStep { boot: 0x1234_5678, id, oldest: 0, step })
    }

    fn frame(message: &FromShoe) -> Vec<u8> {
        encode(message, &mut [0; FRAME_MAX]).unwrap().to_vec()
    }

    /// Flips so many bits inside the frame, each in another byte. No byte becomes a zero.
    fn damaged(message: &FromShoe, flips: usize, random: &mut Random) -> Vec<u8> {
        let mut frame = frame(message);
        let mut left: Vec<_> = (1..frame.len() - 1).collect();
        for _ in 0..flips {
            let at = left.swap_remove((left.len() as f64 * random.unit()) as usize);
            let places = (0..8).filter(|place| frame[at] != 1 << place).collect::<Vec<_>>();
            frame[at] ^= 1 << places[(places.len() as f64 * random.unit()) as usize];
        }
        frame
    }

    fn hear(decoder: &mut Decoder, mut bytes: &[u8]) -> Vec<Option<FromShoe>> {
        std::iter::from_fn(|| decoder.next(&mut bytes)).map(Result::ok).collect()
    }

    #[test]
    fn three_damaged_copies_make_the_message_once() {
        let mut random = Random::new(3, Purpose::FromShoe);
        let (mut decoder, message) = (Decoder::default(), step(7));
        let copies: Vec<_> = (0..6).map(|_| damaged(&message, 1, &mut random)).collect();
        let heard: Vec<_> = copies.iter().map(|copy| hear(&mut decoder, copy)).collect();
        let whole = [Some(message)];
        assert_eq!(heard, [&[None][..], &[None], &whole, &[None], &[None], &whole]);
        assert_eq!((decoder.mended(), decoder.counters().bad(), decoder.counters().good), (2, 6, 0));
    }

    #[test]
    fn copies_are_found_among_those_of_other_steps() {
        let mut random = Random::new(4, Purpose::FromShoe);
        let mut decoder = Decoder::default();
        let mut heard = Vec::new();
        for _ in 0..3 {
            for id in 0..64 {
                heard.extend(hear(&mut decoder, &damaged(&step(id), 3, &mut random)).into_iter().flatten());
            }
        }
        // Two of three copies are wrong in the same place once in 35 times.
        assert!(heard.len() > 50, "{}", heard.len());
        assert!(heard.iter().all(|message| (0..64).any(|id| step(id) == *message)));
    }

    #[test]
    fn whole_frames_pass_and_those_of_other_lines_are_forgotten() {
        let mut random = Random::new(5, Purpose::FromShoe);
        let (mut decoder, message) = (Decoder::default(), step(7));
        hear(&mut decoder, &damaged(&message, 1, &mut random));
        assert_eq!(hear(&mut decoder, &frame(&message)), [Some(message.clone())]);
        hear(&mut decoder, &damaged(&message, 1, &mut random));
        decoder.restart();
        assert_eq!(hear(&mut decoder, &damaged(&message, 1, &mut random)), [None]);
        assert_eq!(decoder.mended(), 0);
    }

    #[test]
    fn messages_that_are_nearly_the_same_do_not_mix() {
        let mut random = Random::new(6, Purpose::FromShoe);
        let mut decoder = Decoder::default();
        for number in 0..1_000 {
            let time = Micros(i64::from(number) * 2_000_000);
            let reply = FromShoe::TimeReply(TimeReply { number, received: time, sent: time + 40 });
            assert_eq!(hear(&mut decoder, &damaged(&reply, 1, &mut random)), [None]);
        }
        assert!(decoder.damaged.len() == KEPT);
    }

    proptest! {
        #[test]
        fn no_bytes_panic_or_pile_up(
            chunks in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..400), 0..20),
            nonzero in any::<bool>(),
        ) {
            let mut decoder = Decoder::default();
            for mut bytes in chunks {
                bytes.iter_mut().for_each(|byte| *byte |= u8::from(nonzero));
                let mut rest = &bytes[..];
                while decoder.next(&mut rest).is_some() {}
                prop_assert!(rest.is_empty() && decoder.frame.len() <= FRAME_MAX + 1);
            }
        }
    }
}
