//! The executors' clock, from two timers of the emulated machine: one runs freely, the other wakes.
//!
//! Registers: Arm Cortex-M System Design Kit, technical reference manual (DDI 0479), "APB timer"; addresses and interrupts:
//! Arm application note 386. Both count down at 25 MHz.

use super::interrupt::{self, Irq};
use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;
use critical_section::{CriticalSection, Mutex};
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

/// Counts of a timer in a microsecond.
const PER_US: u32 = 25;
/// The longest alarm; the queue is looked at again then. **Units:** microseconds.
const LONGEST_US: u64 = 60_000_000;

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
}

embassy_time_driver::time_driver_impl!(static CLOCK: Clock = Clock {
    rounds: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl Clock {
    /// Sets the alarm for the first of the queue.
    fn arm(&self, _: CriticalSection<'_>, queue: &mut Queue) {
        let now = self.now();
        let wait = queue.next_expiration(now).saturating_sub(now).clamp(1, LONGEST_US);
        ALARM.write(CONTROL, 0);
        // This sets the value too, so it comes first.
        ALARM.write(RELOAD, u32::MAX);
        // At most LONGEST_US · PER_US, which fits.
        ALARM.write(VALUE, wait as u32 * PER_US);
        ALARM.write(CLEAR, 1);
        ALARM.write(CONTROL, ENABLE | INTERRUPT);
    }
}

impl Driver for Clock {
    fn now(&self) -> u64 {
        critical_section::with(|_| {
            let mut count = u32::MAX - FREE.read(VALUE);
            let mut rounds = self.rounds.load(Ordering::Relaxed);
            // It came around, and its interrupt waits.
            if FREE.read(CLEAR) & 1 != 0 {
                rounds = rounds.wrapping_add(1);
                count = u32::MAX - FREE.read(VALUE);
            }
            (u64::from(rounds) << 32 | u64::from(count)) / u64::from(PER_US)
        })
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

/// Counts of the free timer; they begin anew after 171 s. **Units:** 40 ns.
pub fn counts() -> u32 {
    u32::MAX - FREE.read(VALUE)
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
