//! A small institute: three floors of which no two have the same plan, as in most buildings that people work in.

use super::drawing::{DOOR_M, Drawing, STAIRS_M, Side, elevator, stairs};
use super::made;
use crate::building::geometry::Point;
use crate::building::model::{Building, Entrance};

/// The house. **Units:** m.
const LONG: f64 = 48.0;
const DEEP: f64 = 18.0;
/// Northern wall of all corridors; lobby, elevator and both staircases lie behind it. **Units:** m.
const NORTH: f64 = 9.0;
/// West walls of the staircases: the main one leads up on its east side, the other on its west side. **Units:** m.
const MAIN: f64 = 20.0;
const SIDE: f64 = 42.0;
/// The elevator, its door to the lobby. **Units:** m.
const CABIN: (Point, Point) = ([14.0, 9.3], [16.0, 11.5]);
/// The lobby, from the elevator to the main staircase. **Units:** m.
const LOBBY: (Point, Point) = ([14.0, NORTH], [MAIN, NORTH + STAIRS_M[1]]);

/// Three floors of 860 m²: foyer, café and lecture hall; offices and seminar rooms; an open-plan office and laboratories. Two
/// staircases that are mirror images of each other, and an elevator.
///
/// # Panics
/// Never; the tests make it.
pub fn institute() -> Building {
    let cabin = elevator("elevator-1", CABIN.0, CABIN.1, 3);
    let entrances = vec![Entrance { name: "main".to_owned(), floor: 0, place: [15.5, 0.3], beacon: None }];
    made(Building {
        name: "Institute".to_owned(),
        floors: [ground(), first(), second()].map(|drawing| drawing.floor).into(),
        connectors: vec![
            stairs("stairs-main", MAIN, NORTH, 3, Side::East),
            stairs("stairs-side", SIDE, NORTH, 3, Side::West),
            cabin,
        ],
        entrances,
        ..Building::default()
    })
}

/// What all floors have: the outer walls but for that to the south, both staircases with what lies around them, the lobby and
/// the elevator.
fn shell(number: i32) -> Drawing {
    let mut drawing = Drawing::new(number);
    drawing.wall([0.0, 0.0], [0.0, DEEP]);
    drawing.wall([LONG, 0.0], [LONG, DEEP]);
    drawing.wall([0.0, DEEP], [LONG, DEEP]);
    let (lowest, highest) = (number == 0, number == 2);
    drawing.staircase(MAIN, NORTH, lowest, highest, Side::East);
    drawing.staircase(SIDE, NORTH, lowest, highest, Side::West);
    drawing.elevator(CABIN.0, CABIN.1);
    let back = NORTH + STAIRS_M[1];
    drawing.room(format!("lobby-{number}"), "corridor", LOBBY.0, LOBBY.1);
    drawing.wall([LOBBY.0[0], NORTH], [LOBBY.0[0], DEEP]);
    // Behind the lobby and the main staircase.
    drawing.room(format!("store-{number}"), "store", [LOBBY.0[0], back], [MAIN + STAIRS_M[0], DEEP]);
    drawing.wall_with_gaps([LOBBY.0[0], back], [MAIN + STAIRS_M[0], back], &[(17.6, DOOR_M)], true);
    drawing.wall([MAIN + STAIRS_M[0], NORTH], [MAIN + STAIRS_M[0], DEEP]);
    // Around the other one; nothing leads behind it.
    drawing.wall([SIDE, back], [SIDE, DEEP]);
    drawing.wall([SIDE + STAIRS_M[0], back], [SIDE + STAIRS_M[0], DEEP]);
    drawing.room(format!("wc-{number}"), "wc", [SIDE + STAIRS_M[0], NORTH], [LONG, DEEP]);
    drawing.wall_with_gaps([SIDE + STAIRS_M[0], NORTH], [LONG, NORTH], &[(SIDE + STAIRS_M[0] + 1.1, DOOR_M)], true);
    drawing
}

