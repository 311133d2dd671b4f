//! `sohle building graph` and `sohle route` from outside, and the graph of a real plan.

#![allow(clippy::unwrap_used, reason = "a test that cannot run its program has failed")]

use crate::command::{refused, said, sohle};
use sohle::building::check::{Finding, Kind, Level, check};
use sohle::building::geometry::{self, Segment};
use sohle::building::open::{Options, open};
use sohle::graph::Graph;
use sohle::graph::draw::{self, draw};
use sohle::graph::lint::{self, lint};
use sohle::recording::recordings_dir;

fn house() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    said(home.path(), &["building", "generate", "twin", "twin.geojson"]);
    home
}

#[test]
fn a_graph_is_drawn_written_and_read_again() {
    let home = house();
    let folder = home.path();
    let drawn =
        ["building", "graph", "twin.geojson", "--write", "graph.geojson", "--list", "list.csv", "--out", "pictures"];
    assert!(said(folder, &drawn).starts_with("walk graph, drawn"));
    assert!(std::fs::read(folder.join("pictures/floor0.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(refused(folder, &drawn).contains("--force"));
    // From the file, and from the list, it is the same.
    assert!(
        said(folder, &["building", "graph", "graph.geojson", "--list", "again.csv"])
            .starts_with("walk graph, of the file")
    );
    let imported = ["building", "graph", "twin.geojson", "--import", "list.csv", "--list", "third.csv"];
    assert!(said(folder, &imported).starts_with("walk graph, read from a list"));
    let rows = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap().lines().count();
    assert_eq!([rows("again.csv"), rows("third.csv")], [rows("list.csv"); 2]);
    assert!(said(folder, &["building", "check", "graph.geojson"]).contains("0 errors"));
}

#[test]
fn a_graph_through_a_wall_and_a_list_that_is_none_are_refused() {
    let home = house();
    let folder = home.path();
    let headings =
        "start_node,start_y_m,start_x_m,start_floor,end_node,end_y_m,end_x_m,end_floor,direction_deg,length_m";
    let write = |rows: &str| std::fs::write(folder.join("list.csv"), format!("{headings}\n{rows}")).unwrap();
    let import = ["building", "graph", "twin.geojson", "--import", "list.csv"];
    write("0,1,3,0,1,6,3,0,90,5\n1,6,3,0,0,1,3,0,270,5\n");
    let output = sohle(folder, &import);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stdout).unwrap().contains("leads through a wall"));
    write("0,1,3,9,1,6,3,0,90,5\n");
    assert!(refused(folder, &import).contains("list.csv, line 2: floor 9 is not there; the building has 0, 1"));
    assert!(
        refused(folder, &["building", "graph", "twin.geojson", "--import", "none.csv"])
            .contains("none.csv cannot be read")
    );
    std::fs::write(folder.join("wrong.toml"), "edge_m = -1.0\n").unwrap();
    let wrong = ["building", "graph", "twin.geojson", "--parameters", "wrong.toml"];
    assert!(refused(folder, &wrong).contains("edge_m = -1: expected 0.5 to 50"));
}

#[test]
fn a_route_is_told_and_drawn() {
    let home = house();
    let folder = home.path();
    let told =
        said(folder, &["route", "W01", "E14", "--building", "twin.geojson", "--avoid", "elevators", "--out", "way"]);
    assert!(told.starts_with("  1. leave from W01 towards north"), "{told}");
    assert!(told.contains("take the stairs (stairs-") && told.contains("up to floor 1"), "{told}");
    assert!(told.contains("arrive at E14"), "{told}");
    assert!(folder.join("way/floor0.png").is_file() && folder.join("way/floor1.svg").is_file());
    let nowhere = refused(folder, &["route", "W01", "cellar", "--building", "twin.geojson"]);
    assert!(nowhere.contains("'cellar' is no room and no entrance of the building"), "{nowhere}");
}

#[test]
fn a_recorded_walk_is_followed_and_each_step_is_explained() {
    let Some(folder) = recordings_dir().map(|folder| folder.join("hcu_hamburg")).filter(|folder| folder.exists())
    else {
        return;
    };
    let home = tempfile::tempdir().unwrap();
    let [walk, plan] = ["eight_walk", "floorplans/4OG.geojson"].map(|name| folder.join(name).display().to_string());
    let begin = ["graph", &walk, "--building", &plan, "--method", "documented", "--start"];
    let told = said(home.path(), &[&begin[..], &["4,76.7,33.4,-164", "--explain", "--out", "way"]].concat());
    let lines: Vec<&str> = told.lines().filter(|line| line.starts_with("step ")).collect();
    // 146 m in steps of about 0.7 m.
    assert!((180..=240).contains(&lines.len()), "{}", lines.len());
    assert!(lines.iter().all(|line| line.contains(", delta ") && line.contains(": edge ")), "{}", lines[0]);
    for case in ["case 1 straight on", "case 3 turn", "case 4 beyond the node"] {
        assert!(lines.iter().any(|line| line.contains(case)), "{case}");
    }
    assert!(told.contains("edges chosen without a search") && told.contains("on floor 4"), "{told}");
    assert!(home.path().join("way/floor4.png").is_file());
    assert!(refused(home.path(), &[&begin[..], &["anywhere"]].concat()).contains("expected FLOOR,X,Y,HEADING_DEG"));
    // Edges are searched for by map matching if that is asked for, by an option or by a settings file.
    let matched = [&begin[..], &["4,76.7,33.4,-164", "--explain", "--search", "map-matching"]].concat();
    let told = said(home.path(), &matched);
    assert!(told.contains("map matching of ") && told.contains(" in ") && told.contains(" from node "), "{told}");
    std::fs::write(home.path().join("settings.toml"), "search = \"map-matching\"\n").unwrap();
    let by_file = [&begin[..], &["4,76.7,33.4,-164", "--explain", "--parameters", "settings.toml"]].concat();
    assert_eq!(said(home.path(), &by_file), told);
    let matcher = ["graph", &walk, "--building", &plan, "--start", "anywhere", "--search", "map-matching"];
    assert!(refused(home.path(), &matcher).contains("--search: the matcher searches no edges"));
}

#[test]
fn a_recorded_walk_is_matched_from_a_known_start_and_from_anywhere() {
    let Some(folder) = recordings_dir().map(|folder| folder.join("hcu_hamburg")).filter(|folder| folder.exists())
    else {
        return;
    };
    let home = tempfile::tempdir().unwrap();
    let [walk, plan] = ["eight_walk", "floorplans/4OG.geojson"].map(|name| folder.join(name).display().to_string());
    let begin = ["graph", &walk, "--building", &plan, "--start"];
    let told = said(home.path(), &[&begin[..], &["4,76.7,33.4,-164", "--explain", "--out", "way"]].concat());
    let lines: Vec<&str> = told.lines().filter(|line| line.starts_with("step ")).collect();
    assert!((180..=240).contains(&lines.len()), "{}", lines.len());
    assert!(lines.iter().all(|line| line.contains(" hypotheses, loss ") && line.contains("% edge ")), "{}", lines[0]);
    assert!(told.contains("located from step 0 on"), "{told}");
    assert!(home.path().join("way/floor4.png").is_file());
    // From anywhere it has several places to tell at first.
    let told = said(home.path(), &[&begin[..], &["anywhere", "--explain"]].concat());
    assert!(told.lines().nth(5).unwrap().ends_with("more places"), "{told}");
    assert!(told.contains("place at the end"), "{told}");
    std::fs::write(home.path().join("wrong.toml"), "aside_m = -1.0\n").unwrap();
    let wrong = [&begin[..], &["anywhere", "--parameters", "wrong.toml"]].concat();
    assert!(refused(home.path(), &wrong).contains("aside_m = -1: expected 0.05 to 20"));
}

#[test]
fn a_walk_begins_at_the_entrance_whose_beacon_is_loud() {
    let home = house();
    let folder = home.path();
    // The beacon of the main entrance gets its id.
    let house = std::fs::read_to_string(folder.join("twin.geojson")).unwrap();
    let mut house: serde_json::Value = serde_json::from_str(&house).unwrap();
    let features = house["features"].as_array_mut().unwrap();
    let entrance = features.iter_mut().find(|feature| feature["properties"]["kind"] == "entrance").unwrap();
    entrance["properties"]["beacon"] = "40".into();
    std::fs::write(folder.join("house.geojson"), house.to_string()).unwrap();
    said(folder, &["simulate", "--building", "twin.geojson", "--route", "hall,W02", "--out", "walk.mcap"]);
    let heard = |lines: &str| std::fs::write(folder.join("heard.jsonl"), lines).unwrap();
    let begin = ["graph", "walk.mcap", "--building", "house.geojson", "--start", "beacon"];
    let by_beacon = [&begin[..], &["--beacons", "heard.jsonl", "--method", "documented", "--explain"]].concat();
    heard(
        "{\"time_us\":0,\"beacon\":\"40\",\"rssi_dbm\":-71}\n{\"time_us\":1000000,\"beacon\":\"40\",\"rssi_dbm\":-52}\n",
    );
    let told = said(folder, &by_beacon);
    assert!(told.starts_with("begins at entrance 'main' of floor 0 after 1.0 s: beacon '40' with -52 dBm"), "{told}");
    // From the entrance at (26, 0.3) into the building.
    let first = told.lines().find(|line| line.starts_with("step ")).unwrap();
    assert!(first.contains("(26.0"), "{first}");
    // The matcher begins there, too.
    let matched = said(folder, &[&begin[..], &["--beacons", "heard.jsonl"]].concat());
    assert!(matched.starts_with("begins at entrance 'main'") && matched.contains("place at the end"), "{matched}");
    // A threshold that nothing exceeds, a beacon that nobody knows, and what is missing.
    let quiet = [&by_beacon[..], &["--beacon-dbm", "-50"]].concat();
    assert!(refused(folder, &quiet).contains("louder than -50 dBm: the loudest was '40' with -52 dBm"));
    heard("{\"time_us\":0,\"beacon\":\"7\",\"rssi_dbm\":-40}\n");
    assert!(refused(folder, &by_beacon).contains("heard '7', and the entrances have '40'"));
    heard("{\"time_us\":0,\"beacon\":\"40\"}\n");
    assert!(refused(folder, &by_beacon).contains("heard.jsonl, line 1: missing field `rssi_dbm`"));
    assert!(refused(folder, &begin).contains("expected --beacons FILE"));
    let missing = [&begin[..], &["--beacons", "none.jsonl"]].concat();
    assert!(refused(folder, &missing).contains("beacons none.jsonl: "));
    let unknown = ["graph", "walk.mcap", "--building", "twin.geojson", "--start", "beacon", "--beacons", "heard.jsonl"];
    heard("{\"time_us\":0,\"beacon\":\"40\",\"rssi_dbm\":-40}\n");
    assert!(refused(folder, &unknown).contains("no entrance of the building has a beacon"));
    let other = ["graph", "walk.mcap", "--building", "twin.geojson", "--start", "main", "--beacons", "heard.jsonl"];
    assert!(refused(folder, &other).contains("--beacons is for --start beacon"));
}

/// So many walks in each building; those of the whole suite take some minutes.
const FEW: &str = "4";

#[test]
fn the_suite_prints_the_table_that_is_kept() {
    let recorded = recordings_dir().is_some_and(|folder| folder.join("hcu_hamburg").exists());
    if !recorded {
        println!("skipped: no recordings");
        return;
    }
    let home = tempfile::tempdir().unwrap();
    let arguments = ["evaluate", "--suite", "graph", "--walks", FEW, "--pictures", "drawn"];
    let printed = said(home.path(), &arguments);
    let kept = include_str!("../../../tests/graph.txt");
    assert_eq!(printed, kept, "if that is meant: sohle evaluate --suite graph --walks {FEW} > tests/graph.txt");
    assert!(std::fs::read(home.path().join("drawn/graph-eight.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn the_rooms_of_the_university_are_reached_and_no_edge_leads_through_a_wall() {
    let Some(folder) =
        recordings_dir().map(|folder| folder.join("hcu_hamburg/floorplans")).filter(|folder| folder.exists())
    else {
        return;
    };
    let mut building = open(&folder, &Options::default()).unwrap();
    building.graph = Some(draw(&building, &draw::Parameters::default()));
    let building = building.assembled().unwrap();
    let found = lint(&building, &lint::Parameters::default()).unwrap();
    let errors = found.iter().filter(|finding| finding.level == Level::Error);
    let errors: Vec<_> = errors.filter(|finding| finding.kind != Kind::SeparatePiece).collect();
    assert!(errors.iter().all(|finding| finding.kind == Kind::RoomOffGraph), "{errors:#?}");
    // Shafts to which no way leads at all are told by the check of the building, too. Of some 400 rooms one more is off the
    // graph: E 117, whose only door leads out of doors.
    let place = |finding: &Finding| (finding.floor, finding.room.clone());
    let plan = check(&building);
    let closed: Vec<_> = plan.iter().filter(|finding| finding.kind == Kind::UnreachableRoom).map(place).collect();
    let off: Vec<_> = errors.iter().map(|finding| place(finding)).filter(|room| !closed.contains(room)).collect();
    assert_eq!(off.len(), 1, "{off:?}");
    // Walls once more without the lint's own means.
    let graph = Graph::of(&building).unwrap();
    for floor in &building.floors {
        let edges = graph.edge_ids().filter(|&id| {
            let [from, to] = [graph.edge(id).from, graph.edge(id).to].map(|node| graph.node(node));
            from.floor == floor.number && from.height_m == floor.height_m && to.height_m == floor.height_m
        });
        let lines: Vec<Segment> = edges.map(|id| graph.ends(id)).collect();
        assert!(!lines.is_empty());
        let low = |line: &Segment| line[0][0].min(line[1][0]);
        let mut lines = lines;
        lines.sort_by(|a, b| low(a).total_cmp(&low(b)));
        for wall in &floor.walls {
            // Edges are no longer than 8 m: only those that begin near the wall are looked at.
            let begin = lines.partition_point(|line| low(line) < low(wall) - 8.0);
            let right = wall[0][0].max(wall[1][0]);
            let mut near = lines[begin..].iter().take_while(|line| low(line) <= right);
            assert!(near.all(|line| geometry::crossing(line, wall).is_none()), "{wall:?}");
        }
    }
}
