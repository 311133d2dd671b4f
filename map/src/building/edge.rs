//! Where a floor ends and nothing is drawn: the edge of a slab at a void, a railing, a facade of glass.
//!
//! A plan whose rooms cover the floor says by their outlines where the floor ends. A particle does not know that; without a
//! wall it walks on over the edge, and in the open, where nothing is in its way, it outlives those that stay inside.

use super::geometry::{self, Outline, Point, Segment};

/// Outlines are looked at in pieces of this length. **Units:** m.
const PIECE_M: f64 = 0.5;
/// Distances beyond the outline at which a wall, a door or another room is looked for: walls are thinner than the last.
/// **Units:** m.
const BEYOND_M: [f64; 5] = [0.1, 0.25, 0.4, 0.6, 0.9];

/// What is nearer than this touches. **Units:** m.
const TOUCHES_M: f64 = 1e-3;

/// An area with its bounds; holes are rings too.
struct Area {
    rings: Vec<Outline>,
    bounds: [Point; 2],
}

impl Area {
    fn of(rings: Vec<Outline>) -> Option<Self> {
        let bounds = geometry::bounds(rings.iter().flatten().copied())?;
        Some(Self { rings, bounds })
    }

    fn contains(&self, point: Point) -> bool {
        let [low, high] = self.bounds;
        let near = (0..2).all(|axis| (low[axis]..=high[axis]).contains(&point[axis]));
        near && self.rings.iter().filter(|ring| geometry::contains(ring, point)).count() % 2 == 1
    }
}

/// What lies beyond the outlines of rooms.
struct Plan {
    rooms: Vec<Area>,
    others: Vec<Area>,
}

impl Plan {
    /// Whether something is beyond a point of the outline of a room.
    fn covered(&self, room: usize, point: Point, outwards: Point) -> bool {
        let in_room = |there: Point| {
            let other = |(number, area): (usize, &Area)| number != room && area.contains(there);
            self.rooms.iter().enumerate().any(other)
        };
        BEYOND_M.iter().any(|&far| {
            let there = shifted(point, outwards, far);
            self.solid(there) || in_room(there)
        })
    }

    fn solid(&self, point: Point) -> bool {
        self.others.iter().any(|area| area.contains(point))
    }

    /// From a point to the face of what is solid in this direction.
    fn to_solid(&self, point: Point, direction: Point) -> Option<Segment> {
        let mut near = 0.0;
        for far in BEYOND_M {
            if self.solid(shifted(point, direction, far)) {
                let face = flip(near, far, |far| self.solid(shifted(point, direction, far)));
                return (face > TOUCHES_M).then(|| [point, shifted(point, direction, face)]);
            }
            near = far;
        }
        None
    }

    /// The edges of a room. Each ends where what is beyond begins, and reaches to it: no gap stays open.
    fn edges_of(&self, room: usize, ring: &Outline, edges: &mut Vec<Segment>) {
        let sides: Vec<Side> = geometry::sides(ring).filter_map(|line| Side::of(line, &self.rooms[room])).collect();
        for (number, side) in sides.iter().enumerate() {
            let covered = |at: f64| self.covered(room, side.at(at), side.outwards);
            let last = side.pieces as f64;
            for [first, end] in runs(side.pieces, |piece| !covered(piece as f64 + 0.5)) {
                let (mut from, mut to) = (first as f64, end as f64);
                // Beside it something is beyond; around a corner it may stand back from the outline.
                let (mut before, mut after) = (side.outwards, side.outwards);
                if first > 0 {
                    from = flip(from + 0.5, from - 0.5, covered);
                } else {
                    before = sides[(number + sides.len() - 1) % sides.len()].outwards;
                }
                if to < last {
                    to = flip(to - 0.5, to + 0.5, covered);
                } else {
                    after = sides[(number + 1) % sides.len()].outwards;
                }
                let [from, to] = [side.at(from), side.at(to)];
                edges.push([from, to]);
                edges.extend(self.to_solid(from, before));
                edges.extend(self.to_solid(to, after));
            }
        }
    }
}

/// The stretches of numbers below `count` for which it holds: the first of each, and the first beyond it.
fn runs(count: usize, holds: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for number in (0..count).filter(|&number| holds(number)) {
        match runs.last_mut() {
            Some([_, end]) if *end == number => *end += 1,
            _ => runs.push([number, number + 1]),
        }
    }
    runs
}

/// A side of an outline, cut into pieces.
struct Side {
    line: Segment,
    pieces: usize,
    /// Unit vector out of the room.
    outwards: Point,
}

