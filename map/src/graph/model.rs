//! The graph in an indexed adjacency list.

use super::error::Error;
use crate::building::geometry::{self, Point};
use crate::building::{Building, Connector, ConnectorKind, Node, WalkGraph};

/// Number of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// Number of a directed edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EdgeId(pub u32);

impl NodeId {
    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl EdgeId {
    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What one walks on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeKind {
    /// A level floor.
    Level,
    /// Stairs.
    Stairs,
    /// A ramp.
    Ramp,
    /// Nothing: one is carried.
    Elevator,
}

impl EdgeKind {
    /// In a list.
    pub fn word(self) -> &'static str {
        match self {
            Self::Level => "level",
            Self::Stairs => "stairs",
            Self::Ramp => "ramp",
            Self::Elevator => "elevator",
        }
    }
}

impl From<ConnectorKind> for EdgeKind {
    fn from(kind: ConnectorKind) -> Self {
        match kind {
            ConnectorKind::Stairs => Self::Stairs,
            ConnectorKind::Ramp => Self::Ramp,
            ConnectorKind::Elevator => Self::Elevator,
        }
    }
}

/// A directed edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Where it begins.
    pub from: NodeId,
    /// Where it ends.
    pub to: NodeId,
    /// The same way in the other direction.
    pub back: EdgeId,
    /// What one walks on.
    pub kind: EdgeKind,
    /// From end to end in the plan, as the document's adjacency list has it. **Units:** m.
    pub length_m: f64,
    /// Height gained. **Units:** m.
    pub rise_m: f64,
    /// Of the edge in the plan. **Units:** rad, counter-clockwise from the x axis; **Frame:** building.
    pub direction: f64,
}

/// A walk graph with two directed edges for each way (Graph, 5.1), in an indexed adjacency list: the edges that leave a
/// node follow each other, so that they are found without a search.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    /// The first edge that leaves each node, and one more at the end.
    first: Vec<u32>,
}

/// How far a node may lie beside the outline of stairs and still belong to them. **Units:** m.
const BESIDE_M: f64 = 0.5;
/// Steeper than this nobody walks: an edge that climbs so is an elevator, if nothing else says what it is.
const STEEPEST: f64 = 1.2;
/// Nodes whose heights differ by less are level. **Units:** m.
const LEVEL_M: f64 = 0.01;

impl Graph {
    /// The graph that is drawn in a building.
    ///
    /// Edges that climb are of the kind of the connector that holds both ends. A level edge is one of stairs when both its
    /// ends lie in their outline and it does not cross it, where the stairs have no way with heights (Graph, 6.2.2).
    ///
    /// # Errors
    /// When there is none, or an edge joins a node with itself.
    pub fn of(building: &Building) -> Result<Self, Error> {
        let drawn = building.graph.as_ref().ok_or(Error::None)?;
        Self::new(drawn, &building.connectors)
    }

    /// A graph on floors that are joined by some connectors.
    ///
    /// # Errors
    /// When an edge joins a node with itself, or there are more than can be numbered.
    pub fn new(drawn: &WalkGraph, connectors: &[Connector]) -> Result<Self, Error> {
        let count = u32::try_from(2 * drawn.edges.len()).map_err(|_| Error::TooLarge)?;
        u32::try_from(drawn.nodes.len()).map_err(|_| Error::TooLarge)?;
        let mut degree = vec![0_u32; drawn.nodes.len() + 1];
        for (number, &[a, b]) in drawn.edges.iter().enumerate() {
            if a == b {
                let Node { floor, place: [x, y], .. } = drawn.nodes[a];
                return Err(Error::Loop { edge: number, x, y, floor });
            }
            degree[a] += 1;
            degree[b] += 1;
        }
        let mut first = Vec::with_capacity(degree.len());
        let mut sum = 0;
        for count in degree {
            first.push(sum);
            sum += count;
        }
        let blank = Edge {
            from: NodeId(0),
            to: NodeId(0),
            back: EdgeId(0),
            kind: EdgeKind::Level,
            length_m: 0.0,
            rise_m: 0.0,
            direction: 0.0,
        };
        let mut edges = vec![blank; count as usize];
        let mut next = first.clone();
        for &ends in &drawn.edges {
            let kind = kind(ends.map(|end| &drawn.nodes[end]), connectors);
            let [there, back] = ends.map(|end| {
                let id = next[end];
                next[end] += 1;
                EdgeId(id)
            });
            for (id, back, [from, to]) in [(there, back, ends), (back, there, [ends[1], ends[0]])] {
                let (a, b) = (&drawn.nodes[from], &drawn.nodes[to]);
                edges[id.index()] = Edge {
                    from: NodeId(from as u32),
                    to: NodeId(to as u32),
                    back,
                    kind,
                    length_m: geometry::distance(a.place, b.place),
                    rise_m: b.height_m - a.height_m,
                    direction: geometry::direction(a.place, b.place),
                };
            }
        }
        Ok(Self { nodes: drawn.nodes.clone(), edges, first })
    }

