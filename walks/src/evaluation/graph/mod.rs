//! The document's comparison (Graph, 7.5) on many walks: plain dead reckoning, the documented tracker on the graph, the
//! matcher, and the particle filter follow the same steps.
//!
//! [`walks`] makes simulated walks of a phone in the committed buildings, [`follow`] lets each method follow one, [`suite`] puts
//! them side by side, [`eight`] does the same on a recorded walk with surveyed way-points.

pub mod eight;
pub mod follow;
pub mod suite;
pub mod walks;
