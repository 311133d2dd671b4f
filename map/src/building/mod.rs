//! The building: what every method that uses a map works on.
//!
//! A [`Building`] has floors with walls, doors and rooms, and what joins the floors: stairs, ramps, elevators. All formats
//! become one: [`geojson`] is the project's own, which any GIS shows and edits; each other reader is a file of its own, and [`open`]
//! recognises which. [`generate`] makes buildings for evaluation, [`route`] finds ways through one.
//!
//! # Frame
//! x east, y north, z up from the origin of the building, in metres. [`Georeference`] tells where that is.

pub mod check;
pub mod dxf;
mod edge;
pub mod error;
mod features;
pub mod generate;
pub mod geojson;
pub mod geometry;
pub mod georeference;
pub mod hcu;
pub mod imdf;
pub(crate) mod index;
pub mod merge;
mod model;
pub mod open;
pub mod opening;
pub mod osm;
pub mod ros;
pub mod route;
#[cfg(test)]
mod same;
mod stacked;
pub mod xyz10;

pub use error::Error;
pub use geometry::{Outline, Point, Segment};
pub use georeference::Georeference;
pub use model::{Building, Connector, ConnectorKind, Door, Entrance, Floor, Node, Room, WalkGraph};
