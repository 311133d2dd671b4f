//! STM32F405RG as on the Adafruit Feather STM32F405 Express: pins A0 to A5, D5 and D6 for the sensor, TX and RX for the
//! laptop.
//!
//! With Bluetooth, TX and RX are the module's, with RTS and CTS at MI and SCK, and the laptop is at SCL and SDA.
//!
//! The feather's own SPI pins (SPI2) cannot be used: their DMA streams are the only ones of the serial port at TX and RX.

use super::{Board, LAPTOP_BAUD, Sensor, chip_select, spi_config, uart_config};
use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::exti::{self, ExtiInput};
use embassy_stm32::flash::{Bank1Region1, Blocking};
use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::rcc::{APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk};
use embassy_stm32::rng::{self, Rng};
use embassy_stm32::spi::Spi;
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, Uart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, flash, pac, peripherals};
use sohle_shared::wire::message::ResetReason;

/// The name in the hello.
pub const NAME: &str = "STM32F405";

/// The first four sectors, of 16 KiB each.
pub type Region = Bank1Region1<'static, Blocking>;

bind_interrupts!(struct Irqs {
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    EXTI9_5 => exti::InterruptHandler<interrupt::typelevel::EXTI9_5>;
    USART3 => usart::InterruptHandler<peripherals::USART3>;
    #[cfg(feature = "ble")]
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    #[cfg(feature = "ble")]
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
    #[cfg(feature = "ble")]
    USART1 => usart::InterruptHandler<peripherals::USART1>;
    RNG => rng::InterruptHandler<peripherals::RNG>;
});

/// 168 MHz from the 12 MHz crystal; 48 MHz for the random numbers.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(12_000_000), mode: HseMode::Oscillator });
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV12,
        mul: PllMul::MUL336,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    // Limits of the chip: 42 and 84 MHz.
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

/// Sets the chip up and hands out its parts. Panics when it is called twice.
pub fn start() -> Board {
    let p = embassy_stm32::init(clocks());
    let region = flash::Flash::new_blocking(p.FLASH).into_blocking_regions().bank1_region1;
    let mut random = Rng::new(p.RNG, Irqs);
    let boot = random.next_u32();
    #[cfg(not(feature = "ble"))]
    let uart = Uart::new(p.USART3, p.PB11, p.PB10, p.DMA1_CH3, p.DMA1_CH1, Irqs, uart_config(LAPTOP_BAUD));
    // The only serial port of the header with RTS and CTS is for the module.
    #[cfg(feature = "ble")]
    let uart = Uart::new(p.USART1, p.PB7, p.PB6, p.DMA2_CH7, p.DMA2_CH2, Irqs, uart_config(LAPTOP_BAUD));
    let (tx, rx) = uart.expect("the clock divides to 921600 baud").split();
    #[cfg(feature = "ble")]
    let radio = {
        let (rts, cts) = (p.PB14, p.PB13);
        let uart = Uart::new_with_rtscts(
            p.USART3,
            p.PB11,
            p.PB10,
            rts,
            cts,
            p.DMA1_CH3,
            p.DMA1_CH1,
            Irqs,
            uart_config(super::HCI_BAUD),
        );
        let (tx, rx) = uart.expect("the clock divides to 1000000 baud").split();
        super::Radio { tx, rx, button: ExtiInput::new(p.PB8, p.EXTI8, Pull::Up, Irqs), random }
    };
    Board {
        sensor: Sensor {
            bus: Spi::new(p.SPI1, p.PA5, p.PA7, p.PA6, p.DMA2_CH3, p.DMA2_CH0, Irqs, spi_config()),
            accel: chip_select(p.PA4),
            gyro: chip_select(p.PC4),
            mag: chip_select(p.PC5),
            accel_ready: ExtiInput::new(p.PC6, p.EXTI6, Pull::Down, Irqs),
            gyro_ready: ExtiInput::new(p.PC7, p.EXTI7, Pull::Down, Irqs),
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

/// Why the processor started. Every reset sets the flag of the pin, and the power coming that of the brown-out.
fn reset_reason() -> ResetReason {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|csr| csr.set_rmvf(true));
    if flags.wdgrstf() || flags.wwdgrstf() {
        ResetReason::Watchdog
    } else if flags.sftrstf() {
        ResetReason::Software
    } else if flags.porrstf() {
        ResetReason::PowerOn
    } else if flags.borrstf() {
        ResetReason::BrownOut
    } else if flags.padrstf() {
        ResetReason::Pin
    } else {
        ResetReason::Unknown
    }
}

/// Whether a non-maskable interrupt was a fault of the flash that is of no consequence: this flash has no error
/// correction that could raise one.
pub(crate) fn flash_fault_cleared() -> bool {
    false
}

static URGENT: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor of what must not wait: it runs in an interrupt that no peripheral uses here, below the drivers'
/// own and above everything else.
pub fn urgent() -> SendSpawner {
    interrupt::CAN2_SCE.set_priority(Priority::P6);
    URGENT.start(interrupt::CAN2_SCE)
}

#[embassy_stm32::interrupt]
unsafe fn CAN2_SCE() {
    // SAFETY: the handler of the interrupt that `urgent` gave to the executor; it is disabled before that.
    unsafe { URGENT.on_interrupt() }
}

#[cfg(feature = "ble")]
static STEADY: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor of what follows the foot, below [`urgent`] and above Bluetooth.
#[cfg(feature = "ble")]
pub fn steady() -> SendSpawner {
    interrupt::CAN2_RX0.set_priority(Priority::P7);
    STEADY.start(interrupt::CAN2_RX0)
}

#[cfg(feature = "ble")]
#[embassy_stm32::interrupt]
unsafe fn CAN2_RX0() {
    // SAFETY: the handler of the interrupt that `steady` gave to the executor; it is disabled before that.
    unsafe { STEADY.on_interrupt() }
}
