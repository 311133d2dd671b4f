//! Reads plans that the test writes as OSM.

use super::parse;
use crate::building::generate;
use crate::building::geometry::{self, Point};
use crate::building::model::{Building, ConnectorKind};
use crate::building::{Georeference, same};
use proptest::prelude::*;
use std::fmt::Write as _;

/// Writes elements with numbers counted up.
struct Map {
    georeference: Georeference,
    text: String,
    last: i64,
}

impl Map {
    fn new() -> Self {
        let georeference = Georeference::around(10.005, 53.54).unwrap();
        Self { georeference, text: "<?xml version='1.0'?>\n<osm version='0.6'>\n".to_owned(), last: 0 }
    }

    fn node(&mut self, place: Point, tags: &[(&str, &str)]) -> i64 {
        self.last += 1;
        let projection = self.georeference.projection().unwrap().unwrap();
        let [lon, lat] = projection.to_earth(place).unwrap();
        // Seven digits, as the database has them.
        writeln!(self.text, "<node id='{}' lat='{lat:.7}' lon='{lon:.7}'>{}</node>", self.last, xml(tags)).unwrap();
        self.last
    }

    fn way(&mut self, nodes: &[i64], tags: &[(&str, &str)]) -> i64 {
        self.last += 1;
        let nodes: String = nodes.iter().map(|node| format!("<nd ref='{node}'/>")).collect();
        writeln!(self.text, "<way id='{}'>{nodes}{}</way>", self.last, xml(tags)).unwrap();
        self.last
    }

    fn area(&mut self, outline: &[Point], tags: &[(&str, &str)]) -> i64 {
        let mut nodes: Vec<i64> = outline.iter().map(|place| self.node(*place, &[])).collect();
        nodes.push(nodes[0]);
        self.way(&nodes, tags)
    }

    fn done(self) -> String {
        self.text + "</osm>\n"
    }
}

fn xml(tags: &[(&str, &str)]) -> String {
    tags.iter().map(|(key, value)| format!("<tag k='{key}' v='{value}'/>")).collect()
}

fn read(text: &str) -> Building {
    parse("house", text, "house.osm", 3.6).unwrap()
}

fn refused(text: &str) -> String {
    parse("house", text, "house.osm", 3.6).unwrap_err().to_string()
}

/// The twin: walls and rooms as areas without walls.
fn twin() -> String {
    let plan = same::plan();
    let mut map = Map::new();
    for (floor, walls) in plan.building.floors.iter().zip(&plan.closed) {
        let level = floor.number.to_string();
        let level = ("level", level.as_str());
        for wall in walls {
            let nodes = wall.map(|place| map.node(place, &[]));
            map.way(&nodes, &[("indoor", "wall"), level]);
        }
        for door in &floor.doors {
            let width = format!("{:.2} m", geometry::length(&door.line));
            let is_entrance = floor.number == 0
                && plan.building.entrances.iter().any(|e| geometry::distance(e.place, door.line[0]) < 2.0);
            let mut tags = vec![("door", "yes"), ("width", width.as_str()), level];
            tags.extend(is_entrance.then_some(("entrance", "main")));
            map.node(geometry::between(door.line[0], door.line[1], 0.5), &tags);
        }
        for room in &floor.rooms {
            map.area(&room.outline, &[("indoor", "area"), ("name", &room.name), level]);
        }
    }
    for connector in &plan.building.connectors {
        let tag = if connector.kind == ConnectorKind::Elevator { "elevator" } else { "stairs" };
        map.area(&connector.outlines[0].1, &[(tag, "yes"), ("level", "0-1"), ("name", &connector.name)]);
    }
    map.done()
}

#[test]
fn the_twin_is_read_as_it_was_written() {
    let building = read(&twin());
    let twin = generate::twin(2);
    // The origin is a corner of what is indoors, rounded to metres: that of the twin, up to this.
    let [low, _] = building.bounds().unwrap();
    let [origin, _] = twin.bounds().unwrap();
    // Seven digits are 1.1 cm: a corner is 0.8 cm wrong at most, and merging moves it by up to 2 cm.
    same::assert_same(&building, &twin, [origin[0] - low[0], origin[1] - low[1]], 0.03);
    assert_eq!(building.entrances[0].name, "main");
}

/// Two rooms of 4 m by 5 m side by side, a corridor of 2 m before them, in a building; doors as nodes of the outlines.
fn rooms() -> Map {
    let mut map = Map::new();
    let place = |map: &mut Map, x: f64, y: f64| map.node([x, y], &[]);
    let corners: Vec<i64> =
        [(0.0, 0.0), (4.0, 0.0), (8.0, 0.0), (8.0, 5.0), (4.0, 5.0), (0.0, 5.0), (0.0, 7.0), (8.0, 7.0)]
            .iter()
            .map(|&(x, y)| place(&mut map, x, y))
            .collect();
    let [a, b, c, d, e, f, g, h] = corners[..] else { unreachable!() };
    let left = map.node([1.0, 5.0], &[("door", "hinged"), ("door:width", "80 cm")]);
    let right = map.node([4.1, 5.0], &[("door", "yes")]);
    let main = map.node([0.0, 6.0], &[("entrance", "main"), ("level", "0")]);
    map.way(&[a, b, e, left, f, a], &[("indoor", "room"), ("level", "0-1"), ("ref", "1"), ("room", "office")]);
    map.way(&[b, c, d, right, e, b], &[("indoor", "room"), ("level", "0;1")]);
    map.way(&[f, left, e, right, d, h, g, main, f], &[("indoor", "corridor"), ("level", "0"), ("repeat_on", "1")]);
    map.way(&[a, b, c, d, h, g, main, f, a], &[("building", "yes")]);
    map.area(&[[60.0, 0.0], [70.0, 0.0], [70.0, 10.0]], &[("building", "yes"), ("level", "roof")]);
    map
}

