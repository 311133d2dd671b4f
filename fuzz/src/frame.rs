//! The decoder of frames: whatever lies between them, frames that are whole are read, in whatever pieces they come.

use crate::line::framed;
use crate::script;
use crate::seeds::Seed;
use serde::{Deserialize, Serialize};
use sohle_shared::wire::frame::{AnyDecoder, Decoder, FrameError};

/// What comes on the line.
#[derive(Serialize, Deserialize)]
enum Piece {
    Bytes(Vec<u8>),
    Frame(Vec<u8>),
    /// A frame of which a byte is another.
    Damaged(Vec<u8>, u16, u8),
    /// A frame that ends early.
    Cut(Vec<u8>, u16),
}

impl Piece {
    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Bytes(bytes) => bytes.clone(),
            Self::Frame(message) => framed(message),
            Self::Damaged(message, at, flip) => {
                let mut frame = framed(message);
                let at = usize::from(*at) % frame.len().max(1);
                frame.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= flip);
                frame
            }
            Self::Cut(message, length) => {
                let mut frame = framed(message);
                frame.truncate(usize::from(*length) % frame.len().max(1));
                frame
            }
        }
    }
}

type Outcome = Result<Vec<u8>, FrameError>;

fn decode<const N: usize>(decoder: &mut Decoder<N>, mut bytes: &[u8]) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    while let Some(outcome) = decoder.next(&mut bytes) {
        outcomes.push(outcome);
    }
    assert!(bytes.is_empty(), "all bytes are taken");
    outcomes
}

fn check<const N: usize>(stream: &[u8], chunk: usize) -> Vec<Outcome> {
    let mut decoder = Decoder::<N>::new();
    let whole = decode(&mut decoder, stream);
    let good = whole.iter().filter(|outcome| outcome.is_ok()).count();
    assert_eq!((decoder.counters().good as usize, decoder.counters().bad() as usize), (good, whole.len() - good));
    let mut decoder = Decoder::<N>::new();
    let in_pieces: Vec<_> = stream.chunks(chunk).flat_map(|piece| decode(&mut decoder, piece)).collect();
    assert_eq!(in_pieces, whole, "it is the same in pieces of {chunk}");
    whole
}

/// The first byte is the length of the pieces, the rest a script of what comes.
pub fn run(data: &[u8]) {
    let Some((&chunk, script)) = data.split_first() else { return };
    let pieces: Vec<Piece> = script::read(script).collect();
    let stream: Vec<u8> = pieces.iter().flat_map(Piece::bytes).collect();
    let chunk = usize::from(chunk).max(1);
    check::<16>(&stream, chunk);
    let mut decoded = check::<{ size_of_any() }>(&stream, chunk).into_iter().flatten();
    for piece in &pieces {
        if let Piece::Frame(message) = piece
            && !framed(message).is_empty()
        {
            assert!(decoded.any(|decoded| decoded == *message), "a whole frame is read");
        }
    }
    decode(&mut AnyDecoder::new(), data);
}

/// The longest message with its checksum. **Units:** bytes.
const fn size_of_any() -> usize {
    sohle_shared::wire::frame::MESSAGE_MAX + 4
}

/// A frame alone, frames between garbage, and damaged ones.
pub fn seeds() -> Vec<Seed> {
    let message = vec![1, 0, 2, 0, 0, 3];
    let long = vec![7; 300];
    let seed = |chunk, pieces: &[Piece]| [vec![chunk], script::written(pieces)].concat();
    vec![
        ("frame", seed(1, &[Piece::Frame(message.clone())])),
        ("garbage", seed(7, &[Piece::Bytes(vec![9, 0, 200, 1, 0, 5]), Piece::Frame(message.clone())])),
        (
            "damaged",
            seed(
                3,
                &[
                    Piece::Damaged(message.clone(), 3, 0x10),
                    Piece::Frame(message.clone()),
                    Piece::Cut(message.clone(), 5),
                    Piece::Frame(message.clone()),
                ],
            ),
        ),
        ("long", seed(64, &[Piece::Frame(long.clone()), Piece::Bytes(vec![1; 400]), Piece::Frame(message)])),
    ]
}
