//! Buildings made for evaluation: a twin of the document's, an institute whose floors differ, offices that are much alike,
//! and a large one.

mod drawing;
mod institute;

pub use institute::institute;

use self::drawing::{Drawing, STAIRS_M, Side, elevator, stairs};
use super::geometry::Segment;
use super::model::{Building, Entrance};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// What the evaluation of the document needs (Foot, chapter 7): two floors of 805 m² (141 120 particles each), wings that are
/// mirror images of each other, a staircase in each, an elevator, and a hall in the middle. More floors are like the upper
/// one.
pub fn twin(floors: i32) -> Building {
    const WING: f64 = 20.0;
    const HALL: f64 = 12.0;
    const SOUTH: f64 = 6.0;
    const NORTH: f64 = 8.2;
    const DEEP: f64 = NORTH + STAIRS_M[1];
    const HALL_DEEP: f64 = 19.75;
    let (east, whole) = (WING + HALL, 2.0 * WING + HALL);
    let cabin = ([WING, 15.0], [WING + 2.0, 17.2]);
    let floor = |number: i32| {
        let mut drawing = Drawing::new(number);
        let widths = [3.2, 4.8, 4.0, 3.6, 4.4];
        let mirrored: Vec<f64> = widths.iter().rev().copied().collect();
        let name =
            move |wing: &'static str, first: usize| move |index: usize| format!("{wing}{number}{}", first + index);
        drawing.row(0.0, &widths, SOUTH, 0.0, name("W", 1));
        drawing.row(east, &mirrored, SOUTH, 0.0, name("E", 1));
        let (north, north_mirrored) = ([4.0, 4.6, 3.4, 4.0], [4.0, 3.4, 4.6, 4.0]);
        drawing.row(0.0, &north, NORTH, DEEP, name("W", 6));
        drawing.row(east + STAIRS_M[0], &north_mirrored, NORTH, DEEP, name("E", 6));
        for west in [WING - STAIRS_M[0], east] {
            drawing.staircase(west, NORTH, number == 0, number == floors - 1, Side::East);
        }
        drawing.room(format!("corridor-W{number}"), "corridor", [0.0, SOUTH], [WING, NORTH]);
        drawing.room(format!("corridor-E{number}"), "corridor", [east, SOUTH], [whole, NORTH]);
        drawing.wall([0.0, SOUTH], [0.0, NORTH]);
        drawing.wall([whole, SOUTH], [whole, NORTH]);
        // The hall, open to both corridors.
        drawing.room(
            if number == 0 { "hall".to_owned() } else { format!("hall-{number}") },
            "hall",
            [WING, 0.0],
            [east, HALL_DEEP],
        );
        for x in [WING, east] {
            drawing.wall([x, DEEP], [x, HALL_DEEP]);
        }
        drawing.wall([WING, HALL_DEEP], [east, HALL_DEEP]);
        if number == 0 {
            drawing.wall_with_gaps([WING, 0.0], [east, 0.0], &[(WING + HALL / 2.0, 1.8)], true);
        } else {
            drawing.wall([WING, 0.0], [east, 0.0]);
        }
        drawing.elevator(cabin.0, cabin.1);
        drawing.floor
    };
    let building = Building {
        name: "Twin".to_owned(),
        floors: (0..floors).map(floor).collect(),
        connectors: vec![
            stairs("stairs-W", WING - STAIRS_M[0], NORTH, floors, Side::East),
            stairs("stairs-E", east, NORTH, floors, Side::East),
            elevator("elevator-1", cabin.0, cabin.1, floors),
        ],
        entrances: vec![Entrance { name: "main".to_owned(), floor: 0, place: [WING + HALL / 2.0, 0.3], beacon: None }],
        ..Building::default()
    };
    made(building)
}

/// Six floors of 10 000 m² each with some sixteen hundred rooms.
pub fn large(seed: u64) -> Building {
    offices("Large", 6, 5, 125.0, seed)
}

