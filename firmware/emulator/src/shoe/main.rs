//! A shoe without a shoe: the firmware's own loops on an emulated Cortex-M4F, by `cargo xtask emulate`.
//!
//! The sensor is its twin, which reads a recorded or simulated walk; driver, tracker and wire are those of the boards. The
//! sensor is read at a higher priority than everything else runs at, as there. The serial line is whatever the emulator
//! connects it to. Time is that of the emulated machine: with `-icount` it is real time for who watches.
#![no_std]
#![no_main]

mod clock;
mod interrupt;
mod sensor;
#[path = "../stack.rs"]
mod stack;
mod uart;

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_semihosting::{debug, heprintln};
use critical_section::Mutex;
use embassy_executor::{InterruptExecutor, Spawner};
use interrupt::Irq;
use panic_semihosting as _;
use sensor::{Bus, Pin, Walk};
use sohle_shared::bmx055::blocking::Blocking;
use sohle_shared::bmx055::counts::Header;
use sohle_shared::bmx055::twin::{Chip, SimulatedBmx055, SimulatedDelay};
use sohle_shared::bmx055::{Bmx055, Config, Die};
use sohle_shared::calibration::Calibration;
use sohle_shared::shoe::Shoe;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::{Refusal, ResetReason};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::transfer::Value;
use sohle_tasks::{Board, BoardHealth, Traffic, process, send, sense};
use stack::Painted;
use static_cell::{ConstStaticCell, StaticCell};

/// Steps that the shoe keeps for the laptop.
const STEPS: usize = 1_000;
/// Priorities: a low number goes before a high one.
const SENSE_PRIORITY: u8 = 128;
const PROCESS_PRIORITY: u8 = 192;

unsafe extern "C" {
    /// First word above the stack, from the memory map.
    static _stack_start: u32;
}

static TRAFFIC: Traffic = Traffic::new();
static SENSE: InterruptExecutor = InterruptExecutor::new();
static PROCESS: InterruptExecutor = InterruptExecutor::new();
/// Counts of the clock in which nothing was to be done.
static IDLE: AtomicU32 = AtomicU32::new(0);

/// The emulated machine has neither flash, battery nor watchdog.
struct Machine {
    stack: Painted,
    /// Counts of the clock, and those idle, at the last question.
    asked: (u32, u32),
}

impl Board for Machine {
    async fn keep(&mut self, _: &Value) -> Result<(), Refusal> {
        // In effect until the emulator ends, which is as long as its memory lasts.
        Ok(())
    }

    fn health(&mut self) -> BoardHealth {
        let now = (clock::counts(), IDLE.load(Ordering::Relaxed));
        let (passed, idle) = (now.0.wrapping_sub(self.asked.0), now.1.wrapping_sub(self.asked.1));
        self.asked = now;
        let busy = u64::from(passed.saturating_sub(idle)) * 1_000 / u64::from(passed.max(1));
        // At most 1000.
        BoardHealth { load: busy as u16, battery: None, stack: self.stack.used(), reset: ResetReason::PowerOn }
    }

    fn alive(&mut self) {}
}

/// The twin, with the walk as its source.
type Twin = SimulatedBmx055<fn(Die, u64) -> [i16; 3]>;

static WALK: Mutex<RefCell<Option<Walk>>> = Mutex::new(RefCell::new(None));

/// What the die reads at this time. **Units:** ns since the power came.
fn counts(die: Die, time_ns: u64) -> [i16; 3] {
    critical_section::with(|cs| WALK.borrow_ref_mut(cs).as_mut().map_or([0; 3], |walk| walk.counts(die, time_ns)))
}

/// Starts what reads the sensor; what is spawned from outside an executor must not stay in one thread.
#[embassy_executor::task]
async fn start_sensing(accel_period_ns: u32, gyro_period_ns: u32) {
    static TWIN: StaticCell<RefCell<Twin>> = StaticCell::new();
    let twin = TWIN.init(RefCell::new(SimulatedBmx055::new(accel_period_ns, gyro_period_ns, counts)));
    // SAFETY: awaited in a task of an embassy executor.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    spawner.spawn(sensing(twin).expect("started once"));
}

