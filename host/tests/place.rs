//! From a building to a walk in it, and from the walk back to the place, as a user does it.

use std::path::Path;
use std::process::{Command, Output};

fn sohle(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sohle")).args(arguments).current_dir(folder).output().expect("it starts")
}

/// Runs a command that must succeed; what it says.
#[track_caller]
fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = sohle(folder, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it is text")
}

/// Runs a command that must fail with one line; the line.
#[track_caller]
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = sohle(folder, arguments);
    let told = String::from_utf8(output.stderr).expect("it is text");
    assert_eq!((output.status.code(), told.lines().count()), (Some(1), 1), "{told}");
    told
}

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
    assert!(replay("somewhere").contains("expected anywhere, entrances, the name of a room"));
    assert!(!folder.join("out").exists());
}
