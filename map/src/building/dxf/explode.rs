//! The entities of a drawing one by one, in metres, with all blocks in their places.

use super::drawing::{Drawing, Entity, Insert, Shape};
use super::layers::{Layers, Role};
use crate::building::geometry::{self, Point};
use std::collections::BTreeSet;

/// Something drawn on a layer that is read.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The floor that the layer names.
    pub floor: Option<String>,
    pub role: Role,
    pub line: Line,
}

/// What it is. **Units:** m.
#[derive(Clone, Debug)]
pub enum Line {
    /// From one point to another.
    Straight([Point; 2]),
    /// Along corners.
    Corners(Vec<Point>),
    /// Around corners.
    Outline(Vec<Point>),
    /// Around a centre.
    Arc {
        centre: Point,
        points: Vec<Point>,
    },
    Point(Point),
    Text(Point, String),
}

/// Blocks in blocks no deeper than this.
const DEEPEST: usize = 16;
/// More blocks in places, and more points, than this no plan has.
const MOST_INSERTS: usize = 200_000;
const MOST_POINTS: usize = 4_000_000;
/// A curve becomes straight lines that are no farther from it. **Units:** m.
const SAGITTA_M: f64 = 0.01;
/// So many of them at most make a full circle.
const MOST_SIDES: f64 = 90.0;

/// All pieces on layers that are read, and the names of the other layers.
///
/// # Errors
/// When there is too much of it.
pub fn explode(drawing: &Drawing, layers: &Layers) -> Result<(Vec<Piece>, BTreeSet<String>), String> {
    let unit_m = layers.unit_m.or(drawing.unit_m).unwrap_or(1.0);
    let mut work = Work { drawing, layers, pieces: Vec::new(), ignored: BTreeSet::new(), inserts: 0, points: 0 };
    let metres = Affine { x: [unit_m, 0.0], y: [0.0, unit_m], to: [0.0; 2] };
    work.draw(&drawing.entities, metres, None, 0)?;
    Ok((work.pieces, work.ignored))
}

/// A linear map and where the origin goes.
#[derive(Clone, Copy, Debug)]
struct Affine {
    x: Point,
    y: Point,
    to: Point,
}

impl Affine {
    fn apply(&self, [x, y]: Point) -> Point {
        [0, 1].map(|axis| self.x[axis] * x + self.y[axis] * y + self.to[axis])
    }

    /// First `inner`, then this.
    fn after(&self, inner: &Self) -> Self {
        let turn = |[x, y]: Point| [0, 1].map(|axis| self.x[axis] * x + self.y[axis] * y);
        Self { x: turn(inner.x), y: turn(inner.y), to: self.apply(inner.to) }
    }

    /// As seen from below.
    fn mirrored(&self, is_mirrored: bool) -> Self {
        if is_mirrored { Self { x: self.x.map(|value| -value), ..*self } } else { *self }
    }

    /// By how much it makes lengths larger at most, nearly.
    fn scale(&self) -> f64 {
        self.x[0].hypot(self.x[1]).max(self.y[0].hypot(self.y[1]))
    }
}

struct Work<'a> {
    drawing: &'a Drawing,
    layers: &'a Layers,
    pieces: Vec<Piece>,
    ignored: BTreeSet<String>,
    inserts: usize,
    points: usize,
}

