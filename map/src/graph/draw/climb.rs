//! Stairs, ramps and elevators: where one steps on and off them, and the way between.

use crate::building::geometry::{self, Point};
use crate::building::{Building, Connector, ConnectorKind, Floor};

/// From a floor to the next above that a connector joins.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Numbers of the floors, the lower first.
    pub floors: [i32; 2],
    /// Where it begins on the lower and ends on the upper floor. **Units:** m; **Frame:** building.
    pub landings: [Point; 2],
    /// The points between them, with heights; none in an elevator. **Units:** m.
    pub between: Vec<[f64; 3]>,
}

impl Flight {
    /// The direction in which one leaves it at an end; none in an elevator. **Units:** rad; **Frame:** building.
    pub fn direction(&self, end: usize) -> Option<f64> {
        let next = if end == 0 { self.between.first() } else { self.between.last() };
        let from = next.map_or(self.landings[1 - end], |&[x, y, _]| [x, y]);
        let to = self.landings[end];
        (geometry::distance(from, to) > 0.1).then(|| geometry::direction(from, to))
    }
}

/// From the short end of the outline of stairs without a way to where one steps on them, as a part of their length.
const IN_PART: f64 = 0.2;
/// Points of a way that lie nearer than this to the line through their neighbours are left out. **Units:** m.
const STRAIGHT_M: f64 = 0.05;
/// A piece at the end of a way that is shorter than this belongs to the flight. **Units:** m.
const STUB_M: f64 = 1.0;
/// At half the way of stairs that have none is a landing, unless they are as long as this for each metre of height.
const LONG: f64 = 2.5;

/// All flights of a building.
pub fn flights(building: &Building) -> Vec<Flight> {
    building.connectors.iter().flat_map(|connector| of(building, connector)).collect()
}

fn of(building: &Building, connector: &Connector) -> Vec<Flight> {
    let mut floors: Vec<(&Floor, &[Point])> = connector
        .outlines
        .iter()
        .filter_map(|(number, outline)| Some((building.floor(*number)?, &outline[..])))
        .collect();
    floors.sort_by(|a, b| a.0.height_m.total_cmp(&b.0.height_m));
    floors.windows(2).map(|pair| flight(connector, pair[0], pair[1])).collect()
}

fn flight(connector: &Connector, lower: (&Floor, &[Point]), upper: (&Floor, &[Point])) -> Flight {
    let floors = [lower.0.number, upper.0.number];
    if connector.kind == ConnectorKind::Elevator {
        let landings = [lower.1, upper.1].map(geometry::centre);
        return Flight { floors, landings, between: Vec::new() };
    }
    if let Some(points) = along_way(connector, [lower.0.height_m, upper.0.height_m]) {
        let plane = |point: &[f64; 3]| [point[0], point[1]];
        let between = points.get(1..points.len() - 1).unwrap_or_default().to_vec();
        let landings = [plane(&points[0]), plane(&points[points.len() - 1])];
        return Flight { floors, landings, between };
    }
    let [(first, far), (second, _)] = [lower, upper].map(|(floor, outline)| ends(floor, outline));
    let same = geometry::distance(first, second) < geometry::distance(far, second);
    let rise = upper.0.height_m - lower.0.height_m;
    let between = if same && geometry::distance(first, far) < LONG * rise {
        vec![[far[0], far[1], 0.5 * (lower.0.height_m + upper.0.height_m)]]
    } else {
        Vec::new()
    };
    Flight { floors, landings: [first, second], between }
}

