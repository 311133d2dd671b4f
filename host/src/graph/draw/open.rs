//! Open areas: halls where one may walk anywhere get a net of nodes instead of a line along their middle.

use super::free::Free;
use super::sketch::{Hold, Sketch};
use crate::building::geometry::{self, Point};
use std::collections::BTreeMap;

/// The cells within `radius` of a place that is so far from every wall: where a disc of this size has room. **Units:** m.
pub fn open_cells(free: &Free, radius: f64) -> Vec<bool> {
    let core: Vec<bool> =
        (0..free.count()).map(|cell| free.free[cell] && f64::from(free.clearance[cell]) >= radius).collect();
    let near = free.distances(&core);
    // A cell less, so that a disc never reaches through a door.
    let reach = radius - free.side();
    (0..free.count()).map(|cell| free.free[cell] && f64::from(near[cell]) <= reach).collect()
}

/// Puts a net of nodes about `edge_m` apart on the open cells, joined with their eight neighbours, and joins the ports to
/// it. Two edges that leave a node are `fork` apart. **Units:** m, rad.
pub fn net(free: &Free, sketch: &mut Sketch, open: &[bool], edge_m: f64, fork: f64) {
    let ports: Vec<usize> =
        (0..sketch.dots.len()).filter(|&dot| sketch.dots[dot].port && !sketch.dots[dot].gone).collect();
    let mut seen = vec![false; open.len()];
    let mut nodes = Vec::new();
    for start in 0..open.len() {
        if !open[start] || std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut cells = vec![start];
        let mut next = 0;
        while next < cells.len() {
            for cell in free.around(cells[next]).into_iter().flatten() {
                if open[cell] && !std::mem::replace(&mut seen[cell], true) {
                    cells.push(cell);
                }
            }
            next += 1;
        }
        nodes.extend(lattice(free, sketch, open, &cells, edge_m));
    }
    for port in ports {
        join_port(free, sketch, port, &nodes, edge_m, fork);
    }
}

/// The nodes of one open area.
fn lattice(free: &Free, sketch: &mut Sketch, open: &[bool], cells: &[usize], edge_m: f64) -> Vec<usize> {
    let Some([low, high]) = geometry::bounds(cells.iter().map(|&cell| free.middle(cell))) else { return Vec::new() };
    let counts = [0, 1].map(|axis| ((high[axis] - low[axis]) / edge_m).round().max(1.0));
    let pitch = [0, 1].map(|axis| (high[axis] - low[axis]) / counts[axis]);
    let mut nodes: BTreeMap<[i64; 2], usize> = BTreeMap::new();
    for row in 0..counts[1] as i64 {
        for column in 0..counts[0] as i64 {
            let at = [low[0] + (column as f64 + 0.5) * pitch[0], low[1] + (row as f64 + 0.5) * pitch[1]];
            let place = free.to_building(at);
            if free.cell(place).is_some_and(|cell| open[cell]) {
                nodes.insert([column, row], sketch.add(place, Hold::Loose));
            }
        }
    }
    if nodes.is_empty() {
        // A disc and nothing more: its middle.
        let widest =
            cells.iter().copied().max_by(|&a, &b| free.clearance[a].total_cmp(&free.clearance[b]).then(b.cmp(&a)));
        return widest.map(|cell| sketch.add(free.place(cell), Hold::Loose)).into_iter().collect();
    }
    for (&[column, row], &node) in &nodes {
        for beside in [[1, 0], [0, 1], [1, 1], [-1, 1]] {
            let Some(&other) = nodes.get(&[column + beside[0], row + beside[1]]) else { continue };
            if free.sees(sketch.dots[node].place, sketch.dots[other].place) {
                sketch.join(node, other);
            }
        }
    }
    nodes.into_values().collect()
}

/// Joins a port with the nearest nodes of the net that it sees, three at most.
fn join_port(free: &Free, sketch: &mut Sketch, port: usize, nodes: &[usize], edge_m: f64, fork: f64) {
    let here = sketch.dots[port].place;
    let far = |node: &usize| geometry::distance(sketch.dots[*node].place, here);
    let mut near: Vec<usize> = nodes.to_vec();
    near.sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    let reach: Vec<(usize, Point, f64)> =
        near.iter().map(|&node| (node, sketch.dots[node].place, far(&node))).collect();
    let mut joined = 0;
    for (node, place, distance) in reach {
        if joined == 3 || joined > 0 && distance > 1.5 * edge_m {
            break;
        }
        let forks = sketch.forks(port, place, fork) || sketch.forks(node, here, fork);
        if (joined == 0 || !forks) && free.sees(here, place) {
            sketch.join(port, node);
            joined += 1;
        }
    }
}
