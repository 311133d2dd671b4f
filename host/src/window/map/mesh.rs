//! The building as triangles: floors filled, walls raised, stairs built.

use super::palette::Material;
use crate::building::{Outline, Point, Segment, geometry};
use lyon_tessellation::geom::point;
use lyon_tessellation::math::Point as At;
use lyon_tessellation::path::Path;
use lyon_tessellation::{BuffersBuilder, FillOptions, FillRule, FillTessellator, FillVertex, VertexBuffers};

/// Half the thickness of a wall: a plan has only its line. **Units:** m.
const WALL_HALF_M: f32 = 0.06;
/// Half the width of the strip that is a door. **Units:** m.
const DOOR_HALF_M: f32 = 0.09;
/// Of stairs. **Units:** m.
const STAIRS_WIDTH_M: f64 = 1.3;
/// Horizontal length of a step. **Units:** m.
const TREAD_M: f64 = 0.3;

/// A corner of a triangle as the shader reads it: place x, y on the plan, height above the floor (of walls a share of
/// their height), where it moves to with the thickness of a wall (x, y), direction of the surface (x, y, z), and material.
/// All are the bits of an f32 but the last.
pub type Vertex = [u32; 9];

/// Triangles of one floor.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Their corners.
    pub vertices: Vec<Vertex>,
    /// Three for each triangle.
    pub indices: Vec<u32>,
}

const UP: [f32; 3] = [0.0, 0.0, 1.0];

impl Mesh {
    fn vertex(&mut self, at: [f32; 3], side: [f32; 2], normal: [f32; 3], material: Material) -> u32 {
        let numbers = [at[0], at[1], at[2], side[0], side[1], normal[0], normal[1], normal[2]].map(f32::to_bits);
        let mut vertex = [material as u32; 9];
        vertex[..8].copy_from_slice(&numbers);
        self.vertices.push(vertex);
        (self.vertices.len() - 1) as u32
    }

