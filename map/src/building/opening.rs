//! Doors and openings cut the walls they lie in.
//!
//! Plans draw a wall through from corner to corner and the door on top of it, or as a place on it. What tracks somebody needs
//! the gap. Only what lies along an opening is taken out of a wall: a partition that ends beside the frame, and the short
//! remains between a frame and a corner that other walls meet, stay as they are, or the rooms behind them would leak.

use super::error::Error;
use super::geometry::{self, Outline, Point, Segment};
use super::index::{Index, pieces};
use super::model::is_place;

/// Where one goes through walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// From one side of the frame to the other. **Units:** m.
    pub line: Segment,
    /// Walls are cut so far on both sides of the line. **Units:** m.
    pub depth_m: f64,
}

/// Walls within 45 degrees of the line of an opening lie along it.
const ALONG: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Walls within 10 degrees of each other go on in the same direction.
const STRAIGHT: f64 = 0.985;
/// So near to the wall that holds a place are those that go on from it. **Units:** m.
const SAME_M: f64 = 0.03;

/// More doors than this no floor has.
pub(super) const MOST_DOORS: usize = 20_000;
/// So often an opening is held against a metre of wall, on a floor with very many doors in one place.
const MOST_LOOKS: usize = 20_000_000;

/// What openings leave of walls.
///
/// # Errors
/// When there are more openings than a floor has doors, or very many in one place.
pub fn cut(walls: &[Segment], openings: &[Opening]) -> Result<Vec<Segment>, Error> {
    if openings.len() > MOST_DOORS {
        return Err(Error::Model(format!("a floor has {} doors, more than {MOST_DOORS}", openings.len())));
    }
    let openings: Vec<Opening> = openings.iter().filter(|opening| opening.line.iter().all(is_place)).copied().collect();
    let lines: Vec<Segment> = openings.iter().map(|opening| opening.line).collect();
    let reach = openings.iter().map(|opening| opening.depth_m).fold(0.0, f64::max);
    let index = Index::of(&lines);
    let (mut left, mut looks) = (Vec::new(), 0);
    for wall in walls {
        if !wall.iter().all(is_place) {
            left.push(*wall);
            continue;
        }
        let mut near = Vec::new();
        for bounds in pieces(wall, 1.0).filter_map(geometry::bounds) {
            let found = index.near(bounds, reach);
            looks += 1 + found.len();
            near.extend(found);
        }
        if looks > MOST_LOOKS {
            return Err(Error::Model("too many doors of a floor lie in one place".to_owned()));
        }
        near.sort_unstable();
        near.dedup();
        let mut remains = vec![*wall];
        for opening in near.into_iter().map(|number| &openings[number]) {
            remains = remains.iter().flat_map(|piece| opening.leaves(piece)).collect();
        }
        left.extend(remains);
    }
    Ok(left)
}

impl Opening {
    /// What of a wall is outside.
    fn leaves(&self, wall: &Segment) -> Vec<Segment> {
        let lies_along = cosine(wall, &self.line).abs() >= ALONG;
        if lies_along || crosses(wall, &self.line) { geometry::outside_of(wall, &self.outline()) } else { vec![*wall] }
    }

    /// Its rectangle.
    fn outline(&self) -> Outline {
        let [a, b] = self.line;
        let length = geometry::length(&self.line).max(1e-9);
        let across = [-(b[1] - a[1]) / length * self.depth_m, (b[0] - a[0]) / length * self.depth_m];
        let moved = |point: Point, by: f64| [point[0] + by * across[0], point[1] + by * across[1]];
        vec![moved(a, -1.0), moved(b, -1.0), moved(b, 1.0), moved(a, 1.0)]
    }
}

/// Cosine of the angle between two segments; 0 if one has no length.
fn cosine(a: &Segment, b: &Segment) -> f64 {
    let along = |[from, to]: &Segment| [to[0] - from[0], to[1] - from[1]];
    let ([x, y], [u, v]) = (along(a), along(b));
    let lengths = x.hypot(y) * u.hypot(v);
    if lengths > 0.0 { (x * u + y * v) / lengths } else { 0.0 }
}

/// Whether a wall runs through the opening, not only up to its frame.
fn crosses(wall: &Segment, line: &Segment) -> bool {
    geometry::crossing(line, wall).is_some_and(|(part, _)| {
        let from_frame = part.min(1.0 - part) * geometry::length(line);
        from_frame > SAME_M
    })
}

/// Somebody who has just come in stands so far behind the door. **Units:** m.
const INSIDE_M: f64 = 0.5;

/// Where somebody stands who has just come in by a door: on the side that is inside, or in the door if neither or both are.
pub(super) fn inside_of(door: &Segment, is_inside: impl Fn(Point) -> bool) -> Point {
    let middle = geometry::between(door[0], door[1], 0.5);
    let length = geometry::length(door).max(1e-9);
    let across = [-(door[1][1] - door[0][1]) / length, (door[1][0] - door[0][0]) / length];
    let sides = [1.0, -1.0].map(|sign| [0, 1].map(|axis| middle[axis] + sign * INSIDE_M * across[axis]));
    match sides.map(&is_inside) {
        [true, false] => sides[0],
        [false, true] => sides[1],
        _ => middle,
    }
}

