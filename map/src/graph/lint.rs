//! Finds in a walk graph what a tracker would stumble over: each finding with its place and its cure.
//!
//! # Source
//! Graph, 7.1, for what makes a graph good or bad; 6.2.2 for stairs.

use super::draw;
use super::error::Error;
use super::model::{EdgeId, EdgeKind, Graph, NodeId};
use crate::building::check::{Finding, Kind, Notes, sorted};
use crate::building::geometry::{self, Point, Segment, wrapped};
use crate::building::index::Index;
use crate::building::{Building, Floor, Room};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

/// From where on something is a finding.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// A shorter edge is too short. **Units:** m.
    pub short_m: f64,
    /// A longer edge is too long: about ten steps. **Units:** m.
    pub long_m: f64,
    /// Two edges must leave a node so far apart (Graph, 7.1). **Units:** degrees.
    pub fork_deg: f64,
    /// A corner whose arms are so long and which is free between them needs a diagonal. **Units:** m.
    pub corner_m: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        let drawn = draw::Parameters::default();
        Self { short_m: 0.6, long_m: 3.0 * drawn.edge_m, fork_deg: drawn.fork_deg, corner_m: 2.0 }
    }
}

/// An edge shorter than this has no length. **Units:** m.
const ZERO_M: f64 = 0.01;
/// A door leads into a room from whose outline it is no farther. **Units:** m.
const DOOR_M: f64 = 0.4;
/// A smaller outline is no room, but what a plan leaves between walls. **Units:** m².
const LEAST_ROOM_M2: f64 = 0.1;
/// A wall as near as this to a diagonal is in its way. **Units:** m.
const CLEAR_M: f64 = 0.3;

/// Looks at the graph of a building. Errors first, then by kind, floor and place.
///
/// # Errors
/// When the building has no graph, or one that cannot be looked at.
pub fn lint(building: &Building, parameters: &Parameters) -> Result<Vec<Finding>, Error> {
    let graph = Graph::of(building)?;
    let mut lint = Lint { building, graph: &graph, parameters, notes: Notes::of(building) };
    lint.edges();
    lint.forks();
    lint.pieces();
    lint.stairs();
    lint.connectors();
    for floor in &building.floors {
        let walls = Index::of(&floor.walls);
        lint.walls(floor, &walls);
        lint.diagonals(floor, &walls);
        lint.rooms(floor);
    }
    Ok(sorted(lint.notes.findings()))
}

struct Lint<'a> {
    building: &'a Building,
    graph: &'a Graph,
    parameters: &'a Parameters,
    notes: Notes<'a>,
}

