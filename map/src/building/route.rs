//! Ways through a building: from room to room, through doors, over stairs and with elevators.
//!
//! For walks to be simulated and for routes to be shown. A way keeps clear of walls and goes straight where it can.

use super::error::Error;
use super::geometry::{self, Point};
use super::model::{Building, Connector, ConnectorKind, Floor};
use pathfinding::prelude::astar;
use std::f64::consts::FRAC_PI_3;

/// Side of a cell. **Units:** m.
const CELL_M: f64 = 0.15;
/// Nobody walks nearer to a wall. **Units:** m.
const CLEAR_M: f64 = 0.28;
/// And nobody likes to within this. **Units:** m.
const COMFORTABLE_M: f64 = 0.7;
/// How much longer a way in the uncomfortable part counts.
const DISLIKE: u32 = 2;
/// Who walks along the middle of corridors keeps so far from walls, if there is room. **Units:** m.
const MIDDLE_M: f64 = 1.5;
/// And turns so far beside where the straightest way does at most. **Units:** m.
const ASIDE_M: f64 = 1.2;
/// But not for the price of turning so much more: nobody walks a loop for it. **Units:** rad.
const DETOUR: f64 = FRAC_PI_3;
/// Length of a straight and of a diagonal move, in hundredths of a cell.
const STRAIGHT: u32 = 100;
const DIAGONAL: u32 = 141;

/// A piece of a way.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// On foot through points of a floor.
    Walk {
        /// Number of the floor.
        floor: i32,
        /// The points; the first is where the piece before has ended.
        points: Vec<Point>,
    },
    /// Over stairs or a ramp, through points with heights. **Units:** m.
    Climb {
        /// Which stairs.
        connector: String,
        /// The points.
        points: Vec<[f64; 3]>,
    },
    /// In an elevator.
    Ride {
        /// Which elevator.
        connector: String,
        /// Where its middle is.
        place: Point,
        /// Height gained. **Units:** m.
        rise: f64,
    },
}

/// Where a way is to lead.
#[derive(Clone, Debug, PartialEq)]
enum Stop {
    /// A point of a floor.
    Place(i32, Point),
    /// The next change of the floor uses this kind.
    By(ConnectorKind),
    /// The next change of the floor uses this connector.
    Through(String),
}

/// The free places of one floor.
struct Free<'a> {
    origin: Point,
    columns: usize,
    rows: usize,
    /// 0 is a wall or too near to one, else the factor of its length.
    cost: Vec<u32>,
    floor: &'a Floor,
}

/// The pieces of a way through `stops`: as [`Planner::plan`], for one way.
///
/// # Errors
/// As [`Planner::plan`].
pub fn plan(building: &Building, stops: &[&str]) -> Result<Vec<Piece>, Error> {
    Planner::new(building).plan(stops)
}

/// Plans ways through a building, whose free places it knows.
pub struct Planner<'a> {
    building: &'a Building,
    free: Vec<Free<'a>>,
    manner: Manner,
}

/// How people walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    /// As straight as walls let them, across corridors too.
    Straight,
    /// Straight out of a room to the middle of a corridor, along it, and straight into the next room.
    Middle,
}

impl<'a> Planner<'a> {
    /// Looks at all floors, for people who go as straight as walls let them.
    pub fn new(building: &'a Building) -> Self {
        Self::with(building, Manner::Straight)
    }

    /// Looks at all floors.
    pub fn with(building: &'a Building, manner: Manner) -> Self {
        Self { building, free: building.floors.iter().map(|floor| Free::new(building, floor)).collect(), manner }
    }

    /// The pieces of a way through `stops`: names of rooms (`101`, or with the floor's name before them, `F1/101`), and
    /// between them `stairs`, `ramp`, `elevator` or the name of a connector where the way is to change floors by it.
    ///
    /// # Errors
    /// When a name is not known, or no way leads to a stop.
    pub fn plan(&self, stops: &[&str]) -> Result<Vec<Piece>, Error> {
        let stops = stops.iter().map(|name| self.stop(name)).collect::<Result<Vec<_>, _>>()?;
        let mut pieces = Vec::new();
        let mut here: Option<(i32, Point)> = None;
        let (mut kind, mut through) = (None, None);
        for stop in stops {
            match stop {
                Stop::By(wanted) => kind = Some(wanted),
                Stop::Through(name) => through = Some(name),
                Stop::Place(floor, place) => {
                    let wanted = Wanted { kind: kind.take(), name: through.take() };
                    match here {
                        None => pieces.push(Piece::Walk { floor, points: vec![place] }),
                        Some(from) => pieces.extend(leg(self.building, &self.free, from, (floor, place), &wanted)?),
                    }
                    here = Some((floor, place));
                }
            }
        }
        if here.is_none() {
            return Err(Error::Model("a route needs a room to start from".to_owned()));
        }
        if self.manner == Manner::Middle {
            for piece in &mut pieces {
                if let Piece::Walk { floor, points } = piece
                    && let Some(free) = self.free.iter().find(|free| free.floor.number == *floor)
                {
                    free.to_the_middle(points);
                }
            }
        }
        Ok(pieces)
    }

