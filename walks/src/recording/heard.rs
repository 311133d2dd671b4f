//! What a laptop heard of a shoe: every message as it came, so that nothing of a live walk is lost in a translation.

use super::message::{Decoder, Encoder, Message};
use sohle_shared::time::Micros;
use sohle_shared::wire::message::FromShoe;

/// A message of the shoe.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    /// When it came, by the laptop's clock since the recording began.
    pub time: Micros,
    /// What was said.
    pub message: FromShoe,
}

impl Message for Heard {
    const TOPIC: &'static str = "/shoe";
    const SCHEMA: &'static str = "sohle/msg/FromShoe";
    const DEFINITION: &'static str = "\
# A message of the shoe as it came over the wire.
# laptop's clock since the recording began
int64 time_us
# postcard; the metadata 'wire_schema' tells which messages there are
uint8[] message
";

    fn time(&self) -> Micros {
        self.time
    }

    fn put(&self, out: &mut Encoder) {
        out.time(self.time);
        // Into a vector everything fits.
        let bytes = postcard::to_stdvec(&self.message).unwrap_or_default();
        out.sequence(&bytes);
    }

    fn take(from: &mut Decoder<'_>) -> Option<Self> {
        let time = from.time()?;
        let (message, rest) = postcard::take_from_bytes(from.sequence()?).ok()?;
        rest.is_empty().then_some(Self { time, message })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::wire::message::{Level, Log, text};

    #[test]
    fn a_message_comes_back_and_half_a_message_does_not() {
        let message = FromShoe::Log(Log { time: Micros(3), level: Level::Warn, text: text("too late") });
        let heard = Heard { time: Micros(7), message };
        let mut buffer = Encoder::default();
        let bytes = heard.encode(&mut buffer).to_vec();
        assert_eq!(Heard::decode(&bytes), Some(heard));
        for length in 0..bytes.len() {
            assert_eq!(Heard::decode(&bytes[..length]), None);
        }
    }
}
