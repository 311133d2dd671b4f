//! The executor of all that may be late, and how busy the processor is.
//!
//! The processor sleeps when there is nothing to do. It sleeps with interrupts masked and is woken by one that becomes
//! pending, so that the time asleep ends before the work of the interrupt begins and all work is counted.

use cortex_m::{asm, interrupt, peripheral::SCB};
use embassy_executor::{Spawner, raw};
use embassy_time::Instant;
use portable_atomic::{AtomicU32, Ordering};
use static_cell::StaticCell;

/// What `embassy-executor` takes for the executor that is woken by an event (its `platform/cortex_m.rs`).
const WOKEN_BY_EVENT: usize = usize::MAX;

/// SEVONPEND of the system control register: an interrupt that becomes pending is an event, though it is masked
/// (ARMv7-M Architecture Reference Manual, B3.2.7).
const EVENT_ON_PENDING: u32 = 1 << 4;

static EXECUTOR: StaticCell<raw::Executor> = StaticCell::new();

/// Time asleep since the boot; comes around after 71 minutes. **Units:** microseconds.
static ASLEEP_US: AtomicU32 = AtomicU32::new(0);

/// Runs the tasks that `init` spawns, for ever. Panics when it is called twice.
pub fn run(scb: SCB, init: impl FnOnce(Spawner)) -> ! {
    let executor = EXECUTOR.init(raw::Executor::new(WOKEN_BY_EVENT as *mut ()));
    // SAFETY: only makes masked interrupts wake `wfe`; nothing else in this program writes the register.
    unsafe { scb.scr.modify(|value| value | EVENT_ON_PENDING) }
    init(executor.spawner());
    loop {
        // SAFETY: this is the only place that polls it, and no task can get here.
        unsafe { executor.poll() }
        interrupt::free(|_| {
            let before = Instant::now();
            asm::wfe();
            ASLEEP_US.fetch_add(before.elapsed().as_micros() as u32, Ordering::Relaxed);
        });
    }
}

/// How busy the processor is.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    since: Instant,
    asleep_us: u32,
}

impl Load {
    /// Begins to count now.
    pub fn start() -> Self {
        Self { since: Instant::now(), asleep_us: ASLEEP_US.load(Ordering::Relaxed) }
    }

    /// Share of the time since the start or the last call that the processor was awake. **Units:** 1/1000.
    pub fn take(&mut self) -> u16 {
        let before = core::mem::replace(self, Self::start());
        let elapsed = (self.since - before.since).as_micros().max(1);
        let asleep = u64::from(self.asleep_us.wrapping_sub(before.asleep_us));
        1000 - (1000 * asleep / elapsed).min(1000) as u16
    }
}