#[test]
fn rooms_share_walls_and_doors_open_them() {
    let building = read(&rooms().done());
    assert_eq!(building.floors.len(), 2);
    for floor in &building.floors {
        let total: f64 = floor.walls.iter().map(geometry::length).sum();
        // Around the building, between the rooms, and both rooms' walls to the corridor; less two doors, and the entrance.
        let doors = 0.8 + 0.9 + if floor.number == 0 { 0.9 } else { 0.0 };
        assert!((total - (30.0 + 5.0 + 8.0 - doors)).abs() < 0.06, "floor {}: {total}", floor.number);
        assert_eq!(floor.doors.len(), if floor.number == 0 { 3 } else { 2 });
        let names: Vec<_> = floor.rooms.iter().map(|room| (room.name.as_str(), room.usage.as_deref())).collect();
        assert_eq!(names, [("1", Some("office")), ("room", None), ("corridor", Some("corridor"))]);
    }
    // Beside the partition there is no room for half a door: it begins there.
    let door = building.floors[0].doors.iter().find(|door| door.line[0][0] > 3.5 || door.line[1][0] > 3.5).unwrap();
    let x = door.line.map(|[x, _]| x - building.bounds().unwrap()[0][0]);
    assert!((x[0].min(x[1]) - 4.0).abs() < 0.03 && (x[0].max(x[1]) - 4.9).abs() < 0.03, "{x:?}");
    let entrance = &building.entrances[0];
    assert_eq!((entrance.name.as_str(), entrance.floor), ("main", 0));
    assert!(building.floors[0].room_at(entrance.place).is_some_and(|room| room.name == "corridor"));
}

#[test]
fn steps_lines_cabin_nodes_and_multipolygons_are_read() {
    let mut map = rooms();
    let steps = [[1.0, 6.0], [1.0, 9.0], [3.0, 9.0]].map(|place| map.node(place, &[]));
    map.way(&steps, &[("highway", "steps"), ("level", "0-1"), ("width", "1.5")]);
    map.node([6.0, 6.0], &[("highway", "elevator"), ("level", "0;1"), ("name", "A &amp; B")]);
    // Stairs in the street have no level.
    map.way(&steps, &[("highway", "steps")]);
    let outer = [[20.0, 0.0], [30.0, 0.0], [30.0, 9.0], [20.0, 9.0]].map(|place| map.node(place, &[]));
    let halves = [map.way(&outer[..3], &[]), map.way(&[outer[0], outer[3], outer[2]], &[])];
    let hole = map.area(&[[24.0, 4.0], [25.0, 4.0], [25.0, 5.0]], &[]);
    writeln!(
        map.text,
        "<relation id='1'><member type='way' ref='{}' role='outer'/><member type='way' ref='{}' role='outer'/>\
         <member type='way' ref='{hole}' role='inner'/><tag k='type' v='multipolygon'/><tag k='indoor' v='room'/>\
         <tag k='level' v='1'/><tag k='name' v='Hall'/></relation>",
        halves[0], halves[1]
    )
    .unwrap();
    let building = read(&map.done());
    let kinds: Vec<_> = building.connectors.iter().map(|c| (c.kind, c.name.as_str(), c.outlines.len())).collect();
    assert_eq!(kinds, [(ConnectorKind::Elevator, "A & B", 2), (ConnectorKind::Stairs, "stairs-2", 2)]);
    // 5 m of steps, 1.5 m wide, less or more nothing: at the bend a square is shared and one is added.
    assert!((geometry::area(&building.connectors[1].outlines[0].1).abs() - 7.5).abs() < 0.1);
    let hall = building.room("Hall").unwrap();
    assert!((geometry::area(&hall.1.outline).abs() - 90.0).abs() < 0.5);
    assert_eq!(hall.0.number, 1);
}

#[test]
fn what_is_wrong_is_told() {
    assert!(refused("<osm").starts_with("house.osm is no OSM XML"));
    assert!(refused("<html/>").contains("outermost element is 'html'"));
    assert!(refused("<osm/>").contains("nothing in it has the key 'indoor'"));
    assert!(refused("<osm><node id='1' lat='x' lon='1'/></osm>").contains("node 1 has no 'lon' and 'lat'"));
    assert!(refused("<osm><node lat='1' lon='1'/></osm>").contains("a node has no number"));
    let with = |from: &str, to: &str| {
        let text = rooms().done();
        assert!(text.contains(from));
        refused(&text.replacen(from, to, 1))
    };
    assert!(with("v='0-1'", "v='0-x'").contains("'level=0-x' is no level"));
    assert!(with("v='80 cm'", "v='wide'").contains("the width 'wide' is none"));
    // A node on the other side of the earth is no place of this building.
    assert!(with("<node id='1' lat='", "<node id='1' lat='-").contains("from the origin"));
    // Deeply nested: refused, not a stack that is used up.
    let deep = format!("<osm>{}{}</osm>", "<a>".repeat(200_000), "</a>".repeat(200_000));
    assert!(!refused(&deep).is_empty());
}

proptest! {
    #[test]
    fn no_text_panics(text in ".{0,200}", cut in 0_usize..6_000, at in 0_usize..6_000, with in ".{0,4}") {
        let _ = parse("x", &text, "x", 3.0);
        let whole = rooms().done();
        let part = |to: usize| whole.chars().take(to).collect::<String>();
        prop_assert!(cut >= whole.len() - 1 || parse("x", &part(cut), "x", 3.0).is_err());
        let changed = format!("{}{with}{}", part(at), whole.chars().skip(at + 2).collect::<String>());
        let _ = parse("x", &changed, "x", 3.0);
    }
}
