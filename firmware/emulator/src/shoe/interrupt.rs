//! Interrupts of the emulated machine (Arm application note 386, table of interrupts), by number: there is no crate that
//! names its peripherals.

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::{NVIC, SCB};

/// Number of an interrupt.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Irq(u16);

impl Irq {
    /// A byte has come over the serial line.
    pub const UART_RECEIVED: Self = Self(0);
    /// A byte has come from the Bluetooth controller.
    #[cfg(feature = "ble")]
    pub const HCI_RECEIVED: Self = Self(2);
    /// A byte has come from whoever runs the emulator.
    pub const PACE_RECEIVED: Self = Self(4);
    /// The timer of the alarms.
    pub const ALARM_TIMER: Self = Self(8);
    /// The free timer.
    pub const FREE_TIMER: Self = Self(9);
    /// Belongs to a device that is not used: the software interrupt of the executor that reads the sensor.
    pub const SENSE: Self = Self(20);
    /// The same for the executor that does the rest.
    pub const PROCESS: Self = Self(21);

    /// The same for the executor of Bluetooth.
    #[cfg(feature = "ble")]
    pub const RADIO: Self = Self(22);

    /// What the processor says of an interrupt; `None` for an exception.
    pub fn of(number: i16) -> Option<Self> {
        u16::try_from(number).ok().map(Self)
    }
}

// SAFETY: the number is below the 32 interrupts of the machine and stays the same.
unsafe impl InterruptNumber for Irq {
    fn number(self) -> u16 {
        self.0
    }
}

/// Sets the priority (0 is the highest, 255 the lowest) and unmasks the interrupt.
pub fn enable(irq: Irq, priority: u8) {
    prioritise(irq, priority);
    // SAFETY: no critical section relies on this interrupt being masked: they mask all.
    unsafe { NVIC::unmask(irq) }
}

/// Sets the priority alone.
pub fn prioritise(irq: Irq, priority: u8) {
    // SAFETY: called while the machine is set up, before anything else can own the controller.
    unsafe { cortex_m::Peripherals::steal().NVIC.set_priority(irq, priority) }
}

/// Makes the interrupt wait as if its device had raised it.
pub fn raise(irq: Irq) {
    NVIC::pend(irq);
}

/// Whether any waits: ISRPENDING of ICSR (ARMv7-M Architecture Reference Manual, B3.2.4).
pub fn waits() -> bool {
    // SAFETY: reading the register has no side effect.
    let state = unsafe { (*SCB::PTR).icsr.read() };
    state & 1 << 22 != 0
}
