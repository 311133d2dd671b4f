//! Corridors that are straight in the building are straight in the graph, past openings too.

use super::free::Free;
use super::sketch::{Hold, Sketch};

/// An edge that leaves the direction of the cells by less than this part of its length runs along them.
const ALONG: f64 = 0.03;

/// Lays the nodes of a way that runs along the cells on the line of its longest edge, if they are no farther from it than `off`
/// and still see what they are joined with: where a corridor passes an opening its middle bends, but nobody who goes
/// straight on. **Units:** m.
pub fn straighten(free: &Free, sketch: &mut Sketch, off: f64) {
    for axis in [0, 1] {
        let mut lines: Vec<(f64, [usize; 2])> = Vec::new();
        for [a, b] in sketch.edges() {
            let (from, to) = (at(free, sketch, a), at(free, sketch, b));
            let [along, aside] = [1 - axis, axis].map(|axis| (to[axis] - from[axis]).abs());
            if aside <= ALONG * along {
                lines.push((along, [a, b]));
            }
        }
        lines.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut seen = vec![false; sketch.dots.len()];
        for (_, ends) in lines {
            if ends.iter().all(|&end| !seen[end]) {
                lay(free, sketch, ends, axis, off, &mut seen);
            }
        }
    }
}

/// The place of a node. **Frame:** cells.
fn at(free: &Free, sketch: &Sketch, dot: usize) -> [f64; 2] {
    free.to_cells(sketch.dots[dot].place)
}

/// Lays on the line through two nodes what goes on from them along it.
fn lay(free: &Free, sketch: &mut Sketch, ends: [usize; 2], axis: usize, off: f64, seen: &mut [bool]) {
    let common = 0.5 * ends.iter().map(|&end| at(free, sketch, end)[axis]).sum::<f64>();
    let mut open = ends.to_vec();
    ends.into_iter().for_each(|end| seen[end] = true);
    while let Some(dot) = open.pop() {
        let here = at(free, sketch, dot);
        for next in sketch.dots[dot].beside.clone() {
            let mut place = at(free, sketch, next);
            let along = (place[1 - axis] - here[1 - axis]).abs();
            let away = (place[axis] - common).abs();
            if seen[next] || away > off || along < away {
                continue;
            }
            place[axis] = common;
            let place = free.to_building(place);
            let beside = &sketch.dots[next].beside;
            let sees = beside.iter().all(|&other| free.sees(place, sketch.dots[other].place));
            if sees && (sketch.dots[next].hold == Hold::Loose || away < 1e-6) {
                sketch.dots[next].place = place;
                seen[next] = true;
                open.push(next);
            }
        }
    }
}
