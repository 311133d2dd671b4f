//! The building as the particles see it: walls, connectors and rooms by place.

use super::Error;
use super::areas::{Areas, Outline};
use super::grid::{Grid, Wall};
use crate::building::{self, Building};

/// What joins floors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConnectorKind {
    /// Stairs or a ramp: the height is free, the way leads on foot.
    Stairs,
    /// An elevator: the height is free, the way does not lead anywhere.
    Elevator,
}

/// One floor, as it is given to [`Map::new`].
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Its number in the building.
    pub number: i32,
    /// **Units:** m; **Frame:** building.
    pub height: f32,
    /// What nobody goes through: doors are open.
    pub walls: Vec<Wall>,
    /// What closes the building when doors are closed: walls and doors. Tells what is inside.
    pub closed: Vec<Wall>,
    /// Areas with a name.
    pub rooms: Vec<Outline>,
}

/// What joins floors, as it is given to [`Map::new`].
#[derive(Clone, Debug)]
pub struct Connector {
    /// Stairs or elevator.
    pub kind: ConnectorKind,
    /// Its outline on each floor that it joins, by the index of the floor.
    pub outlines: Vec<(usize, Outline)>,
}

/// A floor of the map.
#[derive(Clone, Debug)]
pub(super) struct Floor {
    pub number: i32,
    pub height: f32,
    pub grid: Grid,
    pub connectors: Areas,
    pub rooms: Areas,
    /// Where somebody may be at all: cells of [`INSIDE_M`], row by row.
    pub inside: Inside,
}

/// Which places are inside of the building.
#[derive(Clone, Debug)]
pub(super) struct Inside {
    origin: [f32; 2],
    columns: usize,
    rows: usize,
    cells: Vec<bool>,
}

/// Side of a cell of [`Inside`]. **Units:** m.
const INSIDE_M: f32 = 0.25;

/// The most floors and connectors that a map may have: particles name them by 16 bits, one of which is taken.
const MOST: usize = u16::MAX as usize - 1;
/// The largest extent of a building. **Units:** m. Beyond, single precision would show at walls.
const LARGEST_M: f32 = 5_000.0;

/// The building as the particles see it.
#[derive(Clone, Debug)]
pub struct Map {
    /// From the lowest to the highest.
    pub(super) floors: Vec<Floor>,
    pub(super) connectors: Vec<Joint>,
}

/// A connector: which floors it joins.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub kind: ConnectorKind,
    /// Floors that it joins, and their heights, from the lowest.
    pub floors: Vec<(u16, f32)>,
}

impl Joint {
    /// The floor that something at the height `z` belongs to, coming from floor `from`: another only when it is clearly
    /// nearer (Foot, 5.18, for floors 3.6 m apart).
    pub fn floor_at(&self, z: f32, from: u16) -> u16 {
        let distance = |floor: u16| {
            self.floors
                .iter()
                .find(|&&(other, _)| other == floor)
                .map_or(f32::INFINITY, |(_, height)| (z - height).abs())
        };
        let nearest = self.floors.iter().map(|&(floor, _)| floor).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        match nearest {
            Some(nearest) if distance(nearest) + HYSTERESIS_M < distance(from) => nearest,
            _ => from,
        }
    }
}

/// How much nearer the other floor has to be. **Units:** m.
const HYSTERESIS_M: f32 = 0.1;

impl Map {
    /// Arranges floors and connectors.
    ///
    /// # Errors
    /// Without floors, with more of anything than can be numbered, with heights that do not rise, beyond 5 km, or where
    /// something is no number.
    pub fn new(plans: Vec<Plan>, connectors: Vec<Connector>) -> Result<Self, Error> {
        if plans.is_empty() {
            return Err(Error::NoFloors);
        }
        for (what, count) in [("floors", plans.len()), ("connectors", connectors.len())] {
            if count > MOST {
                return Err(Error::TooMany { what, count, most: MOST });
            }
        }
        check(&plans, &connectors)?;
        let heights: Vec<f32> = plans.iter().map(|plan| plan.height).collect();
        let floors = plans
            .into_iter()
            .enumerate()
            .map(|(index, plan)| {
                let areas = connectors.iter().enumerate().flat_map(|(number, connector)| {
                    let here = connector.outlines.iter().filter(move |(floor, _)| *floor == index);
                    here.map(move |(_, outline)| (number as u16, outline.clone()))
                });
                Floor::new(plan, areas.collect())
            })
            .collect();
        let joints = connectors
            .iter()
            .map(|connector| {
                let mut floors: Vec<_> =
                    connector.outlines.iter().map(|&(floor, _)| (floor as u16, heights[floor])).collect();
                floors.sort_by_key(|&(floor, _)| floor);
                floors.dedup_by_key(|&mut (floor, _)| floor);
                Joint { kind: connector.kind, floors }
            })
            .collect();
        Ok(Self { floors, connectors: joints })
    }