    /// All nodes, by number.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// All directed edges, by number.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// A node.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.index()]
    }

    /// An edge.
    pub fn edge(&self, id: EdgeId) -> &Edge {
        &self.edges[id.index()]
    }

    /// All numbers of nodes.
    pub fn node_ids(&self) -> impl Iterator<Item = NodeId> + use<> {
        (0..self.nodes.len() as u32).map(NodeId)
    }

    /// All numbers of edges.
    pub fn edge_ids(&self) -> impl Iterator<Item = EdgeId> + use<> {
        (0..self.edges.len() as u32).map(EdgeId)
    }

    /// The edges that leave a node.
    pub fn leaving(&self, node: NodeId) -> impl Iterator<Item = EdgeId> + use<> {
        (self.first[node.index()]..self.first[node.index() + 1]).map(EdgeId)
    }

    /// Where an edge begins and ends. **Units:** m; **Frame:** building.
    pub fn ends(&self, id: EdgeId) -> [Point; 2] {
        let edge = self.edge(id);
        [self.node(edge.from).place, self.node(edge.to).place]
    }

    /// A place on an edge, so far from its beginning; beyond its ends on the straight line. **Units:** m.
    pub fn on(&self, id: EdgeId, along_m: f64) -> Point {
        let edge = self.edge(id);
        let [x, y] = self.node(edge.from).place;
        let (sin, cos) = edge.direction.sin_cos();
        [x + along_m * cos, y + along_m * sin]
    }

    /// The shortest edge from a node to another.
    pub fn between(&self, from: NodeId, to: NodeId) -> Option<EdgeId> {
        let fitting = self.leaving(from).filter(|&id| self.edge(id).to == to);
        fitting.min_by(|&a, &b| self.edge(a).length_m.total_cmp(&self.edge(b).length_m))
    }

    /// The node of a floor that is nearest to a place, if any is on the floor.
    pub fn nearest(&self, floor: i32, place: Point) -> Option<NodeId> {
        let here = self.node_ids().filter(|&id| self.node(id).floor == floor);
        let far = |id: &NodeId| geometry::distance(self.node(*id).place, place);
        here.min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// For each node the number of its piece: pieces are not joined. The largest has the number 0.
    pub fn pieces(&self) -> Vec<usize> {
        let mut piece = vec![usize::MAX; self.nodes.len()];
        let mut sizes = Vec::new();
        for start in self.node_ids() {
            if piece[start.index()] != usize::MAX {
                continue;
            }
            let (mut open, mut size) = (vec![start], 0);
            piece[start.index()] = sizes.len();
            while let Some(node) = open.pop() {
                size += 1;
                for next in self.leaving(node).map(|id| self.edge(id).to) {
                    if piece[next.index()] == usize::MAX {
                        piece[next.index()] = sizes.len();
                        open.push(next);
                    }
                }
            }
            sizes.push(size);
        }
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by_key(|&number| (std::cmp::Reverse(sizes[number]), number));
        let mut rank = vec![0; order.len()];
        for (place, number) in order.into_iter().enumerate() {
            rank[number] = place;
        }
        piece.into_iter().map(|number| rank[number]).collect()
    }
}

/// What an edge leads over.
fn kind(ends: [&Node; 2], connectors: &[Connector]) -> EdgeKind {
    let line = ends.map(|node| node.place);
    let rise = (ends[1].height_m - ends[0].height_m).abs();
    let climbs = rise > LEVEL_M || ends[0].floor != ends[1].floor;
    let inside = |connector: &Connector, end: usize| {
        connector.outlines.iter().any(|(floor, outline)| {
            let near = || geometry::sides(outline).any(|side| reaches(&side, line[end]));
            // A node on stairs is of the floor below; its outline may be that of either.
            (*floor == ends[end].floor || climbs) && (geometry::contains(outline, line[end]) || climbs && near())
        })
    };
    let drawn_level =
        |connector: &&Connector| {
            connector.kind != ConnectorKind::Elevator
                && connector.way.is_empty()
                && (0..2).all(|end| inside(connector, end))
                && connector.outlines.iter().filter(|(floor, _)| *floor == ends[0].floor).all(|(_, outline)| {
                    !geometry::sides(outline).any(|side| geometry::crossing(&line, &side).is_some())
                })
        };
    if !climbs {
        return connectors.iter().find(drawn_level).map_or(EdgeKind::Level, |connector| connector.kind.into());
    }
    let steep = rise > STEEPEST * geometry::length(&line);
    let holding = connectors.iter().filter(|connector| (0..2).all(|end| inside(connector, end)));
    let fitting = |connector: &&Connector| (connector.kind == ConnectorKind::Elevator) == steep;
    let connector = holding.clone().find(fitting).or_else(|| holding.clone().next());
    connector.map_or(if steep { EdgeKind::Elevator } else { EdgeKind::Stairs }, |connector| connector.kind.into())
}

