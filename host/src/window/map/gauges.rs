//! What helps to read the map: scale, north, legend, and what is under the pointer.

use super::overlay::Role;
use super::palette::{Rgb, colour};
use super::scene::Place;
use super::widget::Scenery;
use eframe::egui::{Align2, FontId, Painter, Rect, Shape, Stroke, pos2, vec2};

/// A scale is at most so long. **Units:** points.
const LONGEST: f64 = 110.0;
/// A map that is narrower or lower shows only the scale. **Units:** points.
const ROOMY: (f32, f32) = (420.0, 260.0);

/// Draws them.
pub fn draw(painter: &Painter, scenery: &Scenery<'_>, hovered: Option<&Place>) {
    let rect = scenery.sight.rect();
    scale(painter, scenery, rect);
    if rect.width() < ROOMY.0 || rect.height() < ROOMY.1 {
        return;
    }
    north(painter, scenery, rect);
    legend(painter, scenery, rect);
    if let Some(place) = hovered {
        readout(painter, scenery, rect, place);
    }
}

/// The longest of 1, 2, 5 times a power of ten that is not longer than `most`.
fn round_length(most: f64) -> f64 {
    let ten = 10.0_f64.powf(most.log10().floor());
    [5.0, 2.0].into_iter().map(|factor| factor * ten).find(|length| *length <= most).unwrap_or(ten)
}

fn scale(painter: &Painter, scenery: &Scenery<'_>, rect: Rect) {
    let scale = scenery.sight.scale_at(scenery.sight.camera().target);
    let length = round_length(LONGEST / scale);
    let text = if length >= 1000.0 {
        format!("{} km", length / 1000.0)
    } else if length >= 1.0 {
        format!("{length} m")
    } else {
        format!("{:.0} cm", length * 100.0)
    };
    let right = rect.max - vec2(14.0, 12.0);
    let left = pos2(right.x - (length * scale) as f32, right.y);
    let tick = vec2(0.0, 5.0);
    for (width, rgb) in [(4.0, scenery.palette.halo), (1.6, scenery.palette.ink)] {
        let stroke = Stroke::new(width, colour(rgb));
        painter.add(Shape::line(vec![left - tick, left, right, right - tick], stroke));
    }
    let at = left.lerp(right, 0.5) - vec2(0.0, 4.0);
    let font = FontId::proportional(11.0);
    let galley = painter.layout_no_wrap(text, font, colour(scenery.palette.ink));
    let place = Align2::CENTER_BOTTOM.anchor_size(at, galley.size());
    painter.rect_filled(place.expand2(vec2(3.0, 0.0)), 3.0, colour(scenery.palette.halo).gamma_multiply(0.6));
    painter.galley(place.min, galley, colour(scenery.palette.ink));
}

fn north(painter: &Painter, scenery: &Scenery<'_>, rect: Rect) {
    let centre = rect.max - vec2(32.0, 66.0);
    let halo = colour(scenery.palette.halo).gamma_multiply(0.8);
    painter.circle(centre, 19.0, halo, Stroke::new(1.0, colour(scenery.palette.faint).gamma_multiply(0.5)));
    let bearing = scenery.sight.camera().bearing as f32;
    let to = |turn: f32, far: f32| {
        let (sin, cos) = (turn - bearing).sin_cos();
        centre + vec2(sin, -cos) * far
    };
    use std::f32::consts::{FRAC_PI_2, PI};
    let red = colour(scenery.palette.role(Role::Estimate));
    let grey = colour(scenery.palette.faint).gamma_multiply(0.6);
    for (turn, fill) in [(0.0, red), (PI, grey)] {
        let needle = vec![to(turn, 12.0), to(turn + FRAC_PI_2, 4.0), to(turn - FRAC_PI_2, 4.0)];
        painter.add(Shape::convex_polygon(needle, fill, Stroke::NONE));
    }
    let font = FontId::proportional(10.0);
    painter.text(to(0.0, 25.0), Align2::CENTER_CENTER, "N", font, colour(scenery.palette.ink));
}

