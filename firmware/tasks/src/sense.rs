//! Reads the sensor.

use crate::traffic::Traffic;
use crate::{instant, now};
use core::future::pending;
use embassy_futures::select::{Either4, select4};
use embassy_time::Timer;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::digital::Wait;
use embedded_hal_async::spi::SpiDevice;
use sohle_shared::bmx055::{Bmx055, Die, State};
use sohle_shared::time::Micros;

/// A watermark pin is looked at no sooner after the die was read: one that is stuck must not hold everything up.
/// A FIFO fills to its watermark in several times as long. **Units:** microseconds.
const PIN_REST_US: i64 = 1_000;

/// Sets the sensor up, reads both FIFOs when they tell of it, and mends what breaks, for ever.
///
/// The watermark pins are high as long as a FIFO is filled above its mark, so none is missed while the other die is read.
/// When [`process`](crate::process()) wants it, the sensor sleeps: the loop then waits for the pin of the accelerometer, which
/// tells of motion, for the driver's look once in a second, and for who wants it awake.
pub async fn sense<ACCEL, GYRO, MAG, DELAY>(
    traffic: &Traffic,
    mut driver: Bmx055<ACCEL, GYRO, MAG, DELAY>,
    mut accel_pin: impl Wait,
    mut gyro_pin: impl Wait,
) -> !
where
    ACCEL: SpiDevice,
    GYRO: SpiDevice,
    MAG: SpiDevice,
    DELAY: DelayNs,
{
    let mut read = [Micros(0); 2];
    let mut asleep = false;
    loop {
        let running = [Die::Accel, Die::Gyro].map(|die| driver.state(die) == State::Run);
        let accel = marked(&mut accel_pin, running[0] || asleep, read[0]);
        let gyro = marked(&mut gyro_pin, running[1], read[1]);
        let woken = select4(accel, gyro, Timer::at(instant(driver.due())), traffic.rest.wait()).await;
        let time = now();
        let sink = |batch: &_| traffic.offer(batch);
        match woken {
            Either4::First(()) => {
                driver.on_watermark(Die::Accel, time, sink).await;
                read[0] = time;
            }
            Either4::Second(()) => {
                driver.on_watermark(Die::Gyro, time, sink).await;
                read[1] = time;
            }
            Either4::Third(()) => driver.poll(time, sink).await,
            Either4::Fourth(true) => _ = driver.sleep(time).await,
            Either4::Fourth(false) => driver.wake(time),
        }
        if driver.asleep() != asleep {
            asleep = !asleep;
            traffic.tell_sleep((!asleep).then_some(time));
        }
        traffic.tell([*driver.counters(Die::Accel), *driver.counters(Die::Gyro)]);
    }
}

/// Ends when the pin is high, and never while the die does not run.
async fn marked(pin: &mut impl Wait, running: bool, read: Micros) {
    if !running {
        return pending().await;
    }
    Timer::at(instant(read + PIN_REST_US)).await;
    if pin.wait_for_high().await.is_err() {
        // A pin that cannot be waited for: the driver's own times find the data.
        pending().await
    }
}
