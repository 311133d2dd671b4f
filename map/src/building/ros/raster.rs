//! The image of a map: which pixels are occupied.
//!
//! # Source
//! Netpbm, the PGM format (`P2` and `P5`); ROS map_server, interpretation of the values.

use super::info::{Info, Mode};
use std::io::Cursor;

/// More pixels than this no map has: 8 000 in a square, 400 m at 5 cm.
const MOST_PIXELS: usize = 64_000_000;

/// Occupied or not, cell by cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    /// Row by row from the lowest, each from the left.
    pub occupied: Vec<bool>,
}

/// Shades from 0 to 255, row by row from the highest.
struct Shades {
    width: usize,
    height: usize,
    values: Vec<u8>,
}

impl Raster {
    /// The map in the bytes of an image.
    ///
    /// # Errors
    /// When it is neither PGM nor PNG, is cut short, or is too large.
    pub fn read(bytes: &[u8], info: &Info) -> Result<Self, String> {
        let shades = if bytes.starts_with(b"\x89PNG") {
            png(bytes)?
        } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
            pgm(bytes)?
        } else {
            return Err("its image is neither PGM nor PNG".to_owned());
        };
        let is_occupied = |value: u8| match info.mode {
            Mode::Raw => value <= 100 && f64::from(value) >= info.occupied * 100.0,
            Mode::Shades => {
                let darkness = if info.is_negated { value } else { 255 - value };
                f64::from(darkness) / 255.0 > info.occupied
            }
        };
        let table: Vec<bool> = (0..=255).map(is_occupied).collect();
        let rows = shades.values.chunks_exact(shades.width).rev();
        let occupied = rows.flatten().map(|value| table[usize::from(*value)]).collect();
        Ok(Self { width: shades.width, height: shades.height, occupied })
    }

    /// Whether a cell is occupied; nothing is beyond the border.
    pub fn at(&self, [x, y]: [i64; 2]) -> bool {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return false };
        x < self.width && y < self.height && self.occupied[y * self.width + x]
    }
}

fn sized(width: usize, height: usize) -> Result<usize, String> {
    let count = width.checked_mul(height).filter(|count| (1..=MOST_PIXELS).contains(count));
    count.ok_or_else(|| format!("its image has {width} x {height} pixels; expected one to {MOST_PIXELS}"))
}

fn pgm(bytes: &[u8]) -> Result<Shades, String> {
    let mut next = 2;
    let cut = || "its image is cut short".to_owned();
    let [width, height, most] = [number(bytes, &mut next), number(bytes, &mut next), number(bytes, &mut next)];
    let (Some(width), Some(height), Some(most)) = (width, height, most) else {
        return Err("its image has no width, height and greatest value".to_owned());
    };
    let count = sized(width, height)?;
    if !(1..=65_535).contains(&most) {
        return Err(format!("the greatest value of its image is {most}; expected 1 to 65535"));
    }
    let scaled = |value: usize| (value.min(most) * 255 / most) as u8;
    let values = if bytes.starts_with(b"P2") {
        (0..count).map(|_| number(bytes, &mut next).map(scaled)).collect::<Option<Vec<u8>>>().ok_or_else(cut)?
    } else {
        let wide = if most > 255 { 2 } else { 1 };
        // A single white space stands before the values.
        let data = bytes.get(next + 1..next + 1 + count * wide).ok_or_else(cut)?;
        let value = |pixel: &[u8]| pixel.iter().fold(0, |value, byte| value << 8 | usize::from(*byte));
        data.chunks_exact(wide).map(|pixel| scaled(value(pixel))).collect()
    };
    Ok(Shades { width, height, values })
}