fn ground() -> Drawing {
    let mut drawing = shell(0);
    drawing.room("foyer", "hall", [11.0, 0.0], [MAIN, NORTH]);
    drawing.wall_with_gaps([0.0, 0.0], [MAIN, 0.0], &[(15.5, 1.8)], true);
    drawing.room("cafe", "cafe", [0.0, 0.0], [11.0, NORTH]);
    drawing.wall_with_gaps([11.0, 0.0], [11.0, NORTH], &[(6.2, 2.0)], true);
    drawing.room("kitchen", "kitchen", [0.0, NORTH], [8.5, DEEP]);
    drawing.room("office-01", "office", [8.5, NORTH], [14.0, DEEP]);
    drawing.wall_with_gaps([0.0, NORTH], [14.0, NORTH], &[(2.4, DOOR_M), (12.6, DOOR_M)], true);
    drawing.wall([8.5, NORTH], [8.5, DEEP]);
    drawing.room("corridor-0", "corridor", [MAIN, 6.5], [LONG, NORTH]);
    let name = |index: usize| format!("0{:02}", index + 1);
    drawing.row(MAIN, &[3.4, 5.2, 3.4, 4.0, 6.4, 5.6], 6.5, 0.0, name);
    drawing.room("lecture-hall", "hall", [MAIN + STAIRS_M[0], NORTH], [SIDE, DEEP]);
    drawing.wall_with_gaps([MAIN + STAIRS_M[0], NORTH], [SIDE, NORTH], &[(26.2, 1.6), (38.4, 1.6)], true);
    drawing
}

fn first() -> Drawing {
    let mut drawing = shell(1);
    drawing.room("corridor-1", "corridor", [0.0, 7.0], [LONG, NORTH]);
    let name = |index: usize| format!("1{:02}", index + 1);
    drawing.row(0.0, &[5.4, 3.0, 3.2, 7.0, 4.2, 3.0, 8.0, 3.4, 4.8, 6.0], 7.0, 0.0, name);
    let name = |index: usize| format!("1{:02}", index + 11);
    drawing.row(0.0, &[4.0, 6.4, 3.6], NORTH, DEEP, name);
    // A seminar room, and behind the room beside it one that is entered through it.
    drawing.room("seminar", "seminar", [24.0, NORTH], [33.0, DEEP]);
    drawing.room("120", "office", [33.0, NORTH], [SIDE, 13.0]);
    drawing.room("library", "library", [33.0, 13.0], [SIDE, DEEP]);
    drawing.wall_with_gaps([24.0, NORTH], [SIDE, NORTH], &[(31.4, DOOR_M), (36.5, DOOR_M)], true);
    drawing.wall_with_gaps([33.0, NORTH], [33.0, DEEP], &[(15.2, DOOR_M)], true);
    drawing.wall([33.0, 13.0], [SIDE, 13.0]);
    drawing
}

fn second() -> Drawing {
    let mut drawing = shell(2);
    drawing.room("open-plan", "office", [0.0, 0.0], [14.0, DEEP]);
    drawing.wall([0.0, 0.0], [14.0, 0.0]);
    drawing.room("corridor-2", "corridor", [14.0, 7.4], [LONG, NORTH]);
    let name = |index: usize| format!("2{:02}", index + 1);
    drawing.row(14.0, &[6.0, 4.2, 3.6, 9.0, 3.0, 4.0, 4.2], 7.4, 0.0, name);
    let name = |index: usize| format!("lab-{}", index + 1);
    drawing.row(24.0, &[7.2, 3.0, 7.8], NORTH, DEEP, name);
    drawing
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::check;

    #[test]
    fn no_two_floors_are_alike_and_nothing_is_wrong_with_them() {
        let building = institute();
        for pair in building.floors.windows(2) {
            assert!(pair[0].rooms.len() != pair[1].rooms.len() && pair[0].walls != pair[1].walls);
        }
        let findings = check::check(&building);
        assert!(findings.is_empty(), "{findings:?}");
    }
}
