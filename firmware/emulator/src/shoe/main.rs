//! A shoe without a shoe: the firmware's own loops on an emulated Cortex-M4F, by `cargo xtask emulate`.
//!
//! The sensor is its twin, which reads a recorded or simulated walk; driver, tracker and wire are those of the boards. The
//! sensor is read at a higher priority than everything else runs at, as there. The serial line is whatever the emulator
//! connects it to. Time is that of the emulated machine, with `-icount` real time for who watches, but for what [`clock`] leaves
//! out or skips.
//!
//! With the feature `ble` there is a second serial line, to a Bluetooth controller, and a flash in a file. The walk begins
//! when the first laptop says something, whichever way it comes; without the feature the shoe walks at once, since the
//! emulator itself waits for the laptop.
#![no_std]
#![no_main]

mod clock;
mod desk;
#[cfg(feature = "ble")]
mod flash;
mod interrupt;
mod memory;
mod pace;
#[cfg(feature = "ble")]
mod radio;
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
use memory::Memory;
use panic_semihosting as _;
use sensor::{Bus, Pin, Walk};
use sohle_shared::bmx055::blocking::Blocking;
use sohle_shared::bmx055::counts::Header;
use sohle_shared::bmx055::twin::{Chip, SimulatedBmx055, SimulatedDelay};
use sohle_shared::bmx055::{Bmx055, Config, Die};
use sohle_shared::shoe::Shoe;
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::{Refusal, ResetReason};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::port::Port;
use sohle_shared::wire::transfer::Value;
#[cfg(not(feature = "ble"))]
use sohle_tasks::NoAir;
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

/// Laptops at a time.
#[cfg(not(feature = "ble"))]
const PORTS: usize = 1;
#[cfg(feature = "ble")]
const PORTS: usize = 2;

#[cfg(feature = "ble")]
static RADIO: InterruptExecutor = InterruptExecutor::new();
/// Below that of everything else.
#[cfg(feature = "ble")]
const RADIO_PRIORITY: u8 = 224;

/// The emulated machine has neither battery nor watchdog.
struct Machine {
    memory: Memory,
    stack: Painted,
    /// Counts of the clock, and those idle, at the last question.
    asked: (u32, u32),
}

impl Board for Machine {
    async fn keep(&mut self, value: &Value) -> Result<(), Refusal> {
        self.memory.keep(value)
    }

    #[cfg(feature = "ble")]
    async fn keep_bonds(&mut self, bonds: &sohle_shared::bonds::Bonds) -> Result<(), Refusal> {
        self.memory.keep_bonds(bonds)
    }

    fn health(&mut self) -> BoardHealth {
        let now = (clock::counts(), IDLE.load(Ordering::Relaxed));
        let (passed, idle) = (now.0.wrapping_sub(self.asked.0), now.1.wrapping_sub(self.asked.1));
        self.asked = now;
        let busy = u64::from(passed.saturating_sub(idle)) * 1_000 / u64::from(passed.max(1));
        // At most 1000.
        BoardHealth { load: busy as u16, battery: None, stack: self.stack.used(), reset: ResetReason::PowerOn }
    }

    fn alive(&mut self) {
        pace::tell();
    }
}

/// The twin, with the walk as its source.
type Twin = SimulatedBmx055<fn(Die, u64) -> [i16; 3]>;

static WALK: Mutex<RefCell<Option<Walk>>> = Mutex::new(RefCell::new(None));

/// What the die reads at this time. **Units:** ns since the power came.
fn counts(die: Die, time_ns: u64) -> [i16; 3] {
    #[cfg(feature = "ble")]
    let time_ns = since_a_laptop_came(time_ns);
    critical_section::with(|cs| WALK.borrow_ref_mut(cs).as_mut().map_or([0; 3], |walk| walk.counts(die, time_ns)))
}

