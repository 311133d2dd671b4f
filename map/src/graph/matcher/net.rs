//! The graph as the matcher looks at it: each way once, with what is asked of it at every step.

use crate::building::geometry::Point;
use crate::graph::{EdgeId, EdgeKind, Graph, NodeId};
use std::collections::BTreeMap;

/// A way of the graph, in the direction of the first of its two edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// The first of its two edges.
    pub edge: EdgeId,
    /// Where it begins. **Units:** m; **Frame:** building.
    pub begin: Point,
    /// Its direction, of length 1.
    pub along: Point,
    /// **Units:** m; rad.
    pub length_m: f64,
    pub direction: f64,
    /// Where it begins, and height gained. **Units:** m.
    pub height_m: f64,
    pub rise_m: f64,
    pub kind: EdgeKind,
    /// The nodes at its ends, and numbers of their floors.
    pub ends: [NodeId; 2],
    pub floors: [i32; 2],
    /// Whether nothing else leaves from there.
    pub blind: [bool; 2],
    /// It is part of a net over an open area.
    pub open: bool,
}

/// A way that somebody may be on next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    pub way: u32,
    /// What the choice costs (logarithm of odds).
    pub cost: f64,
}

/// Nodes of a net over an open area have so many ways at least.
const OPEN_WAYS: usize = 5;
/// More ways are not looked at from one.
const MOST_REACHED: usize = 48;
/// Side of the cells in which ways are looked up. **Units:** m.
const CELL_M: f64 = 4.0;

/// All ways of a graph.
#[derive(Clone, Debug)]
pub(super) struct Net {
    pub ways: Vec<Way>,
    /// For each edge its way.
    way_of: Vec<u32>,
    /// The edges that leave each node follow each other from here on.
    first: Vec<u32>,
    to: Vec<NodeId>,
    /// What one of the ways at a node costs.
    fork: Vec<f64>,
    /// The ways whose middle is in a cell.
    cells: BTreeMap<[i32; 2], Vec<u32>>,
    longest_m: f64,
}

impl Net {
    pub fn of(graph: &Graph, [fork, open_fork]: [f64; 2]) -> Self {
        let mut ways = Vec::with_capacity(graph.edges().len() / 2);
        let mut way_of = vec![u32::MAX; graph.edges().len()];
        let degree = |node: NodeId| graph.leaving(node).filter(|&id| graph.edge(id).kind != EdgeKind::Elevator).count();
        let degrees: Vec<usize> = graph.node_ids().map(degree).collect();
        for id in graph.edge_ids() {
            let edge = graph.edge(id);
            if edge.back < id {
                way_of[id.index()] = way_of[edge.back.index()];
                continue;
            }
            way_of[id.index()] = ways.len() as u32;
            let (sin, cos) = edge.direction.sin_cos();
            let ends = [edge.from, edge.to];
            ways.push(Way {
                edge: id,
                begin: graph.node(edge.from).place,
                along: [cos, sin],
                length_m: edge.length_m,
                direction: edge.direction,
                height_m: graph.node(edge.from).height_m,
                rise_m: edge.rise_m,
                kind: edge.kind,
                ends,
                floors: ends.map(|end| graph.node(end).floor),
                blind: ends.map(|end| graph.leaving(end).count() == 1),
                open: edge.kind == EdgeKind::Level && ends.iter().all(|end| degrees[end.index()] >= OPEN_WAYS),
            });
        }
        let cost = |degree: usize| {
            let part = if degree >= OPEN_WAYS { open_fork } else { fork };
            part * (degree.max(2) as f64 - 1.0).ln()
        };
        let mut first: Vec<u32> = Vec::with_capacity(graph.nodes().len() + 1);
        let mut sum = 0;
        for node in graph.node_ids() {
            first.push(sum);
            sum += graph.leaving(node).count() as u32;
        }
        first.push(sum);
        let mut cells: BTreeMap<[i32; 2], Vec<u32>> = BTreeMap::new();
        let mut longest_m = 0.0_f64;
        for (number, way) in ways.iter().enumerate() {
            cells.entry(cell(way.at(0.5 * way.length_m))).or_default().push(number as u32);
            longest_m = longest_m.max(way.length_m);
        }
        Self {
            way_of,
            first,
            to: graph.edges().iter().map(|edge| edge.to).collect(),
            fork: degrees.iter().map(|&degree| cost(degree)).collect(),
            ways,
            cells,
            longest_m,
        }
    }