impl Lint<'_> {
    /// Each way once: the edge that leaves the node with the smaller number.
    fn ways(&self) -> impl Iterator<Item = EdgeId> + use<> {
        let ways = self.graph.edge_ids().filter(|&id| self.graph.edge(id).from < self.graph.edge(id).to);
        ways.collect::<Vec<_>>().into_iter()
    }

    fn at(&mut self, kind: Kind, id: EdgeId, what: String, cure: &str) {
        let ends = self.graph.ends(id);
        let floor = self.graph.node(self.graph.edge(id).from).floor;
        self.notes.at(kind, floor, geometry::between(ends[0], ends[1], 0.5), what, cure);
    }

    fn edges(&mut self) {
        for id in self.ways() {
            let edge = *self.graph.edge(id);
            let (from, to, length) = (edge.from.0, edge.to.0, edge.length_m);
            if edge.kind == EdgeKind::Elevator {
                continue;
            }
            if length < ZERO_M {
                let what = format!("the edge between nodes {from} and {to} has no length, and so no direction");
                self.at(Kind::ZeroEdge, id, what, "make the two nodes one");
            } else if edge.kind == EdgeKind::Level && length < self.parameters.short_m {
                let what = format!("the edge between nodes {from} and {to} is {length:.2} m long");
                self.at(Kind::ShortEdge, id, what, "make the two nodes one: a turn is looked for at the nearest node");
            } else if length > self.parameters.long_m {
                let what = format!("the edge between nodes {from} and {to} is {length:.1} m long");
                self.at(
                    Kind::LongEdge,
                    id,
                    what,
                    "put nodes on it, about 2.3 m apart: the heading drifts until the next",
                );
            }
        }
    }

    fn forks(&mut self) {
        let least = self.parameters.fork_deg.to_radians();
        for node in self.graph.node_ids() {
            let leaving: Vec<EdgeId> = self.graph.leaving(node).filter(|&id| self.has_direction(id)).collect();
            for (first, a) in leaving.iter().enumerate() {
                for b in &leaving[first + 1..] {
                    let apart = wrapped(self.graph.edge(*a).direction - self.graph.edge(*b).direction).abs();
                    if apart < least {
                        let (to_a, to_b) = (self.graph.edge(*a).to.0, self.graph.edge(*b).to.0);
                        let what = format!(
                            "the edges from node {} to {to_a} and to {to_b} are {:.0} degrees apart",
                            node.0,
                            apart.to_degrees()
                        );
                        let here = *self.graph.node(node);
                        let cure = "take one away: turns below 20 degrees are not told from going straight on";
                        self.notes.at(Kind::NarrowFork, here.floor, here.place, what, cure);
                    }
                }
            }
        }
    }

    fn has_direction(&self, id: EdgeId) -> bool {
        let edge = self.graph.edge(id);
        edge.kind != EdgeKind::Elevator && edge.length_m >= ZERO_M
    }

    fn pieces(&mut self) {
        let mut members: BTreeMap<usize, Vec<NodeId>> = BTreeMap::new();
        for (node, piece) in self.graph.node_ids().zip(self.graph.pieces()) {
            members.entry(piece).or_default().push(node);
        }
        for members in members.into_values().skip(1) {
            let here = *self.graph.node(members[0]);
            let nodes = if members.len() == 1 { "a node".to_owned() } else { format!("{} nodes", members.len()) };
            let what = format!("{nodes} from node {} on, with no way to the rest of the graph", members[0].0);
            let cure = "draw the edge through the door, or take the piece away";
            self.notes.at(Kind::SeparatePiece, here.floor, here.place, what, cure);
        }
    }

    /// Flights that end in the middle of nowhere.
    fn stairs(&mut self) {
        for node in self.graph.node_ids() {
            let mut leaving = self.graph.leaving(node);
            let (Some(only), None) = (leaving.next(), leaving.next()) else { continue };
            let edge = self.graph.edge(only);
            if edge.kind != EdgeKind::Level && edge.rise_m != 0.0 {
                let here = *self.graph.node(node);
                let what = format!("the {} at node {} lead nowhere", edge.kind.word(), node.0);
                let cure = "join their end with the floor it lies on";
                self.notes.at(Kind::LeadsNowhere, here.floor, here.place, what, cure);
            }
        }
    }

    /// Stairs and elevators of the building that no edge climbs.
    fn connectors(&mut self) {
        for connector in &self.building.connectors {
            let inside = |node: NodeId| {
                let node = self.graph.node(node);
                connector.outlines.iter().any(|(_, outline)| {
                    geometry::contains(outline, node.place)
                        || geometry::sides(outline)
                            .any(|side| geometry::distance(geometry::nearest(&side, node.place), node.place) < 0.5)
                })
            };
            let mut floors = connector.outlines.iter().map(|(number, _)| *number).collect::<Vec<_>>();
            floors.sort_by(|a, b| {
                let height = |number: i32| self.building.floor(number).map_or(0.0, |floor| floor.height_m);
                height(*a).total_cmp(&height(*b))
            });
            for pair in floors.windows(2) {
                let [low, high] =
                    [pair[0], pair[1]].map(|number| self.building.floor(number).map_or(0.0, |floor| floor.height_m));
                let climbs = self.graph.edge_ids().any(|id| {
                    let edge = self.graph.edge(id);
                    let from = self.graph.node(edge.from).height_m;
                    edge.rise_m > 0.0
                        && from > low - 0.1
                        && from + edge.rise_m < high + 0.1
                        && inside(edge.from)
                        && inside(edge.to)
                });
                if !climbs {
                    let outline = connector.outlines.iter().find(|(number, _)| *number == pair[0]);
                    let place = outline.map(|(_, outline)| geometry::centre(outline)).unwrap_or_default();
                    let what = format!(
                        "no edge of the graph climbs {} '{}' from floor {} to floor {}",
                        connector.kind.word(),
                        connector.name,
                        pair[0],
                        pair[1]
                    );
                    self.notes.at(Kind::LeadsNowhere, pair[0], place, what, "draw it, or take the stairs away");
                }
            }
        }
    }

    /// Level edges of a floor, each way once.
    fn level_ways(&self, floor: &Floor) -> Vec<EdgeId> {
        let on = |id: &EdgeId| {
            let edge = self.graph.edge(*id);
            let from = self.graph.node(edge.from);
            edge.kind == EdgeKind::Level && from.floor == floor.number && (from.height_m - floor.height_m).abs() < 0.1
        };
        self.ways().filter(on).collect()
    }

    fn walls(&mut self, floor: &Floor, walls: &Index<'_>) {
        for id in self.level_ways(floor) {
            let line = self.graph.ends(id);
            if blocked(walls, &line, 0.0) {
                let (from, to) = (self.graph.edge(id).from.0, self.graph.edge(id).to.0);
                let what = format!("the edge between nodes {from} and {to} leads through a wall");
                self.at(Kind::EdgeThroughWall, id, what, "lead it through a door");
            }
        }
    }

    /// Corners that are free but have no way across (Graph, 7.1 and figure 7.1).
    fn diagonals(&mut self, floor: &Floor, walls: &Index<'_>) {
        let level: BTreeSet<EdgeId> =
            self.level_ways(floor).into_iter().flat_map(|id| [id, self.graph.edge(id).back]).collect();
        for node in self.graph.node_ids().filter(|&node| self.graph.node(node).floor == floor.number) {
            let arms: Vec<EdgeId> = self.graph.leaving(node).filter(|id| level.contains(id)).collect();
            for (first, &a) in arms.iter().enumerate() {
                for &b in &arms[first + 1..] {
                    if self.lacks_diagonal(node, [a, b], walls) {
                        let here = *self.graph.node(node);
                        let [to_a, to_b] = [a, b].map(|id| self.graph.edge(id).to.0);
                        let what = format!(
                            "who goes from node {to_a} to node {to_b} cannot cut the corner at node {}",
                            node.0
                        );
                        let cure = "join the two, or nodes between them, by an edge";
                        self.notes.at(Kind::MissingDiagonal, here.floor, here.place, what, cure);
                    }
                }
            }
        }
    }

    fn lacks_diagonal(&self, corner: NodeId, arms: [EdgeId; 2], walls: &Index<'_>) -> bool {
        let [a, b] = arms.map(|id| *self.graph.edge(id));
        let angle = wrapped(a.direction - b.direction).abs();
        if (angle - 0.5 * PI).abs() > PI / 6.0 || a.length_m.min(b.length_m) < self.parameters.corner_m {
            return false;
        }
        // An edge, or two over a node beside the corner.
        let crossed = |from: NodeId, to: NodeId| {
            let over = |id: EdgeId| self.graph.edge(id).to;
            self.graph
                .leaving(from)
                .map(over)
                .any(|next| next == to || next != corner && self.graph.leaving(next).map(over).any(|last| last == to))
        };
        // One step further on there may be one, too.
        let near = |id: EdgeId| -> Vec<NodeId> {
            let direction = self.graph.edge(id).direction;
            let further = self
                .graph
                .leaving(self.graph.edge(id).to)
                .filter(|&next| wrapped(self.graph.edge(next).direction - direction).abs() < 0.2);
            further.map(|next| self.graph.edge(next).to).chain([self.graph.edge(id).to]).collect()
        };
        let (near_a, near_b) = (near(arms[0]), near(arms[1]));
        if near_a.iter().any(|&from| near_b.iter().any(|&to| crossed(from, to))) {
            return false;
        }
        let here = self.graph.node(corner).place;
        let at = |edge: &super::Edge| -> Point {
            let part = self.parameters.corner_m / edge.length_m;
            geometry::between(here, self.graph.node(edge.to).place, part)
        };
        !blocked(walls, &[at(&a), at(&b)], CLEAR_M)
    }

    /// Rooms with a door that no node of the largest piece is in, and no edge of it leads through.
    fn rooms(&mut self, floor: &Floor) {
        let pieces = self.graph.pieces();
        let ways: Vec<Segment> = self
            .level_ways(floor)
            .into_iter()
            .filter(|&id| pieces[self.graph.edge(id).from.index()] == 0)
            .map(|id| self.graph.ends(id))
            .collect();
        // Slivers that a plan holds between walls are no rooms.
        let roomy = |room: &&Room| geometry::area(&room.outline).abs() >= LEAST_ROOM_M2;
        for room in floor.rooms.iter().filter(roomy) {
            let beside = |line: &Segment| {
                let middle = geometry::between(line[0], line[1], 0.5);
                geometry::sides(&room.outline)
                    .any(|side| geometry::distance(geometry::nearest(&side, middle), middle) < DOOR_M)
            };
            let has_door = floor.doors.iter().any(|door| beside(&door.line));
            let led_into = |way: &Segment| {
                geometry::contains(&room.outline, way[0])
                    || geometry::contains(&room.outline, way[1])
                    || geometry::sides(&room.outline).filter(|side| geometry::crossing(way, side).is_some()).count() > 1
            };
            if has_door && !ways.iter().any(led_into) {
                let what = format!("room '{}' has a door, but the graph does not lead into it", room.name);
                let cure = "draw an edge through its door";
                let place = Some(geometry::centre(&room.outline));
                self.notes.note(Kind::RoomOffGraph, Some(floor.number), place, Some(room.name.clone()), what, cure);
            }
        }
    }
}