/// How long ago the first laptop said something; nothing while there was none.
#[cfg(feature = "ble")]
fn since_a_laptop_came(time_ns: u64) -> u64 {
    static BEGUN: Mutex<core::cell::Cell<Option<u64>>> = Mutex::new(core::cell::Cell::new(None));
    critical_section::with(|cs| {
        let begun = BEGUN.borrow(cs);
        if begun.get().is_none() && (uart::LAPTOP.was_used() || sohle_tasks::Air::is_open(&radio::RADIO)) {
            begun.set(Some(time_ns));
        }
        begun.get().map_or(0, |begun| time_ns.saturating_sub(begun))
    })
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
async fn start_processing(shoe: &'static mut Wearer, machine: Machine) {
    let (received, sent) = uart::LAPTOP.start();
    // SAFETY: as above.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    spawner.spawn(processing(shoe, received, machine).expect("started once"));
    spawner.spawn(sending(sent).expect("started once"));
}

/// The shoe with its steps elsewhere.
type Wearer = Shoe<STEPS, &'static mut Outbox<STEPS, PORTS>, PORTS>;

/// A shoe. Not inlined: like this the compiler makes it where the caller wants it, and not a second one beside it.
#[inline(never)]
fn make(memory: &mut Memory) -> Wearer {
    static OUTBOX: ConstStaticCell<Outbox<STEPS, PORTS>> = ConstStaticCell::new(Outbox::blank());
    let identity = Identity { boot: boot(), firmware: env!("CARGO_PKG_VERSION"), board: "mps2-an386" };
    let outbox = OUTBOX.take();
    outbox.begin(Port::Serial, Pace::SERIAL);
    #[cfg(feature = "ble")]
    outbox.begin(Port::Radio, Pace::RADIO);
    let (parameters, calibration) = memory.settings();
    Shoe::new(identity, &Config::default(), &parameters, &calibration, outbox)
}

/// There is one boot: the line is new with every start of the emulator.
#[cfg(not(feature = "ble"))]
fn boot() -> u32 {
    1
}

#[cfg(feature = "ble")]
use radio::boot;

#[embassy_executor::task]
async fn processing(shoe: &'static mut Wearer, line: uart::Receiver, machine: Machine) {
    #[cfg(not(feature = "ble"))]
    let air = &NoAir;
    #[cfg(feature = "ble")]
    let air = &radio::RADIO;
    process(&TRAFFIC, shoe, line, air, machine).await
}

#[embassy_executor::task]
async fn sending(line: uart::Sender) {
    send(&TRAFFIC, line).await
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    match Irq::of(number) {
        Some(Irq::UART_RECEIVED) => uart::LAPTOP.on_received(),
        #[cfg(feature = "ble")]
        Some(Irq::HCI_RECEIVED) => uart::HCI.on_received(),
        #[cfg(feature = "ble")]
        // SAFETY: as below.
        Some(Irq::RADIO) => unsafe { RADIO.on_interrupt() },
        Some(Irq::PACE_RECEIVED) => pace::on_received(),
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
fn set_off(header: Header, shoe: &'static mut Wearer, machine: Machine) {
    clock::start();
    pace::start();
    interrupt::prioritise(Irq::SENSE, SENSE_PRIORITY);
    interrupt::prioritise(Irq::PROCESS, PROCESS_PRIORITY);
    let sensing = start_sensing(header.accel_period_ns, header.gyro_period_ns).expect("started once");
    SENSE.start(Irq::SENSE).spawn(sensing);
    #[cfg(feature = "ble")]
    let mut machine = machine;
    #[cfg(feature = "ble")]
    let bonds = machine.memory.bonds();
    PROCESS.start(Irq::PROCESS).spawn(start_processing(shoe, machine).expect("started once"));
    #[cfg(feature = "ble")]
    {
        interrupt::prioritise(Irq::RADIO, RADIO_PRIORITY);
        RADIO.start(Irq::RADIO).spawn(radio::start(bonds).expect("started once"));
    }
}

/// Ends the emulator.
fn give_up() -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::nop();
    }
}

#[inline(never)]
fn open_memory() -> Memory {
    let Some(memory) = Memory::open() else {
        heprintln!("error: no flash; expected the name of a file for it after that of the walk");
        give_up();
    };
    memory
}

/// Opens the walk. No board has one, so this comes before the stack is watched.
#[inline(never)]
fn open_walk() -> Header {
    let Some(walk) = Walk::open() else {
        heprintln!("error: no walk; expected the name of a file that 'sohle convert' wrote");
        give_up();
    };
    let header = *walk.header();
    critical_section::with(|cs| WALK.borrow_ref_mut(cs).replace(walk));
    header
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut memory = open_memory();
    let mut shoe = make(&mut memory);
    let shoe = &raw mut shoe;
    // SAFETY: this function never returns, so its frame and the shoe in it stay for ever, and this is the only reference.
    let shoe: &'static mut Wearer = unsafe { &mut *shoe };
    let header = open_walk();
    let stack = stack::paint(Some((&raw const _stack_start).addr() as u32));
    set_off(header, shoe, Machine { memory, stack, asked: (0, 0) });
    loop {
        // Masked, an interrupt still ends the sleep, but is served after the time was taken.
        cortex_m::interrupt::disable();
        IDLE.fetch_add(clock::rest(), Ordering::Relaxed);
        // SAFETY: nothing here relies on the mask.
        unsafe { cortex_m::interrupt::enable() };
    }
}
