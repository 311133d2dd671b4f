//! A floor of upright rectangles, as it is drawn up before there are walls: sides that rooms share become one wall, doors
//! and openings are cut out of it, and the ways through all of it are known.

use crate::building::geometry::{Outline, Point};
use crate::building::{Door, Floor, Node, Room, Segment, WalkGraph};
use std::collections::BTreeMap;

/// Lower left and upper right corner. **Units:** mm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    pub low: [i64; 2],
    pub high: [i64; 2],
}

impl Rectangle {
    /// From the lower left to the upper right corner. **Units:** mm.
    pub const fn new(low: [i64; 2], high: [i64; 2]) -> Self {
        Self { low, high }
    }

    /// Turned by half a turn within a building of this size. **Units:** mm.
    pub fn turned(self, size: [i64; 2]) -> Self {
        Self {
            low: [size[0] - self.high[0], size[1] - self.high[1]],
            high: [size[0] - self.low[0], size[1] - self.low[1]],
        }
    }

    /// Its corners. **Units:** m.
    pub fn outline(self) -> Outline {
        let [x0, y0] = metres(self.low);
        let [x1, y1] = metres(self.high);
        vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    fn centre(self) -> [i64; 2] {
        [(self.low[0] + self.high[0]) / 2, (self.low[1] + self.high[1]) / 2]
    }

    /// Whether a place lies inside or on the border.
    fn touches(self, place: [i64; 2]) -> bool {
        (0..2).all(|axis| (self.low[axis]..=self.high[axis]).contains(&place[axis]))
    }
}

/// **Units:** mm to m.
pub fn metres(place: [i64; 2]) -> Point {
    place.map(|value| value as f64 / 1e3)
}

/// How one gets about in a room.
#[derive(Clone, Copy, Debug)]
enum Ways {
    /// From every door to one place.
    Star([i64; 2]),
    /// Along the middle, and from there to the doors.
    Along(usize),
}

/// A floor under way.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    rooms: Vec<(Room, Rectangle, Option<Ways>)>,
    doors: Vec<Door>,
    /// By axis along which it runs and place on the other: what is walled, and what is open. **Units:** mm.
    walls: BTreeMap<(usize, i64), Vec<[i64; 2]>>,
    openings: BTreeMap<(usize, i64), Vec<[i64; 2]>>,
    /// Middles of the openings.
    passages: Vec<[i64; 2]>,
}

impl Draft {
    /// A room with walls around it; one goes from its doors to its middle.
    pub fn room(&mut self, name: impl Into<String>, usage: &str, area: Rectangle) {
        self.enclosed(name, usage, area, Some(Ways::Star(area.centre())));
    }

    /// A room in whose middle nobody can stand; one goes to `anchor`. **Units:** mm.
    pub fn room_around(&mut self, name: impl Into<String>, usage: &str, area: Rectangle, anchor: [i64; 2]) {
        self.enclosed(name, usage, area, Some(Ways::Star(anchor)));
    }

    /// A corridor with walls around it, along its longer side.
    pub fn corridor(&mut self, name: impl Into<String>, area: Rectangle) {
        let size = [0, 1].map(|axis| area.high[axis] - area.low[axis]);
        self.enclosed(name, "corridor", area, Some(Ways::Along(usize::from(size[1] > size[0]))));
    }

    fn enclosed(&mut self, name: impl Into<String>, usage: &str, area: Rectangle, ways: Option<Ways>) {
        let room = Room { name: name.into(), usage: Some(usage.to_owned()), outline: area.outline() };
        self.rooms.push((room, area, ways));
        self.walled(area);
    }

    /// Walls around a rectangle.
    pub fn walled(&mut self, area: Rectangle) {
        let Rectangle { low: [x0, y0], high: [x1, y1] } = area;
        for (from, to) in [([x0, y0], [x1, y0]), ([x0, y1], [x1, y1]), ([x0, y0], [x0, y1]), ([x1, y0], [x1, y1])] {
            self.wall(from, to);
        }
    }

    /// A wall along an axis, the lower end first. **Units:** mm.
    pub fn wall(&mut self, from: [i64; 2], to: [i64; 2]) {
        add(&mut self.walls, from, to);
    }

    /// A door along an axis, the lower end first. **Units:** mm.
    pub fn door(&mut self, from: [i64; 2], to: [i64; 2]) {
        self.doors.push(Door { line: [metres(from), metres(to)], name: None });
        self.opening(from, to);
    }

    /// A wall that is not there: where one corridor leads into another. **Units:** mm.
    pub fn opening(&mut self, from: [i64; 2], to: [i64; 2]) {
        add(&mut self.openings, from, to);
        self.passages.push([(from[0] + to[0]) / 2, (from[1] + to[1]) / 2]);
    }

