//! How deep the stack goes. The runtime paints it at boot (`paint-stack` of `cortex-m-rt`); what lost its paint was used.

use core::ptr;
use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    /// Lowest word of the stack, from the memory map.
    static _stack_end: u32;
    /// First word above the stack, from the memory map.
    static _stack_start: u32;
}

/// Largest depth since the boot, interrupts included. **Units:** bytes.
pub fn used() -> u32 {
    let (end, start) = (&raw const _stack_end, &raw const _stack_start);
    let words = (end.addr()..start.addr()).step_by(4).map(|address| address as *const u32);
    // SAFETY: the memory map reserves these words for the stack; they are aligned, were painted before `main`, and a
    // volatile read of a word in use sees whatever it holds.
    let intact = words.take_while(|&word| unsafe { ptr::read_volatile(word) } == STACK_PAINT_VALUE).count();
    (start.addr() - end.addr() - 4 * intact) as u32
}
