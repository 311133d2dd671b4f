//! Reads floor plans of the indoor-location competition 2020 (xyz10): a GeoJSON file whose first feature is the border of
//! the floor and whose others are shops, and a file with the size of the floor's image in metres.
//!
//! The borders of shops and of the floor are walls. Nobody drew the doors of the shops: the walks lead past them. The frame
//! is that of the way-points: metres from the lower left corner of the image.

use super::error::Error;
use super::features;
use super::geometry::{self, Outline, Point};
use super::model::{Building, Floor, Room};

/// `floor_info.json`.
#[derive(Debug, serde::Deserialize)]
struct Info {
    map_info: Size,
}

#[derive(Debug, serde::Deserialize)]
struct Size {
    height: f64,
    width: f64,
}

/// The floor of `map` (`geojson_map.json`) and `info` (`floor_info.json`); `file` names the map in errors.
///
/// # Errors
/// When a text is not of the format.
pub fn parse(name: &str, number: i32, map: &str, info: &str, file: &str) -> Result<Building, Error> {
    let wrong = |what: String| Error::Format { file: file.to_owned(), format: "xyz10 floor", what };
    let info: Info = serde_json::from_str(info).map_err(|error| wrong(format!("floor_info.json: {error}")))?;
    let Size { height, width } = info.map_info;
    if !(1.0..5_000.0).contains(&height) || !(1.0..5_000.0).contains(&width) {
        return Err(wrong(format!("the image is {width} m by {height} m")));
    }
    let features = features::features(features::collection(map, file)?, file)?;
    let border = features.iter().find(|feature| feature.text("type").as_deref() == Some("floor")).or(features.first());
    let points = border.iter().flat_map(|feature| feature.polygons.iter().flatten().flatten().copied());
    let Some([low, high]) = geometry::bounds(points) else {
        return Err(wrong("it has no border of the floor".to_owned()));
    };
    if !(high[0] > low[0] && high[1] > low[1]) {
        return Err(wrong("the border of the floor has no area".to_owned()));
    }
    let place = |point: &Point| {
        [(point[0] - low[0]) / (high[0] - low[0]) * width, (point[1] - low[1]) / (high[1] - low[1]) * height]
    };
    let mut floor = Floor { number, name: format!("F{number}"), ..Floor::default() };
    for feature in &features {
        for (ring, outline) in feature.polygons.iter().flat_map(|polygon| polygon.iter().enumerate()) {
            let outline: Outline = outline.iter().map(place).collect();
            floor.walls.extend(geometry::sides(&outline));
            let is_shop = ring == 0 && feature.index > 1 && outline.len() > 2;
            if let Some(name) = feature.text("name").filter(|_| is_shop) {
                floor.rooms.push(Room { name, usage: Some("shop".to_owned()), outline });
            }
        }
    }
    Building { name: name.to_owned(), floors: vec![floor], ..Building::default() }.assembled()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_spans_the_image() {
        let map = r#"{"type":"FeatureCollection","features":[
            {"type":"Feature","properties":{"name":"F4","type":"floor"},"geometry":{"type":"MultiPolygon",
             "coordinates":[[[[120.0,30.0],[120.002,30.0],[120.002,30.001],[120.0,30.001],[120.0,30.0]]]]}},
            {"type":"Feature","properties":{"name":"shop"},"geometry":{"type":"Polygon",
             "coordinates":[[[120.001,30.0],[120.002,30.0],[120.002,30.0005],[120.001,30.0]]]}}]}"#;
        let building = parse("mall", 4, map, r#"{"map_info":{"height":100.0,"width":200.0}}"#, "map").unwrap();
        let floor = &building.floors[0];
        assert_eq!((floor.walls.len(), floor.rooms.len()), (7, 1));
        assert!(geometry::distance(floor.rooms[0].outline[0], [100.0, 0.0]) < 1e-6);
        assert!(geometry::distance(floor.rooms[0].outline[2], [200.0, 50.0]) < 1e-6);
        assert!(parse("mall", 4, map, "{}", "map").unwrap_err().to_string().contains("floor_info.json"));
    }
}
