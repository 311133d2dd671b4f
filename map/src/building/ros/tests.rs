//! Reads maps that the test draws.

use super::{Info, MapFile, parse};
use crate::building::check::{Level, check};
use crate::building::geometry::{self, Segment};
use crate::building::{Building, Floor, generate, same};
use proptest::prelude::*;

const CELL_M: f64 = 0.05;

/// A floor as an image: all pixels within `thick` of a wall are black. The lower left corner is at -1, -1.
fn drawn(floor: &Floor, thick: f64) -> Vec<u8> {
    let [_, high] = geometry::bounds(floor.points()).unwrap();
    let [width, height] = high.map(|value| ((value + 2.0) / CELL_M).ceil() as usize);
    let mut pixels = vec![254_u8; width * height];
    for wall in &floor.walls {
        let [low, high] = geometry::bounds(*wall).unwrap();
        let cell = |value: f64| ((value + 1.0) / CELL_M) as usize;
        for y in cell(low[1] - thick)..=cell(high[1] + thick) {
            for x in cell(low[0] - thick)..=cell(high[0] + thick) {
                let centre = [x, y].map(|value| (value as f64 + 0.5) * CELL_M - 1.0);
                if geometry::distance(geometry::nearest(wall, centre), centre) <= thick {
                    pixels[(height - 1 - y) * width + x] = 0;
                }
            }
        }
    }
    [format!("P5\n{width} {height}\n255\n").as_bytes(), &pixels].concat()
}

fn info(text: &str) -> Info {
    Info::parse(&format!("image: m.pgm\nresolution: {CELL_M}\n{text}"), "m.yaml").unwrap()
}

fn read(image: &[u8], info: &Info) -> Building {
    let map = MapFile { number: 0, name: "EG", info, image, file: "m.yaml" };
    parse("house", &[map], 3.6).unwrap()
}

#[test]
fn the_walls_of_the_twin_are_where_they_were_drawn_and_its_rooms_are_reached_by_its_doors() {
    let twin = generate::twin(2);
    // Walls of 15 cm: their faces are 7.5 cm from the middle, less or more half a cell, and moved by up to a cell.
    let maps: Vec<Building> =
        twin.floors.iter().map(|floor| read(&drawn(floor, 0.075), &info("origin: [-1, -1, 0]"))).collect();
    let mut walled = twin.clone();
    for (map, floor) in maps.iter().zip(&mut walled.floors) {
        same::assert_covered(&map.floors[0], floor, 0.075 + 1.5 * CELL_M);
        same::assert_covered(floor, &map.floors[0], 0.075 + 1.5 * CELL_M);
        floor.walls.clone_from(&map.floors[0].walls);
        // A door of a metre has lost half a wall on both sides, or lies at a wall across.
        floor.doors.clear();
    }
    let errors: Vec<_> = check(&walled).into_iter().filter(|finding| finding.level == Level::Error).collect();
    assert!(errors.is_empty(), "{errors:?}");
    // With its doors closed no room is reached.
    let plan = same::plan();
    for (floor, closed) in walled.floors.iter_mut().zip(&plan.closed) {
        let drawing = Floor { walls: closed.clone(), ..Floor::default() };
        floor.walls = read(&drawn(&drawing, 0.075), &info("origin: [-1, -1, 0]")).floors[0].walls.clone();
    }
    let offices =
        walled.floors.iter().flat_map(|floor| &floor.rooms).filter(|room| room.usage.as_deref() == Some("office"));
    let offices = offices.count();
    let shut = check(&walled).iter().filter(|finding| finding.room.is_some()).count();
    assert_eq!(shut, offices);
}

#[test]
fn a_turned_map_lies_where_its_origin_says() {
    let walls: Vec<Segment> = vec![[[0.0, 0.0], [4.0, 0.0]]];
    let floor = Floor { walls, ..Floor::default() };
    let building = read(&drawn(&floor, 0.05), &info("origin: [10, 20, 1.5707963267948966]"));
    // The image reaches a metre beyond the wall, and x of the image is y.
    let [low, high] = building.bounds().unwrap();
    assert!((low[1] - 21.0).abs() < 0.1 && (high[1] - 25.0).abs() < 0.1, "{low:?} {high:?}");
    assert!((low[0] - 9.0).abs() < 0.1 && (high[0] - 9.0).abs() < 0.1, "{low:?} {high:?}");
}

#[test]
fn what_is_wrong_is_told() {
    let message = |image: &[u8], text: &str| {
        let map = MapFile { number: 0, name: "EG", info: &info(text), image, file: "m.yaml" };
        parse("house", &[map], 3.6).unwrap_err().to_string()
    };
    assert_eq!(
        message(b"P5 2 1 255\n\xff\xff", "origin: [0, 0, 0]"),
        "m.yaml is no map of map_server: nothing in its image is occupied"
    );
    assert!(message(b"P5 2 1 255\n\x00\xff", "origin: [9000, 0, 0]").contains("beyond 5000 m"));
    // A million specks are no map.
    let speck = |at: u32| if at.is_multiple_of(2) && (at / 2_000).is_multiple_of(2) { 0 } else { 255 };
    let noise: Vec<u8> = (0..4_000_000_u32).map(speck).collect();
    let mut image = b"P5 2000 2000 255\n".to_vec();
    image.extend(&noise);
    assert!(message(&image, "origin: [0, 0, 0]").contains("is it a map?"));
}

proptest! {
    #[test]
    fn no_bytes_panic(
        text in ".{0,80}", bytes in proptest::collection::vec(any::<u8>(), 0..200), mode in 0..3,
    ) {
        let _ = Info::parse(&text, "x");
        let info = info("origin: [0, 0, 0]");
        let head: &[u8] = [&b""[..], b"P5 9 9 255\n", b"\x89PNG\r\n\x1a\n"][mode as usize];
        let image = [head, &bytes].concat();
        let _ = parse("x", &[MapFile { number: 0, name: "x", info: &info, image: &image, file: "x" }], 3.0);
    }
}
