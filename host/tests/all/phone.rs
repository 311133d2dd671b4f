//! Recorded walks with a phone, as the command scores and follows them.

use crate::command::program;
use sohle::building::open::{Options, open};
use sohle::evaluation::phone::{path::Path, walk};
use sohle::phone;
use sohle::recording::recordings_dir;

/// Whether the recordings are there.
fn recorded() -> bool {
    let found = recordings_dir().is_some_and(|folder| folder.join("hcu_hamburg").exists());
    if !found {
        println!("skipped: no recordings");
    }
    found
}

#[test]
fn the_suite_prints_the_table_that_is_kept_and_reaches_its_goals() {
    if !recorded() {
        return;
    }
    let output = program().args(["evaluate", "--suite", "phone"]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let printed = String::from_utf8(output.stdout).unwrap();
    let kept = include_str!("../../../tests/phone.txt");
    assert_eq!(printed, kept, "if that is meant: sohle evaluate --suite phone > tests/phone.txt");
    // The columns after the name: way, steps, documented (two), default (two), live, corrected, and from an unknown start.
    let row = |name: &str| -> Vec<f64> {
        let line = kept.lines().find_map(|line| line.strip_prefix(name)).unwrap();
        line.split_whitespace().map_while(|word| word.parse().ok()).collect()
    };
    let eight = row("hcu eight");
    let (live, unknown) = (eight[6], eight[9]);
    assert!(live <= 0.9 && unknown <= 1.2, "{eight:?}");
    assert!(row("mall F1 a")[6] <= 1.5);
    for name in ["hcu eight", "mall F1 a", "mall F1 b", "mall F4 a", "mall F4 b", "mall F4 c"] {
        let row = row(name);
        assert!(row[4] < row[2], "the document's length is better alone in {name}: {row:?}");
    }
}

#[test]
fn steps_of_the_surveyed_walk_are_found_and_have_their_length() {
    if !recorded() {
        return;
    }
    let walks = walk::all().unwrap();
    let eight = &walks[0];
    let path = Path::of(&phone::steps(&eight.samples, &phone::Parameters::default()));
    // The three first way-points lie on a straight corridor of 24.2 m.
    let [from, to] = [0, 2].map(|index| path.at(eight.way_points[index].time).unwrap());
    let walked = (to[0] - from[0]).hypot(to[1] - from[1]);
    // The first half step and the stand before it are within a metre.
    assert!((walked - 24.2).abs() < 1.2, "{walked}");
}

#[test]
fn a_floor_without_a_drawn_edge_ends_where_its_rooms_end() {
    if !recorded() {
        return;
    }
    let plan = recordings_dir().unwrap().join("hcu_hamburg/floorplans/4OG.geojson");
    let building = open(&plan, &Options::default()).unwrap();
    // The hall 4 F06 has no facade to the court between the wings: from (97, 45) m to (103, 55) m and to (120, 41) m.
    let crosses = |a: [f64; 2], b: [f64; 2]| {
        building.floors[0].walls.iter().any(|wall| sohle::building::geometry::crossing(wall, &[a, b]).is_some())
    };
    assert!(crosses([97.0, 50.0], [104.0, 48.0]) && crosses([108.0, 41.0], [109.0, 46.0]));
    // And the corridor that was walked stays open.
    assert!(!crosses([60.0, 28.7], [70.0, 31.5]));
}

#[test]
fn a_recording_of_a_phone_is_replayed_in_a_building() {
    if !recorded() {
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let folder = recordings_dir().unwrap().join("hcu_hamburg");
    let replay = |more: &[&str]| {
        let mut command = program();
        command.current_dir(home.path()).arg("replay").arg(folder.join("eight_walk")).args(["--out", "out"]);
        command.arg("--building").arg(folder.join("floorplans/4OG.geojson")).args(["--start", "4,76.7,33.4,-164"]);
        command.args(more).output().unwrap()
    };
    let output = replay(&["--compare"]);
    assert!(output.status.success(), "{output:?}");
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("in 4OG: located at the end"), "{told}");
    for name in ["track.png", "steps.csv", "steps_documented.csv", "places.jsonl", "floor4.png"] {
        assert!(home.path().join("out").join(name).is_file(), "{name}");
    }
    // The walk ends where it began; a metre is what the walk is known to there.
    let last = std::fs::read_to_string(home.path().join("out/places.jsonl")).unwrap();
    let last: serde_json::Value = serde_json::from_str(last.lines().last().unwrap()).unwrap();
    let place = &last["places"][0]["position_m"];
    let [x, y] = [0, 1].map(|axis| place[axis].as_f64().unwrap());
    assert!((x - 76.7).hypot(y - 33.4) < 1.5, "{place}");
    // What was written of it says the same again, by the settings of a phone.
    let again = program()
        .current_dir(home.path())
        .args(["replay", "out/recording.mcap", "--out", "again", "--start", "4,76.7,33.4,-164", "--building"])
        .arg(folder.join("floorplans/4OG.geojson"))
        .output()
        .unwrap();
    assert!(again.status.success(), "{again:?}");
    let places = |name: &str| std::fs::read_to_string(home.path().join(name).join("places.jsonl")).unwrap();
    assert_eq!(places("again"), places("out"));
    let refused = replay(&["--profile", "xio"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8(refused.stderr).unwrap().contains("--profile is for recordings of a shoe"));
}

#[test]
fn without_the_recordings_the_suite_says_so() {
    let home = tempfile::tempdir().unwrap();
    let output =
        program().args(["evaluate", "--suite", "phone"]).env("SOHLE_RECORDINGS", home.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("hcu_hamburg/eight_walk is not there"), "{told}");
}
