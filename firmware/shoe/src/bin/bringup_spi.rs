//! First light: asks the three dies of the sensor who they are, once a second, without interrupts or FIFOs.
//!
//! `cargo xtask flash --board B --bin bringup_spi`. What it prints when all is well is in `docs/bring-up.md`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_stm32::gpio::Output;
use embassy_time::{Duration, Ticker, Timer};
use sohle_shoe::board::{self, Bus, Sensor};
use sohle_shoe::executor;

/// Bit 7 of the address: the register is read.
const READ: u8 = 0x80;

/// A die as it answers on the bus.
struct Die {
    name: &'static str,
    select: Output<'static>,
    /// Register of the chip id.
    register: u8,
    id: u8,
}

impl Die {
    async fn transfer(&mut self, bus: &mut Bus, bytes: [u8; 2]) -> Option<u8> {
        let mut answer = [0; 2];
        self.select.set_low();
        let result = bus.transfer(&mut answer, &bytes).await;
        self.select.set_high();
        result.ok().map(|()| answer[1])
    }

    /// Asks for the chip id. Whether it is the right one.
    async fn ask(&mut self, bus: &mut Bus) -> bool {
        let id = self.transfer(bus, [self.register | READ, 0]).await;
        let right = id == Some(self.id);
        match id {
            Some(_) if right => defmt::info!("{=str}: chip id {=u8:#04x}, as it must be", self.name, self.id),
            Some(id @ (0x00 | 0xff)) => {
                defmt::error!("{=str}: read {=u8:#04x}: nobody answers; check MISO, CSB, PS and power", self.name, id)
            }
            Some(id) => defmt::error!("{=str}: chip id {=u8:#04x}, must be {=u8:#04x}", self.name, id, self.id),
            None => defmt::error!("{=str}: the transfer failed", self.name),
        }
        right
    }
}

#[embassy_executor::task]
async fn ask(sensor: Sensor) {
    let mut bus = sensor.bus;
    let mut accel = Die { name: "accelerometer", select: sensor.accel, register: 0x00, id: 0xfa };
    let mut gyro = Die { name: "gyroscope", select: sensor.gyro, register: 0x00, id: 0x0f };
    let mut mag = Die { name: "magnetometer", select: sensor.mag, register: 0x40, id: 0x32 };
    // The magnetometer is suspended after power-on; bit 0 of its register 0x4B wakes it, which takes 3 ms.
    let _ = mag.transfer(&mut bus, [0x4b, 0x01]).await;
    Timer::after_millis(5).await;
    let mut second = Ticker::every(Duration::from_secs(1));
    loop {
        let mut right = 0;
        for die in [&mut accel, &mut gyro, &mut mag] {
            right += u8::from(die.ask(&mut bus).await);
        }
        defmt::info!("{=u8} of 3 dies answer", right);
        second.next().await;
    }
}

#[entry]
fn main() -> ! {
    let board = board::start();
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("bringup_spi on {=str}", board::NAME);
    executor::run(core.SCB, |spawner: Spawner| spawner.spawn(ask(board.sensor).expect("one task")))
}
