//! The boards: all that depends on the chip and on how it is wired. The table of the wires is in `docs/bring-up.md`.

#[cfg(feature = "board-f405")]
mod f405;
#[cfg(feature = "board-wb55")]
mod wb55;

#[cfg(feature = "board-f405")]
pub use f405::*;
#[cfg(feature = "board-wb55")]
pub use wb55::*;

use core::ops::Range;
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_stm32::exti::ExtiInput;
use embassy_stm32::flash::FLASH_BASE;
use embassy_stm32::gpio::{Level, Output, Pin, Pull, Speed};
use embassy_stm32::mode::Async;
#[cfg(feature = "ble")]
use embassy_stm32::rng::Rng;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, UartRx, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, peripherals};
use sohle_shared::wire::message::ResetReason;

/// The bus of the sensor's three dies.
pub type Bus = Spi<'static, Async, spi::mode::Master>;

/// The flash that holds calibration and settings, at [`store`].
pub type Flash = BlockingAsync<Region>;

/// The sensor: a bus, a chip select and, but for the magnetometer, an interrupt line for each die.
pub struct Sensor {
    /// SPI mode 3, at most 8 MHz, by DMA.
    pub bus: Bus,
    /// CSB1.
    pub accel: Output<'static>,
    /// CSB2.
    pub gyro: Output<'static>,
    /// CSB3.
    pub mag: Output<'static>,
    /// INT1, high while the accelerometer's FIFO is at its watermark.
    pub accel_ready: ExtiInput<'static, Async>,
    /// INT3, high while the gyroscope's FIFO is at its watermark.
    pub gyro_ready: ExtiInput<'static, Async>,
}

/// What Bluetooth needs.
#[cfg(feature = "ble")]
pub struct Radio {
    /// To the module, by DMA, as long as it takes bytes (CTS).
    pub tx: UartTx<'static, Async>,
    /// From the module, by DMA.
    pub rx: UartRx<'static, Async>,
    /// Low while it is pressed.
    pub button: ExtiInput<'static, Async>,
    /// Keys are made of it.
    pub random: Rng<'static, peripherals::RNG>,
}

/// Everything the firmware uses, once.
pub struct Board {
    /// The sensor.
    pub sensor: Sensor,
    /// To the laptop, by DMA.
    pub tx: UartTx<'static, Async>,
    /// From the laptop, by DMA.
    pub rx: UartRx<'static, Async>,
    /// Bluetooth.
    #[cfg(feature = "ble")]
    pub radio: Radio,
    /// Where calibration and settings are kept.
    pub flash: Flash,
    /// Not running yet. Its clock is off by up to a tenth.
    pub watchdog: IndependentWatchdog<'static, peripherals::IWDG>,
    /// Why the processor started.
    pub reset: ResetReason,
    /// A random number: tells this boot from others.
    pub boot: u32,
}

unsafe extern "C" {
    /// First byte of the store, from the memory map.
    static _store_start: u8;
    /// First byte after the store, from the memory map.
    static _store_end: u8;
}

/// Where the store is, from the start of the flash. **Units:** bytes.
pub fn store() -> Range<u32> {
    let offset = |address: usize| (address - FLASH_BASE) as u32;
    offset((&raw const _store_start).addr())..offset((&raw const _store_end).addr())
}

/// Of the line to the laptop.
const LAPTOP_BAUD: u32 = 921_600;
/// Of the line to the Bluetooth module: what Zephyr's controller firmware has when nobody changes it.
#[cfg(feature = "ble")]
const HCI_BAUD: u32 = 1_000_000;

/// How long the watchdog waits. **Units:** microseconds.
const WATCHDOG_US: u32 = 4_000_000;

fn chip_select(pin: Peri<'static, impl Pin>) -> Output<'static> {
    Output::new(pin, Level::High, Speed::VeryHigh)
}

fn spi_config() -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    // The sensor takes 10 MHz; the divider is a power of two, so the F405 clocks 5.25 MHz and the WB55 8 MHz.
    config.frequency = Hertz(8_000_000);
    config
}

/// 8N1.
fn uart_config(baud: u32) -> usart::Config {
    let mut config = usart::Config::default();
    config.baudrate = baud;
    // A line that is not connected is silent.
    config.rx_pull = Pull::Up;
    config
}
