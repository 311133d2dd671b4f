//! `sohle building` from outside: exit codes, what it says, the files it leaves.

#![allow(clippy::unwrap_used, reason = "a test that cannot run its program has failed")]

use crate::command;
use std::path::Path;

#[track_caller]
fn said(folder: &Path, arguments: &[&str]) -> String {
    command::said(folder, &[&["building"], arguments].concat())
}

#[track_caller]
fn refused(folder: &Path, arguments: &[&str], code: i32) -> String {
    command::refused_with(code, folder, &[&["building"], arguments].concat())
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
    let output = command::sohle(folder, &["building", "check", "open.geojson", "--json", "--out", "marked"]);
    assert_eq!(output.status.code(), Some(1));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&told["errors"], &told["findings"][0]["kind"]), (&2.into(), &"no-walls".into()));
    assert!(folder.join("marked/floor0.svg").exists() && folder.join("marked/floor1.png").exists());
    let told = refused(folder, &["check", "open.geojson"], 1);
    assert_eq!(told, "error: open.geojson: 2 errors\n");
}

/// A house of 8 m by 6 m with a room and a hall, a door between them and one to the outside, in four formats.
fn plans(folder: &Path) -> [String; 4] {
    let write = |name: &str, text: &[u8]| std::fs::write(folder.join(name), text).unwrap();
    let degrees = |[x, y]: [f64; 2]| [10.0 + x / 66_000.0, 53.5 + y / 111_000.0];
    let room = [[0.0, 0.0], [4.0, 0.0], [4.0, 6.0], [0.0, 6.0]];
    let hall = room.map(|[x, y]| [x + 4.0, y]);
    let doors = [[[4.0, 2.0], [4.0, 3.0]], [[8.0, 2.0], [8.0, 3.0]]];

    let (mut nodes, mut ways, mut id) = (String::new(), String::new(), 0);
    let mut node = |place: [f64; 2], tags: &str| {
        id += 1;
        let [lon, lat] = degrees(place);
        nodes += &format!("<node id='{id}' lon='{lon}' lat='{lat}'>{tags}</node>");
        id
    };
    for (outline, name) in [(room, "Room"), (hall, "Hall")] {
        let ids = outline.map(|place| node(place, ""));
        let refs: String = ids.iter().chain(&ids[..1]).map(|id| format!("<nd ref='{id}'/>")).collect();
        let tags = format!("<tag k='indoor' v='room'/><tag k='level' v='0'/><tag k='name' v='{name}'/>");
        ways += &format!("<way id='{}'>{refs}{tags}</way>", ids[0]);
    }
    for ([[x, y], _], kind) in doors.into_iter().zip(["door", "entrance"]) {
        node([x, y + 0.5], &format!("<tag k='{kind}' v='yes'/><tag k='level' v='0'/>"));
    }
    write("house.osm", format!("<osm>{nodes}{ways}</osm>").as_bytes());

    let mut dxf = "0\nSECTION\n2\nENTITIES\n".to_owned();
    for (outline, name) in [(room, "Room"), (hall, "Hall")] {
        for layer in ["Wand", "Raum"] {
            dxf += &format!("0\nLWPOLYLINE\n8\n{layer}\n70\n1\n");
            dxf.extend(outline.iter().map(|[x, y]| format!("10\n{x}\n20\n{y}\n")));
        }
        dxf += &format!("0\nTEXT\n8\nRaum\n10\n{}\n20\n3\n1\n{name}\n", outline[0][0] + 2.0);
    }
    for ([[x, y], [u, v]], layer) in doors.into_iter().zip(["Tuer", "Eingang"]) {
        dxf += &format!("0\nLINE\n8\n{layer}\n10\n{x}\n20\n{y}\n11\n{u}\n21\n{v}\n");
    }
    write("house.dxf", (dxf + "0\nENDSEC\n0\nEOF\n").as_bytes());

    let archive = |kind: &str, features: Vec<serde_json::Value>| {
        let text = serde_json::json!({"type": "FeatureCollection", "features": features}).to_string();
        write(&format!("imdf/{kind}.geojson"), text.as_bytes());
    };
    let feature = |kind: &str, geometry: &str, places: serde_json::Value, properties: serde_json::Value| {
        serde_json::json!({"type": "Feature", "id": "0", "feature_type": kind, "properties": properties,
            "geometry": {"type": geometry, "coordinates": places}})
    };
    let ring = |outline: [[f64; 2]; 4]| {
        let places: Vec<_> = outline.iter().chain(&outline[..1]).map(|place| degrees(*place)).collect();
        serde_json::json!([places])
    };
    std::fs::create_dir(folder.join("imdf")).unwrap();
    archive("level", vec![feature("level", "Polygon", ring(room), serde_json::json!({"ordinal": 0}))]);
    let unit = |(outline, name)| {
        let properties = serde_json::json!({"category": "office", "level_id": "0", "name": {"en": name}});
        feature("unit", "Polygon", ring(outline), properties)
    };
    archive("unit", [(room, "Room"), (hall, "Hall")].map(unit).to_vec());
    let opening = |(line, category): ([[f64; 2]; 2], &str)| {
        let places = serde_json::json!(line.map(degrees));
        feature("opening", "LineString", places, serde_json::json!({"category": category, "level_id": "0"}))
    };
    archive("opening", doors.into_iter().zip(["pedestrian", "pedestrian.principal"]).map(opening).collect());

    // Cells of a decimetre; the image is a cell larger on every side.
    let is_wall = |x: usize, y: usize| {
        let is_gap = (21..30).contains(&y);
        (x == 1 || y == 1 || y == 60) || ([41, 80].contains(&x) && !is_gap)
    };
    let pixel = |x: usize, y: usize| {
        let is_inside = (1..=80).contains(&x) && (1..=60).contains(&y);
        if is_inside && is_wall(x, y) { 0_u8 } else { 254 }
    };
    let pixels: Vec<u8> = (0..62).rev().flat_map(|y| (0..82).map(move |x| pixel(x, y))).collect();
    write("house.pgm", &[&b"P5 82 62 255\n"[..], &pixels].concat());
    write("house.yaml", b"image: house.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n");
    ["house.osm", "house.dxf", "imdf", "house.yaml"].map(str::to_owned)
}

