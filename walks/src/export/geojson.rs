//! The track as GeoJSON: a line and a point for every stance, for each of the tracks.
//!
//! GeoJSON has one frame, WGS84 (RFC 7946, section 4), and a dead-reckoned track does not know where on Earth it is. With
//! an [`Origin`] the coordinates are longitude and latitude; without one they are metres around (0, 0), which a map
//! program would draw in the Gulf of Guinea, and the foreign member `crs_note` says so.

use super::picture::{Picture, Placement, Role};
use super::{Named, steps_csv};
use ::geojson::{Feature, FeatureCollection, GeoJson, Geometry, JsonObject, JsonValue, Position};
use std::str::FromStr;

/// Equatorial radius and squared eccentricity of the WGS84 ellipsoid. **Units:** m; 1.
const WGS84_RADIUS_M: f64 = 6_378_137.0;
const WGS84_ECCENTRICITY_2: f64 = 6.694_379_990_14e-3;

/// Where on Earth the origin of a track lies and how its axes are turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// **Units:** degrees, north positive; **Frame:** WGS84.
    pub latitude: f64,
    /// **Units:** degrees, east positive; **Frame:** WGS84.
    pub longitude: f64,
    /// Compass bearing of the x axis, clockwise from north. **Units:** degrees.
    pub bearing: f64,
}

/// Why a text is no [`Origin`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("expected LAT,LON or LAT,LON,HEADING_DEG in degrees, latitude within 85 and longitude within 180")]
pub struct NoOrigin;

impl FromStr for Origin {
    type Err = NoOrigin;

    fn from_str(text: &str) -> Result<Self, NoOrigin> {
        let numbers: Vec<f64> =
            text.split(',').map(|part| part.trim().parse()).collect::<Result<_, _>>().map_err(|_| NoOrigin)?;
        let (latitude, longitude, bearing) = match numbers[..] {
            [latitude, longitude] => (latitude, longitude, 90.0),
            [latitude, longitude, bearing] => (latitude, longitude, bearing),
            _ => return Err(NoOrigin),
        };
        // A tangent plane is of no use near the poles; the comparisons are false for NaN.
        if latitude.abs() <= 85.0 && longitude.abs() <= 180.0 && bearing.is_finite() {
            Ok(Self { latitude, longitude, bearing })
        } else {
            Err(NoOrigin)
        }
    }
}

impl Origin {
    /// Longitude, latitude and height of a point on the plane that touches the ellipsoid at the origin. Wrong by less
    /// than a centimetre within a kilometre. **Units:** `point` in m.
    fn locate(&self, point: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.bearing.to_radians().sin_cos();
        // The x axis points along the bearing, the y axis to the left of it.
        let (east, north) = (point[0] * sin - point[1] * cos, point[0] * cos + point[1] * sin);
        let latitude = self.latitude.to_radians();
        let flattening = 1.0 - WGS84_ECCENTRICITY_2 * latitude.sin().powi(2);
        let along_parallel = WGS84_RADIUS_M / flattening.sqrt();
        let along_meridian = along_parallel * (1.0 - WGS84_ECCENTRICITY_2) / flattening;
        [
            self.longitude + (east / (along_parallel * latitude.cos())).to_degrees(),
            self.latitude + (north / along_meridian).to_degrees(),
            point[2],
        ]
    }

    /// As many digits as a tenth of a millimetre needs.
    const DIGITS: i32 = 9;
}

