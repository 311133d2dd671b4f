//! Routes in words: from room to room, with where to turn and which stairs to take.
//!
//! # Source
//! Graph, 5.3 for the way; 7.5, which names lists of manoeuvres as what a walk graph is good for besides tracking.

use super::error::Error;
use super::model::{EdgeId, EdgeKind, Graph, NodeId};
use super::paths::{self, Path, plan_length};
use crate::building::geometry::{self, Point, wrapped};
use crate::building::{Building, Connector, Floor};
use std::f64::consts::PI;

/// What people like.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Preferences {
    /// A metre of height on stairs counts as so many metres of level floor; without it nobody takes stairs.
    pub stairs: Option<f64>,
    /// A ride from floor to floor counts as so many metres, the wait included; without it nobody takes an elevator.
    /// **Units:** m.
    pub elevator_m: Option<f64>,
}

impl Default for Preferences {
    fn default() -> Self {
        Self { stairs: Some(4.0), elevator_m: Some(25.0) }
    }
}

/// No way is as long. **Units:** mm.
const NEVER: u64 = 1 << 40;

/// To which side one turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Counter-clockwise from above.
    Left,
    /// Clockwise.
    Right,
}

/// What one does at a place.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// The beginning; whence, and into which direction: clockwise from the y axis. **Units:** rad.
    Start(String, f64),
    /// A turn. **Units:** rad, its size.
    Turn(Side, f64),
    /// Turning round.
    TurnRound,
    /// Stairs, a ramp or an elevator, and the floor they are left on.
    Change {
        /// What it is called.
        name: String,
        /// What it is.
        kind: EdgeKind,
        /// Number of the floor.
        to: i32,
        /// Height gained. **Units:** m.
        rise_m: f64,
    },
    /// The end.
    Arrive(String),
}

/// Something to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Instruction {
    /// What.
    pub action: Action,
    /// After so much of the way since the instruction before. **Units:** m.
    pub after_m: f64,
    /// On which floor.
    pub floor: i32,
    /// Where. **Units:** m; **Frame:** building.
    pub place: Point,
    /// The room one comes into thereby.
    pub into: Option<String>,
}

impl Instruction {
    /// In words.
    pub fn text(&self) -> String {
        let into = self.into.as_ref().map_or_else(String::new, |room| format!(", into {room}"));
        let after = if self.after_m >= 0.5 { format!(" after {:.0} m", self.after_m) } else { String::new() };
        match &self.action {
            Action::Start(from, bearing) => format!("leave from {from} towards {}", compass(*bearing)),
            Action::Turn(side, angle) => {
                let side = if *side == Side::Left { "left" } else { "right" };
                let verb = match angle.to_degrees() {
                    angle if angle < 60.0 => "bear",
                    angle if angle < 120.0 => "turn",
                    _ => "turn sharply",
                };
                format!("{verb} {side}{after}{into}")
            }
            Action::TurnRound => format!("turn round{after}{into}"),
            Action::Change { name, kind, to, rise_m } => {
                let way = if *rise_m > 0.0 { "up" } else { "down" };
                let kind = kind.word();
                let name = if name.is_empty() { format!("the {kind}") } else { format!("the {kind} ({name})") };
                format!("take {name}{after}, {way} to floor {to}")
            }
            Action::Arrive(to) => format!("arrive at {to}{after}"),
        }
    }
}

/// One of eight winds, for buildings whose y axis points north.
fn compass(bearing: f64) -> &'static str {
    const WINDS: [&str; 8] = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];
    WINDS[(bearing / (PI / 4.0)).round().rem_euclid(8.0) as usize]
}

/// A way with instructions.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// The edges.
    pub path: Path,
    /// From the beginning to the end.
    pub instructions: Vec<Instruction>,
    /// On foot, in the plan. **Units:** m.
    pub length_m: f64,
}

