//! Buildings made by the project: one for the evaluation of the source document, one for scale.

mod draft;
mod large;
mod stairwell;
mod twin;

pub use large::large;
pub use twin::twin;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::geometry;
    use crate::building::{Building, ConnectorKind, geojson};

    /// The committed file is what the generator makes, to the byte.
    #[track_caller]
    fn committed(building: &Building, text: &str, largest: usize) {
        assert!(geojson::write(building).unwrap() == text, "make it again: sohle building generate");
        assert!(text.len() < largest, "{} bytes", text.len());
    }

    /// Edges of the walk graph cross no wall, and everything is reached from everywhere.
    #[track_caller]
    fn well_connected(building: &Building) {
        let graph = building.graph.as_ref().unwrap();
        let mut group: Vec<usize> = (0..graph.nodes.len()).collect();
        fn root(group: &mut [usize], mut node: usize) -> usize {
            while group[node] != node {
                group[node] = group[group[node]];
                node = group[node];
            }
            node
        }
        for edge in &graph.edges {
            let ends = edge.map(|index| graph.nodes[index]);
            let floors = ends.map(|node| building.floor(node.floor).unwrap());
            let line = ends.map(|node| node.place);
            for floor in floors.iter().filter(|_| geometry::length(&line) > 0.0) {
                let through = floor.walls.iter().find(|wall| geometry::crossing(&line, wall).is_some());
                assert!(through.is_none(), "{ends:?} goes through {through:?}");
            }
            let [a, b] = edge.map(|node| root(&mut group, node));
            group[a] = b;
        }
        let roots: std::collections::BTreeSet<_> = (0..group.len()).map(|node| root(&mut group, node)).collect();
        assert_eq!(roots.len(), 1, "the walk graph falls apart");
    }

    #[test]
    fn the_twin_is_what_the_document_evaluates() {
        let building = twin().unwrap();
        committed(&building, include_str!("../../../../buildings/twin.geojson"), 100_000);
        well_connected(&building);
        assert_eq!(building.floors.len(), 2);
        for floor in &building.floors {
            let [low, high] = geometry::bounds(floor.points()).unwrap();
            // 141 120 particles, 16 at a place, 0.30 m apart: 794 m² of grid, "about 175 on a square metre": 806 m².
            let area = (high[0] - low[0]) * (high[1] - low[1]);
            assert!((area - 805.0).abs() < 1.0, "{area}");
            // Rotated by half a turn the wings are the same: doors and walls of one are those of the other.
            let wing = |[x, _]: geometry::Point| x < 10.9;
            let turned = |[x, y]: geometry::Point| [high[0] - x, high[1] - y];
            for wall in floor.walls.iter().filter(|wall| wall.iter().all(|end| wing(*end))) {
                let other = wall.map(turned);
                assert!(floor.walls.iter().any(|wall| same(wall, &other)), "{wall:?}");
            }
        }
        let count = |kind| building.connectors.iter().filter(|connector| connector.kind == kind).count();
        assert_eq!((count(ConnectorKind::Stairs), count(ConnectorKind::Elevator)), (2, 1));
    }

    fn same(a: &geometry::Segment, b: &geometry::Segment) -> bool {
        let near = |a, b| geometry::distance(a, b) < 1e-6;
        (near(a[0], b[0]) && near(a[1], b[1])) || (near(a[0], b[1]) && near(a[1], b[0]))
    }

    #[test]
    fn the_large_one_has_six_floors_and_hundreds_of_rooms() {
        let building = large(1).unwrap();
        committed(&building, include_str!("../../../../buildings/large.geojson"), 1_000_000);
        well_connected(&building);
        assert_eq!(building.floors.len(), 6);
        for floor in &building.floors {
            let [low, high] = geometry::bounds(floor.points()).unwrap();
            assert_eq!((high[0] - low[0]) * (high[1] - low[1]), 10_000.0);
            assert!(floor.rooms.len() > 100, "{}", floor.rooms.len());
            for door in &floor.doors {
                assert!((0.9..2.1).contains(&geometry::length(&door.line)), "{door:?}");
            }
        }
    }

    #[test]
    fn another_seed_is_another_building() {
        assert_eq!(large(2).unwrap(), large(2).unwrap());
        assert_ne!(large(2).unwrap(), large(3).unwrap());
        well_connected(&large(2).unwrap());
    }
}
