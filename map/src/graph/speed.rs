//! Work of known size for timing the matcher: as many ways as asked for, and somebody who walks on them for as long as one likes.

use super::matcher::{Estimate, Matcher, Parameters, Place, Start};
use super::{Error, Graph};
use crate::building::{Node, Point, WalkGraph};
use crate::phone::{self, Measured};
use sohle_shared::time::Micros;
use std::f64::consts::FRAC_PI_2;

/// From crossing to crossing of the corridors. **Units:** m.
const BLOCK_M: f64 = 10.0;
/// Edges of a block: 2.5 m each, about what the document draws (Graph, 7.1).
const PIECES: usize = 4;
/// Steps of a block. **Units:** none.
const BLOCK_STEPS: u32 = 14;
/// The walk goes round a square with so many blocks to a side, if there are as many.
const SIDE: usize = 5;
/// From step to step. **Units:** us.
const STEP_US: i64 = 550_000;

/// Corridors that cross at right angles, `blocks` to each side, on one floor.
fn corridors(blocks: usize) -> WalkGraph {
    let mut drawn = WalkGraph::default();
    let mut node = |place: Point| {
        drawn.nodes.push(Node { floor: 0, place, height_m: 0.0 });
        drawn.nodes.len() - 1
    };
    let at = |index: usize| BLOCK_M * index as f64;
    let crossings: Vec<usize> =
        (0..=blocks).flat_map(|row| (0..=blocks).map(move |column| [at(column), at(row)])).map(&mut node).collect();
    for row in 0..=blocks {
        for column in 0..=blocks {
            let from = row * (blocks + 1) + column;
            for (is_there, to, [east, north]) in
                [(column < blocks, from + 1, [1.0, 0.0]), (row < blocks, from + blocks + 1, [0.0, 1.0])]
            {
                if !is_there {
                    continue;
                }
                let mut before = crossings[from];
                for piece in 1..PIECES {
                    let along = BLOCK_M * piece as f64 / PIECES as f64;
                    let next = node([at(column) + along * east, at(row) + along * north]);
                    drawn.edges.push([before, next]);
                    before = next;
                }
                drawn.edges.push([before, crossings[to]]);
            }
        }
    }
    drawn
}

/// Somebody with a phone on a graph.
#[derive(Clone, Debug)]
pub struct Work {
    matcher: Matcher<Graph>,
    edges: usize,
    /// Blocks to a side of the square that is walked.
    side: u32,
    count: u32,
    place: Point,
    heading: f64,
}

impl Work {
    /// The smallest square of corridors that has at least so many directed edges; `known` tells whether the matcher knows the
    /// start.
    ///
    /// # Errors
    /// More than can be numbered.
    pub fn new(edges: usize, known: bool) -> Result<Self, Error> {
        let directed = |blocks: usize| 4 * PIECES * blocks * (blocks + 1);
        let blocks = (1..).find(|&blocks| directed(blocks) >= edges).unwrap_or(1);
        let graph = Graph::new(&corridors(blocks), &[])?;
        let side = SIDE.min(blocks);
        let corner = BLOCK_M * ((blocks - side) / 2) as f64;
        let place = Place { floor: 0, place: [corner; 2], sigma_m: 0.5, heading: Some((0.0, 0.1)) };
        let start = if known { Start::At(vec![place]) } else { Start::Anywhere };
        let edges = graph.edges().len();
        let matcher = Matcher::new(graph, &Parameters::phone(), &start)?;
        Ok(Self { matcher, edges, side: side as u32, count: 0, place: place.place, heading: 0.0 })
    }

    /// Directed edges.
    pub fn edges(&self) -> usize {
        self.edges
    }

    /// The next step, as a phone tells it, and what the matcher says of it: along the corridor, and round at its corners to the
    /// left.
    pub fn step(&mut self) -> &Estimate {
        let turns = self.count > 0 && self.count.is_multiple_of(self.side * BLOCK_STEPS);
        let turn = if turns { FRAC_PI_2 } else { 0.0 };
        self.heading += turn;
        let length = BLOCK_M / f64::from(BLOCK_STEPS);
        let (sin, cos) = self.heading.sin_cos();
        self.place = [self.place[0] + length * cos, self.place[1] + length * sin];
        let time = Micros(i64::from(self.count) * STEP_US);
        let settings = phone::Parameters::default();
        let measured = Measured { index: self.count, time, length, part: settings.length_part, turn, rise: None };
        self.count += 1;
        self.matcher.step(&measured.step(&settings))
    }

    /// Where the walk is in truth. **Units:** m; **Frame:** building.
    pub fn place(&self) -> Point {
        self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::geometry::distance;

    #[test]
    fn the_corridors_are_one_piece_with_as_many_edges_as_asked_for() {
        let graph = Graph::new(&corridors(3), &[]).unwrap();
        assert_eq!((graph.nodes().len(), graph.edges().len()), (16 + 24 * (PIECES - 1), 2 * 24 * PIECES));
        assert!(graph.edges().iter().all(|edge| (edge.length_m - BLOCK_M / PIECES as f64).abs() < 1e-9));
        assert!(graph.pieces().iter().all(|&piece| piece == 0));
        let edges = Work::new(100_000, true).unwrap().edges();
        assert!((100_000..103_000).contains(&edges), "{edges}");
    }

    #[test]
    fn who_is_timed_is_followed_round_and_round() {
        let mut work = Work::new(5_000, true).unwrap();
        for _ in 0..700 {
            work.step();
        }
        let said = work.matcher.estimate().place().unwrap().position;
        // A step is 0.7 m: nobody is farther off who goes round the right blocks.
        assert!(distance(said, work.place()) < 0.7, "{said:?} {:?}", work.place());
    }
}
