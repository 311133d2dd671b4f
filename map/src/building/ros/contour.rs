//! Walls from occupied cells: the borders of each occupied region, closed, as few straight lines as the raster allows.
//!
//! A border is followed along the sides of cells; cells that touch at a corner are one region, so that a slanting wall does
//! not leak. Where a border steps sideways by one cell, as slanting walls do all along, it is taken through the middle of the
//! step: such middles lie on one line. What then lies within half a cell of a straight line becomes that line (Douglas and
//! Peucker, 1973). A wall of one cell becomes its middle line. Nothing is moved by more than a cell, and every border stays
//! closed.

use super::raster::Raster;
use crate::building::geometry::{self, Point, Segment};

/// More walls than this no map has.
const MOST_WALLS: usize = 500_000;
/// What is within this of a line becomes the line. **Units:** cells.
const STRAIGHT_CELLS: f64 = 0.5;
/// Longer borders are straightened in parts of so many corners: the work for one grows with the square of it.
const MOST_CORNERS: usize = 2_000;

/// East, north, west, south.
const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
const SOUTH: usize = 3;

/// The walls of a raster. **Units:** cells from its lower left corner.
///
/// # Errors
/// When there are too many: the image is no map.
pub fn walls(raster: &Raster) -> Result<Vec<Segment>, String> {
    let mut seen = vec![false; raster.occupied.len()];
    let too_many = || format!("its image gives more than {MOST_WALLS} walls: is it a map?");
    let mut walls = Vec::new();
    for y in 0..raster.height as i64 {
        for x in 0..raster.width as i64 {
            let cell = y as usize * raster.width + x as usize;
            if !raster.occupied[cell] || seen[cell] || raster.at([x - 1, y]) {
                continue;
            }
            let corners = corners(raster, [x, y], &mut seen).ok_or_else(too_many)?;
            let corners = straightened(&corners);
            walls.extend(match corners[..] {
                [a, b] => vec![[a, b]],
                _ => geometry::sides(&corners).collect(),
            });
            if walls.len() > MOST_WALLS {
                return Err(too_many());
            }
        }
    }
    Ok(walls)
}

/// A border with more straight parts than this is that of no region of a map.
const MOST_RUNS: usize = 2_000_000;

/// The corners of the border that runs down the left side of a cell, with the region to its left; nothing if there are too
/// many. All left sides of cells on the border are marked as seen.
fn corners(raster: &Raster, [x, y]: [i64; 2], seen: &mut [bool]) -> Option<Vec<Point>> {
    let start = [x, y + 1];
    let (mut place, mut heading) = (start, SOUTH);
    // Each straight part: where it begins, its heading and its length.
    let mut runs: Vec<([i64; 2], usize, i64)> = Vec::new();
    loop {
        if heading == SOUTH {
            seen[(place[1] - 1) as usize * raster.width + place[0] as usize] = true;
        }
        match runs.last_mut() {
            Some(run) if run.1 == heading => run.2 += 1,
            _ => runs.push((place, heading, 1)),
        }
        if runs.len() > MOST_RUNS {
            return None;
        }
        let step = STEPS[heading];
        place = [place[0] + step[0], place[1] + step[1]];
        // The cells ahead on both sides: those that touch the corner, in the quarters between the headings.
        let ahead = |turned: usize| {
            let side = STEPS[(heading + turned) % 4];
            let twice = [step[0] + side[0], step[1] + side[1]];
            raster.at([place[0] + (twice[0] - 1) / 2, place[1] + (twice[1] - 1) / 2])
        };
        if ahead(3) {
            heading = (heading + 3) % 4;
        } else if !ahead(1) {
            heading = (heading + 1) % 4;
        }
        if place == start && heading == SOUTH {
            break;
        }
    }
    if runs.len() > 1 && runs[0].1 == runs[runs.len() - 1].1 {
        // The border was begun within a straight part.
        let (from, heading, length) = runs.pop().unwrap_or_default();
        runs[0] = (from, heading, length + runs[0].2);
    }
    let mut corners = Vec::new();
    for (index, &(from, heading, length)) in runs.iter().enumerate() {
        let to = |part: f64| [0, 1].map(|axis| from[axis] as f64 + part * STEPS[heading][axis] as f64);
        if length == 1 {
            corners.push(to(0.5));
        } else if runs[(index + 1) % runs.len()].2 > 1 {
            corners.push(to(length as f64));
        }
    }
    Some(corners)
}

