//! The program from outside: exit codes, the lines it says, the files it leaves.

#![allow(clippy::unwrap_used, reason = "a test that cannot run its program has failed")]

use crate::command::sohle;
use geojson::GeoJson;
use resvg::usvg;
use std::path::Path;
use std::process::Output;

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

/// The one line an unsuccessful run ends with.
#[track_caller]
fn refusal(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = sohle(folder, arguments);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(told.starts_with("error: "), "{told}");
    assert!(output.stdout.is_empty());
    told
}

/// Names of what lies in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn version_and_help_go_to_the_standard_output() {
    let home = tempfile::tempdir().unwrap();
    let version = sohle(home.path(), &["--version"]);
    assert!(version.status.success());
    assert_eq!(stdout(&version), format!("sohle {}\n", env!("CARGO_PKG_VERSION")));
    let help = sohle(home.path(), &["--help"]);
    assert!(help.status.success());
    for command in ["demo", "replay", "calibrate", "parameters"] {
        assert!(stdout(&help).contains(command), "{command}");
        let help = sohle(home.path(), &[command, "--help"]);
        assert!(help.status.success() && stdout(&help).contains("Example"), "{command}");
    }
}

#[test]
fn a_wrong_command_line_is_one_line_and_code_2() {
    let home = tempfile::tempdir().unwrap();
    assert!(refusal(home.path(), &["replay"], 2).contains("<FILE>"));
    assert!(refusal(home.path(), &["replay", "a.csv", "--owt", "b"], 2).contains("--owt"));
    assert!(refusal(home.path(), &["wander"], 2).contains("wander"));
    assert!(refusal(home.path(), &["evaluate", "--suite", "building", "--walks", "0"], 2).contains("from 1 on"));
    assert!(refusal(home.path(), &["demo", "--seed", "many"], 2).contains("many"));
    assert!(refusal(home.path(), &["replay", "a.csv", "--origin", "91,0"], 2).contains("LAT,LON"));
    assert!(names(home.path()).is_empty());
}

#[test]
fn what_cannot_be_replayed_is_one_line_and_leaves_nothing() {
    let home = tempfile::tempdir().unwrap();
    std::fs::create_dir(home.path().join("folder")).unwrap();
    std::fs::write(home.path().join("empty.csv"), "").unwrap();
    std::fs::write(home.path().join("noise.bin"), [0_u8, 159, 146, 150, 255]).unwrap();
    std::fs::write(home.path().join("bad.toml"), "\nshoe_size = 43\n").unwrap();
    let before = names(home.path());
    assert!(refusal(home.path(), &["replay", "absent.csv"], 1).contains("absent.csv"));
    assert!(refusal(home.path(), &["replay", "folder"], 1).contains("folder"));
    assert!(refusal(home.path(), &["replay", "empty.csv"], 1).contains("empty.csv"));
    assert!(refusal(home.path(), &["replay", "noise.bin"], 1).contains("noise.bin"));
    let told = refusal(home.path(), &["replay", "empty.csv", "--parameters", "bad.toml"], 1);
    assert!(told.contains("bad.toml, line 2") && told.contains("shoe_size"), "{told}");
    assert!(refusal(home.path(), &["replay", "empty.csv", "--parameters", "absent.toml"], 1).contains("absent.toml"));
    assert!(refusal(home.path(), &["replay", "empty.csv", "--profile", "nobody's"], 1).contains("nobody's"));
    assert_eq!(names(home.path()), before);
}

/// What every tracked walk leaves.
const FILES: [&str; 6] = ["parameters.toml", "recording.mcap", "steps.csv", "track.geojson", "track.png", "track.svg"];
/// What a comparison adds.
/// And of who is followed through a building of two floors.
const PLACES: [&str; 5] = ["floor0.png", "floor0.svg", "floor1.png", "floor1.svg", "places.jsonl"];
const DOCUMENTED: [&str; 2] = ["parameters_documented.toml", "steps_documented.csv"];

