//! Reads plans that the test writes as DXF.

use super::{Layers, PlanFile, is_dxf, parse};
use crate::building::error::Error;
use crate::building::generate;
use crate::building::geometry::{self, Point};
use crate::building::model::{Building, ConnectorKind};
use crate::building::{Georeference, same};
use proptest::prelude::*;
use std::fmt::Write as _;

/// Entities as text, in millimetres.
#[derive(Default)]
struct Sketch {
    entities: String,
}

impl Sketch {
    fn pairs(&mut self, kind: &str, layer: &str, pairs: &[(i32, f64)]) {
        write!(self.entities, "  0\n{kind}\n  8\n{layer}\n").unwrap();
        for (code, value) in pairs {
            writeln!(self.entities, "{code:>3}\n{value}").unwrap();
        }
    }

    fn line(&mut self, layer: &str, line: [Point; 2]) {
        let [[a, b], [c, d]] = line.map(|point| point.map(|value| value * 1e3));
        self.pairs("LINE", layer, &[(10, a), (20, b), (11, c), (21, d)]);
    }

    fn point(&mut self, layer: &str, place: Point) {
        self.pairs("POINT", layer, &[(10, place[0] * 1e3), (20, place[1] * 1e3)]);
    }

    fn outline(&mut self, layer: &str, corners: &[Point]) {
        let mut pairs = vec![(90, corners.len() as f64), (70, 1.0)];
        pairs.extend(corners.iter().flat_map(|point| [(10, point[0] * 1e3), (20, point[1] * 1e3)]));
        self.pairs("LWPOLYLINE", layer, &pairs);
    }

    fn text(&mut self, layer: &str, place: Point, text: &str) {
        self.pairs("TEXT", layer, &[(10, place[0] * 1e3), (20, place[1] * 1e3), (40, 200.0)]);
        write!(self.entities, "  1\n{text}\n").unwrap();
    }

    fn done(&self) -> String {
        let header = "  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  1\nAC1027\n  9\n$INSUNITS\n 70\n4\n  0\nENDSEC\n";
        format!("999\nmade by a test\n{header}  0\nSECTION\n  2\nENTITIES\n{}  0\nENDSEC\n  0\nEOF\n", self.entities)
    }
}

fn file<'a>(number: i32, name: &'a str, text: &'a str) -> PlanFile<'a> {
    PlanFile { number, name, bytes: text.as_bytes(), file: "plan.dxf" }
}

fn one(text: &str, layers: &Layers) -> Result<Building, Error> {
    parse("house", &[file(0, "EG", text)], layers, 3.6)
}

/// A floor of the twin; with `prefix` before the name of each layer.
fn floor_of_the_twin(sketch: &mut Sketch, number: usize, prefix: &str) {
    let plan = same::plan();
    let floor = &plan.building.floors[number];
    let layer = |name: &str| format!("{prefix}{name}");
    for wall in &plan.closed[number] {
        sketch.line(&layer("Wand"), *wall);
    }
    for (index, door) in floor.doors.iter().enumerate() {
        let [a, b] = door.line;
        let length = geometry::length(&door.line);
        match index % 3 {
            0 => sketch.line(&layer("T\u{fc}r"), door.line),
            // The leaf, drawn open, and its swing.
            1 => {
                let angle = (b[1] - a[1]).atan2(b[0] - a[0]).to_degrees();
                let (sin, cos) = (angle + 90.0).to_radians().sin_cos();
                sketch.line(&layer("T\u{fc}r"), [a, [a[0] + cos * length, a[1] + sin * length]]);
                let [x, y] = a.map(|value| value * 1e3);
                sketch.pairs(
                    "ARC",
                    &layer("T\u{fc}r"),
                    &[(10, x), (20, y), (40, length * 1e3), (50, angle), (51, angle + 90.0)],
                );
            }
            _ => {
                let across = [-(b[1] - a[1]) / length * 0.06, (b[0] - a[0]) / length * 0.06];
                let beside = |point: Point, by: f64| [point[0] + by * across[0], point[1] + by * across[1]];
                sketch.outline(&layer("T\u{fc}r"), &[beside(a, -1.0), beside(b, -1.0), beside(b, 1.0), beside(a, 1.0)]);
            }
        }
    }
    for room in &floor.rooms {
        sketch.outline(&layer("Raum"), &room.outline);
        let [x, y] = geometry::centre(&room.outline);
        sketch.text(&layer("Raum"), [x, y - 0.3], "23,5 m2");
        sketch.text(&layer("Raum"), [x, y], &room.name);
    }
    for connector in &plan.building.connectors {
        let name = if connector.kind == ConnectorKind::Elevator { "Lift" } else { "Stiegen" };
        if let Some((_, outline)) = connector.outlines.iter().find(|(floor, _)| *floor == number as i32) {
            sketch.outline(&layer(name), outline);
        }
    }
    for entrance in plan.building.entrances.iter().filter(|entrance| entrance.floor == number as i32) {
        sketch.point(&layer("Eingang"), entrance.place);
        sketch.text(&layer("Eingang"), entrance.place, "main");
    }
}

