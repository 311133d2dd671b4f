//! STM32WB55RG as on the Nucleo-WB55RG: Arduino header for the sensor, the probe's serial port for the laptop, D0 and D1
//! with two pins of the morpho header for a Bluetooth module.
//!
//! The second core sleeps. With a wireless stack it would own the upper flash and share the flash interface, the random
//! numbers and the 32 MHz crystal through hardware semaphores, none of which is taken here.

use super::{Board, LAPTOP_BAUD, Sensor, chip_select, spi_config, uart_config};
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::exti::{self, ExtiInput};
use embassy_stm32::flash::{Bank1Region, Blocking};
use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::rcc::{Hse, HseMode, HsePrescaler, Pll, PllMul, PllPreDiv, PllQDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::rng::{self, Rng};
use embassy_stm32::spi::Spi;
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, Uart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, flash, pac, peripherals};
use sohle_shared::wire::message::ResetReason;

/// The name in the hello.
pub const NAME: &str = "STM32WB55";

/// The part of the flash with pages of one size, 4 KiB.
pub type Region = Bank1Region<'static, Blocking>;

bind_interrupts!(struct Irqs {
    DMA1_CHANNEL1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
    DMA1_CHANNEL3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_CHANNEL4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    EXTI9_5 => exti::InterruptHandler<interrupt::typelevel::EXTI9_5>;
    EXTI15_10 => exti::InterruptHandler<interrupt::typelevel::EXTI15_10>;
    USART1 => usart::InterruptHandler<peripherals::USART1>;
    #[cfg(feature = "ble")]
    DMA1_CHANNEL5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    #[cfg(feature = "ble")]
    DMA1_CHANNEL6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    #[cfg(feature = "ble")]
    EXTI4 => exti::InterruptHandler<interrupt::typelevel::EXTI4>;
    #[cfg(feature = "ble")]
    LPUART1 => usart::InterruptHandler<peripherals::LPUART1>;
    RNG => rng::InterruptHandler<peripherals::RNG>;
});

/// 64 MHz from the 32 MHz crystal.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(32_000_000), mode: HseMode::Oscillator, prescaler: HsePrescaler::DIV1 });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV2,
        mul: PllMul::MUL12,
        divp: None,
        divq: Some(PllQDiv::DIV4),
        divr: Some(PllRDiv::DIV3),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config
}

/// Sets the chip up and hands out its parts. Panics when it is called twice.
pub fn start() -> Board {
    let p = embassy_stm32::init(clocks());
    let region = flash::Flash::new_blocking(p.FLASH).into_blocking_regions().bank1_region;
    let uart = Uart::new(p.USART1, p.PB7, p.PB6, p.DMA1_CH3, p.DMA1_CH4, Irqs, uart_config(LAPTOP_BAUD));
    let (tx, rx) = uart.expect("the clock divides to 921600 baud").split();
    let mut random = Rng::new(p.RNG, Irqs);
    let boot = random.next_u32();
    #[cfg(feature = "ble")]
    let radio = {
        let (rts, cts) = (p.PB12, p.PB13);
        let uart = Uart::new_with_rtscts(
            p.LPUART1,
            p.PA3,
            p.PA2,
            rts,
            cts,
            p.DMA1_CH5,
            p.DMA1_CH6,
            Irqs,
            uart_config(super::HCI_BAUD),
        );
        let (tx, rx) = uart.expect("the clock divides to 1000000 baud").split();
        super::Radio { tx, rx, button: ExtiInput::new(p.PC4, p.EXTI4, Pull::Up, Irqs), random }
    };
    Board {
        sensor: Sensor {
            bus: Spi::new(p.SPI1, p.PA5, p.PA7, p.PA6, p.DMA1_CH1, p.DMA1_CH2, Irqs, spi_config()),
            accel: chip_select(p.PA4),
            gyro: chip_select(p.PA9),
            mag: chip_select(p.PC12),
            accel_ready: ExtiInput::new(p.PC6, p.EXTI6, Pull::Down, Irqs),
            gyro_ready: ExtiInput::new(p.PC10, p.EXTI10, Pull::Down, Irqs),
        },
        tx,
        rx,
        #[cfg(feature = "ble")]
        radio,
        flash: BlockingAsync::new(region),
        watchdog: IndependentWatchdog::new(p.IWDG, super::WATCHDOG_US),
        reset: reset_reason(),
        boot,
    }
}

/// Why the processor started. A brown-out sets the same flag as the power coming, and every reset that of the pin.
fn reset_reason() -> ResetReason {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|csr| csr.set_rmvf(true));
    if flags.iwdgrstf() || flags.wwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        ResetReason::Software
    } else if flags.borrstf() {
        ResetReason::PowerOn
    } else if flags.pinrstf() {
        ResetReason::Pin
    } else {
        ResetReason::Unknown
    }
}

/// Whether a non-maskable interrupt was the flash reading a word that a loss of power left half written: such a word
/// has a wrong checksum and is passed over (`sohle_shared::calibration::store`).
pub(crate) fn flash_fault_cleared() -> bool {
    let fault = pac::FLASH.eccr().read().eccd();
    if fault {
        // Writing a one clears it.
        pac::FLASH.eccr().modify(|eccr| eccr.set_eccd(true));
    }
    fault
}

static URGENT: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor of what must not wait: it runs in an interrupt that no peripheral uses here, below the drivers'
/// own and above everything else.
pub fn urgent() -> SendSpawner {
    interrupt::SAI1.set_priority(Priority::P6);
    URGENT.start(interrupt::SAI1)
}

#[embassy_stm32::interrupt]
unsafe fn SAI1() {
    // SAFETY: the handler of the interrupt that `urgent` gave to the executor; it is disabled before that.
    unsafe { URGENT.on_interrupt() }
}

#[cfg(feature = "ble")]
static STEADY: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor of what follows the foot, below [`urgent`] and above Bluetooth.
#[cfg(feature = "ble")]
pub fn steady() -> SendSpawner {
    interrupt::TSC.set_priority(Priority::P7);
    STEADY.start(interrupt::TSC)
}

#[cfg(feature = "ble")]
#[embassy_stm32::interrupt]
unsafe fn TSC() {
    // SAFETY: the handler of the interrupt that `steady` gave to the executor; it is disabled before that.
    unsafe { STEADY.on_interrupt() }
}
