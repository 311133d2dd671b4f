//! The cube: how the sensor lies. Its red, green and blue sides face along the sensor's x, y and z axis.
//!
//! # Source
//! Foot, 6.2.2.

use super::map::palette::{Palette, Rgb, colour};
use crate::building::geometry::wrapped;
use eframe::egui::{
    self, Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, WidgetInfo, WidgetType, pos2, vec2,
};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Colours of the sides along x, y, z.
const AXES: [(Rgb, &str); 3] = [([0xe0, 0x3a, 0x35], "x"), ([0x2f, 0xa8, 0x4f], "y"), ([0x2f, 0x6f, 0xe4], "z")];
/// Half the length of a side; everything else is in parts of it.
const HALF: f64 = 1.0;
/// Of the eye from the middle.
const DISTANCE: f64 = 7.5;
/// What is seen of the height of the view, from the middle, at that distance.
const REACH: f64 = 2.35;
/// Below the middle.
const GROUND: f64 = -1.75;

/// From where the cube is looked at: kept from run to run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cube {
    /// Where one looks to, clockwise from the y axis of the world. **Units:** rad.
    pub bearing: f64,
    /// Of the eye above the horizon. **Units:** rad.
    pub elevation: f64,
}

impl Default for Cube {
    fn default() -> Self {
        Self { bearing: -0.5, elevation: 0.42 }
    }
}

/// What is drawn, from the farthest to the nearest.
enum Part {
    Face { corners: Vec<Pos2>, inner: Vec<Pos2>, fill: Rgb, letter: Vec<[Pos2; 2]> },
    Arrow { from: Pos2, to: Pos2, rgb: Rgb, word: &'static str },
}

struct Eye {
    rect: Rect,
    right: Vector3<f64>,
    up: Vector3<f64>,
    forward: Vector3<f64>,
}

impl Eye {
    fn new(cube: &Cube, rect: Rect) -> Self {
        let (sin_b, cos_b) = cube.bearing.sin_cos();
        let (sin_e, cos_e) = cube.elevation.sin_cos();
        Self {
            rect,
            right: Vector3::new(cos_b, -sin_b, 0.0),
            up: Vector3::new(sin_b * sin_e, cos_b * sin_e, cos_e),
            forward: Vector3::new(sin_b * cos_e, cos_b * cos_e, -sin_e),
        }
    }

    fn depth(&self, point: Vector3<f64>) -> f64 {
        self.forward.dot(&point) + DISTANCE
    }

    fn at(&self, point: Vector3<f64>) -> Pos2 {
        let scale = f64::from(self.rect.width().min(self.rect.height())) / (2.0 * REACH) * DISTANCE / self.depth(point);
        let middle = self.rect.center();
        pos2(middle.x + (self.right.dot(&point) * scale) as f32, middle.y - (self.up.dot(&point) * scale) as f32)
    }
}

impl Cube {
    /// Draws the cube into all the room that there is. `attitude` turns the sensor's frame into the world's, whose z is
    /// up; without one the cube is grey. Dragging turns the view, a double click turns it back.
    pub fn show(&mut self, ui: &mut Ui, attitude: Option<UnitQuaternion<f64>>) -> egui::Response {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let words = attitude.map_or_else(|| "no attitude yet".to_owned(), words);
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, format!("Attitude: {words}")));
        if response.double_clicked() {
            *self = Self::default();
        }
        let drag = response.drag_delta();
        self.bearing = wrapped(self.bearing + f64::from(drag.x) * 0.01);
        self.elevation = (self.elevation + f64::from(drag.y) * 0.01).clamp(0.05, 1.5);
        if rect.width() < 20.0 || rect.height() < 20.0 {
            return response;
        }
        let palette = Palette::of(ui.visuals().dark_mode);
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, colour(palette.background));
        let eye = Eye::new(self, rect);
        let turn = attitude.unwrap_or_default();
        ground(&painter, &eye, palette, turn);
        let mut parts = parts(&eye, turn, attitude.is_some(), palette);
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, part) in parts {
            part.draw(&painter, palette);
        }
        let ink = colour(palette.ink);
        let place = rect.left_bottom() + vec2(10.0, -8.0);
        painter.text(place, Align2::LEFT_BOTTOM, words, FontId::proportional(12.0), ink);
        response
    }
}

