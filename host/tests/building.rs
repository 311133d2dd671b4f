//! `sohle building` from outside: exit codes, what it says, the files it leaves.

#![allow(clippy::unwrap_used, reason = "a test that cannot run its program has failed")]

use std::path::Path;
use std::process::{Command, Output};

fn sohle(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sohle")).arg("building").args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = sohle(folder, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn refused(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = sohle(folder, arguments);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), told.lines().count()), (Some(code), 1), "{told}");
    told
}

#[test]
fn a_made_building_is_converted_and_shown() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path();
    assert!(said(folder, &["generate", "twin", "twin.geojson"]).contains("52.0 x 19.8"));
    assert!(refused(folder, &["generate", "twin", "twin.geojson"], 1).contains("--force"));
    assert!(refused(folder, &["generate", "twin", "--seed", "2", "a.geojson"], 1).contains("of 'large' only"));
    said(folder, &["convert", "twin.geojson", "again.geojson"]);
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    assert_eq!(read("twin.geojson"), read("again.geojson"));
    said(folder, &["show", "twin.geojson", "--floor", "1", "--out", "pictures"]);
    assert!(read("pictures/floor1.svg").starts_with("<svg") && !folder.join("pictures/floor0.svg").exists());
    assert!(std::fs::read(folder.join("pictures/floor1.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(refused(folder, &["show", "twin.geojson", "--floor", "7"], 1).contains("the building has 0, 1"));
    assert!(refused(folder, &["show", "absent.geojson"], 1).contains("absent.geojson cannot be read"));
    assert!(refused(folder, &["convert", "twin.geojson", "twin.txt"], 1).contains(".geojson"));
    assert!(refused(folder, &["show", "twin.geojson", "--format", "paper"], 2).contains("paper"));
}

#[test]
fn the_check_ends_with_an_error_where_there_is_one_and_marks_it() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path();
    said(folder, &["generate", "twin", "twin.geojson"]);
    assert!(said(folder, &["check", "twin.geojson"]).ends_with("Twin: 0 errors, 0 warnings\n"));
    let text = std::fs::read_to_string(folder.join("twin.geojson")).unwrap();
    // Without the lines that hold the walls.
    let broken: Vec<_> = text.lines().filter(|line| !line.contains("\"wall\"")).collect();
    std::fs::write(folder.join("open.geojson"), broken.join("\n")).unwrap();
    let output = sohle(folder, &["check", "open.geojson", "--json", "--out", "marked"]);
    assert_eq!(output.status.code(), Some(1));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&told["errors"], &told["findings"][0]["kind"]), (&2.into(), &"no-walls".into()));
    assert!(folder.join("marked/floor0.svg").exists() && folder.join("marked/floor1.png").exists());
    let told = refused(folder, &["check", "open.geojson"], 1);
    assert_eq!(told, "error: open.geojson: 2 errors\n");
}
