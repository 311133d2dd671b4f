//! Bluetooth of the emulated shoe: its controller is whatever the emulator connects to the second serial line.
//!
//! It runs below everything else: pairing takes the processor for a tenth of a second and more, which the tracker would not
//! forgive.

use super::{desk, uart};
use embassy_executor::Spawner;
use sohle_ble::{Device, Radio, Resources, run};
use sohle_shared::bonds::Bonds;
use static_cell::StaticCell;

/// What passes between the tracker and the radio.
pub static RADIO: Radio = Radio::new();

/// There is one emulated shoe, by this address. The highest byte comes last.
const ADDRESS: [u8; 6] = [0x86, 0x03, b'e', b'l', b'o', 0xc0];

/// Starts it; what is spawned from outside an executor must not stay in one thread.
#[embassy_executor::task]
pub async fn start(bonds: Bonds) {
    // SAFETY: awaited in a task of an embassy executor.
    let spawner = unsafe { Spawner::for_current_executor() }.await;
    spawner.spawn(radio(bonds).expect("started once"));
}

#[embassy_executor::task]
async fn radio(bonds: Bonds) {
    static RESOURCES: StaticCell<Resources> = StaticCell::new();
    let (reader, writer) = uart::HCI.start();
    let line = (reader, writer);
    run(&RADIO, line, Device::new(ADDRESS, false), bonds, entropy, RESOURCES.init(Resources::new())).await
}

/// Of the clock of the machine that runs the emulator, for want of anything better: whoever knows when it was started can
/// guess it. A board has a generator of random numbers.
fn entropy() -> [u8; 32] {
    let mut state = desk::moment();
    let mut bytes = [0; 32];
    for chunk in bytes.chunks_exact_mut(8) {
        chunk.copy_from_slice(&mixed(&mut state).to_le_bytes());
    }
    bytes
}

/// The next number of SplitMix64 (Steele, Lea, Flood: "Fast splittable pseudorandom number generators", 2014).
fn mixed(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let first = (*state ^ *state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let second = (first ^ first >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    second ^ second >> 31
}

/// Tells this boot from others.
pub fn boot() -> u32 {
    mixed(&mut desk::moment()) as u32
}
