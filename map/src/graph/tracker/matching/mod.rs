//! Case 5 by map matching: of all routes that may have been walked since the last turns the one whose shape is most like
//! that of the steps, put end to end without the graph.
//!
//! The document keeps it as the alternative to the search by direction and distance, which it found more robust, and falls
//! back on that where a condition of the matching is not met. So does this, and finds the same: `sohle evaluate --suite graph
//! --walks 40` has fewer right ends with it. It takes about 0.2 ms a step in the twin and 1.6 ms in the large building.
//!
//! What the document leaves open: a reference track holds a turn when its directions spread over
//! [`turn_deg`](Thresholds::turn_deg); a route begins in the opposite direction when its first edge is more than
//! [`begin_deg`](Thresholds::begin_deg) off that of the reference; a peak of the correlation counts up to a shift of
//! [`shift_share`](Thresholds::shift_share) of the steps. Edges that no route may have are left out before the five shortest
//! are looked for, not afterwards: all five are of use. What comes before half a turn, or before a change of the floor, is no
//! part of a reference, since no route holds either.
//!
//! # Source
//! Graph, 6.10.2, figures 6.35 to 6.41, and 7.3.

mod curvature;
mod reference;
#[cfg(test)]
mod tests;

pub use curvature::{correlation, curvature};
pub use reference::{History, Reference, Turn};

use super::Tracker;
use super::decision::{Case, Decision};
use crate::alignment::Helmert;
use crate::building::geometry::{self, Point};
use crate::graph::paths::{self, plan_length};
use crate::graph::{EdgeId, EdgeKind, Graph, NodeId};
use std::borrow::Borrow;
use std::fmt;

/// The thresholds of map matching.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Thresholds {
    /// The reference track is longer than this (Graph, 6.10.2). **Units:** m.
    pub shortest_m: f64,
    /// A track holds a turn when its directions spread over so much. **Units:** degrees.
    pub turn_deg: f64,
    /// Routes lead to the nodes within this of the end of the reference track (Graph, 6.10.2). **Units:** m.
    pub radius_m: f64,
    /// So many shortest routes to each node (Graph, 6.10.2).
    pub routes: usize,
    /// A route may be so much longer or shorter than the reference track (Graph, 6.10.2). **Units:** m.
    pub length_m: f64,
    /// A route whose first edge is farther off the first direction of the reference track begins in the opposite one.
    /// **Units:** degrees.
    pub begin_deg: f64,
    /// A route with a sharper bend than this turns round. **Units:** degrees.
    pub half_turn_deg: f64,
    /// Least cross-correlation of the curvatures (Graph, 6.10.2). **Units:** 1/m².
    pub correlation: f64,
    /// For its peak a route may be shifted by so much of the number of steps.
    pub shift_share: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self::documented()
    }
}

impl Thresholds {
    /// As the document has them.
    pub const fn documented() -> Self {
        Self {
            shortest_m: 15.0,
            turn_deg: 45.0,
            radius_m: 10.0,
            routes: 5,
            length_m: 10.0,
            begin_deg: 90.0,
            half_turn_deg: 145.0,
            correlation: 0.3,
            shift_share: 0.5,
        }
    }
}

/// A route that may have been walked.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Its edges.
    pub edges: Vec<EdgeId>,
    /// **Units:** m.
    pub length_m: f64,
    /// Greatest cross-correlation of its curvature with that of the reference track. **Units:** 1/m².
    pub correlation: f64,
    /// By how many steps it is shifted for that.
    pub shift: i64,
    /// Sum of the squared distances between its points and those of the reference track once a Helmert transformation has
    /// laid one over the other. **Units:** m².
    pub residual: f64,
}

/// What came of map matching.
#[derive(Clone, Debug, PartialEq)]
pub struct Matching {
    /// Where the routes begin.
    pub from: NodeId,
    /// Length of the reference track. **Units:** m.
    pub length_m: f64,
    /// Its steps.
    pub steps: usize,
    /// Its end, around which routes end. **Units:** m; **Frame:** building.
    pub end: Point,
    /// Routes of a fitting length.
    pub compared: usize,
    /// Those that are like enough, the best first; or why there are none.
    pub routes: Result<Vec<Route>, Unmatched>,
}

/// Why the search by direction and distance comes in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unmatched {
    /// The reference track is too short.
    Short,
    /// It holds no turn.
    Straight,
    /// No route has its length.
    NoRoute,
    /// None bends as it does.
    Unlike,
}

impl fmt::Display for Unmatched {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Short => "too short",
            Self::Straight => "without a turn",
            Self::NoRoute => "no route of that length",
            Self::Unlike => "no route bends so",
        })
    }
}

/// Routes that are told of in words.
const MOST_TOLD: usize = 3;

impl fmt::Display for Matching {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { from, length_m, steps, end: [x, y], compared, routes } = self;
        write!(out, "map matching of {length_m:.1} m in {steps} steps from node {} to ({x:.2}, {y:.2})", from.0)?;
        let routes = match routes {
            Ok(routes) => routes,
            Err(why) => return write!(out, ": {why}"),
        };
        write!(out, ", {} of {compared} routes alike", routes.len())?;
        for (number, route) in routes.iter().take(MOST_TOLD).enumerate() {
            let edges: Vec<String> = route.edges.iter().map(|edge| edge.0.to_string()).collect();
            let word = if number == 0 { "chosen" } else { "then" };
            write!(
                out,
                "; {word} {} ({:.1} m, correlation {:.2} at {:+}, residual {:.2} m2)",
                edges.join(" "),
                route.length_m,
                route.correlation,
                route.shift,
                route.residual
            )?;
        }
        Ok(())
    }
}

