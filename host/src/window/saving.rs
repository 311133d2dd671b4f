//! Pictures of the window as files.

use crate::export::file;
use eframe::egui::{self, ColorImage, Context, Event, UserData, ViewportCommand};
use std::path::PathBuf;
use std::time::SystemTime;

/// A file in the present folder that says when it was made.
pub fn name(begin: &str, extension: &str) -> PathBuf {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    PathBuf::from(format!("{begin}-{}.{extension}", since.as_secs()))
}

/// Asks for a picture of the window; it comes with one of the next frames.
pub fn ask_screenshot(context: &Context) {
    context.send_viewport_cmd(ViewportCommand::Screenshot(UserData::default()));
}

/// Writes the picture, when it has come. What there is to tell.
pub fn screenshot(context: &Context) -> Option<String> {
    let image = context.input(|input| {
        input.events.iter().find_map(|event| match event {
            Event::Screenshot { image, .. } => Some(image.clone()),
            _ => None,
        })
    })?;
    let path = name("sohle-window", "png");
    let told = encode(&image).and_then(|bytes| file::write(&path, &bytes).map_err(|error| error.to_string()));
    Some(match told {
        Ok(()) => format!("the picture is in {}", path.display()),
        Err(error) => format!("no picture: {error}"),
    })
}

/// A picture as PNG.
pub fn encode(image: &ColorImage) -> Result<Vec<u8>, String> {
    let [width, height] = image.size.map(|pixels| pixels as u32);
    let pixels: Vec<u8> = image.pixels.iter().flat_map(egui::Color32::to_array).collect();
    rgba([width, height], &pixels)
}

/// The same from bytes: red, green, blue, opacity of each pixel.
pub fn rgba([width, height]: [u32; 2], pixels: &[u8]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels));
    written.map(|()| bytes).map_err(|error| error.to_string())
}
