//! Colours of the map, on light and on dark ground.

use super::overlay::Role;
use eframe::egui::Color32;

/// Red, green, blue.
pub type Rgb = [u8; 3];

/// What a surface is: its number is the place of its colour in the palette of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Material {
    /// The floor where there is no room.
    Slab = 0,
    /// A room.
    Room = 1,
    /// A corridor or a hall.
    Passage = 2,
    /// Where stairs or a ramp are.
    Stairs = 3,
    /// Where an elevator is.
    Elevator = 4,
    /// The side of a floor.
    Edge = 5,
    /// The side of a wall.
    Wall = 6,
    /// The top of a wall.
    Cap = 7,
    /// A door.
    Door = 8,
    /// A step of stairs; stands farther apart when the floors do.
    Tread = 9,
    /// The ground around the building.
    Ground = 10,
    /// Lines on the ground.
    Grid = 11,
}

/// Number of materials.
pub const MATERIALS: usize = 12;

/// All colours of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette {
    /// Behind everything.
    pub background: Rgb,
    /// By [`Material`].
    pub materials: [Rgb; MATERIALS],
    /// Of particles.
    pub particles: Rgb,
    /// Around lines, so that they stand out.
    pub casing: Rgb,
    /// Of words.
    pub ink: Rgb,
    /// Of names of rooms.
    pub faint: Rgb,
    /// Behind words.
    pub halo: Rgb,
}

const LIGHT: Palette = Palette {
    background: [0xec, 0xef, 0xf3],
    materials: [
        [0xf3, 0xf4, 0xf6],
        [0xfd, 0xfd, 0xfc],
        [0xe9, 0xf0, 0xf8],
        [0xf6, 0xe3, 0xb4],
        [0xc9, 0xe6, 0xe1],
        [0xb3, 0xba, 0xc4],
        [0xb9, 0xc1, 0xcc],
        [0x55, 0x5f, 0x6e],
        [0xb9, 0x93, 0x62],
        [0xe2, 0xc3, 0x7c],
        [0xe4, 0xe8, 0xed],
        [0xd3, 0xd9, 0xe1],
    ],
    particles: [0x16, 0xa3, 0x4a],
    casing: [0xff, 0xff, 0xff],
    ink: [0x1d, 0x23, 0x2b],
    faint: [0x56, 0x60, 0x6d],
    halo: [0xff, 0xff, 0xff],
};

const DARK: Palette = Palette {
    background: [0x12, 0x15, 0x1a],
    materials: [
        [0x20, 0x25, 0x2c],
        [0x2a, 0x30, 0x39],
        [0x24, 0x2f, 0x3d],
        [0x54, 0x47, 0x2a],
        [0x22, 0x49, 0x49],
        [0x17, 0x1b, 0x21],
        [0x4c, 0x57, 0x66],
        [0x9b, 0xa8, 0xb9],
        [0x8d, 0x6e, 0x45],
        [0x86, 0x6f, 0x3d],
        [0x16, 0x1a, 0x20],
        [0x24, 0x2a, 0x33],
    ],
    particles: [0x3b, 0xdc, 0x77],
    casing: [0x0e, 0x11, 0x15],
    ink: [0xee, 0xf1, 0xf5],
    faint: [0xa4, 0xaf, 0xbd],
    halo: [0x14, 0x18, 0x1e],
};

impl Palette {
    /// Of a light or a dark window.
    pub fn of(dark: bool) -> &'static Self {
        if dark { &DARK } else { &LIGHT }
    }

    /// Of a way.
    pub fn role(&self, role: Role) -> Rgb {
        let dark = self.background[0] < 0x80;
        match (role, dark) {
            (Role::Truth, false) => [0x26, 0x2c, 0x36],
            (Role::Truth, true) => [0xd7, 0xdd, 0xe6],
            (Role::Free, false) => [0x8b, 0x3f, 0xd9],
            (Role::Free, true) => [0xb8, 0x84, 0xf5],
            (Role::Other, false) => [0xd9, 0x77, 0x06],
            (Role::Other, true) => [0xf5, 0xa5, 0x3b],
            (Role::Corrected, false) => [0x1f, 0x5f, 0xd6],
            (Role::Corrected, true) => [0x5b, 0x9b, 0xff],
            (Role::Estimate, false) => [0xdc, 0x26, 0x26],
            (Role::Estimate, true) => [0xff, 0x5c, 0x5c],
        }
    }
}

/// For the painter of words and marks.
pub fn colour([red, green, blue]: Rgb) -> Color32 {
    Color32::from_rgb(red, green, blue)
}

/// From 0 to 1, for the shader.
pub fn shares(rgb: Rgb) -> [f32; 3] {
    rgb.map(|channel| f32::from(channel) / 255.0)
}
