//! Instructions, by SysTick: under `-icount shift=0` QEMU's `mps2-an386` executes one instruction in a virtual nanosecond
//! and counts SysTick at 25 MHz, so one tick is 40 instructions.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// Instructions in a tick of SysTick.
const PER_TICK: u64 = 40;

/// Largest value of the 24-bit counter; it counts down. 671 million instructions pass before it comes around.
const RELOAD: u32 = 0x00ff_ffff;

/// Starts the counter.
pub fn start() {
    if let Some(mut peripherals) = cortex_m::Peripherals::take() {
        peripherals.SYST.set_clock_source(SystClkSource::Core);
        peripherals.SYST.set_reload(RELOAD);
        peripherals.SYST.clear_current();
        peripherals.SYST.enable_counter();
    }
}

/// A moment.
#[derive(Clone, Copy)]
pub struct Mark(u32);

/// Now.
pub fn mark() -> Mark {
    Mark(SYST::get_current())
}

impl Mark {
    /// Ticks since then.
    pub fn ticks(self) -> u32 {
        self.0.wrapping_sub(SYST::get_current()) & RELOAD
    }
}

/// What something costs that is done often. A tick is coarse, but over many rounds what it cuts off and what it adds are
/// the same.
#[derive(Clone, Copy, Default)]
pub struct Cost {
    /// How often it was done.
    pub count: u64,
    ticks: u64,
    most: u32,
}

impl Cost {
    /// It was done once more.
    pub fn add(&mut self, ticks: u32) {
        self.count += 1;
        self.ticks += u64::from(ticks);
        self.most = self.most.max(ticks);
    }

    /// Measures `work`, done once.
    pub fn of<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let before = mark();
        let result = work();
        self.add(before.ticks());
        result
    }

    /// Over all rounds.
    pub fn instructions(&self) -> u64 {
        self.ticks * PER_TICK
    }

    /// The most that one round took.
    pub fn most(&self) -> u64 {
        u64::from(self.most) * PER_TICK
    }
}
