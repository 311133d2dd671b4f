//! The window: what is known of the person, drawn as it becomes known.
//!
//! [`engine`] computes, in a thread of its own; [`app`] shows what it hands on, and computes nothing. [`map`] shows the
//! building with the person in it, [`cube`] the attitude of the shoe; [`gpu`] is what both draw with.

pub mod app;
mod arrangement;
pub mod cube;
mod dialogs;
pub mod engine;
pub mod gpu;
mod help;
mod latencies;
pub mod layout;
pub mod map;
pub mod measure;
mod parameters;
pub mod picture;
mod plots;
pub mod run;
pub mod saving;
mod selector;
pub mod shoes;
pub mod status;
mod toolbar;

#[cfg(test)]
mod tests;

pub use app::App;
