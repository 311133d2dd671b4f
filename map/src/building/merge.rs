//! Walls that several outlines have in common are drawn once.
//!
//! Formats that know areas give the same wall twice, once for the room on each side, and often not from corner to corner: the
//! wall of a corridor is that of many rooms. Here ends that lie within a tolerance become one point, walls are divided where
//! others end on them, of pieces between the same points one remains, and pieces that go straight on become one again.

use super::error::Error;
use super::geometry::{self, Point, Segment};
use super::index::{Index, pieces};
use super::model::is_place;
use std::collections::{BTreeMap, BTreeSet};

/// More walls than this no floor has.
const MOST_WALLS: usize = 500_000;
/// All walls of a floor together are no longer: those of 100 000 m² of offices have 50 km. **Units:** m.
const LONGEST_M: f64 = 2e6;
/// So often an end is held against a metre of wall, on a floor with very many walls in one place.
const MOST_LOOKS: usize = 20_000_000;
/// Pieces go straight on if they turn by less than 1 degree.
const STRAIGHT: f64 = 0.999_85;

/// The walls of a floor, each once. Two ends are the same, and an end lies on a wall, within `tolerance`. **Units:** m.
///
/// # Errors
/// When a wall reaches to no place of a building, or there are too many.
pub fn merged(walls: &[Segment], tolerance: f64) -> Result<Vec<Segment>, Error> {
    if walls.len() > MOST_WALLS {
        return Err(Error::Model(format!("a floor has {} walls, more than {MOST_WALLS}", walls.len())));
    }
    if let Some(wall) = walls.iter().find(|wall| !wall.iter().all(is_place)) {
        return Err(Error::Model(format!("a wall from {:?} to {:?} is too far from the origin", wall[0], wall[1])));
    }
    let total: f64 = walls.iter().map(geometry::length).sum();
    if total > LONGEST_M {
        return Err(Error::Model(format!("the walls of a floor are {:.0} km long, all together", total / 1e3)));
    }
    let mut corners = Corners { tolerance, places: Vec::new(), cells: BTreeMap::new() };
    let ends: Vec<[usize; 2]> = walls.iter().map(|wall| wall.map(|point| corners.of(point))).collect();
    let joined = divided(&corners, ends)?;
    let joined = straightened(&corners.places, joined, tolerance);
    Ok(joined.into_iter().map(|pair| pair.map(|corner| corners.places[corner])).collect())
}

/// Ends of walls by place.
struct Corners {
    tolerance: f64,
    places: Vec<Point>,
    cells: BTreeMap<[i64; 2], Vec<usize>>,
}

impl Corners {
    /// The number of the corner at a point; a new one if none is near.
    fn of(&mut self, point: Point) -> usize {
        let [x, y] = point.map(|value| (value / self.tolerance).floor() as i64);
        let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
        let near = around.filter_map(|cell| self.cells.get(&cell)).flatten();
        let known = near.copied().find(|&corner| geometry::distance(self.places[corner], point) <= self.tolerance);
        known.unwrap_or_else(|| {
            self.places.push(point);
            self.cells.entry([x, y]).or_default().push(self.places.len() - 1);
            self.places.len() - 1
        })
    }
}

/// Walls divided at all corners that lie on them; each piece once.
fn divided(corners: &Corners, ends: Vec<[usize; 2]>) -> Result<BTreeSet<[usize; 2]>, Error> {
    let points: Vec<Segment> = corners.places.iter().map(|place| [*place; 2]).collect();
    let index = Index::of(&points);
    let (mut joined, mut looks) = (BTreeSet::new(), 0);
    for [a, b] in ends.into_iter().collect::<BTreeSet<_>>() {
        let wall = [corners.places[a], corners.places[b]];
        let length = geometry::length(&wall);
        let mut on = vec![(0.0, a), (length, b)];
        for bounds in pieces(&wall, 1.0).filter_map(geometry::bounds) {
            let near = index.near(bounds, corners.tolerance);
            looks += 1 + near.len();
            for corner in near.into_iter().filter(|&corner| corner != a && corner != b) {
                let foot = geometry::nearest(&wall, corners.places[corner]);
                if geometry::distance(foot, corners.places[corner]) <= corners.tolerance {
                    on.push((geometry::distance(wall[0], foot), corner));
                }
            }
        }
        if looks > MOST_LOOKS || joined.len() > 4 * MOST_WALLS {
            return Err(Error::Model("too many walls of a floor lie in one place".to_owned()));
        }
        on.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        on.dedup_by_key(|(_, corner)| *corner);
        for pair in on.windows(2).filter(|pair| pair[0].1 != pair[1].1) {
            joined.insert([pair[0].1.min(pair[1].1), pair[0].1.max(pair[1].1)]);
        }
    }
    Ok(joined)
}