    fn stop(&self, name: &str) -> Result<Stop, Error> {
        let (building, name) = (self.building, name.trim());
        if let Some(kind) = ConnectorKind::ALL.into_iter().find(|kind| kind.word() == name) {
            return Ok(Stop::By(kind));
        }
        if building.connectors.iter().any(|connector| connector.name == name) {
            return Ok(Stop::Through(name.to_owned()));
        }
        let Some((floor, room)) = building.room(name) else {
            let known: Vec<_> =
                building.floors.iter().flat_map(|floor| &floor.rooms).map(|room| room.name.as_str()).take(12).collect();
            return Err(Error::Model(format!(
                "'{name}' is no room and no connector of the building; its rooms begin with {}",
                known.join(", ")
            )));
        };
        let middle = geometry::centre(&room.outline);
        let free = self.free.iter().find(|free| free.floor.number == floor.number);
        let place = free.and_then(|free| free.nearest(middle, |point| geometry::contains(&room.outline, point)));
        let place = place.ok_or_else(|| Error::Model(format!("nobody can stand in room '{name}'")))?;
        Ok(Stop::Place(floor.number, place))
    }
}

/// How floors are to be changed.
struct Wanted {
    kind: Option<ConnectorKind>,
    name: Option<String>,
}

impl Wanted {
    fn allows(&self, connector: &Connector) -> bool {
        self.kind.is_none_or(|kind| kind == connector.kind)
            && self.name.as_ref().is_none_or(|name| *name == connector.name)
    }
}