/// The best way between two places, each the name of a room (as [`Building::room`] takes it) or of an entrance.
///
/// # Errors
/// When a name is not known, the graph has no node there, or no way leads from one to the other.
pub fn route(
    building: &Building,
    graph: &Graph,
    [from, to]: [&str; 2],
    preferences: &Preferences,
) -> Result<Route, Error> {
    let (start, end) = (node_of(building, graph, from)?, node_of(building, graph, to)?);
    let weight = |edge: &super::Edge| {
        let length = plan_length(edge);
        let more = |each: Option<f64>, count: f64| each.map_or(NEVER, |each| (each * count * 1e3).ceil() as u64);
        match edge.kind {
            EdgeKind::Level => length,
            EdgeKind::Stairs | EdgeKind::Ramp if edge.rise_m == 0.0 => length,
            EdgeKind::Stairs => length + more(preferences.stairs, edge.rise_m.abs()),
            EdgeKind::Ramp => length + (edge.rise_m.abs() * 1e3) as u64,
            EdgeKind::Elevator => length + more(preferences.elevator_m, 1.0),
        }
    };
    let path = paths::astar(graph, start, end, weight).filter(|path| path.weight_mm < NEVER);
    let path = path.ok_or_else(|| Error::NoWay(format!("no way that may be taken leads from '{from}' to '{to}'")))?;
    let instructions = Guide { building, graph }.instructions(&path, [from, to], start);
    let on_foot = path.edges.iter().map(|&id| graph.edge(id)).filter(|edge| edge.kind != EdgeKind::Elevator);
    let length_m = on_foot.map(|edge| edge.length_m).sum();
    Ok(Route { path, instructions, length_m })
}

/// The node where somebody in a room, or at an entrance, is.
fn node_of(building: &Building, graph: &Graph, name: &str) -> Result<NodeId, Error> {
    let pieces = graph.pieces();
    let near = |floor: i32, place: Point, fits: &dyn Fn(Point) -> bool| {
        let here = graph.node_ids().filter(|&id| graph.node(id).floor == floor && fits(graph.node(id).place));
        let far = |id: &NodeId| (pieces[id.index()], geometry::distance(graph.node(*id).place, place));
        here.min_by(|a, b| far(a).partial_cmp(&far(b)).unwrap_or(std::cmp::Ordering::Equal))
    };
    if let Some((floor, room)) = building.room(name) {
        let inside = |place: Point| geometry::contains(&room.outline, place);
        let found = near(floor.number, geometry::centre(&room.outline), &inside);
        return found.ok_or_else(|| Error::NoWay(format!("the walk graph does not lead into room '{name}'")));
    }
    if let Some(entrance) = building.entrances.iter().find(|entrance| entrance.name == name) {
        let found = near(entrance.floor, entrance.place, &|_| true);
        return found
            .ok_or_else(|| Error::NoWay(format!("the walk graph has no node on the floor of entrance '{name}'")));
    }
    let rooms = building.floors.iter().flat_map(|floor| &floor.rooms).map(|room| room.name.as_str());
    let known: Vec<&str> = rooms.take(12).collect();
    Err(Error::NoWay(format!(
        "'{name}' is no room and no entrance of the building; its rooms begin with {}",
        known.join(", ")
    )))
}

/// Corners of less than this are none. **Units:** rad.
const STRAIGHT: f64 = 25.0 * PI / 180.0;
/// Turns to the same side nearer to each other than this are one. **Units:** m.
const ONE_TURN_M: f64 = 4.0;
/// Ways are straightened to this before turns are told. **Units:** m.
const OFF_M: f64 = 0.6;
/// A piece of the way: level, or by stairs and the like.
#[derive(Debug)]
struct Piece {
    edges: Vec<EdgeId>,
    /// What climbs, if anything does.
    kind: EdgeKind,
}

struct Guide<'a> {
    building: &'a Building,
    graph: &'a Graph,
}