/// Pieces that go straight on where nothing else ends become one.
fn straightened(places: &[Point], joined: BTreeSet<[usize; 2]>, tolerance: f64) -> BTreeSet<[usize; 2]> {
    let mut next: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for [a, b] in &joined {
        next.entry(*a).or_default().insert(*b);
        next.entry(*b).or_default().insert(*a);
    }
    let corners: Vec<usize> = next.keys().copied().collect();
    for corner in corners {
        let ends: Vec<usize> = next[&corner].iter().copied().collect();
        let [a, b] = ends[..] else { continue };
        let (from, at, to) = (places[a], places[corner], places[b]);
        let (before, after) = ([at[0] - from[0], at[1] - from[1]], [to[0] - at[0], to[1] - at[1]]);
        let lengths = before[0].hypot(before[1]) * after[0].hypot(after[1]);
        let turns_little = before[0] * after[0] + before[1] * after[1] > STRAIGHT * lengths;
        let is_on = geometry::distance(geometry::nearest(&[from, to], at), at) <= tolerance;
        if turns_little && is_on && !next[&a].contains(&b) {
            next.remove(&corner);
            for (end, other) in [(a, b), (b, a)] {
                let around = next.entry(end).or_default();
                around.remove(&corner);
                around.insert(other);
            }
        }
    }
    let pairs = next.iter().flat_map(|(a, others)| others.iter().map(|b| [*a.min(b), *a.max(b)]));
    pairs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn total(walls: &[Segment]) -> f64 {
        walls.iter().map(geometry::length).sum()
    }

    #[test]
    fn two_rooms_at_a_corridor_have_five_walls_less() {
        let square = |x: f64| [[x, 0.0], [x + 4.0, 0.0], [x + 4.0, 5.0], [x, 5.0]];
        let corridor = [[0.0, 5.0], [8.0, 5.0], [8.0, 7.0], [0.0, 7.0]];
        let outlines = [square(0.0), square(4.0), corridor];
        // One room is drawn some millimetres beside the other.
        let moved = outlines[1].map(|[x, y]| [x + 0.004, y - 0.003]);
        let walls: Vec<Segment> = [outlines[0], moved, corridor].iter().flat_map(|o| geometry::sides(o)).collect();
        let left = merged(&walls, 0.01).unwrap();
        // Around both rooms and the corridor, the wall between the rooms, and both rooms' walls to the corridor.
        assert!((total(&left) - (8.0 + 7.0 + 8.0 + 7.0 + 5.0 + 8.0)).abs() < 0.05, "{}", total(&left));
        let again = merged(&left, 0.01).unwrap();
        assert!(again.len() == left.len() && total(&again) == total(&left), "{again:?}");
    }

    #[test]
    fn a_wall_in_pieces_is_one_and_a_curve_stays_a_curve() {
        let pieces: Vec<Segment> = (0..10).map(|i| [[f64::from(i), 0.0], [f64::from(i) + 1.0, 0.0]]).collect();
        assert_eq!(merged(&pieces, 0.01).unwrap(), [[[0.0, 0.0], [10.0, 0.0]]]);
        let circle: Vec<Point> = (0..120).map(|i| (f64::from(i) * 0.052_36).sin_cos()).map(|(y, x)| [x, y]).collect();
        let walls: Vec<Segment> = geometry::sides(&circle).collect();
        assert!((total(&merged(&walls, 0.01).unwrap()) - total(&walls)).abs() < 0.01);
    }

    #[test]
    fn what_is_no_wall_is_refused() {
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            assert!(merged(&[[[0.0, 0.0], [bad, 0.0]]], 0.01).unwrap_err().to_string().contains("too far"));
        }
        assert_eq!(merged(&[[[1.0, 1.0], [1.001, 1.0]]], 0.01).unwrap(), Vec::<Segment>::new());
    }

    #[test]
    fn more_than_a_building_has_is_refused() {
        let message = |walls: &[Segment]| merged(walls, 0.01).unwrap_err().to_string();
        assert!(message(&vec![[[0.0; 2], [1.0, 0.0]]; MOST_WALLS + 1]).contains("500001 walls"));
        assert!(message(&vec![[[0.0, 0.0], [5e3, 0.0]]; 401]).contains("2005 km"));
        // All walls of a square metre, two thousand corners.
        let corners: Vec<Point> = (0..2_000).map(|i| [f64::from(i % 40) * 0.024, f64::from(i / 40) * 0.019]).collect();
        let walls: Vec<Segment> =
            (0..100_000).map(|i| [corners[i % 2_000], corners[(i * 7 + i / 2_000 + 1) % 2_000]]).collect();
        assert!(message(&walls).contains("lie in one place"));
    }

    proptest! {
        #[test]
        fn every_wall_is_still_covered(
            walls in proptest::collection::vec(
                proptest::array::uniform2(proptest::array::uniform2(-40_i32..40)), 1..30),
        ) {
            // On a raster of a decimetre ends are either the same or apart.
            let walls: Vec<Segment> =
                walls.iter().map(|wall| wall.map(|point| point.map(|value| f64::from(value) / 10.0))).collect();
            let left = merged(&walls, 0.01).unwrap();
            prop_assert!(total(&left) <= total(&walls) + 0.02 * walls.len() as f64);
            for [a, b] in &walls {
                for part in [0.0, 0.23, 0.5, 0.77, 1.0] {
                    let place = geometry::between(*a, *b, part);
                    let far = left.iter().map(|wall| geometry::distance(geometry::nearest(wall, place), place));
                    prop_assert!(geometry::distance(*a, *b) < 0.01 || far.fold(9.0, f64::min) <= 0.021);
                }
            }
        }
    }
}
