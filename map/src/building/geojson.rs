//! The project's own format: GeoJSON, with all floors in one file, as any GIS shows and edits it.
//!
//! A feature collection (RFC 7946) with the foreign member `sohle_building`:
//! ```json
//! {"version": 1, "name": "House", "georeference": {"kind": "utm", "epsg": 32632, "origin": [566500, 5932800]},
//!  "floors": [{"number": 0, "name": "EG", "height_m": 0.0}]}
//! ```
//! Every feature has the properties `kind` and `floor`: `wall` (lines), `door` (a line of two points), `room` (a polygon,
//! with `name` and `usage`), `stairs`, `ramp`, `elevator` (a polygon for each floor; those of one `name` belong together; the
//! first may have `way`, a list of x, y, z in metres), `entrance` (a point, with `name` and maybe `beacon`), `path` (lines of the walk graph: a
//! node is where a line begins, bends or ends, a third coordinate its height in metres; those that climb have `to_floor`).
//! Coordinates are longitude and
//! latitude; of a building that is somewhere (`"kind": "local"`) they are metres, and `crs_note` says so.

use super::error::Error;
use super::features::{self, RawFeature};
use super::geometry::{Outline, Point, Segment};
use super::georeference::{Georeference, Projection};
use super::model::{Building, Connector, ConnectorKind, Door, Entrance, Floor, Node, Room, WalkGraph};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The foreign member that makes a feature collection a building.
const MEMBER: &str = "sohle_building";
/// Of the format.
const VERSION: u32 = 1;

/// What the foreign member holds.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    version: u32,
    name: String,
    georeference: Georeference,
    floors: Vec<FloorHeader>,
}

#[derive(Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct FloorHeader {
    number: i32,
    name: String,
    height_m: f64,
}

/// The building of a text; `file` names it in errors.
///
/// # Errors
/// When the text is not of the format, a feature makes no sense, or the parts do not make a building.
pub fn parse(text: &str, file: &str) -> Result<Building, Error> {
    let collection = features::collection(text, file)?;
    let wrong = |what: String| Error::Format { file: file.to_owned(), format: "Sohle building", what };
    let header = collection.foreign_members.as_ref().and_then(|members| members.get(MEMBER)).cloned();
    let header = header.ok_or_else(|| wrong(format!("it has no member '{MEMBER}'")))?;
    let header: Header = serde_json::from_value(header).map_err(|error| wrong(format!("'{MEMBER}': {error}")))?;
    if header.version != VERSION {
        return Err(wrong(format!("it is of version {}, this program reads version {VERSION}", header.version)));
    }
    let mut building = Building {
        name: header.name,
        georeference: header.georeference,
        floors: header
            .floors
            .into_iter()
            .map(|floor| Floor { number: floor.number, name: floor.name, height_m: floor.height_m, ..Floor::default() })
            .collect(),
        ..Building::default()
    };
    let projection = building.georeference.projection()?;
    let mut paths = Paths::default();
    for mut feature in features::features(collection, file)? {
        if let Some(projection) = &projection {
            project(&mut feature, projection).map_err(|error| feature.error(file, error.to_string()))?;
        }
        if feature.text("kind").as_deref() == Some("path") {
            paths.add(&building.floors, &feature).map_err(|what| feature.error(file, what))?;
        } else {
            add(&mut building, &feature).map_err(|what| feature.error(file, what))?;
        }
    }
    building.graph = (!paths.graph.edges.is_empty()).then_some(paths.graph);
    building.assembled()
}

/// Into the frame of the building.
pub(super) fn project(feature: &mut RawFeature, projection: &Projection) -> Result<(), Error> {
    let lines = feature.lines.iter_mut().chain(feature.polygons.iter_mut().flatten());
    for point in feature.points.iter_mut().chain(lines.flatten()) {
        *point = projection.to_building(*point)?;
    }
    Ok(())
}