/// Roll, pitch and yaw: turns about x, then y, then z of the world. **Units:** degrees.
fn words(attitude: UnitQuaternion<f64>) -> String {
    let (roll, pitch, yaw) = attitude.euler_angles();
    // No minus before a zero.
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angle| (angle.to_degrees() * 10.0).round() / 10.0 + 0.0);
    format!("roll {roll:.1}°  pitch {pitch:.1}°  yaw {yaw:.1}°")
}

/// The ground with its axes, and the shadow of the cube.
fn ground(painter: &Painter, eye: &Eye, palette: &Palette, turn: UnitQuaternion<f64>) {
    let on = |x: f64, y: f64| eye.at(Vector3::new(x, y, GROUND));
    let circle = |radius: f64| -> Vec<Pos2> {
        (0..64)
            .map(|part| {
                let (sin, cos) = (f64::from(part) / 64.0 * std::f64::consts::TAU).sin_cos();
                on(radius * cos, radius * sin)
            })
            .collect()
    };
    let [_, _, _, _, _, _, _, _, _, _, ground, grid] = palette.materials;
    let line = Stroke::new(1.0, colour(grid));
    painter.add(Shape::convex_polygon(circle(2.1), colour(ground), Stroke::new(1.5, colour(grid))));
    painter.add(Shape::closed_line(circle(1.05), line));
    for (x, y) in [(2.1, 0.0), (0.0, 2.1)] {
        painter.line_segment([on(-x, -y), on(x, y)], line);
    }
    for (x, y, word) in [(2.35, 0.0, "X"), (0.0, 2.35, "Y")] {
        let font = FontId::proportional(11.0);
        painter.text(on(x, y), Align2::CENTER_CENTER, word, font, colour(palette.faint));
    }
    let shadow = (0..8).map(|corner| {
        let side = |axis: i32| if corner >> axis & 1 == 1 { HALF } else { -HALF };
        let place = turn * Vector3::new(side(0), side(1), side(2));
        [place.x, place.y]
    });
    let outline = super::map::hull(shadow.collect());
    let outline: Vec<Pos2> = outline.into_iter().map(|[x, y]| on(x, y)).collect();
    painter.add(Shape::convex_polygon(outline, Color32::from_black_alpha(38), Stroke::NONE));
}

/// The letters as lines on a side, from -1 to 1.
fn letter(axis: usize) -> &'static [[[f64; 2]; 2]] {
    const X: [[[f64; 2]; 2]; 2] = [[[-0.6, -1.0], [0.6, 1.0]], [[-0.6, 1.0], [0.6, -1.0]]];
    const Y: [[[f64; 2]; 2]; 3] = [[[-0.6, 1.0], [0.0, 0.05]], [[0.6, 1.0], [0.0, 0.05]], [[0.0, 0.05], [0.0, -1.0]]];
    const Z: [[[f64; 2]; 2]; 3] = [[[-0.6, 1.0], [0.6, 1.0]], [[0.6, 1.0], [-0.6, -1.0]], [[-0.6, -1.0], [0.6, -1.0]]];
    [&X[..], &Y, &Z][axis]
}

