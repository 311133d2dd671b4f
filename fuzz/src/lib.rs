//! What is fuzzed: for each target a function of bytes that panics when a promise is broken, and some inputs to begin with.
//!
//! A target is a file here and a program of the same name in `bin/`; `cargo xtask fuzz` builds and runs them. The promise
//! is always more than that nothing panics: what was decoded must be fit for use, what was sent must arrive once.
#![forbid(unsafe_code)]

pub mod building;
pub mod fifo;
pub mod frame;
pub mod from_shoe;
pub mod importers;
pub mod inbox;
pub mod line;
pub mod parameters;
pub mod script;
pub mod seeds;
pub mod to_shoe;
