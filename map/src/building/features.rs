//! The features of a GeoJSON text as plain points, for every reader of a dialect of it.

use super::error::Error;
use super::geometry::{Outline, Point};
use ::geojson::feature::Id;
use ::geojson::{FeatureCollection, GeoJson, Geometry, GeometryValue, JsonObject, Position};

/// A feature: its properties and what it is made of.
#[derive(Clone, Debug, Default)]
pub(super) struct RawFeature {
    /// Counted from 1.
    pub index: usize,
    /// Its identifier, if it has one.
    pub id: Option<String>,
    pub properties: JsonObject,
    pub points: Vec<Point>,
    pub lines: Vec<Vec<Point>>,
    /// For each point of each line its third coordinate, if it has one.
    pub line_heights: Vec<Vec<Option<f64>>>,
    /// Outer border and holes; the repeated last corner is left out.
    pub polygons: Vec<Vec<Outline>>,
}

impl RawFeature {
    /// A property that is a text; numbers are turned into one.
    pub fn text(&self, key: &str) -> Option<String> {
        match self.properties.get(key)? {
            serde_json::Value::String(text) => Some(text.trim().to_owned()).filter(|text| !text.is_empty()),
            serde_json::Value::Number(number) => Some(number.to_string()),
            _ => None,
        }
    }

    /// A property that is a whole number.
    pub fn integer(&self, key: &str) -> Option<i32> {
        self.properties.get(key)?.as_i64().and_then(|value| i32::try_from(value).ok())
    }

    /// An error of this feature.
    pub fn error(&self, file: &str, what: impl Into<String>) -> Error {
        Error::Feature { file: file.to_owned(), index: self.index, what: what.into() }
    }
}

/// The text of a file called `name` as a collection.
///
/// # Errors
/// When it is no GeoJSON feature collection.
pub(super) fn collection(text: &str, name: &str) -> Result<FeatureCollection, Error> {
    let wrong = |what: String| Error::Format { file: name.to_owned(), format: "GeoJSON", what };
    match text.parse::<GeoJson>() {
        Ok(GeoJson::FeatureCollection(collection)) => Ok(collection),
        Ok(_) => Err(wrong("it has no feature collection".to_owned())),
        Err(error) => Err(wrong(error.to_string())),
    }
}

/// Its features.
///
/// # Errors
/// When a coordinate is missing or no number.
pub(super) fn features(collection: FeatureCollection, name: &str) -> Result<Vec<RawFeature>, Error> {
    let mut features = Vec::new();
    for (index, feature) in collection.features.into_iter().enumerate() {
        let mut raw = RawFeature {
            index: index + 1,
            id: feature.id.map(|id| match id {
                Id::String(text) => text,
                Id::Number(number) => number.to_string(),
            }),
            properties: feature.properties.unwrap_or_default(),
            ..RawFeature::default()
        };
        if let Some(geometry) = feature.geometry {
            add(&mut raw, &geometry).map_err(|what| raw.error(name, what))?;
        }
        features.push(raw);
    }
    Ok(features)
}

fn add(raw: &mut RawFeature, geometry: &Geometry) -> Result<(), String> {
    match &geometry.value {
        GeometryValue::Point { coordinates } => raw.points.push(point(coordinates)?),
        GeometryValue::MultiPoint { coordinates } => raw.points.extend(line(coordinates)?),
        GeometryValue::LineString { coordinates } => add_line(raw, coordinates)?,
        GeometryValue::MultiLineString { coordinates } => {
            coordinates.iter().try_for_each(|coordinates| add_line(raw, coordinates))?;
        }
        GeometryValue::Polygon { coordinates } => raw.polygons.push(polygon(coordinates)?),
        GeometryValue::MultiPolygon { coordinates } => {
            for coordinates in coordinates {
                raw.polygons.push(polygon(coordinates)?);
            }
        }
        GeometryValue::GeometryCollection { geometries } => {
            geometries.iter().try_for_each(|geometry| add(raw, geometry))?;
        }
    }
    Ok(())
}

fn add_line(raw: &mut RawFeature, positions: &[Position]) -> Result<(), String> {
    raw.lines.push(line(positions)?);
    raw.line_heights.push(positions.iter().map(|position| position.as_slice().get(2).copied()).collect());
    Ok(())
}

fn point(position: &Position) -> Result<Point, String> {
    match position.as_slice() {
        [x, y, ..] if x.is_finite() && y.is_finite() => Ok([*x, *y]),
        other => Err(format!("{other:?} is no place")),
    }
}

fn line(positions: &[Position]) -> Result<Vec<Point>, String> {
    positions.iter().map(point).collect()
}

fn polygon(rings: &[Vec<Position>]) -> Result<Vec<Outline>, String> {
    let ring = |positions: &Vec<Position>| {
        let mut outline = line(positions)?;
        if outline.len() > 1 && outline.first() == outline.last() {
            outline.pop();
        }
        Ok(outline)
    };
    rings.iter().map(ring).collect()
}
