//! A staircase of two flights for each storey, with a half landing between them.
//!
//! From the door one steps on a landing, climbs the right flight away from it, turns on the half landing, and climbs the
//! left flight back to the landing of the next floor. A wall stands between the flights.

use super::draft::{Draft, Rectangle, add_edge, add_node};
use crate::building::{Connector, ConnectorKind, Node, WalkGraph};

/// **Units:** mm.
pub const WIDTH: i64 = 4_600;
/// **Units:** mm.
pub const LENGTH: i64 = 7_000;
/// Where flights begin and end, from the wall with the landing. **Units:** mm.
const FLIGHT: [i64; 2] = [1_700, 5_000];
/// Middle of the landing and of the half landing. **Units:** mm.
const LANDINGS: [i64; 2] = [850, 6_000];
/// Middles of the flights, up from the landing and up to the next. **Units:** mm.
const LANES: [i64; 2] = [3_450, 1_150];

/// A staircase in a building.
#[derive(Clone, Copy, Debug)]
pub struct Stairwell {
    /// Its lower left corner, or where that comes to lie when it is turned. **Units:** mm.
    pub corner: [i64; 2],
    /// Turned by half a turn: the landing is at the upper end.
    pub turned: bool,
}

impl Stairwell {
    fn at(&self, place: [i64; 2]) -> [i64; 2] {
        let sign = if self.turned { -1 } else { 1 };
        [self.corner[0] + sign * place[0], self.corner[1] + sign * place[1]]
    }

    fn rectangle(&self, low: [i64; 2], high: [i64; 2]) -> Rectangle {
        let (a, b) = (self.at(low), self.at(high));
        Rectangle::new([a[0].min(b[0]), a[1].min(b[1])], [a[0].max(b[0]), a[1].max(b[1])])
    }

    /// Its room and the wall between the flights.
    pub fn draw(&self, draft: &mut Draft, name: &str) {
        let area = self.rectangle([0, 0], [WIDTH, LENGTH]);
        draft.room_around(format!("Stairs {name}"), "stairs", area, self.at([LANES[0], LANDINGS[0]]));
        let spine = self.rectangle([WIDTH / 2, FLIGHT[0]], [WIDTH / 2, FLIGHT[1]]);
        draft.wall(spine.low, spine.high);
    }

    /// The stairs from floor 0 to floor `top`. **Units:** `storey_m` in m.
    pub fn connector(&self, name: &str, top: i32, storey_m: f64) -> Connector {
        let area = self.rectangle([0, FLIGHT[0] - 200], [WIDTH, LENGTH]);
        let mut way = Vec::new();
        for floor in 0..top {
            for (place, part) in Self::climb() {
                let [x, y] = super::draft::metres(self.at(place));
                way.push([x, y, storey_m * (f64::from(floor) + part)]);
            }
        }
        Connector {
            name: name.to_owned(),
            kind: ConnectorKind::Stairs,
            outlines: (0..=top).map(|floor| (floor, area.outline())).collect(),
            way,
        }
    }

    /// From landing to landing: places and which part of the storey is climbed.
    fn climb() -> [([i64; 2], f64); 8] {
        [
            ([LANES[0], LANDINGS[0]], 0.0),
            ([LANES[0], FLIGHT[0]], 0.0),
            ([LANES[0], FLIGHT[1]], 0.5),
            ([LANES[0], LANDINGS[1]], 0.5),
            ([LANES[1], LANDINGS[1]], 0.5),
            ([LANES[1], FLIGHT[1]], 0.5),
            ([LANES[1], FLIGHT[0]], 1.0),
            ([LANES[1], LANDINGS[0]], 1.0),
        ]
    }

    /// Adds the way up from each floor to the next; the floors' own ways are in the graph.
    pub fn add_ways(&self, graph: &mut WalkGraph, top: i32, storey_m: f64) {
        let anchor = super::draft::metres(self.at([LANES[0], LANDINGS[0]]));
        for floor in 0..top {
            let landing = |graph: &WalkGraph, floor: i32| {
                graph.nodes.iter().position(|node| node.floor == floor && node.place == anchor)
            };
            let (Some(from), Some(to)) = (landing(graph, floor), landing(graph, floor + 1)) else { continue };
            let mut last = from;
            for (place, part) in &Self::climb()[1..] {
                let node = Node {
                    floor: if *part < 1.0 { floor } else { floor + 1 },
                    place: super::draft::metres(self.at(*place)),
                    height_m: storey_m * (f64::from(floor) + part),
                };
                let next = add_node(graph, node);
                add_edge(graph, [last, next]);
                last = next;
            }
            add_edge(graph, [last, to]);
        }
    }
}

/// An elevator from floor 0 to floor `top`, its middle being a node of every floor.
pub fn elevator(name: &str, area: Rectangle, top: i32) -> Connector {
    Connector {
        name: name.to_owned(),
        kind: ConnectorKind::Elevator,
        outlines: (0..=top).map(|floor| (floor, area.outline())).collect(),
        way: Vec::new(),
    }
}

/// Joins the middles of an elevator's floors.
pub fn ride(graph: &mut WalkGraph, area: Rectangle, top: i32) {
    let middle = super::draft::metres([(area.low[0] + area.high[0]) / 2, (area.low[1] + area.high[1]) / 2]);
    let stops: Vec<usize> = (0..=top)
        .filter_map(|floor| graph.nodes.iter().position(|node| node.floor == floor && node.place == middle))
        .collect();
    for pair in stops.windows(2) {
        add_edge(graph, [pair[0], pair[1]]);
    }
}