/// From place to place.
fn leg(
    building: &Building,
    free: &[Free<'_>],
    (from_floor, from): (i32, Point),
    (to_floor, to): (i32, Point),
    wanted: &Wanted,
) -> Result<Vec<Piece>, Error> {
    let on = |number: i32| {
        free.iter()
            .find(|free| free.floor.number == number)
            .ok_or_else(|| Error::Model(format!("there is no floor {number}")))
    };
    if from_floor == to_floor {
        let points = on(from_floor)?.way(from, to).map(|(points, _)| points);
        let points = points.ok_or_else(|| {
            Error::Model(format!(
                "no way leads from ({:.1}, {:.1}) to ({:.1}, {:.1}) on floor {from_floor}",
                from[0], from[1], to[0], to[1]
            ))
        })?;
        return Ok(vec![Piece::Walk { floor: from_floor, points }]);
    }
    let mut best: Option<(u32, Vec<Piece>)> = None;
    for connector in building.connectors.iter().filter(|connector| wanted.allows(connector)) {
        let Some((enter, change, leave)) = change(building, connector, from_floor, to_floor) else { continue };
        let Some((before, cost)) = on(from_floor)?.way(from, enter) else { continue };
        let Some((after, more)) = on(to_floor)?.way(leave, to) else { continue };
        if best.as_ref().is_none_or(|(least, _)| cost + more < *least) {
            let walk = |floor, points| Piece::Walk { floor, points };
            best = Some((cost + more, vec![walk(from_floor, before), change, walk(to_floor, after)]));
        }
    }
    best.map(|(_, pieces)| pieces).ok_or_else(|| {
        Error::Model(format!("nothing that is wanted leads from floor {from_floor} to floor {to_floor}"))
    })
}

/// Where one enters a connector, the piece that changes the floor, and where one leaves it.
fn change(building: &Building, connector: &Connector, from: i32, to: i32) -> Option<(Point, Piece, Point)> {
    let outline =
        |number: i32| connector.outlines.iter().find(|(floor, _)| *floor == number).map(|(_, outline)| outline);
    let (start, _) = (outline(from)?, outline(to)?);
    let (low, high) = (building.floor(from)?.height_m, building.floor(to)?.height_m);
    if connector.kind == ConnectorKind::Elevator {
        let place = geometry::centre(start);
        let piece = Piece::Ride { connector: connector.name.clone(), place, rise: high - low };
        return Some((place, piece, place));
    }
    let at = |height: f64| {
        let level = |point: &[f64; 3]| (point[2] - height).abs() < 0.01;
        Some((connector.way.iter().position(level)?, connector.way.iter().rposition(level)?))
    };
    let ((first_low, last_low), (first_high, last_high)) = (at(low)?, at(high)?);
    let points: Vec<[f64; 3]> = if high > low {
        connector.way.get(last_low..=first_high)?.to_vec()
    } else {
        connector.way.get(last_high..=first_low)?.iter().rev().copied().collect()
    };
    let plane = |point: &[f64; 3]| [point[0], point[1]];
    let (enter, leave) = (plane(points.first()?), plane(points.last()?));
    Some((enter, Piece::Climb { connector: connector.name.clone(), points }, leave))
}

impl<'a> Free<'a> {
    fn new(building: &Building, floor: &'a Floor) -> Self {
        let [low, high] = geometry::bounds(floor.points()).unwrap_or_default();
        let origin = low.map(|value| value - 2.0 * CELL_M);
        let count = |axis: usize| ((high[axis] - origin[axis]) / CELL_M).ceil() as usize + 3;
        let (columns, rows) = (count(0), count(1));
        let mut free = Self { origin, columns, rows, cost: vec![1; columns * rows], floor };
        for wall in &floor.walls {
            free.near(wall, COMFORTABLE_M, |cost, distance| {
                if distance < CLEAR_M {
                    *cost = 0;
                } else if *cost > 0 {
                    *cost = DISLIKE;
                }
            });
        }
        // Nobody walks through a flight of stairs on the level.
        for way in building.connectors.iter().map(|connector| &connector.way) {
            for pair in way.windows(2).filter(|pair| pair[0][2] != pair[1][2]) {
                let [a, b] = [0, 1].map(|i| [pair[i][0], pair[i][1]]);
                let inner = [geometry::between(a, b, 0.2), geometry::between(a, b, 0.8)];
                free.near(&inner, CLEAR_M, |cost, _| *cost = 0);
            }
        }
        free
    }

    /// Changes the cells within `reach` of a segment.
    fn near(&mut self, segment: &geometry::Segment, reach: f64, change: impl Fn(&mut u32, f64)) {
        let range = |axis: usize, count: usize| {
            let cell = |value: f64| ((value - self.origin[axis]) / CELL_M).floor().max(0.0) as usize;
            let (a, b) = (segment[0][axis], segment[1][axis]);
            cell(a.min(b) - reach)..=cell(a.max(b) + reach).min(count - 1)
        };
        let (across, up) = (range(0, self.columns), range(1, self.rows));
        for row in up {
            for column in across.clone() {
                let cell = row * self.columns + column;
                let point = self.centre(cell);
                let distance = geometry::distance(geometry::nearest(segment, point), point);
                if distance < reach {
                    change(&mut self.cost[cell], distance);
                }
            }
        }
    }

    fn centre(&self, cell: usize) -> Point {
        let place = |axis: usize, index: usize| self.origin[axis] + (index as f64 + 0.5) * CELL_M;
        [place(0, cell % self.columns), place(1, cell / self.columns)]
    }

    fn cell(&self, point: Point) -> Option<usize> {
        let [column, row] = [0, 1].map(|axis| (point[axis] - self.origin[axis]) / CELL_M);
        (column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64)
            .then(|| row as usize * self.columns + column as usize)
    }

    /// The free place nearest to `point` for which `fits` holds.
    fn nearest(&self, point: Point, fits: impl Fn(Point) -> bool) -> Option<Point> {
        let places = (0..self.cost.len()).filter(|&cell| self.cost[cell] > 0).map(|cell| self.centre(cell));
        let near = |place: &Point| geometry::distance(*place, point);
        places.filter(|place| fits(*place)).min_by(|a, b| near(a).total_cmp(&near(b)))
    }

    /// The way between two points and what it costs.
    fn way(&self, from: Point, to: Point) -> Option<(Vec<Point>, u32)> {
        let near = |point: Point| {
            let place = self.nearest(point, |place| geometry::distance(place, point) < 1.0)?;
            self.cell(place)
        };
        let (start, end) = (near(from)?, near(to)?);
        let (goal_column, goal_row) = (end % self.columns, end / self.columns);
        let (cells, cost) = astar(
            &start,
            |&cell| self.neighbours(cell),
            |&cell| {
                let across = (cell % self.columns).abs_diff(goal_column) as u32;
                let up = (cell / self.columns).abs_diff(goal_row) as u32;
                STRAIGHT * across.max(up) + (DIAGONAL - STRAIGHT) * across.min(up)
            },
            |&cell| cell == end,
        )?;
        let mut points: Vec<Point> = cells.iter().map(|&cell| self.centre(cell)).collect();
        if let Some(first) = points.first_mut() {
            *first = from;
        }
        if points.len() > 1 {
            points.pop();
        }
        points.push(to);
        Some((self.pulled(&points), cost))
    }

    fn neighbours(&self, cell: usize) -> Vec<(usize, u32)> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let mut neighbours = Vec::with_capacity(8);
        for (right, up) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
            let place = column.checked_add_signed(right).zip(row.checked_add_signed(up));
            let Some((column, row)) = place.filter(|&(column, row)| column < self.columns && row < self.rows) else {
                continue;
            };
            let next = row * self.columns + column;
            if self.cost[next] > 0 {
                let length = if right != 0 && up != 0 { DIAGONAL } else { STRAIGHT };
                neighbours.push((next, length * self.cost[next]));
            }
        }
        neighbours
    }

    /// The same way with straight lines where no more walls are near than before.
    fn pulled(&self, points: &[Point]) -> Vec<Point> {
        let mut pulled: Vec<Point> = points.first().copied().into_iter().collect();
        let mut here = 0;
        while here + 1 < points.len() {
            let seen = (here + 1..points.len()).rev().find(|&next| next == here + 1 || self.sees(points, here, next));
            here = seen.unwrap_or(here + 1);
            pulled.push(points[here]);
        }
        pulled
    }

    /// Moves where a way turns along the lines to and from there, to where there is more room: into the middle of a corridor.
    fn to_the_middle(&self, points: &mut [Point]) {
        const PARTS: i32 = 16;
        for at in 1..points.len().saturating_sub(1) {
            let [before, here, after] = [points[at - 1], points[at], points[at + 1]];
            let first = at.saturating_sub(2);
            let mut around = points[first..points.len().min(at + 3)].to_vec();
            let turned = turning(&around);
            let mut more = |place: Point| {
                around[at - first] = place;
                turning(&around) - turned
            };
            let mut best = (self.room(here), here);
            for other in [before, after] {
                let long = geometry::distance(other, here);
                for part in -PARTS..=PARTS {
                    let off_m = ASIDE_M * f64::from(part) / f64::from(PARTS);
                    let place = geometry::between(other, here, 1.0 + off_m / long);
                    let fits = off_m > -long && self.is_free([before, place]) && self.is_free([place, after]);
                    if fits && self.room(place) > best.0 + 1e-6 && more(place) < DETOUR {
                        best = (self.room(place), place);
                    }
                }
            }
            points[at] = best.1;
        }
    }

    /// How far from the next wall a place is; all that is more than enough is alike. **Units:** m.
    fn room(&self, place: Point) -> f64 {
        let walls = self.floor.walls.iter();
        walls.map(|wall| geometry::distance(geometry::nearest(wall, place), place)).fold(MIDDLE_M, f64::min)
    }

    fn is_free(&self, [a, b]: geometry::Segment) -> bool {
        let count = (geometry::distance(a, b) / (0.5 * CELL_M)).ceil() as usize;
        (1..count).all(|i| {
            let place = geometry::between(a, b, i as f64 / count as f64);
            self.cell(place).is_some_and(|cell| self.cost[cell] > 0)
        })
    }

    fn sees(&self, points: &[Point], from: usize, to: usize) -> bool {
        let cost = |point: Point| self.cell(point).map_or(0, |cell| self.cost[cell]);
        // What was uncomfortable on the way may be so on the straight line.
        let worst = points[from..=to].iter().map(|&point| cost(point)).max().unwrap_or(1).max(1);
        let (a, b) = (points[from], points[to]);
        let count = (geometry::distance(a, b) / (0.5 * CELL_M)).ceil() as usize;
        (1..count).all(|i| (1..=worst).contains(&cost(geometry::between(a, b, i as f64 / count as f64))))
    }
}

