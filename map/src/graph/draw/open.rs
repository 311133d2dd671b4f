//! Open areas: halls where one may walk anywhere are crossed straight from way to way instead of along their middle, and get a
//! net of nodes where they are too large for that.

use super::LONGEST;
use super::free::Free;
use super::sketch::{Hold, Sketch};
use crate::building::geometry::{self, Point};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// The cells within `radius` of a place that is so far from every wall: where a disc of this size has room. **Units:** m.
pub fn open_cells(free: &Free, radius: f64) -> Vec<bool> {
    let core: Vec<bool> =
        (0..free.count()).map(|cell| free.free[cell] && f64::from(free.clearance[cell]) >= radius).collect();
    let near = free.distances(&core);
    // A cell less, so that a disc never reaches through a door.
    let reach = radius - free.side();
    (0..free.count()).map(|cell| free.free[cell] && f64::from(near[cell]) <= reach).collect()
}

/// Crosses the open cells: by straight lines between the ports of an area, or by a net of nodes where one of its cells is for a
/// `net` or some ports do not see each other. Edges are about `edge_m` long, and two that leave a node are `fork` apart.
/// Returns the nodes of the nets. **Units:** m, rad.
pub fn cross(free: &Free, sketch: &mut Sketch, [open, net]: [&[bool]; 2], edge_m: f64, fork: f64) -> BTreeSet<usize> {
    let ports: Vec<usize> =
        (0..sketch.dots.len()).filter(|&dot| sketch.dots[dot].port && !sketch.dots[dot].gone).collect();
    let mut seen = vec![false; open.len()];
    let (mut nodes, mut crossed) = (Vec::new(), BTreeSet::new());
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
        let small = !cells.iter().any(|&cell| net[cell]);
        if let Some(joined) = small.then(|| star(free, sketch, &cells, &ports, edge_m, fork)).flatten() {
            crossed.extend(joined);
            continue;
        }
        let lines = rows_of(free, sketch, &ports);
        nodes.extend(lattice(free, sketch, open, &cells, &lines, edge_m));
    }
    for port in ports {
        join_port(free, sketch, port, &nodes, [edge_m, fork], crossed.contains(&port));
    }
    nodes.into_iter().collect()
}

/// Joins the ports of one open area, the nearest first, by edges of about `edge_m`, if each sees each other; if not, nothing is
/// done. Returns them. A line that would leave a node nearly along another is left out unless it joins what is apart.
fn star(
    free: &Free,
    sketch: &mut Sketch,
    cells: &[usize],
    ports: &[usize],
    edge_m: f64,
    fork: f64,
) -> Option<Vec<usize>> {
    let cells: BTreeSet<usize> = cells.iter().copied().collect();
    // One beside a door between two areas belongs to both.
    let is_here = |&port: &usize| {
        let (place, mut is) = (sketch.dots[port].place, false);
        free.near(&[place; 2], BESIDE_M, |cell| is |= cells.contains(&cell) && free.sees(place, free.place(cell)));
        is
    };
    let here: Vec<usize> = ports.iter().copied().filter(is_here).collect();
    let heads: Vec<(usize, Point)> = here.iter().map(|&port| (port, ahead_of(free, sketch, port))).collect();
    let mut pairs: Vec<(f64, [usize; 2])> = Vec::new();
    for (first, (_, a)) in heads.iter().enumerate() {
        for (second, (_, b)) in heads.iter().enumerate().skip(first + 1) {
            if free.sees(*a, *b) {
                pairs.push((geometry::distance(*a, *b), [first, second]));
            }
        }
    }
    if 2 * pairs.len() < heads.len() * heads.len().saturating_sub(1) {
        return None;
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let nodes: Vec<usize> = heads
        .iter()
        .map(|&(port, place)| {
            if place == sketch.dots[port].place {
                return port;
            }
            let node = sketch.add(place, Hold::Loose);
            sketch.join(port, node);
            node
        })
        .collect();
    let mut piece: Vec<usize> = (0..nodes.len()).collect();
    let mut lines = Vec::new();
    for (_, [first, second]) in pairs {
        let [a, b] = [nodes[first], nodes[second]];
        let forks = sketch.forks(a, sketch.dots[b].place, fork) || sketch.forks(b, sketch.dots[a].place, fork);
        let (from, to) = (piece[first], piece[second]);
        if !forks || from != to {
            piece.iter_mut().filter(|piece| **piece == to).for_each(|piece| *piece = from);
            sketch.join(a, b);
            lines.push([a, b]);
        }
    }
    for [a, b] in lines {
        sketch.split_edge(a, b, edge_m, LONGEST * edge_m);
    }
    Some(here)
}

/// A port lies so far beside its area at most. **Units:** m.
const BESIDE_M: f64 = 1.2;
/// Out of a door one goes straight on for so long before one turns. **Units:** m.
const AHEAD_M: f64 = 1.2;
/// A way with less room than this beside it leads through a door. **Units:** m.
const NARROW_M: f64 = 0.8;

/// Where one turns who comes into an open area by a port: the port itself, but behind a door.
fn ahead_of(free: &Free, sketch: &Sketch, port: usize) -> Point {
    let here = sketch.dots[port].place;
    let narrow = free.cell(here).is_some_and(|cell| f64::from(free.clearance[cell]) < NARROW_M);
    let place = match sketch.dots[port].beside[..] {
        [before] => {
            let [x, y] = sketch.along(before, port);
            beside(here, y.atan2(x))
        }
        [] => roomiest(free, here),
        _ => return here,
    };
    if narrow && free.sees(here, place) { place } else { here }
}

fn beside([x, y]: Point, direction: f64) -> Point {
    [x + AHEAD_M * direction.cos(), y + AHEAD_M * direction.sin()]
}

/// Where there is most room beside a place: ahead of a door behind which nothing is.
fn roomiest(free: &Free, here: Point) -> Point {
    const DIRECTIONS: i32 = 16;
    let all = (0..DIRECTIONS).map(|part| beside(here, TAU * f64::from(part) / f64::from(DIRECTIONS)));
    let room =
        |place: &Point| free.cell(*place).filter(|&cell| free.free[cell]).map_or(0.0, |cell| free.clearance[cell]);
    all.max_by(|a, b| room(a).total_cmp(&room(b))).unwrap_or(here)
}

/// Ports: where they are, and whether their way leads into the net along its rows. **Frame:** cells.
fn rows_of(free: &Free, sketch: &Sketch, ports: &[usize]) -> Vec<(Point, bool)> {
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

/// Joins a port with the nearest nodes of the net that it sees, three at most; one that is `joined` in its area with none that is
/// far.
fn join_port(free: &Free, sketch: &mut Sketch, port: usize, nodes: &[usize], [edge_m, fork]: [f64; 2], joined: bool) {
    let alone = !joined;
    let here = sketch.dots[port].place;
    let far = |node: &usize| geometry::distance(sketch.dots[*node].place, here);
    let mut near: Vec<usize> = nodes.to_vec();
    near.sort_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    let reach: Vec<(usize, Point, f64)> =
        near.iter().map(|&node| (node, sketch.dots[node].place, far(&node))).collect();
    let mut joined = 0;
    for (node, place, distance) in reach {
        if joined == 3 || (joined > 0 || !alone) && distance > 1.5 * edge_m {
            break;
        }
        let forks = sketch.forks(port, place, fork) || sketch.forks(node, here, fork);
        if (joined == 0 && alone || !forks) && free.sees(here, place) {
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