/// Floors with `strips` corridors along x, `long` metres of them, with rooms of random widths on both sides; joined by one
/// corridor across, with a staircase on both sides of it at both ends and an elevator.
///
/// # Panics
/// Never for one floor to a hundred, one strip or more, and a length of 30 m or more.
pub fn offices(name: &str, floors_wanted: i32, strips: usize, long: f64, seed: u64) -> Building {
    const STRIP: f64 = 16.0;
    const ROOM: f64 = 6.7;
    let across = [(0.48 * long).round(), (0.48 * long).round() + 5.0];
    let mut random = Pcg64Mcg::new(u128::from(seed) << 1 | 1);
    let mut unit = move || (random.next_u32() >> 8) as f64 / f64::from(1 << 24);
    let last = STRIP * (strips - 1) as f64;
    let ends: Vec<f64> = if strips > 1 { vec![0.0, last] } else { vec![0.0] };
    let cabins: Vec<_> = ends.iter().map(|y| ([across[0], y + 0.5], [across[0] + 2.0, y + 2.7])).collect();
    let mut floors = Vec::new();
    for number in 0..floors_wanted {
        let mut drawing = Drawing::new(number);
        for strip in 0..strips {
            let south = STRIP * strip as f64;
            let (low, high) = (south + ROOM, south + STRIP - ROOM);
            let with_stairs = strip == 0 || strip == strips - 1;
            for (side, from, to) in [("W", 0.0, across[0]), ("E", across[1], long)] {
                // South of the corridor rooms only; north of it a staircase beside the way across in the outer strips.
                for (row, corridor, outer) in [("S", low, south), ("N", high, south + STRIP)] {
                    let (mut west, mut east) = (from, to);
                    if row == "N" && with_stairs {
                        if side == "W" {
                            east -= STAIRS_M[0];
                            drawing.staircase(east, high, number == 0, number == floors_wanted - 1, Side::East);
                            drawing.wall([east, high + STAIRS_M[1]], [east, outer]);
                        } else {
                            drawing.staircase(west, high, number == 0, number == floors_wanted - 1, Side::East);
                            west += STAIRS_M[0];
                            drawing.wall([west, high + STAIRS_M[1]], [west, outer]);
                        }
                    }
                    let widths = widths(east - west, &mut unit);
                    drawing.row(west, &widths, corridor, outer, |index| {
                        format!("{number}{}{side}{row}{:02}", strip + 1, index + 1)
                    });
                }
                drawing.room(format!("corridor-{number}{}{side}", strip + 1), "corridor", [from, low], [to, high]);
                let end = if side == "W" { from } else { to };
                drawing.wall([end, low], [end, high]);
            }
        }
        let top = STRIP * strips as f64;
        drawing.room(format!("across-{number}"), "corridor", [across[0], 0.0], [across[1], top]);
        drawing.wall([across[0], top], [across[1], top]);
        for y in ends.iter().map(|south| south + STRIP - ROOM + STAIRS_M[1]) {
            for x in across {
                drawing.wall([x, y], [x, y + ROOM - STAIRS_M[1]]);
            }
        }
        if number == 0 {
            drawing.wall_with_gaps([across[0], 0.0], [across[1], 0.0], &[(across[0] + 3.5, 1.8)], true);
        } else {
            drawing.wall([across[0], 0.0], [across[1], 0.0]);
        }
        for &(low, high) in &cabins {
            drawing.elevator(low, high);
        }
        floors.push(drawing.floor);
    }
    let north = STRIP - ROOM;
    let mut connectors = Vec::new();
    for &south in &ends {
        let strip = (south / STRIP).round() as usize + 1;
        connectors.push(stairs(
            &format!("stairs-{strip}W"),
            across[0] - STAIRS_M[0],
            south + north,
            floors_wanted,
            Side::East,
        ));
        connectors.push(stairs(&format!("stairs-{strip}E"), across[1], south + north, floors_wanted, Side::East));
    }
    for (index, (low, high)) in cabins.into_iter().enumerate() {
        connectors.push(elevator(&format!("elevator-{}", index + 1), low, high, floors_wanted));
    }
    let entrances = vec![Entrance { name: "main".to_owned(), floor: 0, place: [across[0] + 3.5, 0.3], beacon: None }];
    made(Building { name: name.to_owned(), floors, connectors, entrances, ..Building::default() })
}

