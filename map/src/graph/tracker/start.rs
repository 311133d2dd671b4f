//! The start on a graph, from a place and a direction.

use crate::building::geometry::{self, Point};
use crate::graph::{EdgeId, EdgeKind, Graph};
use std::f64::consts::PI;

/// A radian beside the direction counts as so many metres beside the place. **Units:** m.
const RADIAN_M: f64 = 3.0;

/// The edge of a floor on which somebody begins who stands at a place and looks in a direction, and how far along: the
/// nearest, where a wrong direction counts as a distance. **Units:** m, rad; **Frame:** building.
pub fn start(graph: &Graph, floor: i32, place: Point, heading: f64) -> Option<(EdgeId, f64)> {
    let on_floor = graph.edge_ids().filter(|&id| {
        let edge = graph.edge(id);
        edge.kind != EdgeKind::Elevator && edge.length_m > 0.0 && graph.node(edge.from).floor == floor
    });
    let off = |id: EdgeId| {
        let turned = (graph.edge(id).direction - heading + PI).rem_euclid(2.0 * PI) - PI;
        geometry::distance(geometry::nearest(&graph.ends(id), place), place) + RADIAN_M * turned.abs()
    };
    let best = on_floor.map(|id| (off(id), id)).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?.1;
    let along = geometry::distance(graph.ends(best)[0], geometry::nearest(&graph.ends(best), place));
    Some((best, along))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Node, WalkGraph};

    #[test]
    fn place_and_direction_choose_the_edge() {
        let node = |x: f64, y: f64| Node { place: [x, y], ..Node::default() };
        let drawn =
            WalkGraph { nodes: vec![node(0.0, 0.0), node(5.0, 0.0), node(5.0, 5.0)], edges: vec![[0, 1], [1, 2]] };
        let graph = Graph::new(&drawn, &[]).unwrap();
        let begin = |place: Point, degrees: f64| {
            let (edge, along) = start(&graph, 0, place, f64::to_radians(degrees)).unwrap();
            ([graph.edge(edge).from.0, graph.edge(edge).to.0], along)
        };
        assert_eq!(begin([2.0, 0.3], 10.0), ([0, 1], 2.0));
        assert_eq!(begin([2.0, 0.3], 170.0), ([1, 0], 3.0));
        assert_eq!(begin([4.5, 0.5], 80.0), ([1, 2], 0.5));
        assert_eq!(start(&graph, 3, [0.0; 2], 0.0), None);
    }
}
