//! The shoe's Bluetooth LE, for any controller that speaks HCI on a serial line with handshake.
//!
//! [`run`] drives the controller and serves one laptop at a time; what passes between it and the tracker is in [`Radio`],
//! whose side for the tracker never waits ([`Air`](sohle_tasks::Air)). Pairing and keys are those of `trouble-host`, the
//! host stack; in front of it stands [`hci`], which hands on nothing that the stack would panic at, and refuses to pair
//! while nobody with the shoe at hand has allowed it.
//!
//! Whatever goes wrong with the controller, it is reset and everything begins anew.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod hci;
mod host;
mod packet;
mod radio;
mod serve;
mod server;

pub use host::{Device, Resources, run};
pub use radio::Radio;
