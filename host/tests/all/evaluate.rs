//! `sohle evaluate` as a researcher uses it: recordings of one's own, a manifest, no Rust.
#![expect(clippy::unwrap_used, reason = "the helpers of a test are part of it")]

use crate::command::program;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::Output;

const STRIDES: usize = 20;
const STANDING_S: f64 = 3.0;
const STRIDE_S: f64 = 1.1;
const SWING_S: f64 = 0.6;
const STRIDE_M: f64 = 1.3;
const RATE_HZ: f64 = 200.0;

/// Part of a swing that lies behind the foot at `time`, and how many strides are complete; 0 in stance.
fn gait(time: f64) -> (f64, f64) {
    let walked = (time - STANDING_S) / STRIDE_S;
    if walked < 0.0 {
        return (0.0, 0.0);
    }
    if walked >= STRIDES as f64 {
        return (STRIDES as f64, 0.0);
    }
    (
        walked.floor(),
        (walked.fract() * STRIDE_S / SWING_S).min(1.0) % 1.0
            + f64::from(u8::from(walked.fract() * STRIDE_S >= SWING_S)),
    )
}

/// Position ahead, height and pitch of the foot. A swing lifts and pitches it; all come to rest smoothly.
fn pose(time: f64) -> [f64; 3] {
    let (strides, part) = gait(time);
    let smooth = part * part * part * (10.0 - 15.0 * part + 6.0 * part * part);
    let bump = (std::f64::consts::PI * part).sin().powi(4);
    let pitch = 0.9 * (std::f64::consts::TAU * part).sin() * (std::f64::consts::PI * part).sin().powi(2);
    [STRIDE_M * (strides + smooth), 0.12 * bump, pitch]
}

/// Writes a walk straight ahead as a stranger might: milliseconds, g, deg/s, semicolons; and its survey in millimetres.
fn write_walk(folder: &Path) {
    let duration = 2.0 * STANDING_S + STRIDES as f64 * STRIDE_S;
    let step = 1.0 / RATE_HZ;
    let mut samples = String::from("clock;ax;ay;az;gx;gy;gz\n");
    for k in 0..(duration * RATE_HZ) as usize {
        let time = k as f64 * step;
        let [before, now, after] = [-step, 0.0, step].map(|offset| pose(time + offset));
        let second = |axis: usize| (before[axis] - 2.0 * now[axis] + after[axis]) / (step * step);
        let (ahead, up) = (second(0), second(1) + 9.806_65);
        let (sin, cos) = now[2].sin_cos();
        // Pitch is a turn about the left axis y, nose down positive.
        let accel = [cos * ahead - sin * up, 0.0, sin * ahead + cos * up].map(|value| value / 9.806_65);
        let rate = ((after[2] - before[2]) / (2.0 * step)).to_degrees();
        let _ = writeln!(
            samples,
            "{:.3};{:.6};{:.6};{:.6};0.01;{:.5};-0.01",
            1e3 * time,
            accel[0],
            accel[1],
            accel[2],
            rate
        );
    }
    std::fs::write(folder.join("walk.csv"), samples).unwrap();
    let mut survey = String::from("% surveyed on a Monday\nclock,east,north\n");
    for k in 0..=STRIDES {
        // The last moment before push-off; the last stance is seen half a second after landing.
        let time = STANDING_S + k as f64 * STRIDE_S - if k == 0 { 0.01 } else { 0.05 };
        let _ =
            writeln!(survey, "{:.1},{:.1},{:.1}", 1e3 * time, 600.0 * STRIDE_M * k as f64, 800.0 * STRIDE_M * k as f64);
    }
    std::fs::write(folder.join("survey.csv"), survey).unwrap();
}

const MANIFEST: &str = r#"
[[recording]]
name = "mine"
path = "walk.csv"
[recording.mapping]
separator = ";"
time = "clock"
time_unit = "ms"
accel = ["ax", "ay", "az"]
accel_unit = "g"
gyro = ["gx", "gy", "gz"]
gyro_unit = "deg/s"
[recording.truth]
height_change_m = 0.0
stride_count = 20
[recording.truth.positions]
path = "survey.csv"
layout = { comment = "%" }
at = { time = "clock", time_unit = "ms" }
x = "east"
y = "north"
unit = "mm"

