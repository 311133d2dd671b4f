//! Shortest ways through a graph: Dijkstra, A*, and Yen's k shortest.
//!
//! # Source
//! Graph, 5.3.

use super::model::{Edge, EdgeId, Graph, NodeId};
use crate::building::geometry;
use pathfinding::prelude as find;
use std::collections::HashMap;

/// A way.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path {
    /// The edges in order; none when it ends where it begins.
    pub edges: Vec<EdgeId>,
    /// The sum of what they weigh. **Units:** mm.
    pub weight_mm: u64,
}

/// What an edge weighs: an integer, so that sums do not depend on their order. **Units:** mm.
pub trait Weight: Fn(&Edge) -> u64 {}
impl<F: Fn(&Edge) -> u64> Weight for F {}

/// The length of the edge in the plan (Graph, 6.2.2), a millimetre at least, rounded up.
pub fn plan_length(edge: &Edge) -> u64 {
    ((edge.length_m * 1e3).ceil() as u64).max(1)
}

/// The shortest way, found by Dijkstra's algorithm.
pub fn dijkstra(graph: &Graph, from: NodeId, to: NodeId, weight: impl Weight) -> Option<Path> {
    let (nodes, weight_mm) = find::dijkstra(&from, |&node| beside(graph, node, &weight, &every), |&node| node == to)?;
    Some(path(graph, &nodes, weight_mm, &weight, &every))
}

/// The shortest way, found by A*: the same weight as [`dijkstra`]'s, where no edge weighs less than its [`plan_length`].
pub fn astar(graph: &Graph, from: NodeId, to: NodeId, weight: impl Weight) -> Option<Path> {
    let goal = graph.node(to).place;
    let least = |&node: &NodeId| (geometry::distance(graph.node(node).place, goal) * 1e3).floor() as u64;
    let (nodes, weight_mm) =
        find::astar(&from, |&node| beside(graph, node, &weight, &every), least, |&node| node == to)?;
    Some(path(graph, &nodes, weight_mm, &weight, &every))
}

/// The `count` shortest ways that visit no node twice, from the shortest on; fewer if there are not so many. Yen's algorithm.
pub fn yen(graph: &Graph, from: NodeId, to: NodeId, count: usize, weight: impl Weight) -> Vec<Path> {
    yen_over(graph, from, to, count, weight, every)
}

/// The same over some edges only.
pub fn yen_over(
    graph: &Graph,
    from: NodeId,
    to: NodeId,
    count: usize,
    weight: impl Weight,
    open: impl Fn(EdgeId) -> bool,
) -> Vec<Path> {
    let found = find::yen(&from, |&node| beside(graph, node, &weight, &open), |&node| node == to, count);
    found.into_iter().map(|(nodes, weight_mm)| path(graph, &nodes, weight_mm, &weight, &open)).collect()
}

/// What the shortest ways over some edges weigh to each other node that they lead to. **Units:** mm.
pub fn reach(graph: &Graph, from: NodeId, weight: impl Weight, open: impl Fn(EdgeId) -> bool) -> HashMap<NodeId, u64> {
    let found = find::dijkstra_all(&from, |&node| beside(graph, node, &weight, &open));
    found.into_iter().map(|(node, (_, weight_mm))| (node, weight_mm)).collect()
}

fn every(_: EdgeId) -> bool {
    true
}

/// What weighs least of the open edges to each neighbour.
fn beside(graph: &Graph, node: NodeId, weight: &impl Weight, open: &impl Fn(EdgeId) -> bool) -> Vec<(NodeId, u64)> {
    let edges = graph.leaving(node).filter(|&id| open(id)).map(|id| graph.edge(id));
    edges.map(|edge| (edge.to, weight(edge))).collect()
}

