//! The walk graph of a DXF file: what is drawn on each floor, joined by stairs and elevators.
//!
//! # Source
//! The graph document, chapter 6.2.2 and table 6.2: the last node of the stairs up and the last of the stairs down are marked,
//! so are elevators. Here the upper end on one floor is joined to the lower end above it, and elevators to those above them.

use crate::building::geometry::{self, Point, Segment};
use crate::building::model::{Node, WalkGraph};
use std::collections::BTreeMap;

/// What is drawn of the graph on a floor. **Units:** m; **Frame:** drawing.
#[derive(Debug, Default)]
pub struct Drawn {
    pub nodes: Vec<Point>,
    pub edges: Vec<Segment>,
    /// Where the stairs end that lead up, and that lead down.
    pub up: Vec<Point>,
    pub down: Vec<Point>,
    pub elevators: Vec<Point>,
}

/// Ends of lines nearer than this are one node. **Units:** m.
const NODE_M: f64 = 1e-3;
/// Ends of stairs on two floors that belong together, and elevators, are no farther apart in the plan. **Units:** m.
const ABOVE_M: f64 = 4.0;
/// More ends of stairs on a floor than this no building has.
const MOST_ENDS: usize = 1_000;

/// The graph of floors from the lowest to the highest, each with its number and height; nothing without edges.
///
/// # Errors
/// When a floor has too many ends of stairs.
pub fn graph(floors: &[(i32, f64, &Drawn)], origin: Point) -> Result<Option<WalkGraph>, String> {
    if floors.iter().all(|(_, _, drawn)| drawn.edges.is_empty()) {
        return Ok(None);
    }
    let mut nodes = Nodes { origin, graph: WalkGraph::default(), found: BTreeMap::new() };
    // Ends of stairs and elevators of the floor below.
    let (mut below_up, mut below_elevators): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for &(number, height_m, drawn) in floors {
        let most = drawn.up.len().max(drawn.down.len()).max(drawn.elevators.len());
        if most > MOST_ENDS {
            return Err(format!("floor {number} has {most} ends of stairs or elevators, more than {MOST_ENDS}"));
        }
        let mut of = |points: &[Point]| -> Vec<usize> {
            points.iter().map(|place| nodes.of(number, height_m, *place)).collect()
        };
        of(&drawn.nodes);
        let (up, down, elevators) = (of(&drawn.up), of(&drawn.down), of(&drawn.elevators));
        for edge in &drawn.edges {
            let edge = edge.map(|place| nodes.of(number, height_m, place));
            if edge[0] != edge[1] {
                nodes.graph.edges.push(edge);
            }
        }
        nodes.join(&below_up, &down);
        nodes.join(&below_elevators, &elevators);
        (below_up, below_elevators) = (up, elevators);
    }
    Ok(Some(nodes.graph))
}

struct Nodes {
    origin: Point,
    graph: WalkGraph,
    found: BTreeMap<(i32, [i64; 2]), usize>,
}

impl Nodes {
    fn of(&mut self, floor: i32, height_m: f64, place: Point) -> usize {
        let place = [place[0] - self.origin[0], place[1] - self.origin[1]];
        let cell = place.map(|value| (value / NODE_M).round() as i64);
        let nodes = &mut self.graph.nodes;
        *self.found.entry((floor, cell)).or_insert_with(|| {
            nodes.push(Node { floor, place, height_m });
            nodes.len() - 1
        })
    }

    /// Joins each of the nodes above with the nearest one below.
    fn join(&mut self, below: &[usize], above: &[usize]) {
        for &upper in above {
            let far = |lower: &usize| geometry::distance(self.graph.nodes[*lower].place, self.graph.nodes[upper].place);
            let nearest = below.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            if let Some(&lower) = nearest.filter(|lower| far(lower) <= ABOVE_M) {
                self.graph.edges.push([lower, upper]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_stairs_are_joined_over_two_floors() {
        let lower = Drawn {
            nodes: vec![[0.0, 0.0]],
            edges: vec![[[0.0, 0.0], [5.0, 0.0]], [[5.0, 0.0], [5.0, 3.0]], [[1.0, 1.0], [1.0, 1.0]]],
            up: vec![[5.0, 3.0]],
            down: Vec::new(),
            elevators: vec![[0.0, 0.0]],
        };
        let upper = Drawn {
            edges: vec![[[6.0, 3.0], [0.0, 0.000_4]]],
            up: vec![[20.0, 0.0]],
            down: vec![[6.0, 3.0], [30.0, 0.0]],
            elevators: vec![[0.0, 0.0]],
            ..Drawn::default()
        };
        let graph = graph(&[(0, 0.0, &lower), (1, 3.5, &upper)], [1.0, 0.0]).unwrap().unwrap();
        let joined: Vec<_> = graph
            .edges
            .iter()
            .map(|edge| edge.map(|node| (graph.nodes[node].floor, graph.nodes[node].place)))
            .filter(|[a, b]| a.0 != b.0)
            .collect();
        assert_eq!(joined, [[(0, [4.0, 3.0]), (1, [5.0, 3.0])], [(0, [-1.0, 0.0]), (1, [-1.0, 0.0])]]);
        // Two edges below, one above, stairs and elevator; four places of edges and two ends that lead nowhere.
        assert_eq!((graph.edges.len(), graph.nodes.len()), (5, 8));
        assert_eq!(super::graph(&[(0, 0.0, &Drawn::default())], [0.0; 2]).unwrap(), None);
    }
}
