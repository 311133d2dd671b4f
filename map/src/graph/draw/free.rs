//! The free places of a floor in cells, along the direction of most of its walls, and how far each is from a wall.

use crate::building::geometry::{self, Point, Segment};
use crate::building::index::pieces;
use crate::building::{Building, Floor};

/// Around a floor. **Units:** m.
const MARGIN_M: f64 = 0.5;
/// A floor with more cells than this has coarser ones.
const MOST_CELLS: f64 = 4e6;
/// From the middle of a door one looks so far for a free place, and passes its frame. **Units:** m.
const GATE_M: (f64, f64) = (1.2, 0.3);
/// Who goes through a door obliquely keeps so far from its sides: through a narrow one nobody does. **Units:** m.
const JAMB_M: f64 = 0.6;
/// From a door people go straight on so far, if the middle of what is behind it is not nearer. **Units:** m.
pub const STRAIGHT_ON_M: f64 = 2.5;
/// And from a landing. **Units:** m.
const LANDING_M: f64 = 3.5;
/// Bins for the directions of walls, of a quarter turn.
const DIRECTIONS: usize = 90;

/// A floor in cells, row by row.
pub struct Free {
    /// Turned so that most walls lie along the cells. **Units:** rad.
    angle: f64,
    low: Point,
    side: f64,
    columns: usize,
    rows: usize,
    /// Whether one can stand there.
    pub free: Vec<bool>,
    /// Distance from walls and doors: the middle of a corridor is where it is largest. **Units:** m.
    pub clearance: Vec<f32>,
    /// Whether one gets through there without standing there: wide doors.
    through: Vec<bool>,
    /// For each door that leads somewhere the cell in its middle.
    pub gates: Vec<usize>,
    /// The cells straight on from the doors to the middle of what is behind.
    pub straight_on: Vec<usize>,
}

