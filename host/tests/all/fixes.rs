//! Steps with positions of other sources, from outside: the suite, good and bad lines, and what a recording keeps of them.

use crate::command::{self, program, said_and_warned, sohle};
use sohle::recording::{Recording, mcap, recordings_dir};
use sohle_shared::step::Step;
use std::path::Path;

/// Twenty strides of 1.2 m along the lower corridor of the twin, to the east from (4, 7.1) m.
fn steps() -> Vec<Step> {
    command::steps(20)
}

/// Where they lead, as a source tells it after each of them.
fn positions(source: &str, off_m: f64) -> String {
    let line = |(index, step): (usize, &Step)| {
        let (time, x) = (step.stance_end.0, 4.0 + 1.2 * index as f64);
        format!("{{\"time_us\":{time},\"source\":\"{source}\",\"position\":[{x},{}],\"sigma_m\":0.5}}\n", 7.1 + off_m)
    };
    steps().iter().enumerate().map(line).collect()
}

/// A folder with the walk, the twin of the document's building, and these positions.
fn prepared(lines: &str) -> tempfile::TempDir {
    let home = tempfile::tempdir().expect("a folder");
    let recording = Recording { name: "walk".into(), steps: steps(), ..Recording::default() };
    mcap::write(&home.path().join("walk.mcap"), &recording).expect("it can be written");
    said_and_warned(home.path(), &["building", "generate", "twin", "twin.geojson"]);
    std::fs::write(home.path().join("fixes.jsonl"), lines).expect("it can be written");
    home
}

/// The last line of the path of this kind.
fn last(folder: &Path, kind: &str) -> [f64; 2] {
    let text = std::fs::read_to_string(folder.join("out/fixes.csv")).expect("it was written");
    let line = text.lines().rfind(|line| line.starts_with(kind)).expect("a line");
    let cells: Vec<&str> = line.split(',').collect();
    [2, 3].map(|column| cells[column].parse().expect("a number"))
}

const IN_TWIN: [&str; 4] = ["--building", "twin.geojson", "--start", "0,4,7.1,0"];

#[test]
fn the_suite_prints_the_tables_that_are_kept_and_the_smoother_reaches_its_goals() {
    let recorded = |name: &str| recordings_dir().is_some_and(|folder| folder.join(name).exists());
    if !recorded("hcu_hamburg") || !recorded("ranging_hymn") {
        println!("skipped: no recordings");
        return;
    }
    let home = tempfile::tempdir().expect("a folder");
    let (printed, _) = said_and_warned(home.path(), &["evaluate", "--suite", "fixes"]);
    let kept = include_str!("../../../tests/fixes.txt");
    assert_eq!(printed, kept, "if that is meant: sohle evaluate --suite fixes > tests/fixes.txt");
    let rows = |table: &str, name: &str| -> Vec<Vec<String>> {
        let lines = kept.split(table).nth(1).expect("the table").lines().skip(1).take_while(|line| !line.is_empty());
        let cells = lines.filter_map(|line| line.strip_prefix(name).filter(|rest| rest.starts_with("  ")));
        cells.map(|rest| rest.split_whitespace().map(str::to_owned).collect()).collect()
    };
    let number = |text: &str| -> f64 { text.parse().expect("a number") };
    // Start, rate, RMSE.
    let eight = |name: &str, rate: &str| -> f64 {
        let rows = rows("hcu eight, steps and positions", name);
        number(&rows.iter().find(|row| row[0] == "known" && row[1] == rate).expect("the rate")[2])
    };
    for (rate, most) in [("1.000", 0.75), ("0.200", 1.0), ("0.100", 1.2)] {
        let corrected = eight("smoother, corrected", rate);
        assert!(corrected <= most && corrected < eight("extended", rate), "{rate}: {corrected}");
    }
    // The goals with the plan (0.6, 0.7, 0.8 m) are not reached; at least it is of use.
    for rate in ["1.000", "0.200", "0.100"] {
        assert!(eight("map, corrected", rate) < eight("smoother, corrected", rate), "{rate}");
    }
    // Sigma, extended, live, its 95 %, corrected; then the bounds and their means.
    let walks = |wrong: &str| rows("simulated walks, wrong with the positions", wrong);
    for (right, outlying) in walks("nothing").iter().zip(&walks("20 % outliers of 20 m")) {
        for figure in [2, 4] {
            assert!(number(&outlying[figure]) <= 1.3 * number(&right[figure]), "{right:?} {outlying:?}");
        }
        for mean in [5, 9] {
            let low = number(right[mean + 1].trim_start_matches('('));
            let high = number(right[mean + 3].trim_end_matches(')'));
            assert!((low..=high).contains(&number(&right[mean])), "{right:?}");
        }
    }
    let placed = |name: &str| number(&rows("place of one round of ranges", name)[0][1]);
    assert!(placed("with a tail") < placed("all believed alike"));
}