/// How much somebody turns on a way, to the left and to the right. **Units:** rad.
fn turning(points: &[Point]) -> f64 {
    let directions: Vec<f64> = points.windows(2).map(|pair| geometry::direction(pair[0], pair[1])).collect();
    directions.windows(2).map(|pair| geometry::wrapped(pair[1] - pair[0]).abs()).sum()
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::*;
    use std::f64::consts::PI;

    /// Whether a way goes through a wall.
    fn crosses(floor: &Floor, points: &[Point]) -> bool {
        let pieces = points.windows(2).map(|pair| [pair[0], pair[1]]);
        pieces.into_iter().any(|piece| floor.walls.iter().any(|wall| geometry::crossing(&piece, wall).is_some()))
    }

    #[test]
    fn rooms_floors_and_both_kinds_of_connectors_are_joined() {
        let building = generate::twin(2);
        for (by, climbs) in [("stairs", true), ("elevator", false)] {
            let pieces = plan(&building, &["W01", "hall", by, "E12", "E14"]).unwrap();
            let walks: Vec<_> = pieces
                .iter()
                .filter_map(|piece| match piece {
                    Piece::Walk { floor, points } => Some((*floor, points)),
                    _ => None,
                })
                .collect();
            assert!(walks.iter().all(|(floor, points)| !crosses(building.floor(*floor).unwrap(), points)));
            assert_eq!(pieces.iter().any(|piece| matches!(piece, Piece::Climb { .. })), climbs);
            let rise: f64 = pieces
                .iter()
                .map(|piece| match piece {
                    Piece::Climb { points, .. } => points[points.len() - 1][2] - points[0][2],
                    Piece::Ride { rise, .. } => *rise,
                    Piece::Walk { .. } => 0.0,
                })
                .sum();
            assert!((rise - building.floors[1].height_m).abs() < 1e-9);
            // Each piece begins where the last has ended.
            for pair in walks.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
                assert_eq!(pair[0].1.last(), pair[1].1.first());
            }
        }
    }

    #[test]
    fn who_keeps_to_the_middle_walks_there_along_a_corridor_and_straight_through_doors() {
        let building = generate::twin(1);
        let floor = &building.floors[0];
        let inside = |manner: Manner| -> Vec<Point> {
            let pieces = Planner::with(&building, manner).plan(&["W01", "W08", "W05"]).unwrap();
            let points = pieces.iter().filter_map(|piece| match piece {
                Piece::Walk { points, .. } => Some(points),
                _ => None,
            });
            let all: Vec<&Vec<Point>> = points.collect();
            assert!(all.iter().all(|points| !crosses(floor, points)));
            all.into_iter().flatten().copied().filter(|[_, y]| (6.0..8.2).contains(y)).collect()
        };
        // The corridor is 2.2 m wide: within a quarter of that.
        let off = |points: Vec<Point>| points.iter().map(|[_, y]| (y - 7.1).abs()).fold(0.0, f64::max);
        let (straight, middle) = (inside(Manner::Straight), inside(Manner::Middle));
        assert_eq!(straight.len(), middle.len());
        let (straight, middle) = (off(straight), off(middle));
        assert!(middle < 0.55 && straight > 0.8, "{middle} {straight}");
    }

    #[test]
    fn nobody_walks_a_loop_to_keep_to_the_middle() {
        let building = generate::twin(2);
        let names: Vec<String> = building
            .floors
            .iter()
            .flat_map(|floor| floor.rooms.iter().map(|room| format!("{}/{}", floor.name, room.name)))
            .collect();
        let turned = |planner: &Planner<'_>, stops: &[&str]| -> Option<f64> {
            let pieces = planner.plan(stops).ok()?;
            let walked = pieces.iter().map(|piece| match piece {
                Piece::Walk { points, .. } => turning(points),
                _ => 0.0,
            });
            Some(walked.sum())
        };
        let [straight, middle] = [Manner::Straight, Manner::Middle].map(|manner| Planner::with(&building, manner));
        let mut ways = 0;
        for (at, from) in names.iter().enumerate() {
            let stops = [from.as_str(), &names[(at * 7 + 11) % names.len()]];
            let Some(least) = turned(&straight, &stops) else { continue };
            ways += 1;
            let more = turned(&middle, &stops).unwrap() - least;
            // A loop turns by 2 pi.
            assert!(more < PI, "{stops:?}: {more}");
        }
        assert!(ways > 30, "{ways}");
    }

    #[test]
    fn what_leads_nowhere_is_told() {
        let building = generate::twin(2);
        let message = |stops: &[&str]| plan(&building, stops).unwrap_err().to_string();
        assert!(
            message(&["cellar"])
                .starts_with("'cellar' is no room and no connector of the building; its rooms begin with W01")
        );
        assert_eq!(message(&["stairs"]), "a route needs a room to start from");
        assert_eq!(message(&["W01", "ramp", "W11"]), "nothing that is wanted leads from floor 0 to floor 1");
    }
}
