//! The parts of a building.

use super::error::Error;
use super::geometry::{self, Outline, Point, Segment};
use super::georeference::Georeference;
use std::collections::BTreeSet;

/// A building.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Building {
    /// What it is called.
    pub name: String,
    /// Where it is.
    pub georeference: Georeference,
    /// From the lowest to the highest.
    pub floors: Vec<Floor>,
    /// What joins floors.
    pub connectors: Vec<Connector>,
    /// Where one comes in.
    pub entrances: Vec<Entrance>,
    /// The ways that people take, if somebody drew them.
    pub graph: Option<WalkGraph>,
}

/// A floor. **Units:** m; **Frame:** building.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Floor {
    /// Its number; 0 is usually the ground floor.
    pub number: i32,
    /// What it is called.
    pub name: String,
    /// Above the origin of the building.
    pub height_m: f64,
    /// What nobody goes through. Doors are gaps in them.
    pub walls: Vec<Segment>,
    /// Gaps in the walls that one goes through.
    pub doors: Vec<Door>,
    /// Areas with a name.
    pub rooms: Vec<Room>,
}

/// A door.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Door {
    /// From one side of the frame to the other.
    pub line: Segment,
    /// What it is called, if it is.
    pub name: Option<String>,
}

/// A room, a corridor, a hall.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Room {
    /// What it is called.
    pub name: String,
    /// What it is for, if that is known.
    pub usage: Option<String>,
    /// Its border.
    pub outline: Outline,
}

/// How one gets from floor to floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ConnectorKind {
    /// A staircase.
    Stairs,
    /// A ramp.
    Ramp,
    /// An elevator.
    Elevator,
}

impl ConnectorKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Stairs, Self::Ramp, Self::Elevator];

    /// In a file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stairs => "stairs",
            Self::Ramp => "ramp",
            Self::Elevator => "elevator",
        }
    }
}

/// Stairs, a ramp or an elevator.
#[derive(Clone, Debug, PartialEq)]
pub struct Connector {
    /// What it is called; no other has this name.
    pub name: String,
    /// What it is.
    pub kind: ConnectorKind,
    /// Where it is on each floor that it joins: number of the floor and border.
    pub outlines: Vec<(i32, Outline)>,
    /// The way of somebody who walks it from the lowest floor to the highest, with heights: the points between which one
    /// goes straight. Empty when it is not known, and for elevators. **Units:** m.
    pub way: Vec<[f64; 3]>,
}

/// A way into the building.
#[derive(Clone, Debug, PartialEq)]
pub struct Entrance {
    /// What it is called.
    pub name: String,
    /// Number of the floor.
    pub floor: i32,
    /// Where.
    pub place: Point,
    /// Id of the beacon above its door, if there is one.
    pub beacon: Option<String>,
}

/// The ways that people take: places, and which of them one can walk between, in both directions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WalkGraph {
    /// The places.
    pub nodes: Vec<Node>,
    /// Pairs of indices into the nodes.
    pub edges: Vec<[usize; 2]>,
}

/// A place of a [`WalkGraph`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Node {
    /// Number of the floor; on stairs that of the floor below.
    pub floor: i32,
    /// Where. **Units:** m; **Frame:** building.
    pub place: Point,
    /// Above the origin of the building; on stairs between the heights of the floors. **Units:** m.
    pub height_m: f64,
}

