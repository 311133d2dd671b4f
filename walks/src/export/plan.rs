//! A floor from above, as SVG: rooms, walls, doors, what joins floors, and marks with numbers.

use super::pen::{Anchor, Lettering, Pen};
use super::scale::{Range, label, round_spacing};
use crate::building::geometry::{self, Outline, Point};
use crate::building::{Building, ConnectorKind, Floor};

/// The page. **Units:** px.
const WIDTH: f64 = 1400.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = WIDTH - 24.0;
const TOP: f64 = 96.0;
/// Bounds of the height of the plan. **Units:** px.
const HEIGHT: (f64, f64) = (240.0, 1300.0);

const PAPER: &str = "#ffffff";
const FIELD: &str = "#f4f4f1";
const GRID: &str = "#e2e2dc";
const INK: &str = "#20242a";
const FAINT: &str = "#565b63";
const ROOM: &str = "#ffffff";
const PASSAGE: &str = "#f1f5fa";
const STAIRS: &str = "#f3e2bd";
const ELEVATOR: &str = "#cfe6e2";
const DOOR: &str = "#3a9b57";
const WAY: &str = "#b58a2c";
const GRAPH: &str = "#8d7fc0";

const TITLE: Lettering = Lettering { size: 24.0, colour: INK, anchor: Anchor::Start };
const NOTE: Lettering = Lettering { size: 14.0, colour: FAINT, anchor: Anchor::Start };
const SMALL: Lettering = Lettering { size: 12.0, colour: FAINT, anchor: Anchor::Start };

/// How a mark looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Must be cured.
    Error,
    /// Should be looked at.
    Warning,
    /// Where somebody is.
    Place,
}

/// A place that is pointed at.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Where. **Units:** m; **Frame:** building.
    pub place: Point,
    /// Its number or word.
    pub text: String,
    /// How it looks.
    pub look: Look,
}

/// A path on a floor. **Units:** m; **Frame:** building.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// What it is.
    pub label: &'static str,
    /// Of the line, as SVG has it.
    pub colour: &'static str,
    /// Of the line. **Units:** px.
    pub width: f64,
    /// Pieces of the path on this floor.
    pub pieces: Vec<Vec<Point>>,
}

/// Many places on a floor, a cloud of particles for instance. **Units:** m; **Frame:** building.
#[derive(Clone, Debug, PartialEq)]
pub struct Dots {
    /// What they are.
    pub label: &'static str,
    /// As SVG has it.
    pub colour: &'static str,
    /// The places.
    pub places: Vec<Point>,
}

/// Draws a floor with marks on it.
pub fn draw(building: &Building, floor: &Floor, marks: &[Mark]) -> String {
    draw_with(building, floor, marks, &[], &[])
}

/// Draws a floor with marks, dots and, above them, paths.
pub fn draw_with(building: &Building, floor: &Floor, marks: &[Mark], dots: &[Dots], traces: &[Trace]) -> String {
    let mut pen = Pen::new();
    let plan = Plan::of(building, floor, marks);
    pen.text([LEFT, 40.0], &title(building, floor), TITLE);
    pen.text([LEFT, 62.0], &note(floor), NOTE);
    let lines = traces.iter().filter(|trace| !trace.pieces.is_empty()).map(|trace| (trace.colour, trace.label));
    let clouds = dots.iter().filter(|dots| !dots.places.is_empty()).map(|dots| (dots.colour, dots.label));
    key(&mut pen, building, floor, &clouds.chain(lines).collect::<Vec<_>>());
    plan.grid(&mut pen);
    pen.clip("plan", [LEFT, TOP], [RIGHT - LEFT, plan.bottom - TOP]);
    plan.areas(&mut pen, building, floor);
    plan.lines(&mut pen, building, floor);
    plan.names(&mut pen, building, floor);
    for entrance in building.entrances.iter().filter(|entrance| entrance.floor == floor.number) {
        let at = plan.at(entrance.place);
        pen.outline(at, &[[0.0, -9.0], [8.0, 6.0], [-8.0, 6.0]], DOOR, (PAPER, 1.0));
    }
    for dots in dots {
        for place in &dots.places {
            pen.circle(plan.at(*place), 1.6, dots.colour, (PAPER, 0.0));
        }
    }
    for trace in traces {
        for piece in &trace.pieces {
            pen.polyline(piece.iter().map(|point| plan.at(*point)), trace.colour, trace.width, 0.9);
        }
    }
    for mark in marks {
        plan.mark(&mut pen, mark);
    }
    pen.unclip();
    pen.finish(WIDTH, plan.bottom + 48.0, PAPER)
}