fn path(graph: &Graph, nodes: &[NodeId], weight_mm: u64, weight: &impl Weight, open: &impl Fn(EdgeId) -> bool) -> Path {
    let edge = |pair: &[NodeId]| {
        let fitting = graph.leaving(pair[0]).filter(|&id| open(id) && graph.edge(id).to == pair[1]);
        fitting.min_by_key(|&id| weight(graph.edge(id)))
    };
    Path { edges: nodes.windows(2).filter_map(edge).collect(), weight_mm }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Node, WalkGraph};
    use proptest::prelude::*;

    fn graph(places: &[[f64; 2]], edges: &[[usize; 2]]) -> Graph {
        let nodes = places.iter().map(|&place| Node { place, ..Node::default() }).collect();
        Graph::new(&WalkGraph { nodes, edges: edges.to_vec() }, &[]).unwrap()
    }

    /// Every way without a node twice, by trying all.
    fn all(graph: &Graph, here: NodeId, to: NodeId, seen: &mut Vec<NodeId>, weight: u64, found: &mut Vec<u64>) {
        if here == to {
            found.push(weight);
            return;
        }
        seen.push(here);
        for id in graph.leaving(here) {
            let edge = graph.edge(id);
            if !seen.contains(&edge.to) {
                all(graph, edge.to, to, seen, weight + plan_length(edge), found);
            }
        }
        seen.pop();
    }

    #[test]
    fn the_shorter_way_round_is_taken_and_the_longer_is_second() {
        let graph = graph(&[[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [0.0, 5.0]], &[[0, 1], [1, 2], [0, 3], [3, 2]]);
        let (from, to) = (NodeId(0), NodeId(2));
        let shortest = dijkstra(&graph, from, to, plan_length).unwrap();
        assert_eq!(shortest.weight_mm, 7_000);
        assert_eq!(shortest.edges.iter().map(|&id| graph.edge(id).to.0).collect::<Vec<_>>(), [1, 2]);
        let both = yen(&graph, from, to, 5, plan_length);
        assert_eq!(both.iter().map(|path| path.weight_mm).collect::<Vec<_>>(), [7_000, 5_000 + 3_163]);
        assert_eq!(dijkstra(&graph, from, from, plan_length), Some(Path::default()));
    }

    #[test]
    fn there_is_no_way_between_pieces() {
        let graph = graph(&[[0.0, 0.0], [3.0, 0.0], [9.0, 0.0], [9.0, 1.0]], &[[0, 1], [2, 3]]);
        assert_eq!(dijkstra(&graph, NodeId(0), NodeId(2), plan_length), None);
        assert_eq!(astar(&graph, NodeId(0), NodeId(2), plan_length), None);
        assert_eq!(yen(&graph, NodeId(0), NodeId(2), 3, plan_length), []);
    }

    proptest! {
        #[test]
        fn all_three_agree_with_trying_every_way(
            places in proptest::collection::vec(proptest::array::uniform2(0.0_f64..20.0), 7),
            drawn in proptest::collection::vec((0_usize..7, 0_usize..7), 4..14),
        ) {
            let mut edges: Vec<[usize; 2]> =
                drawn.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a.min(b), a.max(b)]).collect();
            edges.sort_unstable();
            edges.dedup();
            let graph = graph(&places, &edges);
            let (from, to) = (NodeId(0), NodeId(6));
            let mut truth = Vec::new();
            all(&graph, from, to, &mut Vec::new(), 0, &mut truth);
            truth.sort_unstable();
            let shortest = dijkstra(&graph, from, to, plan_length);
            prop_assert_eq!(shortest.as_ref().map(|path| path.weight_mm), truth.first().copied());
            prop_assert_eq!(astar(&graph, from, to, plan_length).map(|path| path.weight_mm), truth.first().copied());
            let five = yen(&graph, from, to, 5, plan_length);
            truth.truncate(5);
            prop_assert_eq!(five.iter().map(|path| path.weight_mm).collect::<Vec<_>>(), truth);
            let reached = reach(&graph, from, plan_length, every);
            prop_assert_eq!(reached.get(&to).copied(), shortest.map(|path| path.weight_mm));
            // Over the edges of all ways but one that one is missing.
            if let Some(closed) = five.first().and_then(|path| path.edges.first()) {
                let others = yen_over(&graph, from, to, 5, plan_length, |id| id != *closed);
                prop_assert!(others.iter().all(|path| !path.edges.contains(closed)));
            }
            for path in five {
                prop_assert_eq!(path.edges.iter().map(|&id| plan_length(graph.edge(id))).sum::<u64>(), path.weight_mm);
                prop_assert!(path.edges.windows(2).all(|pair| graph.edge(pair[0]).to == graph.edge(pair[1]).from));
            }
        }
    }
}
