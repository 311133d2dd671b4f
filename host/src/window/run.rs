//! The window on a display.

use super::App;
use super::engine::{Make, Opening};
use super::gpu::DITHERING;
use super::map::Map;
use eframe::egui::{ViewportBuilder, ViewportCommand};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Nothing to show it on.
    #[error(
        "there is no display: neither WAYLAND_DISPLAY nor DISPLAY is set; everything works without one too (see 'sohle --help'), \
         and 'sohle window --picture FILE.png' draws the window into a file"
    )]
    NoDisplay,
    /// The display cannot be used.
    #[error("the window cannot be opened: {0}; 'sohle window --picture FILE.png' draws it into a file")]
    Refused(String),
}

/// Whether there is a display, as far as can be told without asking it.
pub fn has_display() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || set("WAYLAND_DISPLAY") || set("DISPLAY")
}

/// What the window shows at first.
pub enum First {
    /// Something that it opens.
    Opening(Box<Opening>),
    /// Something of this name that somebody else makes.
    Made(String, Make),
}

/// Opens the window and returns when it is closed, or after so long.
///
/// # Errors
/// When there is no display, or it cannot be used.
pub fn window(first: Vec<First>, layout: Option<PathBuf>, duration: Option<Duration>) -> Result<(), Error> {
    if !has_display() {
        return Err(Error::NoDisplay);
    }
    let viewport = ViewportBuilder::default().with_title("Sohle").with_app_id("sohle").with_inner_size([1280.0, 800.0]);
    let options = eframe::NativeOptions { viewport, dithering: DITHERING, ..eframe::NativeOptions::default() };
    let begun = Instant::now();
    let made = eframe::run_native(
        "sohle",
        options,
        Box::new(move |creation| {
            let mut app = App::new(creation.wgpu_render_state.as_ref().map(Map::quick), layout).measured();
            for (index, first) in first.into_iter().enumerate() {
                match first {
                    First::Opening(opening) => app.open(*opening, &creation.egui_ctx, index > 0),
                    First::Made(name, make) => app.begin(name, make, &creation.egui_ctx, index > 0),
                }
            }
            app.shoes().select(0);
            if let Some(duration) = duration {
                let context = creation.egui_ctx.clone();
                std::thread::spawn(move || {
                    std::thread::sleep(duration.saturating_sub(begun.elapsed()));
                    context.send_viewport_cmd(ViewportCommand::Close);
                    context.request_repaint();
                });
            }
            Ok(Box::new(app))
        }),
    );
    made.map_err(|error| Error::Refused(error.to_string()))
}
