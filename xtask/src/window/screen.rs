//! A display without a screen, and what is to be seen on it.

use super::file;
use crate::process::Failure;
use std::io::{BufRead, BufReader};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Of the display. **Units:** px.
const SIZE: [usize; 2] = [1280, 800];
/// The part of the window that shows the map, in its usual layout. **Units:** px.
const MAP: [Range<usize>; 2] = [160..900, 60..540];

/// A display that nobody sees; it ends with the program.
pub struct Screen {
    server: Child,
    name: String,
    memory: PathBuf,
}

impl Screen {
    /// Starts it; its memory is a file in `folder`.
    pub fn start(folder: &Path) -> Result<Self, Failure> {
        let program = "Xvfb";
        let started = |source| Failure::NotStarted { program: program.into(), source };
        let mut command = Command::new(program);
        let [width, height] = SIZE;
        command.args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0", &format!("{width}x{height}x24")]);
        command.arg("-fbdir").arg(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut server = command.spawn().map_err(started)?;
        // It tells the number of its display as soon as it listens.
        let mut number = String::new();
        if let Some(out) = server.stdout.take() {
            BufReader::new(out).read_line(&mut number).map_err(started)?;
        }
        let name = format!(":{}", number.trim());
        let screen = Self { server, name, memory: folder.join("Xvfb_screen0") };
        if number.trim().is_empty() { Err(Failure::Found("Xvfb does not start".into())) } else { Ok(screen) }
    }

    /// As programs know it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What is to be seen now.
    pub fn picture(&self) -> Result<Picture, Failure> {
        let bytes = std::fs::read(&self.memory).map_err(|source| file(&self.memory, source))?;
        Picture::read(&bytes).ok_or_else(|| Failure::Found(format!("{} is no picture", self.memory.display())))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // Killing fails only for a child that has just ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Pixels from the upper left: red, green, blue.
pub struct Picture {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

/// How many pixels of the map have the colour of something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Colours {
    /// Of walls.
    pub walls: usize,
    /// Of particles.
    pub particles: usize,
    /// Of the path.
    pub path: usize,
}

impl Colours {
    /// Whether there is as much of everything.
    pub fn reaches(&self, least: Self) -> bool {
        self.walls >= least.walls && self.particles >= least.particles && self.path >= least.path
    }

    fn add(&mut self, [red, green, blue]: [u8; 3]) {
        let [r, g, b] = [red, green, blue].map(i32::from);
        // Tops of walls are slate, their sides lighter; particles are green, on whatever they shine through; the path is red.
        if (60..150).contains(&r.min(g).min(b)) && (b - r) > 8 && (b - r) < 40 && (g - r).abs() < 20 {
            self.walls += 1;
        } else if g - r > 50 && g - b > 30 {
            self.particles += 1;
        } else if r - g > 110 && r - b > 110 {
            self.path += 1;
        }
    }
}

impl Picture {
    /// From the dump of a window that the server keeps (`XWDFile.h` of the X Window System, version 7): 25 numbers, a name, a
    /// table of colours, and the pixels, of which these are read: 32 bits, the least significant byte first.
    fn read(bytes: &[u8]) -> Option<Self> {
        let number = |index: usize| {
            let word = bytes.get(4 * index..4 * index + 4)?;
            Some(u32::from_be_bytes([word[0], word[1], word[2], word[3]]) as usize)
        };
        let (header, version, width, height) = (number(0)?, number(1)?, number(4)?, number(5)?);
        let (order, bits, line, colours) = (number(7)?, number(11)?, number(12)?, number(19)?);
        if (version, order, bits) != (7, 0, 32) || width * 4 > line {
            return None;
        }
        let rows = bytes.get(header + 12 * colours..)?.chunks_exact(line).take(height);
        let pixels: Vec<[u8; 3]> =
            rows.flat_map(|row| row[..4 * width].chunks_exact(4).map(|pixel| [pixel[2], pixel[1], pixel[0]])).collect();
        (pixels.len() == width * height).then_some(Self { width, pixels })
    }

    /// What there is on the map.
    pub fn colours(&self) -> Colours {
        let mut colours = Colours::default();
        let [across, down] = MAP;
        for row in self.pixels.chunks_exact(self.width).take(down.end).skip(down.start) {
            row.iter().take(across.end).skip(across.start).for_each(|pixel| colours.add(*pixel));
        }
        colours
    }

    /// Writes it as PNG.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let out = std::fs::File::create(path).map_err(|source| file(path, source))?;
        let mut encoder = png::Encoder::new(out, self.width as u32, (self.pixels.len() / self.width) as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(self.pixels.as_flattened()));
        written.map_err(|error| Failure::Found(format!("{}: {error}", path.display())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dump of one colour.
    fn dump([red, green, blue]: [u8; 3]) -> Vec<u8> {
        let [width, height] = SIZE.map(|side| side as u32);
        let mut words = [0_u32; 25];
        words[0] = 104;
        (words[1], words[4], words[5], words[11], words[12], words[19]) = (7, width, height, 32, 4 * width, 2);
        let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        bytes.extend([0; 4 + 2 * 12]);
        bytes.extend([blue, green, red, 0].repeat((width * height) as usize));
        bytes
    }

    #[test]
    fn each_colour_is_counted_for_what_it_is() {
        let all = MAP.map(|range| range.len()).iter().product();
        let of = |rgb| Picture::read(&dump(rgb)).unwrap().colours();
        assert_eq!(of([0x55, 0x5f, 0x6e]), Colours { walls: all, ..Colours::default() });
        assert_eq!(of([0x16, 0xa3, 0x4a]), Colours { particles: all, ..Colours::default() });
        assert_eq!(of([0xdc, 0x26, 0x26]), Colours { path: all, ..Colours::default() });
        // The ground, words, the corrected path, a staircase.
        for other in [[0xfd, 0xfd, 0xfc], [0x1d, 0x23, 0x2b], [0x1f, 0x5f, 0xd6], [0xf6, 0xe3, 0xb4]] {
            assert_eq!(of(other), Colours::default(), "{other:?}");
        }
    }

    #[test]
    fn what_is_no_dump_is_refused() {
        let whole = dump([1, 2, 3]);
        assert!(Picture::read(&whole[..whole.len() - 1]).is_none());
        assert!(Picture::read(&whole[..50]).is_none());
        assert!(Picture::read(&[0; 200]).is_none());
    }
}