/// The line of a door of some width that somebody drew as a place on a wall, or at most `reach` beside it: along the wall, and
/// moved if the wall ends too near. Nothing where there is no wall. **Units:** m.
pub(super) fn door_at(walls: &Index<'_>, place: Point, width: f64, reach: f64) -> Option<Segment> {
    let near: Vec<&Segment> = walls.near([place; 2], reach).into_iter().map(|number| walls.segment(number)).collect();
    let distance = |wall: &Segment| geometry::distance(geometry::nearest(wall, place), place);
    let least = near.iter().map(|wall| distance(wall)).min_by(f64::total_cmp).filter(|least| *least <= reach)?;
    let touching: Vec<&Segment> = near.into_iter().filter(|wall| distance(wall) <= least + SAME_M).collect();
    let holding = touching.iter().max_by(|a, b| geometry::length(a).total_cmp(&geometry::length(b)))?;
    let foot = geometry::nearest(holding, place);
    let length = geometry::length(holding);
    if length == 0.0 {
        return None;
    }
    let along = [0, 1].map(|axis| (holding[1][axis] - holding[0][axis]) / length);
    // How far one comes in both directions on walls that go on.
    let (mut back, mut ahead) = (0.0_f64, 0.0_f64);
    for wall in touching.iter().filter(|wall| cosine(wall, holding).abs() >= STRAIGHT) {
        for end in *wall {
            let part = (end[0] - foot[0]) * along[0] + (end[1] - foot[1]) * along[1];
            (back, ahead) = (back.max(-part), ahead.max(part));
        }
    }
    let back = (width - ahead.min(width / 2.0)).min(back);
    let ahead = (width - back).min(ahead);
    let at = |part: f64| [foot[0] + part * along[0], foot[1] + part * along[1]];
    (back + ahead > 0.0).then(|| [at(-back), at(ahead)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WALL: Segment = [[0.0, 0.0], [6.0, 0.0]];
    const DOOR: Opening = Opening { line: [[2.0, 0.0], [3.0, 0.0]], depth_m: 0.3 };

    #[test]
    fn a_door_opens_its_wall_and_leaves_what_meets_it() {
        let parallel = [[0.0, 0.2], [6.0, 0.2]];
        let beyond = [[0.0, 0.4], [6.0, 0.4]];
        // Partitions that end at the frame, and one that ends before the door's depth without crossing its line.
        let at_frame = [[2.0, 0.0], [2.0, 3.0]];
        let before = [[2.5, 0.1], [2.5, 3.0]];
        let through = [[2.5, -3.0], [2.5, 3.0]];
        let left = cut(&[WALL, parallel, beyond, at_frame, before, through], &[DOOR]).unwrap();
        assert_eq!(left.len(), 2 + 2 + 1 + 1 + 1 + 2, "{left:?}");
        for kept in [beyond, at_frame, before] {
            assert!(left.contains(&kept), "{kept:?}");
        }
        assert!(left.contains(&[[0.0, 0.0], [2.0, 0.0]]) && left.contains(&[[3.0, 0.2], [6.0, 0.2]]));
        // Of the one that runs through the door, what is farther from it than its depth.
        let cut_off = |wall: &&Segment| wall[0][0] == 2.5 && geometry::length(wall) < 2.75;
        assert_eq!(left.iter().filter(cut_off).count(), 2, "{left:?}");
    }

    #[test]
    fn a_place_on_a_wall_becomes_a_door_that_stays_on_it() {
        let walls = [WALL, [[6.0, 0.0], [6.0, 4.0]], [[0.0, 0.0], [0.0, 4.0]]];
        let index = Index::of(&walls);
        let at = |place, width| door_at(&index, place, width, 0.3);
        assert_eq!(at([2.0, 0.0], 1.0), Some([[1.5, 0.0], [2.5, 0.0]]));
        // Beside the wall, and nearer to a corner than half its width.
        assert_eq!(at([2.0, 0.25], 1.0), Some([[1.5, 0.0], [2.5, 0.0]]));
        assert_eq!(at([0.2, 0.0], 1.0), Some([[0.0, 0.0], [1.0, 0.0]]));
        assert_eq!(at([5.9, 0.0], 1.0), Some([[5.0, 0.0], [6.0, 0.0]]));
        assert_eq!(at([2.0, 0.0], 20.0), Some(WALL));
        assert_eq!(at([2.0, 1.0], 1.0), None);
        // A wall of two pieces that meet in the place.
        let pieces = [[[0.0, 0.0], [2.0, 0.001]], [[2.0, 0.001], [6.0, 0.0]]];
        let line = door_at(&Index::of(&pieces), [2.0, 0.0], 1.0, 0.3).unwrap();
        assert!((geometry::length(&line) - 1.0).abs() < 1e-3 && (line[0][0] - 1.5).abs() < 1e-3, "{line:?}");
    }

    fn place() -> impl Strategy<Value = Point> {
        proptest::array::uniform2(-8.0_f64..8.0)
    }

    proptest! {
        #[test]
        fn nothing_is_added_and_the_line_is_free(
            walls in proptest::collection::vec((place(), place()).prop_map(|(a, b)| [a, b]), 1..8),
            a in place(), b in place(),
        ) {
            prop_assume!(geometry::distance(a, b) > 0.2);
            let opening = Opening { line: [a, b], depth_m: 0.2 };
            let left = cut(&walls, &[opening]).unwrap();
            let total = |walls: &[Segment]| walls.iter().map(geometry::length).sum::<f64>();
            prop_assert!(total(&left) <= total(&walls) + 1e-9);
            for wall in &left {
                prop_assert!(!crosses(wall, &opening.line), "{:?}", wall);
            }
            // What has been cut is not cut again; corners of the rectangle move by rounding.
            prop_assert!((total(&cut(&left, &[opening]).unwrap()) - total(&left)).abs() < 1e-6);
        }
    }
}
