//! Floor changes by barometer: when, by what, and where one comes out.
//!
//! # Source
//! Graph, 6.11. The document draws stairs on both floors that they join; in a graph with heights they are there once, and
//! "the stair edges of the next floor" are those between the two floors.

use super::Tracker;
use crate::building::Building;
use crate::building::geometry::{self, Point};
use crate::graph::{EdgeId, EdgeKind, Graph, NodeId};
use std::borrow::Borrow;

/// By what a floor was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Stairs: there were steps on the way.
    Stairs,
    /// An elevator: there were none.
    Elevator,
}

/// A change of the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Number of the floor before.
    pub from: i32,
    /// Number of the new one.
    pub to: i32,
    /// By what.
    pub by: By,
}

/// Knows on which floor somebody is from how high the steps go.
#[derive(Clone, Debug, PartialEq)]
pub struct Floors {
    /// Number and height of each floor. **Units:** m.
    heights: Vec<(i32, f64)>,
    here: i32,
    /// Above the building's origin. **Units:** m.
    height_m: f64,
    /// The height after each step since the last change. **Units:** m.
    past: Vec<f64>,
}

impl Floors {
    /// Somebody begins on a floor of a building; nothing if it has no such floor.
    pub fn new(building: &Building, floor: i32) -> Option<Self> {
        let heights = building.floors.iter().map(|floor| (floor.number, floor.height_m)).collect();
        let height_m = building.floor(floor)?.height_m;
        Some(Self { heights, here: floor, height_m, past: vec![height_m] })
    }

    /// The floor.
    pub fn here(&self) -> i32 {
        self.here
    }

    /// The next floor below another.
    pub(super) fn below(&self, floor: i32) -> Option<i32> {
        let height_m = self.height_of(floor);
        let lower = self.heights.iter().filter(|(_, height)| *height < height_m);
        lower.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(number, _)| *number)
    }

    fn height_of(&self, floor: i32) -> f64 {
        self.heights.iter().find(|(number, _)| *number == floor).map_or(0.0, |(_, height)| *height)
    }

    /// Takes in a step that ends so much higher than the last; tells a change of the floor. **Units:** m.
    pub fn step(&mut self, rise_m: f64, parameters: &super::Parameters) -> Option<Change> {
        self.height_m += rise_m;
        self.past.push(self.height_m);
        let near = |(number, height): &&(i32, f64)| {
            *number != self.here && (height - self.height_m).abs() <= parameters.floor_m
        };
        let to = self.heights.iter().find(near)?.0;
        // Steps that ended within the last part of the height: the first of them may have come from farther below.
        let recent = self.past.iter().rev();
        let recent = recent.take_while(|height| (*height - self.height_m).abs() < parameters.between_floors_m).count();
        let by = if recent > parameters.stairs_steps { By::Stairs } else { By::Elevator };
        let change = Change { from: self.here, to, by };
        self.here = to;
        self.past = vec![self.height_m];
        Some(change)
    }
}

impl<G: Borrow<Graph>> Tracker<G> {
    /// Whether an edge may be walked on: level ones only on the floor that the barometer tells.
    pub(super) fn is_open(&self, id: EdgeId) -> bool {
        let Some(floors) = &self.floors else { return true };
        let edge = self.graph().edge(id);
        let node = self.graph().node(edge.from);
        let on_floor = floors.heights.iter().find(|(_, height)| (height - node.height_m).abs() < LEVEL_M);
        edge.kind != EdgeKind::Level || on_floor.is_none_or(|(number, _)| *number == floors.here)
    }

    /// Whether an edge belongs to stairs from the floor below: the document draws stairs on both floors that they join.
    pub(super) fn climbs_to(&self, id: EdgeId, floor: i32) -> bool {
        let Some(floors) = &self.floors else { return false };
        let edge = self.graph().edge(id);
        let [from, to] = [edge.from, edge.to].map(|node| self.graph().node(node));
        let on_floor = floors.heights.iter().any(|(_, height)| (height - from.height_m).abs() < LEVEL_M);
        (edge.kind == EdgeKind::Stairs || !on_floor) && floors.below(floor) == Some(from.floor.min(to.floor))
    }

    /// Begins anew on the new floor (Graph, 6.11).
    pub(super) fn change_floor(&mut self, change: Change) {
        let place = self.graph().on(self.edge, self.along_m);
        let heading = self.heading();
        let begin = match change.by {
            By::Elevator => self.out_of_elevator(change.to, place, heading),
            By::Stairs => self.on_stairs(change, place, heading),
        };
        let Some((edge, along_m)) = begin else { return };
        self.held.clear();
        self.searched = None;
        self.by_turn = false;
        if edge != self.edge {
            self.turned_at = self.graph().edge(edge).from;
            self.trail = vec![edge];
            self.reach(edge);
        }
        self.behind_end = false;
        self.along_m = along_m;
        self.variance = super::Variance::default();
        self.history = super::matching::History::begin(self.as_turn());
    }

