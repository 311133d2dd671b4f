//! Where a laptop is connected to the shoe.

/// A port of the shoe. Each has its own laptop, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// The serial line: whoever holds its other end has the shoe at hand.
    Serial = 0,
    /// Bluetooth.
    Radio = 1,
}

impl Port {
    /// All of them. A shoe without a radio has the first alone.
    pub const ALL: [Self; 2] = [Self::Serial, Self::Radio];

    /// Its place among those of a shoe.
    pub(crate) fn index(self) -> usize {
        self as usize
    }
}
