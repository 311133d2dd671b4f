//! Reads DXF files by layer, as the graph document draws its plans and graphs (table 6.2).
//!
//! One file holds one floor, or several with the name of the floor in front of the layer's. What is drawn on which layer is
//! set by [`Layers`]; `docs/building.md` lists what becomes what. Blocks are taken apart.

mod drawing;
mod explode;
mod graph;
mod layers;
mod pairs;
mod sheet;
#[cfg(test)]
mod tests;

pub use layers::Layers;

use super::error::Error;
use super::geometry::{self, Point};
use super::georeference::Georeference;
use super::model::{Building, Floor, is_place};
use super::open::floor_number;
use super::stacked;
use sheet::Sheet;
use std::collections::{BTreeMap, BTreeSet};

/// A drawing.
#[derive(Clone, Debug)]
pub struct PlanFile<'a> {
    /// Number of the floor of all layers that name none.
    pub number: i32,
    /// What that floor is called.
    pub name: &'a str,
    /// What is in the file.
    pub bytes: &'a [u8],
    /// Its name in errors.
    pub file: &'a str,
}

/// More floors than this no building has.
const MOST_FLOORS: usize = 500;
/// So many of the layers that are not read are named.
const LISTED: usize = 12;

/// Whether a file begins as a DXF file does.
pub fn is_dxf(bytes: &[u8]) -> bool {
    let mut pairs = pairs::Pairs::of(bytes).map_while(Result::ok).filter(|pair| pair.code != 999);
    let is_section = |value: &pairs::Value<'_>| matches!(value, pairs::Value::Text(text) if text.trim() == "SECTION");
    pairs.next().is_some_and(|first| first.code == 0 && is_section(&first.value))
}

/// The building of some drawings. Floors are `storey_m` apart. What is drawn near the origin keeps its coordinates; else, and
/// always when they are those of a UTM zone, the lower left corner is the origin.
///
/// # Errors
/// When a file is no DXF, nothing is drawn on a layer that is read, or the parts do not make a building.
pub fn parse(name: &str, files: &[PlanFile<'_>], layers: &Layers, storey_m: f64) -> Result<Building, Error> {
    let mut sheets: BTreeMap<i32, (String, Sheet)> = BTreeMap::new();
    for file in files {
        let wrong = |what: String| Error::Format { file: file.file.to_owned(), format: "DXF plan", what };
        let drawing = drawing::read(file.bytes).map_err(wrong)?;
        let (pieces, ignored) = explode::explode(&drawing, layers).map_err(wrong)?;
        if pieces.is_empty() {
            return Err(wrong(nothing(&ignored)));
        }
        for piece in pieces {
            let named = piece.floor.as_deref().and_then(|name| Some((floor_number(name)?, name)));
            let (number, name) = named.unwrap_or((file.number, file.name));
            let sheet = sheets.entry(number).or_insert_with(|| (name.to_owned(), Sheet::default()));
            sheet.1.add(piece);
            if sheets.len() > MOST_FLOORS {
                return Err(wrong(format!("its layers name more than {MOST_FLOORS} floors")));
            }
        }
    }
    let (origin, georeference) = place(&sheets, layers)?;
    let mut building = Building { name: name.to_owned(), georeference, ..Building::default() };
    let mut parts = Vec::new();
    let mut drawn = Vec::new();
    for (number, (name, sheet)) in &sheets {
        let height_m = f64::from(*number) * storey_m;
        let floor = Floor { number: *number, name: name.clone(), height_m, ..Floor::default() };
        let (floor, entrances, own) = sheet.done(floor, origin, layers.door_width_m)?;
        building.floors.push(floor);
        building.entrances.extend(entrances);
        parts.extend(own);
        drawn.push((*number, height_m, &sheet.graph));
    }
    building.connectors = stacked::join(parts)?;
    building.graph = graph::graph(&drawn, origin).map_err(Error::Model)?;
    building.assembled()
}

fn nothing(ignored: &BTreeSet<String>) -> String {
    let names: Vec<&str> = ignored.iter().take(LISTED).map(String::as_str).collect();
    let more = if ignored.len() > LISTED { " and more" } else { "" };
    format!("none of its layers ({}{more}) is read; --layers tells which hold what", names.join(", "))
}

/// What of the drawing is the origin of the building, and where that is.
fn place(sheets: &BTreeMap<i32, (String, Sheet)>, layers: &Layers) -> Result<(Point, Georeference), Error> {
    let Some([low, high]) = geometry::bounds(sheets.values().flat_map(|(_, sheet)| sheet.points())) else {
        return Ok(([0.0; 2], Georeference::Local));
    };
    let Some(epsg) = layers.epsg else {
        let is_near = is_place(&low) && is_place(&high);
        return Ok((if is_near { [0.0; 2] } else { low.map(f64::round) }, Georeference::Local));
    };
    let georeference = Georeference::Utm { epsg, origin: low.map(f64::round) };
    georeference.projection()?;
    Ok((low.map(f64::round), georeference))
}