fn add(building: &mut Building, feature: &RawFeature) -> Result<(), String> {
    let kind = feature.text("kind").ok_or("it has no 'kind'")?;
    let number = feature.integer("floor").ok_or("it has no 'floor' that is a whole number")?;
    let name = feature.text("name");
    let outline = || match &feature.polygons[..] {
        [polygon] => polygon.first().cloned().ok_or_else(|| "its polygon is empty".to_owned()),
        _ => Err(format!("a {kind} is one polygon")),
    };
    let floor = building.floors.iter_mut().find(|floor| floor.number == number);
    let Some(floor) = floor else { return Err(format!("floor {number} is not among the floors of '{MEMBER}'")) };
    if let Some(kind) = ConnectorKind::ALL.into_iter().find(|other| other.word() == kind) {
        let name = name.ok_or_else(|| format!("{} need a 'name' that joins their floors", kind.word()))?;
        return add_connector(&mut building.connectors, feature, kind, name, number, outline()?);
    }
    match &kind[..] {
        "wall" => {
            if feature.lines.iter().all(|line| line.len() < 2) {
                return Err("a wall is made of lines".to_owned());
            }
            let pieces = feature.lines.iter().flat_map(|line| line.windows(2));
            floor.walls.extend(pieces.map(|pair| [pair[0], pair[1]]));
        }
        "door" => match &feature.lines[..] {
            [line] if line.len() == 2 => floor.doors.push(Door { line: [line[0], line[1]], name }),
            _ => return Err("a door is a line of two points".to_owned()),
        },
        "room" => floor.rooms.push(Room {
            name: name.ok_or("a room needs a 'name'")?,
            usage: feature.text("usage"),
            outline: outline()?,
        }),
        "entrance" => match feature.points[..] {
            [place] => {
                let name = name.ok_or("an entrance needs a 'name'")?;
                let beacon = feature.text("beacon");
                building.entrances.push(Entrance { name, floor: number, place, beacon });
            }
            _ => return Err("an entrance is a point".to_owned()),
        },
        other => {
            return Err(format!(
                "'{other}' is no kind: wall, door, room, stairs, ramp, elevator, entrance and path are"
            ));
        }
    }
    Ok(())
}

fn add_connector(
    connectors: &mut Vec<Connector>,
    feature: &RawFeature,
    kind: ConnectorKind,
    name: String,
    floor: i32,
    outline: Outline,
) -> Result<(), String> {
    let way = match feature.properties.get("way") {
        None => Vec::new(),
        Some(way) => serde_json::from_value(way.clone()).map_err(|error| format!("'way': {error}"))?,
    };
    match connectors.iter_mut().find(|other| other.name == name) {
        None => connectors.push(Connector { name, kind, outlines: vec![(floor, outline)], way }),
        Some(other) if other.kind != kind => {
            return Err(format!("'{name}' is {} and {}", other.kind.word(), kind.word()));
        }
        Some(other) => {
            other.outlines.push((floor, outline));
            if other.way.is_empty() {
                other.way = way;
            }
        }
    }
    Ok(())
}

/// Paths put together to a graph.
#[derive(Default)]
struct Paths {
    graph: WalkGraph,
    /// Nodes by floor and by place in [`NODE_M`].
    found: BTreeMap<(i32, [i64; 3]), usize>,
}

/// Ends of paths that are nearer than this are one node. **Units:** m.
const NODE_M: f64 = 1e-3;

impl Paths {
    fn add(&mut self, floors: &[Floor], feature: &RawFeature) -> Result<(), String> {
        let from = feature.integer("floor").ok_or("it has no 'floor' that is a whole number")?;
        let to = match feature.properties.get("to_floor") {
            None => from,
            Some(_) => feature.integer("to_floor").ok_or("'to_floor' is no whole number")?,
        };
        let height = |number: i32| {
            let floor = floors.iter().find(|floor| floor.number == number);
            floor.map(|floor| floor.height_m).ok_or(format!("floor {number} is not among the floors of '{MEMBER}'"))
        };
        let heights = [height(from)?, height(to)?];
        if feature.lines.iter().all(|line| line.len() < 2) {
            return Err("a path is made of lines".to_owned());
        }
        for (line, drawn) in feature.lines.iter().zip(&feature.line_heights) {
            if from != to && line.len() != 2 {
                return Err("a path that climbs is made of lines of two points".to_owned());
            }
            for (pair, drawn) in line.windows(2).zip(drawn.windows(2)) {
                let mut edge = [0; 2];
                for end in 0..2 {
                    let height_m = drawn[end].unwrap_or(heights[end]);
                    edge[end] = self.node(Node { floor: [from, to][end], place: pair[end], height_m });
                }
                self.graph.edges.push(edge);
            }
        }
        Ok(())
    }

    fn node(&mut self, node: Node) -> usize {
        let cell = [node.place[0], node.place[1], node.height_m].map(|value| (value / NODE_M).round() as i64);
        let nodes = &mut self.graph.nodes;
        *self.found.entry((node.floor, cell)).or_insert_with(|| {
            nodes.push(node);
            nodes.len() - 1
        })
    }
}

