//! Plans of real buildings, as others wrote them: floors, corridors, shops and closed walls are found in them.

#![allow(clippy::unwrap_used, reason = "a test that cannot read its plan has failed")]

use sohle_walks::building::open::{Options, open};
use sohle_walks::building::{ConnectorKind, Floor, Georeference, Room, geometry};
use sohle_walks::recording::recordings_dir;
use std::fs;
use std::path::PathBuf;

/// A folder of the recordings, if they are there.
fn recorded(path: &str) -> Option<PathBuf> {
    let found = recordings_dir().map(|folder| folder.join(path)).filter(|path| path.exists());
    if found.is_none() {
        println!("skipped: no recordings");
    }
    found
}

#[test]
fn the_university_has_three_floors_and_surveyed_places_lie_in_its_corridors() {
    let Some(folder) = recorded("hcu_hamburg") else { return };
    let building = open(&folder.join("floorplans"), &Options::default()).unwrap();
    let numbers: Vec<_> = building.floors.iter().map(|floor| floor.number).collect();
    assert_eq!(numbers, [0, 1, 4]);
    let Georeference::Utm { epsg, origin } = building.georeference else { panic!("no zone") };
    assert_eq!(epsg, 32_632);
    // Surveyed places where somebody walked, in the same zone.
    let table = fs::read_to_string(folder.join("eight_walk/demo_waypoints.csv")).unwrap();
    let places: Vec<[f64; 2]> = table
        .lines()
        .skip(1)
        .map(|line| {
            let values: Vec<f64> = line.split_whitespace().map(|value| value.parse().unwrap()).collect();
            [values[1] - origin[0], values[2] - origin[1]]
        })
        .collect();
    let floor = building.floor(4).unwrap();
    assert_eq!(places.len(), 13);
    let rooms: Vec<_> = places.iter().filter_map(|place| floor.room_at(*place)).collect();
    assert_eq!(rooms.len(), places.len());
    // `F` are corridors (Flure). The places are given to a decimetre and lie at corners, some of them in a stairwell
    // or a store beside the corridor.
    let corridors = rooms.iter().filter(|room| room.name.starts_with("4 F")).count();
    assert!(corridors * 4 >= places.len() * 3, "{corridors} of {rooms:?}");
    let stairs = building.connectors.iter().filter(|connector| connector.kind == ConnectorKind::Stairs).count();
    assert!(stairs > 2, "{stairs} staircases");
}

#[test]
fn the_mall_has_shops_and_walkers_stay_between_them() {
    for (name, walk, shops) in [("F1", "5dd9ef979191710006b57086", 172), ("F4", "5ddb6558c5b77e0006b17918", 123)] {
        let Some(folder) = recorded(&format!("xyz10_mall/site1/{name}")) else { return };
        let building = open(&folder, &Options::default()).unwrap();
        assert_eq!(building, open(&folder.join("geojson_map.json"), &Options::default()).unwrap());
        let floor: &Floor = &building.floors[0];
        assert_eq!((floor.name.as_str(), floor.rooms.len()), (name, shops));
        let text = fs::read_to_string(folder.join(format!("{walk}.txt"))).unwrap();
        let points: Vec<[f64; 2]> = text
            .lines()
            .filter_map(|line| {
                let mut fields = line.split('\t').skip_while(|field| *field != "TYPE_WAYPOINT").skip(1);
                Some([fields.next()?.parse().ok()?, fields.next()?.parse().ok()?])
            })
            .collect();
        assert!(points.len() > 4);
        let in_shop = |point: &&[f64; 2]| floor.room_at(**point).map(|room: &Room| &room.name).is_some();
        let inside = points.iter().filter(in_shop).count();
        // Most of the walk is in the corridors; what the shops are called decides nothing.
        assert!(inside * 4 <= points.len(), "{inside} of {} in {name}", points.len());
    }
}

#[test]
fn the_hall_that_a_robot_mapped_is_closed() {
    let Some(folder) = recorded("map_nav2_depot") else { return };
    let building = open(&folder, &Options::default()).unwrap();
    assert_eq!(building.floors, open(&folder.join("depot.yaml"), &Options::default()).unwrap().floors);
    // 604 by 307 pixels of 5 cm, with walls at their borders.
    let [low, high] = building.bounds().unwrap();
    assert!(low.iter().all(|value| (0.0..0.2).contains(value)), "{low:?}");
    assert!((high[0] - 30.2).abs() < 0.2 && (high[1] - 15.35).abs() < 0.2, "{high:?}");
    // From the middle no straight way leads out.
    let walls = &building.floors[0].walls;
    for angle in 0..720 {
        let (sin, cos) = (f64::from(angle) / 2.0).to_radians().sin_cos();
        let way = [[12.0, 8.0], [12.0 + 40.0 * cos, 8.0 + 40.0 * sin]];
        assert!(walls.iter().any(|wall| geometry::crossing(&way, wall).is_some()), "{angle}");
    }
}
