//! The picture as pixels, with a font of our own: a fresh machine may have none.

use super::ExportError;
use ::png::{ColorType, Compression, Encoder, EncodingError, Filter};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::sync::Arc;

/// Pixels for each unit of the drawing: sharp on dense screens too.
const DENSITY: f32 = 1.25;

/// Family of the font that is built in.
const FAMILY: &str = "Ubuntu";

/// The drawing as a PNG file.
pub fn render(svg: &str) -> Result<Vec<u8>, ExportError> {
    let mut options = Options { font_family: FAMILY.to_owned(), ..Options::default() };
    let fonts = Arc::make_mut(&mut options.fontdb);
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    fonts.set_sans_serif_family(FAMILY);
    let tree = Tree::from_str(svg, &options).map_err(|error| ExportError::Draw(error.to_string()))?;
    let size = tree.size().to_int_size().scale_by(DENSITY).ok_or_else(|| ExportError::Draw("it is empty".into()))?;
    let mut pixels = Pixmap::new(size.width(), size.height())
        .ok_or_else(|| ExportError::Draw(format!("{} x {} pixels are too many", size.width(), size.height())))?;
    resvg::render(&tree, Transform::from_scale(DENSITY, DENSITY), &mut pixels.as_mut());
    encode(&pixels).map_err(|error| ExportError::Draw(error.to_string()))
}

/// The pixels as a file. A drawing is opaque and full of even areas: without transparency and without a filter it takes
/// a third less than as photographs are stored.
fn encode(pixels: &Pixmap) -> Result<Vec<u8>, EncodingError> {
    let opaque: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect();
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, pixels.width(), pixels.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_compression(Compression::High);
    // After the compression, which brings a filter of its own.
    encoder.set_filter(Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&opaque)?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_drawn_without_any_font_on_the_machine() {
        let page = |text: &str| {
            format!(
                r#"<svg xmlns="http://www.w3.org/2000/svg" width="80" height="30"><rect width="80" height="30" fill="white"/><text x="5" y="20">{text}</text></svg>"#
            )
        };
        let (blank, written) = (render(&page("")).unwrap(), render(&page("Sohle")).unwrap());
        assert!(written.starts_with(b"\x89PNG"));
        assert_ne!(blank, written);
    }
}
