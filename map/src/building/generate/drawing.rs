//! Walls, rooms, doors, staircases and elevators, drawn floor by floor.

use crate::building::geometry::{Outline, Point};
use crate::building::model::{Connector, ConnectorKind, Door, Floor, Room};

/// Width of a door. **Units:** m.
pub(super) const DOOR_M: f64 = 1.0;
/// Floor to floor: 20 risers of 0.18 m. **Units:** m.
pub(super) const STOREY_M: f64 = 3.6;
/// Width and depth of a staircase. **Units:** m.
pub(super) const STAIRS_M: [f64; 2] = [4.0, 6.0];
/// Length of a flight: ten treads of 0.28 m. **Units:** m.
const FLIGHT_M: f64 = 2.8;

pub(super) fn rectangle([x, y]: Point, [far_x, far_y]: Point) -> Outline {
    vec![[x, y], [far_x, y], [far_x, far_y], [x, far_y]]
}

/// A side of a staircase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    East,
    West,
}

/// A floor that is being drawn.
pub(super) struct Drawing {
    pub floor: Floor,
}

impl Drawing {
    pub fn new(number: i32) -> Self {
        let name = format!("F{number}");
        Self { floor: Floor { number, name, height_m: STOREY_M * f64::from(number), ..Floor::default() } }
    }

    pub fn wall(&mut self, a: Point, b: Point) {
        self.floor.walls.push([a, b]);
    }

    /// A wall along x or y with gaps in it: middle and width of each, in order. `doors` closes them.
    pub fn wall_with_gaps(&mut self, a: Point, b: Point, gaps: &[(f64, f64)], doors: bool) {
        let axis = usize::from(a[0] == b[0]);
        let at = |place: f64| if axis == 0 { [place, a[1]] } else { [a[0], place] };
        let mut from = a[axis];
        for &(middle, width) in gaps {
            let (low, high) = (middle - width / 2.0, middle + width / 2.0);
            self.wall(at(from), at(low));
            if doors {
                self.floor.doors.push(Door { line: [at(low), at(high)], name: None });
            }
            from = high;
        }
        self.wall(at(from), at(b[axis]));
    }

    pub fn room(&mut self, name: impl Into<String>, usage: &str, low: Point, high: Point) {
        self.floor.rooms.push(Room { name: name.into(), usage: Some(usage.to_owned()), outline: rectangle(low, high) });
    }

    /// Rooms side by side from x = `from` on, `widths` wide, between the `corridor` and the `outer` wall, each with a door to
    /// the corridor.
    pub fn row(&mut self, from: f64, widths: &[f64], corridor: f64, outer: f64, mut name: impl FnMut(usize) -> String) {
        let mut west = from;
        let mut doors = Vec::new();
        for (index, width) in widths.iter().enumerate() {
            let east = west + width;
            self.room(name(index), "office", [west, corridor.min(outer)], [east, corridor.max(outer)]);
            if index > 0 {
                self.wall([west, corridor], [west, outer]);
            }
            // Not in the middle: where it is tells the rooms apart.
            doors.push((west + 0.35 * width, DOOR_M));
            west = east;
        }
        self.wall([from, corridor], [from, outer]);
        self.wall([west, corridor], [west, outer]);
        self.wall([from, outer], [west, outer]);
        self.wall_with_gaps([from, corridor], [west, corridor], &doors, true);
    }

    /// A staircase north of the corridor at y = `corridor`, from x = `west` on: open to the corridor, two flights with a wall
    /// between them. `ends` says whether it ends on the lowest and on the highest floor: there nobody gets under or over
    /// the flight. `up` is the side of the flight that leads up from the corridor.
    pub fn staircase(&mut self, west: f64, corridor: f64, lowest: bool, highest: bool, up: Side) {
        let [width, depth] = STAIRS_M;
        let (east, north, middle) = (west + width, corridor + depth, west + width / 2.0);
        let (front, back) = flights(corridor);
        self.wall([west, corridor], [west, north]);
        self.wall([east, corridor], [east, north]);
        self.wall([west, north], [east, north]);
        self.wall_with_gaps([west, corridor], [east, corridor], &[(middle, 3.0)], false);
        self.wall([middle, front], [middle, back]);
        let (up, down) = match up {
            Side::East => (east, west),
            Side::West => (west, east),
        };
        let mut close = |side: f64| self.wall([middle.min(side), front], [middle.max(side), front]);
        if lowest {
            close(down);
        }
        if highest {
            close(up);
        }
    }

    /// An elevator with its door to the east.
    pub fn elevator(&mut self, low: Point, high: Point) {
        self.wall(low, [high[0], low[1]]);
        self.wall([low[0], high[1]], high);
        self.wall(low, [low[0], high[1]]);
        self.wall_with_gaps([high[0], low[1]], high, &[((low[1] + high[1]) / 2.0, DOOR_M)], true);
    }
}

/// Where the flights of a staircase begin and end, from the wall of the corridor.
fn flights(corridor: f64) -> (f64, f64) {
    let front = corridor + 1.4;
    (front, front + FLIGHT_M)
}

/// The staircase of [`Drawing::staircase`] as a connector of floors 0 to `floors` - 1.
pub(super) fn stairs(name: &str, west: f64, corridor: f64, floors: i32, up: Side) -> Connector {
    let [width, depth] = STAIRS_M;
    let outline = rectangle([west, corridor], [west + width, corridor + depth]);
    let (front, back) = flights(corridor);
    let (quarter, rest) = (west + 0.25 * width, west + 0.75 * width);
    let (up, down) = match up {
        Side::East => (rest, quarter),
        Side::West => (quarter, rest),
    };
    let landing = back + 0.9;
    let mut way = Vec::new();
    for floor in 0..floors - 1 {
        let low = STOREY_M * f64::from(floor);
        let half = low + STOREY_M / 2.0;
        way.extend([
            [up, front - 0.5, low],
            [up, front, low],
            [up, back, half],
            [up, landing, half],
            [down, landing, half],
            [down, back, half],
            [down, front, low + STOREY_M],
            [down, front - 0.5, low + STOREY_M],
        ]);
    }
    let outlines = (0..floors).map(|floor| (floor, outline.clone())).collect();
    Connector { name: name.to_owned(), kind: ConnectorKind::Stairs, outlines, way }
}

pub(super) fn elevator(name: &str, low: Point, high: Point, floors: i32) -> Connector {
    let outlines = (0..floors).map(|floor| (floor, rectangle(low, high))).collect();
    Connector { name: name.to_owned(), kind: ConnectorKind::Elevator, outlines, way: Vec::new() }
}
