//! Draws the walk graph of a building from its walls, doors, stairs and elevators, as the graph document draws it by hand.
//!
//! The free places of each floor are thinned to lines along their middle, which lead through every door into every room.
//! The lines become nodes and edges of about the length that the document found best, straight wherever people go straight on:
//! to a tracker that begins its heading anew on each edge a bend is a turn. Crossings are modelled for those who cut the
//! corner, halls are crossed or get a net of nodes. Stairs and elevators join the floors.
//!
//! # Source
//! Graph, 6.2.2 and 7.1, for what a good graph is.

mod arms;
mod climb;
mod corridor;
mod free;
mod open;
mod sketch;
#[cfg(test)]
mod tests;
mod thin;
mod trace;

use crate::building::geometry::{self, Point};
use crate::building::{Building, Floor, Node, WalkGraph};
use climb::Flight;
use free::Free;
use sketch::{Hold, Sketch};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// How graphs are drawn.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How long edges are wanted (Graph, table 7.1: 2.3 and 2.4 m on average). **Units:** m.
    pub edge_m: f64,
    /// Two nodes nearer than this become one. **Units:** m.
    pub shortest_m: f64,
    /// Two edges that leave a node lie so far apart at least (Graph, 7.1: no turns below 20 degrees). **Units:** degrees.
    pub fork_deg: f64,
    /// Nobody walks nearer to a wall. **Units:** m.
    pub clear_m: f64,
    /// An area where a disc of this radius has room is open: it is crossed straight from each way that leads into it to each
    /// other. **Units:** m.
    pub open_m: f64,
    /// One where a disc of this radius has room gets a net of nodes. **Units:** m.
    pub net_m: f64,
    /// No free place is farther from the graph, but in halls that are crossed. **Units:** m.
    pub reach_m: f64,
    /// A corner is cut between places so far from it, from the nearest to the farthest. **Units:** m.
    pub cut_m: [f64; 2],
    /// Side of the cells in which a floor is looked at. **Units:** m.
    pub cell_m: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            edge_m: 2.3,
            shortest_m: 0.9,
            fork_deg: 20.0,
            clear_m: 0.2,
            open_m: 3.5,
            net_m: 6.5,
            reach_m: 4.0,
            cut_m: [0.8, 1.7],
            cell_m: 0.1,
        }
    }
}

impl Parameters {
    /// Whether graphs can be drawn so.
    ///
    /// # Errors
    /// Names the setting that is out of its bounds.
    pub fn check(&self) -> Result<(), String> {
        let bounds = [
            ("edge_m", self.edge_m, 0.5, 50.0),
            ("shortest_m", self.shortest_m, 0.0, self.edge_m),
            ("fork_deg", self.fork_deg, 0.0, 45.0),
            ("clear_m", self.clear_m, 0.05, 1.0),
            ("open_m", self.open_m, 0.5, 100.0),
            ("net_m", self.net_m, self.open_m, 100.0),
            ("reach_m", self.reach_m, 1.0, 1_000.0),
            ("cut_m[0]", self.cut_m[0], 0.3, 20.0),
            ("cut_m[1]", self.cut_m[1], self.cut_m[0], 20.0),
            ("cell_m", self.cell_m, 0.05, 0.5),
        ];
        for (name, value, low, high) in bounds {
            if !(low..=high).contains(&value) {
                return Err(format!("{name} = {value}: expected {low} to {high}"));
            }
        }
        Ok(())
    }
}

/// An edge is cut from so many times the wanted length on.
const LONGEST: f64 = 1.4;
/// What lies so near to a straight line is straight. **Units:** m.
const STRAIGHT_M: f64 = 0.15;
/// Lines that miss each other by less are laid on one. **Units:** m.
const ALIGNED_M: f64 = 0.25;
/// A corridor is laid straight past openings if its nodes are no farther from its line. **Units:** m.
const CORRIDOR_M: f64 = 0.7;
/// A way without any other is pulled straight if it is no farther from that. **Units:** m.
const PULLED_M: f64 = 0.8;
/// A landing, an entrance or the middle of a room may be so far from the next free place. **Units:** m.
const STAND_M: f64 = 1.2;
/// A room is a corridor, which needs no node in its middle, from so many times longer than wide on.
const CORRIDOR: f64 = 4.0;

