//! The program of the shoe: gives the parts of the board to the loops of `sohle-tasks`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::usart::{RingBufferedUartRx, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use sohle_shared::bmx055::Config;
use sohle_shared::calibration::Calibration;
use sohle_shared::shoe::Shoe;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::{Level, Refusal, ResetReason};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::transfer::Value;
use sohle_shoe::executor::{self, Load};
use sohle_shoe::settings::Settings;
use sohle_shoe::{board, kept, sensor, stack};
use sohle_tasks::{Board, BoardHealth, Traffic, now, process, send};
use static_cell::{ConstStaticCell, StaticCell};

/// Steps that are kept until the laptop has them: more than a quarter of an hour of walking.
const STEPS: usize = 1_000;

/// Bytes of the laptop that may wait: 11 ms of the line.
const RING: usize = 1_024;

static TRAFFIC: Traffic = Traffic::new();

/// 40 kB that are never on the stack.
static OUTBOX: ConstStaticCell<Outbox<STEPS>> = ConstStaticCell::new(Outbox::blank());

/// The shoe with its steps elsewhere.
type Wearer = Shoe<STEPS, &'static mut Outbox<STEPS>>;

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

    fn health(&mut self) -> BoardHealth {
        BoardHealth { load: self.load.take(), battery: None, stack: stack::used(), reset: self.reset }
    }

    fn alive(&mut self) {
        self.watchdog.pet();
    }
}

#[embassy_executor::task]
async fn processing(shoe: &'static mut Wearer, line: RingBufferedUartRx<'static>, machine: Machine) {
    process(&TRAFFIC, shoe, line, machine).await
}

#[embassy_executor::task]
async fn sending(line: UartTx<'static, Async>) {
    send(&TRAFFIC, line).await
}

/// A shoe. Not inlined: like this the compiler makes it where the caller wants it, and not a second one beside it.
#[inline(never)]
fn make(identity: Identity, config: &Config, parameters: &Parameters, calibration: &Calibration) -> Wearer {
    let outbox = OUTBOX.take();
    outbox.begin(Pace::SERIAL);
    Shoe::new(identity, config, parameters, calibration, outbox)
}

#[entry]
fn main() -> ! {
    static BUFFER: StaticCell<[u8; RING]> = StaticCell::new();
    let words = kept::take();
    let board = board::start();
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("sohle {=str} on {=str}", env!("CARGO_PKG_VERSION"), board::NAME);

    let mut settings = Settings::open(board.flash);
    let (config, parameters, calibration) = (Config::default(), settings.parameters(), settings.calibration());
    let identity = Identity { boot: board.boot, firmware: env!("CARGO_PKG_VERSION"), board: board::NAME };
    let mut shoe = make(identity, &config, &parameters, &calibration);
    if let Some(words) = words {
        defmt::error!("before the reset: {=str}", words.as_str());
        shoe.log(now(), Level::Error, &words);
    }
    if settings.refused() {
        shoe.log(now(), Level::Warn, "kept settings cannot be used: defaults are in effect");
    }
    let line = board.rx.into_ring_buffered(BUFFER.init([0; RING]));
    let mut machine = Machine { settings, watchdog: board.watchdog, load: Load::start(), reset: board.reset };
    machine.watchdog.unleash();
    sensor::start(board.sensor, config, &TRAFFIC);
    let shoe_at = &raw mut shoe;
    // SAFETY: the executor never returns, so this frame and the shoe in it stay for ever, and this is the only reference. In a
    // static it would have to be copied from a stack that is as large again.
    let shoe: &'static mut Wearer = unsafe { &mut *shoe_at };
    executor::run(core.SCB, |spawner: Spawner| {
        spawner.spawn(sending(board.tx).expect("one line"));
        spawner.spawn(processing(shoe, line, machine).expect("one shoe"));
    })
}
