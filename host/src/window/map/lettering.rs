//! Words on the map: none over another, each with a rim that keeps it readable.

use super::camera::Projection;
use super::palette::{Palette, Rgb, colour};
use super::scene::Label;
use super::widget::Scenery;
use eframe::egui::{Align2, Color32, FontId, Galley, Painter, Pos2, Rect, Vec2, vec2};
use std::sync::Arc;

/// More names are not written at a time.
const MOST_NAMES: usize = 250;
/// **Units:** points.
const NAME_SIZE: f32 = 11.5;
const SMALLEST_SIZE: f32 = 9.0;

/// What writes on a map, and where something is written already.
pub struct Letters<'a> {
    painter: &'a Painter,
    palette: &'a Palette,
    rect: Rect,
    /// Rims are drawn in all directions, not in every other.
    fine: bool,
    taken: Vec<Rect>,
}

impl<'a> Letters<'a> {
    /// On a map where nothing is written yet.
    pub fn new(painter: &'a Painter, palette: &'a Palette, rect: Rect, fine: bool) -> Self {
        Self { painter, palette, rect, fine, taken: Vec::new() }
    }

    /// Keeps a part of the map free.
    pub fn take(&mut self, rect: Rect) {
        self.taken.push(rect);
    }

    fn is_free(&self, rect: Rect) -> bool {
        self.rect.contains_rect(rect) && !self.taken.iter().any(|taken| taken.intersects(rect))
    }

    fn galley(&self, text: &str, size: f32, rgb: Rgb) -> Arc<Galley> {
        self.painter.layout_no_wrap(text.to_owned(), FontId::proportional(size), colour(rgb))
    }

    /// Writes with a rim, wherever something is written already.
    fn write(&mut self, galley: &Arc<Galley>, at: Pos2) {
        let rim = colour(self.palette.halo).gamma_multiply(0.8);
        let offsets =
            [[-0.7, -0.7], [0.7, 0.7], [-0.7, 0.7], [0.7, -0.7], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]];
        for offset in offsets.into_iter().take(if self.fine { 8 } else { 4 }) {
            self.painter.galley_with_override_text_color(at + Vec2::from(offset), galley.clone(), rim);
        }
        self.painter.galley(at, galley.clone(), Color32::PLACEHOLDER);
        self.taken.push(Rect::from_min_size(at, galley.size()).expand(2.0));
    }

    /// A word at a place, if there is room for it. Tells whether there was.
    pub fn word(&mut self, text: &str, at: Pos2, anchor: Align2, size: f32, rgb: Rgb) -> bool {
        let galley = self.galley(text, size, rgb);
        let rect = anchor.anchor_size(at, galley.size());
        let free = self.is_free(rect);
        if free {
            self.write(&galley, rect.min);
        }
        free
    }

    /// A word on a badge of a colour, whatever is there.
    pub fn badge(&mut self, text: &str, at: Pos2, anchor: Align2, rgb: Rgb) -> Rect {
        let bright = rgb.iter().zip([299, 587, 114]).map(|(&channel, part)| u32::from(channel) * part).sum::<u32>();
        let ink = if bright > 150_000 { [0x10, 0x14, 0x1a] } else { [0xff, 0xff, 0xff] };
        let galley = self.galley(text, 12.0, ink);
        let rect = anchor.anchor_size(at, galley.size() + vec2(12.0, 6.0));
        self.painter.rect_filled(rect.expand(1.5), 9.0, colour(self.palette.halo).gamma_multiply(0.9));
        self.painter.rect_filled(rect, 8.0, colour(rgb));
        self.painter.galley(rect.min + vec2(6.0, 3.0), galley, colour(ink));
        self.taken.push(rect.expand(2.0));
        rect
    }
}

/// Names of floors and rooms: of rooms only on the highest floor that is drawn whole, where nothing covers them.
pub fn names(letters: &mut Letters<'_>, scenery: &Scenery<'_>) {
    let storeys = scenery.scene.storeys();
    let Some(highest) = (0..storeys.len()).rev().find(|&index| scenery.is_whole(index)) else { return };
    if scenery.view.projection == Projection::Orbit && storeys.len() > 1 {
        floors(letters, scenery);
    }
    let storey = &storeys[highest];
    for label in storey.labels.iter().take(MOST_NAMES) {
        name(letters, scenery, label, storey.height_m);
    }
}

/// The name of each floor, beside the corner that is farthest left.
fn floors(letters: &mut Letters<'_>, scenery: &Scenery<'_>) {
    for (index, storey) in scenery.scene.storeys().iter().enumerate().rev() {
        if !scenery.is_whole(index) {
            continue;
        }
        let corners = storey.hull.iter().filter_map(|[x, y]| scenery.at([*x, *y, storey.height_m]));
        if let Some(corner) = corners.min_by(|a, b| a.x.total_cmp(&b.x)) {
            let at = corner - vec2(7.0, 0.0);
            letters.word(&storey.name, at, Align2::RIGHT_CENTER, 13.0, scenery.palette.ink);
        }
    }
}

/// The name of a room, if it fits into it.
fn name(letters: &mut Letters<'_>, scenery: &Scenery<'_>, label: &Label, height_m: f64) {
    let [x, y] = label.at;
    let half = [label.size[0] / 2.0, label.size[1] / 2.0];
    let Some(at) = scenery.at([x, y, height_m]) else { return };
    if !letters.rect.contains(at) {
        return;
    }
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let seen: Vec<Pos2> = corners
        .iter()
        .filter_map(|[east, north]| scenery.at([x + east * half[0], y + north * half[1], height_m]))
        .collect();
    if seen.len() < corners.len() {
        return;
    }
    // Of a room that is seen turned, the box around it has more room than it has itself.
    let room = Rect::from_points(&seen).size() * 0.85;
    let letters_across = label.text.chars().count().max(1) as f32 * 0.52;
    let size = (room.x / letters_across).min(room.y * 0.7).min(NAME_SIZE);
    if size >= SMALLEST_SIZE {
        letters.word(&label.text, at, Align2::CENTER_CENTER, size, scenery.palette.faint);
    }
}
