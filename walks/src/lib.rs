//! Walks: recorded, simulated, tracked, followed through a building, scored against truth, exported.
//!
//! Everything that the program does with a whole walk and without a shoe, a terminal or a window; tests and fuzzing use it as
//! the program does.

pub use sohle_map::{alignment, building, fixes, graph, particle, phone, sight};

pub mod calibration;
pub mod evaluation;
pub mod export;
pub mod follow;
pub mod gravity;
pub mod recording;
pub mod simulation;
pub mod toml_file;
pub mod track;