/// The next number of a PGM header, after white space and comments.
fn number(bytes: &[u8], next: &mut usize) -> Option<usize> {
    loop {
        match bytes.get(*next)? {
            b'#' => *next += bytes[*next..].iter().position(|byte| *byte == b'\n')? + 1,
            byte if byte.is_ascii_whitespace() => *next += 1,
            _ => break,
        }
    }
    let length = bytes[*next..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let digits = std::str::from_utf8(&bytes[*next..*next + length]).ok()?;
    *next += length;
    digits.parse().ok()
}

fn png(bytes: &[u8]) -> Result<Shades, String> {
    let wrong = |error: png::DecodingError| format!("its image: {error}");
    let limits = png::Limits { bytes: 4 * MOST_PIXELS };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(wrong)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    sized(width, height)?;
    let size = reader.output_buffer_size().ok_or("its image is too large")?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(wrong)?;
    let (samples, has_alpha) = match frame.color_type {
        png::ColorType::Grayscale => (1, false),
        png::ColorType::GrayscaleAlpha => (2, true),
        png::ColorType::Rgb => (3, false),
        png::ColorType::Rgba => (4, true),
        png::ColorType::Indexed => return Err("its image has a palette that is not resolved".to_owned()),
    };
    let colours = samples - usize::from(has_alpha);
    let mean = |pixel: &[u8]| {
        let sum: usize = pixel[..colours].iter().map(|value| usize::from(*value)).sum();
        (sum / colours) as u8
    };
    let rows = data.chunks_exact(frame.line_size).take(height);
    let values: Vec<u8> = rows.flat_map(|row| row.chunks_exact(samples).take(width).map(mean)).collect();
    if values.len() == width * height {
        return Ok(Shades { width, height, values });
    }
    Err("its image is cut short".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(mode: Mode) -> Info {
        Info { image: String::new(), resolution_m: 0.05, origin: [0.0; 3], occupied: 0.65, is_negated: false, mode }
    }

    #[test]
    fn all_forms_of_an_image_say_the_same() {
        // Occupied at the lower left and the upper right.
        let expected = Raster { width: 3, height: 2, occupied: vec![true, false, false, false, false, true] };
        let mut picture = Vec::new();
        let mut encoder = png::Encoder::new(&mut picture, 3, 2);
        encoder.set_color(png::ColorType::Rgba);
        let colours = [254_u8, 205, 0, 10, 254, 254].map(|value| [value, value, value, 255]).concat();
        encoder.write_header().unwrap().write_image_data(&colours).unwrap();
        let images: [&[u8]; 4] = [
            b"P5\n# made by hand\n3 2\n255\n\xfe\xcd\x00\x0a\xfe\xfe",
            b"P2 3 2 100\n99 80 0\n4 99 100 ",
            b"P5 3 2 65535\n\xfe\x00\xcd\x00\x00\x00\x0a\x00\xfe\x00\xfe\x00",
            &picture,
        ];
        for image in images {
            assert_eq!(Raster::read(image, &info(Mode::Shades)).unwrap(), expected);
        }
        let raw = Raster::read(b"P5 3 2 255\n\x00\xff\x64\x42\x00\x00", &info(Mode::Raw)).unwrap();
        assert_eq!(raw, expected);
        let negated = Info { is_negated: true, ..info(Mode::Shades) };
        let raster = Raster::read(b"P5 3 2 255\n\x00\x00\xff\xf5\x00\x00", &negated).unwrap();
        assert_eq!(raster, expected);
        assert!(!expected.at([-1, 0]) && !expected.at([3, 0]) && expected.at([2, 1]));
    }

    #[test]
    fn what_is_no_image_is_told() {
        let message = |bytes: &[u8]| Raster::read(bytes, &info(Mode::Shades)).unwrap_err();
        assert!(message(b"BM").contains("neither PGM nor PNG"));
        assert!(message(b"P5\n").contains("no width"));
        assert!(message(b"P5 99999999999 99999999999 255\n").contains("99999999999 x"));
        assert!(message(b"P5 0 9 255\n").contains("expected one"));
        assert!(message(b"P5 3 2 255\n\x00").contains("cut short"));
        assert!(message(b"P2 3 2 255\n1 2 3").contains("cut short"));
        assert!(message(b"P5 3 2 0\n\x00").contains("greatest value"));
        assert!(message(b"\x89PNG\r\n").contains("its image: "));
    }
}