#[test]
fn without_the_recordings_the_suite_says_so() {
    let home = tempfile::tempdir().expect("a folder");
    let mut command = program();
    let output = command.args(["evaluate", "--suite", "fixes"]).env("SOHLE_RECORDINGS", home.path()).output();
    let output = output.expect("it starts");
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stderr).expect("it is text");
    assert!(told.contains("hcu_hamburg/eight_walk is not there"), "{told}");
}

#[test]
fn good_lines_place_a_walk_whose_start_nobody_knows() {
    let home = prepared(&positions("uwb", 0.0));
    let (told, err) = said_and_warned(home.path(), &["replay", "walk.mcap", "--fixes", "fixes.jsonl", "--out", "out"]);
    assert!(err.is_empty() && told.contains("positions of  all  taken"), "{told}{err}");
    for kind in ["said", "corrected"] {
        let [x, y] = last(home.path(), kind);
        assert!((x - 28.0).hypot(y - 7.1) < 0.5, "{kind} {x} {y}");
    }
}

#[test]
fn the_answer_is_that_of_the_plan_where_it_knows_one_and_of_the_positions_where_it_does_not() {
    let home = prepared(&positions("uwb", 0.0));
    let last = |start: &str| -> serde_json::Value {
        let replay = ["replay", "walk.mcap", "--fixes", "fixes.jsonl", "--out", "out", "--building", "twin.geojson"];
        said_and_warned(home.path(), &[&replay[..], &["--start", start]].concat());
        let lines = std::fs::read_to_string(home.path().join("out/places.jsonl")).expect("it was written");
        serde_json::from_str(lines.lines().last().expect("a line")).expect("JSON")
    };
    let known = last("0,4,7.1,0");
    assert_eq!((&known["state"], &known["answer"]), (&"located".into(), &"map".into()), "{known}");
    // The floors of the twin are alike, and the source does not name one.
    let unknown = last("anywhere");
    assert_eq!((&unknown["state"], &unknown["answer"]), (&"several_places".into(), &"positions".into()), "{unknown}");
    for place in [&known["positions"], &unknown["positions"]] {
        let [x, y] = [0, 1].map(|axis| place["position_m"][axis].as_f64().expect("a number"));
        assert!((x - 28.0).hypot(y - 7.1) < 0.5, "{place}");
    }
}

