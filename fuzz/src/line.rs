//! Bytes as frames on the line, with the right checksum.
//!
//! No fuzzer finds a checksum by chance, and behind it lies most of what is to be tested.

use serde::ser::{Serialize, SerializeTuple, Serializer};
use sohle_shared::wire::frame::{AnyDecoder, FRAME_MAX, encode};

/// Bytes that are a message as they are, without their length.
struct Plain<'a>(&'a [u8]);

impl Serialize for Plain<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

/// The frame around a message; nothing if it is longer than any.
pub fn framed<M: Serialize + ?Sized>(message: &M) -> Vec<u8> {
    encode(message, &mut [0; FRAME_MAX]).map(<[u8]>::to_vec).unwrap_or_default()
}

/// The frame around the bytes of what may be a message; nothing if they are more than any has.
pub fn framed_bytes(bytes: &[u8]) -> Vec<u8> {
    framed(&Plain(bytes))
}

/// The messages in `bytes`, which must hold nothing else.
pub fn messages<M: serde::de::DeserializeOwned>(mut bytes: &[u8]) -> Vec<M> {
    let mut decoder = AnyDecoder::new();
    let mut messages = Vec::new();
    while let Some(message) = decoder.next(&mut bytes) {
        messages.push(message.expect("what is sent can be read"));
    }
    messages
}