impl Work<'_> {
    /// Draws entities; those on layer 0 of a block are on the `layer` of the block.
    fn draw(&mut self, entities: &[Entity], map: Affine, layer: Option<&str>, depth: usize) -> Result<(), String> {
        for entity in entities {
            let layer = layer.filter(|_| entity.layer == "0").unwrap_or(&entity.layer);
            if let Shape::Insert(insert) = &entity.shape {
                self.insert(insert, map, layer, depth)?;
                continue;
            }
            let Some((floor, role)) = self.layers.role(layer) else {
                self.ignored.insert(layer.to_owned());
                continue;
            };
            if let Some(line) = lines(&entity.shape, map) {
                self.points += match &line {
                    Line::Corners(points) | Line::Outline(points) | Line::Arc { points, .. } => points.len(),
                    _ => 1,
                };
                if self.points > MOST_POINTS {
                    return Err(format!("it has more than {MOST_POINTS} points"));
                }
                self.pieces.push(Piece { floor: floor.map(str::to_owned), role, line });
            }
        }
        Ok(())
    }

    fn insert(&mut self, insert: &Insert, map: Affine, layer: &str, depth: usize) -> Result<(), String> {
        let drawing = self.drawing;
        let Some(block) = drawing.blocks.get(&insert.block) else {
            let [x, y] = insert.place;
            return Err(format!(
                "block '{}' is put on layer {layer} at ({x}, {y}) of the drawing, but not defined: bind external references and \
                 save the drawing anew, or take the block out",
                insert.block
            ));
        };
        if depth >= DEEPEST {
            return Err(format!("block '{}' lies in more than {DEEPEST} blocks, or in itself", insert.block));
        }
        let map = map.mirrored(insert.is_mirrored);
        let (sin, cos) = insert.angle.to_radians().sin_cos();
        let [columns, rows] = insert.counts.map(|count| count.clamp(1.0, MOST_INSERTS as f64) as usize);
        self.inserts = self.inserts.saturating_add(columns.saturating_mul(rows));
        if self.inserts > MOST_INSERTS {
            return Err(format!("it has more than {MOST_INSERTS} blocks in places"));
        }
        for row in 0..rows {
            for column in 0..columns {
                let along = [column as f64 * insert.spacing[0], row as f64 * insert.spacing[1]];
                let to = [
                    insert.place[0] + cos * along[0] - sin * along[1],
                    insert.place[1] + sin * along[0] + cos * along[1],
                ];
                let placed = Affine {
                    x: [insert.scale[0] * cos, insert.scale[0] * sin],
                    y: [-insert.scale[1] * sin, insert.scale[1] * cos],
                    to,
                };
                let base = Affine { x: [1.0, 0.0], y: [0.0, 1.0], to: block.base.map(|value| -value) };
                self.draw(&block.entities, map.after(&placed).after(&base), Some(layer), depth + 1)?;
            }
        }
        Ok(())
    }
}

/// The lines that a shape is made of, in their places.
fn lines(shape: &Shape, map: Affine) -> Option<Line> {
    Some(match shape {
        Shape::Line(ends) => Line::Straight(ends.map(|point| map.apply(point))),
        Shape::Polyline { corners, is_closed, is_mirrored } => {
            let map = map.mirrored(*is_mirrored);
            let (mut points, is_outline) = bent(corners, *is_closed, map.scale());
            points.iter_mut().for_each(|point| *point = map.apply(*point));
            match (points.len(), is_outline) {
                (0 | 1, _) => return None,
                (2, _) => Line::Straight([points[0], points[1]]),
                (_, true) => Line::Outline(points),
                (_, false) => Line::Corners(points),
            }
        }
        Shape::Arc { centre, radius, angles, is_mirrored } => {
            let map = map.mirrored(*is_mirrored);
            let sweep = (angles[1] - angles[0]).rem_euclid(360.0);
            let sweep = if sweep > 0.0 { sweep } else { 360.0 };
            let points = around(*centre, *radius, angles[0].to_radians(), sweep.to_radians(), map.scale());
            let points = points.into_iter().map(|point| map.apply(point)).collect();
            Line::Arc { centre: map.apply(*centre), points }
        }
        Shape::Circle { centre, radius, is_mirrored } => {
            let map = map.mirrored(*is_mirrored);
            let mut points = around(*centre, *radius, 0.0, std::f64::consts::TAU, map.scale());
            points.pop();
            Line::Outline(points.into_iter().map(|point| map.apply(point)).collect())
        }
        Shape::Point(point) => Line::Point(map.apply(*point)),
        Shape::Text(point, text) => Line::Text(map.apply(*point), text.clone()),
        Shape::Insert(_) => return None,
    })
}

