//! For tests of readers: whether a building that was written in a format and read again is still the same.

use super::check::{Level, check};
use super::generate;
use super::geometry::{self, Point, Segment};
use super::model::{Building, Floor};

/// The twin with its walls drawn through the doors, as plans have it: walls, and on them doors.
pub(super) struct Plan {
    pub building: Building,
    /// For each floor the walls and what closes the doors.
    pub closed: Vec<Vec<Segment>>,
}

/// The building that is written.
pub(super) fn plan() -> Plan {
    let building = generate::twin(2);
    let closed = |floor: &Floor| {
        let doors = floor.doors.iter().map(|door| door.line);
        super::merge::merged(&floor.walls.iter().copied().chain(doors).collect::<Vec<_>>(), 1e-4).unwrap()
    };
    Plan { closed: building.floors.iter().map(closed).collect(), building }
}

/// Every so many metres of the walls of a floor.
fn places(floor: &Floor) -> Vec<Point> {
    let on = |wall: &Segment| {
        let count = (geometry::length(wall) / 0.2).ceil() as u32 + 1;
        let wall = *wall;
        (0..=count).map(move |part| geometry::between(wall[0], wall[1], f64::from(part) / f64::from(count)))
    };
    floor.walls.iter().flat_map(on).collect()
}

/// Whether all walls of one floor lie on those of the other.
#[track_caller]
pub(super) fn assert_covered(by: &Floor, floor: &Floor, tolerance: f64) {
    for place in places(floor) {
        let distance = |wall: &Segment| geometry::distance(geometry::nearest(wall, place), place);
        let least = by.walls.iter().map(distance).fold(f64::INFINITY, f64::min);
        assert!(least <= tolerance, "floor {}: {least} m from ({place:?}) to a wall", floor.number);
    }
}

/// Both have the same walls, doors, rooms, connectors and entrances, each within `tolerance`, and no errors. The one that was
/// read is moved by `offset`. **Units:** m.
#[track_caller]
pub(super) fn assert_same(read: &Building, written: &Building, offset: Point, tolerance: f64) {
    let mut read = read.clone();
    move_by(&mut read, offset);
    assert_eq!(read.floors.len(), written.floors.len());
    for (read, written) in read.floors.iter().zip(&written.floors) {
        assert_eq!(read.number, written.number);
        assert!((read.height_m - written.height_m).abs() < 1e-9);
        assert_covered(read, written, tolerance);
        assert_covered(written, read, tolerance);
        assert_eq!(read.doors.len(), written.doors.len());
        for door in &written.doors {
            let far = |line: &Segment| {
                let apart =
                    |a: Point, b: Point| geometry::distance(a, door.line[0]).max(geometry::distance(b, door.line[1]));
                apart(line[0], line[1]).min(apart(line[1], line[0]))
            };
            let least = read.doors.iter().map(|door| far(&door.line)).fold(f64::INFINITY, f64::min);
            assert!(least <= tolerance, "{door:?} is {least} m away");
        }
        assert_eq!(read.rooms.len(), written.rooms.len());
        for room in &written.rooms {
            let found = read.rooms.iter().find(|other| {
                other.name == room.name
                    && geometry::distance(geometry::centre(&other.outline), geometry::centre(&room.outline)) < tolerance
            });
            let found = found.unwrap_or_else(|| panic!("no room {room:?}"));
            let (a, b) = (geometry::area(&found.outline).abs(), geometry::area(&room.outline).abs());
            // An outline whose corners are moved by the tolerance.
            assert!((a - b).abs() <= tolerance * 4.0 * (a + b).sqrt(), "{} {a} {b}", room.name);
        }
    }
    for connector in &written.connectors {
        let centres = |of: &super::Connector| -> Vec<(i32, Point)> {
            of.outlines.iter().map(|(floor, outline)| (*floor, geometry::centre(outline))).collect()
        };
        let is_same = |other: &&super::Connector| {
            let (a, b) = (centres(connector), centres(other));
            other.kind == connector.kind
                && a.len() == b.len()
                && a.iter().zip(&b).all(|(a, b)| a.0 == b.0 && geometry::distance(a.1, b.1) < tolerance)
        };
        assert_eq!(read.connectors.iter().filter(is_same).count(), 1, "{}", connector.name);
    }
    assert_eq!(read.connectors.len(), written.connectors.len());
    assert_eq!(read.entrances.len(), written.entrances.len());
    for (read, written) in read.entrances.iter().zip(&written.entrances) {
        assert_eq!(read.beacon, written.beacon);
        assert_eq!(read.floor, written.floor);
        // Just inside: which step behind the door is the reader's to choose.
        assert!(geometry::distance(read.place, written.place) < 0.5);
    }
    let errors: Vec<_> = check(&read).into_iter().filter(|finding| finding.level == Level::Error).collect();
    assert!(errors.is_empty(), "{errors:?}");
}

fn move_by(building: &mut Building, offset: Point) {
    let by = |point: &mut Point| *point = [point[0] + offset[0], point[1] + offset[1]];
    for floor in &mut building.floors {
        floor.walls.iter_mut().flatten().for_each(by);
        floor.doors.iter_mut().flat_map(|door| &mut door.line).for_each(by);
        floor.rooms.iter_mut().flat_map(|room| &mut room.outline).for_each(by);
    }
    building.connectors.iter_mut().flat_map(|connector| &mut connector.outlines).flat_map(|o| &mut o.1).for_each(by);
    building.entrances.iter_mut().for_each(|entrance| by(&mut entrance.place));
}
