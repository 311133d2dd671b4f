//! Steps and positions together, scored: the document's comparison (Fix, 3.4), and more.
//!
//! [`eight`] is the recorded walk with positions as 5G would tell them, thinned and scored at surveyed way-points; [`walks`]
//! are simulated ones with known truth, noise, outliers and biases; [`mall`] are recorded walks with simulated positions; [`ranges`] are recorded ranges of UWB; [`pace`] is a walk of
//! hours, to be timed.

pub mod eight;
mod figures;
pub mod mall;
pub mod pace;
pub mod ranges;
pub mod walks;

pub use figures::{Bounds, Figures, live};
