//! What becomes of a program that cannot go on: it leaves its last words ([`kept`](crate::kept)) and starts anew.

use crate::{board, kept};
use core::fmt;
use core::panic::PanicInfo;
use cortex_m::interrupt;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

fn die(words: fmt::Arguments<'_>) -> ! {
    interrupt::disable();
    defmt::error!("{}", defmt::Debug2Format(&words));
    kept::keep(words);
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    match info.location() {
        // The place first: it must not be cut off.
        Some(place) => die(format_args!("panic at {}:{}: {}", file_name(place.file()), place.line(), info.message())),
        None => die(format_args!("panic: {}", info.message())),
    }
}

/// The last two parts of a path; the folders before them would fill the line.
fn file_name(path: &str) -> &str {
    let start = path.rmatch_indices('/').nth(1).map_or(0, |(at, _)| at + 1);
    path.get(start..).unwrap_or(path)
}

// SAFETY: may be called at any moment; it uses nothing of the interrupted program and does not return.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    die(format_args!("hard fault at {:#010x}, called from {:#010x}", frame.pc(), frame.lr()))
}

// SAFETY: may be called at any moment; it only clears a flag, or does not return.
#[exception]
unsafe fn NonMaskableInt() {
    if !board::flash_fault_cleared() {
        die(format_args!("non-maskable interrupt"));
    }
}
