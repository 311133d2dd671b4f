//! The one checksum of the project: of frames on the wire, of records in flash and of what is kept over a reset.

use crc::{CRC_32_ISO_HDLC, Crc};

/// CRC-32/ISO-HDLC (IEEE 802.3), by a small table.
pub static CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
