//! From a building to a walk in it, and from the walk back to the place, as a user does it.

use crate::command::{refused, said, sohle, steps};
use sohle::building::georeference::Georeference;
use sohle::building::{Building, generate, geojson};
use sohle::recording::{Recording, mcap};
use sohle_shared::step::Step;
use std::path::Path;

#[test]
fn somebody_who_may_be_anywhere_is_found_in_the_right_room_of_the_right_floor() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    said(folder, &["building", "generate", "twin", "twin.geojson"]);
    let way = ["--route", "W02,hall,stairs-E,E14", "--out", "walk.mcap"];
    said(folder, &[&["simulate", "--building", "twin.geojson"][..], &way].concat());
    let told = said(folder, &["replay", "walk.mcap", "--building", "twin.geojson", "--out", "out"]);
    assert!(told.contains("in Twin: located at the end"), "{told}");
    let stream = std::fs::read_to_string(folder.join("out/places.jsonl")).expect("it was written");
    let lines: Vec<serde_json::Value> =
        stream.lines().map(|line| serde_json::from_str(line).expect("a line is an object")).collect();
    let (first, last) = (&lines[0], &lines[lines.len() - 1]);
    assert_eq!((&first["state"], &last["state"]), (&"searching".into(), &"located".into()));
    assert_eq!((&last["rooms"][0]["room"], &last["rooms"][0]["floor"]), (&"E14".into(), &1.into()));
    // The walk ends in the middle of the room, (46.4, 3) m.
    let place = |axis: usize| last["places"][0]["position_m"][axis].as_f64().expect("a number");
    assert!((place(0) - 46.4).abs() < 1.0 && (place(1) - 3.0).abs() < 1.0, "{last}");
    for name in ["floor0.svg", "floor1.png"] {
        assert!(folder.join("out").join(name).exists());
    }
}

#[test]
fn what_makes_no_sense_is_told_before_anything_is_written() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    said(folder, &["building", "generate", "twin", "twin.geojson"]);
    let simulate = |route: &str| {
        refused(folder, &["simulate", "--building", "twin.geojson", "--route", route, "--out", "walk.mcap"])
    };
    assert!(simulate("W02,cellar").contains("'cellar' is no room and no connector of the building"));
    assert!(simulate("W02,ramp,E14").contains("nothing that is wanted leads from floor 0 to floor 1"));
    said(folder, &["simulate", "--building", "twin.geojson", "--route", "W02,hall", "--out", "walk.mcap"]);
    let replay = |start: &str| {
        refused(folder, &["replay", "walk.mcap", "--building", "twin.geojson", "--start", start, "--out", "out"])
    };
    assert!(replay("7,1,1").contains("the building has no floor 7 to start on; it has 0, 1"));
    assert!(replay("0,-5,1").contains("is outside of the building"));
    assert!(replay("somewhere").contains("expected anywhere, entrances, the name of a room or of an entrance"));
    assert!(!folder.join("out").exists());
}

fn write_steps(folder: &Path, name: &str, steps: Vec<Step>) {
    let recording = Recording { name: name.into(), steps, ..Recording::default() };
    mcap::write(&folder.join(name), &recording).expect("it can be written");
}

fn write_building(folder: &Path, name: &str, building: &Building) {
    let text = geojson::write(building).expect("it can be written");
    std::fs::write(folder.join(name), text).expect("it can be written");
}

/// Eastwards along the lower corridor of the twin.
const CORRIDOR: &str = "0,4,7.1,0";

fn replay<'a>(building: &'a str, start: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["replay", "walk.mcap", "--building", building, "--start", start, "--out", "out"][..], more].concat()
}

fn last_place(folder: &Path) -> serde_json::Value {
    let stream = std::fs::read_to_string(folder.join("out/places.jsonl")).expect("it was written");
    serde_json::from_str(stream.lines().last().expect("a line")).expect("an object")
}

#[test]
fn a_building_without_walls_is_refused_from_an_unknown_start_and_warned_of_from_a_known_one() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    let mut bare = generate::twin(2);
    bare.floors.iter_mut().for_each(|floor| floor.walls.clear());
    write_building(folder, "bare.geojson", &bare);
    write_steps(folder, "walk.mcap", steps(12));
    let told = refused(folder, &replay("bare.geojson", "anywhere", &[]));
    assert!(told.contains("has no walls, so a start that is not known can never be found"), "{told}");
    assert!(!folder.join("out").exists());
    let output = sohle(folder, &replay("bare.geojson", CORRIDOR, &[]));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && told.starts_with("warning: the building has no walls"), "{told}");
    // The steps alone: 14.4 m to the east.
    let place = &last_place(folder)["places"][0]["position_m"];
    assert!((place[0].as_f64().expect("a number") - 18.4).abs() < 0.5, "{place}");
}

#[test]
fn a_building_without_floors_is_refused_and_one_floor_is_enough() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    write_steps(folder, "walk.mcap", steps(12));
    let none = r#"{"type": "FeatureCollection", "features": [],
        "sohle_building": {"version": 1, "name": "None", "georeference": {"kind": "local"}, "floors": []}}"#;
    std::fs::write(folder.join("none.geojson"), none).expect("it can be written");
    let told = refused(folder, &replay("none.geojson", "anywhere", &[]));
    assert!(told.contains("the building has no floors"), "{told}");
    let mut single = generate::twin(2);
    single.floors.truncate(1);
    single.connectors.clear();
    single.graph = None;
    write_building(folder, "single.geojson", &single);
    said(folder, &replay("single.geojson", CORRIDOR, &[]));
    let last = last_place(folder);
    assert_eq!((&last["state"], &last["places"][0]["floor"]), (&"located".into(), &0.into()));
    assert!(folder.join("out/floor0.png").exists() && !folder.join("out/floor1.png").exists());
}

