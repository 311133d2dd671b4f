//! Reads archives that the test writes.

use super::{Part, parse};
use crate::building::error::Error;
use crate::building::geometry::{self, Point, Segment};
use crate::building::model::{Building, ConnectorKind, Door};
use crate::building::{Georeference, same};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Features by their type.
struct Archive {
    georeference: Georeference,
    features: BTreeMap<&'static str, Vec<Value>>,
}

impl Archive {
    fn new() -> Self {
        Self { georeference: Georeference::around(10.005, 53.54).unwrap(), features: BTreeMap::new() }
    }

    fn places(&self, points: &[Point]) -> Vec<Point> {
        let projection = self.georeference.projection().unwrap().unwrap();
        points.iter().map(|point| projection.to_earth(*point).unwrap()).collect()
    }

    fn add(&mut self, kind: &'static str, id: &str, geometry: Value, properties: Value) {
        let feature =
            json!({"type": "Feature", "id": id, "feature_type": kind, "geometry": geometry, "properties": properties});
        self.features.entry(kind).or_default().push(feature);
    }

    fn polygon(&self, outline: &[Point]) -> Value {
        let mut ring = self.places(outline);
        ring.push(ring[0]);
        json!({"type": "Polygon", "coordinates": [ring]})
    }

    fn line(&self, line: Segment) -> Value {
        json!({"type": "LineString", "coordinates": self.places(&line)})
    }

    fn level(&mut self, ordinal: i32, outdoor: bool) {
        let id = if outdoor { "yard".to_owned() } else { format!("level {ordinal}") };
        let geometry = self.polygon(&[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]);
        let name = json!({"en": format!("L{ordinal}")});
        self.add(
            "level",
            &id,
            geometry,
            json!({"ordinal": ordinal, "outdoor": outdoor, "short_name": name, "name": null}),
        );
    }

    fn unit(&mut self, id: &str, level: i32, category: &str, name: Option<&str>, outline: &[Point]) {
        let name = name.map(|name| json!({"de": name}));
        let properties = json!({"category": category, "level_id": format!("level {level}"), "name": name});
        self.add("unit", id, self.polygon(outline), properties);
    }

    fn opening(&mut self, level: i32, category: &str, line: Segment) {
        let properties =
            json!({"category": category, "level_id": format!("level {level}"), "name": null, "door": null});
        self.add("opening", "o", self.line(line), properties);
    }

    fn texts(&self) -> Vec<(&'static str, String)> {
        let text = |(kind, features): (&&'static str, &Vec<Value>)| {
            (*kind, json!({"type": "FeatureCollection", "features": features}).to_string())
        };
        self.features.iter().map(text).collect()
    }
}

