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

    fn print(&self, name: &str, phase: &str) {
        hprintln!("cost {} {} {} {}", name, phase, self.samples, self.ticks * PER_TICK);
        hprintln!("most {} {} {}", name, phase, self.most * PER_TICK);
    }
}

fn measure(name: &str, parameters: &Parameters) {
    let (mut swinging, mut standing) = (Cost::default(), Cost::default());
    stack::paint();
    let report = selftest::track(selftest::PERIOD_US, parameters, |tracker, sample| {
        let before = SYST::get_current();
        let output = tracker.push(sample);
        let ticks = before.wrapping_sub(SYST::get_current()) & RELOAD;
        if output.stance { &mut standing } else { &mut swinging }.add(ticks);
        output
    });
    let bytes = stack::used();
    hprintln!("bits {} {}", name, report);
    swinging.print(name, "swinging");
    standing.print(name, "standing");
    hprintln!("stack {} {}", name, bytes);
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
    measure("default", &Parameters::default());
    measure("documented", &Parameters::documented());
    debug::exit(debug::EXIT_SUCCESS);
    loop {}
}