fn sorted(names: impl IntoIterator<Item = &'static str>) -> Vec<String> {
    let mut names: Vec<_> = names.into_iter().map(String::from).collect();
    names.sort();
    names
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn the_demo_needs_no_arguments_and_its_outputs_can_be_read() {
    let home = tempfile::tempdir().unwrap();
    let output = sohle(home.path(), &[]);
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "no progress bar where there is no terminal");
    let told = stdout(&output);
    for word in ["default", "documented", "truth", "missed", "end error", "height error", "time taken"] {
        assert!(told.contains(word), "{word}: {told}");
    }
    assert!(told.contains("sohle-out/demo"));
    let folder = home.path().join("sohle-out/demo");
    assert_eq!(names(&folder), sorted(FILES.into_iter().chain(DOCUMENTED).chain(PLACES)));
    assert!(told.contains("in Twin: located at the end") && told.contains("while located"), "{told}");

    assert!(usvg::Tree::from_str(&read(&folder, "track.svg"), &usvg::Options::default()).is_ok());
    assert!(std::fs::read(folder.join("track.png")).unwrap().starts_with(b"\x89PNG"));
    let features = match read(&folder, "track.geojson").parse().unwrap() {
        GeoJson::FeatureCollection(collection) => collection.features,
        other => panic!("{other}"),
    };
    let rows = |name: &str| csv::Reader::from_reader(read(&folder, name).as_bytes()).records().count();
    let (chosen, documented) = (rows("steps.csv"), rows("steps_documented.csv"));
    // 158 strides; how many are found exactly is what the evaluation tells.
    assert!(chosen > 144, "{chosen} steps");
    // A line of one point is none.
    let lines = 1 + [chosen, documented].into_iter().filter(|&steps| steps > 1).count();
    assert_eq!(features.len(), lines + chosen + documented, "a line for each track and a point for each stance");
}

