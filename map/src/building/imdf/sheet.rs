//! A floor that is drawn from the features of an IMDF archive.

use crate::building::error::Error;
use crate::building::features::RawFeature;
use crate::building::geometry::{self, Outline, Point, Segment};
use crate::building::merge::merged;
use crate::building::model::{ConnectorKind, Door, Entrance, Floor, Room};
use crate::building::opening::{self, Opening};
use crate::building::stacked::Part;

/// Units that have a border in common miss each other by no more. **Units:** m.
const SAME_M: f64 = 0.02;
/// An opening lies on the border of a unit or so far beside it. **Units:** m.
const BESIDE_M: f64 = 0.3;
/// So far on both sides of a border it is asked which unit is there. **Units:** m.
const SIDE_M: f64 = 0.05;
/// So many corners of units are looked at for that.
const MOST_LOOKS: usize = 500_000_000;
/// More entrances than this no floor has.
const MOST_ENTRANCES: usize = 1_000;

/// Between these there is no wall.
const OPEN: [&str; 12] = [
    "walkway",
    "walkway.island",
    "movingwalkway",
    "unenclosedarea",
    "platform",
    "footbridge",
    "terrace",
    "ramp",
    "steps",
    "escalator",
    "road",
    "vegetation",
];
/// These are no room: what they are made of, and where there is no floor.
const SOLID: [&str; 8] = ["brick", "column", "concretewall", "drywall", "glass", "wood", "structure", "opentobelow"];

/// A unit.
#[derive(Debug)]
struct Unit {
    outline: Outline,
    bounds: [Point; 2],
    is_open: bool,
}

/// A floor in the making.
#[derive(Debug, Default)]
pub struct Sheet {
    units: Vec<Unit>,
    /// Borders of units.
    borders: Vec<Segment>,
    /// Walls that are drawn as such.
    walls: Vec<Segment>,
    rooms: Vec<Room>,
    doors: Vec<Door>,
    /// Lines and names of the main entrances.
    entrances: Vec<(Segment, String)>,
    connectors: Vec<(ConnectorKind, Option<String>, Outline)>,
}

impl Sheet {
    /// Draws a unit.
    ///
    /// # Errors
    /// When it has no category or no area.
    pub fn unit(&mut self, feature: &RawFeature, name: Option<String>) -> Result<(), String> {
        let category = feature.text("category").ok_or("it has no 'category'")?;
        let rings = feature.polygons.iter().flatten().filter(|ring| ring.len() > 2);
        self.borders.extend(rings.flat_map(|ring| geometry::sides(ring)));
        let outlines: Vec<&Outline> =
            feature.polygons.iter().filter_map(|polygon| polygon.first()).filter(|ring| ring.len() > 2).collect();
        if outlines.is_empty() {
            return Err("it is no polygon".to_owned());
        }
        let kind = match &category[..] {
            "stairs" | "steps" | "escalator" => Some(ConnectorKind::Stairs),
            "elevator" => Some(ConnectorKind::Elevator),
            "ramp" => Some(ConnectorKind::Ramp),
            _ => None,
        };
        for outline in outlines {
            let Some(bounds) = geometry::bounds(outline.iter().copied()) else { continue };
            let is_open = OPEN.contains(&&category[..]);
            self.units.push(Unit { outline: outline.clone(), bounds, is_open });
            match kind {
                Some(kind) => self.connectors.push((kind, name.clone(), outline.clone())),
                None if SOLID.contains(&&category[..]) => {}
                None => self.rooms.push(Room {
                    name: name.clone().unwrap_or_else(|| category.clone()),
                    usage: Some(category.clone()),
                    outline: outline.clone(),
                }),
            }
        }
        Ok(())
    }

