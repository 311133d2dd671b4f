//! Outlines that cross themselves, and coordinates that were read the wrong way round.

use super::{Kind, Notes};
use crate::building::geometry::{self, Point, Segment};
use crate::building::georeference::Georeference;
use crate::building::model::Building;

/// Looks at all outlines and at the frame.
pub fn check(building: &Building, notes: &mut Notes<'_>) {
    axis_order(building, notes);
    let cure = "draw the corners in their order around the area; in a GIS: 'fix geometries'";
    for floor in &building.floors {
        for room in &floor.rooms {
            if let Some(place) = self_crossing(&room.outline) {
                let what = format!("the outline of room '{}' crosses itself", room.name);
                notes.note(Kind::SelfCrossing, Some(floor.number), Some(place), Some(room.name.clone()), what, cure);
            }
        }
    }
    for connector in &building.connectors {
        for (floor, outline) in &connector.outlines {
            if let Some(place) = self_crossing(outline) {
                let what = format!("the outline of {} '{}' crosses itself", connector.kind.word(), connector.name);
                notes.at(Kind::SelfCrossing, *floor, place, what, cure);
            }
        }
    }
}

/// The first place where two sides cross that are not neighbours.
fn self_crossing(outline: &[Point]) -> Option<Point> {
    let count = outline.len();
    let mut sides: Vec<(usize, Segment)> = geometry::sides(outline).enumerate().collect();
    // From left to right: a side need only be compared with those that begin before it ends.
    let left = |side: &Segment| side[0][0].min(side[1][0]);
    let right = |side: &Segment| side[0][0].max(side[1][0]);
    sides.sort_by(|(_, a), (_, b)| left(a).total_cmp(&left(b)));
    for (index, (i, a)) in sides.iter().enumerate() {
        for (j, b) in sides[index + 1..].iter().take_while(|(_, b)| left(b) <= right(a)) {
            let apart = i.abs_diff(*j);
            if apart == 1 || apart == count - 1 {
                continue;
            }
            // Touching at a corner is none: outlines of rooms around a pillar do.
            let within = |part: f64| part > 1e-9 && part < 1.0 - 1e-9;
            if let Some((part, _)) = geometry::crossing(a, b).filter(|(p, q)| within(*p) && within(*q)) {
                return Some(geometry::between(a[0], a[1], part));
            }
        }
    }
    None
}

/// How much more right angles there must be after a swap of the axes, and how many. From 0 to 1, see [`rectangularity`].
const BETTER: f64 = 0.1;
const GOOD: f64 = 0.8;

/// Walls mostly stand at right angles. Longitude and latitude in the wrong order stretch a building, so that the angles
/// of one that stands askew to the meridian are right no longer; one that stands along it cannot be told.
fn axis_order(building: &Building, notes: &mut Notes<'_>) {
    let Ok(Some(projection)) = building.georeference.projection() else { return };
    let walls: Vec<Segment> = building.floors.iter().flat_map(|floor| floor.walls.iter().copied()).collect();
    let Some(first) = walls.first().and_then(|wall| projection.to_earth(wall[0]).ok()) else { return };
    let Ok(Some(swapped)) = Georeference::around(first[1], first[0]).and_then(|frame| frame.projection()) else {
        return;
    };
    let turn = |point: Point| {
        let [longitude, latitude] = projection.to_earth(point).ok()?;
        swapped.to_building([latitude, longitude]).ok()
    };
    let turned: Option<Vec<Segment>> = walls.iter().map(|wall| Some([turn(wall[0])?, turn(wall[1])?])).collect();
    let Some(turned) = turned else { return };
    let (as_is, other) = (rectangularity(&walls), rectangularity(&turned));
    if other > GOOD && other > as_is + BETTER {
        let what = format!(
            "with longitude and latitude swapped {:.0} % of the walls stand at right angles, as it is {:.0} %",
            other * 100.0,
            as_is * 100.0
        );
        let cure = "swap the two coordinates of every place: GeoJSON has the longitude first";
        notes.note(Kind::AxisOrder, None, None, None, what, cure);
    }
}

/// How much the walls stand at right angles to each other: 1 if all do, about 0 if they stand anyhow.
fn rectangularity(walls: &[Segment]) -> f64 {
    let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
    for wall in walls {
        let length = geometry::length(wall);
        let angle = 4.0 * geometry::direction(wall[0], wall[1]);
        (x, y, total) = (x + length * angle.cos(), y + length * angle.sin(), total + length);
    }
    if total > 0.0 { x.hypot(y) / total } else { 0.0 }
}
