//! Distances that somebody measures on the map by clicking.

use super::lettering::Letters;
use super::palette::{Rgb, colour};
use super::scene::Place;
use super::widget::Scenery;
use eframe::egui::{Align2, Painter, Pos2, Stroke, vec2};

const ORANGE: Rgb = [0xf5, 0x7c, 0x00];

/// What is measured.
#[derive(Clone, Debug, Default)]
pub struct Ruler {
    on: bool,
    places: Vec<[f64; 3]>,
}

impl Ruler {
    /// Whether clicks measure.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Begins to measure, or ends it and forgets what was measured.
    pub fn switch(&mut self) {
        self.on = !self.on;
        self.places.clear();
    }

    /// One place more.
    pub fn add(&mut self, place: Option<&Place>) {
        self.places.extend(place.map(at));
    }

    /// Draws what was measured, and on to the pointer.
    pub(super) fn draw(
        &self,
        painter: &Painter,
        letters: &mut Letters<'_>,
        scenery: &Scenery<'_>,
        pointer: Option<&Place>,
    ) {
        if !self.on {
            return;
        }
        let places: Vec<[f64; 3]> = self.places.iter().copied().chain(pointer.map(at)).collect();
        let seen: Vec<Option<Pos2>> = places.iter().map(|&place| scenery.at(place)).collect();
        let mut total = 0.0;
        for (pair, ends) in seen.windows(2).zip(places.windows(2)) {
            let length = length(ends[0], ends[1]);
            total += length;
            let [Some(a), Some(b)] = [pair[0], pair[1]] else { continue };
            painter.line_segment([a, b], Stroke::new(4.0, colour(scenery.palette.halo)));
            painter.line_segment([a, b], Stroke::new(2.0, colour(ORANGE)));
            if places.len() > 2 && a.distance(b) > 60.0 {
                let text = format!("{length:.2} m");
                letters.word(&text, a.lerp(b, 0.5), Align2::CENTER_CENTER, 11.5, scenery.palette.ink);
            }
        }
        for &at in seen.iter().flatten() {
            painter.circle(at, 4.0, colour(scenery.palette.halo), Stroke::new(2.0, colour(ORANGE)));
        }
        if let (Some(Some(last)), true) = (seen.last(), places.len() > 1) {
            letters.badge(&format!("{total:.2} m"), *last + vec2(10.0, -8.0), Align2::LEFT_BOTTOM, ORANGE);
        }
    }
}

fn at(place: &Place) -> [f64; 3] {
    [place.point[0], place.point[1], place.height_m]
}

fn length(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}