fn reaches(side: &geometry::Segment, point: Point) -> bool {
    geometry::distance(geometry::nearest(side, point), point) <= BESIDE_M
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(floor: i32, place: Point, height_m: f64) -> Node {
        Node { floor, place, height_m }
    }

    fn square(x: f64, y: f64, side: f64) -> Vec<Point> {
        vec![[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
    }

    fn connector(kind: ConnectorKind, outline: Vec<Point>) -> Connector {
        Connector { name: kind.word().into(), kind, outlines: vec![(0, outline.clone()), (1, outline)], way: vec![] }
    }

    #[test]
    fn each_way_becomes_two_edges_that_know_each_other() {
        let nodes = vec![node(0, [0.0, 0.0], 0.0), node(0, [3.0, 4.0], 0.0), node(0, [3.0, 0.0], 0.0)];
        let graph = Graph::new(&WalkGraph { nodes, edges: vec![[0, 1], [2, 0], [2, 1]] }, &[]).unwrap();
        assert_eq!(graph.edges().len(), 6);
        for id in graph.edge_ids() {
            let edge = graph.edge(id);
            let back = graph.edge(edge.back);
            assert_eq!((back.back, back.from, back.to), (id, edge.to, edge.from));
            assert!(graph.leaving(edge.from).any(|leaving| leaving == id));
            let turn = (edge.direction - back.direction).abs();
            assert!((turn - std::f64::consts::PI).abs() < 1e-12);
        }
        let there = graph.between(NodeId(0), NodeId(1)).unwrap();
        assert_eq!(graph.edge(there).length_m, 5.0);
        assert!(geometry::distance(graph.on(there, 2.5), [1.5, 2.0]) < 1e-12);
        assert_eq!(graph.leaving(NodeId(0)).count(), 2);
    }

    #[test]
    fn stairs_and_elevators_are_known_by_their_outlines() {
        let connectors = [
            connector(ConnectorKind::Stairs, square(0.0, 0.0, 5.0)),
            connector(ConnectorKind::Elevator, square(8.0, 0.0, 2.0)),
        ];
        let kind_of = |a: Node, b: Node| kind([&a, &b], &connectors);
        // A flight; a cabin; what climbs outside of both; the level floor between them.
        assert_eq!(kind_of(node(0, [1.0, 1.0], 0.0), node(1, [4.0, 1.0], 3.5)), EdgeKind::Stairs);
        assert_eq!(kind_of(node(0, [9.0, 1.0], 0.0), node(1, [9.0, 1.0], 3.5)), EdgeKind::Elevator);
        assert_eq!(kind_of(node(0, [30.0, 1.0], 0.0), node(1, [30.5, 1.0], 3.5)), EdgeKind::Elevator);
        assert_eq!(kind_of(node(0, [30.0, 1.0], 0.0), node(1, [36.0, 1.0], 3.5)), EdgeKind::Stairs);
        assert_eq!(kind_of(node(0, [6.0, 1.0], 0.0), node(0, [9.0, 1.0], 0.0)), EdgeKind::Level);
    }

    /// Graph, 6.2.2 and figure 6.7: between stair nodes only what does not cross the polygon is a stair edge.
    #[test]
    fn an_edge_between_stair_nodes_that_crosses_the_polygon_is_no_stair_edge() {
        // A polygon around two flights, open to the right between them.
        let outline =
            vec![[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 2.0], [4.0, 2.0], [4.0, 3.0], [0.0, 3.0]];
        let stairs = [connector(ConnectorKind::Stairs, outline)];
        let kind_of = |a: Point, b: Point| kind([&node(0, a, 0.0), &node(0, b, 0.0)], &stairs);
        assert_eq!(kind_of([0.5, 0.5], [3.5, 0.5]), EdgeKind::Stairs);
        assert_eq!(kind_of([3.5, 0.5], [3.5, 2.5]), EdgeKind::Level);
        assert_eq!(kind_of([0.5, 0.5], [0.5, 2.5]), EdgeKind::Stairs);
    }

    #[test]
    fn pieces_are_numbered_from_the_largest() {
        let nodes = (0..5).map(|x| node(0, [f64::from(x), 0.0], 0.0)).collect();
        let graph = Graph::new(&WalkGraph { nodes, edges: vec![[0, 1], [2, 3], [3, 4]] }, &[]).unwrap();
        assert_eq!(graph.pieces(), [1, 1, 0, 0, 0]);
    }

    #[test]
    fn a_loop_is_refused_with_its_place() {
        let drawn = WalkGraph { nodes: vec![node(2, [1.0, 2.5], 7.0)], edges: vec![[0, 0]] };
        let told = Graph::new(&drawn, &[]).unwrap_err().to_string();
        assert_eq!(told, "edge 0 of the graph joins the node at (1.00, 2.50) on floor 2 with itself; remove it");
        assert!(matches!(Graph::of(&Building::default()), Err(Error::None)));
    }
}
