//! The executors' clock, from two timers of the emulated machine: one runs freely, the other wakes.
//!
//! Registers: Arm Cortex-M System Design Kit, technical reference manual (DDI 0479), "APB timer"; addresses and interrupts:
//! Arm application note 386. Both count down at 25 MHz.
//!
//! # The shoe's time and the machine's
//! An emulator that has no processor of its host for a while makes up for it: while the emulated processor waits, its timers
//! jump by as much as the host was late. No real timer does, and a sensor whose FIFO holds 16 ms overflows. So the shoe's clock
//! leaves out by how much the processor woke later than the alarm was due, and gains it again by skipping what the processor would
//! wait for afterwards: it goes slower and faster then, but every alarm comes in time, and all of them come. It also skips every
//! wait while [`pace`] wants it to hurry.

use super::interrupt::{self, Irq};
use super::pace;
use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;
use critical_section::{CriticalSection, Mutex};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

/// Counts of a timer in a microsecond.
const PER_US: u32 = 25;
/// The longest alarm; the queue is looked at again then. **Units:** microseconds.
const LONGEST_US: u64 = 60_000_000;
/// An alarm that is late by no more than this is the ordinary affair of the emulator's host. **Units:** counts, 2 ms.
const ORDINARY: i64 = 2_000 * PER_US as i64;

const ENABLE: u32 = 1 << 0;
const INTERRUPT: u32 = 1 << 3;

/// A timer of the machine.
struct Timer(*mut u32);

/// Registers, as offsets in words.
const CONTROL: usize = 0;
const VALUE: usize = 1;
const RELOAD: usize = 2;
const CLEAR: usize = 3;

const ALARM: Timer = Timer(0x4000_0000 as *mut u32);
const FREE: Timer = Timer(0x4000_1000 as *mut u32);

impl Timer {
    fn write(&self, register: usize, value: u32) {
        // SAFETY: the register is inside the timer's block, which nothing else uses.
        unsafe { self.0.add(register).write_volatile(value) }
    }

    fn read(&self, register: usize) -> u32 {
        // SAFETY: as above; reading has no side effect.
        unsafe { self.0.add(register).read_volatile() }
    }
}

struct Clock {
    /// Whole rounds of the free timer, each 2^32 counts.
    rounds: AtomicU32,
    queue: Mutex<RefCell<Queue>>,
    /// By how much the shoe's clock is behind the free timer; less than nothing when it is ahead. **Units:** counts.
    left_out: Mutex<Cell<i64>>,
    /// When the alarm is due, by the free timer. **Units:** counts.
    due: Mutex<Cell<i64>>,
}

embassy_time_driver::time_driver_impl!(static CLOCK: Clock = Clock {
    rounds: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
    left_out: Mutex::new(Cell::new(0)),
    // No alarm is set.
    due: Mutex::new(Cell::new(i64::MAX)),
});

impl Clock {
    /// Sets the alarm for the first of the queue.
    fn arm(&self, cs: CriticalSection<'_>, queue: &mut Queue) {
        let now = self.now();
        let wait = queue.next_expiration(now).saturating_sub(now).clamp(1, LONGEST_US);
        ALARM.write(CONTROL, 0);
        // This sets the value too, so it comes first.
        ALARM.write(RELOAD, u32::MAX);
        // At most LONGEST_US · PER_US, which fits.
        let counts = wait as u32 * PER_US;
        self.due.borrow(cs).set(self.machine(cs) + i64::from(counts));
        ALARM.write(VALUE, counts);
        ALARM.write(CLEAR, 1);
        ALARM.write(CONTROL, ENABLE | INTERRUPT);
    }

    /// Counts of the free timer since the start.
    fn machine(&self, _: CriticalSection<'_>) -> i64 {
        let mut count = u32::MAX - FREE.read(VALUE);
        let mut rounds = self.rounds.load(Ordering::Relaxed);
        // It came around, and its interrupt waits.
        if FREE.read(CLEAR) & 1 != 0 {
            rounds = rounds.wrapping_add(1);
            count = u32::MAX - FREE.read(VALUE);
        }
        i64::from(rounds) << 32 | i64::from(count)
    }

    /// The same of the shoe's clock.
    fn shoe(&self) -> i64 {
        critical_section::with(|cs| self.machine(cs) - self.left_out.borrow(cs).get())
    }

    /// Makes it the time of the alarm for the shoe, sooner or later, if that is `wanted`: by how much later it is than the
    /// alarm, and by how much the shoe's clock is behind. Tells whether it was.
    fn settle(&self, wanted: impl FnOnce(i64, i64) -> bool) -> bool {
        critical_section::with(|cs| {
            let left_out = self.left_out.borrow(cs);
            let late = self.machine(cs) - self.due.borrow(cs).get();
            let wanted = wanted(late, left_out.get());
            if wanted {
                left_out.set(left_out.get() + late);
            }
            wanted
        })
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        // The shoe's clock does not go back, so it is not below zero.
        self.shoe() as u64 / u64::from(PER_US)
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let mut queue = self.queue.borrow_ref_mut(cs);
            if queue.schedule_wake(at, waker) {
                self.arm(cs, &mut queue);
            }
        });
    }
}

/// Starts both timers.
pub fn start() {
    FREE.write(RELOAD, u32::MAX);
    FREE.write(CONTROL, ENABLE | INTERRUPT);
    interrupt::enable(Irq::FREE_TIMER, 0);
    interrupt::enable(Irq::ALARM_TIMER, 0);
}

/// Counts of the shoe's clock; they begin anew after 171 s. **Units:** 40 ns.
pub fn counts() -> u32 {
    CLOCK.shoe() as u32
}

/// Waits for an interrupt. All must be masked, so that it is served afterwards. Tells how long it took the shoe, as
/// [`counts`].
pub fn rest() -> u32 {
    let before = counts();
    let skips = |late: i64, behind: i64| late + behind >= 0 || pace::hurries();
    if !interrupt::waits() && CLOCK.settle(skips) {
        interrupt::raise(Irq::ALARM_TIMER);
    } else {
        cortex_m::asm::wfi();
        CLOCK.settle(|late, _| late > ORDINARY);
    }
    counts().wrapping_sub(before)
}

/// The free timer came around.
pub fn on_round() {
    critical_section::with(|_| {
        FREE.write(CLEAR, 1);
        CLOCK.rounds.store(CLOCK.rounds.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    });
}

/// The alarm is due.
pub fn on_alarm() {
    critical_section::with(|cs| {
        ALARM.write(CLEAR, 1);
        CLOCK.arm(cs, &mut CLOCK.queue.borrow_ref_mut(cs));
    });
}
