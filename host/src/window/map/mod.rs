//! The map: the building with the person in it, in perspective or flat.
//!
//! A [`Scene`] is made once of a building, an [`Overlay`] each time that something is known anew, a [`View`] is how somebody
//! looks at them and is kept from run to run. [`Map::show`] draws them into a window and tells what was pointed at.
//!
//! Nothing here waits or computes for long: the pictures are made on the graphics card, and only when something changed.

pub mod camera;
mod controls;
mod gauges;
mod glide;
pub mod keys;
mod lettering;
mod marks;
pub mod measure;
mod mesh;
pub mod overlay;
mod painter;
pub mod palette;
mod pins;
mod pointer;
mod ruler;
pub mod scene;
pub mod view;
mod widget;

pub use camera::{Camera, Projection};
pub use keys::KEYS;
pub(super) use mesh::hull;
pub use overlay::{Cloud, Foot, Overlay, Person, Role, Track};
pub use palette::Rgb;
pub use scene::{Place, Scene};
pub use view::{Layers, View};
pub use widget::{Map, Response};
