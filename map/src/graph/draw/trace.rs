//! From thin lines of cells to nodes and edges.

use super::free::Free;
use super::sketch::{Hold, Sketch};
use crate::building::geometry::{self, Point};
use std::collections::BTreeMap;

/// Lines of cells are straightened to this. **Units:** m.
const STRAIGHT_M: f64 = 0.15;

/// What has become of the cells of a floor.
#[derive(Debug, Default)]
pub struct Traced {
    /// The graph.
    pub sketch: Sketch,
    /// The nodes of cells that are held, where lines meet or end.
    pub node_of: BTreeMap<usize, usize>,
}

/// The graph of the cells that are `left`; those that are held become nodes. Cells where `skip` holds become none, but
/// those beside them do: ports.
pub fn trace(free: &Free, left: &[bool], held: &BTreeMap<usize, Hold>, skip: &[bool]) -> Traced {
    let is = |cell: usize| left[cell] && !skip[cell];
    let cells: Vec<usize> = (0..left.len()).filter(|&cell| is(cell)).collect();
    // Beside each cell: straight neighbours, and diagonal ones that are not reached straight on.
    let beside = |cell: usize| -> Vec<usize> {
        let around = free.around(cell).map(|next| next.filter(|&next| is(next)));
        let diagonal =
            [1, 3, 5, 7].into_iter().filter(|side| around[side - 1].is_none() && around[(side + 1) % 8].is_none());
        [0, 2, 4, 6].into_iter().chain(diagonal).filter_map(|side| around[side]).collect()
    };
    let is_port = |cell: usize| free.around(cell).into_iter().flatten().any(|next| skip[next] && left[next]);
    let mut sketch = Sketch::default();
    let mut node_of: BTreeMap<usize, usize> = BTreeMap::new();
    for &cell in &cells {
        let hold = held.get(&cell).copied();
        if hold.is_some() || is_port(cell) || beside(cell).len() != 2 {
            let node = sketch.add(free.place(cell), hold.unwrap_or(Hold::Loose));
            sketch.dots[node].port = is_port(cell);
            node_of.insert(cell, node);
        }
    }
    // A ring without any of these.
    let mut seen = vec![false; left.len()];
    let starts: Vec<usize> = node_of.keys().copied().collect();
    for start in starts {
        follow_all(free, &mut sketch, &mut node_of, &mut seen, start, &beside);
    }
    for &cell in &cells {
        if !seen[cell] && !node_of.contains_key(&cell) {
            node_of.insert(cell, sketch.add(free.place(cell), Hold::Loose));
            follow_all(free, &mut sketch, &mut node_of, &mut seen, cell, &beside);
        }
    }
    Traced { sketch, node_of }
}

/// Follows every line that leaves a cell to the next node.
fn follow_all(
    free: &Free,
    sketch: &mut Sketch,
    node_of: &mut BTreeMap<usize, usize>,
    seen: &mut [bool],
    start: usize,
    beside: &impl Fn(usize) -> Vec<usize>,
) {
    for first in beside(start) {
        let (mut before, mut here) = (start, first);
        let mut line = vec![start, first];
        if seen[here] {
            continue;
        }
        while !node_of.contains_key(&here) {
            seen[here] = true;
            let Some(next) = beside(here).into_iter().find(|&next| next != before) else { break };
            (before, here) = (here, next);
            line.push(here);
        }
        let Some(&end) = node_of.get(&here) else { continue };
        let points: Vec<Point> = line.iter().map(|&cell| free.place(cell)).collect();
        let mut last = node_of[&start];
        for point in bends(&points) {
            let node = sketch.add(point, Hold::Loose);
            sketch.join(last, node);
            last = node;
        }
        sketch.join(last, end);
    }
}

/// The points between the first and the last at which a line bends. One that ends where it begins bends twice at least.
fn bends(points: &[Point]) -> Vec<Point> {
    let found = geometry::simplified(points, STRAIGHT_M);
    if points.len() > 3 && points.first() == points.last() && found.len() < 4 {
        return vec![points[points.len() / 3], points[2 * points.len() / 3]];
    }
    found.get(1..found.len() - 1).unwrap_or_default().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_bend_where_they_do_and_rings_stay_rings() {
        let corner: Vec<Point> =
            (0..=10).map(|i| [f64::from(i) * 0.1, 0.0]).chain((1..=10).map(|i| [1.0, f64::from(i) * 0.1])).collect();
        assert_eq!(bends(&corner), [[1.0, 0.0]]);
        let stagger: Vec<Point> = (0..20).map(|i| [f64::from(i) * 0.1, f64::from(i / 10) * 0.1]).collect();
        assert!(bends(&stagger).is_empty());
        let small = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1], [0.0, 0.0]];
        assert_eq!(bends(&small).len(), 2);
    }
}