/// The walk graph of a building. Places that nothing leads to get no nodes.
pub fn draw(building: &Building, parameters: &Parameters) -> WalkGraph {
    let flights = climb::flights(building);
    let mut graph = WalkGraph::default();
    // For each flight the nodes of both landings.
    let mut landed = vec![[None; 2]; flights.len()];
    for floor in &building.floors {
        let (sketch, nodes) = draw_floor(building, floor, &flights, parameters);
        let mut number = vec![None; sketch.dots.len()];
        for (index, dot) in sketch.dots.iter().enumerate() {
            let landing = nodes.values().any(|&node| node == index);
            if !dot.gone && (landing || !dot.beside.is_empty()) {
                number[index] = Some(graph.nodes.len());
                graph.nodes.push(Node { floor: floor.number, place: dot.place, height_m: floor.height_m });
            }
        }
        graph.edges.extend(sketch.edges().filter_map(|[a, b]| Some([number[a]?, number[b]?])));
        for ((flight, end), node) in nodes {
            landed[flight][end] = number[node];
        }
    }
    for (flight, ends) in flights.iter().zip(landed) {
        if let [Some(lower), Some(upper)] = ends {
            climb_with(&mut graph, flight, [lower, upper], parameters.edge_m);
        }
    }
    without_lonely(graph)
}

/// Nodes that lie alone, the landings of flights that are not joined for instance, are no places to walk to.
fn without_lonely(graph: WalkGraph) -> WalkGraph {
    let mut number = vec![usize::MAX; graph.nodes.len()];
    let mut nodes = Vec::new();
    let mut joined = vec![false; graph.nodes.len()];
    graph.edges.iter().flatten().for_each(|&end| joined[end] = true);
    for (index, node) in graph.nodes.into_iter().enumerate().filter(|(index, _)| joined[*index]) {
        number[index] = nodes.len();
        nodes.push(node);
    }
    WalkGraph { nodes, edges: graph.edges.iter().map(|edge| edge.map(|end| number[end])).collect() }
}

/// Joins two nodes by a flight, in edges of about the wanted length.
fn climb_with(graph: &mut WalkGraph, flight: &Flight, [lower, upper]: [usize; 2], edge_m: f64) {
    let top = graph.nodes[upper];
    let mut points = flight.between.clone();
    points.push([top.place[0], top.place[1], top.height_m]);
    let mut last = lower;
    let count = points.len();
    for (index, [x, y, z]) in points.into_iter().enumerate() {
        let from = graph.nodes[last];
        let length = geometry::distance(from.place, [x, y]);
        let pieces = if length > LONGEST * edge_m { (length / edge_m).round().max(2.0) as usize } else { 1 };
        for piece in 1..=pieces {
            let here = if index + 1 == count && piece == pieces {
                upper
            } else {
                let part = piece as f64 / pieces as f64;
                let height_m = from.height_m + part * (z - from.height_m);
                graph.nodes.push(Node {
                    floor: flight.floors[0],
                    place: geometry::between(from.place, [x, y], part),
                    height_m,
                });
                graph.nodes.len() - 1
            };
            graph.edges.push([last, here]);
            last = here;
        }
    }
}

/// The graph of a floor, and the node of each landing: by the flight and its end.
fn draw_floor(
    building: &Building,
    floor: &Floor,
    flights: &[Flight],
    parameters: &Parameters,
) -> (Sketch, BTreeMap<(usize, usize), usize>) {
    let mut free = Free::of(building, floor, parameters.clear_m, parameters.cell_m);
    let open = open::open_cells(&free, parameters.open_m);
    let net = open::open_cells(&free, parameters.net_m);
    let mut held: BTreeMap<usize, Hold> = free.gates.iter().map(|&cell| (cell, Hold::Place)).collect();
    let mut landings = BTreeMap::new();
    for (index, flight) in flights.iter().enumerate() {
        for end in (0..2).filter(|&end| flight.floors[end] == floor.number) {
            if let Some(cell) = free.nearest(flight.landings[end], STAND_M) {
                held.insert(cell, Hold::Fixed);
                landings.insert((index, end), cell);
                if let Some(direction) = flight.direction(end) {
                    free.go_straight_on(flight.landings[end], direction);
                }
            }
        }
    }
    let entrances = building.entrances.iter().filter(|entrance| entrance.floor == floor.number);
    let stands = entrances.filter_map(|entrance| free.nearest(entrance.place, STAND_M));
    let rooms = floor.rooms.iter().filter_map(|room| middle_of(&free, &net, &room.outline));
    for cell in stands.chain(rooms).collect::<Vec<_>>() {
        held.insert(cell, Hold::Fixed);
    }
    let mut keep: Vec<bool> = (0..free.count()).map(|cell| open[cell] || held.contains_key(&cell)).collect();
    for &cell in &free.straight_on {
        keep[cell] = true;
    }
    let mut left = thin::thin(&free, &keep);
    reach_everything(&free, &mut left, parameters.reach_m);
    let mut traced = trace::trace(&free, &left, &held, &open);
    // What is held in an open area is joined to its net.
    for &cell in held.keys().filter(|&&cell| open[cell]) {
        let node = traced.sketch.add(free.place(cell), Hold::Fixed);
        traced.sketch.dots[node].port = true;
        traced.node_of.insert(cell, node);
    }
    let mut sketch = traced.sketch;
    let fork = parameters.fork_deg.to_radians();
    sketch.prune(free::STRAIGHT_ON_M);
    sketch.straighten(&free, STRAIGHT_M, Hold::Loose);
    sketch.contract(&free, parameters.shortest_m);
    sketch.align(&free, ALIGNED_M);
    corridor::straighten(&free, &mut sketch, CORRIDOR_M);
    sketch.straighten(&free, STRAIGHT_M, Hold::Loose);
    sketch.contract(&free, parameters.shortest_m);
    arms::straight_through_doors(&free, &mut sketch);
    sketch.pull(&free, PULLED_M);
    sketch.straighten(&free, STRAIGHT_M, Hold::Place);
    sketch.contract(&free, parameters.shortest_m);
    sketch.split(parameters.edge_m, LONGEST * parameters.edge_m);
    let nets = open::cross(&free, &mut sketch, [&open, &net], parameters.edge_m, fork);
    sketch.diagonals(&free, fork, parameters.cut_m, &nets);
    let nodes = landings.into_iter().filter_map(|(landing, cell)| Some((landing, *traced.node_of.get(&cell)?)));
    let nodes = nodes.collect();
    (sketch, nodes)
}