/// The text of a building: one feature for all walls of a floor, one for each other part. Coordinates are rounded to the
/// millimetre, or to what a tenth of one is in degrees.
///
/// # Errors
/// For an EPSG code that is no UTM zone.
pub fn write(building: &Building) -> Result<String, Error> {
    let place = Placer { projection: building.georeference.projection()? };
    let mut features = Vec::new();
    for floor in &building.floors {
        // A feature without lines could not be read again.
        if !floor.walls.is_empty() {
            let geometry = json!({"type": "MultiLineString", "coordinates": place.lines(&floor.walls)?});
            features.push(feature("wall", floor.number, None, geometry));
        }
        for door in &floor.doors {
            let line = door.line.iter().map(|point| place.point(*point)).collect::<Result<Vec<_>, _>>()?;
            let geometry = json!({"type": "LineString", "coordinates": line});
            features.push(feature("door", floor.number, door.name.as_deref(), geometry));
        }
        for room in &floor.rooms {
            let mut room_feature = feature("room", floor.number, Some(&room.name), place.polygon(&room.outline)?);
            if let Some(usage) = &room.usage {
                room_feature["properties"]["usage"] = json!(usage);
            }
            features.push(room_feature);
        }
    }
    for connector in &building.connectors {
        for (index, (floor, outline)) in connector.outlines.iter().enumerate() {
            let geometry = place.polygon(outline)?;
            let mut part = feature(connector.kind.word(), *floor, Some(&connector.name), geometry);
            if index == 0 && !connector.way.is_empty() {
                let way: Vec<_> = connector.way.iter().map(|point| point.map(millimetres)).collect();
                part["properties"]["way"] = json!(way);
            }
            features.push(part);
        }
    }
    for entrance in &building.entrances {
        let geometry = json!({"type": "Point", "coordinates": place.point(entrance.place)?});
        let mut point = feature("entrance", entrance.floor, Some(&entrance.name), geometry);
        if let Some(beacon) = &entrance.beacon {
            point["properties"]["beacon"] = json!(beacon);
        }
        features.push(point);
    }
    if let Some(graph) = &building.graph {
        features.extend(place.paths(graph)?);
    }
    let header = Header {
        version: VERSION,
        name: building.name.clone(),
        georeference: building.georeference,
        floors: building
            .floors
            .iter()
            .map(|floor| FloorHeader { number: floor.number, name: floor.name.clone(), height_m: floor.height_m })
            .collect(),
    };
    let header = json!(header).to_string();
    let note = if place.projection.is_none() { "\"crs_note\": \"metres, x east, y north\",\n" } else { "" };
    // A feature to a line: differences of two versions of a building can be read.
    let lines: Vec<_> = features.iter().map(Value::to_string).collect();
    Ok(format!(
        "{{\"type\": \"FeatureCollection\",\n\"{MEMBER}\": {header},\n{note}\"features\": [\n{}\n]}}\n",
        lines.join(",\n")
    ))
}

fn feature(kind: &str, floor: i32, name: Option<&str>, geometry: Value) -> Value {
    let mut properties = json!({"kind": kind, "floor": floor});
    if let Some(name) = name {
        properties["name"] = json!(name);
    }
    json!({"type": "Feature", "properties": properties, "geometry": geometry})
}

