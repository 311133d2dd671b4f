//! The laptop's side of Sohle: the wire to the shoe, recordings, simulation, tracks, scores.

pub mod building;
pub mod calibration;
pub mod cli;
pub mod evaluation;
pub mod export;
pub mod fixes;
pub mod follow;
pub mod graph;
pub mod gravity;
pub mod link;
pub mod particle;
pub mod phone;
pub mod recording;
pub mod serve;
pub mod simulation;
pub mod toml_file;
pub mod track;
#[cfg(feature = "window")]
pub mod window;