    /// The floor.
    pub fn floor(&self, number: i32, name: impl Into<String>, height_m: f64) -> Floor {
        let mut walls: Vec<Segment> = Vec::new();
        for (&(axis, across), intervals) in &self.walls {
            let open = self.openings.get(&(axis, across)).map_or(&[][..], Vec::as_slice);
            for [from, to] in without(union(intervals), union(open)) {
                let end = |along: i64| if axis == 0 { [along, across] } else { [across, along] };
                walls.push([metres(end(from)), metres(end(to))]);
            }
        }
        let rooms = self.rooms.iter().map(|(room, ..)| room.clone()).collect();
        Floor { number, name: name.into(), height_m, walls, doors: self.doors.clone(), rooms }
    }

    /// Adds the ways through the floor to a graph.
    pub fn add_ways(&self, graph: &mut WalkGraph, floor: i32, height_m: f64) {
        let mut nodes: BTreeMap<[i64; 2], usize> = BTreeMap::new();
        let mut node = |graph: &mut WalkGraph, place: [i64; 2]| {
            *nodes.entry(place).or_insert_with(|| add_node(graph, Node { floor, place: metres(place), height_m }))
        };
        for (_, area, ways) in &self.rooms {
            let passages: Vec<_> = self.passages.iter().copied().filter(|place| area.touches(*place)).collect();
            match ways {
                None => {}
                Some(Ways::Star(middle)) => {
                    for &passage in &passages {
                        let ends = [node(graph, *middle), node(graph, passage)];
                        add_edge(graph, ends);
                    }
                }
                Some(Ways::Along(axis)) => {
                    let onto = |mut place: [i64; 2]| {
                        place[1 - axis] = area.centre()[1 - axis];
                        place
                    };
                    let mut along: Vec<_> = passages.iter().map(|&place| onto(place)).collect();
                    for &passage in &passages {
                        let ends = [node(graph, onto(passage)), node(graph, passage)];
                        add_edge(graph, ends);
                    }
                    along.sort_unstable();
                    for pair in along.windows(2) {
                        let ends = [node(graph, pair[0]), node(graph, pair[1])];
                        add_edge(graph, ends);
                    }
                }
            }
        }
    }
}

/// A new node of a graph.
pub fn add_node(graph: &mut WalkGraph, node: Node) -> usize {
    graph.nodes.push(node);
    graph.nodes.len() - 1
}

/// An edge, unless it leads from a node to itself.
pub fn add_edge(graph: &mut WalkGraph, edge: [usize; 2]) {
    if edge[0] != edge[1] {
        graph.edges.push(edge);
    }
}

fn add(lines: &mut BTreeMap<(usize, i64), Vec<[i64; 2]>>, from: [i64; 2], to: [i64; 2]) {
    let axis = usize::from(from[0] == to[0]);
    lines.entry((axis, from[1 - axis])).or_default().push([from[axis], to[axis]]);
}

/// Intervals that touch become one.
fn union(intervals: &[[i64; 2]]) -> Vec<[i64; 2]> {
    let mut sorted = intervals.to_vec();
    sorted.sort_unstable();
    let mut joined: Vec<[i64; 2]> = Vec::new();
    for interval in sorted {
        match joined.last_mut() {
            Some(last) if interval[0] <= last[1] => last[1] = last[1].max(interval[1]),
            _ => joined.push(interval),
        }
    }
    joined
}

/// What of the first remains without the second.
fn without(intervals: Vec<[i64; 2]>, holes: Vec<[i64; 2]>) -> Vec<[i64; 2]> {
    holes.into_iter().fold(intervals, |left, [from, to]| {
        let cut = |[low, high]: [i64; 2]| [[low, high.min(from)], [low.max(to), high]];
        left.into_iter()
            .flat_map(|interval| {
                let apart = interval[1] <= from || interval[0] >= to;
                if apart { vec![interval] } else { cut(interval).to_vec() }
            })
            .filter(|[low, high]| low < high)
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_side_by_side_share_a_wall_with_one_door_in_it() {
        let mut draft = Draft::default();
        draft.room("a", "office", Rectangle::new([0, 0], [4_000, 3_000]));
        draft.room("b", "office", Rectangle::new([4_000, 0], [8_000, 3_000]));
        draft.door([4_000, 1_000], [4_000, 1_900]);
        let floor = draft.floor(0, "", 0.0);
        assert_eq!(floor.walls.len(), 2 + 1 + 1 + 2, "below, above, left, right, and two pieces between");
        assert!(floor.walls.contains(&[[4.0, 1.9], [4.0, 3.0]]));
        let mut graph = WalkGraph::default();
        draft.add_ways(&mut graph, 0, 0.0);
        assert_eq!((graph.nodes.len(), graph.edges.len()), (3, 2));
    }
}
