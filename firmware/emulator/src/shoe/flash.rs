//! The flash of the emulated shoe: a file, so that what was kept survives the end of the emulator as it does a loss of
//! power.

use super::desk::{self, File};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// A page, as on the STM32WB55. **Units:** bytes.
const PAGE: usize = 4_096;
/// The whole of it: what the store needs. **Units:** bytes.
pub const SIZE: usize = 2 * PAGE;

/// The flash.
#[derive(Debug)]
pub struct Flash(File);

/// Why it could not be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The file.
    File,
    /// Misaligned or out of bounds.
    Place(NorFlashErrorKind),
}

impl NorFlashError for Fault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place(kind) => *kind,
            Self::File => NorFlashErrorKind::Other,
        }
    }
}

impl Flash {
    /// The file that the emulator's command line names; a new one is erased flash.
    pub fn open() -> Option<Self> {
        let mut line = [0_u8; 512];
        let (file, new) = File::change(desk::flash(&mut line)?)?;
        if new {
            erase(file, 0, SIZE)?;
        }
        Some(Self(file))
    }
}

fn erase(file: File, from: usize, to: usize) -> Option<()> {
    (from..to).step_by(64).try_for_each(|place| file.write(place, &[0xff; 64]))
}

/// Refuses what does not begin and end at a multiple of `unit`, or lies outside.
fn check(from: u32, length: usize, unit: usize) -> Result<usize, Fault> {
    let from = from as usize;
    if !from.is_multiple_of(unit) || !length.is_multiple_of(unit) {
        return Err(Fault::Place(NorFlashErrorKind::NotAligned));
    }
    let inside = from.checked_add(length).is_some_and(|end| end <= SIZE);
    if inside { Ok(from) } else { Err(Fault::Place(NorFlashErrorKind::OutOfBounds)) }
}

impl ErrorType for Flash {
    type Error = Fault;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fault> {
        let place = check(offset, bytes.len(), 1)?;
        self.0.read(place, bytes).ok_or(Fault::File)
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Fault> {
        let length = to.saturating_sub(from) as usize;
        let place = check(from, length, PAGE)?;
        erase(self.0, place, place + length).ok_or(Fault::File)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fault> {
        let place = check(offset, bytes.len(), Self::WRITE_SIZE)?;
        // Bits become zeros, never ones.
        for (at, word) in bytes.chunks_exact(Self::WRITE_SIZE).enumerate() {
            let at = place + at * Self::WRITE_SIZE;
            let mut there = [0; Self::WRITE_SIZE];
            self.0.read(at, &mut there).ok_or(Fault::File)?;
            there.iter_mut().zip(word).for_each(|(there, byte)| *there &= byte);
            self.0.write(at, &there).ok_or(Fault::File)?;
        }
        Ok(())
    }
}