#[embassy_executor::task]
async fn sensing(twin: &'static RefCell<Twin>) {
    let device = |chip| Blocking(Bus::new(twin, chip));
    let (accel, gyro) = (device(Chip::Die(Die::Accel)), device(Chip::Die(Die::Gyro)));
    let delay = Blocking(SimulatedDelay(twin));
    let driver = Bmx055::new(accel, gyro, device(Chip::Mag), delay, &Config::default());
    sense(&TRAFFIC, driver, Pin::new(twin, Die::Accel), Pin::new(twin, Die::Gyro)).await
}

/// Starts the rest.
#[embassy_executor::task]
async fn start_processing(shoe: &'static mut Wearer, stack: Painted) {
    let (received, sent) = uart::start();
    // SAFETY: as above.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    spawner.spawn(processing(shoe, received, stack).expect("started once"));
    spawner.spawn(sending(sent).expect("started once"));
}

/// The shoe with its steps elsewhere.
type Wearer = Shoe<STEPS, &'static mut Outbox<STEPS>>;

/// A shoe. Not inlined: like this the compiler makes it where the caller wants it, and not a second one beside it.
#[inline(never)]
fn make() -> Wearer {
    static OUTBOX: ConstStaticCell<Outbox<STEPS>> = ConstStaticCell::new(Outbox::blank());
    // There is one boot: the line is new with every start of the emulator.
    let identity = Identity { boot: 1, firmware: env!("CARGO_PKG_VERSION"), board: "mps2-an386" };
    let outbox = OUTBOX.take();
    outbox.begin(Pace::SERIAL);
    Shoe::new(identity, &Config::default(), &Parameters::default(), &Calibration::default(), outbox)
}

#[embassy_executor::task]
async fn processing(shoe: &'static mut Wearer, line: uart::Receiver, stack: Painted) {
    process(&TRAFFIC, shoe, line, Machine { stack, asked: (0, 0) }).await
}

#[embassy_executor::task]
async fn sending(line: uart::Sender) {
    send(&TRAFFIC, line).await
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    match Irq::of(number) {
        Some(Irq::UART_RECEIVED) => uart::on_received(),
        Some(Irq::ALARM_TIMER) => clock::on_alarm(),
        Some(Irq::FREE_TIMER) => clock::on_round(),
        // SAFETY: called from the interrupt of this executor alone, which its start has unmasked.
        Some(Irq::SENSE) => unsafe { SENSE.on_interrupt() },
        // SAFETY: as above.
        Some(Irq::PROCESS) => unsafe { PROCESS.on_interrupt() },
        _ => panic!("unexpected interrupt {number}"),
    }
}

/// Starts clock and tasks. Not inlined: what it takes of the stack is free again when the tasks run.
#[inline(never)]
fn set_off(header: Header, shoe: &'static mut Wearer, stack: Painted) {
    clock::start();
    interrupt::prioritise(Irq::SENSE, SENSE_PRIORITY);
    interrupt::prioritise(Irq::PROCESS, PROCESS_PRIORITY);
    let sensing = start_sensing(header.accel_period_ns, header.gyro_period_ns).expect("started once");
    SENSE.start(Irq::SENSE).spawn(sensing);
    PROCESS.start(Irq::PROCESS).spawn(start_processing(shoe, stack).expect("started once"));
}

/// Opens the walk. No board has one, so this comes before the stack is watched.
#[inline(never)]
fn open_walk() -> Header {
    let Some(walk) = Walk::open() else {
        heprintln!("error: no walk; expected the name of a file that 'sohle convert' wrote");
        debug::exit(debug::EXIT_FAILURE);
        loop {}
    };
    let header = *walk.header();
    critical_section::with(|cs| WALK.borrow_ref_mut(cs).replace(walk));
    header
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut shoe = make();
    let shoe = &raw mut shoe;
    // SAFETY: this function never returns, so its frame and the shoe in it stay for ever, and this is the only reference.
    let shoe: &'static mut Wearer = unsafe { &mut *shoe };
    let header = open_walk();
    set_off(header, shoe, stack::paint(Some((&raw const _stack_start).addr() as u32)));
    loop {
        // Masked, an interrupt still ends the sleep, but is served after the time was taken.
        cortex_m::interrupt::disable();
        let before = clock::counts();
        cortex_m::asm::wfi();
        IDLE.fetch_add(clock::counts().wrapping_sub(before), Ordering::Relaxed);
        // SAFETY: nothing here relies on the mask.
        unsafe { cortex_m::interrupt::enable() };
    }
}
