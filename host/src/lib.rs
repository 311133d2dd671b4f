//! The program `sohle`: its commands, the link to the shoe, the window; and by their names what it works with, so that a test
//! finds all of the laptop's side here.

pub use sohle_map::{alignment, building, fixes, graph, particle, phone, sight};
pub use sohle_walks::{calibration, evaluation, export, follow, gravity, recording, simulation, toml_file, track};

pub mod cli;
pub mod link;
pub mod serve;
#[cfg(feature = "window")]
pub mod window;