/// Where one stands in the middle of a room; nothing in a corridor and in a hall, which get nodes anyway.
fn middle_of(free: &Free, net: &[bool], outline: &[Point]) -> Option<usize> {
    let cells: Vec<usize> = free.cells_in(outline).into_iter().filter(|&cell| free.free[cell]).collect();
    if cells.iter().any(|&cell| net[cell]) {
        return None;
    }
    let widest = cells.iter().map(|&cell| free.clearance[cell]).fold(0.0, f32::max);
    let [low, high] = geometry::bounds(outline.iter().map(|&point| free.to_cells(point)))?;
    let long = (high[0] - low[0]).max(high[1] - low[1]);
    if long > CORRIDOR * 2.0 * f64::from(widest) {
        return None;
    }
    let centre = geometry::centre(outline);
    let roomy = cells.into_iter().filter(|&cell| free.clearance[cell] >= 0.6 * widest);
    let far = |cell: &usize| geometry::distance(free.place(*cell), centre);
    roomy.min_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)))
}

/// Near walls a line along the way to a far corner counts so many times longer.
const WALL: f64 = 3.0;
/// Nearer than this to a wall. **Units:** m.
const WALL_M: f64 = 0.6;

/// Adds lines to the places that are farther from what is left than `reach_m`, the farthest first.
fn reach_everything(free: &Free, left: &mut [bool], reach_m: f64) {
    let mut far = vec![f64::INFINITY; free.count()];
    let mut came = vec![usize::MAX; free.count()];
    let lines: Vec<usize> = (0..free.count()).filter(|&cell| left[cell]).collect();
    // A place that stands alone, in a shaft for instance, is no line.
    let lines: Vec<usize> =
        lines.into_iter().filter(|&cell| free.around(cell).into_iter().flatten().any(|next| left[next])).collect();
    spread(free, &mut far, &mut came, lines);
    loop {
        // Nobody wants to go into a corner.
        let roomy = |cell: &usize| free.free[*cell] && f64::from(free.clearance[*cell]) >= WALL_M;
        let reached = (0..free.count()).filter(roomy).filter(|&cell| far[cell].is_finite());
        let Some(end) = reached.max_by(|&a, &b| far[a].total_cmp(&far[b]).then(b.cmp(&a))) else { return };
        if far[end] <= reach_m {
            return;
        }
        let mut line = Vec::new();
        let mut cell = end;
        while !left[cell] {
            left[cell] = true;
            line.push(cell);
            cell = came[cell];
        }
        spread(free, &mut far, &mut came, line);
    }
}

/// Dijkstra's algorithm on cells, going on from what was found before.
fn spread(free: &Free, far: &mut [f64], came: &mut [usize], from: Vec<usize>) {
    // In whole tenths of a millimetre: they have an order.
    let key = |far: f64| (far * 1e4) as u64;
    let mut open: BinaryHeap<Reverse<(u64, usize)>> = BinaryHeap::new();
    for cell in from {
        far[cell] = 0.0;
        open.push(Reverse((0, cell)));
    }
    while let Some(Reverse((at, cell))) = open.pop() {
        if at > key(far[cell]) {
            continue;
        }
        for (side, next) in free.around(cell).into_iter().enumerate() {
            let Some(next) = next.filter(|&next| free.free[next]) else { continue };
            let length = free.side() * if side % 2 == 1 { std::f64::consts::SQRT_2 } else { 1.0 };
            let dislike = if f64::from(free.clearance[next]) < WALL_M { WALL } else { 1.0 };
            let new = far[cell] + length * dislike;
            if new + 1e-9 < far[next] {
                far[next] = new;
                came[next] = cell;
                open.push(Reverse((key(new), next)));
            }
        }
    }
}
