//! Reads OpenStreetMap files (OSM XML, as editors and the Overpass API write them) with Simple Indoor Tagging.
//!
//! Rooms are surrounded by walls, corridors and areas are not; the outline of the building is a wall on every floor. Where
//! two outlines have a wall in common it is drawn once. Doors are nodes on walls, or ways along them, and open them. What
//! becomes what is listed in `docs/building.md`.

mod data;
mod elements;
mod levels;
mod sheet;
#[cfg(test)]
mod tests;

use super::error::Error;
use super::geometry;
use super::georeference::Georeference;
use super::model::{Building, Floor};
use super::stacked;
use elements::Element;
use levels::Level;
use sheet::Sheet;
use std::collections::{BTreeMap, BTreeSet};

/// The building of a text; `file` names it in errors, `storey_m` is the height from level to level. The origin is a corner of
/// what is indoors, in its UTM zone.
///
/// # Errors
/// When the text is no OSM XML, nothing in it is indoors, or an element makes no sense.
pub fn parse(name: &str, text: &str, file: &str, storey_m: f64) -> Result<Building, Error> {
    let wrong = |what: String| Error::Format { file: file.to_owned(), format: "OSM file with indoor tags", what };
    let data = data::read(text, file)?;
    let used = elements::used(&data).map_err(wrong)?;
    let indoors = used.iter().filter(|element| element.is_indoors());
    let points = indoors.flat_map(Element::nodes).filter_map(|node| data.nodes.get(&node)).map(|node| node.place);
    let Some([low, _]) = geometry::bounds(points) else {
        return Err(wrong("nothing in it has the key 'indoor', or the nodes of what has it are missing".to_owned()));
    };
    let georeference = Georeference::around(low[0], low[1])?;
    let mut places = BTreeMap::new();
    if let Some(projection) = georeference.projection()? {
        for node in used.iter().flat_map(Element::nodes) {
            if let Some(found) = data.nodes.get(&node) {
                places.insert(node, projection.to_building(found.place)?);
            }
        }
    }
    let mut levels: BTreeSet<Level> =
        used.iter().filter(|element| element.is_indoors()).flat_map(|element| element.levels.clone()).collect();
    if levels.is_empty() {
        levels.insert(0);
    }
    let mut sheets: BTreeMap<Level, Sheet> = levels::floors(&levels, storey_m)
        .into_iter()
        .map(|(level, (number, name, height_m))| {
            (level, Sheet::new(Floor { number, name, height_m, ..Floor::default() }))
        })
        .collect();
    let meant = Meant::of(&used, &levels);
    let mut points = 0;
    for element in &used {
        let drawn = element.drawn(&places);
        for level in meant.levels(element) {
            points += drawn.count();
            if points > MOST_POINTS {
                return Err(wrong(format!("its floors have more than {MOST_POINTS} points, all together")));
            }
            if let Some(sheet) = sheets.get_mut(&level) {
                sheet.add(element, &drawn).map_err(|what| wrong(format!("{}: {what}", element.name)))?;
            }
        }
    }
    let mut building = Building { name: name.to_owned(), georeference, ..Building::default() };
    let mut parts = Vec::new();
    for mut sheet in sheets.into_values() {
        parts.append(&mut sheet.parts);
        let (floor, entrances) = sheet.done()?;
        building.floors.push(floor);
        building.entrances.extend(entrances);
    }
    building.connectors = stacked::join(parts)?;
    building.assembled()
}

/// More points than this no building has, all floors together.
const MOST_POINTS: usize = 4_000_000;

/// The levels of elements that name none.
struct Meant<'a> {
    levels: &'a BTreeSet<Level>,
    /// Of each node of an area or wall indoors.
    of_nodes: BTreeMap<i64, BTreeSet<Level>>,
}

impl<'a> Meant<'a> {
    fn of(used: &[Element<'_>], levels: &'a BTreeSet<Level>) -> Self {
        let mut of_nodes: BTreeMap<i64, BTreeSet<Level>> = BTreeMap::new();
        for element in used.iter().filter(|element| element.is_indoors()) {
            for node in element.nodes() {
                of_nodes.entry(node).or_default().extend(&element.levels);
            }
        }
        Self { levels, of_nodes }
    }

    /// The building's outline is on all; a door without a level is where the areas are whose corner it is; all else is on the
    /// lowest floor that is not below the ground.
    fn levels(&self, element: &Element<'_>) -> BTreeSet<Level> {
        if !element.levels.is_empty() {
            return element.levels.clone();
        }
        if element.is_shell() {
            return self.levels.clone();
        }
        let around = element.nodes().filter_map(|node| self.of_nodes.get(&node)).find(|levels| !levels.is_empty());
        around.filter(|_| element.is_door()).cloned().unwrap_or_else(|| {
            let ground = self.levels.range(0..).next().or(self.levels.last());
            ground.copied().into_iter().collect()
        })
    }
}