impl Guide<'_> {
    fn instructions(&self, path: &Path, [from, to]: [&str; 2], start: NodeId) -> Vec<Instruction> {
        let pieces = self.pieces(path);
        let first = path.edges.first().map_or(0.0, |&id| self.first_direction(&pieces, id));
        let node = self.graph.node(start);
        let action = Action::Start(from.to_owned(), (0.5 * PI - first).rem_euclid(2.0 * PI));
        let mut list = vec![Instruction { action, after_m: 0.0, floor: node.floor, place: node.place, into: None }];
        let mut walked = 0.0;
        let mut heading: Option<f64> = None;
        for piece in &pieces {
            let ends = [piece.edges.first(), piece.edges.last()].map(|id| id.map(|&id| self.graph.edge(id)));
            let [Some(enter), Some(leave)] = ends else { continue };
            let (from, to) = (self.graph.node(enter.from), self.graph.node(leave.to));
            if piece.kind == EdgeKind::Level {
                self.turns(piece, &mut heading, &mut walked, &mut list);
                continue;
            }
            let name = self.connector(from.place, from.floor).map_or_else(String::new, |found| found.name.clone());
            let (to_floor, rise_m) = (self.floor_at(to.height_m), to.height_m - from.height_m);
            let action = Action::Change { name, kind: piece.kind, to: to_floor, rise_m };
            let floor = self.floor_at(from.height_m);
            list.push(Instruction { action, after_m: walked, floor, place: from.place, into: None });
            walked = 0.0;
            heading = (piece.kind != EdgeKind::Elevator).then_some(leave.direction);
        }
        let end = path.edges.last().map_or(start, |&id| self.graph.edge(id).to);
        let node = self.graph.node(end);
        let floor = self.floor_at(node.height_m);
        list.push(Instruction {
            action: Action::Arrive(to.to_owned()),
            after_m: walked,
            floor,
            place: node.place,
            into: None,
        });
        list
    }

    /// Level pieces and climbs in turn; half landings belong to their climb.
    fn pieces(&self, path: &Path) -> Vec<Piece> {
        let mut pieces: Vec<Piece> = Vec::new();
        for &id in &path.edges {
            let edge = self.graph.edge(id);
            let on_floor = [edge.from, edge.to].map(|id| {
                let node = self.graph.node(id);
                self.building.floors.iter().any(|floor| (floor.height_m - node.height_m).abs() < 0.1)
            });
            let between = !on_floor[0] && !on_floor[1];
            let kind = match (edge.kind, pieces.last()) {
                (EdgeKind::Level, Some(last)) if between => last.kind,
                (kind, _) => kind,
            };
            match pieces.last_mut() {
                // The next floor of the same stairs is the same climb: the landing between is no place to leave it.
                Some(last) if last.kind == kind => last.edges.push(id),
                _ => pieces.push(Piece { edges: vec![id], kind }),
            }
        }
        pieces
    }

    fn first_direction(&self, pieces: &[Piece], first: EdgeId) -> f64 {
        let Some(piece) = pieces.first().filter(|piece| piece.kind == EdgeKind::Level) else {
            return self.graph.edge(first).direction;
        };
        let points = self.line(piece);
        points.get(1).map_or(0.0, |to| geometry::direction(points[0], *to))
    }

    /// The corners of a level piece.
    fn line(&self, piece: &Piece) -> Vec<Point> {
        let mut points: Vec<Point> = piece.edges.first().map(|&id| self.graph.ends(id)[0]).into_iter().collect();
        points.extend(piece.edges.iter().map(|&id| self.graph.ends(id)[1]));
        geometry::simplified(&points, OFF_M)
    }

    /// The turns of a level piece.
    fn turns(&self, piece: &Piece, heading: &mut Option<f64>, walked: &mut f64, list: &mut Vec<Instruction>) {
        let floor =
            piece.edges.first().map_or(0, |&id| self.floor_at(self.graph.node(self.graph.edge(id).from).height_m));
        let points = self.line(piece);
        // A turn that is being made: where it began, how far it has gone, and how long ago it last went on.
        let mut turning: Option<(Point, f64, f64, f64)> = None;
        for pair in points.windows(2) {
            let direction = geometry::direction(pair[0], pair[1]);
            let angle = heading.map_or(0.0, |before| wrapped(direction - before));
            if angle.abs() >= STRAIGHT {
                match &mut turning {
                    Some((_, sum, _, since)) if *sum * angle > 0.0 && *since < ONE_TURN_M => {
                        *sum += angle;
                        *since = 0.0;
                    }
                    _ => {
                        self.tell(floor, turning.take(), walked, list, pair[0]);
                        turning = Some((pair[0], angle, *walked, 0.0));
                    }
                }
            }
            let length = geometry::distance(pair[0], pair[1]);
            *walked += length;
            if let Some((_, _, _, since)) = &mut turning {
                *since += length;
            }
            *heading = Some(direction);
        }
        if let Some(&last) = points.last() {
            self.tell(floor, turning, walked, list, last);
        }
    }

    /// Tells a turn that was made before `next`.
    fn tell(
        &self,
        floor: i32,
        turning: Option<(Point, f64, f64, f64)>,
        walked: &mut f64,
        list: &mut Vec<Instruction>,
        next: Point,
    ) {
        let Some((place, angle, at, _)) = turning else { return };
        let action = match angle.abs() {
            angle if angle > 0.9 * PI => Action::TurnRound,
            size => Action::Turn(if angle > 0.0 { Side::Left } else { Side::Right }, size),
        };
        let room = |point: Point| self.building.floor(floor).and_then(|floor: &Floor| floor.room_at(point));
        let into = room(next).filter(|after| room(place).is_none_or(|before| before.name != after.name));
        let into = into.map(|room| room.name.clone());
        list.push(Instruction { action, after_m: at, floor, place, into });
        *walked -= at;
    }

    fn connector(&self, place: Point, floor: i32) -> Option<&Connector> {
        self.building.connectors.iter().find(|connector| {
            connector.outlines.iter().any(|(number, outline)| *number == floor && geometry::contains(outline, place))
        })
    }

    /// The floor at a height; the nearest to it.
    fn floor_at(&self, height_m: f64) -> i32 {
        let far = |floor: &&Floor| (floor.height_m - height_m).abs();
        let nearest = self.building.floors.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        nearest.map_or(0, |floor| floor.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Node, Room, WalkGraph, generate};
    use crate::graph::draw::{self, draw};

    /// 12 m to the east, 5 m to the north, in two rooms.
    fn corner() -> Building {
        let room = |name: &str, [x, y]: Point, [w, h]: Point| Room {
            name: name.into(),
            usage: None,
            outline: vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]],
        };
        let floor = Floor {
            rooms: vec![room("a", [-1.0, -1.0], [14.0, 2.0]), room("b", [11.0, 1.0], [2.0, 6.0])],
            ..Floor::default()
        };
        let node = |place: Point| Node { place, ..Node::default() };
        let nodes = vec![node([0.0, 0.0]), node([6.0, 0.0]), node([12.0, 0.0]), node([12.0, 5.0]), node([30.0, 0.0])];
        let graph = Some(WalkGraph { nodes, edges: vec![[0, 1], [1, 2], [2, 3]] });
        Building { floors: vec![floor], graph, ..Building::default() }
    }

    fn told(building: &Building, stops: [&str; 2], preferences: &Preferences) -> Vec<String> {
        let graph = Graph::of(building).unwrap();
        let route = route(building, &graph, stops, preferences).unwrap();
        route.instructions.iter().map(Instruction::text).collect()
    }

    #[test]
    fn a_corner_is_a_turn_after_so_many_metres() {
        // From the node in the middle of a: it is nearest to the centre of the room.
        let told = told(&corner(), ["a", "b"], &Preferences::default());
        assert_eq!(told, ["leave from a towards east", "turn left after 6 m, into b", "arrive at b after 5 m"]);
    }

    #[test]
    fn names_and_ways_that_are_not_there_are_told() {
        let mut building = corner();
        let graph = Graph::of(&building).unwrap();
        let message = |building: &Building, stops: [&str; 2]| {
            route(building, &graph, stops, &Preferences::default()).unwrap_err().to_string()
        };
        assert_eq!(
            message(&building, ["a", "cellar"]),
            "'cellar' is no room and no entrance of the building; its rooms begin with a, b"
        );
        building.floors[0].rooms.push(Room {
            name: "c".into(),
            usage: None,
            outline: vec![[29.0, -1.0], [31.0, -1.0], [31.0, 1.0], [29.0, 1.0]],
        });
        assert_eq!(message(&building, ["a", "c"]), "no way that may be taken leads from 'a' to 'c'");
    }

    #[test]
    fn stairs_and_elevators_are_taken_as_liked() {
        let mut building = generate::twin(2);
        building.graph = Some(draw(&building, &draw::Parameters { cell_m: 0.15, ..draw::Parameters::default() }));
        let on_foot = Preferences { elevator_m: None, ..Preferences::default() };
        let carried = Preferences { stairs: None, ..Preferences::default() };
        let climbs = |told: Vec<String>| told.into_iter().filter(|line| line.starts_with("take")).collect::<Vec<_>>();
        let [stairs] = &climbs(told(&building, ["W01", "W14"], &on_foot))[..] else { panic!("one climb") };
        assert!(stairs.starts_with("take the stairs (stairs-W)") && stairs.ends_with("up to floor 1"), "{stairs}");
        let [down] = &climbs(told(&building, ["W14", "W01"], &carried))[..] else { panic!("one ride") };
        assert!(down.starts_with("take the elevator (elevator-1)") && down.ends_with("down to floor 0"), "{down}");
        let graph = Graph::of(&building).unwrap();
        let never = Preferences { stairs: None, elevator_m: None };
        assert!(route(&building, &graph, ["W01", "W14"], &never).is_err());
    }
}
