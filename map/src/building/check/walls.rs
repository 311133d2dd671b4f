//! Gaps between walls, walls drawn twice, walls through doors.

use super::{Kind, Notes};
use crate::building::geometry::{self, Point, Segment};
use crate::building::index::Index;
use crate::building::model::{Building, Floor};

/// Ends nearer than this meet. **Units:** m.
const MEETS_M: f64 = 2e-3;
/// Up to this a gap comes from drawing, above it from a wall that is missing. **Units:** m.
const TINY_M: f64 = 0.05;
/// Narrower than this nobody calls it a door or an opening. **Units:** m.
const NARROWEST_DOOR_M: f64 = 0.6;
/// The frame of a door may reach so far into the wall: plans with thick walls have the door in their middle. **Units:** m.
const FRAME_M: f64 = 0.3;
/// So far before and behind a door it must be free. **Units:** m.
const FREE_M: f64 = 0.15;

/// Looks at the walls of all floors.
pub fn check(building: &Building, notes: &mut Notes<'_>) {
    for floor in &building.floors {
        if floor.walls.is_empty() {
            let what = format!("floor {} has no walls", floor.number);
            let cure = "draw its walls, or check that the reader was told the right layers or classes";
            notes.note(Kind::NoWalls, Some(floor.number), None, None, what, cure);
            continue;
        }
        let index = Index::of(&floor.walls);
        gaps(floor, &index, notes);
        doubles(floor, &index, notes);
        closed_doors(floor, &index, notes);
    }
}

/// Ends of walls that meet nothing although something is near.
fn gaps(floor: &Floor, index: &Index<'_>, notes: &mut Notes<'_>) {
    let mut told: Vec<Segment> = Vec::new();
    let doors: Vec<Segment> = floor.doors.iter().map(|door| door.line).collect();
    let door_index = Index::of(&doors);
    for (number, wall) in floor.walls.iter().enumerate() {
        for end in 0..2 {
            let Some(other) = gap(number, [wall[1 - end], wall[end]], index, &door_index) else { continue };
            let place = wall[end];
            let width = geometry::distance(place, other);
            let middle = geometry::between(place, other, 0.5);
            // The other side of the same gap has been told.
            let again = |gap: &Segment| {
                geometry::distance(geometry::between(gap[0], gap[1], 0.5), middle) < width.max(MEETS_M) * 0.75
            };
            if told.iter().any(again) {
                continue;
            }
            told.push([place, other]);
            if width <= TINY_M {
                let what = format!("walls miss each other by {:.1} cm", width * 100.0);
                notes.at(Kind::TinyGap, floor.number, middle, what, "let the walls end in the same point");
            } else {
                let what = format!("a gap of {width:.2} m, narrower than a door, which is no door");
                let cure = "close the gap with a wall, or draw a door of at least 0.6 m there";
                notes.at(Kind::Leak, floor.number, middle, what, cure);
            }
        }
    }
}

/// The nearest place of another wall or door that the end of a wall misses, the other end of which is `wall[0]`.
fn gap(number: usize, [start, end]: [Point; 2], index: &Index<'_>, doors: &Index<'_>) -> Option<Point> {
    let mut nearest: Option<(f64, Point)> = None;
    let mut offer = |place: Point| {
        let distance = geometry::distance(place, end);
        if nearest.is_none_or(|(least, _)| distance < least) {
            nearest = Some((distance, place));
        }
    };
    for other in index.near([end; 2], NARROWEST_DOOR_M) {
        if other == number {
            continue;
        }
        let place = geometry::nearest(index.segment(other), end);
        if geometry::distance(place, end) < MEETS_M {
            return None;
        }
        // What lies beside the wall and not before its end is another wall, not the other side of a gap.
        let ahead = [end[0] - start[0], end[1] - start[1]];
        let to = [place[0] - end[0], place[1] - end[1]];
        if ahead[0] * to[0] + ahead[1] * to[1] >= 0.0 {
            offer(place);
        }
    }
    for door in doors.near([end; 2], NARROWEST_DOOR_M) {
        let line = doors.segment(door);
        let place = geometry::nearest(line, end);
        if geometry::distance(place, end) < MEETS_M {
            return None;
        }
        if faces(line, start, end) {
            offer(place);
            continue;
        }
        // A wall that ends at the frame: beside the end of the door's line, not before its middle.
        if line.iter().any(|corner| geometry::distance(*corner, end) < FRAME_M) {
            return None;
        }
    }
    nearest.filter(|(distance, _)| *distance < NARROWEST_DOOR_M).map(|(_, place)| place)
}