#[test]
fn the_same_demo_writes_the_same_bytes_and_its_recording_gives_the_same_track() {
    let home = tempfile::tempdir().unwrap();
    for out in ["a", "b"] {
        let output = sohle(home.path(), &["demo", "--headless", "--quiet", "--seed", "3", "--out", out]);
        assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
    }
    let (a, b, c) = (home.path().join("a"), home.path().join("b"), home.path().join("c"));
    for name in names(&a) {
        assert!(std::fs::read(a.join(&name)).unwrap() == std::fs::read(b.join(&name)).unwrap(), "{name}");
    }
    let twin = Path::new(env!("CARGO_MANIFEST_DIR")).join("../buildings/twin.geojson");
    let replay = ["replay", "a/recording.mcap", "--building", twin.to_str().unwrap(), "--out", "c"];
    let replayed = sohle(home.path(), &replay);
    assert!(replayed.status.success());
    assert!(stdout(&replayed).contains("truth"));
    // The building that the program brings along is the one in the folder.
    for name in ["steps.csv", "recording.mcap", "places.jsonl", "floor0.svg", "floor1.svg"] {
        assert!(std::fs::read(a.join(name)).unwrap() == std::fs::read(c.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn the_demo_can_leave_its_building_and_walk_elsewhere() {
    let home = tempfile::tempdir().unwrap();
    let output = sohle(home.path(), &["demo", "--no-building", "--quiet", "--out", "free"]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(names(&home.path().join("free")), sorted(FILES.into_iter().chain(DOCUMENTED)));
    let walk = ["demo", "--route", "W02,hall", "--start", "W02", "--track", "way.geojson", "--out", "short"];
    let output = sohle(home.path(), &walk);
    assert!(stdout(&output).contains("located at the end"), "{output:?}");
    assert!(matches!(read(home.path(), "way.geojson").parse(), Ok(GeoJson::FeatureCollection(_))));
    assert!(refusal(home.path(), &["demo", "--no-building", "--start", "W02"], 2).contains("--no-building"));
    assert!(refusal(home.path(), &["demo", "--building", "a.geojson"], 2).contains("--route"));
}

#[test]
fn a_recording_is_replayed_with_settings_of_ones_own() {
    let Some(recordings) = sohle::recording::recordings_dir() else { return };
    let home = tempfile::tempdir().unwrap();
    let printed = sohle(home.path(), &["parameters"]);
    std::fs::write(home.path().join("mine.toml"), &printed.stdout).unwrap();
    let walk = recordings.join("foot_xio/short_walk.csv");
    let replay = ["replay", walk.to_str().unwrap(), "--parameters", "mine.toml", "--origin", "51.45,-2.6,0"];
    let output = sohle(home.path(), &replay);
    assert!(output.status.success(), "{output:?}");
    assert!(stdout(&output).contains("mine"));
    let folder = home.path().join("sohle-out/short_walk");
    assert_eq!(names(&folder), sorted(FILES));
    assert_eq!(read(&folder, "parameters.toml").as_bytes(), printed.stdout);
    assert!(read(&folder, "track.geojson").contains("\"crs_note\":\"WGS84"));
}

#[test]
fn a_calibrated_sensor_is_replayed_and_the_calibration_stays_with_the_result() {
    let home = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = sohle(home.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        stdout(&output).to_owned()
    };
    run(&["simulate", "--preset", "calibration", "--seed", "3", "--out", "rests.mcap"]);
    run(&["simulate", "--gait", "walk", "--strides", "8", "--seed", "3", "--out", "walk.mcap"]);
    let told = run(&["calibrate", "rests.mcap", "--out", "unit.toml", "--gravity-at", "45.51"]);
    assert_eq!(told.matches(" up: taken as pose ").count(), 12, "{told}");
    assert!(told.contains("The sensor is good. Gravity was taken as 9.8067 m/s²"), "{told}");
    assert!(run(&["calibrate", "rests.mcap", "-q"]).is_empty());
    let default = home.path().join("sohle-out/rests");
    assert_eq!(names(&default), ["calibration.toml"]);

    run(&["replay", "walk.mcap", "--out", "raw"]);
    let told = run(&["replay", "walk.mcap", "--calibration", "unit.toml", "--out", "corrected"]);
    assert!(told.contains("calibration: good"), "{told}");
    let (raw, corrected) = (home.path().join("raw"), home.path().join("corrected"));
    assert_ne!(read(&raw, "steps.csv"), read(&corrected, "steps.csv"));
    assert_eq!(read(&corrected, "calibration.toml"), read(home.path(), "unit.toml"));
    assert!(!names(&raw).contains(&"calibration.toml".to_owned()));
    // The samples stay as measured, so that nobody corrects them twice.
    let recorded = |folder: &Path| sohle::recording::open(&folder.join("recording.mcap"), None).unwrap();
    let (raw, corrected) = (recorded(&raw), recorded(&corrected));
    assert_eq!(raw.samples, corrected.samples);
    assert_eq!(corrected.metadata["calibration"], read(home.path(), "unit.toml"));
    run(&["replay", "corrected/recording.mcap", "--out", "again"]);
    assert!(!recorded(&home.path().join("again")).metadata.contains_key("calibration"));

    let told = refusal(home.path(), &["calibrate", "walk.mcap", "--quiet"], 1);
    assert!(told.contains("walk.mcap: 1 of 12 poses were taken, at least 6 are needed"), "{told}");
    assert!(!home.path().join("sohle-out/walk").exists());
    std::fs::write(home.path().join("bad.toml"), "\nshoe_size = 43\n").unwrap();
    let told = refusal(home.path(), &["replay", "walk.mcap", "--calibration", "bad.toml"], 1);
    assert!(told.contains("calibration file bad.toml, line 2") && told.contains("shoe_size"), "{told}");
    assert!(refusal(home.path(), &["calibrate", "rests.mcap", "--gravity", "981"], 2).contains("9.7 to 9.9"));
    assert!(refusal(home.path(), &["calibrate", "rests.mcap", "--gravity-at", "x"], 2).contains("LAT,HEIGHT_M"));
}

#[test]
fn outputs_that_cannot_be_written_are_told() {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("taken"), "mine").unwrap();
    assert!(refusal(home.path(), &["demo", "--out", "taken/demo"], 1).contains("taken/demo"));
    assert!(refusal(home.path(), &["demo", "--out", "taken"], 1).contains("taken"));
    assert_eq!(read(home.path(), "taken"), "mine");
}