/// Points on an arc from its first to its last; `scale` turns the units of the radius into metres.
fn around(centre: Point, radius: f64, from: f64, sweep: f64, scale: f64) -> Vec<Point> {
    let radius_m = (radius * scale).abs().max(SAGITTA_M);
    let step = 2.0 * (1.0 - SAGITTA_M / radius_m).acos();
    let most = (MOST_SIDES * sweep.abs() / std::f64::consts::TAU).ceil().max(2.0);
    let count = (sweep.abs() / step).ceil().clamp(2.0, most);
    let point = |index: u32| {
        let (sin, cos) = (from + sweep * f64::from(index) / count).sin_cos();
        [centre[0] + radius * cos, centre[1] + radius * sin]
    };
    (0..=count as u32).map(point).collect()
}

/// The points of a polyline whose sides may be bent, and whether it is closed; the first is not repeated.
fn bent(corners: &[(Point, f64)], is_closed: bool, scale: f64) -> (Vec<Point>, bool) {
    let mut points = Vec::new();
    for (index, &(corner, bulge)) in corners.iter().enumerate() {
        points.push(corner);
        let is_last = index + 1 == corners.len();
        if bulge == 0.0 || (is_last && !is_closed) {
            continue;
        }
        let next = corners[(index + 1) % corners.len()].0;
        let chord = geometry::distance(corner, next);
        let sweep = 4.0 * bulge.atan();
        let radius = chord / (2.0 * (sweep / 2.0).sin()).abs().max(1e-12);
        // From the middle of the chord to the left of it, if the arc is less than half a circle and counter-clockwise.
        let off = radius * (sweep / 2.0).cos() * sweep.signum();
        let across = [-(next[1] - corner[1]) / chord.max(1e-12), (next[0] - corner[0]) / chord.max(1e-12)];
        let middle = geometry::between(corner, next, 0.5);
        let centre = [middle[0] + off * across[0], middle[1] + off * across[1]];
        let from = (corner[1] - centre[1]).atan2(corner[0] - centre[0]);
        let arc = around(centre, radius, from, sweep, scale);
        points.extend_from_slice(&arc[1..arc.len() - 1]);
    }
    let repeats = points.len() > 1 && points.first() == points.last();
    if repeats {
        points.pop();
    }
    (points, is_closed || repeats)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entity(layer: &str, shape: Shape) -> Entity {
        Entity { layer: layer.to_owned(), shape }
    }

    fn insert(block: &str, place: Point) -> Insert {
        Insert {
            block: block.to_owned(),
            place,
            scale: [1.0; 2],
            angle: 0.0,
            counts: [1.0; 2],
            spacing: [0.0; 2],
            is_mirrored: false,
        }
    }

    fn near(a: Point, b: Point) -> bool {
        geometry::distance(a, b) < 1e-9
    }

    #[test]
    fn blocks_are_put_in_their_places() {
        let mut drawing = Drawing { unit_m: Some(1e-3), ..Drawing::default() };
        let line = Shape::Line([[1_000.0, 0.0], [2_000.0, 0.0]]);
        let inner = vec![entity("0", line.clone()), entity("M\u{f6}bel", line.clone()), entity("Wand", line)];
        drawing.blocks.insert("inner".into(), super::super::drawing::Block { base: [1_000.0, 0.0], entities: inner });
        let turned = Insert { angle: 90.0, scale: [2.0, 2.0], ..insert("inner", [0.0, 5_000.0]) };
        let outer = vec![entity("0", Shape::Insert(turned))];
        drawing.blocks.insert("outer".into(), super::super::drawing::Block { entities: outer, ..Default::default() });
        drawing.entities.push(entity("T\u{fc}ren", Shape::Insert(insert("outer", [3_000.0, 0.0]))));
        let field =
            Insert { counts: [3.0, 2.0], spacing: [1e3, 1e3], is_mirrored: true, ..insert("inner", [1e3, 0.0]) };
        drawing.entities.push(entity("0", Shape::Insert(field)));
        let (pieces, ignored) = explode(&drawing, &Layers::default()).unwrap();
        assert_eq!(ignored.iter().collect::<Vec<_>>(), ["0", "M\u{f6}bel"]);
        let roles: Vec<_> = pieces.iter().map(|piece| piece.role).collect();
        assert_eq!(roles[..2], [Role::Doors, Role::Walls]);
        assert_eq!(roles.len(), 2 + 6);
        for piece in &pieces[..2] {
            let Line::Straight([a, b]) = piece.line else { panic!("no line") };
            assert!(near(a, [3.0, 5.0]) && near(b, [3.0, 7.0]), "{a:?} {b:?}");
        }
        let Line::Straight([a, b]) = pieces[7].line else { panic!("no line") };
        // Mirrored, in the third column of the second row.
        assert!(near(a, [-3.0, 1.0]) && near(b, [-4.0, 1.0]), "{a:?} {b:?}");
    }

    #[test]
    fn a_block_that_is_not_defined_is_named_with_its_place() {
        let entities = vec![entity("T\u{fc}ren", Shape::Insert(insert("Door90", [3.0, 4.5])))];
        let told = explode(&Drawing { entities, ..Drawing::default() }, &Layers::default()).unwrap_err();
        assert!(told.starts_with("block 'Door90' is put on layer T\u{fc}ren at (3, 4.5)"), "{told}");
        assert!(told.contains("bind external references"), "{told}");
    }

    #[test]
    fn a_block_in_itself_and_a_field_without_end_are_refused() {
        let mut drawing = Drawing::default();
        let own = vec![entity("0", Shape::Insert(insert("a", [0.0; 2])))];
        drawing.blocks.insert("a".into(), super::super::drawing::Block { entities: own.clone(), ..Default::default() });
        drawing.entities = own;
        assert!(explode(&drawing, &Layers::default()).unwrap_err().contains("or in itself"));
        drawing.blocks.insert("a".into(), super::super::drawing::Block::default());
        let Shape::Insert(field) = &mut drawing.entities[0].shape else { panic!("no insert") };
        field.counts = [1e30, 3.0];
        assert!(explode(&drawing, &Layers::default()).unwrap_err().contains("blocks in places"));
    }

    #[test]
    fn curves_stay_within_a_centimetre() {
        let shapes = [
            Shape::Circle { centre: [1.0, 2.0], radius: 3.0, is_mirrored: false },
            // Two half circles.
            Shape::Polyline {
                corners: vec![([-2.0, 2.0], 1.0), ([4.0, 2.0], 1.0)],
                is_closed: true,
                is_mirrored: false,
            },
            Shape::Polyline {
                corners: vec![([4.0, 2.0], -1.0), ([-2.0, 2.0], -1.0)],
                is_closed: true,
                is_mirrored: false,
            },
        ];
        for shape in shapes {
            let map = Affine { x: [1.0, 0.0], y: [0.0, 1.0], to: [0.0; 2] };
            let Some(Line::Outline(points)) = lines(&shape, map) else { panic!("no outline") };
            for [a, b] in geometry::sides(&points) {
                let sag = 3.0 - geometry::distance(geometry::between(a, b, 0.5), [1.0, 2.0]);
                assert!((0.0..=SAGITTA_M).contains(&sag) && (geometry::distance(a, [1.0, 2.0]) - 3.0).abs() < 1e-9);
            }
            assert!((geometry::area(&points).abs() / (9.0 * std::f64::consts::PI) - 1.0).abs() < 0.01);
        }
        let quarter = Shape::Polyline {
            corners: vec![([1.0, 0.0], std::f64::consts::FRAC_PI_8.tan()), ([0.0, 1.0], 0.0)],
            is_closed: false,
            is_mirrored: false,
        };
        let Some(Line::Corners(points)) = lines(&quarter, Affine { x: [1.0, 0.0], y: [0.0, 1.0], to: [0.0; 2] }) else {
            panic!("no curve")
        };
        assert!(points.iter().all(|[x, y]| (x.hypot(*y) - 1.0).abs() < 1e-9), "{points:?}");
    }
}
