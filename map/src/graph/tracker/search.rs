//! Case 5: an edge is searched for, near by and then anywhere (Graph, 6.10.1, figure 6.31); by map matching before that, if
//! it is set so.

use super::decision::{Candidate, Case, Decision, Search};
use super::matching::History;
use super::{Floors, SearchBy, Tracker, Variance};
use crate::building::geometry::{self, Point};
use crate::graph::paths::{dijkstra, plan_length};
use crate::graph::{EdgeId, EdgeKind, Graph};
use std::borrow::Borrow;

impl<G: Borrow<Graph>> Tracker<G> {
    /// Searches an edge for the steps that are held back. Without one they are held back further.
    pub(super) fn search(&mut self, length_m: f64, decision: &mut Decision) {
        if self.parameters.search == SearchBy::MapMatching && self.match_route(length_m, decision) {
            return;
        }
        let from = self.search_from();
        let heading = self.heading();
        let limit = self.parameters.search_deg.to_radians();
        let radius_m = self.parameters.search_sigmas * self.variance.sigma_m();
        let own = self.graph().node(self.graph().edge(self.edge).from).floor;
        let floor = self.floors.as_ref().map_or(own, Floors::here);
        let start = |edge: EdgeId| self.graph().node(self.graph().edge(edge).from);
        let far = |edge: EdgeId| geometry::distance(start(edge).place, from);
        // Those since the last turn were wrong (figure 6.33).
        let passed =
            |edge: EdgeId| self.trail.iter().any(|&passed| passed == edge || self.graph().edge(passed).back == edge);
        let fitting = self.graph().edge_ids().filter(|&edge| {
            (start(edge).floor == floor || self.climbs_to(edge, floor))
                && self.graph().edge(edge).kind != EdgeKind::Elevator
                && !passed(edge)
                && self.is_open(edge)
                && self.angle(edge, heading) < limit
        });
        let mut fitting: Vec<EdgeId> = fitting.collect();
        fitting.sort_by(|&a, &b| far(a).total_cmp(&far(b)).then(a.cmp(&b)));
        let nearest = fitting.first().map(|&edge| (edge, far(edge) <= radius_m));
        decision.limit = limit;
        decision.search = Some(Search { from, radius_m });
        decision.candidates =
            fitting.into_iter().map(|edge| Candidate { edge, angle: self.angle(edge, heading) }).collect();
        let Some((edge, local)) = nearest else {
            decision.case = Case::Waiting;
            return;
        };
        let node = self.graph().edge(edge).from;
        if local {
            // The way since the last turn was wrong: the shortest from there to the edge takes its place.
            decision.case = Case::LocalSearch;
            let way = dijkstra(self.graph(), self.turned_at, node, plan_length);
            self.trail = way.map_or_else(Vec::new, |way| way.edges);
            self.trail.push(edge);
        } else {
            // Nothing has made sense for a while: all begins anew.
            decision.case = Case::GlobalSearch;
            self.turned_at = node;
            self.trail = vec![edge];
            self.variance = Variance::default();
        }
        self.held.clear();
        self.by_turn = false;
        self.reach(edge);
        self.along_m = length_m.min(self.graph().edge(edge).length_m);
        self.spread(1, length_m);
        self.searched = Some((from, 0));
        if !local {
            self.history = History::begin(self.as_turn());
        }
    }

    /// Where the steps that are held back lead to, from the last position. From where the last search began, over all steps
    /// since, if that was a few edges ago: it found the wrong edge. The document adds "the new search steps"; those in between
    /// were walked, too.
    fn search_from(&self) -> Point {
        if let Some((from, edges)) = self.searched
            && edges <= self.parameters.again_edges
        {
            return from;
        }
        self.held.iter().fold(self.graph().on(self.edge, self.along_m), |[x, y], held| {
            [x + held.length_m * held.heading.cos(), y + held.length_m * held.heading.sin()]
        })
    }
}
