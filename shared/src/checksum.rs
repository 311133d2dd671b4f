//! The one checksum of the project: of frames on the wire and of records in flash.

use crc::{CRC_32_ISO_HDLC, Crc};

/// CRC-32/ISO-HDLC (IEEE 802.3), by a small table.
pub(crate) static CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
