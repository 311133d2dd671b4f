//! The firmware of the shoe on real boards.
//!
//! What it does is in `sohle-shared`; here are the pins, DMA, interrupts and what depends on a real processor: which
//! board ([`board`]), how busy it is ([`executor`]), how deep its stack was ([`stack`]), why it stopped last time
//! ([`kept`]). Which board is chosen by one of the features `board-wb55` and `board-f405`.
#![no_std]

#[cfg(not(any(feature = "board-wb55", feature = "board-f405")))]
compile_error!("choose a board: --features board-wb55 or --features board-f405");
#[cfg(all(feature = "board-wb55", feature = "board-f405"))]
compile_error!("choose one board: board-wb55 and board-f405 exclude each other");

pub mod board;
pub mod executor;
mod fault;
pub mod kept;
#[cfg(feature = "ble")]
pub mod radio;
pub mod sensor;
pub mod settings;
pub mod stack;

use defmt_rtt as _;
