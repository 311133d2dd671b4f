//! Steps become a place on the floor plan: a particle filter on the building.
//!
//! A cloud of hypotheses, each a place, a floor and a heading, takes every step of the shoe. Those that walk through walls, or
//! climb where there are no stairs, lose their weight; after some turns one place is left, with its floor and its heading,
//! though none of them was known at the start.
//!
//! [`map`] is the building as the particles see it, [`start`] where they lie at first, [`filter`] the filter itself,
//! [`estimate`] what it says. Positions of other sources weigh the particles too ([`crate::sight`]). Both the document's method ([`parameters::Parameters::documented`]) and the default run here.
//!
//! # Frame
//! The building's: x east, y north, z up, in metres; headings counter-clockwise from east.
//!
//! # Source
//! Foot, chapter 5; where its formulas slip, SPEC section 8, decisions 3 to 6.

mod ancestry;
mod areas;
mod cloud;
pub mod cluster;
mod error;
pub mod estimate;
pub mod filter;
mod grid;
pub mod map;
mod motion;
pub mod parameters;
mod random;
mod resampling;
pub mod settings;
mod sight;
pub mod speed;
pub mod start;

pub use ancestry::PastPlace;
pub use areas::Outline;
pub use cloud::Particle;
pub use cluster::Cluster;
pub use error::Error;
pub use estimate::{Estimate, State};
pub use filter::ParticleFilter;
pub use grid::Wall;
pub use map::{Connector, ConnectorKind, Map, Plan};
pub use parameters::{Method, Parameters};
pub use start::{Start, StartPlace};
