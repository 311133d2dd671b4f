//! A BMX055 that is none: its registers behave as the data sheet says, its readings come from the caller.
//!
//! For tests of the driver, and for the shoe that runs in an emulator: the same driver reads a recording or a simulated
//! walk through it. Three dies hang on one bus; two of them have clocks of their own. Time passes only when it is told
//! to ([`SimulatedBmx055::advance_to`]), by the bytes on the bus and by [`SimulatedDelay`]; nothing here is random. What
//! can go wrong on a bus is set in [`Faults`].
//!
//! The readings come from a function of die and time, so a recording, a simulator and an iterator are all the same to
//! it. Sources of the rules are at [`registers`](super::registers).

mod address;
mod die;
mod fifo;
mod mag;

pub use die::{Faults, Observed};

use super::batch::Die;
use crate::time::Micros;
use core::cell::RefCell;
use die::DieTwin;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use mag::MagTwin;

/// Time of a byte on the bus at 8 MHz. **Units:** ns.
const BYTE_NS: u64 = 1_000;

/// The twin. `S` gives the counts a die reads at a time: `FnMut(Die, ns since power on) -> x, y, z`, right-justified.
#[derive(Debug)]
pub struct SimulatedBmx055<S> {
    accel: DieTwin,
    gyro: DieTwin,
    mag: MagTwin,
    source: S,
    now_ns: u64,
}

impl<S: FnMut(Die, u64) -> [i16; 3]> SimulatedBmx055<S> {
    /// Powered at time zero. The periods are those of the full rate, 500 000 ns by the data sheet; at a lower rate they
    /// grow as the data sheet's do. **Units:** ns.
    pub fn new(accel_period_ns: u32, gyro_period_ns: u32, source: S) -> Self {
        Self {
            accel: DieTwin::new(Die::Accel, accel_period_ns),
            gyro: DieTwin::new(Die::Gyro, gyro_period_ns),
            mag: MagTwin::default(),
            source,
            now_ns: 0,
        }
    }

    /// Lets time pass; a time that is past changes nothing.
    pub fn advance_to(&mut self, now: Micros) {
        self.advance_to_ns(u64::try_from(now.0).unwrap_or_default().saturating_mul(1_000));
    }

    fn advance_to_ns(&mut self, now_ns: u64) {
        if now_ns > self.now_ns {
            self.now_ns = now_ns;
            self.accel.advance(now_ns, |time_ns| (self.source)(Die::Accel, time_ns));
            self.gyro.advance(now_ns, |time_ns| (self.source)(Die::Gyro, time_ns));
        }
    }

    /// The time it is, rounded up.
    pub fn now(&self) -> Micros {
        micros(self.now_ns)
    }

    fn die(&self, die: Die) -> &DieTwin {
        match die {
            Die::Accel => &self.accel,
            Die::Gyro => &self.gyro,
        }
    }

    fn die_mut(&mut self, die: Die) -> &mut DieTwin {
        match die {
            Die::Accel => &mut self.accel,
            Die::Gyro => &mut self.gyro,
        }
    }

    /// When the watermark interrupt of a die comes next if nobody reads; `None` when none will come.
    pub fn next_interrupt(&self, die: Die) -> Option<Micros> {
        self.die(die).next_edge().map(micros)
    }

    /// When the last watermark interrupt came that was not taken yet, rounded up.
    pub fn take_interrupt(&mut self, die: Die) -> Option<Micros> {
        self.die_mut(die).take_edge().map(micros)
    }

    /// What is wrong with a die; to be changed at will.
    pub fn faults(&mut self, die: Die) -> &mut Faults {
        &mut self.die_mut(die).faults
    }

    /// What happened to a die.
    pub fn observed(&self, die: Die) -> Observed {
        self.die(die).observed
    }

    /// Resets a die as a drop of its supply would.
    pub fn interrupt_supply(&mut self, die: Die) {
        let now_ns = self.now_ns;
        self.die_mut(die).reset(now_ns);
    }

    /// **Units:** 0.5 K from 23 °C.
    pub fn set_temperature(&mut self, temperature: i8) {
        self.accel.temperature = temperature;
    }

    /// What the magnetometer reads: x, y, z, hall resistance. **Units:** least significant bits.
    pub fn set_field(&mut self, field: [i16; 4]) {
        self.mag.field = field;
    }