impl Free {
    /// The free places of a floor. Nobody stands nearer to a wall than `clear_m`; a cell has the side `cell_m`.
    pub fn of(building: &Building, floor: &Floor, clear_m: f64, cell_m: f64) -> Self {
        let angle = direction(&floor.walls);
        let connectors = building.connectors.iter();
        let outlines =
            connectors.flat_map(|connector| &connector.outlines).filter(|(number, _)| *number == floor.number);
        let outlines: Vec<&[Point]> = outlines.map(|(_, outline)| &outline[..]).collect();
        let points = floor.points().chain(outlines.iter().flat_map(|outline| outline.iter().copied()));
        let [low, high] = geometry::bounds(points.map(|point| turned(point, -angle))).unwrap_or_default();
        let low = low.map(|value| value - MARGIN_M);
        let size = [0, 1].map(|axis| high[axis] + MARGIN_M - low[axis]);
        let side = cell_m.max((size[0] * size[1] / MOST_CELLS).sqrt());
        let [columns, rows] = size.map(|size| (size / side).ceil() as usize + 1);
        let (free, through) = (vec![false; columns * rows], vec![false; columns * rows]);
        let (clearance, gates, straight_on) = (Vec::new(), Vec::new(), Vec::new());
        let mut grid = Self { angle, low, side, columns, rows, free, clearance, through, gates, straight_on };

        let mut lines: Vec<bool> = vec![false; grid.count()];
        for line in floor.walls.iter().chain(floor.doors.iter().map(|door| &door.line)) {
            grid.near(line, 0.75 * grid.side, |cell| lines[cell] = true);
        }
        grid.clearance = grid.distances(&lines);
        let mut inside: Vec<bool> = vec![false; grid.count()];
        for outline in floor.rooms.iter().map(|room| &room.outline[..]).chain(outlines) {
            for cell in grid.cells_in(outline) {
                inside[cell] = true;
            }
        }
        if floor.rooms.is_empty() {
            inside = grid.enclosed(&lines);
        }
        // Between rooms whose outlines leave out the wall there may be openings without a door.
        let beyond = grid.distances(&inside);
        grid.free = beyond.iter().map(|&distance| f64::from(distance) < clear_m).collect();
        let mut blocked = vec![false; grid.count()];
        for wall in &floor.walls {
            grid.near(wall, clear_m, |cell| blocked[cell] = true);
        }
        for connector in &building.connectors {
            for (_, outline) in connector.outlines.iter().filter(|(number, _)| *number == floor.number) {
                for cell in grid.cells_in(outline) {
                    blocked[cell] |= !on_level(&connector.way, floor.height_m, grid.place(cell));
                }
            }
        }
        for (free, blocked) in grid.free.iter_mut().zip(blocked) {
            *free &= !blocked;
        }
        for door in &floor.doors {
            // The middle first; where something stands there, beside it.
            for part in [0.5, 0.35, 0.65, 0.2, 0.8] {
                if grid.open(&door.line, part, &floor.walls) {
                    break;
                }
            }
        }
        grid
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// Side of a cell. **Units:** m.
    pub fn side(&self) -> f64 {
        self.side
    }

    /// Into the frame of the cells.
    pub fn to_cells(&self, point: Point) -> Point {
        turned(point, -self.angle)
    }

    /// And back.
    pub fn to_building(&self, point: Point) -> Point {
        turned(point, self.angle)
    }

    /// The middle of a cell. **Frame:** building.
    pub fn place(&self, cell: usize) -> Point {
        self.to_building(self.middle(cell))
    }

    /// The middle of a cell. **Frame:** cells.
    pub fn middle(&self, cell: usize) -> Point {
        let [column, row] = [cell % self.columns, cell / self.columns];
        [self.low[0] + (column as f64 + 0.5) * self.side, self.low[1] + (row as f64 + 0.5) * self.side]
    }

    /// The cell that holds a point. **Frame:** building.
    pub fn cell(&self, point: Point) -> Option<usize> {
        let point = self.to_cells(point);
        let [column, row] = [0, 1].map(|axis| (point[axis] - self.low[axis]) / self.side);
        (column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64)
            .then(|| row as usize * self.columns + column as usize)
    }

    /// The free cell nearest to a point, no farther than `reach`. **Frame:** building; **Units:** m.
    pub fn nearest(&self, point: Point, reach: f64) -> Option<usize> {
        let mut found: Option<(f64, usize)> = None;
        self.near(&[point, point], reach, |cell| {
            let far = geometry::distance(self.place(cell), point);
            if self.free[cell] && found.is_none_or(|(least, _)| far < least) {
                found = Some((far, cell));
            }
        });
        found.map(|(_, cell)| cell)
    }

    /// Whether one gets from one point to another straight on, over free cells and through wide doors alone. **Frame:** building.
    pub fn sees(&self, from: Point, to: Point) -> bool {
        let count = (geometry::distance(from, to) / (0.5 * self.side)).ceil().max(1.0) as usize;
        (0..=count).all(|step| {
            let point = geometry::between(from, to, step as f64 / count as f64);
            self.cell(point).is_some_and(|cell| self.free[cell] || self.through[cell])
        })
    }

    /// The cells around one: to the right first, then counter-clockwise. Nothing beyond the border, which nobody reaches.
    pub fn around(&self, cell: usize) -> [Option<usize>; 8] {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let at = |right: isize, up: isize| {
            let (column, row) = (column.checked_add_signed(right)?, row.checked_add_signed(up)?);
            (column < self.columns && row < self.rows).then(|| row * self.columns + column)
        };
        [at(1, 0), at(1, 1), at(0, 1), at(-1, 1), at(-1, 0), at(-1, -1), at(0, -1), at(1, -1)]
    }

    /// The cells whose middle lies in an outline. **Frame:** building.
    pub fn cells_in(&self, outline: &[Point]) -> Vec<usize> {
        let outline: Vec<Point> = outline.iter().map(|&point| self.to_cells(point)).collect();
        let Some([low, high]) = geometry::bounds(outline.iter().copied()) else { return Vec::new() };
        let row_of = |v: f64| ((v - self.low[1]) / self.side - 0.5).max(0.0);
        let mut found = Vec::new();
        for row in row_of(low[1]).floor() as usize..=(row_of(high[1]).ceil() as usize).min(self.rows - 1) {
            let v = self.low[1] + (row as f64 + 0.5) * self.side;
            let crossed = geometry::sides(&outline).filter(|[a, b]| (a[1] > v) != (b[1] > v));
            let mut us: Vec<f64> = crossed.map(|[a, b]| a[0] + (v - a[1]) / (b[1] - a[1]) * (b[0] - a[0])).collect();
            us.sort_by(f64::total_cmp);
            for pair in us.chunks_exact(2) {
                let [from, to] = [pair[0], pair[1]].map(|u| ((u - self.low[0]) / self.side - 0.5).max(0.0));
                let columns = from.ceil() as usize..=(to.floor() as usize).min(self.columns - 1);
                found.extend(columns.filter(|&column| column as f64 <= to).map(|column| row * self.columns + column));
            }
        }
        found
    }

    /// Visits the cells whose middle is within `reach` of a line. **Frame:** building; **Units:** m.
    pub fn near(&self, line: &Segment, reach: f64, mut visit: impl FnMut(usize)) {
        let line = line.map(|point| self.to_cells(point));
        for piece in pieces(&line, 2.0) {
            let range = |axis: usize, count: usize| {
                let at = |value: f64| ((value - self.low[axis]) / self.side).floor().max(0.0) as usize;
                let (a, b) = (piece[0][axis], piece[1][axis]);
                at(a.min(b) - reach)..=at(a.max(b) + reach).min(count - 1)
            };
            let (across, up) = (range(0, self.columns), range(1, self.rows));
            for row in up {
                for cell in across.clone().map(|column| row * self.columns + column) {
                    let middle = self.middle(cell);
                    if geometry::distance(geometry::nearest(&piece, middle), middle) < reach {
                        visit(cell);
                    }
                }
            }
        }
    }

    /// What cannot be reached from the border without crossing a line.
    fn enclosed(&self, lines: &[bool]) -> Vec<bool> {
        let mut inside = vec![true; self.count()];
        let mut open = vec![0];
        while let Some(cell) = open.pop() {
            if lines[cell] || !std::mem::replace(&mut inside[cell], false) {
                continue;
            }
            let around = self.around(cell);
            open.extend([0, 2, 4, 6].into_iter().filter_map(|side| around[side]).filter(|&next| inside[next]));
        }
        inside
    }

    /// The cells across a door, so far along it, from its middle line to the first free ones on both sides of it; nothing where
    /// none is or where a wall stands between. **Units:** m.
    fn leaf(&self, door: &Segment, along_m: f64, walls: &[Segment]) -> Option<Vec<usize>> {
        let steps = (GATE_M.0 / (0.5 * self.side)) as usize;
        let mut cells = Vec::new();
        for sign in [1.0, -1.0] {
            let at = |step: usize| across(door, along_m, sign * step as f64 * 0.5 * self.side);
            let is_free = |step: &usize| {
                *step as f64 * 0.5 * self.side >= GATE_M.1 && self.cell(at(*step)).is_some_and(|cell| self.free[cell])
            };
            let end = (0..=steps).find(is_free)?;
            let leaf = [at(0), at(end)];
            if walls.iter().any(|wall| geometry::crossing(&leaf, wall).is_some()) {
                return None;
            }
            cells.extend((0..=end).filter_map(|step| self.cell(at(step))));
        }
        Some(cells)
    }

    /// Makes a way of free cells through a door, at a part of its width, and tells whether both sides of it lead somewhere. A wide
    /// one can be looked through obliquely, too.
    fn open(&mut self, door: &Segment, part: f64, walls: &[Segment]) -> bool {
        let length = geometry::length(door);
        if length < 1e-6 {
            return false;
        }
        let Some(cells) = self.leaf(door, part * length, walls) else { return false };
        let beside = (0..).map(|step| JAMB_M + 0.5 * self.side * f64::from(step));
        let beside = beside.take_while(|along_m| *along_m <= length - JAMB_M);
        let doorway: Vec<usize> = beside.filter_map(|along_m| self.leaf(door, along_m, walls)).flatten().collect();
        for cell in doorway {
            self.through[cell] = true;
        }
        for &cell in &cells {
            self.free[cell] = true;
        }
        self.gates.extend(cells.first());
        for sign in [1.0, -1.0] {
            let at = |step: usize| self.cell(across(door, part * length, sign * step as f64 * 0.5 * self.side));
            let (mut wide, mut line) = (0.0, Vec::new());
            for cell in (0..(STRAIGHT_ON_M / (0.5 * self.side)) as usize).map_while(at) {
                if !self.free[cell] || self.clearance[cell] < wide {
                    break;
                }
                wide = self.clearance[cell];
                line.push(cell);
            }
            self.straight_on.extend(line);
        }
        true
    }

    /// From a landing people go straight on to the middle of what is before it, too. **Units:** rad; **Frame:** building.
    pub fn go_straight_on(&mut self, place: Point, direction: f64) {
        let (sin, cos) = direction.sin_cos();
        let at = |step: usize| {
            let far = step as f64 * 0.5 * self.side;
            self.cell([place[0] + far * cos, place[1] + far * sin]).filter(|&cell| self.free[cell])
        };
        let line: Vec<usize> = (0..(LANDING_M / (0.5 * self.side)) as usize).map_while(at).collect();
        let wide = |cell: usize| self.clearance[cell];
        // The first of the widest places.
        let Some(end) = (0..line.len()).rev().max_by(|&a, &b| wide(line[a]).total_cmp(&wide(line[b]))) else { return };
        self.straight_on.extend(&line[..=end]);
    }

    /// Distance of each cell from the nearest of some. **Units:** m.
    ///
    /// # Source
    /// Felzenszwalb and Huttenlocher, Distance Transforms of Sampled Functions (2012): exact, in time linear in the cells.
    pub fn distances(&self, from: &[bool]) -> Vec<f32> {
        let mut squared: Vec<f64> = from.iter().map(|&is| if is { 0.0 } else { FAR }).collect();
        let mut line = Envelope::new(self.columns.max(self.rows));
        for column in 0..self.columns {
            line.transform(&mut squared, column, self.columns, self.rows);
        }
        for row in 0..self.rows {
            line.transform(&mut squared, row * self.columns, 1, self.columns);
        }
        squared.into_iter().map(|squared| (squared.sqrt() * self.side) as f32).collect()
    }
}

/// Farther than any cell, squared.
const FAR: f64 = 1e12;

/// The lower envelope of parabolas, reused from line to line.
struct Envelope {
    values: Vec<f64>,
    roots: Vec<usize>,
    borders: Vec<f64>,
}

impl Envelope {
    fn new(longest: usize) -> Self {
        Self { values: vec![0.0; longest], roots: vec![0; longest], borders: vec![0.0; longest + 1] }
    }