impl Side {
    /// Nothing of one without length.
    fn of(line: Segment, room: &Area) -> Option<Self> {
        let length = geometry::length(&line);
        if length < 1e-6 {
            return None;
        }
        let pieces = (length / PIECE_M).ceil() as usize;
        let across = [(line[1][1] - line[0][1]) / length, (line[0][0] - line[1][0]) / length];
        let inwards = room.contains(shifted(geometry::between(line[0], line[1], 0.5), across, 0.02));
        let outwards = if inwards { across.map(|value| -value) } else { across };
        Some(Self { line, pieces, outwards })
    }

    /// A point, counted in pieces from the first end.
    fn at(&self, piece: f64) -> Point {
        geometry::between(self.line[0], self.line[1], piece / self.pieces as f64)
    }
}

/// Where something becomes true that is not so at `from` and is at `to`, just on its side.
fn flip(mut from: f64, mut to: f64, holds: impl Fn(f64) -> bool) -> f64 {
    // To a thousandth of the way.
    for _ in 0..10 {
        let middle = 0.5 * (from + to);
        if holds(middle) {
            to = middle;
        } else {
            from = middle;
        }
    }
    to
}

fn shifted(point: Point, direction: Point, far: f64) -> Point {
    [0, 1].map(|axis| point[axis] + far * direction[axis])
}

/// The parts of the outlines of `rooms` beyond which there is nothing: no other room, and none of `others` (walls and
/// doors, each with its rings); with what joins them to that which is beyond beside them.
pub(super) fn open_edges(rooms: &[Outline], others: Vec<Vec<Outline>>) -> Vec<Segment> {
    let plan = Plan {
        rooms: rooms.iter().filter_map(|outline| Area::of(vec![outline.clone()])).collect(),
        others: others.into_iter().filter_map(Area::of).collect(),
    };
    let mut edges = Vec::new();
    for (number, room) in plan.rooms.iter().enumerate() {
        for ring in &room.rings {
            plan.edges_of(number, ring, &mut edges);
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle([x, y]: Point, [far_x, far_y]: Point) -> Outline {
        vec![[x, y], [far_x, y], [far_x, far_y], [x, far_y]]
    }

    #[test]
    fn a_floor_ends_where_neither_wall_nor_room_is_beyond() {
        // A wall in the south, a room in the north whose own south is this one, a door in the east; the west is open.
        let rooms = [rectangle([0.0, 0.0], [6.0, 4.0]), rectangle([0.0, 4.0], [6.0, 8.0])];
        let wall = |low, high| vec![rectangle(low, high)];
        let others = vec![
            wall([-0.3, -0.3], [6.3, 0.0]),
            wall([6.0, -0.3], [6.3, 8.3]),
            wall([0.0, 8.0], [6.3, 8.3]),
            wall([-0.3, 4.0], [0.0, 8.3]),
        ];
        let edges = open_edges(&rooms, others);
        assert_eq!(edges, [[[0.0, 4.0], [0.0, 0.0]]]);
    }

    #[test]
    fn an_edge_reaches_to_the_walls_beside_it() {
        // A wall 0.3 m behind the first 3.2 m of the south, and one 0.2 m behind the east; nothing elsewhere.
        let room = rectangle([0.0, 0.0], [6.0, 4.0]);
        let wall = |low, high| vec![rectangle(low, high)];
        let others = vec![wall([-0.5, -0.5], [3.2, -0.3]), wall([6.2, -1.0], [6.5, 5.0])];
        let edges = open_edges(&[room], others);
        let expected = [
            [[3.2, 0.0], [6.0, 0.0]],
            [[3.2, 0.0], [3.2, -0.3]],
            [[6.0, 0.0], [6.2, 0.0]],
            [[6.0, 4.0], [0.0, 4.0]],
            [[6.0, 4.0], [6.2, 4.0]],
            [[0.0, 4.0], [0.0, 0.0]],
            [[0.0, 0.0], [0.0, -0.3]],
        ];
        assert_eq!(edges.len(), expected.len(), "{edges:?}");
        for (edge, expected) in edges.iter().zip(expected) {
            // A thousandth of a piece.
            let off = |end: usize| geometry::distance(edge[end], expected[end]);
            assert!(off(0) < 1e-3 && off(1) < 1e-3, "{edge:?} is not {expected:?}");
        }
    }

    #[test]
    fn a_hole_in_a_facade_is_no_wall() {
        let facade = vec![rectangle([-1.0, -1.0], [5.0, 5.0]), rectangle([-0.5, -0.5], [4.5, 4.5])];
        assert!(open_edges(&[rectangle([0.0, 0.0], [4.0, 4.0])], vec![facade]).is_empty());
        let far = vec![rectangle([-2.0, -2.0], [6.0, 6.0]), rectangle([-1.5, -1.5], [5.5, 5.5])];
        assert_eq!(open_edges(&[rectangle([0.0, 0.0], [4.0, 4.0])], vec![far]).len(), 4);
        assert!(open_edges(&[], Vec::new()).is_empty());
    }
}
