//! Drawing on the graphics card into a picture of one's own, which the window then shows.
//!
//! A view that did not change is not drawn again: the picture of it is still there. It has several samples a pixel and
//! a depth of its own, whatever the window has.

mod frames;
pub mod offscreen;
mod pane;
mod pipeline;
mod target;

pub use frames::{Frame, Frames};
pub use pane::Pane;
pub use pipeline::{Blend, Depth, Kind, Layer, Pipelines, uniform};
pub use target::{Care, Target};

use eframe::egui::{Rgba, Visuals};
use eframe::wgpu::TextureFormat;

/// What the window draws with: device, queue, and the painter of the controls.
pub use eframe::egui_wgpu::RenderState;

/// Nothing in the window shades from one colour into another, so nothing is gained by noise in each pixel.
pub const DITHERING: bool = false;

/// What is behind everything in a window of this format, as it is cleared: nothing needs to be filled with it then.
pub fn background(visuals: &Visuals, format: TextureFormat) -> [f32; 4] {
    // A window of the other kind takes amounts of light.
    let fill = visuals.panel_fill;
    if format.is_srgb() { Rgba::from(fill).to_array() } else { fill.to_normalized_gamma_f32() }
}
