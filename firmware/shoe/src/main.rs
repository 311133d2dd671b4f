//! The program of the shoe.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use sohle_shoe::{board, executor, kept};

#[entry]
fn main() -> ! {
    let _words = kept::take();
    let board = board::start();
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("{=u32}", board.boot);
    executor::run(core.SCB, |_| ())
}
