//! Reads floor plans as poslab (HafenCity University Hamburg) keeps them: one GeoJSON file a floor, longitude and latitude,
//! polygons with IFC classes.
//!
//! Walls and facades are solid: their borders are walls. Doors lie in walls as polygons of their own; what of a wall lies
//! along a door is taken out. Spaces are rooms; where one ends with nothing beyond, the floor ends and there is a wall, too.
//! Staircases and elevators join floors where they lie above each other.

use super::edge::open_edges;
use super::error::Error;
use super::features::{self, RawFeature};
use super::geojson::project;
use super::geometry::{self, Outline, Point, Segment};
use super::georeference::Georeference;
use super::model::{Building, ConnectorKind, Door, Floor, Room};
use super::opening::{self, Opening};
use super::stacked::{self, Part};

/// A floor file.
#[derive(Clone, Debug)]
pub struct FloorFile<'a> {
    /// Number of the floor.
    pub number: i32,
    /// What it is called.
    pub name: &'a str,
    /// Above the origin. **Units:** m.
    pub height_m: f64,
    /// The text of the file.
    pub text: &'a str,
    /// Its name in errors.
    pub file: &'a str,
}

/// Doors reach so far beyond the walls that they open. **Units:** m.
const DOOR_REACH_M: f64 = 0.12;

/// The building of some floors. The origin is a corner of the first.
///
/// # Errors
/// When a text is no GeoJSON of this dialect, or the floors do not make a building.
pub fn parse(name: &str, files: &[FloorFile<'_>]) -> Result<Building, Error> {
    let mut building = Building { name: name.to_owned(), ..Building::default() };
    let mut stairs = Vec::new();
    for file in files {
        let mut features = features::features(features::collection(file.text, file.file)?, file.file)?;
        if building.georeference == Georeference::Local {
            let points = features.iter().flat_map(|feature| feature.polygons.iter().flatten().flatten().copied());
            let Some([low, _]) = geometry::bounds(points) else { continue };
            building.georeference = Georeference::around(low[0], low[1])?;
        }
        if let Some(projection) = building.georeference.projection()? {
            for feature in &mut features {
                project(feature, &projection).map_err(|error| feature.error(file.file, error.to_string()))?;
            }
        }
        building.floors.push(floor(file, &features)?);
        stairs.extend(parts(file.number, &features));
    }
    building.connectors = stacked::join(stairs)?;
    building.assembled()
}

fn floor(file: &FloorFile<'_>, features: &[RawFeature]) -> Result<Floor, Error> {
    let mut floor =
        Floor { number: file.number, name: file.name.to_owned(), height_m: file.height_m, ..Floor::default() };
    let mut doors: Vec<Opening> = Vec::new();
    let mut solids: Vec<Vec<Outline>> = Vec::new();
    for feature in features {
        let class = feature.text("ifc_class").ok_or_else(|| feature.error(file.file, "it has no 'ifc_class'"))?;
        let outlines =
            feature.polygons.iter().filter_map(|polygon| polygon.first()).filter(|outline| outline.len() > 2);
        match &class.to_lowercase()[..] {
            "ifcwall" | "ifcfacade" => {
                floor.walls.extend(feature.polygons.iter().flatten().flat_map(|ring| geometry::sides(ring)));
                solids.extend(feature.polygons.iter().cloned());
            }
            "ifcdoor" => {
                for outline in outlines {
                    if let Some(line) = geometry::middle_line(outline) {
                        floor.doors.push(Door { line, name: feature.text("spaceID").filter(|name| name != "Door") });
                        solids.push(vec![outline.clone()]);
                        doors.push(Opening { line, depth_m: thickness(outline, &line) / 2.0 + DOOR_REACH_M });
                    }
                }
            }
            _ => {
                let usage = feature.text("usage").filter(|usage| usage != "Empty");
                let name = feature.text("spaceID").filter(|name| name != "Empty");
                for outline in outlines {
                    if let Some(name) = name.clone().or_else(|| usage.clone()) {
                        floor.rooms.push(Room { name, usage: usage.clone(), outline: outline.clone() });
                    }
                }
            }
        }
    }
    let rooms: Vec<Outline> = floor.rooms.iter().map(|room| room.outline.clone()).collect();
    floor.walls.extend(open_edges(&rooms, solids));
    floor.walls = opening::cut(&floor.walls, &doors)?;
    Ok(floor)
}

/// How thick an outline is across a line along it.
fn thickness(outline: &[Point], line: &Segment) -> f64 {
    let length = geometry::length(line).max(1e-6);
    let across = [-(line[1][1] - line[0][1]) / length, (line[1][0] - line[0][0]) / length];
    let places = outline.iter().map(|point| point[0] * across[0] + point[1] * across[1]);
    let (low, high) =
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| (low.min(place), high.max(place)));
    high - low
}

/// Staircases and elevators of a floor.
fn parts(floor: i32, features: &[RawFeature]) -> impl Iterator<Item = Part> {
    features.iter().flat_map(move |feature| {
        let usage = feature.text("usage").unwrap_or_default().to_lowercase();
        let kind = match &usage[..] {
            "staircase" | "stairs" | "srairs" => Some(ConnectorKind::Stairs),
            "elevator" => Some(ConnectorKind::Elevator),
            _ => None,
        };
        let outlines = feature.polygons.iter().filter_map(|polygon| polygon.first());
        let outlines = outlines.filter(|outline| outline.len() > 2).cloned();
        kind.into_iter()
            .flat_map(move |kind| outlines.clone().map(move |outline| Part { floor, kind, name: None, outline }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_door_opens_the_wall_it_lies_in() {
        // A wall of 8.9 m by 0.2 m, and a door of 0.9 m in its middle.
        let degrees = |x: f64, y: f64| [10.0 + x / 66_400.0, 53.5 + y / 111_300.0];
        let ring = |low: [f64; 2], high: [f64; 2]| {
            let corners =
                [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]], [low[0], low[1]]];
            serde_json::json!([corners.map(|[x, y]| degrees(x, y))])
        };
        let feature = |class: &str, usage: &str, ring: serde_json::Value| {
            serde_json::json!({"type": "Feature", "properties": {"ifc_class": class, "usage": usage, "spaceID": "4 001"},
                "geometry": {"type": "Polygon", "coordinates": ring}})
        };
        let text = serde_json::json!({"type": "FeatureCollection", "features": [
            feature("IfcWall", "Wall", ring([0.0, 0.0], [8.9, 0.2])),
            feature("IfcDoor", "Door", ring([4.0, 0.0], [4.9, 0.2])),
            feature("IfcSpace", "Office", ring([0.0, 0.2], [8.9, 5.0])),
        ]})
        .to_string();
        let file = FloorFile { number: 4, name: "4OG", height_m: 0.0, text: &text, file: "4OG.geojson" };
        let building = parse("house", &[file]).unwrap();
        let floor = &building.floors[0];
        let total: f64 = floor.walls.iter().map(geometry::length).sum();
        // Both long sides lose the door; the degrees above are metres to a percent.
        let wall = 2.0 * 8.9 + 2.0 * 0.2 - 2.0 * 0.9;
        // Beyond the other three sides of the room there is nothing: there the floor ends.
        assert!((total - (wall + 8.9 + 2.0 * 4.8)).abs() < 0.1, "{total}");
        assert!((geometry::length(&floor.doors[0].line) - 0.9).abs() < 0.01);
        assert_eq!((floor.rooms[0].name.as_str(), floor.rooms[0].usage.as_deref()), ("4 001", Some("Office")));
        assert!(matches!(building.georeference, Georeference::Utm { epsg: 32_632, .. }));
    }
}