    /// The map of a building.
    ///
    /// # Errors
    /// As [`Map::new`]; a [`Building`] that was checked has none but for its size.
    pub fn of(building: &Building) -> Result<Self, Error> {
        let point = |point: [f64; 2]| point.map(|value| value as f32);
        let outline = |outline: &building::geometry::Outline| outline.iter().copied().map(point).collect::<Outline>();
        let plan = |floor: &building::Floor| {
            let walls: Vec<Wall> = floor.walls.iter().map(|wall| wall.map(point)).collect();
            let doors = floor.doors.iter().map(|door| door.line.map(point));
            Plan {
                number: floor.number,
                height: floor.height_m as f32,
                closed: walls.iter().copied().chain(doors).collect(),
                walls,
                rooms: floor.rooms.iter().map(|room| outline(&room.outline)).collect(),
            }
        };
        let index = |number: i32| building.floors.iter().position(|floor| floor.number == number);
        let connector = |connector: &building::Connector| Connector {
            kind: match connector.kind {
                building::ConnectorKind::Stairs | building::ConnectorKind::Ramp => ConnectorKind::Stairs,
                building::ConnectorKind::Elevator => ConnectorKind::Elevator,
            },
            outlines: connector
                .outlines
                .iter()
                .filter_map(|(number, corners)| Some((index(*number)?, outline(corners))))
                .collect(),
        };
        Self::new(building.floors.iter().map(plan).collect(), building.connectors.iter().map(connector).collect())
    }

    /// The index of the floor with this number.
    pub fn floor(&self, number: i32) -> Option<usize> {
        self.floors.iter().position(|floor| floor.number == number)
    }

    /// Number and height of each floor, from the lowest. **Units:** m.
    pub fn floors(&self) -> impl Iterator<Item = (i32, f32)> + '_ {
        self.floors.iter().map(|floor| (floor.number, floor.height))
    }

    /// Whether somebody may be at `point` of a floor, given by its index: inside of the outer walls.
    pub fn is_inside(&self, floor: usize, point: [f32; 2]) -> bool {
        self.floors.get(floor).is_some_and(|floor| floor.inside.at(point))
    }

    /// The connector at `point` of a floor, given by its index.
    pub fn connector(&self, floor: usize, point: [f32; 2]) -> Option<u16> {
        let floor = self.floors.get(floor)?;
        floor.connectors.at(floor.grid.cell(point)?, point)
    }

    /// Which room of its plan `point` of a floor, given by its index, is in.
    pub fn room(&self, floor: usize, point: [f32; 2]) -> Option<u16> {
        let floor = self.floors.get(floor)?;
        floor.rooms.at(floor.grid.cell(point)?, point)
    }

    /// Bytes that walls and areas take.
    pub fn bytes(&self) -> usize {
        let floor = |floor: &Floor| {
            floor.grid.bytes() + floor.connectors.bytes() + floor.rooms.bytes() + floor.inside.cells.len()
        };
        self.floors.iter().map(floor).sum()
    }

    /// Whether the straight way between two points of a floor, given by its index, meets a wall.
    pub fn blocked(&self, floor: usize, a: [f32; 2], b: [f32; 2]) -> bool {
        self.floors.get(floor).is_none_or(|floor| floor.grid.blocked(a, b))
    }
}

/// Everything is a number and not too far away.
fn check(plans: &[Plan], connectors: &[Connector]) -> Result<(), Error> {
    for (index, plan) in plans.iter().enumerate() {
        let points = plan.walls.iter().chain(&plan.closed).flatten().chain(plan.rooms.iter().flatten()).flatten();
        if !points.chain([&plan.height]).all(|value| value.abs() <= LARGEST_M) {
            return Err(Error::Beyond { floor: plan.number, most_m: LARGEST_M });
        }
        if plan.rooms.len() > MOST {
            return Err(Error::TooMany { what: "rooms", count: plan.rooms.len(), most: MOST });
        }
        if index > 0 && plan.height <= plans[index - 1].height {
            return Err(Error::Order { floor: plan.number, below: plans[index - 1].number });
        }
    }
    for connector in connectors {
        for (floor, outline) in &connector.outlines {
            let Some(plan) = plans.get(*floor) else { return Err(Error::NoSuchFloor { index: *floor }) };
            if !outline.iter().flatten().all(|value| value.abs() <= LARGEST_M) {
                return Err(Error::Beyond { floor: plan.number, most_m: LARGEST_M });
            }
        }
    }
    Ok(())
}

