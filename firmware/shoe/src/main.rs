//! The program of the shoe: gives the parts of the board to the loops of `sohle-tasks`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::usart::{RingBufferedUartRx, UartRx, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use sohle_shared::bmx055::Config;
use sohle_shared::shoe::Shoe;
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::{Level, Refusal, ResetReason};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::port::Port;
use sohle_shared::wire::transfer::Value;
use sohle_shoe::board::{self, Sensor};
use sohle_shoe::executor::{self, Load};
use sohle_shoe::settings::Settings;
use sohle_shoe::{kept, sensor, stack};
#[cfg(not(feature = "ble"))]
use sohle_tasks::NoAir;
use sohle_tasks::{Board, BoardHealth, Traffic, now, process, send};
use static_cell::{ConstStaticCell, StaticCell};

/// Steps that are kept until the laptop has them: more than a quarter of an hour of walking.
const STEPS: usize = 1_000;

/// Bytes of the laptop that may wait: 11 ms of the line.
const RING: usize = 1_024;

static TRAFFIC: Traffic = Traffic::new();

/// Laptops at a time: one at the serial line, and one by Bluetooth.
const PORTS: usize = if cfg!(feature = "ble") { 2 } else { 1 };

/// 23 kB that are never on the stack.
static OUTBOX: ConstStaticCell<Outbox<STEPS, PORTS>> = ConstStaticCell::new(Outbox::blank());

/// The shoe with its steps elsewhere.
type Wearer = Shoe<STEPS, &'static mut Outbox<STEPS, PORTS>, PORTS>;

/// What the loops need of the board.
struct Machine {
    settings: Settings,
    watchdog: IndependentWatchdog<'static, IWDG>,
    load: Load,
    reset: ResetReason,
}

impl Board for Machine {
    async fn keep(&mut self, value: &Value) -> Result<(), Refusal> {
        self.settings.keep(value)
    }

    #[cfg(feature = "ble")]
    async fn keep_bonds(&mut self, bonds: &sohle_shared::bonds::Bonds) -> Result<(), Refusal> {
        self.settings.keep_bonds(bonds)
    }

    fn health(&mut self) -> BoardHealth {
        BoardHealth { load: self.load.take(), battery: None, stack: stack::used(), reset: self.reset }
    }

    fn alive(&mut self) {
        self.watchdog.pet();
    }
}

#[embassy_executor::task]
async fn processing(shoe: &'static mut Wearer, line: RingBufferedUartRx<'static>, machine: Machine) {
    #[cfg(not(feature = "ble"))]
    let air = &NoAir;
    #[cfg(feature = "ble")]
    let air = &sohle_shoe::radio::RADIO;
    process(&TRAFFIC, shoe, line, air, machine).await
}

#[embassy_executor::task]
async fn sending(line: UartTx<'static, Async>) {
    send(&TRAFFIC, line).await
}

/// What the tasks are made of.
struct Parts {
    sensor: Sensor,
    tx: UartTx<'static, Async>,
    rx: UartRx<'static, Async>,
    #[cfg(feature = "ble")]
    radio: board::Radio,
    machine: Machine,
    boot: u32,
}

// None of these is inlined: what they take of the stack is free again when the tasks run.

/// The board with its settings.
#[inline(never)]
fn begin() -> Parts {
    let board = board::start();
    let board::Board { sensor, tx, rx, flash, watchdog, reset, boot, .. } = board;
    let machine = Machine { settings: Settings::open(flash), watchdog, load: Load::start(), reset };
    Parts {
        sensor,
        tx,
        rx,
        #[cfg(feature = "ble")]
        radio: board.radio,
        machine,
        boot,
    }
}

/// A shoe. The compiler makes it where the caller wants it, and not a second one beside it.
#[inline(never)]
fn make(boot: u32, settings: &mut Settings) -> Wearer {
    let identity = Identity { boot, firmware: env!("CARGO_PKG_VERSION"), board: board::NAME };
    let outbox = OUTBOX.take();
    outbox.begin(Port::Serial, Pace::SERIAL);
    #[cfg(feature = "ble")]
    outbox.begin(Port::Radio, Pace::RADIO);
    Shoe::new(identity, &Config::default(), &settings.parameters(), &settings.calibration(), outbox)
}

/// Starts the tasks.
#[inline(never)]
fn set_off(spawner: Spawner, parts: Parts, shoe: &'static mut Wearer) {
    static BUFFER: StaticCell<[u8; RING]> = StaticCell::new();
    #[cfg(feature = "ble")]
    let radio = parts.radio;
    let Parts { sensor, tx, rx, mut machine, .. } = parts;
    if let Some(words) = kept::take() {
        defmt::error!("before the reset: {=str}", words.as_str());
        shoe.log(now(), Level::Error, &words);
    }
    if machine.settings.refused() {
        shoe.log(now(), Level::Warn, "kept settings cannot be used: defaults are in effect");
    }
    let line = rx.into_ring_buffered(BUFFER.init([0; RING]));
    #[cfg(feature = "ble")]
    sohle_shoe::radio::start(spawner, radio, machine.settings.bonds());
    machine.watchdog.unleash();
    sensor::start(sensor, Config::default(), &TRAFFIC);
    // Bluetooth has the thread for itself, which everything else interrupts.
    #[cfg(feature = "ble")]
    let spawner = board::steady();
    spawner.spawn(sending(tx).expect("one line"));
    spawner.spawn(processing(shoe, line, machine).expect("one shoe"));
}

#[entry]
fn main() -> ! {
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("sohle {=str} on {=str}", env!("CARGO_PKG_VERSION"), board::NAME);
    let mut parts = begin();
    let mut shoe = make(parts.boot, &mut parts.machine.settings);
    let shoe_at = &raw mut shoe;
    // SAFETY: the executor never returns, so this frame and the shoe in it stay for ever, and this is the only reference. In a
    // static it would have to be copied from a stack that is as large again.
    let shoe: &'static mut Wearer = unsafe { &mut *shoe_at };
    executor::run(core.SCB, |spawner| set_off(spawner, parts, shoe))
}
