//! A floor that is drawn from the elements of an OSM file.

use super::elements::{Drawn, Element};
use crate::building::error::Error;
use crate::building::geometry::{self, Outline, Point, Segment};
use crate::building::index::Index;
use crate::building::merge::merged;
use crate::building::model::{Door, Entrance, Floor, Room};
use crate::building::opening::{self, MOST_DOORS, Opening};
use crate::building::stacked::Part;

/// A door whose width nobody gave: the usual one of an office. **Units:** m.
const DOOR_M: f64 = 0.9;
/// A door is no wider than a gate and no narrower than a hatch. **Units:** m.
const WIDTHS_M: std::ops::RangeInclusive<f64> = 0.3..=20.0;
/// Stairs drawn as a line, and cabins drawn as a place, whose width nobody gave. **Units:** m.
const STAIRS_M: f64 = 1.2;
const CABIN_M: f64 = 1.6;
/// Degrees are given to seven digits, a centimetre: outlines with a wall in common miss each other by this. **Units:** m.
const SAME_M: f64 = 0.02;
/// A door lies on its wall or so far beside it. **Units:** m.
const BESIDE_M: f64 = 0.3;
/// More entrances than this no floor has.
const MOST_ENTRANCES: usize = 1_000;

/// A floor in the making.
#[derive(Debug, Default)]
pub struct Sheet {
    floor: Floor,
    walls: Vec<Segment>,
    /// Outlines of the building.
    shells: Vec<Outline>,
    doors: Vec<Drafted>,
    /// Stairs and elevators.
    pub parts: Vec<Part>,
}

/// A door before it has found its wall.
#[derive(Debug)]
struct Drafted {
    /// A way along the wall, or a node on it.
    line: Option<Segment>,
    place: Point,
    width: f64,
    name: Option<String>,
    /// What the entrance is called, if it is one.
    entrance: Option<String>,
}

impl Sheet {
    pub fn new(floor: Floor) -> Self {
        Self { floor, ..Self::default() }
    }

    /// Draws an element.
    ///
    /// # Errors
    /// When a door has a width that is none.
    pub fn add(&mut self, element: &Element<'_>, drawn: &Drawn) -> Result<(), String> {
        let tags = element.tags;
        let name = tags.first(&["name", "ref"]);
        let kind = tags.get("indoor").unwrap_or_default();
        let is_wall = matches!(kind, "room" | "wall" | "column");
        if is_wall || element.is_shell() {
            let rings = drawn.outlines.iter().chain(&drawn.holes);
            self.walls.extend(rings.flat_map(|ring| geometry::sides(ring)));
            self.walls.extend(drawn.lines.iter().flat_map(|line| line.windows(2)).map(|pair| [pair[0], pair[1]]));
        }
        if element.is_shell() {
            self.shells.extend(drawn.outlines.iter().cloned());
        }
        if matches!(kind, "room" | "corridor" | "area") {
            let usage = tags.first(&["room", "amenity", "shop", "office"]).filter(|usage| usage != "yes");
            let usage = usage.or_else(|| (kind == "corridor").then(|| kind.to_owned()));
            let name = name.clone().or_else(|| usage.clone()).unwrap_or_else(|| kind.to_owned());
            let room = |outline: &Outline| Room { name: name.clone(), usage: usage.clone(), outline: outline.clone() };
            self.floor.rooms.extend(drawn.outlines.iter().map(room));
        }
        if kind == "level"
            && let Some(name) = tags.first(&["name", "level:ref", "ref"])
        {
            self.floor.name = name;
        }
        if let Some(kind) = element.connector() {
            let width = width(element, &["width"])?;
            let mut outlines = drawn.outlines.clone();
            outlines.extend(drawn.lines.iter().filter_map(|line| strip(line, width.unwrap_or(STAIRS_M))));
            outlines.extend(drawn.point.map(|place| square(place, width.unwrap_or(CABIN_M))));
            let floor = self.floor.number;
            self.parts.extend(outlines.into_iter().map(|outline| Part { floor, kind, name: name.clone(), outline }));
        }
        if element.is_door() && !is_wall && !element.is_shell() {
            let entrance = tags.get("entrance").map(|kind| name.clone().unwrap_or_else(|| kind.to_owned()));
            let width = width(element, &["door:width", "width"])?.unwrap_or(DOOR_M);
            let outline = drawn.outlines.first().and_then(|outline| geometry::middle_line(outline));
            let along = drawn.lines.first().and_then(|line| Some([*line.first()?, *line.last()?]));
            let line = outline.or(along).filter(|line| geometry::length(line) > 0.0);
            let place = line.map(|line| geometry::between(line[0], line[1], 0.5)).or(drawn.point);
            self.doors.extend(place.map(|place| Drafted { line, place, width, name, entrance }));
        }
        Ok(())
    }