/// Whether a wall crosses a line, or comes as near as `reach` to it. **Units:** m.
fn blocked(walls: &Index<'_>, line: &Segment, reach: f64) -> bool {
    let Some(bounds) = geometry::bounds(*line) else { return false };
    walls.near(bounds, reach).into_iter().map(|number| walls.segment(number)).any(|wall| {
        let near =
            |segment: &Segment, point: Point| geometry::distance(geometry::nearest(segment, point), point) < reach;
        geometry::crossing(line, wall).is_some()
            || wall.iter().any(|&end| near(line, end))
            || line.iter().any(|&end| near(wall, end))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::check::Level;
    use crate::building::{Connector, ConnectorKind, Door, Node, WalkGraph};

    /// Two rooms of 6 m by 6 m with a door between them, and a graph through it.
    fn house() -> Building {
        let square = |x: f64| vec![[x, 0.0], [x + 6.0, 0.0], [x + 6.0, 6.0], [x, 6.0]];
        let room = |name: &str, x: f64| Room { name: name.into(), usage: None, outline: square(x) };
        let floor = Floor {
            walls: vec![[[6.0, 0.0], [6.0, 2.5]], [[6.0, 3.5], [6.0, 6.0]]],
            doors: vec![Door { line: [[6.0, 2.5], [6.0, 3.5]], name: None }],
            rooms: vec![room("left", 0.0), room("right", 6.0)],
            ..Floor::default()
        };
        let node = |x: f64, y: f64| Node { place: [x, y], ..Node::default() };
        let graph = WalkGraph {
            nodes: vec![node(1.0, 3.0), node(3.5, 3.0), node(6.0, 3.0), node(8.5, 3.0), node(11.0, 3.0)],
            edges: vec![[0, 1], [1, 2], [2, 3], [3, 4]],
        };
        Building { floors: vec![floor], graph: Some(graph), ..Building::default() }
    }

    fn add(building: &mut Building, floor: i32, place: Point, height_m: f64, to: &[usize]) {
        let graph = building.graph.as_mut().unwrap();
        graph.nodes.push(Node { floor, place, height_m });
        graph.edges.extend(to.iter().map(|&other| [other, graph.nodes.len() - 1]));
    }

    fn found(building: &Building) -> Vec<(Kind, String)> {
        let found = lint(building, &Parameters::default()).unwrap();
        found.into_iter().map(|finding| (finding.kind, finding.what)).collect()
    }

    #[test]
    fn a_good_graph_has_no_findings_and_none_is_an_error() {
        assert_eq!(found(&house()), []);
        assert!(lint(&Building { graph: None, ..house() }, &Parameters::default()).is_err());
    }

    #[test]
    fn edges_too_short_too_long_and_without_length_are_told() {
        let mut building = house();
        add(&mut building, 0, [11.0, 3.4], 0.0, &[4]);
        add(&mut building, 0, [11.0, 3.0], 0.0, &[4]);
        add(&mut building, 0, [-8.0, 3.0], 0.0, &[0]);
        assert_eq!(
            found(&building),
            [
                (Kind::ZeroEdge, "the edge between nodes 4 and 6 has no length, and so no direction".to_owned()),
                (Kind::ShortEdge, "the edge between nodes 4 and 5 is 0.40 m long".to_owned()),
                (Kind::LongEdge, "the edge between nodes 0 and 7 is 9.0 m long".to_owned()),
            ]
        );
    }

    #[test]
    fn an_edge_through_a_wall_and_a_narrow_fork_are_told() {
        let mut building = house();
        add(&mut building, 0, [8.5, 5.5], 0.0, &[1]);
        add(&mut building, 0, [11.0, 3.5], 0.0, &[3]);
        let kinds: Vec<Kind> = found(&building).into_iter().map(|(kind, _)| kind).collect();
        assert_eq!(kinds, [Kind::EdgeThroughWall, Kind::NarrowFork]);
    }

    #[test]
    fn a_corner_that_is_free_needs_a_diagonal() {
        let mut building = house();
        add(&mut building, 0, [3.5, 5.8], 0.0, &[1]);
        let told = found(&building);
        // To both sides.
        assert_eq!(told.iter().filter(|(kind, _)| *kind == Kind::MissingDiagonal).count(), 2, "{told:?}");
        let graph = building.graph.as_mut().unwrap();
        graph.edges.extend([[5, 0], [5, 2]]);
        assert!(found(&building).iter().all(|(kind, _)| *kind != Kind::MissingDiagonal));
    }

    #[test]
    fn a_graph_in_pieces_and_a_room_off_it_are_told() {
        let mut building = house();
        let graph = building.graph.as_mut().unwrap();
        graph.edges.remove(2);
        graph.edges.remove(1);
        add(&mut building, 0, [1.0, 4.5], 0.0, &[0]);
        assert_eq!(
            found(&building),
            [
                (Kind::SeparatePiece, "a node from node 2 on, with no way to the rest of the graph".to_owned()),
                (Kind::SeparatePiece, "2 nodes from node 3 on, with no way to the rest of the graph".to_owned()),
                (Kind::RoomOffGraph, "room 'right' has a door, but the graph does not lead into it".to_owned()),
            ]
        );
    }

    #[test]
    fn a_sliver_beside_a_door_is_no_room() {
        let mut building = house();
        let sliver = |off: f64| Room {
            name: "sliver".into(),
            usage: None,
            outline: vec![[6.1, 2.4], [6.1, 3.6], [6.1 + off, 3.6]],
        };
        building.floors[0].rooms.push(sliver(0.01));
        assert_eq!(found(&building), []);
        // One in which somebody may stand is told, where the graph does not lead into it.
        building.floors[0].rooms.push(Room { name: "closet".into(), ..sliver(-0.5) });
        building.graph.as_mut().unwrap().edges.drain(1..);
        let told = found(&building);
        assert!(told.iter().any(|(kind, what)| *kind == Kind::RoomOffGraph && what.contains("'closet'")), "{told:?}");
        assert!(told.iter().all(|(_, what)| !what.contains("'sliver'")), "{told:?}");
    }

    #[test]
    fn stairs_that_lead_nowhere_are_told() {
        let mut building = house();
        building.floors.push(Floor { number: 1, height_m: 3.5, ..Floor::default() });
        let outline = vec![[8.0, 3.4], [12.0, 3.4], [12.0, 6.0], [8.0, 6.0]];
        building.connectors = vec![Connector {
            name: "A".into(),
            kind: ConnectorKind::Stairs,
            outlines: vec![(0, outline.clone()), (1, outline)],
            way: Vec::new(),
        }];
        let nothing = "no edge of the graph climbs stairs 'A' from floor 0 to floor 1";
        assert_eq!(found(&building), [(Kind::LeadsNowhere, nothing.to_owned())]);
        add(&mut building, 1, [11.0, 5.5], 3.5, &[4]);
        let told = found(&building);
        assert_eq!(told, [(Kind::LeadsNowhere, "the stairs at node 5 lead nowhere".to_owned())]);
        assert_eq!(lint(&building, &Parameters::default()).unwrap()[0].level, Level::Error);
    }
}