/// Whether a wall leads to a door along the door's own line and ends before it, so that a gap remains between both.
fn faces(door: &Segment, start: Point, end: Point) -> bool {
    let nearest = geometry::nearest(door, end);
    let [ahead, to] = [[end[0] - start[0], end[1] - start[1]], [nearest[0] - end[0], nearest[1] - end[1]]];
    let length = ahead[0].hypot(ahead[1]) * to[0].hypot(to[1]);
    // Within 8 degrees of straight ahead.
    length > 0.0 && (ahead[0] * to[0] + ahead[1] * to[1]) / length > 0.99
}

/// Walls that lie on each other for some length.
fn doubles(floor: &Floor, index: &Index<'_>, notes: &mut Notes<'_>) {
    for (number, wall) in floor.walls.iter().enumerate() {
        let Some(bounds) = geometry::bounds(*wall) else { continue };
        for other in index.near(bounds, MEETS_M).into_iter().filter(|&other| other > number) {
            if let Some(shared) = overlap(wall, index.segment(other)) {
                let what = format!("two walls lie on each other for {:.2} m", geometry::length(&shared));
                let place = geometry::between(shared[0], shared[1], 0.5);
                notes.at(Kind::DoubleWall, floor.number, place, what, "remove one of them");
            }
        }
    }
}

/// What two walls have in common, if they lie on one line: at least a centimetre.
fn overlap(a: &Segment, b: &Segment) -> Option<Segment> {
    let length = geometry::length(a);
    if length < MEETS_M {
        return None;
    }
    let along = [(a[1][0] - a[0][0]) / length, (a[1][1] - a[0][1]) / length];
    let place = |point: Point| {
        let to = [point[0] - a[0][0], point[1] - a[0][1]];
        (to[0] * along[0] + to[1] * along[1], to[1] * along[0] - to[0] * along[1])
    };
    let ((s, off_s), (t, off_t)) = (place(b[0]), place(b[1]));
    // A wall of a metre may be turned by a fifth of a degree and still count.
    if off_s.abs() > MEETS_M || off_t.abs() > MEETS_M {
        return None;
    }
    let (from, to) = (s.min(t).max(0.0), s.max(t).min(length));
    (to - from > 0.01)
        .then(|| [geometry::between(a[0], a[1], from / length), geometry::between(a[0], a[1], to / length)])
}

/// Doors that a wall runs through.
fn closed_doors(floor: &Floor, index: &Index<'_>, notes: &mut Notes<'_>) {
    for door in &floor.doors {
        let length = geometry::length(&door.line);
        let middle = geometry::between(door.line[0], door.line[1], 0.5);
        if length < MEETS_M {
            let what = "a door without width".to_owned();
            notes.at(Kind::ClosedDoor, floor.number, middle, what, "draw it from one side of its frame to the other");
            continue;
        }
        let [a, b] = door.line;
        let across = [(b[1] - a[1]) / length * FREE_M, (a[0] - b[0]) / length * FREE_M];
        let through = [[middle[0] - across[0], middle[1] - across[1]], [middle[0] + across[0], middle[1] + across[1]]];
        let Some(bounds) = geometry::bounds(through) else { continue };
        if index.near(bounds, 0.0).into_iter().any(|wall| geometry::crossing(&through, index.segment(wall)).is_some()) {
            let name = door.name.as_ref().map_or_else(String::new, |name| format!(" '{name}'"));
            let what = format!("a wall runs through the door{name}");
            notes.at(Kind::ClosedDoor, floor.number, middle, what, "cut the wall at both sides of the door's frame");
        }
    }
}