    /// The floor with its walls merged and cut, and where one comes in.
    ///
    /// # Errors
    /// When there are too many walls.
    pub fn done(mut self) -> Result<(Floor, Vec<Entrance>), Error> {
        let walls = merged(&self.walls, SAME_M)?;
        let index = Index::of(&walls);
        let count = self.doors.iter().filter(|door| door.entrance.is_some()).count();
        if count > MOST_ENTRANCES || self.doors.len() > MOST_DOORS {
            let (number, doors) = (self.floor.number, self.doors.len());
            return Err(Error::Model(format!("floor {number} has {doors} doors, {count} of them entrances: too many")));
        }
        let mut entrances = Vec::new();
        for door in std::mem::take(&mut self.doors) {
            let on_wall = || opening::door_at(&index, door.place, door.width, BESIDE_M);
            // Between areas without walls there is nothing to open.
            let Some(line) = door.line.or_else(on_wall) else { continue };
            if let Some(name) = door.entrance {
                let inside = |point: Point| {
                    self.floor.room_at(point).is_some()
                        || self.shells.iter().any(|shell| geometry::contains(shell, point))
                };
                let place = opening::inside_of(&line, inside);
                entrances.push(Entrance { name, floor: self.floor.number, place, beacon: None });
            }
            self.floor.doors.push(Door { line, name: door.name });
        }
        let openings: Vec<Opening> =
            self.floor.doors.iter().map(|door| Opening { line: door.line, depth_m: BESIDE_M }).collect();
        self.floor.walls = opening::cut(&walls, &openings)?;
        Ok((self.floor, entrances))
    }
}

/// A width in metres, with or without its unit, or in centimetres; nothing if it is not given.
fn width(element: &Element<'_>, keys: &[&str]) -> Result<Option<f64>, String> {
    let Some(text) = element.tags.first(keys) else { return Ok(None) };
    let number = text.trim_end_matches(|character: char| character.is_alphabetic()).trim();
    let unit = text[number.len()..].trim();
    let metres = match (number.replace(',', ".").parse::<f64>(), unit) {
        (Ok(value), "" | "m") => value,
        (Ok(value), "cm") => value / 100.0,
        _ => f64::NAN,
    };
    if WIDTHS_M.contains(&metres) {
        return Ok(Some(metres));
    }
    Err(format!("the width '{text}' is none: expected metres from {} to {}", WIDTHS_M.start(), WIDTHS_M.end()))
}

fn square([x, y]: Point, side: f64) -> Outline {
    let half = side / 2.0;
    vec![[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
}

/// The outline of a line of some width; nothing for one without length.
fn strip(line: &[Point], width: f64) -> Option<Outline> {
    let mut line = line.to_vec();
    line.dedup();
    let directions: Vec<Point> = line
        .windows(2)
        .map(|pair| {
            let length = geometry::distance(pair[0], pair[1]).max(1e-9);
            [(pair[1][0] - pair[0][0]) / length, (pair[1][1] - pair[0][1]) / length]
        })
        .collect();
    let (first, last) = (*directions.first()?, *directions.last()?);
    let side = |sign: f64| {
        let before = std::iter::once(first).chain(directions.iter().copied());
        let after = directions.iter().copied().chain(std::iter::once(last));
        let corners = line.iter().zip(before.zip(after)).map(move |(point, (a, b))| {
            // At a bend half way between both normals, not farther out than 2 widths.
            let (x, y) = (-(a[1] + b[1]), a[0] + b[0]);
            let squared = (x * x + y * y).max(0.5);
            let by = sign * width / squared;
            [point[0] + by * x, point[1] + by * y]
        });
        corners.collect::<Vec<Point>>()
    };
    let mut outline = side(1.0);
    outline.extend(side(-1.0).into_iter().rev());
    Some(outline)
}
