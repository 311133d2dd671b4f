//! Whether one gets everywhere: floors are divided into small cells, and from the entrances a flood goes through doors
//! and openings, up and down stairs and elevators.

use super::{Kind, Notes};
use crate::building::geometry::{self, Point};
use crate::building::index::pieces;
use crate::building::model::{Building, Connector, Floor};

/// Side of a cell: a door of 0.6 m has room for three. **Units:** m.
const CELL_M: f64 = 0.2;
/// Around a floor, so that one can also go around a building. **Units:** m.
const MARGIN_M: f64 = 1.0;
/// What lies before stairs has at least so many cells.
const LANDING_CELLS: usize = 9;
/// A floor with more cells than this has coarser ones.
const MOST_CELLS: f64 = 2e6;

/// Looks at all floors together.
pub fn check(building: &Building, notes: &mut Notes<'_>) {
    // Without walls everything is reached; that there are none has been told.
    let grids: Vec<Grid> = building.floors.iter().map(Grid::of).collect();
    let joined: Vec<Vec<(usize, Vec<usize>)>> = building
        .connectors
        .iter()
        .map(|connector| {
            let cells = |(number, outline): &(i32, Vec<Point>)| {
                let floor = building.floors.iter().position(|floor| floor.number == *number)?;
                Some((floor, grids[floor].inside(outline)))
            };
            connector.outlines.iter().filter_map(cells).collect()
        })
        .collect();
    let mut flood = Flood { grids: &grids, joined: &joined, reached: Vec::new() };
    flood.reached = grids.iter().map(|grid| vec![false; grid.count()]).collect();
    let starts = building.entrances.iter().filter_map(|entrance| {
        let floor = building.floors.iter().position(|floor| floor.number == entrance.floor)?;
        Some((floor, grids[floor].cell(entrance.place)?))
    });
    let mut starts: Vec<_> = starts.collect();
    if starts.is_empty() {
        starts.extend(flood.largest(building));
    }
    flood.from(starts);
    for (index, floor) in building.floors.iter().enumerate() {
        let seen = floor.rooms.iter().any(|room| flood.reaches(index, &room.outline));
        if !seen && !floor.rooms.is_empty() {
            let what = format!("no stairs and no elevator lead to floor {}", floor.number);
            let cure = "draw the stairs on both floors under one name, with a door or an opening to their landing";
            notes.note(Kind::UnreachableFloor, Some(floor.number), None, None, what, cure);
            // Its rooms are looked at as seen from the largest part of the floor.
            let start = flood.largest_of(index, floor);
            flood.from(start.into_iter().collect());
        }
    }
    for (index, floor) in building.floors.iter().enumerate() {
        for room in floor.rooms.iter().filter(|room| !flood.reaches(index, &room.outline)) {
            let what = format!("no door leads from the rest of the building to room '{}'", room.name);
            let cure = "draw its door, cut the wall there, or remove the room if nobody enters it";
            let place = Some(geometry::centre(&room.outline));
            notes.note(Kind::UnreachableRoom, Some(floor.number), place, Some(room.name.clone()), what, cure);
        }
    }
    for (connector, cells) in building.connectors.iter().zip(&joined) {
        connector_meets(building, connector, &grids, cells, notes);
    }
}

/// Whether a connector joins floors, and can be entered on each.
fn connector_meets(
    building: &Building,
    connector: &Connector,
    grids: &[Grid],
    cells: &[(usize, Vec<usize>)],
    notes: &mut Notes<'_>,
) {
    let called = format!("{} '{}'", connector.kind.word(), connector.name);
    if let [(floor, outline)] = &connector.outlines[..] {
        let what = format!("{called} lie on floor {floor} only");
        let cure = "draw them under the same name on every floor that they join";
        notes.at(Kind::MeetsNothing, *floor, geometry::centre(outline), what, cure);
        return;
    }
    for ((floor, cells), (number, outline)) in cells.iter().zip(&connector.outlines) {
        let part = grids[*floor].part(cells);
        let beside = part.iter().filter(|&&cell| {
            let place = grids[*floor].place(cell);
            !geometry::contains(outline, place)
                && (building.floors[*floor].rooms.is_empty() || building.floors[*floor].room_at(place).is_some())
        });
        // A cell may come to lie half outside of a slanted outline: a landing has more than these.
        if beside.take(LANDING_CELLS).count() < LANDING_CELLS {
            let what = format!("{called} cannot be entered on floor {number}");
            let cure = "cut the wall at its landing, draw a door there, or take this floor away from it";
            notes.at(Kind::MeetsNothing, *number, geometry::centre(outline), what, cure);
        }
    }
}

