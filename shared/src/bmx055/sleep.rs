//! Asleep while nothing moves: the gyroscope off, the accelerometer looking up now and then.
//!
//! The accelerometer tells of motion by its interrupt pin, which stays high until it is woken. A shift so slow that no slope
//! shows it is found by a look once in a second, which also finds a die that has forgotten that it sleeps.
//!
//! Both wake by a reset, as after power on: the gyroscope takes as long to leave its suspend mode as to start, and every
//! register is written and read back. What the die measured last before the sleep and first after it lie apart by a gap
//! ([`Batch::lost`](super::Batch::lost)); the first readings come 32 ms after the motion was noticed.

use super::batch::Die;
use super::channel::{ASLEEP_US, State, WRITE_US};
use super::config::{AccelConfig, GYRO_ASLEEP};
use super::driver::Bmx055;
use super::port::{self, Error};
use super::registers::both;
use crate::time::Micros;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::SpiDevice;

/// From one look to the next. **Units:** microseconds.
const LOOK_US: i64 = 1_000_000;

/// Two readings at 62.5 Hz: by then the filter has forgotten the bandwidth before. **Units:** ms.
const SETTLE_MS: u32 = 16;

/// Twice the longest sleep of 10 ms and a reading of 8 ms: a reading of the sleep is there. **Units:** ms.
const FIRST_MS: u32 = 36;

/// What belongs to the sleep.
#[derive(Debug)]
pub(super) struct Sleep {
    config: AccelConfig,
    /// The reading of the rest. **Units:** counts.
    rest: [i16; 3],
}

impl Sleep {
    pub fn new(config: &AccelConfig) -> Self {
        Self { config: *config, rest: [0; 3] }
    }
}

impl<ACCEL: SpiDevice, GYRO: SpiDevice, MAG: SpiDevice, DELAY: DelayNs> Bmx055<ACCEL, GYRO, MAG, DELAY> {
    /// Puts both dies to sleep, which takes 55 ms; whether they sleep then. Only dies that run are put to sleep, and they run
    /// on or are set up anew if it fails.
    pub async fn sleep(&mut self, now: Micros) -> bool {
        if [Die::Accel, Die::Gyro].iter().any(|&die| self.state(die) != State::Run) {
            return false;
        }
        // Neither is spoken to as one that runs any more, whatever comes of it.
        self.accel.doze(now + LOOK_US);
        self.gyro.doze(Micros(i64::MAX));
        if let Err((die, error)) = self.fall_asleep().await {
            self.count(die, error);
            self.wake(now);
        }
        self.asleep()
    }

    async fn fall_asleep(&mut self) -> Result<(), (Die, Error)> {
        let of_gyro = |error| (Die::Gyro, error);
        let of_accel = |error| (Die::Accel, error);
        self.gyro.set(GYRO_ASLEEP, ASLEEP_US, &mut self.delay).await.map_err(of_gyro)?;
        for setting in self.sleep.config.asleep() {
            let wait_us = if setting.register == both::POWER { ASLEEP_US } else { WRITE_US };
            self.accel.set(setting, wait_us, &mut self.delay).await.map_err(of_accel)?;
            if setting.register == both::BANDWIDTH {
                self.delay.delay_ms(SETTLE_MS).await;
            }
        }
        self.delay.delay_ms(FIRST_MS).await;
        // A supply that dropped in between has taken back what was written before, and nothing would tell of motion.
        for setting in self.accel.settings_after(self.sleep.config.asleep()) {
            self.accel.verify(setting).await.map_err(of_accel)?;
        }
        self.sleep.rest = self.reading().await.map_err(of_accel)?;
        Ok(())
    }

    /// Ends the sleep, as on motion; nothing happens if there is none.
    pub fn wake(&mut self, now: Micros) {
        if self.asleep() {
            self.accel.wake(now);
            self.gyro.wake(now);
        }
    }

    /// Whether the dies sleep: they deliver nothing, and the pin of the accelerometer tells of motion.
    pub fn asleep(&self) -> bool {
        self.state(Die::Accel) == State::Asleep
    }

    /// Looks at the sleeping dies: whoever has moved, or does not sleep as it should, wakes both.
    pub(super) async fn look(&mut self, now: Micros) {
        match self.moved().await {
            Ok(false) => self.accel.doze(now + LOOK_US),
            Ok(true) => self.wake(now),
            Err((die, error)) => {
                self.count(die, error);
                self.wake(now);
            }
        }
    }

    async fn moved(&mut self) -> Result<bool, (Die, Error)> {
        self.gyro.verify(GYRO_ASLEEP).await.map_err(|error| (Die::Gyro, error))?;
        for setting in self.sleep.config.asleep().into_iter().filter(|setting| setting.register == both::POWER) {
            self.accel.verify(setting).await.map_err(|error| (Die::Accel, error))?;
        }
        let now = self.reading().await.map_err(|error| (Die::Accel, error))?;
        let shift = self.sleep.config.shift();
        Ok(now.iter().zip(self.sleep.rest).any(|(&now, rest)| (now - rest).abs() > shift))
    }

    /// What the accelerometer has measured last. **Units:** counts.
    async fn reading(&mut self) -> Result<[i16; 3], Error> {
        let mut bytes = [0; 6];
        port::read(self.accel.spi(), both::DATA, &mut bytes).await?;
        Ok(port::words(&bytes).map(|word| word >> (i16::BITS - AccelConfig::BITS)))
    }

    fn count(&mut self, die: Die, error: Error) {
        match die {
            Die::Accel => self.accel.count(error),
            Die::Gyro => self.gyro.count(error),
        }
    }
}
