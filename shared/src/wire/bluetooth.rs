//! The wire over Bluetooth LE: the services and characteristics of a shoe.
//!
//! The frames are those of every other line. A notification, and a write, carries any piece of the stream, in order and at
//! most [`HEADER`] bytes shorter than the attribute MTU; frames are found by their zero byte.

/// Service of a shoe, which it advertises.
pub const SERVICE: u128 = 0x5348_0001_8e1f_4c6b_9a0d_736f_686c_6500;
/// Notify: the stream of bytes from the shoe to the laptop.
pub const STEPS: u128 = 0x5348_0002_8e1f_4c6b_9a0d_736f_686c_6500;
/// Write, with or without response: the stream of bytes from the laptop to the shoe.
pub const COMMANDS: u128 = 0x5348_0003_8e1f_4c6b_9a0d_736f_686c_6500;
/// Read and notify: the last [`Status`](super::message::Status), as the bytes of the message without its frame.
pub const STATUS: u128 = 0x5348_0004_8e1f_4c6b_9a0d_736f_686c_6500;

/// Nordic's UART service, for other programs: the same two streams.
pub const UART_SERVICE: u128 = 0x6e40_0001_b5a3_f393_e0a9_e50e_24dc_ca9e;
/// Write: as [`COMMANDS`].
pub const UART_RX: u128 = 0x6e40_0002_b5a3_f393_e0a9_e50e_24dc_ca9e;
/// Notify: as [`STEPS`].
pub const UART_TX: u128 = 0x6e40_0003_b5a3_f393_e0a9_e50e_24dc_ca9e;

/// What begins the name of every shoe; four hexadecimal digits follow.
pub const NAME_PREFIX: &str = "Sohle-";
/// Attribute MTU that is asked for: a notification fills one packet of the radio with data length extension.
pub const MTU: u16 = 247;
/// Of a notification or a write within the attribute MTU. **Units:** bytes.
pub const HEADER: u16 = 3;
/// A [`STATUS`] is never longer. **Units:** bytes.
pub const STATUS_MAX: usize = 240;