#[test]
fn the_twin_is_read_as_it_was_written() {
    let mut floors = [Sketch::default(), Sketch::default()];
    let mut both = Sketch::default();
    for number in 0..2 {
        floor_of_the_twin(&mut floors[number], number, "");
        floor_of_the_twin(&mut both, number, ["EG_", "1OG_"][number]);
    }
    let texts = floors.map(|sketch| sketch.done());
    let of_files =
        parse("house", &[file(0, "EG", &texts[0]), file(1, "1OG", &texts[1])], &Layers::default(), 3.6).unwrap();
    let of_layers = parse("house", &[file(0, "0", &both.done())], &Layers::default(), 3.6).unwrap();
    assert_eq!(of_files, of_layers);
    // Rectangles and arcs are computed with sines; ends within 2 mm become one.
    same::assert_same(&of_files, &generate::twin(2), [0.0; 2], 3e-3);
    assert_eq!((of_files.floors[1].name.as_str(), of_files.entrances[0].name.as_str()), ("1OG", "main"));
}

/// As table 6.2 has it: a building, its graph, stairs and an elevator, on two floors.
fn table_6_2() -> [String; 2] {
    let mut floors = [Sketch::default(), Sketch::default()];
    for (number, sketch) in floors.iter_mut().enumerate() {
        sketch.outline("Stockwerk", &[[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [0.0, 10.0]]);
        for x in [2.0, 8.0, 14.0] {
            sketch.point("Graph", [x, 5.0]);
        }
        sketch.line("Graph", [[2.0, 5.0], [8.0, 5.0]]);
        sketch.line("Graph", [[8.0, 5.0], [14.0, 5.0]]);
        let end = [[14.0, 8.0], [16.0, 8.0]][number];
        sketch.line("Graph", [[14.0, 5.0], end]);
        sketch.point(["upstairs", "downstairs"][number], end);
        sketch.point("Lift", [2.0, 5.0]);
        sketch.outline("Stiegen", &[[13.0, 6.0], [17.0, 6.0], [17.0, 9.0], [13.0, 9.0]]);
        sketch.line("M\u{f6}bel", [[0.0, 0.0], [9.0, 9.0]]);
    }
    floors.map(|sketch| sketch.done())
}

#[test]
fn a_drawing_of_table_6_2_has_a_graph() {
    let texts = table_6_2();
    let files = [file(0, "EG", &texts[0]), file(1, "1OG", &texts[1])];
    let building = parse("house", &files, &Layers::default(), 3.65).unwrap();
    let graph = building.graph.as_ref().unwrap();
    assert_eq!((graph.nodes.len(), graph.edges.len()), (8, 3 + 3 + 2));
    let climbing: Vec<_> =
        graph.edges.iter().map(|edge| edge.map(|node| graph.nodes[node])).filter(|[a, b]| a.floor != b.floor).collect();
    assert_eq!(
        climbing.iter().map(|[a, b]| (a.place, b.place)).collect::<Vec<_>>(),
        [([14.0, 8.0], [16.0, 8.0]), ([2.0, 5.0], [2.0, 5.0])]
    );
    let kinds: Vec<_> = building.connectors.iter().map(|connector| connector.kind).collect();
    assert_eq!(kinds, [ConnectorKind::Elevator, ConnectorKind::Stairs]);
    let total: f64 = building.floors[0].walls.iter().map(geometry::length).sum();
    assert!((total - 60.0).abs() < 1e-9);
    // The same drawing in a national grid, and the same in a UTM zone.
    let moved = |[x, y]: Point| [x * 1e3 + 566_500_400.0, y * 1e3 + 5_932_800_000.0];
    let far: Vec<String> = texts.iter().map(|text| shifted(text, moved)).collect();
    let files = [file(0, "EG", &far[0]), file(1, "1OG", &far[1])];
    let grid = parse("house", &files, &Layers::default(), 3.65).unwrap();
    let same = |a: f64, b: f64| (a - b).abs() < 1e-6;
    let [low, _] = grid.bounds().unwrap();
    assert!(same(low[0], 0.4) && same(low[1], 0.0) && grid.georeference == Georeference::Local, "{low:?}");
    let zone = Layers { epsg: Some(32_632), ..Layers::default() };
    let placed = parse("house", &files, &zone, 3.65).unwrap();
    assert_eq!(placed.georeference, Georeference::Utm { epsg: 32_632, origin: [566_500.0, 5_932_800.0] });
    assert_eq!(placed.floors, grid.floors);
}

/// A text whose coordinates (codes 10, 20, 11 and 21) are moved.
fn shifted(text: &str, to: impl Fn(Point) -> Point) -> String {
    let offset = to([0.0; 2]);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for at in (0..lines.len() - 1).step_by(2) {
        let axis = match lines[at].trim() {
            "10" | "11" => 0,
            "20" | "21" => 1,
            _ => continue,
        };
        lines[at + 1] = format!("{}", lines[at + 1].parse::<f64>().unwrap() + offset[axis]);
    }
    lines.join("\n")
}

#[test]
fn units_and_layers_are_what_the_table_says() {
    let mut sketch = Sketch::default();
    sketch.outline("A-WALL", &[[0.0, 0.0], [4.0, 0.0], [4.0, 5.0]]);
    let text = sketch.done();
    assert!(one(&text, &Layers::default()).unwrap_err().to_string().contains("none of its layers (A-WALL) is read"));
    let layers = Layers::parse("walls = ['A-WALL*']\nunit_m = 0.01", "l.toml").unwrap();
    assert_eq!(one(&text, &layers).unwrap().bounds(), Some([[0.0, 0.0], [40.0, 50.0]]));
    let layers = Layers { unit_m: None, ..layers };
    assert_eq!(one(&text, &layers).unwrap().bounds(), Some([[0.0, 0.0], [4.0, 5.0]]));
}

#[test]
fn what_is_wrong_is_told() {
    let [text, _] = table_6_2();
    assert!(is_dxf(text.as_bytes()) && !is_dxf(b"{}") && !is_dxf(b""));
    let message = |text: &str| one(text, &Layers::default()).unwrap_err().to_string();
    assert!(message("").contains("plan.dxf is no DXF plan: it is cut short"));
    assert!(message(&text.replace("\n14000\n", "\nnan\n")).contains("is no number"));
    assert!(message(&text.replacen("\n20000\n", "\n1e200\n", 1)).contains("from the origin"));
    assert!(message(&text.replacen(" 70\n4\n", " 70\n20\n", 1)).contains("$INSUNITS"));
}

proptest! {
    #[test]
    fn no_bytes_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..200), cut in 0_usize..3_000, at in 0_usize..3_000,
        with in "[0-9A-Z.e -]{0,9}\n?",
    ) {
        let layers = Layers::default();
        let read = |bytes: &[u8]| parse("x", &[PlanFile { number: 0, name: "x", bytes, file: "x" }], &layers, 3.0);
        let _ = read(&bytes);
        let binary = [&super::pairs::BINARY[..], &bytes].concat();
        let _ = read(&binary);
        let [text, _] = table_6_2();
        prop_assert!(cut >= text.len() - 1 || read(&text.as_bytes()[..cut]).is_err());
        let changed = [&text.as_bytes()[..at.min(text.len())], with.as_bytes(), &text.as_bytes()[(at + 3).min(text.len())..]];
        let _ = read(&changed.concat());
    }
}
