//! The magnetometer of the twin: it sleeps, is woken, takes one reading when told to.

use super::address::Address;
use crate::bmx055::registers::mag;

/// Duration of one reading with the fewest repetitions (BMM150, 4.2.4: 0.15 + 0.5 + 0.98 ms). **Units:** ns.
const READING_NS: u64 = 1_630_000;

/// Registers 0x40 to 0x7F.
#[derive(Debug, Default)]
pub(super) struct MagTwin {
    on: bool,
    boot_ns: u64,
    ready_ns: Option<u64>,
    address: Address,
    /// x, y, z and hall resistance, right-justified.
    pub field: [i16; 4],
    pub chip_id: Option<u8>,
    /// So many transfers fail from now on.
    pub transfers: u32,
}

impl MagTwin {
    /// Chip select falls.
    pub fn select(&mut self) {
        self.address.select();
    }

    /// A byte goes either way; the first is the address.
    pub fn exchange(&mut self, sent: u8, now_ns: u64) -> u8 {
        let Some((register, read)) = self.address.next(sent) else { return 0 };
        if read {
            return self.read(register, now_ns);
        }
        match register {
            mag::POWER if sent & mag::POWER_ON != 0 && !self.on => {
                (self.on, self.boot_ns) = (true, now_ns + u64::from(mag::BOOT_US) * 1_000);
            }
            mag::POWER if sent & mag::POWER_ON == 0 => (self.on, self.ready_ns) = (false, None),
            mag::MODE if sent & 0x06 == mag::MODE_FORCED && self.on && now_ns >= self.boot_ns => {
                self.ready_ns = Some(now_ns + READING_NS);
            }
            _ => {}
        }
        0
    }

    fn read(&self, register: u8, now_ns: u64) -> u8 {
        if register == mag::POWER {
            return u8::from(self.on);
        }
        if !self.on || now_ns < self.boot_ns {
            return 0;
        }
        let ready = self.ready_ns.is_some_and(|ready_ns| now_ns >= ready_ns);
        let [x, y, z, hall] = self.field;
        let words = [x << 3, y << 3, z << 1, hall << 2 | i16::from(ready)];
        match register {
            mag::CHIP_ID => self.chip_id.unwrap_or(mag::ID),
            mag::DATA..=0x49 => {
                let place = usize::from(register - mag::DATA);
                let word = words.get(place / 2).copied().unwrap_or_default();
                word.to_le_bytes().get(place % 2).copied().unwrap_or_default()
            }
            _ => 0,
        }
    }
}