fn parts(eye: &Eye, turn: UnitQuaternion<f64>, known: bool, palette: &Palette) -> Vec<(f64, Part)> {
    let light = Vector3::new(-0.35, -0.5, 0.79);
    let eye_at = -eye.forward * DISTANCE;
    let grey: Rgb = if palette.background[0] < 0x80 { [0x4a, 0x52, 0x5e] } else { [0xa6, 0xae, 0xb9] };
    let mut parts = Vec::new();
    for (axis, (side, word)) in AXES.into_iter().enumerate() {
        let unit = |axis: usize| Vector3::ith(axis % 3, 1.0);
        for sign in [1.0, -1.0] {
            let normal = turn * unit(axis) * sign;
            let (along, across) = (turn * unit(axis + 1) * sign, turn * unit(axis + 2));
            if normal.dot(&(eye_at - normal * HALF)) <= 0.0 {
                continue;
            }
            let corners = |size: f64| -> Vec<Pos2> {
                [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                    .map(|[a, b]| eye.at(normal * HALF + (along * a + across * b) * HALF * size))
                    .to_vec()
            };
            let mark = |[a, b]: [f64; 2]| eye.at(normal * HALF + (along * a + across * b) * HALF * 0.38);
            let lines = if sign > 0.0 && known { letter(axis) } else { &[] };
            let rgb = if known { side } else { grey };
            // The side that faces backwards has the same colour, but pale.
            let rgb = if sign > 0.0 { rgb } else { mix(rgb, grey, 0.72) };
            let shade = 0.72 + 0.28 * normal.dot(&light).max(-0.4);
            parts.push((
                eye.depth(normal * HALF),
                Part::Face {
                    corners: corners(1.0),
                    inner: corners(0.9),
                    fill: rgb.map(|channel| (f64::from(channel) * shade) as u8),
                    letter: lines.iter().map(|line| line.map(mark)).collect(),
                },
            ));
        }
        if known {
            let direction = turn * unit(axis);
            let (from, to) = (direction * HALF, direction * HALF * 1.75);
            parts.push((
                eye.depth((from + to) / 2.0),
                Part::Arrow { from: eye.at(from), to: eye.at(to), rgb: side, word },
            ));
        }
    }
    parts
}

fn mix(a: Rgb, b: Rgb, part: f64) -> Rgb {
    [0, 1, 2].map(|channel| (f64::from(a[channel]) * (1.0 - part) + f64::from(b[channel]) * part) as u8)
}

impl Part {
    fn draw(self, painter: &Painter, palette: &Palette) {
        match self {
            Self::Face { corners, inner, fill, letter } => {
                let rim = mix(fill, [0; 3], 0.45);
                painter.add(Shape::convex_polygon(corners, colour(rim), Stroke::new(1.0, colour(rim))));
                painter.add(Shape::convex_polygon(inner, colour(fill), Stroke::NONE));
                for line in letter {
                    painter.line_segment(line, Stroke::new(3.0, Color32::from_white_alpha(235)));
                }
            }
            Self::Arrow { from, to, rgb, word } => {
                let stroke = Stroke::new(3.0, colour(rgb));
                let along = (to - from).normalized();
                let across = vec2(-along.y, along.x);
                if from.distance(to) > 4.0 {
                    let neck = to - along * 9.0;
                    painter.line_segment([from, neck], stroke);
                    let head = vec![to, neck + across * 5.0, neck - across * 5.0];
                    painter.add(Shape::convex_polygon(head, colour(rgb), Stroke::NONE));
                }
                let font = FontId::proportional(13.0);
                painter.text(to + along * 9.0, Align2::CENTER_CENTER, word, font, colour(palette.ink));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_turn() {
        let turn = UnitQuaternion::from_euler_angles(0.1, -0.2, 3.0);
        assert_eq!(words(turn), "roll 5.7°  pitch -11.5°  yaw 171.9°");
        assert_eq!(words(UnitQuaternion::identity()), "roll 0.0°  pitch 0.0°  yaw 0.0°");
    }

    #[test]
    fn three_sides_at_most_are_seen_and_the_one_towards_the_eye_is_nearest() {
        let eye =
            Eye::new(&Cube { bearing: 0.0, elevation: 0.05 }, Rect::from_min_size(Pos2::ZERO, vec2(100.0, 100.0)));
        let palette = Palette::of(false);
        for turn in [0.0, 0.4, 1.0, 2.0] {
            let turn = UnitQuaternion::from_euler_angles(0.3, turn, turn * 2.0);
            let faces = parts(&eye, turn, false, palette);
            assert!((1..=3).contains(&faces.len()), "{}", faces.len());
        }
        // One looks along y: the side that faces -y is in front, none of x is seen.
        let seen = parts(&eye, UnitQuaternion::identity(), true, palette);
        let front = seen.iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(depth, _)| *depth).unwrap();
        assert!((front - (DISTANCE - HALF)).abs() < 0.02, "{front}");
    }
}
