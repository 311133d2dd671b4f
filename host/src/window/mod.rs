//! The window: what is known of the person, drawn as it becomes known.
//!
//! [`map`] shows the building with the person in it, [`cube`] the attitude of the shoe; [`gpu`] is what both draw with.

pub mod cube;
pub mod gpu;
pub mod map;
