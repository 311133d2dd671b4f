//! The bus between driver and twin, on which the supply of a die may drop, and which knows how the dies are set up.

use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use sohle_shared::bmx055::Die;
use sohle_shared::bmx055::registers::both;
use sohle_shared::bmx055::twin::{BusFault, Chip, SimulatedBmx055, SimulatedDevice};
use sohle_shared::time::Micros;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// What is true of a die.
#[derive(Default)]
struct DieTruth {
    /// What was written since the last reset.
    written: BTreeMap<u8, u8>,
    /// Times of readings that were taken as the driver wants them. **Units:** microseconds.
    good: BTreeSet<i64>,
    /// When its supply drops.
    drops: Option<Micros>,
    /// Transfers until its supply drops.
    reset_after: Option<u8>,
}

impl DieTruth {
    /// It is so late. **Units:** microseconds.
    fn advance_to(&mut self, time_us: i64) {
        if self.drops.take_if(|time| time.0 < time_us).is_some() {
            self.written.clear();
        }
    }

    /// Written are range, bandwidth and power, and the FIFO is on.
    fn is_set_up(&self) -> bool {
        let is = |register, value| self.written.get(&register) == Some(&value);
        let registers = [both::RANGE, both::BANDWIDTH, both::HIGH_BANDWIDTH];
        registers.iter().all(|register| self.written.contains_key(register))
            && is(both::POWER, 0)
            && is(both::FIFO_CONFIG_1, both::FIFO_STREAM)
    }
}

/// What is true of both dies.
#[derive(Default)]
pub struct Truth([DieTruth; 2]);

impl Truth {
    fn die(&mut self, die: Die) -> &mut DieTruth {
        &mut self.0[usize::from(die == Die::Gyro)]
    }

    /// A reading was taken. **Units:** microseconds.
    pub fn taken(&mut self, die: Die, time_us: i64) {
        let die = self.die(die);
        die.advance_to(time_us);
        if die.is_set_up() {
            die.good.insert(time_us);
        }
    }

    /// Times of the readings that may be handed out. **Units:** microseconds.
    pub fn good(&self, die: Die) -> &BTreeSet<i64> {
        &self.0[usize::from(die == Die::Gyro)].good
    }

    /// The supply of a die drops after so many transfers.
    pub fn reset_after(&mut self, die: Die, transfers: u8) {
        self.die(die).reset_after = Some(transfers);
    }

    /// The supply of a die drops at this time.
    pub fn drop_at(&mut self, die: Die, time: Micros) {
        self.die(die).drops = Some(time);
    }

    /// No supply drops any more.
    pub fn calm(&mut self) {
        self.0.iter_mut().for_each(|die| (die.reset_after, die.drops) = (None, None));
    }
}

/// A chip select.
pub struct Wire<'a, S> {
    pub device: SimulatedDevice<'a, S>,
    pub twin: &'a RefCell<SimulatedBmx055<S>>,
    pub truth: Rc<RefCell<Truth>>,
    pub chip: Chip,
}

impl<S> ErrorType for Wire<'_, S> {
    type Error = BusFault;
}

impl<S: FnMut(Die, u64) -> [i16; 3]> SpiDevice for Wire<'_, S> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusFault> {
        let Chip::Die(die) = self.chip else { return self.device.transaction(operations) };
        let due = {
            let mut truth = self.truth.borrow_mut();
            let after = &mut truth.die(die).reset_after;
            let due = *after == Some(0);
            *after = after.and_then(|after| after.checked_sub(1));
            due
        };
        if due {
            self.twin.borrow_mut().interrupt_supply(die);
            self.truth.borrow_mut().die(die).written.clear();
        }
        let ignored = self.twin.borrow().observed(die).ignored_writes;
        self.device.transaction(operations)?;
        if let [Operation::Write([register, value])] = operations
            && self.twin.borrow().observed(die).ignored_writes == ignored
        {
            let now = self.twin.borrow().now();
            let mut truth = self.truth.borrow_mut();
            truth.die(die).advance_to(now.0);
            let written = &mut truth.die(die).written;
            if *register == both::RESET {
                written.clear();
            } else {
                written.insert(*register, *value);
            }
        }
        Ok(())
    }
}