impl<G: Borrow<Graph>> Tracker<G> {
    /// The position as the begin of a reference track.
    pub(super) fn as_turn(&self) -> Turn {
        let edge = self.graph().edge(self.edge);
        let entry = self.graph().on(self.edge, self.along_m);
        Turn { node: edge.from, place: self.graph().node(edge.from).place, entry, heading: edge.direction }
    }

    /// Goes on at the end of the best route, if there is one.
    pub(super) fn match_route(&mut self, length_m: f64, decision: &mut Decision) -> bool {
        let thresholds = self.parameters.matching;
        let Some(reference) = self.history.track(&thresholds) else { return false };
        let matching = self.matching(&reference, &thresholds);
        let best = matching.routes.as_ref().ok().and_then(|routes| routes.first()).cloned();
        let end = matching.end;
        decision.matching = Some(matching);
        let Some(best) = best else { return false };
        let Some(&last) = best.edges.last() else { return false };
        decision.case = Case::MapMatching;
        let along = self.projected(last, end);
        let last_m = self.graph().edge(last).length_m;
        self.turned_at = reference.node;
        self.trail = best.edges;
        self.held.clear();
        self.by_turn = false;
        self.reach(last);
        self.along_m = if (0.0..=last_m).contains(&along) { along } else { length_m.min(last_m) };
        self.spread(1, length_m);
        self.searched = Some((end, 0));
        true
    }

    fn matching(&self, reference: &Reference, thresholds: &Thresholds) -> Matching {
        let end = reference.points.last().copied().unwrap_or_default();
        let mut matching = Matching {
            from: reference.node,
            length_m: reference.length_m,
            steps: reference.points.len() - 1,
            end,
            compared: 0,
            routes: Err(Unmatched::Short),
        };
        if !reference.is_long(thresholds) {
            return matching;
        }
        if !reference.is_bent(thresholds) {
            matching.routes = Err(Unmatched::Straight);
            return matching;
        }
        let routes = self.routes(reference, end, thresholds);
        matching.compared = routes.len();
        if routes.is_empty() {
            matching.routes = Err(Unmatched::NoRoute);
            return matching;
        }
        let bends = curvature(&reference.points);
        let most = (thresholds.shift_share * bends.len() as f64) as usize;
        let compared = routes.into_iter().map(|edges| {
            let points = self.points(&edges, matching.steps);
            let (correlation, shift) = correlation(&bends, &curvature(&points), most);
            let residual = Helmert::fit(&reference.points, &points).residual(&reference.points, &points);
            let length_m = self.length_of(&edges);
            Route { edges, length_m, correlation, shift, residual }
        });
        let mut alike: Vec<Route> = compared.filter(|route| route.correlation >= thresholds.correlation).collect();
        alike.sort_by(|a, b| a.residual.total_cmp(&b.residual).then_with(|| a.edges.cmp(&b.edges)));
        matching.routes = if alike.is_empty() { Err(Unmatched::Unlike) } else { Ok(alike) };
        matching
    }

    /// The shortest routes from where the reference track begins to the nodes around its end.
    fn routes(&self, reference: &Reference, end: Point, thresholds: &Thresholds) -> Vec<Vec<EdgeId>> {
        let graph = self.graph();
        let floor = graph.node(reference.node).floor;
        if self.floors.as_ref().is_some_and(|floors| floors.here() != floor) {
            return Vec::new();
        }
        let first = geometry::direction(reference.points[0], reference.points[1]);
        let open = |id: EdgeId| {
            let edge = graph.edge(id);
            let begins = edge.from != reference.node || self.angle(id, first) <= thresholds.begin_deg.to_radians();
            begins && edge.kind != EdgeKind::Elevator && graph.node(edge.to).floor == floor && self.is_open(id)
        };
        let [least, most] = [-1.0, 1.0].map(|sign| reference.length_m + sign * thresholds.length_m);
        let fits = |weight_mm: u64| weight_mm as f64 * 1e-3 <= most;
        let reached = paths::reach(graph, reference.node, plan_length, open);
        let mut ends: Vec<NodeId> =
            reached.into_iter().filter(|(_, weight)| fits(*weight)).map(|(node, _)| node).collect();
        ends.retain(|&node| geometry::distance(graph.node(node).place, end) <= thresholds.radius_m);
        ends.sort_unstable();
        let turns_round = |edges: &[EdgeId]| {
            let sharp = |pair: &[EdgeId]| {
                self.angle(pair[1], graph.edge(pair[0]).direction) > thresholds.half_turn_deg.to_radians()
            };
            edges.windows(2).any(sharp)
        };
        let routes = ends
            .into_iter()
            .filter(|&node| node != reference.node)
            .flat_map(|node| paths::yen_over(graph, reference.node, node, thresholds.routes, plan_length, open));
        routes
            .map(|path| path.edges)
            .filter(|edges| (least..=most).contains(&self.length_of(edges)) && !turns_round(edges))
            .collect()
    }

    /// Of a route. **Units:** m.
    fn length_of(&self, edges: &[EdgeId]) -> f64 {
        edges.iter().map(|&edge| self.graph().edge(edge).length_m).sum()
    }

    /// A route as so many equal steps.
    fn points(&self, edges: &[EdgeId], steps: usize) -> Vec<Point> {
        let total = self.length_of(edges);
        let mut points = Vec::with_capacity(steps + 1);
        let (mut number, mut before) = (0, 0.0);
        for step in 0..=steps {
            let at = total * step as f64 / steps.max(1) as f64;
            while number + 1 < edges.len() && at > before + self.graph().edge(edges[number]).length_m {
                before += self.graph().edge(edges[number]).length_m;
                number += 1;
            }
            points.push(self.graph().on(edges[number], at - before));
        }
        points
    }
}