/// A floor in cells, row by row.
struct Grid {
    low: Point,
    side: f64,
    columns: usize,
    rows: usize,
    /// Whether a wall stands between a cell and the next to the right, and the next above.
    blocked: [Vec<bool>; 2],
}

impl Grid {
    fn of(floor: &Floor) -> Self {
        let [low, high] = geometry::bounds(floor.points()).unwrap_or_default();
        let low = low.map(|value| value - MARGIN_M);
        let size = [0, 1].map(|axis| high[axis] + MARGIN_M - low[axis]);
        let side = CELL_M.max((size[0] * size[1] / MOST_CELLS).sqrt());
        let [columns, rows] = size.map(|size| (size / side).ceil() as usize + 1);
        let mut grid = Self { low, side, columns, rows, blocked: [0, 1].map(|_| vec![false; columns * rows]) };
        for wall in &floor.walls {
            // Beyond its ends a wall stands no longer, but a wall that ends between two cells must not be missed.
            for piece in pieces(wall, 1.0) {
                grid.block(&piece);
            }
        }
        grid
    }

    fn block(&mut self, wall: &geometry::Segment) {
        let Some([low, high]) = geometry::bounds(*wall) else { return };
        let from = self.column_row(low.map(|value| value - self.side));
        let to = self.column_row(high.map(|value| value + self.side));
        for row in from[1]..=to[1] {
            for column in from[0]..=to[0] {
                let cell = row * self.columns + column;
                let here = self.place(cell);
                let neighbours = [[here[0] + self.side, here[1]], [here[0], here[1] + self.side]];
                for (blocked, neighbour) in self.blocked.iter_mut().zip(neighbours) {
                    blocked[cell] |= geometry::crossing(&[here, neighbour], wall).is_some();
                }
            }
        }
    }

    fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// The nearest cell's.
    fn column_row(&self, point: Point) -> [usize; 2] {
        let at = |axis: usize, count: usize| {
            (((point[axis] - self.low[axis]) / self.side).floor().max(0.0) as usize).min(count - 1)
        };
        [at(0, self.columns), at(1, self.rows)]
    }

    /// The cell at a point of the grid.
    fn cell(&self, point: Point) -> Option<usize> {
        let [column, row] = self.column_row(point);
        let cell = row * self.columns + column;
        (geometry::distance(self.place(cell), point) <= self.side).then_some(cell)
    }

    /// The middle of a cell, off round numbers: walls stand there.
    fn place(&self, cell: usize) -> Point {
        let [column, row] = [cell % self.columns, cell / self.columns];
        [self.low[0] + (column as f64 + 0.4871) * self.side, self.low[1] + (row as f64 + 0.5127) * self.side]
    }

    /// The cells of an outline; the one in its middle if it is smaller than a cell.
    fn inside(&self, outline: &[Point]) -> Vec<usize> {
        let Some([low, high]) = geometry::bounds(outline.iter().copied()) else { return Vec::new() };
        let (from, to) = (self.column_row(low), self.column_row(high));
        let cells = (from[1]..=to[1]).flat_map(|row| (from[0]..=to[0]).map(move |column| (row, column)));
        let cells = cells.map(|(row, column)| row * self.columns + column);
        let found: Vec<usize> = cells.filter(|&cell| geometry::contains(outline, self.place(cell))).collect();
        if found.is_empty() { self.cell(geometry::centre(outline)).into_iter().collect() } else { found }
    }