    /// One line of cells: `count` of them from `start`, `stride` apart.
    fn transform(&mut self, cells: &mut [f64], start: usize, stride: usize, count: usize) {
        for i in 0..count {
            self.values[i] = cells[start + i * stride];
        }
        let height = |values: &[f64], i: usize| values[i] + (i * i) as f64;
        let mut last = 0;
        (self.roots[0], self.borders[0], self.borders[1]) = (0, f64::NEG_INFINITY, f64::INFINITY);
        for i in 1..count {
            let border = loop {
                let root = self.roots[last];
                let border = (height(&self.values, i) - height(&self.values, root)) / (2 * (i - root)) as f64;
                if border > self.borders[last] {
                    break border;
                }
                last -= 1;
            };
            last += 1;
            (self.roots[last], self.borders[last], self.borders[last + 1]) = (i, border, f64::INFINITY);
        }
        let mut piece = 0;
        for i in 0..count {
            while self.borders[piece + 1] < i as f64 {
                piece += 1;
            }
            let off = i as f64 - self.roots[piece] as f64;
            cells[start + i * stride] = off * off + self.values[self.roots[piece]];
        }
    }
}

/// Whether a place of stairs is on a floor, and not on a flight or on a landing between: as is the nearest piece of their
/// way. Everywhere where they have none. **Units:** m.
fn on_level(way: &[[f64; 3]], height_m: f64, place: Point) -> bool {
    let far = |pair: &&[[f64; 3]]| {
        let line = [0, 1].map(|end| [pair[end][0], pair[end][1]]);
        geometry::distance(geometry::nearest(&line, place), place)
    };
    let nearest = way.windows(2).min_by(|a, b| far(a).total_cmp(&far(b)));
    nearest.is_none_or(|pair| pair.iter().all(|point| (point[2] - height_m).abs() < 0.1))
}

/// The place so far along a door and so far beside it. **Units:** m.
fn across(door: &Segment, along_m: f64, beside_m: f64) -> Point {
    let length = geometry::length(door);
    let along = [0, 1].map(|axis| (door[1][axis] - door[0][axis]) / length);
    [door[0][0] + along_m * along[0] - beside_m * along[1], door[0][1] + along_m * along[1] + beside_m * along[0]]
}

/// A point turned about the origin. **Units:** rad.
fn turned([x, y]: Point, angle: f64) -> Point {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

/// The direction along which, or across which, most of the length of the walls lies. **Units:** rad, in [0, pi/2).
fn direction(walls: &[Segment]) -> f64 {
    let quarter = std::f64::consts::FRAC_PI_2;
    let of = |wall: &Segment| geometry::direction(wall[0], wall[1]).rem_euclid(quarter);
    let mut bins = [0.0_f64; DIRECTIONS];
    for wall in walls {
        bins[(of(wall) / quarter * DIRECTIONS as f64) as usize % DIRECTIONS] += geometry::length(wall);
    }
    // Walls of one direction may fall on both sides of a border.
    let around = |bin: usize| [DIRECTIONS - 1, 0, 1].into_iter().map(|off| bins[(bin + off) % DIRECTIONS]).sum::<f64>();
    let best = (0..DIRECTIONS).fold(0, |best, bin| if around(bin) > around(best) { bin } else { best });
    let middle = (best as f64 + 0.5) / DIRECTIONS as f64 * quarter;
    let (mut sum, mut weight) = (0.0, 0.0);
    for wall in walls {
        let off = (of(wall) - middle + 0.5 * quarter).rem_euclid(quarter) - 0.5 * quarter;
        if off.abs() < 1.5 / DIRECTIONS as f64 * quarter {
            sum += off * geometry::length(wall);
            weight += geometry::length(wall);
        }
    }
    if weight > 0.0 { (middle + sum / weight).rem_euclid(quarter) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Door, Room};

    /// Two rooms of 4 m by 4 m with a door of 0.8 m between them, turned.
    fn house(angle: f64) -> Building {
        let at = |x: f64, y: f64| turned([x, y], angle);
        let line = |a: (f64, f64), b: (f64, f64)| [at(a.0, a.1), at(b.0, b.1)];
        let walls = vec![
            line((0.0, 0.0), (8.0, 0.0)),
            line((8.0, 0.0), (8.0, 4.0)),
            line((8.0, 4.0), (0.0, 4.0)),
            line((0.0, 4.0), (0.0, 0.0)),
            line((4.0, 0.0), (4.0, 1.0)),
            line((4.0, 1.8), (4.0, 4.0)),
        ];
        let room = |x: f64| {
            let outline = vec![at(x, 0.0), at(x + 4.0, 0.0), at(x + 4.0, 4.0), at(x, 4.0)];
            Room { name: x.to_string(), usage: None, outline }
        };
        let doors = vec![Door { line: line((4.0, 1.0), (4.0, 1.8)), name: None }];
        let floor = Floor { walls, doors, rooms: vec![room(0.0), room(4.0)], ..Floor::default() };
        Building { floors: vec![floor], ..Building::default() }
    }

    #[test]
    fn cells_lie_along_the_walls_and_know_how_far_they_are() {
        for angle in [0.0, 0.4, 1.3] {
            let building = house(angle);
            // Up to a quarter turn, which is the same for cells.
            let off = (direction(&building.floors[0].walls) - angle).rem_euclid(std::f64::consts::FRAC_PI_2);
            assert!(off.min(std::f64::consts::FRAC_PI_2 - off) < 1e-9, "{off}");
            let free = Free::of(&building, &building.floors[0], 0.2, 0.1);
            let middle = free.cell(turned([2.0, 2.0], angle)).unwrap();
            // Cells of walls and of places are each half a cell wrong.
            assert!(free.free[middle] && (f64::from(free.clearance[middle]) - 2.0).abs() < 0.15);
            let near = free.cell(turned([2.0, 0.1], angle)).unwrap();
            let outside = free.cell(turned([8.4, 2.0], angle)).unwrap();
            assert!(!free.free[near] && !free.free[outside]);
            // 3.6 m by 3.6 m in both rooms, and the way through the door.
            let area = free.free.iter().filter(|&&free| free).count() as f64 * 0.01;
            assert!((area - 2.0 * 3.6 * 3.6).abs() < 1.0, "{area}");
            assert_eq!(free.gates.len(), 1);
        }
    }

    #[test]
    fn distances_are_exact() {
        let building = house(0.0);
        let free = Free::of(&building, &building.floors[0], 0.2, 0.2);
        let seeds: Vec<usize> = (0..free.count()).filter(|cell| cell % 131 == 7).collect();
        let mut from = vec![false; free.count()];
        for &seed in &seeds {
            from[seed] = true;
        }
        let found = free.distances(&from);
        for (cell, found) in found.into_iter().enumerate() {
            let near = seeds.iter().map(|&seed| geometry::distance(free.middle(seed), free.middle(cell)));
            assert!((f64::from(found) - near.fold(f64::INFINITY, f64::min)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_floor_without_rooms_is_what_its_walls_enclose() {
        let mut building = house(0.0);
        building.floors[0].rooms.clear();
        let free = Free::of(&building, &building.floors[0], 0.2, 0.1);
        let is = |x: f64, y: f64| free.cell([x, y]).is_some_and(|cell| free.free[cell]);
        assert!(is(2.0, 2.0) && is(6.0, 2.0) && !is(8.4, 2.0) && !is(-0.4, 1.0));
    }

    /// Outlines of rooms leave out a wall of 0.3 m between them, as plans of real buildings do.
    #[test]
    fn one_sees_obliquely_through_a_wide_door_in_a_thick_wall_and_not_through_a_narrow_one() {
        let sees = |wide: f64, [from, to]: [Point; 2]| {
            let outline = |x: f64| vec![[x, 0.0], [x + 4.0, 0.0], [x + 4.0, 4.0], [x, 4.0]];
            let rooms = [0.0, 4.3].map(|x| Room { name: x.to_string(), usage: None, outline: outline(x) }).to_vec();
            let ends = [2.0 - 0.5 * wide, 2.0 + 0.5 * wide];
            let faces = [4.0, 4.3].map(|x| [[[x, 0.0], [x, ends[0]]], [[x, ends[1]], [x, 4.0]]]);
            let doors = vec![Door { line: ends.map(|y| [4.15, y]), name: None }];
            let floor = Floor { walls: faces.concat(), doors, rooms, ..Floor::default() };
            let building = Building { floors: vec![floor], ..Building::default() };
            let free = Free::of(&building, &building.floors[0], 0.2, 0.1);
            assert_eq!(free.gates.len(), 1);
            free.sees(from, to) && free.sees(to, from)
        };
        let oblique = [[3.0, 1.6], [5.3, 2.6]];
        assert!(sees(2.4, oblique) && !sees(1.0, oblique));
        assert!([2.4, 1.0].iter().all(|&wide| sees(wide, [[3.0, 2.0], [5.3, 2.0]])));
        // Not along its sides: nobody goes there.
        assert!(!sees(2.4, [[3.0, 1.1], [5.3, 1.1]]));
    }
}
