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

/// The pieces of the outlines of `rooms` beyond which there is nothing: no other room, and none of `others` (walls and
/// doors, each with its rings).
pub(super) fn open_edges(rooms: &[Outline], others: Vec<Vec<Outline>>) -> Vec<Segment> {
    let rooms: Vec<Area> = rooms.iter().filter_map(|outline| Area::of(vec![outline.clone()])).collect();
    let others: Vec<Area> = others.into_iter().filter_map(Area::of).collect();
    let mut edges = Vec::new();
    for (index, room) in rooms.iter().enumerate() {
        for side in room.rings.iter().flat_map(|ring| geometry::sides(ring)) {
            let length = geometry::length(&side);
            let pieces = (length / PIECE_M).ceil().max(1.0) as usize;
            let at = |part: usize| geometry::between(side[0], side[1], part as f64 / pieces as f64);
            let across = [(side[1][1] - side[0][1]) / length, (side[0][0] - side[1][0]) / length];
            if length < 1e-6 {
                continue;
            }
            for part in 0..pieces {
                let piece = [at(part), at(part + 1)];
                let middle = geometry::between(piece[0], piece[1], 0.5);
                let beyond = |sign: f64, far: f64| [0, 1].map(|axis| middle[axis] + sign * far * across[axis]);
                let outwards = if room.contains(beyond(1.0, 0.02)) { -1.0 } else { 1.0 };
                let covered = |point: Point| {
                    let other = |(number, area): (usize, &Area)| number != index && area.contains(point);
                    others.iter().any(|area| area.contains(point)) || rooms.iter().enumerate().any(other)
                };
                if !BEYOND_M.iter().any(|&far| covered(beyond(outwards, far))) {
                    edges.push(piece);
                }
            }
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
        assert!((edges.iter().map(geometry::length).sum::<f64>() - 4.0).abs() < 1e-9, "{edges:?}");
        assert!(edges.iter().flatten().all(|point| point[0] == 0.0 && (0.0..=4.0).contains(&point[1])));
    }

    #[test]
    fn a_hole_in_a_facade_is_no_wall() {
        let facade = vec![rectangle([-1.0, -1.0], [5.0, 5.0]), rectangle([-0.5, -0.5], [4.5, 4.5])];
        assert!(open_edges(&[rectangle([0.0, 0.0], [4.0, 4.0])], vec![facade]).is_empty());
        let far = vec![rectangle([-2.0, -2.0], [6.0, 6.0]), rectangle([-1.5, -1.5], [5.5, 5.5])];
        assert_eq!(open_edges(&[rectangle([0.0, 0.0], [4.0, 4.0])], vec![far]).len(), 32);
        assert!(open_edges(&[], Vec::new()).is_empty());
    }
}
