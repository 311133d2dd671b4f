//! How deep the stack goes: memory below it is painted, and what lost its paint was used.

use core::ptr;
use cortex_m::register::msp;

const PAINT: u32 = 0xc0de_face;

/// Depth that is painted and searched. **Units:** bytes. Far more than any board has, far less than is free here.
const DEPTH: u32 = 256 * 1024;

/// Left unpainted for the frame of `paint` itself. **Units:** bytes.
const MARGIN: u32 = 256;

/// Words from `DEPTH` below the stack pointer up to just below it.
fn words() -> impl Iterator<Item = *mut u32> {
    let top = msp::read() & !3;
    (top - DEPTH..top - MARGIN).step_by(4).map(|address| address as *mut u32)
}

/// Paints the memory below the stack.
#[inline(never)]
pub fn paint() {
    for word in words() {
        // SAFETY: the memory map leaves 4 MB between the statics and the start of the stack, which nothing else uses;
        // `MARGIN` keeps clear of the live frame, and no interrupt is enabled that would push another.
        unsafe { ptr::write_volatile(word, PAINT) }
    }
}

/// How deep the stack has been below this call since it was painted. **Units:** bytes.
#[inline(never)]
pub fn used() -> u32 {
    // SAFETY: as in `paint`; reading what was painted there.
    let intact = words().take_while(|&word| unsafe { ptr::read_volatile(word) } == PAINT).count() as u32;
    DEPTH - 4 * intact
}
