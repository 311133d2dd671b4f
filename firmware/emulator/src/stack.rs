//! How deep the stack goes: memory below it is painted, and what lost its paint was used.

use core::ptr;
use cortex_m::register::msp;

const PAINT: u32 = 0xc0de_face;

/// Depth that is painted and searched. **Units:** bytes. As much as a board may have, far less than is free here.
const DEPTH: u32 = 64 * 1024;

/// Left unpainted for the frame of `paint` itself. **Units:** bytes.
const MARGIN: u32 = 256;

/// A stack that was painted.
#[derive(Clone, Copy)]
pub struct Painted {
    /// Below this it was painted. Address.
    live: u32,
    /// From here its depth counts. Address.
    top: u32,
}

impl Painted {
    /// Words from `DEPTH` below the frame that painted up to just below it.
    fn words(self) -> impl Iterator<Item = *mut u32> {
        (self.live - DEPTH..self.live - MARGIN).step_by(4).map(|address| address as *mut u32)
    }

    /// How deep the stack has been below its top. **Units:** bytes.
    pub fn used(self) -> u32 {
        // SAFETY: as in `paint`; reading what was painted there.
        let intact = self.words().take_while(|&word| unsafe { ptr::read_volatile(word) } == PAINT).count() as u32;
        DEPTH - 4 * intact + (self.top - self.live)
    }
}

/// Paints the memory below the stack. Its depth counts from `top`, or from here.
#[inline(never)]
pub fn paint(top: Option<u32>) -> Painted {
    let live = msp::read() & !3;
    let painted = Painted { live, top: top.unwrap_or(live) };
    for word in painted.words() {
        // SAFETY: the memory map leaves 4 MB between the statics and the start of the stack, which nothing else uses;
        // `MARGIN` keeps clear of the live frame, and no interrupt is enabled that would push another.
        unsafe { ptr::write_volatile(word, PAINT) }
    }
    painted
}
