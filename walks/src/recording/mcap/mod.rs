//! The project's own recordings: MCAP files, written as a stream and read back bit for bit.
//!
//! # What is inside
//! One channel for each kind of [message](super::message): `/imu`, and where known `/truth/pose`, `/truth/stance`,
//! `/step`; `/fix` for [what other sources said](super::fix) of the place; of a live walk also `/shoe`, which holds every
//! [message of the shoe](super::heard); of a walk that was followed in a building also what [viewers show](super::scene) of it. Their schemas are
//! `ros2msg` text, their messages CDR. The record of metadata `sohle` holds name, sensor range and version; the record
//! `about` whatever the writer had to say (parameters, seeds, origin). Nothing is compressed: the decoders of MCAP's
//! compressions are C code.
//!
//! # Why CDR
//! JSON, MCAP's other self-describing encoding without a code generator, takes 138 bytes for a sample of the surveyed
//! walk 31 against 38 (3.6 times; 2.2 times in the file, where a message brings 47 bytes of header and index) and must be
//! parsed digit by digit; a packed binary of our own would be four bytes smaller but could be shown by nobody else. CDR with a
//! `ros2msg` schema is understood by the viewers of MCAP without a plug-in. The messages are fixed sequences of numbers,
//! so no library is needed for it. The test `the_encoding_is_small` measures the sizes.

mod read;
#[cfg(test)]
mod tests;
mod write;

use super::error::Problem;
use mcap::McapError;
pub(super) use read::read;
pub use write::{Writer, write, write_shown};

/// The first bytes of every MCAP file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

const SCHEMA_ENCODING: &str = "ros2msg";
const MESSAGE_ENCODING: &str = "cdr";
/// Names of the records of metadata.
const OWN: &str = "sohle";
const ABOUT: &str = "about";

/// What tells which messages of the wire a recording holds.
const WIRE_SCHEMA: &str = "wire_schema";

fn wire_schema() -> String {
    format!("{:016x}", sohle_shared::wire::SCHEMA)
}

/// What the writing or reading library says, in the words of this module.
fn problem(error: McapError) -> Problem {
    match error {
        McapError::Io(error) => Problem::Io(error),
        McapError::UnsupportedCompression(name) => {
            Problem::Malformed(format!("compressed with {name}, expected an MCAP without compression"))
        }
        other => Problem::Malformed(format!("damaged MCAP: {}", other.to_string().replace('\n', " "))),
    }
}
