//! The readers of buildings, through the one door that all formats have: whatever the files hold, the answer comes soon and
//! is a building that can be checked and written, or an error.

use crate::seeds::Seed;
use sohle::building::open::{Format, Options, open};
use sohle::building::{
    Building, Connector, ConnectorKind, Door, Entrance, Floor, Georeference, Outline, Room, check, geojson,
};
use std::path::{Path, PathBuf};

/// What stands before the name of a file, at the beginning of a line; the rest of the line is the name, the file follows.
const FILE: &[u8] = b"--- ";
/// Files that an input may have.
const FILES_MOST: usize = 6;

/// Files as an input has them: name and content. What stands before the first name is nobody's.
fn files(data: &[u8]) -> Vec<(String, &[u8])> {
    let starts: Vec<usize> = (0..data.len())
        .filter(|&at| data[at..].starts_with(FILE) && (at == 0 || data[at - 1] == b'\n'))
        .take(FILES_MOST)
        .collect();
    let ends = starts.iter().skip(1).copied().chain([data.len()]);
    let file = |(start, end): (&usize, usize)| {
        let text = &data[start + FILE.len()..end];
        let length = text.iter().position(|&byte| byte == b'\n').unwrap_or(text.len());
        let name = text[..length].iter().map(|&byte| char::from(byte)).take(40);
        let name: String = name.filter(|letter| letter.is_ascii_alphanumeric() || "._-".contains(*letter)).collect();
        // A name that leads out of the folder is none.
        let name = if name.chars().all(|letter| letter == '.') { "file".to_owned() } else { name };
        (name, text.get(length + 1..).unwrap_or_default())
    };
    starts.iter().zip(ends).map(file).collect()
}

/// The folder of this program, empty.
fn folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("sohle-fuzz-{}", std::process::id()));
    // It is not there at first.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the folder for what is temporary takes another");
    folder
}

fn judge(path: &Path, format: Option<Format>) {
    match open(path, &Options { format, ..Options::default() }) {
        Ok(building) => {
            let findings = check::check(&building);
            assert!(findings.iter().flat_map(|finding| finding.place).flatten().all(f64::is_finite));
            if let Ok(text) = geojson::write(&building) {
                geojson::parse(&text, "written").expect("what was written can be read");
            }
        }
        Err(error) => assert!(!error.to_string().contains(['\n', '\r']), "{error:?}"),
    }
}

/// The first byte says whether a format is named, the rest are the files. The first is opened; if there are more, so is the
/// folder.
pub fn run(data: &[u8]) {
    let Some((&format, data)) = data.split_first() else { return };
    let files = files(data);
    let Some((first, _)) = files.first() else { return };
    let folder = folder();
    for (name, content) in &files {
        std::fs::write(folder.join(name), content).expect("a plain name is a file's");
    }
    let formats = <Format as clap::ValueEnum>::value_variants();
    let format = usize::from(format).checked_sub(1).and_then(|format| formats.get(format)).copied();
    judge(&folder.join(first), format);
    if files.len() > 1 {
        judge(&folder, format);
    }
}

/// Files as an input has them.
fn written(files: &[(&str, &str)]) -> Vec<u8> {
    let mut data = vec![0];
    for (name, text) in files {
        data.extend_from_slice(FILE);
        data.extend(format!("{name}\n{text}\n").bytes());
    }
    data
}

/// A floor of 8 m by 6 m with a room, a corridor and stairs.
fn floor(number: i32) -> Floor {
    let wall = |a, b| [a, b];
    Floor {
        number,
        name: format!("F{number}"),
        height_m: 3.5 * f64::from(number),
        walls: vec![
            wall([0.0, 0.0], [8.0, 0.0]),
            wall([8.0, 0.0], [8.0, 6.0]),
            wall([8.0, 6.0], [0.0, 6.0]),
            wall([0.0, 6.0], [0.0, 0.0]),
            wall([5.0, 0.0], [5.0, 2.0]),
            wall([5.0, 3.0], [5.0, 6.0]),
        ],
        doors: vec![Door { line: [[5.0, 2.0], [5.0, 3.0]], name: None }],
        rooms: vec![Room {
            name: format!("{number}.1"),
            usage: Some("office".into()),
            outline: vec![[0.0, 0.0], [5.0, 0.0], [5.0, 6.0], [0.0, 6.0]],
        }],
    }
}

/// Two floors, joined by stairs.
fn house(georeference: Georeference) -> Building {
    let steps: Outline = vec![[6.0, 3.0], [7.0, 3.0], [7.0, 6.0], [6.0, 6.0]];
    let stairs = Connector {
        name: "stairs".into(),
        kind: ConnectorKind::Stairs,
        outlines: vec![(0, steps.clone()), (1, steps)],
        way: vec![[6.5, 3.0, 0.0], [6.5, 6.0, 3.5]],
    };
    let entrances = vec![Entrance { name: "main".into(), floor: 0, place: [8.0, 1.0], beacon: None }];
    let (floors, connectors) = (vec![floor(0), floor(1)], vec![stairs]);
    Building { name: "House".into(), georeference, floors, connectors, entrances, ..Building::default() }
}

/// A wall, a door and a room with IFC classes.
const HCU: &str = r#"{"type":"FeatureCollection","features":[
{"type":"Feature","properties":{"ifc_class":"IfcWall","usage":"Wall"},"geometry":{"type":"Polygon","coordinates":
[[[10.0,53.5],[10.0001,53.5],[10.0001,53.50001],[10.0,53.50001],[10.0,53.5]]]}},
{"type":"Feature","properties":{"ifc_class":"IfcDoor","usage":"Door"},"geometry":{"type":"Polygon","coordinates":
[[[10.00005,53.5],[10.00006,53.5],[10.00006,53.50001],[10.00005,53.50001],[10.00005,53.5]]]}},
{"type":"Feature","properties":{"ifc_class":"IfcSpace","usage":"Office","spaceID":"4 001"},"geometry":{"type":"Polygon",
"coordinates":[[[10.0,53.50001],[10.0001,53.50001],[10.0001,53.5001],[10.0,53.50001]]]}}]}"#;

/// A border and a shop.
const MAP: &str = r#"{"type":"FeatureCollection","features":[
{"type":"Feature","properties":{"name":"F4","type":"floor"},"geometry":{"type":"MultiPolygon",
"coordinates":[[[[120.0,30.0],[120.002,30.0],[120.002,30.001],[120.0,30.001],[120.0,30.0]]]]}},
{"type":"Feature","properties":{"name":"shop"},"geometry":{"type":"Polygon",
"coordinates":[[[120.001,30.0],[120.002,30.0],[120.002,30.0005],[120.001,30.0]]]}}]}"#;

/// Small buildings of each format.
pub fn seeds() -> Vec<Seed> {
    let text = |georeference| geojson::write(&house(georeference)).expect("the house can be written");
    let earth = Georeference::around(10.0, 53.5).expect("Hamburg lies in a zone");
    let info = r#"{"map_info":{"height":100.0,"width":200.0}}"#;
    vec![
        ("local", written(&[("house.geojson", &text(Georeference::Local))])),
        ("earth", written(&[("house.geojson", &text(earth))])),
        ("hcu", written(&[("EG.geojson", HCU), ("1OG.geojson", HCU)])),
        ("xyz10", written(&[("geojson_map.json", MAP), ("floor_info.json", info)])),
    ]
}