/// Everything of the walk as one feature collection: the tracks with their steps, and the truth as the picture has it.
pub fn collection(picture: &Picture, tracks: &[Named<'_>], origin: Option<Origin>) -> String {
    let mut features = Vec::new();
    for line in picture.lines.iter().filter(|line| line.role == Role::Truth) {
        let positions = line.dots.iter().map(|dot| place(dot.position, origin));
        features.extend(path(positions.collect(), properties([("track", line.label.as_str().into())])));
    }
    for named in tracks {
        features.extend(track(named, origin));
    }
    let note = match origin {
        Some(origin) => format!(
            "WGS84 by a plane touching the ellipsoid at latitude {}, longitude {}; the x axis of the track has the compass \
             bearing {} degrees; heights are metres above the start",
            origin.latitude, origin.longitude, origin.bearing
        ),
        None => "not WGS84: coordinates are x, y, z in metres in the frame of the walk, z up".to_owned(),
    };
    let collection = FeatureCollection {
        bbox: None,
        features,
        foreign_members: Some(properties([("title", picture.title.as_str().into()), ("crs_note", note.into())])),
    };
    let mut text = GeoJson::from(collection).to_string();
    text.push('\n');
    text
}

/// The line of a track and its stances.
fn track(named: &Named<'_>, origin: Option<Origin>) -> Vec<Feature> {
    let Named { label, track, placement, .. } = *named;
    let positions: Vec<_> = track.stances.iter().map(|stance| place(placement.of(stance.position), origin)).collect();
    let times = track.stances.iter().map(|stance| JsonValue::from(stance.end.as_seconds())).collect();
    let mut features: Vec<_> = path(
        positions.clone(),
        properties([
            ("track", label.into()),
            ("distance_m", rounded(track.distance(), 3)),
            ("stance_end_s", JsonValue::Array(times)),
        ]),
    )
    .into_iter()
    .collect();
    for ((step, stance), position) in track.steps.iter().zip(&track.stances).zip(positions) {
        features.push(feature(
            Geometry::new_point(position),
            properties([
                ("track", label.into()),
                ("step", step.index.into()),
                ("stance_start_s", stance.start.as_seconds().into()),
                ("stance_end_s", stance.end.as_seconds().into()),
                ("length_m", rounded(f64::from(step.length()), 4)),
                ("climb_m", rounded(f64::from(step.displacement.z), 4)),
                ("turn_deg", rounded(f64::from(step.turn).to_degrees(), 3)),
                ("mode", steps_csv::mode_name(step.mode).into()),
                ("heading_deg", rounded(heading(stance.heading, placement, origin), 3)),
            ]),
        ));
    }
    features
}

/// A heading as people read it: on Earth clockwise from north, else counter-clockwise from the x axis.
fn heading(heading: f64, placement: Placement, origin: Option<Origin>) -> f64 {
    let turned = (heading + placement.turn).to_degrees();
    origin.map_or(turned, |origin| origin.bearing - turned).rem_euclid(360.0)
}

/// A line needs two points (RFC 7946, section 3.1.4).
fn path(positions: Vec<Position>, properties: JsonObject) -> Option<Feature> {
    (positions.len() >= 2).then(|| feature(Geometry::new_line_string(positions), properties))
}

fn feature(geometry: Geometry, properties: JsonObject) -> Feature {
    Feature { geometry: Some(geometry), properties: Some(properties), ..Feature::default() }
}

fn place(point: [f64; 3], origin: Option<Origin>) -> Position {
    let (point, digits) = origin.map_or((point, 4), |origin| (origin.locate(point), Origin::DIGITS));
    let [x, y, z] = point;
    Position::from(vec![round(x, digits), round(y, digits), round(z, 4)])
}

fn rounded(value: f64, digits: i32) -> JsonValue {
    round(value, digits).into()
}

fn round(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    // Adding zero turns a negative zero into zero.
    (value * scale).round() / scale + 0.0
}

fn properties<const N: usize>(entries: [(&str, JsonValue); N]) -> JsonObject {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::synthetic;

    fn text(origin: Option<Origin>) -> String {
        let track = synthetic::square_and_stairs(20);
        let named = Named {
            role: Role::Chosen,
            label: "default",
            track: &track,
            parameters: "",
            placement: Placement::default(),
        };
        collection(&Picture::new("Test"), &[named], origin)
    }

    #[test]
    fn it_parses_and_has_a_line_and_a_point_for_each_stance() {
        let GeoJson::FeatureCollection(collection) = text(None).parse().unwrap() else { panic!("no collection") };
        assert_eq!(collection.features.len(), 1 + 21);
        let note = collection.foreign_members.unwrap()["crs_note"].as_str().unwrap().to_owned();
        assert!(note.starts_with("not WGS84"), "{note}");
        let times = collection.features[0].property("stance_end_s").unwrap().as_array().unwrap().len();
        assert_eq!(times, 21);
    }

    #[test]
    fn an_origin_puts_the_axes_where_the_bearing_says() {
        // A minute of latitude is a nautical mile, 1852 m; at 45 degrees within 0.1 %.
        let east = Origin { latitude: 45.0, longitude: 10.0, bearing: 90.0 };
        let [longitude, latitude, _] = east.locate([0.0, 1852.0, 0.0]);
        assert!((longitude - 10.0).abs() < 1e-9);
        assert!(((latitude - 45.0) * 60.0 - 1.0).abs() < 1e-3, "{latitude}");
        let north = Origin { bearing: 0.0, ..east };
        let [longitude, latitude, _] = north.locate([1852.0, 0.0, 0.0]);
        assert!((longitude - 10.0).abs() < 1e-9 && ((latitude - 45.0) * 60.0 - 1.0).abs() < 1e-3);
        let [longitude, _, _] = north.locate([0.0, 100.0, 0.0]);
        assert!(longitude < 10.0, "the y axis points left of north: west");
    }

    #[test]
    fn origins_are_read_strictly() {
        let origin = Origin { latitude: 48.1, longitude: 16.3, bearing: 90.0 };
        assert_eq!("48.1,16.3".parse(), Ok(origin));
        assert_eq!("48.1, 16.3, 12.5".parse(), Ok(Origin { bearing: 12.5, ..origin }));
        for wrong in ["", "48.1", "48.1,16.3,0,0", "91,0", "nan,0", "0,181", "0,0,inf", "a,b"] {
            assert_eq!(wrong.parse::<Origin>(), Err(NoOrigin), "{wrong}");
        }
    }
}