    /// The identification that the magnetometer gives, and how many of its transfers fail from now on.
    pub fn set_mag_faults(&mut self, chip_id: Option<u8>, transfers: u32) {
        (self.mag.chip_id, self.mag.transfers) = (chip_id, transfers);
    }

    fn select(&mut self, chip: Chip) -> Result<(), BusFault> {
        let transfers = match chip {
            Chip::Die(die) => &mut self.die_mut(die).faults.transfers,
            Chip::Mag => &mut self.mag.transfers,
        };
        if *transfers > 0 {
            *transfers -= 1;
            return Err(BusFault);
        }
        let now_ns = self.now_ns;
        match chip {
            Chip::Die(die) => self.die_mut(die).select(now_ns),
            Chip::Mag => self.mag.select(),
        }
        Ok(())
    }

    fn exchange(&mut self, chip: Chip, sent: u8) -> u8 {
        self.advance_to_ns(self.now_ns.saturating_add(BYTE_NS));
        let now_ns = self.now_ns;
        match chip {
            Chip::Die(die) => self.die_mut(die).exchange(sent, now_ns),
            Chip::Mag => self.mag.exchange(sent, now_ns),
        }
    }

    fn release(&mut self, chip: Chip) {
        let now_ns = self.now_ns;
        if let Chip::Die(die) = chip {
            self.die_mut(die).release(now_ns);
        }
    }
}

/// Rounded up: an interrupt is never seen before it comes.
fn micros(ns: u64) -> Micros {
    Micros(i64::try_from(ns.div_ceil(1_000)).unwrap_or(i64::MAX))
}

/// What a chip select leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// Accelerometer or gyroscope.
    Die(Die),
    /// Magnetometer.
    Mag,
}

/// The transfer that [`Faults::transfers`] made fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusFault;

impl Error for BusFault {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// The bus as one chip select sees it.
#[derive(Debug)]
pub struct SimulatedDevice<'a, S> {
    twin: &'a RefCell<SimulatedBmx055<S>>,
    chip: Chip,
}

impl<'a, S> SimulatedDevice<'a, S> {
    /// The chip select of `chip`.
    pub fn new(twin: &'a RefCell<SimulatedBmx055<S>>, chip: Chip) -> Self {
        Self { twin, chip }
    }
}

impl<S> ErrorType for SimulatedDevice<'_, S> {
    type Error = BusFault;
}

impl<S: FnMut(Die, u64) -> [i16; 3]> SpiDevice for SimulatedDevice<'_, S> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusFault> {
        // Held by somebody else only if the source of readings reaches for the bus.
        let mut twin = self.twin.try_borrow_mut().map_err(|_| BusFault)?;
        twin.select(self.chip)?;
        let chip = self.chip;
        for operation in operations {
            match operation {
                Operation::Read(received) => received.iter_mut().for_each(|byte| *byte = twin.exchange(chip, 0)),
                Operation::Write(sent) => sent.iter().for_each(|&byte| _ = twin.exchange(chip, byte)),
                Operation::TransferInPlace(bytes) => {
                    bytes.iter_mut().for_each(|byte| *byte = twin.exchange(chip, *byte));
                }
                Operation::Transfer(received, sent) => {
                    for index in 0..received.len().max(sent.len()) {
                        let byte = twin.exchange(chip, sent.get(index).copied().unwrap_or_default());
                        if let Some(place) = received.get_mut(index) {
                            *place = byte;
                        }
                    }
                }
                Operation::DelayNs(ns) => {
                    let now_ns = twin.now_ns.saturating_add(u64::from(*ns));
                    twin.advance_to_ns(now_ns);
                }
            }
        }
        twin.release(chip);
        Ok(())
    }
}

/// A delay in the twin's time.
#[derive(Debug)]
pub struct SimulatedDelay<'a, S>(pub &'a RefCell<SimulatedBmx055<S>>);

