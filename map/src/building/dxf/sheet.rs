//! A floor that is drawn from the pieces of a DXF file.

use super::explode::{Line, Piece};
use super::graph::Drawn;
use super::layers::Role;
use crate::building::error::Error;
use crate::building::geometry::{self, Outline, Point, Segment};
use crate::building::index::Index;
use crate::building::merge::merged;
use crate::building::model::{ConnectorKind, Door, Entrance, Floor, Room};
use crate::building::opening::{self, MOST_DOORS, Opening};
use crate::building::stacked::Part;

/// Ends that were meant to meet do so within this. **Units:** m.
const SAME_M: f64 = 2e-3;
/// A door lies on its wall or so far beside it. **Units:** m.
const BESIDE_M: f64 = 0.3;
/// The name of an entrance stands no farther from it. **Units:** m.
const NAME_M: f64 = 3.0;
/// Side of a cabin that is only a point. **Units:** m.
const CABIN_M: f64 = 1.6;
/// More rooms, or texts, than this no floor has; nor more entrances than that.
const MOST_ROOMS: usize = 20_000;
const MOST_ENTRANCES: usize = 1_000;
/// So many corners of rooms are looked at to find the names in them.
const MOST_LOOKS: usize = 500_000_000;

/// A floor in the making. **Units:** m; **Frame:** drawing.
#[derive(Debug, Default)]
pub struct Sheet {
    walls: Vec<Segment>,
    doors: Vec<Segment>,
    /// Where a leaf hangs, and both ends of its swing.
    swings: Vec<(Point, [Point; 2])>,
    door_points: Vec<Point>,
    rooms: Vec<Outline>,
    texts: Vec<(Point, String)>,
    entrances: Vec<(Point, Option<Segment>)>,
    entrance_texts: Vec<(Point, String)>,
    connectors: Vec<(ConnectorKind, Outline)>,
    pub graph: Drawn,
}

