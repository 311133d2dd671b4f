//! From steps to a place on the floor plan.
//!
//! The building, and the three methods that put steps on it, each beside the one of its document: the particle filter, the
//! walk graph with its trackers, and steps with absolute positions. Also steps of a hand-held phone, which come to all three
//! like those of the shoe. No method knows another, a port or a window.

pub mod alignment;
pub mod building;
pub mod fixes;
pub mod graph;
pub mod particle;
pub mod phone;
pub mod sight;
