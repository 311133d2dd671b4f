//! The window where there is nothing to show it on, and nothing to draw it with.

use crate::command::{program, refused, said};
use std::path::Path;
use std::process::{Command, Output};

const TWIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../buildings/twin.geojson");
/// Drawing is done by this: of a system that this one is not, so that there is nothing to draw with.
const ELSEWHERE: (&str, &str) = ("WGPU_BACKEND", if cfg!(windows) { "metal" } else { "dx12" });

fn walk(folder: &Path) {
    said(folder, &["simulate", "--building", TWIN, "--route", "W02,hall", "--out", "walk.mcap"]);
}

fn run(mut command: Command, folder: &Path, arguments: &[&str]) -> Output {
    command.args(arguments).current_dir(folder).output().expect("it starts")
}

#[test]
fn without_a_display_there_is_no_window_and_a_word_on_what_there_is_instead() {
    let home = tempfile::tempdir().unwrap();
    let told = refused(home.path(), &["window"]);
    assert!(told.contains("there is no display") && told.contains("--picture FILE.png"), "{told}");
}

#[test]
fn with_nothing_to_draw_with_there_is_no_picture_and_all_else() {
    let home = tempfile::tempdir().unwrap();
    walk(home.path());
    let blind = || {
        let mut command = program();
        command.env(ELSEWHERE.0, ELSEWHERE.1);
        command
    };
    for arguments in [&["window", "walk.mcap", "--picture", "walk.png"][..], &["window", "--measure"]] {
        let output = run(blind(), home.path(), arguments);
        let told = String::from_utf8(output.stderr).unwrap();
        let clear = told.contains("nothing here can draw") && told.contains("mesa-vulkan-drivers");
        assert!(output.status.code() == Some(1) && told.lines().count() == 1 && clear, "{arguments:?}: {told}");
    }
    assert!(!home.path().join("walk.png").exists());
    let output = run(blind(), home.path(), &["replay", "walk.mcap", "--building", TWIN, "--out", "out"]);
    assert!(output.status.success() && home.path().join("out/places.jsonl").exists(), "{output:?}");
}
