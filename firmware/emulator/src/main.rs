//! The self-test of `sohle-shared` on an emulated Cortex-M4F, by `cargo xtask emulator`.
//!
//! Prints the fingerprints, which must be those of the host, and what everything costs: instructions, and the depth of the
//! stack. These are instructions, not cycles: loads, divisions and the flash of a real chip add to them.
#![no_std]
#![no_main]

mod meter;
mod parts;
mod stack;

use cortex_m_semihosting::{debug, hprintln};
use meter::Cost;
use panic_semihosting as _;
use sohle_shared::selftest;
use sohle_shared::tracker::Parameters;

fn print(cost: &Cost, name: &str, rate: u32, phase: &str) {
    hprintln!("cost {} {} {} {} {}", name, rate, phase, cost.count, cost.instructions());
}

fn measure(name: &str, period_us: u32, parameters: &Parameters) {
    let rate = 1_000_000 / period_us;
    let (mut swinging, mut standing) = (Cost::default(), Cost::default());
    let stack = stack::paint(None);
    let report = selftest::track(period_us, parameters, |tracker, sample| {
        let before = meter::mark();
        let output = tracker.push(sample);
        let ticks = before.ticks();
        if output.stance { &mut standing } else { &mut swinging }.add(ticks);
        output
    });
    let stack = stack.used();
    let most = swinging.most().max(standing.most());
    hprintln!("bits {} {} Hz {}", name, rate, report);
    print(&swinging, name, rate, "swinging");
    print(&standing, name, rate, "standing");
    hprintln!("told {} {} Hz: at most {} instructions for a sample, {} bytes of stack", name, rate, most, stack);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    meter::start();
    hprintln!("bits rotations {:016x}", selftest::rotations().0);
    for period_us in selftest::PERIODS_US {
        measure("default", period_us, &Parameters::default());
        measure("documented", period_us, &Parameters::documented());
    }
    parts::measure();
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}
