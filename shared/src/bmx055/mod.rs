//! The BMX055: three dies in one package, of which two feed the tracker.
//!
//! The accelerometer, the gyroscope and the magnetometer each have a chip select, registers and a clock of their own; the
//! package only holds them together. The [`driver`] sets them up as the [`config`] says and reads their FIFOs.
//! Everything that comes out of it is a [`Batch`]; the [`Merger`] finds out when its frames were taken, and makes of the
//! batches of both dies the samples that the tracker takes.
//!
//! While the shoe stands, both can sleep until something moves ([`Bmx055::sleep`]).
//!
//! [`twin`] is the sensor without the sensor; [`blocking`] is for those whose bus is not asynchronous.

pub mod batch;
pub mod blocking;
mod channel;
mod clock;
pub mod config;
pub mod counts;
pub mod driver;
pub mod merger;
mod port;
pub mod registers;
#[cfg(test)]
mod rig;
mod sleep;
#[cfg(test)]
mod sleep_tests;
pub mod trial;
pub mod twin;

pub use batch::{BATCH_FRAMES, Batch, Die, DieCounters};
pub use channel::State;
pub use config::Config;
pub use driver::Bmx055;
pub use merger::Merger;
pub use port::Error;