/// The corners of a border that are needed.
fn straightened(corners: &[Point]) -> Vec<Point> {
    let Some(&first) = corners.first() else { return Vec::new() };
    let farthest = |from: Point| {
        let far = |index: &usize| geometry::distance(corners[*index], from);
        (0..corners.len()).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or_default()
    };
    // From one end of the region to the other and back: ends are corners in any case.
    let start = farthest(first);
    let mut ring: Vec<Point> = corners[start..].iter().chain(&corners[..start]).copied().collect();
    let middle = (0..ring.len())
        .max_by(|a, b| geometry::distance(ring[*a], ring[0]).total_cmp(&geometry::distance(ring[*b], ring[0])))
        .unwrap_or_default();
    ring.push(ring[0]);
    let mut kept = vec![false; ring.len()];
    let mut fixed: Vec<usize> = (0..ring.len()).step_by(MOST_CORNERS).collect();
    fixed.extend([middle, ring.len() - 1]);
    fixed.sort_unstable();
    let mut open: Vec<[usize; 2]> = fixed.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    fixed.iter().for_each(|index| kept[*index] = true);
    while let Some([from, to]) = open.pop() {
        let line = [ring[from], ring[to]];
        let far = |index: usize| geometry::distance(geometry::nearest(&line, ring[index]), ring[index]);
        let Some(most) = (from + 1..to).max_by(|a, b| far(*a).total_cmp(&far(*b))) else { continue };
        if far(most) > STRAIGHT_CELLS {
            kept[most] = true;
            open.extend([[from, most], [most, to]]);
        }
    }
    kept.pop();
    ring.into_iter().zip(kept).filter(|(_, is_kept)| *is_kept).map(|(corner, _)| corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rows from the highest to the lowest; `#` is occupied.
    fn raster(rows: &[&str]) -> Raster {
        let occupied = rows.iter().rev().flat_map(|row| row.chars().map(|cell| cell == '#')).collect();
        Raster { width: rows[0].len(), height: rows.len(), occupied }
    }

    fn total(walls: &[Segment]) -> f64 {
        walls.iter().map(geometry::length).sum()
    }

    #[test]
    fn a_block_has_four_walls_and_a_ring_eight() {
        let walls = walls(&raster(&["......", ".###..", ".###..", "......"])).unwrap();
        assert_eq!((walls.len(), total(&walls)), (4, 10.0));
        let ring =
            super::walls(&raster(&["########", "########", "##....##", "##....##", "########", "########"])).unwrap();
        assert_eq!((ring.len(), total(&ring)), (8, 28.0 + 12.0));
        let line = super::walls(&raster(&["......", ".####.", "......"])).unwrap();
        assert_eq!(line.iter().map(geometry::length).sum::<f64>(), 4.0);
        assert!(line.iter().flatten().all(|[_, y]| *y == 1.5));
    }

    #[test]
    fn a_slanting_wall_is_two_lines_and_its_ends() {
        // Two cells thick, one up for every four along, 80 cells long.
        let width = 90;
        let mut raster = Raster { width, height: 30, occupied: vec![false; width * 30] };
        for x in 0..80 {
            for y in [x / 4 + 3, x / 4 + 4] {
                raster.occupied[y * width + x + 4] = true;
            }
        }
        let walls = walls(&raster).unwrap();
        assert!(walls.len() <= 8, "{walls:?}");
    }

    /// Free cells that one reaches from another over free cells, and over any way that crosses no wall.
    fn floods(raster: &Raster, walls: &[Segment]) -> (Vec<usize>, Vec<usize>) {
        const PARTS: i64 = 4;
        let number = |size: [i64; 2], may: &dyn Fn([i64; 2], [i64; 2]) -> bool| {
            let mut regions = vec![usize::MAX; (size[0] * size[1]) as usize];
            let at = |[x, y]: [i64; 2]| (y * size[0] + x) as usize;
            for start in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
                let mut open = vec![start];
                let region = at(start);
                while let Some(cell) = open.pop().filter(|_| regions[region] == usize::MAX || regions[region] == region)
                {
                    if regions[at(cell)] == region {
                        continue;
                    }
                    regions[at(cell)] = region;
                    for step in STEPS {
                        let next = [cell[0] + step[0], cell[1] + step[1]];
                        let within = (0..2).all(|axis| (0..size[axis]).contains(&next[axis]));
                        if within && regions[at(next)] == usize::MAX && may(cell, next) {
                            open.push(next);
                        }
                    }
                }
            }
            regions
        };
        let size = [raster.width as i64, raster.height as i64];
        let cells = number(size, &|a, b| !raster.at(a) && !raster.at(b));
        let centre = |[x, y]: [i64; 2]| [x, y].map(|value| (value as f64 + 0.517) / PARTS as f64);
        let fine = number(size.map(|size| size * PARTS), &|a, b| {
            let way = [centre(a), centre(b)];
            walls.iter().all(|wall| geometry::crossing(&way, wall).is_none())
        });
        (cells, fine)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn what_the_raster_keeps_apart_the_walls_keep_apart(
            // Blobs of three cells, so that rooms are wide enough for walls that are a cell beside their place.
            blobs in proptest::collection::vec((1_usize..5, 1_usize..5, any::<bool>()), 1..10),
        ) {
            let side = 26;
            let mut raster = Raster { width: side, height: side, occupied: vec![false; side * side] };
            let mut set = |x: usize, y: usize| raster.occupied[y * side + x] = true;
            for (x, y, upright) in blobs {
                for part in 0..=6 {
                    // Walls of one cell between posts, some of them slanting.
                    let (dx, dy) = if upright { (part / 3, part) } else { (part, part / 2) };
                    set((x * 5 + dx).min(side - 2), (y * 5 + dy).min(side - 2));
                }
            }
            for at in 1..side - 1 {
                for (x, y) in [(at, 1), (at, side - 2), (1, at), (side - 2, at)] {
                    set(x, y);
                }
            }
            let walls = walls(&raster).unwrap();
            let (cells, fine) = floods(&raster, &walls);
            // Places in the middle of nine free cells: walls do not come as near.
            let mut seen = std::collections::BTreeMap::new();
            for y in 1..side as i64 - 1 {
                for x in 1..side as i64 - 1 {
                    if (-1..=1).all(|dx| (-1..=1).all(|dy| !raster.at([x + dx, y + dy]))) {
                        let region = cells[y as usize * side + x as usize];
                        let fine = fine[(y as usize * 4 + 2) * side * 4 + x as usize * 4 + 2];
                        prop_assert_eq!(*seen.entry(fine).or_insert(region), region, "({}, {})", x, y);
                    }
                }
            }
        }

        #[test]
        fn any_raster_has_borders(occupied in proptest::collection::vec(any::<bool>(), 63)) {
            let raster = Raster { width: 9, height: 7, occupied };
            let walls = walls(&raster).unwrap();
            // Every occupied cell with a free side has a wall within a cell of that side.
            for (x, y) in (0..9).flat_map(|x| (0..7).map(move |y| (x, y))) {
                for step in STEPS {
                    if raster.at([x, y]) && !raster.at([x + step[0], y + step[1]]) {
                        let side = [x as f64 + 0.5 + step[0] as f64 / 2.0, y as f64 + 0.5 + step[1] as f64 / 2.0];
                        let near = walls.iter().map(|wall| geometry::distance(geometry::nearest(wall, side), side));
                        prop_assert!(near.fold(9.0, f64::min) <= 1.0, "{:?}", side);
                    }
                }
            }
        }
    }
}