impl Sheet {
    /// Draws a piece.
    pub fn add(&mut self, piece: Piece) {
        match (piece.role, piece.line) {
            (Role::Walls, line) => self.walls.extend(segments(&line)),
            (Role::Doors, Line::Arc { centre, points }) => {
                if let (Some(first), Some(last)) = (points.first(), points.last()) {
                    self.swings.push((centre, [*first, *last]));
                }
            }
            (Role::Doors, Line::Outline(outline)) => self.doors.extend(geometry::middle_line(&outline)),
            (Role::Doors, Line::Point(point)) => self.door_points.push(point),
            (Role::Doors, line) => self.doors.extend(segments(&line)),
            (Role::Rooms, Line::Outline(outline)) => self.rooms.push(outline),
            (Role::Rooms, Line::Text(place, text)) => self.texts.push((place, text)),
            (Role::Stairs, Line::Outline(outline)) => self.connectors.push((ConnectorKind::Stairs, outline)),
            (Role::Ramps, Line::Outline(outline)) => self.connectors.push((ConnectorKind::Ramp, outline)),
            (Role::Elevators, Line::Outline(outline)) => self.connectors.push((ConnectorKind::Elevator, outline)),
            (Role::Elevators, Line::Point([x, y])) => {
                let half = CABIN_M / 2.0;
                let cabin = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[u, v]| [x + u, y + v]);
                self.connectors.push((ConnectorKind::Elevator, cabin.to_vec()));
                self.graph.elevators.push([x, y]);
            }
            (Role::Entrances, Line::Point(point)) => self.entrances.push((point, None)),
            (Role::Entrances, Line::Text(place, text)) => self.entrance_texts.push((place, text)),
            (Role::Entrances, line) => {
                let entrance = |line: Segment| (geometry::between(line[0], line[1], 0.5), Some(line));
                self.entrances.extend(segments(&line).into_iter().map(entrance));
            }
            (Role::Graph, Line::Point(point)) => self.graph.nodes.push(point),
            (Role::Graph, line) => self.graph.edges.extend(segments(&line)),
            (Role::Upstairs, Line::Point(point)) => self.graph.up.push(point),
            (Role::Downstairs, Line::Point(point)) => self.graph.down.push(point),
            // Numbers of treads, arrows and the like.
            _ => {}
        }
    }

    /// All points that make the plan.
    pub fn points(&self) -> impl Iterator<Item = Point> + '_ {
        let lines = self.walls.iter().chain(&self.doors).chain(&self.graph.edges);
        lines.flatten().chain(self.rooms.iter().flatten()).copied()
    }

    /// The floor, its entrances, and its stairs and elevators; `origin` is what becomes the origin of the building.
    ///
    /// # Errors
    /// When a wall is too far away, or there are too many walls or rooms.
    pub fn done(
        &self,
        mut floor: Floor,
        origin: Point,
        door_width: f64,
    ) -> Result<(Floor, Vec<Entrance>, Vec<Part>), Error> {
        for (count, most, what) in [
            (self.doors.len().max(self.swings.len()).max(self.door_points.len()), MOST_DOORS, "doors"),
            (self.entrances.len().max(self.entrance_texts.len()), MOST_ENTRANCES, "entrances or their names"),
            (self.rooms.len().max(self.texts.len()), MOST_ROOMS, "rooms or their names"),
        ] {
            if count > most {
                return Err(Error::Model(format!("floor {} has {count} {what}, more than {most}", floor.number)));
            }
        }
        let moved = |point: &Point| [point[0] - origin[0], point[1] - origin[1]];
        let moved_line = |line: &Segment| [moved(&line[0]), moved(&line[1])];
        let walls = merged(&self.walls.iter().map(moved_line).collect::<Vec<_>>(), SAME_M)?;
        let index = Index::of(&walls);
        let far = |point: Point| {
            let near = index.near([point; 2], 2.0 * BESIDE_M).into_iter();
            let distance = |wall| geometry::distance(geometry::nearest(index.segment(wall), point), point);
            near.map(distance).fold(f64::INFINITY, f64::min)
        };
        let is_leaf = |line: &Segment| {
            // The leaf of a swing, drawn open, and what belongs to its symbol.
            self.swings.iter().any(|(hinge, [end, _])| {
                let reach = geometry::distance(*hinge, *end) * 1.1;
                line.iter().all(|point| geometry::distance(*point, *hinge) <= reach)
            })
        };
        let mut lines: Vec<Segment> = self.doors.iter().filter(|line| !is_leaf(line)).map(moved_line).collect();
        for (hinge, ends) in &self.swings {
            // Closed, the leaf lies on the wall or reaches to its other end.
            let [first, last] = ends.map(|end| moved(&end));
            lines.push([moved(hinge), if far(first) <= far(last) { first } else { last }]);
        }
        lines.extend(self.entrances.iter().filter_map(|(_, line)| line.as_ref()).map(moved_line));
        let on_wall = |point: &Point| opening::door_at(&index, moved(point), door_width, BESIDE_M);
        lines.extend(self.door_points.iter().filter_map(on_wall));
        lines.retain(|line| geometry::length(line) > SAME_M);
        let openings: Vec<Opening> = lines.iter().map(|line| Opening { line: *line, depth_m: BESIDE_M }).collect();
        floor.walls = opening::cut(&walls, &openings)?;
        floor.doors = lines.into_iter().map(|line| Door { line, name: None }).collect();
        floor.rooms = self.rooms(moved)?;
        let entrances = self.entrances.iter().map(|(place, line)| {
            let near = self.entrance_texts.iter().filter(|(at, _)| geometry::distance(*at, *place) <= NAME_M);
            let name = near.min_by(|a, b| geometry::distance(a.0, *place).total_cmp(&geometry::distance(b.0, *place)));
            let inside = |point: Point| floor.room_at(point).is_some();
            let place = line.map_or_else(|| moved(place), |line| opening::inside_of(&moved_line(&line), inside));
            Entrance {
                name: name.map_or_else(|| "entrance".to_owned(), |(_, name)| name.clone()),
                floor: floor.number,
                place,
                beacon: None,
            }
        });
        let entrances = entrances.collect();
        let part = |(kind, outline): &(ConnectorKind, Outline)| Part {
            floor: floor.number,
            kind: *kind,
            name: None,
            outline: outline.iter().map(moved).collect(),
        };
        let parts = self.connectors.iter().map(part).collect();
        Ok((floor, entrances, parts))
    }

    /// Rooms with the highest of the texts in them as their name.
    fn rooms(&self, moved: impl Fn(&Point) -> Point) -> Result<Vec<Room>, Error> {
        let boxes: Vec<[Point; 2]> =
            self.rooms.iter().map(|outline| geometry::bounds(outline.iter().copied()).unwrap_or_default()).collect();
        let areas: Vec<f64> = self.rooms.iter().map(|outline| geometry::area(outline).abs()).collect();
        let mut names: Vec<Option<&(Point, String)>> = vec![None; self.rooms.len()];
        let mut looks = 0;
        for text in self.texts.iter().filter(|(_, text)| !text.is_empty()) {
            let mut holds = |room: &usize| {
                let [low, high] = boxes[*room];
                let may_hold = (0..2).all(|axis| (low[axis]..=high[axis]).contains(&text.0[axis]));
                looks += if may_hold { self.rooms[*room].len() } else { 1 };
                may_hold && looks <= MOST_LOOKS && geometry::contains(&self.rooms[*room], text.0)
            };
            let smallest =
                (0..self.rooms.len()).filter(|room| holds(room)).min_by(|a, b| areas[*a].total_cmp(&areas[*b]));
            if let Some(room) = smallest
                && names[room].is_none_or(|(place, _)| place[1] < text.0[1])
            {
                names[room] = Some(text);
            }
        }
        if looks > MOST_LOOKS {
            return Err(Error::Model("too many rooms of a floor lie in one place".to_owned()));
        }
        let room = |(index, outline): (usize, &Outline)| Room {
            name: names[index].map_or_else(|| format!("room {}", index + 1), |(_, name)| name.clone()),
            usage: None,
            outline: outline.iter().map(&moved).collect(),
        };
        Ok(self.rooms.iter().enumerate().map(room).collect())
    }
}

/// The straight parts of a line.
fn segments(line: &Line) -> Vec<Segment> {
    match line {
        Line::Straight(ends) => vec![*ends],
        Line::Corners(points) | Line::Arc { points, .. } => points.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
        Line::Outline(points) => geometry::sides(points).collect(),
        Line::Point(_) | Line::Text(..) => Vec::new(),
    }
}
