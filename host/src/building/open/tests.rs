//! Opens real plans, and tells what is none.

use super::*;
use crate::building::geometry;
use crate::building::{ConnectorKind, Floor, Georeference, Room};
use crate::recording::recordings_dir;

/// A folder of the recordings, if they are there.
fn recorded(path: &str) -> Option<PathBuf> {
    let found = recordings_dir().map(|folder| folder.join(path)).filter(|path| path.exists());
    if found.is_none() {
        println!("skipped: no recordings");
    }
    found
}

#[test]
fn floors_have_numbers_by_name() {
    let known = [("EG", 0), ("1OG", 1), ("4. OG", 4), ("2UG", -2), ("UG", -1), ("F3", 3), ("B1", -1), ("-2", -2)];
    for (name, number) in known {
        assert_eq!(floor_number(name), Some(number), "{name}");
    }
    for name in ["", "roof", "F", "99999999999OG"] {
        assert_eq!(floor_number(name), None, "{name}");
    }
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
        assert_eq!(building, open(&folder.join(XYZ10_MAP), &Options::default()).unwrap());
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

#[test]
fn what_is_no_building_is_told() {
    let home = tempfile::tempdir().unwrap();
    let message = |name: &str| open(&home.path().join(name), &Options::default()).unwrap_err().to_string();
    assert!(message("absent.geojson").ends_with("absent.geojson cannot be read"));
    fs::write(home.path().join("noise"), [0, 159, 146, 150]).unwrap();
    assert!(message("noise").ends_with("it is no text (UTF-8)"));
    fs::write(home.path().join("empty"), "").unwrap();
    assert!(message("empty").contains("nothing in it tells which format"));
    fs::create_dir(home.path().join("folder")).unwrap();
    assert!(message("folder").contains("the folder holds neither"));
    let floor = r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"ifc_class":"IfcWall"},"geometry":null}]}"#;
    fs::write(home.path().join("plan.geojson"), floor).unwrap();
    assert!(message("plan.geojson").contains("must be that of the floor"));
    fs::write(home.path().join("EG.geojson"), floor).unwrap();
    assert_eq!(message("EG.geojson"), "the building has no floors");
}
