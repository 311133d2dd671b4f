//! Parameters and calibration of this shoe, from and to its flash.

use crate::board::{self, Flash};
use core::fmt;
use embassy_futures::block_on;
#[cfg(feature = "ble")]
use sohle_shared::bonds::Bonds;
use sohle_shared::calibration::Calibration;
use sohle_shared::calibration::store::{Error, Store, Stored};
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::message::Refusal;
use sohle_shared::wire::transfer::Value;

/// The store of this shoe.
///
/// This flash does not wait, it blocks; so nothing here is async, and the records (a kilobyte each) are on the stack for a
/// moment instead of in a task for ever. For the same reason they are not inlined into the task's own frame.
///
/// While a page is erased the processor stands still and so do interrupts: 22 ms on the STM32WB55, up to 0.8 s on the
/// STM32F405 (data sheets, typical and largest). The sensor's FIFOs run over and the line loses bytes; both are noticed and
/// mended, but a step in progress is not measured. Settings are therefore to be written while the shoe stands.
pub struct Settings {
    store: Option<Store<Flash>>,
    refused: bool,
}

impl Settings {
    /// Looks for what was kept. A flash that cannot be used leaves the defaults, and keeps nothing.
    #[inline(never)]
    pub fn open(flash: Flash) -> Self {
        let store = block_on(Store::open(flash, board::store()));
        let store = store.inspect_err(|error| tell("the store does not open", error)).ok();
        Self { refused: store.is_none(), store }
    }

    /// Whether something that may have been kept could not be used, so that a default is in effect.
    pub fn refused(&self) -> bool {
        self.refused
    }

    /// Parameters in effect. Those of a method that this program does not have are not used.
    pub fn parameters(&mut self) -> Parameters {
        let mut parameters: Parameters = self.load();
        if !parameters.method.available() {
            defmt::warn!("the stored parameters are for a method that this firmware does not have");
            self.refused = true;
            parameters = Parameters::default();
        }
        parameters
    }

    /// Calibration in effect.
    pub fn calibration(&mut self) -> Calibration {
        self.load()
    }

    /// The devices that have paired.
    #[cfg(feature = "ble")]
    pub fn bonds(&mut self) -> Bonds {
        self.load()
    }

    /// Keeps them.
    #[cfg(feature = "ble")]
    #[inline(never)]
    pub fn keep_bonds(&mut self, bonds: &Bonds) -> Result<(), Refusal> {
        let store = self.store.as_mut().ok_or(Refusal::Failed)?;
        let result = block_on(store.save(bonds));
        result.inspect_err(|error| tell("a pairing is not stored", error)).map_err(|_| Refusal::Failed)
    }

    #[inline(never)]
    fn load<T: Stored + Default>(&mut self) -> T {
        let Some(store) = &mut self.store else { return T::default() };
        let value = block_on(store.load()).inspect_err(|error| tell("a stored value is not used", error));
        self.refused |= value.is_err();
        value.ok().flatten().unwrap_or_default()
    }

    /// Keeps a value; until that is done the one before is kept.
    #[inline(never)]
    pub fn keep(&mut self, value: &Value) -> Result<(), Refusal> {
        let store = self.store.as_mut().ok_or(Refusal::Failed)?;
        let result = match value {
            Value::Parameters(parameters) => block_on(store.save(parameters)),
            Value::Calibration(calibration) => block_on(store.save(calibration)),
        };
        result.inspect_err(|error| tell("a value is not stored", error)).map_err(|_| Refusal::Failed)
    }
}

fn tell<E: fmt::Debug>(what: &str, error: &Error<E>) {
    defmt::warn!("{=str}: {}", what, defmt::Display2Format(error));
}