impl<S: FnMut(Die, u64) -> [i16; 3]> DelayNs for SimulatedDelay<'_, S> {
    fn delay_ns(&mut self, ns: u32) {
        if let Ok(mut twin) = self.0.try_borrow_mut() {
            let now_ns = twin.now_ns.saturating_add(u64::from(ns));
            twin.advance_to_ns(now_ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bmx055::registers::{READ, accel, both, gyro};

    type Source = fn(Die, u64) -> [i16; 3];

    fn still(_: Die, _: u64) -> [i16; 3] {
        [1, -2, 128]
    }

    fn twin() -> RefCell<SimulatedBmx055<Source>> {
        let mut twin = SimulatedBmx055::new(500_000, 500_000, still as Source);
        twin.advance_to(Micros(30_000));
        RefCell::new(twin)
    }

    fn read<const N: usize, S: FnMut(Die, u64) -> [i16; 3]>(
        device: &mut SimulatedDevice<'_, S>,
        register: u8,
    ) -> [u8; N] {
        let mut bytes = [0; N];
        device.transaction(&mut [Operation::Write(&[register | READ]), Operation::Read(&mut bytes)]).unwrap();
        bytes
    }

    #[test]
    fn readings_are_justified_as_in_the_data_sheet() {
        let twin = twin();
        let mut device = SimulatedDevice::new(&twin, Chip::Die(Die::Accel));
        let [low, high, ..] = read::<6, _>(&mut device, both::DATA);
        assert_eq!(i16::from_le_bytes([low, high]) >> 4, 1);
        assert_eq!(low & 1, 1, "new data");
        let [again] = read(&mut device, both::DATA);
        assert_eq!(again & 1, 0, "read before");
        twin.borrow_mut().advance_to(Micros(40_000));
        let mut device = SimulatedDevice::new(&twin, Chip::Die(Die::Gyro));
        assert_eq!(read(&mut device, both::DATA), [1, 0, 0xFE, 0xFF, 128, 0]);
    }

    #[test]
    fn it_is_deaf_during_a_reset_and_has_its_reset_values_after() {
        let twin = twin();
        let mut device = SimulatedDevice::new(&twin, Chip::Die(Die::Gyro));
        device.write(&[both::RANGE, 3]).unwrap();
        assert_eq!(read(&mut device, both::RANGE), [3]);
        SimulatedDelay(&twin).delay_us(2);
        device.write(&[both::RESET, both::RESET_COMMAND]).unwrap();
        assert_eq!(read(&mut device, both::CHIP_ID), [0]);
        device.write(&[both::RANGE, 2]).unwrap();
        SimulatedDelay(&twin).delay_us(gyro::BOOT_US);
        assert_eq!(read(&mut device, both::CHIP_ID), [gyro::ID]);
        assert_eq!((read(&mut device, both::RANGE), read(&mut device, both::BANDWIDTH)), ([0], [0x80]));
        assert_eq!(twin.borrow().observed(Die::Gyro).ignored_writes, 1);
    }

    #[test]
    fn a_write_too_soon_after_another_has_no_effect() {
        let twin = twin();
        let mut device = SimulatedDevice::new(&twin, Chip::Die(Die::Accel));
        let mut write_both = |wait_us| {
            device.write(&[both::RANGE, 5]).unwrap();
            SimulatedDelay(&twin).delay_us(wait_us);
            device.write(&[accel::FIFO_WATERMARK, 9]).unwrap();
            SimulatedDelay(&twin).delay_us(500);
            let read_back = read(&mut device, accel::FIFO_WATERMARK);
            device.write(&[accel::FIFO_WATERMARK, 0]).unwrap();
            SimulatedDelay(&twin).delay_us(500);
            read_back
        };
        assert_eq!((write_both(1), write_both(2)), ([0], [9]));
        assert_eq!(twin.borrow().observed(Die::Accel).ignored_writes, 1);
    }

    #[test]
    fn the_interrupt_comes_when_it_was_foretold() {
        let twin = twin();
        let mut device = SimulatedDevice::new(&twin, Chip::Die(Die::Accel));
        for [register, value] in [
            [accel::INT_OUT, accel::INT_OUT_INT1_HIGH],
            [accel::INT_MAP_1, accel::INT_MAP_1_WATERMARK],
            [accel::INT_EN_1, accel::INT_EN_1_WATERMARK],
            [accel::FIFO_WATERMARK, 4],
            [both::FIFO_CONFIG_1, both::FIFO_STREAM],
        ] {
            device.write(&[register, value]).unwrap();
            SimulatedDelay(&twin).delay_us(2);
        }
        let mut twin = twin.borrow_mut();
        let foretold = twin.next_interrupt(Die::Accel).unwrap();
        twin.advance_to(foretold + -1);
        assert_eq!(twin.take_interrupt(Die::Accel), None);
        twin.advance_to(foretold + 10_000);
        assert_eq!(twin.take_interrupt(Die::Accel), Some(foretold));
        assert_eq!(twin.next_interrupt(Die::Accel), None, "the line stays high until somebody reads");
    }
}
