//! Scores of the methods that use a building: simulated walks with truth in generated buildings.
//!
//! [`walk`] makes the walks, [`follow`] lets the particle filter follow one and compares. [`suite`] is the document's
//! evaluation (Foot, chapter 7), [`unknown`] the project's own figures over many walks.

pub mod follow;
pub mod suite;
pub mod unknown;
pub mod walk;