impl Floor {
    fn new(plan: Plan, connectors: Vec<(u16, Outline)>) -> Self {
        let corners = || {
            let walls = plan.walls.iter().chain(&plan.closed).flatten();
            walls.chain(plan.rooms.iter().flatten()).chain(connectors.iter().flat_map(|(_, outline)| outline))
        };
        let bound =
            |axis: usize, start: f32, pick: fn(f32, f32) -> f32| corners().map(|point| point[axis]).fold(start, pick);
        let (mut lower, mut upper) = (
            [0, 1].map(|axis| bound(axis, f32::INFINITY, f32::min)),
            [0, 1].map(|axis| bound(axis, f32::NEG_INFINITY, f32::max)),
        );
        if corners().next().is_none() {
            (lower, upper) = ([0.0; 2], [0.0; 2]);
        }
        let grid = Grid::new(&plan.walls, lower, upper);
        let mut inside = Inside::new(&plan.closed, lower, upper);
        let rooms = plan.rooms.into_iter().enumerate().map(|(number, outline)| (number as u16, outline)).collect();
        let (connectors, rooms) = (Areas::new(connectors, &grid), Areas::new(rooms, &grid));
        // A plan whose outer walls leave gaps is known by its rooms.
        let named =
            |point| grid.cell(point).is_some_and(|cell| rooms.at(cell, point).or(connectors.at(cell, point)).is_some());
        for cell in 0..inside.cells.len() {
            if !inside.cells[cell] && named(inside.centre(cell)) {
                inside.cells[cell] = true;
            }
        }
        Self { number: plan.number, height: plan.height, connectors, rooms, grid, inside }
    }

    /// The lower left and the upper right corner. **Units:** m.
    pub fn bounds(&self) -> [[f32; 2]; 2] {
        self.inside.bounds()
    }
}

impl Inside {
    /// What cannot be reached from beyond the building without crossing a wall or a closed door.
    fn new(walls: &[Wall], lower: [f32; 2], upper: [f32; 2]) -> Self {
        let origin = lower.map(|value| value - 2.0 * INSIDE_M);
        let count = |axis: usize| ((upper[axis] - origin[axis]) / INSIDE_M).ceil() as usize + 2;
        let (columns, rows) = (count(0), count(1));
        // A wall lies between the centres of cells; from centre to centre it is tested, so that it need not be drawn.
        let grid = Grid::new(walls, lower, upper);
        let mut outside = vec![false; columns * rows];
        let mut inside = Self { origin, columns, rows, cells: Vec::new() };
        let mut waiting = vec![0_usize];
        outside[0] = true;
        while let Some(cell) = waiting.pop() {
            let (column, row) = (cell % columns, cell / columns);
            let here = inside.centre(cell);
            let neighbours = [
                (column > 0).then(|| cell - 1),
                (column + 1 < columns).then(|| cell + 1),
                (row > 0).then(|| cell - columns),
                (row + 1 < rows).then(|| cell + columns),
            ];
            for next in neighbours.into_iter().flatten() {
                if !outside[next] && !grid.blocked(here, inside.centre(next)) {
                    outside[next] = true;
                    waiting.push(next);
                }
            }
        }
        // A plan that nothing closes has no outside.
        let open = outside.iter().all(|&cell| cell);
        inside.cells = outside.into_iter().map(|cell| open || !cell).collect();
        inside
    }

    fn centre(&self, cell: usize) -> [f32; 2] {
        let place = |axis: usize, index: usize| self.origin[axis] + (index as f32 + 0.5) * INSIDE_M;
        [place(0, cell % self.columns), place(1, cell / self.columns)]
    }

    pub fn at(&self, point: [f32; 2]) -> bool {
        let [column, row] = [0, 1].map(|axis| (point[axis] - self.origin[axis]) / INSIDE_M);
        column >= 0.0
            && row >= 0.0
            && column < self.columns as f32
            && row < self.rows as f32
            && self.cells[row as usize * self.columns + column as usize]
    }