fn millimetres(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Writes places as the file has them.
struct Placer {
    projection: Option<Projection>,
}

impl Placer {
    fn point(&self, point: Point) -> Result<Point, Error> {
        match &self.projection {
            None => Ok(point.map(millimetres)),
            Some(projection) => Ok(projection.to_earth(point)?.map(|degrees| (degrees * 1e9).round() / 1e9)),
        }
    }

    /// Walls that go on from one to the next become one line.
    fn lines(&self, walls: &[Segment]) -> Result<Vec<Vec<Point>>, Error> {
        let mut lines: Vec<Vec<Point>> = Vec::new();
        let mut end = None;
        for wall in walls {
            if end != Some(wall[0]) {
                lines.push(vec![self.point(wall[0])?]);
            }
            if let Some(line) = lines.last_mut() {
                line.push(self.point(wall[1])?);
            }
            end = Some(wall[1]);
        }
        Ok(lines)
    }

    /// One feature for all edges between the same two floors.
    fn paths(&self, graph: &WalkGraph) -> Result<Vec<Value>, Error> {
        let mut groups: BTreeMap<[i32; 2], Vec<[[f64; 3]; 2]>> = BTreeMap::new();
        for edge in &graph.edges {
            let mut ends = edge.map(|index| graph.nodes[index]);
            ends.sort_by_key(|node| node.floor);
            let mut line = [[0.0; 3]; 2];
            for (written, node) in line.iter_mut().zip(ends) {
                let [x, y] = self.point(node.place)?;
                *written = [x, y, millimetres(node.height_m)];
            }
            groups.entry(ends.map(|node| node.floor)).or_default().push(line);
        }
        let write = |([from, to], lines): ([i32; 2], Vec<_>)| {
            let mut part = feature("path", from, None, json!({"type": "MultiLineString", "coordinates": lines}));
            if from != to {
                part["properties"]["to_floor"] = json!(to);
            }
            part
        };
        Ok(groups.into_iter().map(write).collect())
    }

    fn polygon(&self, outline: &[Point]) -> Result<Value, Error> {
        let mut ring = outline.iter().map(|point| self.point(*point)).collect::<Result<Vec<_>, _>>()?;
        ring.extend(ring.first().copied());
        Ok(json!({"type": "Polygon", "coordinates": [ring]}))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn house(georeference: Georeference, corner: f64) -> Building {
        let square = vec![[0.0, 0.0], [corner, 0.0], [corner, 4.5], [0.0, 4.5]];
        let floor = |number: i32| Floor {
            number,
            name: format!("F{number}"),
            height_m: 3.5 * f64::from(number),
            walls: vec![[[0.0, 0.0], [corner, 0.0]], [[corner, 0.0], [corner, 4.5]], [[1.0, 1.0], [2.0, 1.0]]],
            doors: vec![Door { line: [[0.0, 1.0], [0.0, 2.0]], name: (number == 0).then(|| "front".to_owned()) }],
            rooms: vec![Room { name: "a \"room\"".into(), usage: Some("office".into()), outline: square.clone() }],
        };
        let connector = |name: &str, kind, way| Connector {
            name: name.to_owned(),
            kind,
            outlines: vec![(0, square.clone()), (1, square.clone())],
            way,
        };
        let node = |floor, place, height_m| Node { floor, place, height_m };
        let nodes = vec![
            node(0, [0.0, 1.5], 0.0),
            node(0, [0.5, 0.5], 0.0),
            node(0, [0.5, 4.0], 1.75),
            node(1, [0.5, 0.5], 3.5),
        ];
        let graph = WalkGraph { nodes, edges: vec![[0, 1], [1, 2], [2, 3]] };
        Building {
            name: "House".into(),
            georeference,
            floors: vec![floor(0), floor(1)],
            connectors: vec![
                connector("s1", ConnectorKind::Stairs, vec![[0.5, 0.5, 0.0], [0.5, 4.0, 3.5]]),
                connector("e1", ConnectorKind::Elevator, Vec::new()),
            ],
            entrances: vec![Entrance { name: "main".into(), floor: 0, place: [0.0, 1.5], beacon: Some("40".into()) }],
            graph: Some(graph),
        }
        .assembled()
        .unwrap()
    }

    #[test]
    fn a_local_building_is_read_as_it_was_written() {
        let building = house(Georeference::Local, 5.125);
        let text = write(&building).unwrap();
        assert_eq!(parse(&text, "house").unwrap(), building);
        assert!(text.contains("crs_note"));
    }

    fn place() -> impl Strategy<Value = Point> {
        // Millimetres, as they are written.
        [-400_000_i32..400_000, -400_000_i32..400_000].prop_map(|place| place.map(|value| f64::from(value) / 1e3))
    }

    fn any_floor() -> impl Strategy<Value = Floor> {
        let wall = prop::collection::vec((place(), place()).prop_map(|(a, b)| [a, b]), 0..6);
        let door = (place(), place(), prop::option::of("[a-z]{1,4}"));
        let doors = prop::collection::vec(door.prop_map(|(a, b, name)| Door { line: [a, b], name }), 0..4);
        let outline = prop::collection::vec(place(), 3..7).prop_filter("open", |ring| ring.first() != ring.last());
        let room = ("[a-z\"\\\\ü/]{1,6}", prop::option::of("[a-z]{1,6}"), outline);
        let rooms = prop::collection::vec(room.prop_map(|(name, usage, outline)| Room { name, usage, outline }), 0..4);
        (wall, doors, rooms, "[a-z ]{0,5}").prop_map(|(walls, doors, rooms, name)| Floor {
            name,
            walls,
            doors,
            rooms,
            ..Floor::default()
        })
    }

    fn any_building() -> impl Strategy<Value = Building> {
        let nodes = prop::collection::vec((0..3_i32, place(), 0..9_000_i32), 2..6);
        (prop::collection::vec(any_floor(), 3), -9..9_i32, nodes, any::<bool>(), place()).prop_map(
            |(mut floors, lowest, nodes, drawn, entrance)| {
                for (number, floor) in (lowest..).zip(&mut floors) {
                    (floor.number, floor.height_m) = (number, f64::from(number) * 3.21);
                }
                let edges = (1..nodes.len()).map(|node| [node - 1, node]).collect();
                let node =
                    |(floor, place, height)| Node { floor: lowest + floor, place, height_m: f64::from(height) / 1e3 };
                let graph = WalkGraph { nodes: nodes.into_iter().map(node).collect(), edges };
                let entrances = vec![Entrance { name: "main".into(), floor: lowest, place: entrance, beacon: None }];
                let graph = drawn.then_some(graph);
                Building { name: "any".into(), floors, entrances, graph, ..Building::default() }.assembled().unwrap()
            },
        )
    }

    proptest! {
        #[test]
        fn any_local_building_is_read_as_it_was_written(building in any_building()) {
            let text = write(&building).unwrap();
            let back = parse(&text, "any").unwrap();
            prop_assert_eq!(&write(&back).unwrap(), &text);
            // Nodes are numbered anew: the text above has compared their edges.
            let bare = |building: &Building| Building { graph: None, ..building.clone() };
            prop_assert_eq!(bare(&back), bare(&building));
        }

        #[test]
        fn a_building_on_earth_is_read_to_a_tenth_of_a_millimetre(
            longitude in -179.0_f64..179.0, latitude in -80.0_f64..80.0, corner in 1.0_f64..100.0,
            plane in any::<bool>(), rotation_deg in -180.0_f64..180.0,
        ) {
            let zone = Georeference::around(longitude, latitude).unwrap();
            let plane = plane.then_some(Georeference::Geographic { origin: [longitude, latitude], rotation_deg });
            let building = house(plane.unwrap_or(zone), corner);
            let back = parse(&write(&building).unwrap(), "house").unwrap();
            prop_assert_eq!(back.georeference, building.georeference);
            prop_assert_eq!(back.floors.len(), 2);
            for (a, b) in building.floors.iter().flat_map(Floor::points).zip(back.floors.iter().flat_map(Floor::points)) {
                prop_assert!((a[0] - b[0]).abs() < 2e-4 && (a[1] - b[1]).abs() < 2e-4, "{:?} {:?}", a, b);
            }
            prop_assert_eq!(back.connectors.len(), 2);
        }

        #[test]
        fn no_text_panics(text in ".{0,200}", cut in 0_usize..2_000) {
            let _ = parse(&text, "x");
            let whole = write(&house(Georeference::Local, 5.0)).unwrap();
            let cut: String = whole.chars().take(cut).collect();
            if cut.len() + 3 < whole.len() {
                prop_assert!(parse(&cut, "x").is_err());
            }
        }
    }

    #[test]
    fn the_example_for_people_is_a_building() {
        let page = include_str!("../../../docs/building.md");
        let example = page.split("```json").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
        let building = parse(example, "docs/building.md").unwrap();
        assert_eq!((building.floors.len(), building.floors[0].walls.len()), (2, 5));
        assert_eq!(building.floors[0].room_at([1.0, 1.0]).unwrap().name, "Hall");
    }

    #[test]
    fn what_is_wrong_is_told_with_its_feature() {
        let text = write(&house(Georeference::Local, 5.0)).unwrap();
        let message = |from: &str, to: &str| parse(&text.replacen(from, to, 1), "h.geojson").unwrap_err().to_string();
        assert_eq!(
            message("\"kind\":\"door\"", "\"kind\":\"dor\""),
            "h.geojson, feature 2: 'dor' is no kind: wall, door, room, stairs, ramp, elevator, entrance and path are"
        );
        assert_eq!(
            message("\"floor\":0,\"kind\":\"door\"", "\"floor\":7,\"kind\":\"door\""),
            "h.geojson, feature 2: floor 7 is not among the floors of 'sohle_building'"
        );
        assert_eq!(message("sohle_building", "x"), "h.geojson is no Sohle building: it has no member 'sohle_building'");
        assert_eq!(
            message("\"version\":1", "\"version\":2"),
            "h.geojson is no Sohle building: it is of version 2, this program reads version 1"
        );
        assert!(message("\"type\": \"FeatureCollection\"", "\"type\": \"Fea\"").starts_with("h.geojson is no GeoJSON"));
    }
}
