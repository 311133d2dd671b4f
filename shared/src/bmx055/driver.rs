//! The driver: three dies over three chip selects, on any bus and in any time.
//!
//! It has no clock, no task and no pin. Who owns the interrupt pins stamps their edges and calls
//! [`Bmx055::on_watermark`]; whenever [`Bmx055::due`] has come he calls [`Bmx055::poll`], which resets, waits, sets up,
//! checks, and empties a FIFO whose interrupt did not come. Both hand out [`Batch`]es; what goes wrong is counted
//! ([`DieCounters`]) and mended: ten failures in a row, or a register that does not hold its value, and the die is set up
//! anew while the other goes on.
//!
//! The order RESET, WAIT, CONFIGURE, READ with registers checked in turn is that of the sensor drivers of PX4.
//!
//! A frame is read out of the FIFO as soon as the interrupt has come, and as many frames as the watermark has: so the
//! stamp of the interrupt belongs to the last frame of the batch, however late the read. Never is the data register
//! read, nor the FIFO in bypass mode, nor beyond what it holds.

use super::batch::{Batch, Die, DieCounters};
use super::channel::{Channel, State};
use super::config::Config;
use super::port::{self, Error};
use super::registers::{accel, mag};
use super::sleep::Sleep;
use crate::time::Micros;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::SpiDevice;

/// From one reading of the temperature to the next. **Units:** microseconds.
const TEMPERATURE_US: i64 = 1_000_000;

/// How often the magnetometer is asked for its reading, 1 ms apart; with the fewest repetitions it takes 1.6 ms.
const MAG_TRIES: usize = 10;

/// The sensor.
#[derive(Debug)]
pub struct Bmx055<ACCEL, GYRO, MAG, DELAY> {
    pub(super) accel: Channel<ACCEL>,
    pub(super) gyro: Channel<GYRO>,
    mag: MAG,
    pub(super) delay: DELAY,
    pub(super) sleep: Sleep,
    temperature: Option<i8>,
    /// When the temperature is read next.
    temperature_due: Micros,
}

/// What the magnetometer reads, without Bosch's compensation: its formula is published as code only, and indoors the
/// field is of no use. **Units:** least significant bits; **Frame:** sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MagCounts {
    /// x, y (13 bits), z (15 bits).
    pub field: [i16; 3],
    /// Resistance of the hall element, which the compensation needs.
    pub hall: u16,
}

impl<ACCEL: SpiDevice, GYRO: SpiDevice, MAG: SpiDevice, DELAY: DelayNs> Bmx055<ACCEL, GYRO, MAG, DELAY> {
    /// Three chip selects, and a delay that is used for times below 50 ms. Nothing is sent before the first
    /// [`Bmx055::poll`].
    pub fn new(accel: ACCEL, gyro: GYRO, mag: MAG, delay: DELAY, config: &Config) -> Self {
        Self {
            accel: Channel::accel(accel, &config.accel),
            gyro: Channel::gyro(gyro, &config.gyro),
            mag,
            delay,
            sleep: Sleep::new(&config.accel),
            temperature: None,
            temperature_due: Micros(i64::MIN),
        }
    }

    /// When [`Bmx055::poll`] must be called next; a time that is past means at once.
    pub fn due(&self) -> Micros {
        let due = self.accel.due().min(self.gyro.due());
        if self.accel.state() == State::Run { due.min(self.temperature_due) } else { due }
    }

    /// Does what is due at `now`. Frames of a FIFO whose interrupt did not come go to `sink`.
    pub async fn poll(&mut self, now: Micros, mut sink: impl FnMut(&Batch)) {
        if self.asleep() && now >= self.accel.due() {
            return self.look(now).await;
        }
        self.accel.poll(now, self.temperature, &mut self.delay, &mut sink).await;
        self.gyro.poll(now, self.temperature, &mut self.delay, &mut sink).await;
        if self.accel.state() == State::Run && now >= self.temperature_due {
            self.temperature_due = now + TEMPERATURE_US;
            match self.accel.look_up(accel::TEMPERATURE, now).await {
                Ok(read) => self.temperature = read.map(|byte| byte as i8).or(self.temperature),
                Err(error) => self.accel.count(error),
            }
        }
    }

    /// The interrupt of a die came at `stamp`. It tells of the watermark: the frames go to `sink`, a batch for each watermark;
    /// or, asleep, of motion: the dies wake.
    pub async fn on_watermark(&mut self, die: Die, stamp: Micros, mut sink: impl FnMut(&Batch)) {
        match die {
            Die::Accel if self.asleep() => self.wake(stamp),
            Die::Accel => self.accel.on_watermark(stamp, self.temperature, &mut sink).await,
            Die::Gyro => self.gyro.on_watermark(stamp, self.temperature, &mut sink).await,
        }
    }

    /// What a die is doing.
    pub fn state(&self, die: Die) -> State {
        match die {
            Die::Accel => self.accel.state(),
            Die::Gyro => self.gyro.state(),
        }
    }

    /// What happened to a die since the boot.
    pub fn counters(&self, die: Die) -> &DieCounters {
        match die {
            Die::Accel => self.accel.counters(),
            Die::Gyro => self.gyro.counters(),
        }
    }

    /// Wakes the magnetometer for one reading.
    ///
    /// # Errors
    /// When a transfer fails, when it is another chip, or when no reading comes within 10 ms.
    pub async fn magnetometer(&mut self) -> Result<MagCounts, Error> {
        let reading = self.read_magnetometer().await;
        port::write(&mut self.mag, mag::POWER, 0).await?;
        reading
    }

