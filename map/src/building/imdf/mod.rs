//! Reads buildings in the Indoor Mapping Data Format: an archive's GeoJSON files, one for each type of feature.
//!
//! Units are areas; their borders are walls, but not where one walks from one open unit (a walkway, a terrace) into another.
//! Openings cut the walls. Levels with the same ordinal are one floor. `docs/building.md` lists what becomes what.
//!
//! # Source
//! OGC 20-094, Indoor Mapping Data Format 1.0.0.

mod sheet;
#[cfg(test)]
mod tests;

use super::error::Error;
use super::features::{self, RawFeature};
use super::geojson::project;
use super::geometry;
use super::georeference::Georeference;
use super::model::{Building, Floor};
use super::stacked;
use serde_json::Value;
use sheet::Sheet;
use std::collections::BTreeMap;

/// A file of the archive.
#[derive(Clone, Debug)]
pub struct Part<'a> {
    /// The type of its features: its name without the ending.
    pub kind: &'a str,
    /// What is in it.
    pub text: &'a str,
    /// Its name in errors.
    pub file: &'a str,
}

/// The types that are read; levels and units must be there.
pub const KINDS: [&str; 6] = ["level", "unit", "opening", "fixture", "anchor", "occupant"];

/// Ordinals farther from the ground are believed of no building.
const FARTHEST: i32 = 200;

/// Features with the name of their file.
struct Layer<'a> {
    file: &'a str,
    features: Vec<RawFeature>,
}

/// The building of an archive. Floors are `storey_m` apart. The origin is the lower left corner of the units, in its UTM zone.
///
/// # Errors
/// When a file is no GeoJSON, levels or units are missing, or a feature makes no sense.
pub fn parse(name: &str, parts: &[Part<'_>], storey_m: f64) -> Result<Building, Error> {
    let mut layers: BTreeMap<&str, Layer<'_>> = BTreeMap::new();
    for part in parts.iter().filter(|part| KINDS.contains(&part.kind)) {
        let features = features::features(features::collection(part.text, part.file)?, part.file)?;
        layers.insert(part.kind, Layer { file: part.file, features });
    }
    let missing = |kind: &str| Error::Format {
        file: name.to_owned(),
        format: "IMDF archive",
        what: format!("it has no {kind} (file '{kind}.geojson')"),
    };
    let empty = || Layer { file: "", features: Vec::new() };
    let mut take = |kind| layers.remove(kind);
    let levels = take("level").filter(|layer| !layer.features.is_empty()).ok_or_else(|| missing("level"))?;
    let mut units = take("unit").filter(|layer| !layer.features.is_empty()).ok_or_else(|| missing("unit"))?;
    let [mut openings, mut fixtures, anchors, occupants] =
        ["opening", "fixture", "anchor", "occupant"].map(|kind| take(kind).unwrap_or_else(empty));
    let corners = units.features.iter().flat_map(|unit| unit.polygons.iter().flatten().flatten().copied());
    let Some([low, _]) = geometry::bounds(corners) else { return Err(missing("unit")) };
    let georeference = Georeference::around(low[0], low[1])?;
    if let Some(projection) = georeference.projection()? {
        for layer in [&mut units, &mut openings, &mut fixtures] {
            for feature in &mut layer.features {
                project(feature, &projection).map_err(|error| feature.error(layer.file, error.to_string()))?;
            }
        }
    }
    let floors = floors(&levels)?;
    let names = occupant_names(&anchors, &occupants);
    let mut sheets: BTreeMap<i32, Sheet> = BTreeMap::new();
    for (kind, layer) in [("unit", &units), ("opening", &openings), ("fixture", &fixtures)] {
        for feature in &layer.features {
            let level = feature.text("level_id").unwrap_or_default();
            let ordinal = match floors.of_levels.get(&level) {
                Some(Some(ordinal)) => *ordinal,
                Some(None) => continue,
                None => return Err(feature.error(layer.file, format!("'level_id' is '{level}', which is no level"))),
            };
            let sheet = sheets.entry(ordinal).or_default();
            match kind {
                "unit" => {
                    let own = || label(feature, "name").or_else(|| label(feature, "alt_name"));
                    let name = feature.id.as_ref().and_then(|id| names.get(id).cloned()).or_else(own);
                    sheet.unit(feature, name).map_err(|what| feature.error(layer.file, what))?;
                }
                "opening" => sheet.opening(feature, label(feature, "name")),
                _ => sheet.fixture(feature),
            }
        }
    }
    let mut building = Building { name: name.to_owned(), georeference, ..Building::default() };
    let mut connectors = Vec::new();
    // On a level without units nobody is.
    for (ordinal, mut sheet) in sheets.into_iter().filter(|(_, sheet)| sheet.has_units()) {
        connectors.extend(sheet.parts(ordinal));
        let name = floors.names.get(&ordinal).cloned().flatten().unwrap_or_else(|| ordinal.to_string());
        let height_m = f64::from(ordinal) * storey_m;
        let (floor, entrances) = sheet.done(Floor { number: ordinal, name, height_m, ..Floor::default() })?;
        building.floors.push(floor);
        building.entrances.extend(entrances);
    }
    building.connectors = stacked::join(connectors)?;
    building.assembled()
}

/// Levels by their identifier, and what floors are called.
struct Floors {
    /// The ordinal; nothing outdoors.
    of_levels: BTreeMap<String, Option<i32>>,
    names: BTreeMap<i32, Option<String>>,
}

fn floors(levels: &Layer<'_>) -> Result<Floors, Error> {
    let mut floors = Floors { of_levels: BTreeMap::new(), names: BTreeMap::new() };
    for level in &levels.features {
        let wrong = |what: &str| level.error(levels.file, what);
        let id = level.id.clone().ok_or_else(|| wrong("it has no 'id'"))?;
        let ordinal = level.integer("ordinal").filter(|ordinal| ordinal.abs() <= FARTHEST);
        let ordinal = ordinal.ok_or_else(|| wrong("its 'ordinal' is no whole number within 200"))?;
        let is_outdoors = level.properties.get("outdoor").and_then(Value::as_bool).unwrap_or(false);
        if !is_outdoors {
            let name = label(level, "short_name").or_else(|| label(level, "name"));
            let known = floors.names.entry(ordinal).or_default();
            *known = known.take().or(name);
        }
        floors.of_levels.insert(id, (!is_outdoors).then_some(ordinal));
    }
    Ok(floors)
}

/// A name in one of its languages: English if it is there, else the first.
fn label(feature: &RawFeature, key: &str) -> Option<String> {
    let languages = feature.properties.get(key)?.as_object()?;
    let name = languages.get("en").or_else(|| languages.values().next())?.as_str()?.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// The names of those who occupy units, by the units' identifiers.
fn occupant_names(anchors: &Layer<'_>, occupants: &Layer<'_>) -> BTreeMap<String, String> {
    let unit = |anchor: &RawFeature| Some((anchor.id.clone()?, anchor.text("unit_id")?));
    let units: BTreeMap<String, String> = anchors.features.iter().filter_map(unit).collect();
    let name =
        |occupant: &RawFeature| Some((units.get(&occupant.text("anchor_id")?)?.clone(), label(occupant, "name")?));
    occupants.features.iter().filter_map(name).collect()
}
