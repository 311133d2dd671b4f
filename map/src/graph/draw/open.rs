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
        let lines = ahead(free, sketch, &ports);
        nodes.extend(lattice(free, sketch, open, &cells, &lines, edge_m));
    }
    for port in ports {
        join_port(free, sketch, port, &nodes, edge_m, fork);
    }
}

/// Ports: where they are, and whether their way leads into the net along its rows. **Frame:** cells.
fn ahead(free: &Free, sketch: &Sketch, ports: &[usize]) -> Vec<(Point, bool)> {
    let along = |&port: &usize| {
        let here = free.to_cells(sketch.dots[port].place);
        let before = free.to_cells(sketch.dots[*sketch.dots[port].beside.first()?].place);
        Some((here, (here[0] - before[0]).abs() >= (here[1] - before[1]).abs()))
    };
    ports.iter().filter_map(along).collect()
}

/// Where the lines of a net lie between two borders: on what is `wanted`, and about `edge_m` apart between. **Units:** m.
fn lines([low, high]: [f64; 2], mut wanted: Vec<f64>, edge_m: f64) -> Vec<f64> {
    wanted.retain(|at| (low..=high).contains(at));
    wanted.sort_by(f64::total_cmp);
    let groups = wanted.chunk_by(|a, b| b - a < ONE_LINE_M);
    let fixed: Vec<f64> = groups.map(|group| group.iter().sum::<f64>() / group.len() as f64).collect();
    let (Some(&first), Some(&last)) = (fixed.first(), fixed.last()) else {
        let count = ((high - low) / edge_m).round().max(1.0);
        return (0..count as usize).map(|line| low + (line as f64 + 0.5) / count * (high - low)).collect();
    };
    let mut lines = Vec::new();
    // Half a mesh is left at the borders.
    let beside = |gap: f64| {
        let count = (gap / edge_m - 0.5).round().max(0.0);
        (1..=count as usize).map(move |line| line as f64 * gap / (count + 0.5))
    };
    lines.extend(beside(first - low).map(|off| first - off));
    lines.reverse();
    for pair in fixed.windows(2) {
        let count = ((pair[1] - pair[0]) / edge_m).round().max(1.0);
        lines.extend((0..count as usize).map(|line| pair[0] + line as f64 / count * (pair[1] - pair[0])));
    }
    lines.push(last);
    lines.extend(beside(high - last).map(|off| last + off));
    lines
}

/// Lines nearer than this become one. **Units:** m.
const ONE_LINE_M: f64 = 1.0;

/// The nodes of one open area. Its rows and columns go straight on from the ways that lead into it: who comes out of a
/// corridor goes on as before.
fn lattice(
    free: &Free,
    sketch: &mut Sketch,
    open: &[bool],
    cells: &[usize],
    ahead: &[(Point, bool)],
    edge_m: f64,
) -> Vec<usize> {
    let Some([low, high]) = geometry::bounds(cells.iter().map(|&cell| free.middle(cell))) else { return Vec::new() };
    let here = |place: &Point| (0..2).all(|axis| (low[axis] - edge_m..=high[axis] + edge_m).contains(&place[axis]));
    let [columns, rows] = [0, 1].map(|axis| {
        let into = ahead.iter().filter(|(place, along_rows)| here(place) && *along_rows == (axis == 1));
        lines([low[axis], high[axis]], into.map(|(place, _)| place[axis]).collect(), edge_m)
    });
    let mut nodes: BTreeMap<[i64; 2], usize> = BTreeMap::new();
    for (row, &y) in rows.iter().enumerate() {
        for (column, &x) in columns.iter().enumerate() {
            let place = free.to_building([x, y]);
            if free.cell(place).is_some_and(|cell| open[cell]) {
                nodes.insert([column as i64, row as i64], sketch.add(place, Hold::Loose));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_lie_where_they_are_wanted_and_evenly_between() {
        assert_eq!(lines([0.0, 9.0], vec![], 2.3), [1.125, 3.375, 5.625, 7.875]);
        // Two ways that come in beside each other are one.
        let found = lines([0.0, 10.0], vec![5.1, 4.9, 20.0], 2.0);
        let even = [1.0, 3.0, 5.0, 7.0, 9.0_f64];
        assert!(
            found.len() == 5 && found.iter().zip(even).all(|(found, even)| (found - even).abs() < 1e-9),
            "{found:?}"
        );
        let found = lines([0.0, 10.0], vec![2.0, 8.0], 2.3);
        assert!(found.windows(2).all(|pair| (1.3..=3.1).contains(&(pair[1] - pair[0]))), "{found:?}");
        assert!(found.contains(&2.0) && found.contains(&8.0));
    }
}
