//! The laptop's end of the wire.
//!
//! [`session`] turns the bytes of a shoe into events and decides what is said to it; [`clock`] relates the shoe's time to
//! the laptop's. Neither opens a port nor reads a clock: bytes and time are arguments, so that [`endurance`] can let hours
//! pass in seconds over a [`line`](mod@line) as bad as it likes. The shoe's end is [`sohle_shared::wire::link`].
//!
//! [`transport`] keeps the port at an [`address`] open, be it a cable, the network or [`bluetooth`]; [`connection`] puts session and port together, and [`recorder`]
//! writes what is heard.

pub mod address;
pub mod bluetooth;
pub mod clock;
pub mod connection;
mod copies;
pub mod endurance;
pub mod event;
pub mod ground;
pub mod line;
mod questions;
pub mod raw;
pub mod recorder;
pub mod session;
pub mod transport;

pub use address::Address;
pub use connection::Connection;
