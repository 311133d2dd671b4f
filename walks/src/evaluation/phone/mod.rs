//! Scores of walks with a phone in the hand, in buildings whose plan is known: recordings with surveyed way-points.
//!
//! [`walk`] finds the recordings with their plans, [`path`] compares a path in time with way-points, [`suite`] puts dead
//! reckoning and the particle filter side by side.

pub mod path;
pub mod suite;
pub mod walk;
