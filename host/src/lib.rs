//! The laptop's side of Sohle: recordings, simulation, tracks, scores.

pub mod cli;
pub mod evaluation;
pub mod export;
pub mod recording;
pub mod simulation;
pub mod track;