/// Widths of rooms from 3 m to 9 m that fill `length`.
fn widths(length: f64, unit: &mut impl FnMut() -> f64) -> Vec<f64> {
    let mut widths = Vec::new();
    let mut left = length;
    while left > 12.0 {
        let width = ((3.0 + 6.0 * unit() * unit()) * 10.0).round() / 10.0;
        widths.push(width);
        left -= width;
    }
    let halves = [(left * 5.0).round() / 10.0, 0.0];
    widths.extend([halves[0], left - halves[0]]);
    widths
}

/// Walls that lie on each other are drawn once. All of them run along x or y.
fn made(mut building: Building) -> Building {
    for floor in &mut building.floors {
        let mut walls: Vec<Segment> = std::mem::take(&mut floor.walls);
        for wall in &mut walls {
            // Widths that were added up miss each other by a little.
            *wall = wall.map(|point| point.map(|value| (value * 1e3).round() / 1e3));
            if wall[1] < wall[0] {
                wall.swap(0, 1);
            }
        }
        // Line by line, from one end to the other.
        let line = |wall: &Segment| {
            let across = usize::from(wall[0][0] != wall[1][0]);
            (across, (wall[0][across] * 1e3).round() as i64, (wall[0][1 - across] * 1e3).round() as i64)
        };
        walls.retain(|wall| wall[0] != wall[1]);
        walls.sort_by_key(line);
        for wall in walls {
            match floor.walls.last_mut() {
                Some(last) if line(last).0 == line(&wall).0 && line(last).1 == line(&wall).1 && wall[0] <= last[1] => {
                    if last[1] < wall[1] {
                        last[1] = wall[1];
                    }
                }
                _ => floor.walls.push(wall),
            }
        }
    }
    building.assembled().expect("a generated building is whole; the tests make each")
}

#[cfg(test)]
mod tests {
    use super::super::geometry::Point;
    use super::*;
    use crate::particle::Map;

    #[test]
    fn the_twin_is_as_large_as_the_document_has_it_and_symmetric() {
        let building = twin(2);
        let map = Map::of(&building).unwrap();
        let inside = |floor: usize| {
            let places = (0..260).flat_map(|i| (0..100).map(move |j| [0.1 + 0.2 * i as f32, 0.1 + 0.2 * j as f32]));
            places.filter(|&place| map.is_inside(floor, place)).count() as f64 * 0.04
        };
        // 141 120 particles, 16 for each 0.09 m²: 794 m².
        for floor in 0..2 {
            assert!((inside(floor) - 794.0).abs() < 25.0, "{}", inside(floor));
        }
        // Every wall has a mirror image, but for the elevator and the doors that are not in the middle.
        let plain = |wall: &&Segment| wall[0][0] == wall[1][0] && (wall[0][0] < 20.0 || wall[0][0] > 32.0);
        let near = |a: Point, b: Point| (a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9;
        let walls = &building.floors[0].walls;
        for wall in walls.iter().filter(plain) {
            let mirrored = wall.map(|[x, y]| [52.0 - x, y]);
            assert!(walls.iter().any(|other| near(other[0], mirrored[0]) && near(other[1], mirrored[1])), "{wall:?}");
        }
    }

    #[test]
    fn the_committed_files_are_what_is_generated() {
        let committed = [
            (twin(2), include_str!("../../../../buildings/twin.geojson")),
            (institute(), include_str!("../../../../buildings/institute.geojson")),
            (large(1), include_str!("../../../../buildings/large.geojson")),
        ];
        for (building, text) in committed {
            assert!(
                super::super::geojson::write(&building).unwrap() == text,
                "sohle building generate makes {}",
                building.name
            );
        }
    }

    #[test]
    fn the_large_one_is_large() {
        let building = large(1);
        assert_eq!(building.floors.len(), 6);
        let rooms: usize = building.floors.iter().map(|floor| floor.rooms.len()).sum();
        assert!((1_200..2_000).contains(&rooms), "{rooms}");
        let [low, high] = building.bounds().unwrap();
        assert!(((high[0] - low[0]) * (high[1] - low[1]) - 10_000.0).abs() < 1.0);
        assert_eq!(building, large(1));
        assert!(building.floors[0].walls != large(2).floors[0].walls);
        let text = super::super::geojson::write(&building).unwrap();
        assert!(text.len() < 1_500_000, "{}", text.len());
    }
}