impl Building {
    /// Puts the floors in order and checks that the parts fit together.
    ///
    /// # Errors
    /// Without floors, when two have the same number or height, when something is no number or farther than 5 km from
    /// the origin, when an outline has fewer than three corners, when a connector, an entrance or a node of the graph names
    /// a floor that is not there, when a name is taken, or when an edge of the graph ends at no node.
    pub fn assembled(mut self) -> Result<Self, Error> {
        self.floors.sort_by(|a, b| a.height_m.total_cmp(&b.height_m));
        let wrong = |what: String| Err(Error::Model(what));
        if self.floors.is_empty() {
            return wrong("the building has no floors".to_owned());
        }
        for pair in self.floors.windows(2) {
            if pair[0].height_m >= pair[1].height_m {
                return wrong(format!("floors {} and {} have the same height", pair[0].number, pair[1].number));
            }
        }
        let numbers: BTreeSet<i32> = self.floors.iter().map(|floor| floor.number).collect();
        if numbers.len() < self.floors.len() {
            return wrong("two floors have the same number".to_owned());
        }
        for floor in &self.floors {
            floor.check()?;
        }
        let mut names = BTreeSet::new();
        for connector in &self.connectors {
            let name = &connector.name;
            if !names.insert(name) {
                return wrong(format!("two connectors are called '{name}'"));
            }
            let mut floors = BTreeSet::new();
            for (floor, outline) in &connector.outlines {
                if !numbers.contains(floor) {
                    return wrong(format!("connector '{name}' is on floor {floor}, which is not there"));
                }
                if !floors.insert(floor) {
                    return wrong(format!("connector '{name}' is on floor {floor} twice"));
                }
                check_outline(outline, &format!("connector '{name}' on floor {floor}"))?;
            }
            if !connector.way.iter().all(|[x, y, z]| is_place(&[*x, *y]) && is_place(&[*z, 0.0])) {
                return wrong(format!("the way of connector '{name}' is no way"));
            }
        }
        for entrance in &self.entrances {
            if !numbers.contains(&entrance.floor) {
                return wrong(format!(
                    "entrance '{}' is on floor {}, which is not there",
                    entrance.name, entrance.floor
                ));
            }
            if !is_place(&entrance.place) {
                return wrong(format!("entrance '{}' is at no place", entrance.name));
            }
        }
        if let Some(graph) = &self.graph {
            check_graph(graph, &numbers)?;
        }
        Ok(self)
    }

    /// The floor with this number.
    pub fn floor(&self, number: i32) -> Option<&Floor> {
        self.floors.iter().find(|floor| floor.number == number)
    }

    /// Stairs, ramp or elevator at a point of a floor.
    pub fn connector_at(&self, floor: i32, point: Point) -> Option<&Connector> {
        let holds = |(number, outline): &(i32, Outline)| *number == floor && geometry::contains(outline, point);
        self.connectors.iter().find(|connector| connector.outlines.iter().any(holds))
    }

    /// Where the room of this name is: its floor and itself. The name may be that of the room alone, or that of the floor and
    /// the room with a slash between them when several floors have one.
    pub fn room(&self, name: &str) -> Option<(&Floor, &Room)> {
        self.floors.iter().find_map(|floor| {
            let is = |room: &&Room| {
                room.name == name
                    || name.strip_prefix(&floor.name).and_then(|rest| rest.strip_prefix('/')) == Some(&room.name)
            };
            floor.rooms.iter().find(is).map(|room| (floor, room))
        })
    }

    /// Corners of all that is in it; nothing in an empty one.
    pub fn bounds(&self) -> Option<[Point; 2]> {
        geometry::bounds(self.floors.iter().flat_map(Floor::points))
    }
}

/// The farthest from the origin that a building reaches. **Units:** m.
const FARTHEST_M: f64 = 5_000.0;

/// Whether a point is a place of a building.
pub(super) fn is_place(point: &Point) -> bool {
    // Written so that no number is no place.
    point.iter().all(|value| value.abs() <= FARTHEST_M)
}

fn check_outline(outline: &[Point], what: &str) -> Result<(), Error> {
    if outline.len() < 3 {
        return Err(Error::Model(format!("{what} has {} corners; an area needs three", outline.len())));
    }
    check_places(outline.iter(), what)
}

fn check_places<'a>(mut points: impl Iterator<Item = &'a Point>, what: &str) -> Result<(), Error> {
    match points.find(|point| !is_place(point)) {
        Some([x, y]) => Err(Error::Model(format!(
            "{what} reaches to ({x}, {y}), beyond {FARTHEST_M} m from the origin or no place at all: coordinates are in metres, from a \
             point in or near the building"
        ))),
        None => Ok(()),
    }
}

fn check_graph(graph: &WalkGraph, numbers: &BTreeSet<i32>) -> Result<(), Error> {
    for (index, node) in graph.nodes.iter().enumerate() {
        if !numbers.contains(&node.floor) {
            return Err(Error::Model(format!(
                "node {index} of the graph is on floor {}, which is not there",
                node.floor
            )));
        }
        if !is_place(&node.place) || !is_place(&[node.height_m, 0.0]) {
            return Err(Error::Model(format!("node {index} of the graph is at no place")));
        }
    }
    let count = graph.nodes.len();
    match graph.edges.iter().position(|edge| edge.iter().any(|&node| node >= count)) {
        Some(edge) => Err(Error::Model(format!("edge {edge} of the graph ends at a node that is not there"))),
        None => Ok(()),
    }
}

