//! The better way: all steps and positions of the last minute are weighed anew with each position, and what is older is
//! remembered as what it says of the oldest of them.
//!
//! Start direction, step scale and heading drift are estimated with the places. A position may come late: it counts where it
//! was measured. One that is far off is an outlier with some probability, and counts with the rest of it ([`held`]); when
//! others bear it out later, it comes back. The work for a step does not grow with the walk.
//!
//! [`link`] is what a step says of two [`state`]s, [`held`] what a position says of one, [`chain`] solves for all of them,
//! [`window`] holds them, [`verdict`] explains what became of a position.
//!
//! # Source
//! Gauss-Newton with weights from a mixture of what is right and what is anywhere, on a window whose past is marginalised
//! by the Schur complement: Sibley, Matthies and Sukhatme, "Sliding window filter with application to planetary landing",
//! J. Field Robotics 27 (2010). Block elimination: Golub and Van Loan, "Matrix computations", 4.5.

mod chain;
mod held;
mod link;
mod parameters;
mod state;
#[cfg(test)]
mod tests;
pub mod verdict;
mod window;

pub use parameters::Parameters;
pub use verdict::{Outcome, Verdict};
pub use window::{Calibration, Settled, Smoother};