fn read(texts: &[(&'static str, String)]) -> Result<Building, Error> {
    let parts: Vec<Part<'_>> = texts.iter().map(|(kind, text)| Part { kind, text, file: kind }).collect();
    parse("house", &parts, 3.6)
}

#[test]
fn the_twin_is_read_as_it_was_written() {
    let plan = same::plan();
    let mut written = plan.building;
    // The staircases are open to the corridors over 3 of their 4 m; in an archive this is an opening as any other.
    for connector in written.connectors.iter().filter(|connector| connector.kind == ConnectorKind::Stairs) {
        for (number, outline) in &connector.outlines {
            let front = [0.125, 0.875].map(|part| geometry::between(outline[0], outline[1], part));
            let floor = written.floors.iter_mut().find(|floor| floor.number == *number).unwrap();
            floor.doors.push(Door { line: front, name: None });
        }
    }
    let mut archive = Archive::new();
    for (floor, walls) in written.floors.iter().zip(&plan.closed) {
        let level = floor.number;
        archive.level(level, false);
        for room in &floor.rooms {
            let is_open = matches!(room.usage.as_deref(), Some("corridor" | "hall"));
            let category = if is_open { "walkway" } else { "office" };
            archive.unit(&room.name, level, category, Some(&room.name), &room.outline);
        }
        for connector in &written.connectors {
            let (_, outline) = &connector.outlines[level as usize];
            archive.unit(&connector.name, level, connector.kind.word(), Some(&connector.name), outline);
        }
        for wall in walls {
            let properties = json!({"category": "wall", "level_id": format!("level {level}")});
            archive.add("fixture", "f", archive.line(*wall), properties);
        }
        for door in &floor.doors {
            let is_main = level == 0 && geometry::distance(door.line[0], written.entrances[0].place) < 2.0;
            archive.opening(level, if is_main { "pedestrian.principal" } else { "pedestrian" }, door.line);
        }
    }
    let building = read(&archive.texts()).unwrap();
    let ([low, _], [origin, _]) = (building.bounds().unwrap(), written.bounds().unwrap());
    // Numbers are written in full; merging moves ends by up to 2 cm.
    same::assert_same(&building, &written, [origin[0] - low[0], origin[1] - low[1]], 0.021);
    let names: Vec<&str> = building.connectors.iter().map(|connector| connector.name.as_str()).collect();
    assert!(names.contains(&"stairs-W") && names.contains(&"elevator-1"), "{names:?}");
    assert_eq!(building.floors[1].name, "L1");
}

/// Two walkways side by side, a shop at both, a column and a void, a yard.
fn mall() -> Archive {
    let mut archive = Archive::new();
    archive.level(2, false);
    archive.level(0, true);
    let square = |x: f64, y: f64, side: f64| [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
    archive.unit("a", 2, "walkway", None, &square(0.0, 0.0, 10.0));
    archive.unit("b", 2, "walkway", None, &square(10.0, 0.0, 10.0));
    archive.unit("c", 2, "retail", Some("empty"), &square(0.0, 10.0, 10.0));
    archive.unit("d", 2, "column", None, &square(4.0, 4.0, 1.0));
    archive.unit("e", 2, "opentobelow", None, &square(14.0, 4.0, 2.0));
    archive.opening(2, "pedestrian", [[4.0, 10.0], [6.0, 10.0]]);
    archive.add("anchor", "n", Value::Null, json!({"unit_id": "c"}));
    archive.add("occupant", "m", Value::Null, json!({"anchor_id": "n", "name": {"fr": "Boulangerie", "en": "Bakery"}}));
    let yard = archive.polygon(&square(30.0, 0.0, 9.0));
    archive.add("unit", "y", yard, json!({"category": "road", "level_id": "yard"}));
    archive
}

#[test]
fn one_walks_from_walkway_to_walkway_but_not_into_a_column() {
    let building = read(&mall().texts()).unwrap();
    assert_eq!(building.floors.len(), 1);
    let floor = &building.floors[0];
    assert_eq!((floor.number, floor.name.as_str(), floor.height_m), (2, "L2", 7.2));
    let total: f64 = floor.walls.iter().map(geometry::length).sum();
    // Around the walkways and the shop, between them, around the column and the void, less the opening.
    assert!((total - (60.0 + 30.0 + 4.0 + 8.0 - 2.0)).abs() < 0.1, "{total}");
    let rooms: Vec<_> = floor.rooms.iter().map(|room| (room.name.as_str(), room.usage.as_deref().unwrap())).collect();
    assert_eq!(rooms, [("walkway", "walkway"), ("walkway", "walkway"), ("Bakery", "retail")]);
    assert_eq!(floor.doors.len(), 1);
}

#[test]
fn what_is_wrong_is_told() {
    let texts = mall().texts();
    let without = |kind: &str| -> Vec<_> { texts.iter().filter(|(other, _)| *other != kind).cloned().collect() };
    let message = |texts: &[(&'static str, String)]| read(texts).unwrap_err().to_string();
    assert_eq!(message(&without("unit")), "house is no IMDF archive: it has no unit (file 'unit.geojson')");
    assert!(message(&without("level")).contains("it has no level"));
    let with = |from: &str, to: &str| {
        assert!(texts.iter().any(|(_, text)| text.contains(from)), "{from}");
        let changed: Vec<_> = texts.iter().map(|(kind, text)| (*kind, text.replacen(from, to, 1))).collect();
        message(&changed)
    };
    assert!(with("\"level_id\":\"level 2\"", "\"level_id\":\"x\"").contains("'level_id' is 'x', which is no level"));
    assert!(with("\"ordinal\":2", "\"ordinal\":9999").contains("level, feature 1: its 'ordinal' is no whole number"));
    assert!(with("\"category\":\"retail\"", "\"category\":null").contains("unit, feature 3: it has no 'category'"));
    assert!(with("FeatureCollection", "Feature").contains("is no GeoJSON"));
}

proptest! {
    #[test]
    fn no_text_panics(text in ".{0,200}", cut in 0_usize..4_000, which in 0_usize..6) {
        let mut texts = mall().texts();
        let which = which % texts.len();
        let whole = std::mem::take(&mut texts[which].1);
        texts[which].1 = text;
        let _ = read(&texts);
        texts[which].1 = whole.chars().take(cut).collect();
        prop_assert!(texts[which].1.len() == whole.len() || read(&texts).is_err());
    }
}