    async fn read_magnetometer(&mut self) -> Result<MagCounts, Error> {
        port::write(&mut self.mag, mag::POWER, mag::POWER_ON).await?;
        self.delay.delay_us(mag::BOOT_US).await;
        port::identify(&mut self.mag, mag::CHIP_ID, mag::ID).await?;
        port::write(&mut self.mag, mag::MODE, mag::MODE_FORCED).await?;
        for _ in 0..MAG_TRIES {
            self.delay.delay_ms(1).await;
            let mut bytes = [0; 8];
            port::read(&mut self.mag, mag::DATA, &mut bytes).await?;
            let [x, y, z] = port::words(&bytes);
            let [.., low, high] = bytes;
            if low & mag::READY != 0 {
                let hall = u16::from_le_bytes([low, high]) >> 2;
                return Ok(MagCounts { field: [x >> 3, y >> 3, z >> 1], hall });
            }
        }
        Err(Error::NotReady)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bmx055::blocking::block_on;
    use crate::bmx055::registers::READ;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::spi::{Mock, Transaction};
    use std::vec::Vec;

    fn reads(register: u8, bytes: &[u8]) -> Vec<Transaction<u8>> {
        Vec::from([
            Transaction::transaction_start(),
            Transaction::write_vec(Vec::from([register | READ])),
            Transaction::read_vec(bytes.to_vec()),
            Transaction::transaction_end(),
        ])
    }

    fn writes(register: u8, value: u8) -> Vec<Transaction<u8>> {
        Vec::from([
            Transaction::transaction_start(),
            Transaction::write_vec(Vec::from([register, value])),
            Transaction::transaction_end(),
        ])
    }

    /// Reset, identification, ten registers written and read back, and all of them read again.
    fn cold_start(id: u8, settings: [[u8; 3]; 10]) -> Vec<Transaction<u8>> {
        let mut transactions = writes(0x14, 0xB6);
        transactions.extend(reads(0x00, &[id]));
        for [register, value, read] in settings {
            transactions.extend(writes(register, value));
            transactions.extend(reads(register, &[read]));
        }
        for [register, _, read] in settings {
            transactions.extend(reads(register, &[read]));
        }
        transactions
    }

    #[test]
    fn sends_exactly_this() {
        // Numbers, not names: as in the data sheet. The third column is what the die answers with its fixed bits.
        let mut accel = cold_start(
            0xFA,
            [
                [0x11, 0x00, 0x00],
                [0x0F, 0x0C, 0x0C],
                [0x10, 0x0F, 0x0F],
                [0x13, 0x80, 0x80],
                [0x32, 0x00, 0x70],
                [0x20, 0x01, 0x01],
                [0x1A, 0x02, 0x02],
                [0x30, 0x02, 0x02],
                [0x17, 0x40, 0x40],
                [0x3E, 0x80, 0x80],
            ],
        );
        accel.extend(reads(0x08, &[0xFE]));
        // Its interrupt is on: it was not reset.
        accel.extend(reads(0x17, &[0x40]));
        accel.extend(reads(0x0E, &[0x02]));
        accel.extend(reads(0x3F, &[0x11, 0x00, 0xEF, 0xFF, 0x0F, 0x80, 0xFF, 0x7F, 0x00, 0x00, 0x1E, 0x00]));
        accel.extend(reads(0x17, &[0x40]));
        // It has not run over meanwhile.
        accel.extend(reads(0x0E, &[0x00]));
        // None is left, but the line may have stayed high.
        accel.extend(reads(0x0E, &[0x00]));
        let gyro = cold_start(
            0x0F,
            [
                [0x11, 0x00, 0x00],
                [0x0F, 0x00, 0x00],
                [0x10, 0x00, 0x80],
                [0x13, 0x00, 0x00],
                [0x16, 0x01, 0x01],
                [0x18, 0x04, 0x04],
                [0x1E, 0x88, 0x88],
                [0x3D, 0x10, 0x10],
                [0x15, 0x40, 0x40],
                [0x3E, 0x80, 0x80],
            ],
        );
        let (mut accel, mut gyro, mut mag) = (Mock::new(&accel), Mock::new(&gyro), Mock::new(&[]));
        let mut config = Config::default();
        config.accel.watermark = 2;
        let mut driver = Bmx055::new(accel.clone(), gyro.clone(), mag.clone(), NoopDelay::new(), &config);
        let mut batches = Vec::new();
        for (now, states) in [
            (0, [State::Wait, State::Wait]),
            (2_999, [State::Wait, State::Wait]),
            (31_199, [State::Configure, State::Wait]),
            (31_200, [State::Run, State::Configure]),
            (31_201, [State::Run, State::Run]),
        ] {
            block_on(driver.poll(Micros(now), |_| panic!("nothing was read")));
            assert_eq!([driver.state(Die::Accel), driver.state(Die::Gyro)], states, "{now}");
        }
        block_on(driver.on_watermark(Die::Accel, Micros(32_300), |batch| batches.push(batch.clone())));
        let batch = &batches[0];
        assert_eq!((batch.stamp, batch.sequence, batch.lost), (Micros(32_300), 0, false));
        assert_eq!(batch.temperature, Some(-2));
        assert_eq!(batch.frames.as_slice(), [[1, -2, -2048], [2047, 0, 1]]);
        for mock in [&mut accel, &mut gyro, &mut mag] {
            mock.done();
        }
    }
}