fn title(building: &Building, floor: &Floor) -> String {
    let name = if floor.name.is_empty() { String::new() } else { format!(" ({})", floor.name) };
    format!("{}, floor {}{name}", building.name, floor.number)
}

fn note(floor: &Floor) -> String {
    let walls: f64 = floor.walls.iter().map(geometry::length).sum();
    format!(
        "{:.2} m above the origin; {} rooms, {} walls ({walls:.0} m), {} doors",
        floor.height_m,
        floor.rooms.len(),
        floor.walls.len(),
        floor.doors.len()
    )
}

/// What the colours mean: only those that occur.
fn key(pen: &mut Pen, building: &Building, floor: &Floor, more: &[(&str, &str)]) {
    let on = |kinds: &[ConnectorKind]| {
        building.connectors.iter().any(|connector| {
            kinds.contains(&connector.kind) && connector.outlines.iter().any(|(number, _)| *number == floor.number)
        })
    };
    let entries = [
        (INK, "wall", !floor.walls.is_empty()),
        (DOOR, "door", !floor.doors.is_empty()),
        (STAIRS, "stairs, ramp", on(&[ConnectorKind::Stairs, ConnectorKind::Ramp])),
        (ELEVATOR, "elevator", on(&[ConnectorKind::Elevator])),
        (GRAPH, "walk graph", building.graph.is_some()),
    ];
    let mut x = LEFT;
    let occurring = entries.iter().filter(|(_, _, occurs)| *occurs).map(|(colour, word, _)| (*colour, *word));
    for (colour, word) in occurring.chain(more.iter().copied()) {
        pen.rectangle([x, 73.0], [14.0, 12.0], colour);
        pen.text([x + 20.0, 84.0], word, SMALL);
        x += 40.0 + 6.4 * word.len() as f64;
    }
}

/// Metres to pixels.
struct Plan {
    bottom: f64,
    x: Range,
    y: Range,
    scale: f64,
}

impl Plan {
    fn of(building: &Building, floor: &Floor, marks: &[Mark]) -> Self {
        let areas = building.connectors.iter().flat_map(|connector| &connector.outlines);
        let areas =
            areas.filter(|(number, _)| *number == floor.number).flat_map(|(_, outline)| outline.iter().copied());
        let points = floor.points().chain(areas).chain(marks.iter().map(|mark| mark.place));
        let [low, high] = geometry::bounds(points).unwrap_or_default();
        let room = |axis: usize| {
            let range = Range { from: low[axis], to: high[axis] };
            range.padded(0.5 + 0.02 * range.length()).at_least(2.0)
        };
        let (x, y) = (room(0), room(1));
        let width = RIGHT - LEFT;
        let height = (width * y.length() / x.length()).clamp(HEIGHT.0, HEIGHT.1);
        let scale = (width / x.length()).min(height / y.length());
        Self { bottom: TOP + height, x: x.at_least(width / scale), y: y.at_least(height / scale), scale }
    }

    fn at(&self, point: Point) -> [f64; 2] {
        [LEFT + (point[0] - self.x.from) * self.scale, self.bottom - (point[1] - self.y.from) * self.scale]
    }

    fn grid(&self, pen: &mut Pen) {
        pen.rectangle([LEFT, TOP], [RIGHT - LEFT, self.bottom - TOP], FIELD);
        let spacing = round_spacing(70.0 / self.scale);
        for x in self.x.ticks(spacing) {
            let [at, _] = self.at([x, 0.0]);
            pen.line([at, TOP], [at, self.bottom], GRID, 1.0);
            pen.text([at, self.bottom + 17.0], &label(x, spacing), Lettering { anchor: Anchor::Middle, ..SMALL });
        }
        for y in self.y.ticks(spacing) {
            let [_, at] = self.at([0.0, y]);
            pen.line([LEFT, at], [RIGHT, at], GRID, 1.0);
            pen.text([LEFT - 8.0, at + 4.5], &label(y, spacing), Lettering { anchor: Anchor::End, ..SMALL });
        }
        pen.text([RIGHT, self.bottom + 36.0], "x, y in metres", Lettering { anchor: Anchor::End, ..SMALL });
    }

    fn area(&self, pen: &mut Pen, outline: &Outline, fill: &str, rim: (&str, f64)) {
        let corners: Vec<_> = outline.iter().map(|&corner| self.at(corner)).collect();
        pen.outline([0.0; 2], &corners, fill, rim);
    }