    fn quad(&mut self, corners: [([f32; 3], [f32; 2]); 4], normal: [f32; 3], material: Material) {
        let [a, b, c, d] = corners.map(|(at, side)| self.vertex(at, side, normal, material));
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// Fills outlines that may overlap, as one area. What cannot be filled is left out.
    pub fn fill<'a>(&mut self, outlines: impl IntoIterator<Item = &'a Outline>, height: f32, material: Material) {
        let mut path = Path::builder();
        let mut origin = None;
        for outline in outlines {
            // All the same way round, so that none takes away from another.
            let turned = geometry::area(outline) < 0.0;
            let mut corners: Vec<Point> = outline.clone();
            if turned {
                corners.reverse();
            }
            let [x, y] = *origin.get_or_insert(corners[0]);
            let at = |corner: &Point| -> At { point((corner[0] - x) as f32, (corner[1] - y) as f32) };
            path.begin(at(&corners[0]));
            for corner in &corners[1..] {
                path.line_to(at(corner));
            }
            path.end(true);
        }
        let Some([x, y]) = origin else { return };
        let mut filled: VertexBuffers<[f32; 2], u32> = VertexBuffers::new();
        let options = FillOptions::default().with_fill_rule(FillRule::NonZero).with_tolerance(0.01);
        let mut out = BuffersBuilder::new(&mut filled, |vertex: FillVertex<'_>| vertex.position().to_array());
        if FillTessellator::new().tessellate_path(&path.build(), &options, &mut out).is_err() {
            return;
        }
        let first = self.vertices.len() as u32;
        for [east, north] in filled.vertices {
            self.vertex([east + x as f32, north + y as f32, height], [0.0; 2], UP, material);
        }
        self.indices.extend(filled.indices.iter().map(|index| first + index));
    }

    /// The sides of a floor, as thick as a ceiling is.
    pub fn edge(&mut self, outline: &Outline, thickness: f32) {
        for side in geometry::sides(outline) {
            let Some(across) = across(&side) else { continue };
            let [a, b] = side.map(|corner| corner.map(|value| value as f32));
            let corner = |at: [f32; 2], height| ([at[0], at[1], height], [0.0; 2]);
            let corners = [corner(a, 0.0), corner(b, 0.0), corner(b, -thickness), corner(a, -thickness)];
            self.quad(corners, [across[0], across[1], 0.0], Material::Edge);
        }
    }

    /// A wall: two sides, two ends and the top.
    pub fn wall(&mut self, line: &Segment) {
        let Some(across) = across(line) else { return };
        let along = [-across[1], across[0]];
        let [a, b] = line.map(|corner| corner.map(|value| value as f32));
        // Beyond both ends by half the thickness, so that corners are closed.
        let side =
            |sign: f32, forwards: f32| [0, 1].map(|axis| WALL_HALF_M * (sign * across[axis] + forwards * along[axis]));
        let corner = |at: [f32; 2], up: f32, sign: f32, forwards: f32| ([at[0], at[1], up], side(sign, forwards));
        for sign in [1.0, -1.0] {
            let face = [
                corner(a, 0.0, sign, -1.0),
                corner(b, 0.0, sign, 1.0),
                corner(b, 1.0, sign, 1.0),
                corner(a, 1.0, sign, -1.0),
            ];
            self.quad(face, [sign * across[0], sign * across[1], 0.0], Material::Wall);
        }
        for (at, forwards) in [(a, -1.0), (b, 1.0)] {
            let end = [
                corner(at, 0.0, 1.0, forwards),
                corner(at, 0.0, -1.0, forwards),
                corner(at, 1.0, -1.0, forwards),
                corner(at, 1.0, 1.0, forwards),
            ];
            self.quad(end, [forwards * along[0], forwards * along[1], 0.0], Material::Wall);
        }
        let top = [
            corner(a, 1.0, 1.0, -1.0),
            corner(b, 1.0, 1.0, 1.0),
            corner(b, 1.0, -1.0, 1.0),
            corner(a, 1.0, -1.0, -1.0),
        ];
        self.quad(top, UP, Material::Cap);
    }

    /// A door: a strip on the floor in the gap of a wall.
    pub fn door(&mut self, line: &Segment, height: f32) {
        let Some(across) = across(line) else { return };
        let [a, b] = line.map(|corner| corner.map(|value| value as f32));
        let corner = |at: [f32; 2], sign: f32| ([at[0], at[1], height], across.map(|value| sign * value * DOOR_HALF_M));
        self.quad([corner(a, 1.0), corner(b, 1.0), corner(b, -1.0), corner(a, -1.0)], UP, Material::Door);
    }

    /// The steps along a way that rises: a level board and a riser for each. Heights are above the floor.
    pub fn steps(&mut self, from: [f64; 3], to: [f64; 3]) {
        let line = [[from[0], from[1]], [to[0], to[1]]];
        let Some(across) = across(&line) else { return };
        let count = (geometry::length(&line) / TREAD_M).round().max(1.0);
        let half = (STAIRS_WIDTH_M / 2.0) as f32;
        let mut below = from[2];
        for step in 0..count as usize {
            let [near, far] = [step, step + 1]
                .map(|end| geometry::between(line[0], line[1], end as f64 / count).map(|value| value as f32));
            let height = from[2] + (to[2] - from[2]) * (step as f64 + 1.0) / count;
            let corner = |at: [f32; 2], up: f64, sign: f32| {
                ([at[0] + sign * half * across[0], at[1] + sign * half * across[1], up as f32], [0.0; 2])
            };
            let board = [
                corner(near, height, 1.0),
                corner(far, height, 1.0),
                corner(far, height, -1.0),
                corner(near, height, -1.0),
            ];
            self.quad(board, UP, Material::Tread);
            let riser = [
                corner(near, below, 1.0),
                corner(near, height, 1.0),
                corner(near, height, -1.0),
                corner(near, below, -1.0),
            ];
            let along = [-across[1], across[0]];
            self.quad(riser, [-along[0], -along[1], 0.0], Material::Tread);
            below = height;
        }
    }
}

/// To the right of a segment, of length 1; nothing for one without length.
fn across([a, b]: &Segment) -> Option<[f32; 2]> {
    let length = geometry::distance(*a, *b);
    (length > 1e-6).then(|| [((b[1] - a[1]) / length) as f32, ((a[0] - b[0]) / length) as f32])
}

/// The smallest outline that bends one way only around all points (Andrew's monotone chain).
pub fn hull(mut points: Vec<Point>) -> Outline {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = &Point>| {
        let mut kept: Vec<Point> = Vec::new();
        for &point in points {
            while let [.., a, b] = kept[..] {
                let cross = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]);
                if cross > 0.0 {
                    break;
                }
                kept.pop();
            }
            kept.push(point);
        }
        kept.pop();
        kept
    };
    let mut outline = half(&mut points.iter());
    outline.extend(half(&mut points.iter().rev()));
    outline
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn covered(mesh: &Mesh) -> f64 {
        let at = |index: u32| {
            let vertex = mesh.vertices[index as usize];
            [0, 1].map(|axis| f64::from(f32::from_bits(vertex[axis])))
        };
        mesh.indices
            .chunks(3)
            .map(|corners| geometry::area(&corners.iter().map(|&i| at(i)).collect::<Vec<_>>()).abs())
            .sum()
    }

    #[test]
    fn overlapping_rooms_are_covered_once_whichever_way_they_go_round() {
        let room = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        let mut other: Outline = room.iter().map(|[x, y]| [x + 2.0, *y]).collect();
        other.reverse();
        let mut mesh = Mesh::default();
        mesh.fill([&room, &other], 0.0, Material::Room);
        // 4 x 3 and 4 x 3 share 2 x 3; vertices are f32.
        assert!((covered(&mesh) - 18.0).abs() < 1e-4, "{}", covered(&mesh));
    }

    #[test]
    fn an_outline_that_crosses_itself_or_has_no_area_is_no_trouble() {
        let mut mesh = Mesh::default();
        mesh.fill([&vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]], 0.0, Material::Room);
        assert!((covered(&mesh) - 2.0).abs() < 1e-4);
        mesh.fill([&vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]], 0.0, Material::Room);
        mesh.wall(&[[1.0, 1.0], [1.0, 1.0]]);
        assert!((covered(&mesh) - 2.0).abs() < 1e-4);
    }

    #[test]
    fn stairs_reach_from_floor_to_floor() {
        let mut mesh = Mesh::default();
        mesh.steps([0.0, 0.0, 0.0], [3.0, 0.0, 1.7]);
        let heights = mesh.vertices.iter().map(|vertex| f32::from_bits(vertex[2]));
        assert_eq!(mesh.indices.len(), 10 * 12);
        assert!((heights.fold(0.0, f32::max) - 1.7).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn a_hull_holds_its_points(points in proptest::collection::vec((-9.0..9.0, -9.0..9.0).prop_map(|(x, y)| [x, y]), 3..30)) {
            let outline = hull(points.clone());
            prop_assert!(geometry::area(&outline) > 0.0);
            let centre = geometry::centre(&outline);
            for point in points {
                // A hair inwards: a corner lies on the border.
                prop_assert!(geometry::contains(&outline, geometry::between(point, centre, 1e-6)));
            }
        }
    }
}