/// What the colours mean: only what is there and drawn.
fn legend(painter: &Painter, scenery: &Scenery<'_>, rect: Rect) {
    let overlay = scenery.overlay;
    let layers = scenery.view.layers;
    let mut rows: Vec<(Rgb, String, bool)> = Vec::new();
    for track in overlay.tracks.iter().filter(|track| layers.shows(track.role) && !track.pieces.is_empty()) {
        rows.push((track.colour.unwrap_or(scenery.palette.role(track.role)), track.name.clone(), false));
    }
    let count: usize = overlay.clouds.iter().map(|cloud| cloud.particles.len()).sum();
    if layers.particles && count > 0 {
        rows.push((scenery.palette.particles, format!("{} particles", grouped(count)), true));
    }
    if rows.is_empty() {
        return;
    }
    let ink = colour(scenery.palette.ink);
    let most = ((rect.height() - 120.0) / 17.0).max(1.0) as usize;
    rows.truncate(most);
    let galleys: Vec<_> = rows
        .iter()
        .map(|(_, text, _)| {
            let text: String =
                if text.chars().count() > 34 { text.chars().take(33).chain(['…']).collect() } else { text.clone() };
            painter.layout_no_wrap(text, FontId::proportional(11.5), ink)
        })
        .collect();
    let width = galleys.iter().map(|galley| galley.size().x).fold(0.0, f32::max) + 44.0;
    let height = 17.0 * rows.len() as f32 + 10.0;
    let frame = Rect::from_min_size(pos2(rect.min.x + 10.0, rect.max.y - 10.0 - height), vec2(width, height));
    painter.rect_filled(frame, 6.0, colour(scenery.palette.halo).gamma_multiply(0.85));
    for (row, ((rgb, _, dots), galley)) in rows.iter().zip(galleys).enumerate() {
        let y = frame.min.y + 5.0 + 17.0 * (row as f32 + 0.5);
        let x = frame.min.x + 9.0;
        if *dots {
            for (across, down) in [(2.0, -2.0), (8.0, 2.5), (13.0, -3.0), (17.0, 2.0)] {
                painter.circle_filled(pos2(x + across, y + down), 1.8, colour(*rgb));
            }
        } else {
            painter.line_segment([pos2(x, y), pos2(x + 19.0, y)], Stroke::new(3.0, colour(*rgb)));
        }
        let below = galley.size().y / 2.0;
        painter.galley(pos2(x + 27.0, y - below), galley, ink);
    }
}

/// A number with its thousands apart.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let parts: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|part| std::str::from_utf8(part).ok()).collect();
    parts.join(" ")
}

fn readout(painter: &Painter, scenery: &Scenery<'_>, rect: Rect, place: &Place) {
    let floor = scenery.scene.storey(place.floor).map_or("", |(_, storey)| storey.name.as_str());
    let room = place.room.as_ref().map_or(String::new(), |room| format!("{room}  ·  "));
    let text = format!("{room}{floor}  ·  x {:.2} m  y {:.2} m", place.point[0], place.point[1]);
    let galley = painter.layout_no_wrap(text, FontId::proportional(11.5), colour(scenery.palette.ink));
    let at = pos2(rect.center().x, rect.max.y - 10.0);
    let place = Align2::CENTER_BOTTOM.anchor_size(at, galley.size() + vec2(14.0, 8.0));
    painter.rect_filled(place, 6.0, colour(scenery.palette.halo).gamma_multiply(0.85));
    painter.galley(place.min + vec2(7.0, 4.0), galley, colour(scenery.palette.ink));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_and_thousands_stand_apart() {
        assert_eq!([0.34, 1.0, 9.9, 250.0].map(round_length), [0.2, 1.0, 5.0, 200.0]);
        assert_eq!([7, 1_000, 150_000].map(grouped), ["7", "1 000", "150 000"]);
    }
}
