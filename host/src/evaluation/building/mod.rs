//! Scores of the methods that use a building: simulated walks with truth in generated buildings.
//!
//! [`walk`] makes the walks, [`follow`] lets the particle filter follow one and compares, [`suite`] puts the walks of the
//! document's evaluation (Foot, chapter 7) and of the project's own figures together.

pub mod follow;
pub mod suite;
pub mod walk;