impl Floor {
    fn check(&self) -> Result<(), Error> {
        let number = self.number;
        if !is_place(&[self.height_m, 0.0]) {
            return Err(Error::Model(format!("floor {number} has the height {}", self.height_m)));
        }
        let lines = self.walls.iter().chain(self.doors.iter().map(|door| &door.line));
        check_places(lines.flatten(), &format!("a wall or a door of floor {number}"))?;
        self.rooms
            .iter()
            .try_for_each(|room| check_outline(&room.outline, &format!("room '{}' of floor {number}", room.name)))
    }

    /// All points of walls, doors and rooms.
    pub fn points(&self) -> impl Iterator<Item = Point> + '_ {
        let lines = self.walls.iter().chain(self.doors.iter().map(|door| &door.line));
        lines.flatten().copied().chain(self.rooms.iter().flat_map(|room| room.outline.iter().copied()))
    }

    /// The room that holds a point; the smallest where one lies in another.
    pub fn room_at(&self, point: Point) -> Option<&Room> {
        let holding = self.rooms.iter().filter(|room| geometry::contains(&room.outline, point));
        holding.min_by(|a, b| geometry::area(&a.outline).abs().total_cmp(&geometry::area(&b.outline).abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floor(number: i32, height_m: f64) -> Floor {
        let outline = vec![[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0]];
        let rooms = vec![Room { name: "1".into(), usage: None, outline }];
        Floor { number, name: format!("F{number}"), height_m, rooms, ..Floor::default() }
    }

    #[test]
    fn floors_are_put_in_order_and_rooms_are_found() {
        let building =
            Building { floors: vec![floor(1, 3.5), floor(0, 0.0)], ..Building::default() }.assembled().unwrap();
        assert_eq!(building.floors[0].number, 0);
        assert_eq!(building.room("1").unwrap().0.number, 0);
        assert_eq!(building.room("F1/1").unwrap().0.number, 1);
        assert_eq!(building.room("F2/1"), None);
        assert_eq!(building.floors[1].room_at([1.0, 1.0]).unwrap().name, "1");
        assert_eq!(building.bounds(), Some([[0.0, 0.0], [5.0, 4.0]]));
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let message = |building: Building| building.assembled().unwrap_err().to_string();
        assert_eq!(message(Building::default()), "the building has no floors");
        let two = |floors| Building { floors, ..Building::default() };
        assert_eq!(message(two(vec![floor(0, 0.0), floor(1, 0.0)])), "floors 0 and 1 have the same height");
        assert_eq!(message(two(vec![floor(0, 0.0), floor(0, 1.0)])), "two floors have the same number");
        let mut bad = two(vec![floor(0, 0.0)]);
        bad.floors[0].walls.push([[0.0, f64::NAN], [1.0, 1.0]]);
        assert!(message(bad).starts_with("a wall or a door of floor 0 reaches to (0, NaN), beyond"));
        // Millimetres.
        let mut bad = two(vec![floor(0, 0.0)]);
        bad.floors[0].rooms[0].outline[1][0] = 5_250.0;
        assert_eq!(
            message(bad),
            "room '1' of floor 0 reaches to (5250, 0), beyond 5000 m from the origin or no place at all: coordinates are in metres, \
             from a point in or near the building"
        );
        let mut bad = two(vec![floor(0, 0.0)]);
        bad.floors[0].rooms[0].outline.truncate(2);
        assert_eq!(message(bad), "room '1' of floor 0 has 2 corners; an area needs three");
        let mut bad = two(vec![floor(0, 0.0)]);
        bad.connectors.push(Connector {
            name: "s".into(),
            kind: ConnectorKind::Stairs,
            outlines: vec![(3, Vec::new())],
            way: Vec::new(),
        });
        assert_eq!(message(bad), "connector 's' is on floor 3, which is not there");
        let node = Node::default();
        let drawn = |nodes, edges| {
            let graph = Some(WalkGraph { nodes, edges });
            message(Building { graph, ..two(vec![floor(0, 0.0)]) })
        };
        let high = Node { height_m: f64::INFINITY, ..node };
        assert_eq!(
            drawn(vec![Node { floor: 2, ..node }], vec![]),
            "node 0 of the graph is on floor 2, which is not there"
        );
        assert_eq!(drawn(vec![node, high], vec![]), "node 1 of the graph is at no place");
        assert_eq!(drawn(vec![node], vec![[0, 0], [0, 1]]), "edge 1 of the graph ends at a node that is not there");
    }
}