    fn areas(&self, pen: &mut Pen, building: &Building, floor: &Floor) {
        // Large ones first: a room in a room stays visible.
        let mut rooms: Vec<_> = floor.rooms.iter().collect();
        rooms.sort_by(|a, b| geometry::area(&b.outline).abs().total_cmp(&geometry::area(&a.outline).abs()));
        for room in rooms {
            let usage = room.usage.as_deref().unwrap_or_default().to_lowercase();
            let passage = ["corridor", "hallway", "hall", "lobby", "foyer"].iter().any(|word| usage.contains(word));
            self.area(pen, &room.outline, if passage { PASSAGE } else { ROOM }, (GRID, 0.6));
        }
        for connector in &building.connectors {
            let fill = if connector.kind == ConnectorKind::Elevator { ELEVATOR } else { STAIRS };
            for (_, outline) in connector.outlines.iter().filter(|(number, _)| *number == floor.number) {
                self.area(pen, outline, fill, (WAY, 0.8));
                if connector.kind != ConnectorKind::Elevator {
                    let way = connector.way.iter().map(|&[x, y, _]| self.at([x, y]));
                    pen.polyline(way, WAY, 1.4, 1.0);
                }
            }
        }
    }

    fn lines(&self, pen: &mut Pen, building: &Building, floor: &Floor) {
        if let Some(graph) = &building.graph {
            for edge in &graph.edges {
                let ends = edge.map(|index| &graph.nodes[index]);
                if ends.iter().any(|node| node.floor == floor.number) {
                    pen.line(self.at(ends[0].place), self.at(ends[1].place), GRAPH, 0.8);
                }
            }
        }
        let width = (0.1 * self.scale).clamp(1.0, 3.0);
        for door in &floor.doors {
            pen.line(self.at(door.line[0]), self.at(door.line[1]), DOOR, width);
        }
        for wall in &floor.walls {
            pen.line(self.at(wall[0]), self.at(wall[1]), INK, width);
        }
    }

    fn names(&self, pen: &mut Pen, building: &Building, floor: &Floor) {
        let rooms = floor.rooms.iter().map(|room| (&room.name, &room.outline));
        let areas = building.connectors.iter().flat_map(|connector| {
            let here = connector.outlines.iter().filter(|(number, _)| *number == floor.number);
            // One that lies in a room has the room's name already.
            let here = here.filter(|(_, outline)| floor.room_at(geometry::centre(outline)).is_none());
            here.map(|(_, outline)| (&connector.name, outline))
        });
        for (name, outline) in rooms.chain(areas) {
            let Some([low, high]) = geometry::bounds(outline.iter().copied()) else { continue };
            let width = (high[0] - low[0]) * self.scale;
            // A letter takes a good half of its height.
            let size = (width / (0.6 * name.chars().count().max(1) as f64)).min((high[1] - low[1]) * self.scale * 0.6);
            let middle = geometry::centre(outline);
            if size >= 6.0 && geometry::contains(outline, middle) {
                let [x, y] = self.at(middle);
                let size = size.min(13.0);
                pen.text([x, y + size * 0.35], name, Lettering { size, colour: FAINT, anchor: Anchor::Middle });
            }
        }
    }

    fn mark(&self, pen: &mut Pen, mark: &Mark) {
        let at = self.at(mark.place);
        let colour = match mark.look {
            Look::Error => "#c4252b",
            Look::Warning => "#d9822b",
            Look::Place => "#2456b4",
        };
        pen.circle(at, 7.0, "none", (colour, 2.2));
        let lettering = Lettering { size: 14.0, colour, anchor: Anchor::Start };
        pen.text_with_halo([at[0] + 9.0, at[1] - 5.0], &mark.text, lettering);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Room, geometry::Segment};
    use resvg::usvg;

    fn house() -> Building {
        let walls: Vec<Segment> = vec![[[0.0, 0.0], [8.0, 0.0]], [[8.0, 0.0], [8.0, 6.0]]];
        let outline = vec![[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0]];
        let rooms = vec![Room { name: "A & <B>".into(), usage: Some("Hallway".into()), outline }];
        let floor = Floor { walls, rooms, ..Floor::default() };
        Building { name: "House".into(), floors: vec![floor], ..Building::default() }.assembled().unwrap()
    }

    #[test]
    fn a_floor_is_a_drawing_with_its_marks_and_names() {
        let building = house();
        let mark = Mark { place: [4.0, 3.0], text: "17".into(), look: Look::Error };
        let svg = draw(&building, &building.floors[0], &[mark]);
        assert!(usvg::Tree::from_str(&svg, &usvg::Options::default()).is_ok());
        assert!(svg.contains(">17</text>") && svg.contains("A &amp; &lt;B&gt;"));
    }

    #[test]
    fn an_empty_floor_is_drawn_too() {
        let building = Building { floors: vec![Floor::default()], ..Building::default() }.assembled().unwrap();
        let svg = draw(&building, &building.floors[0], &[]);
        assert!(usvg::Tree::from_str(&svg, &usvg::Options::default()).is_ok() && !svg.contains("NaN"));
    }
}