#[test]
fn each_bad_line_is_told_with_what_is_wrong_and_counted_and_the_rest_is_taken() {
    let bad = [
        (r#"{"time_us":5000000,"source":"uwb","frame":"EPSG:3857","position":[1,2],"sigma_m":1}"#, "frame EPSG:3857"),
        (r#"{"time_us":5000000,"source":"uwb","frame":"moon","position":[1,2],"sigma_m":1}"#, "the frame 'moon'"),
        (r#"{"time_us":5000000,"source":"uwb","frame":"EPSG:4326","position":[10,53],"sigma_m":1}"#, "no georeference"),
        (r#"{"time_us":5000000,"source":"uwb","position":[566578,5932830],"sigma_m":1}"#, "is it in another frame?"),
        (
            r#"{"time_us":5000000,"source":"uwb","position":[9,7],"sigma_m":1,"floor":9}"#,
            "floor 9 is not in the building",
        ),
        (
            r#"{"time_us":9000000,"arrived_us":5000000,"source":"uwb","position":[9,7],"sigma_m":1}"#,
            "4.0 s after it arrived",
        ),
        (r#"{"time_us":5000000,"source":"uwb","position":[9,7],"sigma_m":0}"#, "its covariance is none"),
        (r#"{"time_us":5000000,"source":"uwb","position":[9,7],"sigma_m":-1}"#, "its covariance is none"),
        (
            r#"{"time_us":5000000,"source":"uwb","position":[9,7],"covariance_m2":[[1,2],[2,1]]}"#,
            "its covariance is none",
        ),
        (r#"{"time_us":5000000,"position":[9,7],"sigma_m":1,"colour":"red"}"#, "unknown field `colour`"),
    ];
    let mut lines: String = bad.iter().map(|(line, _)| format!("{line}\n")).collect();
    lines += &positions("uwb", 0.0);
    let home = prepared(&lines);
    let replay = ["replay", "walk.mcap", "--fixes", "fixes.jsonl", "--out", "out"];
    let (told, err) = said_and_warned(home.path(), &[&replay[..], &IN_TWIN].concat());
    for ((line, what), (number, message)) in bad.iter().zip(err.lines().enumerate()) {
        let begins = format!("fixes.jsonl, line {}: ", number + 1);
        assert!(message.starts_with(&begins) && message.contains(what), "{line}: {message}");
        assert_eq!(message.matches("line").count(), 1, "{message}");
    }
    assert_eq!(err.lines().count(), bad.len(), "{err}");
    let row: Vec<&str> =
        told.lines().find_map(|line| line.strip_prefix("uwb ")).expect("a row").split_whitespace().collect();
    assert_eq!(row[..5], ["29", "21", "0", "0", "8"], "{told}");
    assert!(told.contains("2 lines were no fixes") && told.contains("floor unknown 1"), "{told}");
    let [x, y] = last(home.path(), "said");
    assert!((x - 28.0).hypot(y - 7.1) < 0.5, "{x} {y}");
}

#[test]
fn sources_that_contradict_each_other_are_told_of_once() {
    let home = prepared(&(positions("uwb", 2.5) + &positions("wifi", -2.5)));
    let (_, err) = said_and_warned(home.path(), &["replay", "walk.mcap", "--fixes", "fixes.jsonl", "--out", "out"]);
    let contradictions: Vec<_> = err.lines().filter(|line| line.contains("contradict each other")).collect();
    assert!(matches!(contradictions[..], [line] if line.contains("uwb and wifi")), "{err}");
}

#[test]
fn a_recording_keeps_what_was_said_and_is_replayed_with_it() {
    let home = prepared(&positions("uwb", 0.0));
    let folder = home.path();
    let replay = ["replay", "walk.mcap", "--fixes", "fixes.jsonl", "--out", "out"];
    said_and_warned(folder, &[&replay[..], &IN_TWIN].concat());
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("it was written");
    let (path, places) = (read("out/fixes.csv"), read("out/places.jsonl"));
    let recorded = sohle::recording::open(&folder.join("out/recording.mcap"), None).expect("it is a recording");
    assert_eq!(recorded.fixes.len(), 21);
    assert_eq!(&*recorded.fixes[3].source, "uwb");
    std::fs::rename(folder.join("out/recording.mcap"), folder.join("kept.mcap")).expect("it is there");
    let (told, _) = said_and_warned(folder, &[&["replay", "kept.mcap", "--out", "out"][..], &IN_TWIN].concat());
    assert!(told.contains("positions of  all  taken"), "{told}");
    assert_eq!((read("out/fixes.csv"), read("out/places.jsonl")), (path, places));
    // Others come in their place.
    std::fs::write(folder.join("fixes.jsonl"), positions("wifi", 0.0)).expect("it can be written");
    said_and_warned(folder, &["replay", "kept.mcap", "--fixes", "fixes.jsonl", "--out", "out"]);
    let recorded = sohle::recording::open(&folder.join("out/recording.mcap"), None).expect("it is a recording");
    assert!(recorded.fixes.len() == 21 && recorded.fixes.iter().all(|fix| &*fix.source == "wifi"));
}

#[test]
fn the_matcher_on_the_walk_graph_finds_by_positions_who_starts_anywhere() {
    let home = prepared(&positions("uwb", 0.0).replace("\"sigma_m\"", "\"floor\":0,\"sigma_m\""));
    let graph = ["graph", "walk.mcap", "--building", "twin.geojson", "--start", "anywhere"];
    let with = |options: &[&str]| said_and_warned(home.path(), &[&graph[..], options].concat()).0;
    let told = with(&["--fixes", "fixes.jsonl"]);
    // Rank, per cent, floor, x, y of the likeliest place.
    let first = told.lines().find_map(|line| line.strip_prefix("1 ")).expect("a place");
    let cells: Vec<f64> = first.split_whitespace().map(|cell| cell.parse().expect("a number")).collect();
    assert!(cells[0] > 90.0 && cells[1] == 0.0 && (cells[2] - 28.0).hypot(cells[3] - 7.1) < 1.0, "{told}");
    assert!(told.contains("located from step") && told.contains("positions of  all  taken"), "{told}");
    // A straight walk of 24 m is possible on both floors.
    assert!(with(&[]).contains("never located"), "{}", with(&[]));
    let refused = sohle(home.path(), &[&graph[..], &["--method", "documented", "--fixes", "fixes.jsonl"]].concat());
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("takes no positions"), "{refused:?}");
}