    fn bounds(&self) -> [[f32; 2]; 2] {
        let far = [self.columns, self.rows];
        [self.origin, [0, 1].map(|axis| self.origin[axis] + far[axis] as f32 * INSIDE_M)]
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The four walls of a rectangle.
    pub fn walls_of([x, y]: [f32; 2], [far_x, far_y]: [f32; 2]) -> Vec<Wall> {
        let corners = [[x, y], [far_x, y], [far_x, far_y], [x, far_y]];
        (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect()
    }

    fn outline_of(lower: [f32; 2], upper: [f32; 2]) -> Outline {
        walls_of(lower, upper).iter().map(|wall| wall[0]).collect()
    }

    /// Two floors of 20 m by 10 m, 3.6 m apart, with stairs in the corner of (16, 6) to (20, 10), and on the lower floor a
    /// wall at x = 8 with a door between y = 4 and 5.
    pub fn small() -> Map {
        let walls = walls_of([0.0, 0.0], [20.0, 10.0]);
        let mut lower = walls.clone();
        lower.extend([[[8.0, 0.0], [8.0, 4.0]], [[8.0, 5.0], [8.0, 10.0]]]);
        let plan = |number, height, walls: Vec<Wall>| Plan {
            number,
            height,
            closed: walls.clone(),
            walls,
            rooms: vec![outline_of([0.0, 0.0], [8.0, 10.0]), outline_of([8.0, 0.0], [20.0, 10.0])],
        };
        let stairs = outline_of([16.0, 6.0], [20.0, 10.0]);
        let connector = Connector { kind: ConnectorKind::Stairs, outlines: vec![(0, stairs.clone()), (1, stairs)] };
        Map::new(vec![plan(0, 0.0, lower), plan(1, 3.6, walls)], vec![connector]).unwrap()
    }

    #[test]
    fn floors_change_where_the_other_is_nearer() {
        let map = small();
        let joint = &map.connectors[0];
        assert_eq!([1.7, 1.82, 1.9, 9.0].map(|z| joint.floor_at(z, 0)), [0, 0, 1, 1]);
        assert_eq!([1.9, 1.78, 1.7, -9.0].map(|z| joint.floor_at(z, 1)), [1, 1, 0, 0]);
    }

    #[test]
    fn places_are_found() {
        let map = small();
        assert_eq!((map.floor(1), map.floor(2)), (Some(1), None));
        assert_eq!(map.connector(0, [18.0, 8.0]), Some(0));
        assert_eq!(map.connector(0, [15.9, 8.0]), None);
        assert_eq!(
            (map.room(0, [3.0, 3.0]), map.room(0, [9.0, 3.0]), map.room(0, [-1.0, 3.0])),
            (Some(0), Some(1), None)
        );
        assert!(map.is_inside(0, [1.0, 1.0]) && map.is_inside(1, [19.0, 9.0]));
        assert!(!map.is_inside(0, [-0.4, 1.0]) && !map.is_inside(0, [21.0, 1.0]) && !map.is_inside(7, [1.0, 1.0]));
        assert!(map.blocked(0, [7.0, 2.0], [9.0, 2.0]) && !map.blocked(0, [7.0, 4.5], [9.0, 4.5]));
    }

    #[test]
    fn a_plan_without_walls_is_open_everywhere() {
        let rooms = vec![outline_of([0.0, 0.0], [8.0, 10.0])];
        let map = Map::new(vec![Plan { rooms, ..Plan::default() }], Vec::new()).unwrap();
        assert!(map.is_inside(0, [4.0, 4.0]));
    }

    #[test]
    fn what_is_no_building_is_refused() {
        let plan = |number, height| Plan { number, height, ..Plan::default() };
        assert!(matches!(Map::new(Vec::new(), Vec::new()), Err(Error::NoFloors)));
        let order = Map::new(vec![plan(0, 3.0), plan(1, 3.0)], Vec::new());
        assert!(matches!(order, Err(Error::Order { floor: 1, below: 0 })));
        assert!(matches!(Map::new(vec![plan(0, f32::NAN)], Vec::new()), Err(Error::Beyond { floor: 0, .. })));
        let connector = Connector { kind: ConnectorKind::Stairs, outlines: vec![(1, Vec::new())] };
        assert!(matches!(Map::new(vec![plan(0, 0.0)], vec![connector]), Err(Error::NoSuchFloor { index: 1 })));
    }
}