#[test]
fn plans_of_other_formats_are_recognised_converted_and_without_errors() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path();
    for (index, plan) in plans(folder).iter().enumerate() {
        let output = format!("{index}.geojson");
        said(folder, &["convert", plan, &output]);
        let told = said(folder, &["check", &output]);
        assert!(told.contains(": 0 errors"), "{plan}: {told}");
        let text = std::fs::read_to_string(folder.join(&output)).unwrap();
        let count = |kind: &str| text.matches(&format!("\"kind\":\"{kind}\"")).count();
        let expected = if plan == "house.yaml" { [0, 0, 0] } else { [2, 2, 1] };
        assert_eq!([count("room"), count("door"), count("entrance")], expected, "{plan}");
        said(folder, &["convert", &output, "again.geojson", "--force"]);
        assert_eq!(text, std::fs::read_to_string(folder.join("again.geojson")).unwrap(), "{plan}");
    }
    // A folder of floors is recognised, too.
    for (name, beside) in [("house.dxf", None), ("house.yaml", Some("house.pgm"))] {
        let ending = name.split_once('.').unwrap().1;
        std::fs::create_dir(folder.join(ending)).unwrap();
        for floor in ["EG", "1OG"] {
            std::fs::copy(folder.join(name), folder.join(format!("{ending}/{floor}.{ending}"))).unwrap();
        }
        if let Some(image) = beside {
            std::fs::copy(folder.join(image), folder.join(ending).join(image)).unwrap();
        }
        let told = said(folder, &["show", ending, "--storey", "4", "--out", "pictures"]);
        assert!(told.contains("EG") && told.contains("1OG") && told.contains("4.00"), "{told}");
    }
    std::fs::write(folder.join("layers.toml"), "walls = ['Raum']\nrooms = []").unwrap();
    said(folder, &["show", "house.dxf", "--layers", "layers.toml", "--out", "pictures"]);
    std::fs::write(folder.join("layers.toml"), "wals = ['Raum']").unwrap();
    assert!(refused(folder, &["check", "house.dxf", "--layers", "layers.toml"], 1).contains("unknown field `wals`"));
    // A file that is cut short is told, whatever its format.
    for (name, length) in [("house.osm", 300), ("house.dxf", 300), ("house.pgm", 300), ("imdf/unit.geojson", 200)] {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        std::fs::write(folder.join(name), &bytes[..length]).unwrap();
        let plan = if name == "house.pgm" { "house.yaml" } else { name };
        assert!(refused(folder, &["check", plan], 1).contains(plan), "{name}");
    }
}
