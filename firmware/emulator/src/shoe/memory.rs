//! What the emulated shoe keeps: with a flash, over the end of the emulator; without, nothing.

use sohle_shared::calibration::Calibration;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::message::Refusal;
use sohle_shared::wire::transfer::Value;

#[cfg(feature = "ble")]
use super::flash::{Flash, SIZE};
#[cfg(feature = "ble")]
use embassy_futures::block_on;
#[cfg(feature = "ble")]
use sohle_shared::bonds::Bonds;
#[cfg(feature = "ble")]
use sohle_shared::calibration::store::{Store, Stored};

/// What is kept.
pub struct Memory {
    #[cfg(feature = "ble")]
    store: Store<Flash>,
}

#[cfg(not(feature = "ble"))]
impl Memory {
    /// There is no flash.
    pub fn open() -> Option<Self> {
        Some(Self {})
    }

    /// Those of every new shoe.
    pub fn settings(&mut self) -> (Parameters, Calibration) {
        (Parameters::default(), Calibration::default())
    }

    /// In effect until the emulator ends, which is as long as its memory lasts.
    pub fn keep(&mut self, _: &Value) -> Result<(), Refusal> {
        Ok(())
    }
}

#[cfg(feature = "ble")]
impl Memory {
    /// The store in the file that is the flash; `None` when it cannot be used.
    #[inline(never)]
    pub fn open() -> Option<Self> {
        block_on(Store::open(Flash::open()?, 0..SIZE as u32)).ok().map(|store| Self { store })
    }

    /// Those that were kept.
    pub fn settings(&mut self) -> (Parameters, Calibration) {
        (self.load(), self.load())
    }

    /// The devices that have paired.
    pub fn bonds(&mut self) -> Bonds {
        self.load()
    }

    #[inline(never)]
    fn load<T: Stored + Default>(&mut self) -> T {
        block_on(self.store.load()).ok().flatten().unwrap_or_default()
    }

    #[inline(never)]
    fn save<T: Stored>(&mut self, value: &T) -> Result<(), Refusal> {
        block_on(self.store.save(value)).map_err(|_| Refusal::Failed)
    }

    /// Keeps settings.
    pub fn keep(&mut self, value: &Value) -> Result<(), Refusal> {
        match value {
            Value::Parameters(parameters) => self.save(parameters),
            Value::Calibration(calibration) => self.save(calibration),
        }
    }

    /// Keeps the devices that have paired.
    pub fn keep_bonds(&mut self, bonds: &Bonds) -> Result<(), Refusal> {
        self.save(bonds)
    }
}