/// The points of the way from a height to another, without those on the way straight on.
fn along_way(connector: &Connector, [low, high]: [f64; 2]) -> Option<Vec<[f64; 3]>> {
    let level = |height: f64| move |point: &[f64; 3]| (point[2] - height).abs() < 0.01;
    let last_low = connector.way.iter().rposition(level(low))?;
    let first_high = connector.way.iter().position(level(high))?;
    // The last point on the floor is the foot of the flight; one steps on it from the point before.
    let from = last_low.saturating_sub(usize::from(last_low > 0 && level(low)(&connector.way[last_low - 1])));
    let on_floor = connector.way.get(first_high + 1).is_some_and(level(high));
    let mut points = connector.way.get(from..=first_high + usize::from(on_floor))?.to_vec();
    if points.len() < 2 {
        return None;
    }
    let mut at = 1;
    while at + 1 < points.len() {
        let [before, here, after] = [points[at - 1], points[at], points[at + 1]].map(|[x, y, _]| [x, y]);
        let off = geometry::distance(geometry::nearest(&[before, after], here), here);
        let short = geometry::distance(before, here).min(geometry::distance(here, after)) < STUB_M;
        if off < STRAIGHT_M && short {
            points.remove(at);
        } else {
            at += 1;
        }
    }
    Some(points)
}

/// Where one steps on stairs on a floor, and the other end of them: the nearer to a door is the first.
fn ends(floor: &Floor, outline: &[Point]) -> (Point, Point) {
    let middle = geometry::centre(outline);
    let [a, b] = geometry::middle_line(outline).unwrap_or([middle; 2]);
    let [a, b] = [geometry::between(a, b, IN_PART), geometry::between(b, a, IN_PART)];
    let to_door = |end: Point| {
        let doors = floor.doors.iter().map(|door| geometry::between(door.line[0], door.line[1], 0.5));
        doors.map(|door| geometry::distance(door, end)).fold(f64::INFINITY, f64::min)
    };
    if to_door(b) < to_door(a) { (b, a) } else { (a, b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;

    #[test]
    fn a_staircase_with_a_way_is_two_flights_and_a_landing() {
        let found = flights(&generate::twin(2));
        assert_eq!(found.len(), 3);
        let stairs = &found[0];
        assert_eq!((stairs.floors, stairs.landings), ([0, 1], [[19.0, 9.1], [17.0, 9.1]]));
        for (found, expected) in stairs.between.iter().zip([[19.0, 13.3, 1.8], [17.0, 13.3, 1.8]]) {
            assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9), "{found:?}");
        }
        assert_eq!(stairs.between.len(), 2);
        assert!(found[2].between.is_empty() && found[2].landings[0] == found[2].landings[1]);
    }

    #[test]
    fn a_staircase_over_three_floors_is_entered_on_each() {
        let found = flights(&generate::institute());
        let main: Vec<_> = found.iter().take(2).map(|flight| (flight.floors, flight.landings)).collect();
        assert_eq!(main, [([0, 1], [[23.0, 9.9], [21.0, 9.9]]), ([1, 2], [[23.0, 9.9], [21.0, 9.9]])]);
    }

    #[test]
    fn stairs_without_a_way_turn_round_at_half_their_height() {
        let outline = vec![[0.0, 0.0], [5.0, 0.0], [5.0, 2.4], [0.0, 2.4]];
        let door = crate::building::Door { line: [[5.0, 0.5], [5.0, 1.5]], name: None };
        let floor = |number: i32| Floor {
            number,
            height_m: 3.5 * f64::from(number),
            doors: vec![door.clone()],
            ..Floor::default()
        };
        let connector = Connector {
            name: "s".into(),
            kind: ConnectorKind::Stairs,
            outlines: vec![(0, outline.clone()), (1, outline)],
            way: Vec::new(),
        };
        let building =
            Building { floors: vec![floor(0), floor(1)], connectors: vec![connector], ..Building::default() };
        let [flight] = &flights(&building)[..] else { panic!("one flight") };
        for (found, expected) in [(flight.landings[0], [4.0, 1.2]), (flight.landings[1], [4.0, 1.2])] {
            assert!(geometry::distance(found, expected) < 1e-9);
        }
        let [x, y, z] = flight.between[0];
        assert!((x - 1.0).abs() < 1e-9 && (y - 1.2).abs() < 1e-9 && z == 1.75);
    }
}