    /// Draws an opening, from its first point to its last.
    pub fn opening(&mut self, feature: &RawFeature, name: Option<String>) {
        for line in &feature.lines {
            let (Some(first), Some(last)) = (line.first(), line.last()) else { continue };
            let line = [*first, *last];
            if geometry::length(&line) > 0.0 {
                let category = feature.text("category").unwrap_or_default();
                if category.starts_with("pedestrian.principal") {
                    self.entrances.push((line, name.clone().unwrap_or_else(|| "entrance".to_owned())));
                }
                self.doors.push(Door { line, name: name.clone() });
            }
        }
    }

    /// Draws a fixture if nobody goes through it.
    pub fn fixture(&mut self, feature: &RawFeature) {
        if matches!(feature.text("category").as_deref(), Some("wall" | "obstruction")) {
            self.walls.extend(feature.polygons.iter().flatten().flat_map(|ring| geometry::sides(ring)));
            self.walls.extend(feature.lines.iter().flat_map(|line| line.windows(2)).map(|pair| [pair[0], pair[1]]));
        }
    }

    /// Whether there is any place to be.
    pub fn has_units(&self) -> bool {
        !self.units.is_empty()
    }

    /// Its stairs, ramps and elevators.
    pub fn parts(&mut self, floor: i32) -> Vec<Part> {
        let part = |(kind, name, outline)| Part { floor, kind, name, outline };
        std::mem::take(&mut self.connectors).into_iter().map(part).collect()
    }

    /// The floor with its walls merged and cut, and where one comes in.
    ///
    /// # Errors
    /// When a wall is too far away, or there is too much of it.
    pub fn done(self, mut floor: Floor) -> Result<(Floor, Vec<Entrance>), Error> {
        let borders = merged(&self.borders, SAME_M)?;
        let mut looks = 0;
        let mut walls: Vec<Segment> =
            borders.into_iter().filter(|border| !self.is_passed(border, &mut looks)).collect();
        if looks > MOST_LOOKS || self.entrances.len() > MOST_ENTRANCES {
            return Err(Error::Model(format!("floor {} has too many units or entrances", floor.number)));
        }
        walls.extend(&self.walls);
        let openings: Vec<Opening> =
            self.doors.iter().map(|door| Opening { line: door.line, depth_m: BESIDE_M }).collect();
        floor.walls = opening::cut(&merged(&walls, SAME_M)?, &openings)?;
        (floor.rooms, floor.doors) = (self.rooms, self.doors);
        let inside = |point: Point| self.units.iter().any(|unit| geometry::contains(&unit.outline, point));
        let entrance = |(line, name): &(Segment, String)| Entrance {
            name: name.clone(),
            floor: floor.number,
            place: opening::inside_of(line, inside),
            beacon: None,
        };
        let entrances = self.entrances.iter().map(entrance).collect();
        Ok((floor, entrances))
    }

    /// Whether one goes over a border freely: both sides are open.
    fn is_passed(&self, border: &Segment, looks: &mut usize) -> bool {
        let [a, b] = *border;
        let length = geometry::length(border).max(1e-9);
        let middle = geometry::between(a, b, 0.5);
        let across = [-(b[1] - a[1]) / length * SIDE_M, (b[0] - a[0]) / length * SIDE_M];
        let side = |side: f64| [middle[0] + side * across[0], middle[1] + side * across[1]];
        [1.0, -1.0].into_iter().all(|sign| self.is_open(side(sign), looks))
    }

    /// Whether a place is in an open unit and in no other.
    fn is_open(&self, point: Point, looks: &mut usize) -> bool {
        let mut open = false;
        for unit in &self.units {
            let [low, high] = unit.bounds;
            let may_hold = (0..2).all(|axis| (low[axis]..=high[axis]).contains(&point[axis]));
            *looks += if may_hold { unit.outline.len() } else { 1 };
            if may_hold && *looks <= MOST_LOOKS && geometry::contains(&unit.outline, point) {
                if !unit.is_open {
                    return false;
                }
                open = true;
            }
        }
        open
    }
}