    /// The cells beside one without a wall between.
    fn beside(&self, cell: usize) -> impl Iterator<Item = usize> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let right = (column + 1 < self.columns && !self.blocked[0][cell]).then(|| cell + 1);
        let left = (column > 0 && !self.blocked[0][cell.wrapping_sub(1)]).then(|| cell - 1);
        let above = (row + 1 < self.rows && !self.blocked[1][cell]).then(|| cell + self.columns);
        let below = (row > 0 && !self.blocked[1][cell.wrapping_sub(self.columns)]).then(|| cell - self.columns);
        [right, left, above, below].into_iter().flatten()
    }

    /// All cells that are reached from some on this floor alone.
    fn part(&self, from: &[usize]) -> Vec<usize> {
        let mut seen = vec![false; self.count()];
        let mut open = from.to_vec();
        let mut part = Vec::new();
        while let Some(cell) = open.pop() {
            if !std::mem::replace(&mut seen[cell], true) {
                part.push(cell);
                open.extend(self.beside(cell));
            }
        }
        part
    }
}

/// What is reached.
struct Flood<'a> {
    grids: &'a [Grid],
    /// For each connector its floors and the cells there.
    joined: &'a [Vec<(usize, Vec<usize>)>],
    reached: Vec<Vec<bool>>,
}

impl Flood<'_> {
    /// Goes on from some cells of floors.
    fn from(&mut self, starts: Vec<(usize, usize)>) {
        let mut open = starts;
        let mut taken = vec![false; self.joined.len()];
        let by_cell: Vec<std::collections::BTreeMap<usize, Vec<usize>>> = (0..self.grids.len())
            .map(|floor| {
                let mut cells: std::collections::BTreeMap<usize, Vec<usize>> = std::collections::BTreeMap::new();
                for (connector, floors) in self.joined.iter().enumerate() {
                    for cell in floors.iter().filter(|(other, _)| *other == floor).flat_map(|(_, cells)| cells) {
                        cells.entry(*cell).or_default().push(connector);
                    }
                }
                cells
            })
            .collect();
        while let Some((floor, cell)) = open.pop() {
            if std::mem::replace(&mut self.reached[floor][cell], true) {
                continue;
            }
            open.extend(self.grids[floor].beside(cell).map(|next| (floor, next)));
            for &connector in by_cell[floor].get(&cell).into_iter().flatten() {
                if !std::mem::replace(&mut taken[connector], true) {
                    let cells = self.joined[connector].iter();
                    open.extend(cells.flat_map(|(floor, cells)| cells.iter().map(|cell| (*floor, *cell))));
                }
            }
        }
    }

    fn reaches(&self, floor: usize, outline: &[Point]) -> bool {
        let cells = self.grids[floor].inside(outline);
        let reached = cells.iter().filter(|&&cell| self.reached[floor][cell]).count();
        // Half of it: stairs that stand walled in within a room do not lead into it.
        2 * reached >= cells.len()
    }

    /// A cell of the largest part of the building, floor by floor.
    fn largest(&self, building: &Building) -> Option<(usize, usize)> {
        let parts = building.floors.iter().enumerate().filter_map(|(index, floor)| {
            let start = self.largest_of(index, floor)?;
            Some((self.grids[index].part(&[start.1]).len(), start))
        });
        parts.max_by_key(|(size, _)| *size).map(|(_, start)| start)
    }

    /// A cell of that part of a floor in which most of the area of rooms lies.
    fn largest_of(&self, index: usize, floor: &Floor) -> Option<(usize, usize)> {
        let grid = &self.grids[index];
        let mut part_of = vec![usize::MAX; grid.count()];
        let mut sizes: Vec<(usize, usize)> = Vec::new();
        for room in &floor.rooms {
            for cell in grid.inside(&room.outline) {
                if part_of[cell] == usize::MAX {
                    for other in grid.part(&[cell]) {
                        part_of[other] = sizes.len();
                    }
                    sizes.push((0, cell));
                }
                sizes[part_of[cell]].0 += 1;
            }
        }
        sizes.into_iter().max_by_key(|(size, _)| *size).map(|(_, cell)| (index, cell))
    }
}
