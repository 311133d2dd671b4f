//! Registers over a bus.

use super::registers::READ;
use core::fmt;
use embedded_hal_async::spi::{Error as _, ErrorKind, Operation, SpiDevice};

/// Why a die did not do what it was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The transfer failed.
    Bus(ErrorKind),
    /// The identification is not the die's.
    Identification {
        /// The die's.
        expected: u8,
        /// As read.
        read: u8,
    },
    /// A register does not hold what was written.
    ReadBack {
        /// Its address.
        register: u8,
        /// As written.
        expected: u8,
        /// As read.
        read: u8,
    },
    /// No reading came in time.
    NotReady,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(kind) => write!(f, "transfer failed: {kind}"),
            Self::Identification { expected, read } => {
                write!(f, "chip identification is {read:#04x} instead of {expected:#04x}: wiring, or another chip")
            }
            Self::ReadBack { register, expected, read } => {
                write!(f, "register {register:#04x} reads {read:#04x} after {expected:#04x} was written")
            }
            Self::NotReady => write!(f, "no reading came in time"),
        }
    }
}

impl core::error::Error for Error {}

/// Reads registers from `register` on.
pub(super) async fn read<S: SpiDevice>(spi: &mut S, register: u8, bytes: &mut [u8]) -> Result<(), Error> {
    let mut operations = [Operation::Write(&[register | READ]), Operation::Read(bytes)];
    spi.transaction(&mut operations).await.map_err(|error| Error::Bus(error.kind()))
}

/// Reads a register.
pub(super) async fn read_one<S: SpiDevice>(spi: &mut S, register: u8) -> Result<u8, Error> {
    let mut byte = [0];
    read(spi, register, &mut byte).await?;
    Ok(byte[0])
}

/// Writes a register.
pub(super) async fn write<S: SpiDevice>(spi: &mut S, register: u8, value: u8) -> Result<(), Error> {
    spi.write(&[register, value]).await.map_err(|error| Error::Bus(error.kind()))
}

/// Whether the die is the one that is expected.
pub(super) async fn identify<S: SpiDevice>(spi: &mut S, register: u8, expected: u8) -> Result<(), Error> {
    let read = read_one(spi, register).await?;
    if read == expected { Ok(()) } else { Err(Error::Identification { expected, read }) }
}

/// x, y, z as they come over the bus, least significant byte first.
pub(super) fn words(bytes: &[u8]) -> [i16; 3] {
    let word = |index: usize| {
        let low = bytes.get(2 * index).copied().unwrap_or_default();
        let high = bytes.get(2 * index + 1).copied().unwrap_or_default();
        i16::from_le_bytes([low, high])
    };
    [word(0), word(1), word(2)]
}
