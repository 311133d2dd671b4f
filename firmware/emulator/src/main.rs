//! The self-test of `sohle-shared` on an emulated Cortex-M4F, by `cargo xtask emulator`.
//!
//! Prints the fingerprints, which must be those of the host, and what the tracker costs: instructions for each sample
//! and the depth of its stack. QEMU's `mps2-an386` under `-icount shift=0` executes one instruction per virtual
//! nanosecond and counts SysTick at 25 MHz, so one tick is 40 instructions. These are instructions, not cycles: loads,
//! divisions and the flash of a real chip add to them.
#![no_std]
#![no_main]

mod stack;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use sohle_shared::selftest;
use sohle_shared::tracker::Parameters;

/// Instructions in a tick of SysTick.
const PER_TICK: u64 = 40;

/// Largest value of the 24-bit counter; it counts down. 671 million instructions pass before it comes around.
const RELOAD: u32 = 0x00ff_ffff;

/// What the samples of one phase of the walk cost.
#[derive(Default)]
struct Cost {
    samples: u64,
    ticks: u64,
    most: u64,
}

impl Cost {
    fn add(&mut self, ticks: u32) {
        self.samples += 1;
        self.ticks += u64::from(ticks);
        self.most = self.most.max(u64::from(ticks));
    }

    fn print(&self, name: &str, rate: u32, phase: &str) {
        hprintln!("cost {} {} {} {} {}", name, rate, phase, self.samples, self.ticks * PER_TICK);
    }
}

fn measure(name: &str, period_us: u32, parameters: &Parameters) {
    let rate = 1_000_000 / period_us;
    let (mut swinging, mut standing) = (Cost::default(), Cost::default());
    stack::paint();
    let report = selftest::track(period_us, parameters, |tracker, sample| {
        let before = SYST::get_current();
        let output = tracker.push(sample);
        let ticks = before.wrapping_sub(SYST::get_current()) & RELOAD;
        if output.stance { &mut standing } else { &mut swinging }.add(ticks);
        output
    });
    let stack = stack::used();
    let most = swinging.most.max(standing.most) * PER_TICK;
    hprintln!("bits {} {} Hz {}", name, rate, report);
    swinging.print(name, rate, "swinging");
    standing.print(name, rate, "standing");
    hprintln!("told {} {} Hz: at most {} instructions for a sample, {} bytes of stack", name, rate, most, stack);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(mut peripherals) = cortex_m::Peripherals::take() {
        peripherals.SYST.set_clock_source(SystClkSource::Core);
        peripherals.SYST.set_reload(RELOAD);
        peripherals.SYST.clear_current();
        peripherals.SYST.enable_counter();
    }
    hprintln!("bits rotations {:016x}", selftest::rotations().0);
    for period_us in selftest::PERIODS_US {
        measure("default", period_us, &Parameters::default());
        measure("documented", period_us, &Parameters::documented());
    }
    debug::exit(debug::EXIT_SUCCESS);
    loop {}
}