    pub fn way(&self, number: u32) -> &Way {
        &self.ways[number as usize]
    }

    /// The ways on which somebody may be who was so far along one and has moved `reach_m` at most; that one first.
    /// `elevator` is what it costs to enter one, if that is possible.
    pub fn reached(
        &self,
        from: u32,
        along_m: f64,
        reach_m: f64,
        elevator: Option<f64>,
        open: &mut Vec<(NodeId, f64, f64)>,
        found: &mut Vec<Reached>,
    ) {
        found.clear();
        open.clear();
        found.push(Reached { way: from, cost: 0.0 });
        let way = self.way(from);
        let along_m = along_m.clamp(0.0, way.length_m);
        open.extend([(way.ends[0], along_m, 0.0), (way.ends[1], way.length_m - along_m, 0.0)]);
        let mut next = 0;
        while let Some(&(node, far_m, cost)) = open.get(next) {
            next += 1;
            if far_m > reach_m {
                continue;
            }
            for edge in self.first[node.index()]..self.first[node.index() + 1] {
                let way = self.way_of[edge as usize];
                let mut cost = cost + self.fork[node.index()];
                let to = self.way(way);
                if to.kind == EdgeKind::Elevator {
                    let Some(entering) = elevator else { continue };
                    cost += entering;
                }
                if found.len() < MOST_REACHED && !found.iter().any(|found| found.way == way) {
                    found.push(Reached { way, cost });
                    open.push((self.to[edge as usize], far_m + to.length_m, cost));
                }
            }
        }
    }

    /// The ways with a part within `radius_m` of a place, on any floor.
    pub fn near(&self, place: Point, radius_m: f64) -> Vec<u32> {
        let reach = radius_m + 0.5 * self.longest_m;
        let [low, high] = [-reach, reach].map(|off| cell([place[0] + off, place[1] + off]));
        let mut found = Vec::new();
        for column in low[0]..=high[0] {
            for (_, ways) in self.cells.range([column, low[1]]..=[column, high[1]]) {
                found.extend(ways.iter().copied().filter(|&way| self.way(way).distance(place) <= radius_m));
            }
        }
        found
    }
}

impl Way {
    /// So far along. **Units:** m.
    pub fn at(&self, along_m: f64) -> Point {
        [self.begin[0] + along_m * self.along[0], self.begin[1] + along_m * self.along[1]]
    }

    /// Whether it is on a floor from one end to the other.
    pub fn is_on(&self, floor: i32) -> bool {
        self.floors == [floor; 2]
    }

    /// How far along a place lies, and how far to the left. **Units:** m.
    pub fn project(&self, place: Point) -> [f64; 2] {
        let [x, y] = [place[0] - self.begin[0], place[1] - self.begin[1]];
        [x * self.along[0] + y * self.along[1], y * self.along[0] - x * self.along[1]]
    }

    /// **Units:** m.
    pub fn distance(&self, place: Point) -> f64 {
        let [along, aside] = self.project(place);
        (along - along.clamp(0.0, self.length_m)).hypot(aside)
    }

    /// Heights that it has so far along: one, but all of them in an elevator. **Units:** m.
    pub fn heights(&self, along_m: f64) -> [f64; 2] {
        let end = self.height_m + self.rise_m;
        if self.kind == EdgeKind::Elevator {
            return [self.height_m.min(end), self.height_m.max(end)];
        }
        let part = if self.length_m > 0.0 { (along_m / self.length_m).clamp(0.0, 1.0) } else { 0.5 };
        [self.height_m + part * self.rise_m; 2]
    }
}

fn cell(place: Point) -> [i32; 2] {
    place.map(|value| (value / CELL_M).floor() as i32)
}
