//! A NOR flash in memory, for tests: writing clears bits, a word is written once, pages are erased, and the power fails
//! when it is told to, also in the middle of an operation.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use std::vec::Vec;

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The power is gone.
    Power,
    /// A word was written that had not been erased.
    NotErased,
    /// Misaligned or out of bounds.
    Place(NorFlashErrorKind),
}

impl NorFlashError for Fault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place(kind) => *kind,
            Self::Power | Self::NotErased => NorFlashErrorKind::Other,
        }
    }
}

/// How the power fails.
#[derive(Clone, Copy, Debug)]
pub enum Cut {
    /// Before the operation.
    Before,
    /// In it: of the bits that it should change each changes with this chance, in 256ths.
    During(u8),
}

/// Pages of `PAGE` bytes, written by words of `WORD` bytes.
#[derive(Clone, Debug)]
pub struct MockFlash<const WORD: usize, const PAGE: usize> {
    bytes: Vec<u8>,
    /// Words written and pages erased until the power fails.
    pub fuel: u32,
    /// How it fails then.
    pub cut: Cut,
    /// Words written and pages erased so far.
    pub operations: u32,
    dead: bool,
    random: u64,
}

impl<const WORD: usize, const PAGE: usize> MockFlash<WORD, PAGE> {
    /// Erased pages.
    pub fn new(pages: usize) -> Self {
        let bytes = std::vec![0xFF; pages * PAGE];
        Self { bytes, fuel: u32::MAX, cut: Cut::Before, operations: 0, dead: false, random: 1 }
    }

    /// The power will fail in the operation after the next `fuel`.
    pub fn fail_after(&mut self, fuel: u32, cut: Cut, seed: u64) {
        (self.fuel, self.cut, self.random) = (fuel, cut, seed.wrapping_mul(2).wrapping_add(1));
    }

    /// The power is back.
    pub fn restore(&mut self) {
        (self.fuel, self.dead) = (u32::MAX, false);
    }

    /// Overwrites whatever is there.
    pub fn spoil(&mut self, place: usize, byte: u8) {
        let len = self.bytes.len();
        self.bytes[place % len] = byte;
    }

    /// Refuses what does not begin and end at a multiple of `unit`, or lies outside.
    fn check(&self, offset: u32, len: usize, unit: usize) -> Result<(), Fault> {
        if !(offset as usize).is_multiple_of(unit) || !len.is_multiple_of(unit) {
            return Err(Fault::Place(NorFlashErrorKind::NotAligned));
        }
        let inside = (offset as usize).checked_add(len).is_some_and(|end| end <= self.bytes.len());
        if inside { Ok(()) } else { Err(Fault::Place(NorFlashErrorKind::OutOfBounds)) }
    }

    fn chance(&mut self, of_256: u8) -> bool {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.random >> 56) as u8 <= of_256
    }

    /// Brings the bytes at `place` to `target`, or on the way there.
    fn operate(&mut self, place: usize, target: &[u8]) -> Result<(), Fault> {
        if self.dead {
            return Err(Fault::Power);
        }
        if self.fuel > 0 {
            (self.fuel, self.operations) = (self.fuel - 1, self.operations + 1);
            self.bytes[place..place + target.len()].copy_from_slice(target);
            return Ok(());
        }
        self.dead = true;
        if let Cut::During(chance) = self.cut {
            for (index, &byte) in target.iter().enumerate() {
                for bit in 0..8 {
                    if self.chance(chance) {
                        let old = &mut self.bytes[place + index];
                        *old = (*old & !(1 << bit)) | (byte & (1 << bit));
                    }
                }
            }
        }
        Err(Fault::Power)
    }
}

impl<const WORD: usize, const PAGE: usize> ErrorType for MockFlash<WORD, PAGE> {
    type Error = Fault;
}

impl<const WORD: usize, const PAGE: usize> ReadNorFlash for MockFlash<WORD, PAGE> {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fault> {
        if self.dead {
            return Err(Fault::Power);
        }
        self.check(offset, bytes.len(), 1)?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WORD: usize, const PAGE: usize> NorFlash for MockFlash<WORD, PAGE> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Fault> {
        self.check(from, to.saturating_sub(from) as usize, PAGE)?;
        (from as usize..to as usize).step_by(PAGE).try_for_each(|page| self.operate(page, &[0xFF; PAGE]))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fault> {
        self.check(offset, bytes.len(), WORD)?;
        for (index, word) in bytes.chunks(WORD).enumerate() {
            let place = offset as usize + index * WORD;
            if self.bytes[place..place + WORD].iter().any(|&byte| byte != 0xFF) {
                return Err(Fault::NotErased);
            }
            self.operate(place, word)?;
        }
        Ok(())
    }
}

/// Runs a future that never waits.
pub fn run<F: core::future::Future>(future: F) -> F::Output {
    let mut context = core::task::Context::from_waker(core::task::Waker::noop());
    match core::pin::pin!(future).poll(&mut context) {
        core::task::Poll::Ready(output) => output,
        core::task::Poll::Pending => panic!("a flash in memory does not make anyone wait"),
    }
}
