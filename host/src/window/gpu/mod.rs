//! Drawing on the graphics card into a picture of one's own, which the window then shows like any other.
//!
//! A view that did not change is not drawn again: the picture of it is still there. It has several samples a pixel and
//! a depth of its own, whatever the window has.

mod frames;
pub mod offscreen;
mod pipeline;
mod target;

pub use frames::{Frame, Frames};
pub use pipeline::{Blend, Depth, Kind, Pipelines, uniform};
pub use target::{Care, Target};

/// What the window draws with: device, queue, and the painter of the controls.
pub use eframe::egui_wgpu::RenderState;

/// Nothing in the window shades from one colour into another, so nothing is gained by noise in each pixel.
pub const DITHERING: bool = false;