    /// The edge that leaves the elevator on a floor nearest to a place; by the heading where it has two doors.
    fn out_of_elevator(&self, floor: i32, place: Point, heading: f64) -> Option<(EdgeId, f64)> {
        let graph = self.graph();
        let is_cabin = |&node: &NodeId| {
            graph.node(node).floor == floor && graph.leaving(node).any(|id| graph.edge(id).kind == EdgeKind::Elevator)
        };
        let far = |node: &NodeId| geometry::distance(graph.node(*node).place, place);
        let cabin = graph.node_ids().filter(is_cabin).min_by(|a, b| far(a).total_cmp(&far(b)))?;
        let off = |id: &EdgeId| self.angle(*id, heading);
        let doors = graph.leaving(cabin).filter(|&id| graph.edge(id).kind == EdgeKind::Level);
        Some((doors.min_by(|a, b| off(a).total_cmp(&off(b)))?, 0.0))
    }

    /// Where on the stairs between two floors somebody is.
    fn on_stairs(&self, change: Change, place: Point, heading: f64) -> Option<(EdgeId, f64)> {
        let graph = self.graph();
        let floors = self.floors.as_ref()?;
        let heights = [change.from, change.to].map(|floor| floors.height_of(floor));
        let up = heights[1] > heights[0];
        let [low, high] = if up { heights } else { [heights[1], heights[0]] };
        let stairs: Vec<EdgeId> = stair_edges(graph, [low, high]);
        // 1: the last position projected onto a stair edge beside it, in the direction of the heading.
        let beside = stairs.iter().copied().filter(|&id| {
            let along = self.projected(id, place);
            let length_m = graph.edge(id).length_m;
            (0.0..=length_m).contains(&along)
                && geometry::distance(graph.on(id, along), place) < self.parameters.project_m
        });
        let off = |id: &EdgeId| self.angle(*id, heading);
        if let Some(best) = beside.min_by(|a, b| off(a).total_cmp(&off(b)).then(a.cmp(b))) {
            return Some((best, self.projected(best, place)));
        }
        // Only those that lead to the new floor come into question from here on.
        let leading = stairs.into_iter().filter(|&id| (graph.edge(id).rise_m > 0.0) == up);
        let leading: Vec<EdgeId> = leading.collect();
        let end = |id: EdgeId| graph.edge(id).to;
        let is_last = |id: &&EdgeId| (graph.node(end(**id)).height_m - heights[1]).abs() < LEVEL_M;
        let far = |id: &EdgeId| geometry::distance(graph.node(end(*id)).place, place);
        let last = *leading.iter().filter(is_last).min_by(|a, b| far(a).total_cmp(&far(b)))?;
        // 2: one in the direction of the heading, the nearest to where the stairs end.
        let limit = self.parameters.stairs_deg.to_radians();
        let top = graph.node(end(last)).place;
        let to_top = |id: &EdgeId| geometry::distance(graph.node(end(*id)).place, top);
        let fitting = leading.iter().copied().filter(|id| off(id) < limit);
        if let Some(best) = fitting.min_by(|a, b| to_top(a).total_cmp(&to_top(b)).then(a.cmp(b))) {
            return Some((best, 0.0));
        }
        // 3: the last edge.
        Some((last, 0.0))
    }

    /// How far along an edge a place lies. **Units:** m.
    pub(super) fn projected(&self, id: EdgeId, place: Point) -> f64 {
        let [from, _] = self.graph().ends(id);
        let (sin, cos) = self.graph().edge(id).direction.sin_cos();
        (place[0] - from[0]) * cos + (place[1] - from[1]) * sin
    }
}

/// Nodes within this of the height of a floor are on it. **Units:** m.
const LEVEL_M: f64 = 0.1;

/// The edges of stairs between two heights.
fn stair_edges(graph: &Graph, [low, high]: [f64; 2]) -> Vec<EdgeId> {
    let between = |node: NodeId| (low - LEVEL_M..=high + LEVEL_M).contains(&graph.node(node).height_m);
    let is = |id: &EdgeId| {
        let edge = graph.edge(*id);
        edge.kind == EdgeKind::Stairs && between(edge.from) && between(edge.to)
    };
    graph.edge_ids().filter(is).collect()
}