#[test]
fn a_step_of_thirty_metres_is_told_and_taken_for_a_hole() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    said(folder, &["building", "generate", "twin", "twin.geojson"]);
    let mut steps = steps(12);
    steps[6].displacement.x = 30.0;
    write_steps(folder, "walk.mcap", steps);
    let output = sohle(folder, &replay("twin.geojson", CORRIDOR, &[]));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    let expected = "step 6: 30.0 m is longer than any stride (6 m); taken for a hole in the walk\n";
    assert!(output.status.success() && told == expected, "{told}");
    let stream = std::fs::read_to_string(folder.join("out/places.jsonl")).expect("it was written");
    let lines: Vec<serde_json::Value> = stream.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let unusual: Vec<_> = lines.iter().filter(|line| line["unusual"] == "too long").map(|line| &line["step"]).collect();
    assert_eq!(unusual, [&serde_json::Value::from(6)]);
    // Known before, not known where it went, and nobody is thirty metres further.
    assert_eq!((&lines[5]["state"] == "located", &lines[6]["state"] == "located"), (true, false));
}

#[test]
fn the_walk_goes_to_files_and_the_standard_output() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    said(folder, &["building", "generate", "twin", "twin.geojson"]);
    let georeference = Georeference::Geographic { origin: [16.37, 48.2], rotation_deg: 0.0 };
    write_building(folder, "vienna.geojson", &Building { georeference, ..generate::twin(2) });
    write_steps(folder, "walk.mcap", steps(12));
    let lines = said(folder, &replay("twin.geojson", CORRIDOR, &["--places", "-"]));
    let places: Vec<serde_json::Value> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(places.len(), 13, "nothing else is on the standard output");
    assert!(places.iter().all(|place| place["event"] == "place"));
    let covariance = &places[12]["places"][0]["covariance_m2"];
    assert!(covariance[0][0].as_f64().expect("a number") > 0.0 && covariance[0][1] == covariance[1][0], "{covariance}");

    let told = refused(folder, &replay("twin.geojson", CORRIDOR, &["--track", "way.gpx"]));
    assert!(told.contains("GPX is made of longitude and latitude") && told.contains("write .geojson"), "{told}");
    assert!(refused(folder, &replay("twin.geojson", CORRIDOR, &["--track", "way.kml"])).contains(".geojson or .gpx"));
    let tracks = ["--track", "way.gpx", "--track", "way.geojson", "--places", "said.jsonl"];
    said(folder, &replay("vienna.geojson", CORRIDOR, &tracks));
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("it was written");
    assert_eq!(read("said.jsonl"), read("out/places.jsonl"));
    let track = gpx::read(read("way.gpx").as_bytes()).expect("it is GPX");
    let corrected = &track.tracks[1].segments[0].points;
    assert_eq!((track.tracks.len(), corrected.len()), (2, 13));
    // 14.4 m to the east in Vienna; a degree of longitude has 74.3 km there.
    let east = corrected[12].point().x() - corrected[0].point().x();
    assert!((east * 74_300.0 - 14.4).abs() < 0.6, "{east}");
    let way: serde_json::Value = serde_json::from_str(&read("way.geojson")).expect("JSON");
    assert!(way["crs_note"].as_str().expect("text").starts_with("WGS84"));
    let end = last_place(folder);
    let lon = end["places"][0]["lon_lat"][0].as_f64().expect("a number");
    assert!((lon - corrected[12].point().x()).abs() < 1e-5, "{end}");
    let alone = refused(folder, &["replay", "walk.mcap", "--track", "way.gpx"]);
    assert!(alone.contains("--track needs a building"), "{alone}");
}

#[test]
fn the_recording_shows_plan_place_and_particles() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path();
    said(folder, &["building", "generate", "twin", "twin.geojson"]);
    write_steps(folder, "walk.mcap", steps(12));
    said(folder, &replay("twin.geojson", CORRIDOR, &[]));
    let bytes = std::fs::read(folder.join("out/recording.mcap")).expect("it was written");
    let mut counts = std::collections::BTreeMap::new();
    for message in ::mcap::MessageStream::new(&bytes).expect("it is MCAP") {
        let channel = message.expect("a message").channel;
        let schema = channel.schema.as_ref().map(|schema| schema.name.clone());
        *counts.entry((channel.topic.clone(), schema)).or_insert(0) += 1;
    }
    for (topic, schema, count) in [
        ("/building", Some("visualization_msgs/msg/MarkerArray"), 1),
        ("/place", Some("geometry_msgs/msg/PoseWithCovarianceStamped"), 13),
        ("/particles", Some("sensor_msgs/msg/PointCloud2"), 13),
        ("/place/line", None, 13),
        ("/step", Some("sohle/msg/StepWithCounts"), 13),
    ] {
        assert_eq!(counts.get(&(topic.to_owned(), schema.map(str::to_owned))), Some(&count), "{topic}: {counts:?}");
    }
    said(folder, &["replay", "out/recording.mcap", "--out", "again"]);
}
