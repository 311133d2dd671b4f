//! The self-tests that the dies have built in.

use super::channel::WRITE_US;
use super::driver::Bmx055;
use super::port::{self, Error};
use super::registers::{accel, both, gyro};
use crate::time::Micros;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::SpiDevice;

/// Least difference between the two deflections of x, y, z (BMA255; the value is not confirmed for this package).
/// **Units:** 1e-3 g.
const LEAST_MILLI_G: [i16; 3] = [800, 800, 400];

/// At ±4 g, the range of the test. **Units:** counts for 1 g.
const COUNTS_PER_G: i32 = 512;

/// Time that a deflection takes (BMA255; not confirmed for this package). **Units:** ms.
const DEFLECTION_MS: u32 = 50;

/// How often the gyroscope is asked whether it is done, 10 ms apart (Bosch's driver asks after 10 ms).
const GYRO_TRIES: usize = 5;

/// What the self-tests found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SelfTest {
    /// Of the accelerometer.
    pub accel: Result<AccelTest, Error>,
    /// Of the gyroscope.
    pub gyro: Result<GyroTest, Error>,
}

/// What the self-test of the accelerometer found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelTest {
    /// Difference between the two deflections of each axis. **Units:** 1e-3 g; **Frame:** sensor.
    pub deflection_milli_g: [i16; 3],
}

/// What the self-test of the gyroscope found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GyroTest {
    /// It found no fault in itself.
    pub intact: bool,
    /// Its rate readings are in order.
    pub rate_ok: bool,
}

impl SelfTest {
    /// Whether both dies are in order.
    pub fn passed(&self) -> bool {
        self.accel.is_ok_and(|test| test.passed()) && self.gyro.is_ok_and(|test| test.intact && test.rate_ok)
    }
}

impl AccelTest {
    /// Whether every axis moved far enough.
    pub fn passed(&self) -> bool {
        self.deflection_milli_g.iter().zip(LEAST_MILLI_G).all(|(&moved, least)| moved >= least)
    }
}

impl<ACCEL: SpiDevice, GYRO: SpiDevice, MAG: SpiDevice, DELAY: DelayNs> Bmx055<ACCEL, GYRO, MAG, DELAY> {
    /// Tests both dies, which takes 0.4 s; the sensor should lie still. After it the dies are set up anew; no frames come
    /// in the meantime.
    pub async fn self_test(&mut self, now: Micros) -> SelfTest {
        let accel = test_accel(self.accel.spi(), &mut self.delay).await;
        let gyro = test_gyro(self.gyro.spi(), &mut self.delay).await;
        self.accel.restart(now);
        self.gyro.restart(now);
        SelfTest { accel, gyro }
    }
}

async fn reset<S: SpiDevice>(spi: &mut S, delay: &mut impl DelayNs, boot_us: u32, id: u8) -> Result<(), Error> {
    port::write(spi, both::RESET, both::RESET_COMMAND).await?;
    delay.delay_us(boot_us).await;
    port::identify(spi, both::CHIP_ID, id).await
}

async fn test_accel<S: SpiDevice>(spi: &mut S, delay: &mut impl DelayNs) -> Result<AccelTest, Error> {
    reset(spi, delay, accel::BOOT_US, accel::ID).await?;
    port::write(spi, both::RANGE, 0x05).await?;
    delay.delay_us(WRITE_US).await;
    let mut deflection_milli_g = [0; 3];
    for (axis, place) in deflection_milli_g.iter_mut().enumerate() {
        let mut ends = [0_i32; 2];
        for (end, sign) in ends.iter_mut().zip([0, accel::SELF_TEST_POSITIVE]) {
            port::write(spi, accel::SELF_TEST, accel::SELF_TEST_HIGH | sign | (axis as u8 + 1)).await?;
            delay.delay_ms(DEFLECTION_MS).await;
            let mut bytes = [0; 6];
            port::read(spi, both::DATA, &mut bytes).await?;
            *end = port::words(&bytes).get(axis).map_or(0, |&word| i32::from(word >> 4));
        }
        // Twelve bits: far from the ends of i16 even in 1e-3 g.
        *place = ((ends[1] - ends[0]) * 1_000 / COUNTS_PER_G) as i16;
    }
    Ok(AccelTest { deflection_milli_g })
}

async fn test_gyro<S: SpiDevice>(spi: &mut S, delay: &mut impl DelayNs) -> Result<GyroTest, Error> {
    reset(spi, delay, gyro::BOOT_US, gyro::ID).await?;
    port::write(spi, gyro::SELF_TEST, gyro::SELF_TEST_START).await?;
    for _ in 0..GYRO_TRIES {
        delay.delay_ms(10).await;
        let status = port::read_one(spi, gyro::SELF_TEST).await?;
        if status & gyro::SELF_TEST_READY != 0 {
            let intact = status & gyro::SELF_TEST_FAILED == 0;
            return Ok(GyroTest { intact, rate_ok: status & gyro::SELF_TEST_RATE_OK != 0 });
        }
    }
    Err(Error::NotReady)
}
