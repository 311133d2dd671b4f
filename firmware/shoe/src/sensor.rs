//! Reading the sensor, above everything else: the program may be late, samples are not lost.

use crate::board::{Bus, Sensor, urgent};
use embassy_embedded_hal::shared_bus::asynch::spi::SpiDevice;
use embassy_stm32::exti::ExtiInput;
use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Async;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::Delay;
use sohle_shared::bmx055::{Bmx055, Config};
use sohle_tasks::{Traffic, sense};

/// Starts to read the sensor. Panics when it is called twice.
pub fn start(sensor: Sensor, config: Config, traffic: &'static Traffic) {
    let Sensor { bus, accel, gyro, mag, accel_ready, gyro_ready } = sensor;
    let task = run(traffic, config, bus, [accel, gyro, mag], [accel_ready, gyro_ready]);
    urgent().spawn(task.expect("one sensor"));
}

#[embassy_executor::task]
async fn run(
    traffic: &'static Traffic,
    config: Config,
    bus: Bus,
    select: [Output<'static>; 3],
    ready: [ExtiInput<'static, Async>; 2],
) {
    let bus = Mutex::<NoopRawMutex, _>::new(bus);
    let [accel, gyro, mag] = select.map(|select| SpiDevice::new(&bus, select));
    let [accel_ready, gyro_ready] = ready;
    sense(traffic, Bmx055::new(accel, gyro, mag, Delay, &config), accel_ready, gyro_ready).await
}
