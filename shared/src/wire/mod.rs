//! The wire between shoe and laptop: every message once, its bytes, and what makes sure that each step arrives.
//!
//! A [`message`] is a postcard value with a checksum in a [`frame`]. A finished step is packed into 40 bytes
//! ([`packed`]), kept in the [`outbox`] of the shoe (in half as many) until the laptop of each [`port`] has acknowledged it,
//! and put in order by the laptop's [`inbox`]. [`link`] is the shoe's whole end of the wire; the laptop's is in the `sohle`
//! crate. Parameters and calibration, which are too long for a message, go in pieces ([`transfer`]).
//!
//! Both ends compile this module, so there is no second definition of anything; [`SCHEMA`] tells two ends apart that were
//! compiled from different ones.

pub mod bluetooth;
mod desk;
mod difference;
pub mod frame;
#[cfg(test)]
mod golden;
pub mod inbox;
mod lane;
#[cfg(test)]
mod laws;
pub mod link;
pub mod message;
pub mod outbox;
pub mod packed;
pub mod port;
mod shelf;
pub mod transfer;

use crate::calibration::Calibration;
use crate::tracker::Parameters;
use message::{FromShoe, ToShoe};
use postcard_schema::key::hash::fnv1a64::hash_ty_path;

/// Counts up when a message changes its meaning but not its fields, which [`SCHEMA`] would not show.
pub const PROTOCOL: u16 = 1;

/// Hash over the names and types of all fields of all messages, of the tracker's parameters and of the calibration.
pub const SCHEMA: u64 = u64::from_le_bytes(hash_ty_path::<(FromShoe, ToShoe, Parameters, Calibration)>("sohle/wire"));
