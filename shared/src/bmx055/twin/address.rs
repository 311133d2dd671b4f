//! The address of a transaction: its first byte, and where the bytes after it go.

use crate::bmx055::registers::{READ, both};

/// The register that the next byte of a transaction belongs to.
#[derive(Debug, Default)]
pub(super) struct Address(Option<u8>);

impl Address {
    /// Chip select falls.
    pub fn select(&mut self) {
        self.0 = None;
    }

    /// A byte comes: `None` for the address itself, else the register and whether it is read. The address advances from
    /// byte to byte but for the FIFO (BMI088, 6.1.1 and 5.5.17).
    pub fn next(&mut self, sent: u8) -> Option<(u8, bool)> {
        let Some(address) = self.0 else {
            self.0 = Some(sent);
            return None;
        };
        let register = address & !READ;
        if register != both::FIFO_DATA {
            self.0 = Some(address & READ | register.wrapping_add(1) & !READ);
        }
        Some((register, address & READ != 0))
    }
}