[[recording]]
name = "lost"
path = "lost.csv"
truth = { closed_loop = true }

[[group]]
name = "all"
recordings = ["mine", "lost"]
figures = [{ metric = "rigid_rmse_m", statistic = "worst", must = 0.3, aim = 0.1 }]
"#;

fn evaluate(folder: &Path, manifest: &str, more: &[&str]) -> Output {
    std::fs::write(folder.join("manifest.toml"), manifest).unwrap();
    let mut command = program();
    command.arg("evaluate").arg("--manifest").arg(folder.join("manifest.toml")).args(more);
    command.env_remove("SOHLE_RECORDINGS").output().unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| {
        panic!("{error}: {} {}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
    })
}

/// The one line that a refused manifest ends with.
fn refusal(folder: &Path, manifest: &str) -> String {
    let output = evaluate(folder, manifest, &[]);
    assert!(!output.status.success(), "{manifest}");
    let text = String::from_utf8(output.stderr).unwrap();
    text.lines().last().unwrap_or_default().to_owned()
}

#[test]
fn a_manifest_is_enough_to_score_a_walk_of_ones_own() {
    let folder = tempfile::tempdir().unwrap();
    write_walk(folder.path());
    let output = evaluate(folder.path(), MANIFEST, &["--format", "json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report = json(&output);
    let recordings = report["recordings"].as_array().unwrap();
    let of = |name: &str, settings: &str| {
        recordings.iter().find(|entry| entry["name"] == name && entry["settings"] == settings).unwrap()
    };
    for settings in ["default", "documented"] {
        let mine = of("mine", settings);
        assert_eq!(mine["status"], "scored");
        assert_eq!(mine["metrics"]["stances_true"], 21);
        assert_eq!(mine["metrics"]["stride_count_true"], 20);
        assert!(mine["metrics"].get("closure_3d_m").is_none(), "its truth does not allow it");
        // 20 strides of 1.3 m; the survey is rounded to 0.1 mm.
        assert!((mine["metrics"]["truth_distance_m"].as_f64().unwrap() - 26.0).abs() < 1e-3);
        assert_eq!(of("lost", settings)["status"], "skipped");
        assert_eq!(of("lost", settings)["reason"], "lost.csv: no such file");
    }
    let mine = of("mine", "default");
    assert_eq!(mine["steps"], 20);
    assert_eq!(mine["metrics"]["stances_missed"], 0);
    assert_eq!(mine["metrics"]["stances_invented"], 0);
    // Noiseless samples of a smooth walk: what is left is integration at 200 Hz, millimetres a stride.
    assert!(mine["metrics"]["rigid_rmse_m"].as_f64().unwrap() < 0.1, "{mine}");
    assert_eq!(report["summary"]["scored"], 1);
    assert_eq!(report["summary"]["skipped"], serde_json::json!(["lost"]));
    assert_eq!(report["groups"][0]["recordings_used"], 1);
    assert_eq!(report["outputs_hash"].as_str().unwrap().len(), 64);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    write_walk(folder.path());
    let one = evaluate(folder.path(), MANIFEST, &["--format", "json", "--threads", "1"]);
    let two = evaluate(folder.path(), MANIFEST, &["--format", "json", "--threads", "2"]);
    assert_eq!(json(&one)["outputs_hash"], json(&two)["outputs_hash"]);
    assert_eq!(one.stdout, two.stdout);
}

#[test]
fn tables_for_people_and_for_spreadsheets() {
    let folder = tempfile::tempdir().unwrap();
    write_walk(folder.path());
    let table = evaluate(folder.path(), MANIFEST, &["--perturb", "upside-down"]);
    let table = String::from_utf8(table.stdout).unwrap();
    for part in ["1 of 2 recordings ran; skipped: lost", "lost skipped: lost.csv: no such file", "upside-down"] {
        assert!(table.contains(part), "no '{part}' in\n{table}");
    }
    let csv =
        String::from_utf8(evaluate(folder.path(), MANIFEST, &["--format", "csv", "--only", "mine"]).stdout).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 3);
    let width = lines[0].split(',').count();
    assert!(lines.iter().all(|line| line.split(',').count() == width), "{csv}");
}

#[test]
fn a_recording_that_cannot_be_scored_is_told_and_the_others_still_run() {
    let folder = tempfile::tempdir().unwrap();
    write_walk(folder.path());
    for (from, to, reason) in [
        ("\"survey.csv\"", "\"survey2.csv\"", "truth survey2.csv: no such file"),
        ("\"east\"", "\"easting\"", "no column 'easting'; the file has: clock, east, north"),
        (
            "time = \"clock\", time_unit = \"ms\" }",
            "time = \"clock\" }",
            "lies outside of the recording, 0.000 s to 27.995 s",
        ),
        (
            "time = \"clock\", time_unit = \"ms\" }",
            "index = \"clock\" }",
            "is no sample of the recording, which has 0 to 5599",
        ),
        ("accel_unit = \"g\"", "accel_unit = \"m/s2\"", "is this in g?"),
    ] {
        let manifest = MANIFEST.replace(from, to);
        assert_ne!(manifest, MANIFEST);
        let output = evaluate(folder.path(), &manifest, &["--format", "json"]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{to}");
        assert_eq!(stderr.lines().last(), Some("error: 1 recordings failed: mine"), "{stderr}");
        let told = json(&output)["recordings"][0]["reason"].as_str().unwrap().to_owned();
        assert!(told.contains(reason), "{told}");
    }
}

#[test]
fn a_wrong_manifest_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    write_walk(folder.path());
    for (from, to, part) in [
        ("height_change_m", "height", "line 14: unknown field `height`, expected one of `positions`, "),
        ("\"rigid_rmse_m\"", "\"rmse\"", "'rmse' is no metric; known: rigid_rmse_m, "),
        ("\"worst\"", "\"best\"", "unknown variant `best`, expected one of `median`, `mean`, `worst`, `sum`"),
        ("\"mine\", \"lost\"", "\"yours\"", "group 'all': no recording 'yours'; known: mine, lost"),
        ("\"lost\"\n", "\"mine\"\n", "recording 'mine': the name is used twice"),
        (
            "time = \"clock\", time_unit = \"ms\" }",
            "rate_hz = 1.0, index = \"n\" }",
            "truth.positions.at: give one of time, index and rate_hz",
        ),
        ("separator = \";\"", "profile = \"xsens\"", "unknown field `profile`"),
        (
            "path = \"walk.csv\"",
            "path = \"walk.csv\"\nprofile = \"xsens\"",
            "recording 'mine': unknown profile 'xsens'; known: ",
        ),
        ("unit = \"mm\"", "unit = \"inch\"", "unknown variant `inch`"),
        ("closed_loop = true", "same_height_as = \"left\"", "same_height_as = 'left' is no other recording"),
        ("closed_loop = true", "closed_loop = yes", "line 27: "),
        (
            "path = \"lost.csv\"",
            "simulate = { detector_test = \"d run\" }",
            "recording 'lost': simulate: 'd run' is no detector test; known: a normal, ",
        ),
        ("path = \"lost.csv\"", "simulate = { scenario = \"x.toml\" }", "recording 'lost': simulate: scenario "),
        ("path = \"lost.csv\"", "about = \"?\"", "recording 'lost': give either a path or simulate"),
    ] {
        let manifest = MANIFEST.replace(from, to);
        assert_ne!(manifest, MANIFEST, "{from}");
        let told = refusal(folder.path(), &manifest);
        assert!(told.starts_with("error: manifest ") && told.contains(part), "{to}: {told}");
    }
    assert!(refusal(folder.path(), "# nothing\n").ends_with("manifest.toml: lists no [[recording]]"));
    let output = evaluate(folder.path(), MANIFEST, &["--only", "yours"]);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("no recording 'yours' in the manifest; known: mine, lost")
    );
}
