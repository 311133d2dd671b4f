//! A walk as GeoJSON: the paths as lines, one for each floor that they are on at a time, and a point for each step.
//!
//! In longitude and latitude where the building is somewhere on the earth; else in the metres of the building, which the
//! member `crs_note` says.

use super::walk::{Point, Walk, runs};
use ::geojson::{Feature, FeatureCollection, GeoJson, Geometry, JsonObject, JsonValue, Position};

/// The text of the file.
pub fn text(walk: &Walk<'_>) -> String {
    let mut features = Vec::new();
    for (path, points) in [("live", &walk.live), ("corrected", &walk.corrected)] {
        for run in runs(points) {
            features.extend(lines(walk, path, run));
        }
        features.extend(points.iter().map(|point| dot(walk, path, point)));
    }
    let note = match walk.projection {
        Some(_) => "WGS84; heights are metres above the origin of the building",
        None => "not WGS84: coordinates are x, y, z in metres in the frame of the building",
    };
    let members = [("name", walk.name.into()), ("crs_note", note.into())];
    let collection = FeatureCollection { bbox: None, features, foreign_members: Some(properties(members)) };
    let mut text = GeoJson::from(collection).to_string();
    text.push('\n');
    text
}

/// A line for each floor; it begins where the one before ends, so that nothing is missing on the stairs.
fn lines(walk: &Walk<'_>, path: &str, run: &[Point]) -> Vec<Feature> {
    let mut lines = Vec::new();
    let mut begin = 0;
    for part in run.chunk_by(|a, b| a.floor == b.floor) {
        let end = begin + part.len();
        let points = &run[begin.saturating_sub(1)..end];
        begin = end;
        // A line needs two points (RFC 7946, section 3.1.4).
        if points.len() < 2 {
            continue;
        }
        let geometry = Geometry::new_line_string(points.iter().map(|point| place(walk, point)).collect::<Vec<_>>());
        let times = points.iter().map(|point| JsonValue::from(point.time.as_seconds())).collect();
        let stamps = points.iter().map(stamp).collect();
        lines.push(feature(
            geometry,
            properties([
                ("path", path.into()),
                ("floor", part[0].floor.into()),
                ("time_s", JsonValue::Array(times)),
                ("time", JsonValue::Array(stamps)),
            ]),
        ));
    }
    lines
}

fn dot(walk: &Walk<'_>, path: &str, point: &Point) -> Feature {
    let said = point.said;
    feature(
        Geometry::new_point(place(walk, point)),
        properties([
            ("path", path.into()),
            ("step", point.step.into()),
            ("time_s", point.time.as_seconds().into()),
            ("time", stamp(point)),
            ("floor", point.floor.into()),
            ("sigma_m", round(point.sigma_m, 3).into()),
            ("state", said.map_or(JsonValue::Null, |(state, _)| state.word().into())),
            ("probability", said.map_or(JsonValue::Null, |(_, probability)| round(probability, 4).into())),
        ]),
    )
}

/// The date, where it is known.
fn stamp(point: &Point) -> JsonValue {
    point.unix_us.map_or(JsonValue::Null, |_| point.stamp().into())
}

fn place(walk: &Walk<'_>, point: &Point) -> Position {
    let [x, y, z] = point.position;
    let earth = walk.projection.and_then(|projection| projection.to_earth([x, y]).ok());
    // Nine digits of a degree are a tenth of a millimetre.
    let ([x, y], digits) = earth.map_or(([x, y], 3), |earth| (earth, 9));
    Position::from(vec![round(x, digits), round(y, digits), round(z, 3)])
}

fn feature(geometry: Geometry, properties: JsonObject) -> Feature {
    Feature { geometry: Some(geometry), properties: Some(properties), ..Feature::default() }
}

fn properties<const N: usize>(entries: [(&str, JsonValue); N]) -> JsonObject {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn round(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    // Adding zero turns a negative zero into zero.
    (value * scale).round() / scale + 0.0
}

#[cfg(test)]
mod tests {
    use super::super::walk::tests::{projection, walk};
    use super::*;

    fn parsed(walk: &Walk<'_>) -> serde_json::Value {
        assert!(text(walk).parse::<GeoJson>().is_ok());
        serde_json::from_str(&text(walk)).unwrap()
    }

    #[test]
    fn lines_have_one_floor_each_and_points_their_uncertainty() {
        let all = parsed(&walk(None));
        assert!(all["crs_note"].as_str().unwrap().starts_with("not WGS84"));
        let features = all["features"].as_array().unwrap();
        let lines: Vec<_> = features.iter().filter(|feature| feature["geometry"]["type"] == "LineString").collect();
        let sizes: Vec<_> = lines
            .iter()
            .map(|line| {
                let count = line["geometry"]["coordinates"].as_array().unwrap().len();
                (line["properties"]["path"].as_str().unwrap(), line["properties"]["floor"].as_i64().unwrap(), count)
            })
            .collect();
        // The place after the third step was not known; the line upstairs begins with the last place below.
        assert_eq!(sizes, [("live", 0, 2), ("live", 1, 3), ("corrected", 0, 4), ("corrected", 1, 3)]);
        assert_eq!(features.len() - lines.len(), 12);
        let unsure = &features.iter().find(|feature| feature["properties"]["step"] == 2).unwrap()["properties"];
        assert_eq!((&unsure["state"], &unsure["sigma_m"]), (&"several places".into(), &0.25.into()));
        assert_eq!(unsure["time"], "2023-11-14T22:13:22.2Z");
    }

    #[test]
    fn on_earth_the_coordinates_are_longitude_and_latitude() {
        let projection = projection();
        let all = parsed(&walk(Some(&projection)));
        let place = &all["features"][0]["geometry"]["coordinates"][0];
        let number = |axis: usize| place[axis].as_f64().unwrap();
        let back = projection.to_building([number(0), number(1)]).unwrap();
        assert!((back[0] - 10.0).abs() < 1e-3 && (back[1] - 5.0).abs() < 1e-3, "{back:?}");
    }
}
