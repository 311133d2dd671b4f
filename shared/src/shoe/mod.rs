//! What the shoe does, without the board it runs on.
//!
//! The [`Pipeline`] makes steps of what the driver reads. `Shoe` (feature `wire`) is the whole application around it: it
//! gives the steps to the laptop, carries out what the laptop asks for, and says how it is. A board adds pins, interrupts,
//! a clock and a place to keep values, and nothing that decides.

#[cfg(feature = "wire")]
mod application;
#[cfg(feature = "wire")]
mod frames;
mod pipeline;

#[cfg(feature = "wire")]
pub use application::{Health, Shoe};
pub use pipeline::{Pipeline, celsius};
