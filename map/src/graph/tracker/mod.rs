//! The documented tracker: one hypothesis, which is forced onto the graph step by step.
//!
//! From the deviation of the heading from the edge a step is one of five cases; each case moves the position along the
//! edge, chooses another edge, or holds the step back until it is clear. With every new edge the deviation begins at zero,
//! so that the gyroscope drifts for one edge only.
//!
//! # Source
//! Graph, 6.1 and 6.4 to 6.11, figures 6.2 and 6.3. Where it leaves something open it is decided here, and said where.

mod decision;
mod floors;
pub mod matching;
mod parameters;
mod search;
mod start;
#[cfg(test)]
mod tests;
mod variance;

pub use decision::{Candidate, Case, Decision, Search};
pub use floors::{By, Change, Floors};
pub use parameters::{Parameters, SearchBy};
pub use start::start;
pub use variance::Variance;

use super::{EdgeId, EdgeKind, Graph, NodeId};
use crate::building::geometry::wrapped;
use std::borrow::Borrow;
use std::f64::consts::PI;

/// A shorter edge has no direction. **Units:** m.
const SHORTEST_M: f64 = 1e-3;

/// A step that was held back.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Its heading. **Units:** rad; **Frame:** building.
    heading: f64,
    length_m: f64,
}

/// Follows somebody on a graph.
#[derive(Clone, Debug)]
pub struct Tracker<G> {
    graph: G,
    parameters: Parameters,
    edge: EdgeId,
    /// Along the edge. **Units:** m.
    along_m: f64,
    /// Since the edge was reached. **Units:** rad.
    delta: f64,
    held: Vec<Held>,
    /// A step has gone beyond the end of the edge, where nothing goes on.
    behind_end: bool,
    /// Half a turn was carried out, of which something may be left.
    half_turned: bool,
    /// The edge was reached by a turn.
    by_turn: bool,
    /// Where the last turn was made, and the edges since.
    turned_at: NodeId,
    trail: Vec<EdgeId>,
    /// Where the steps lead to from where the last search began, and how many edges ago that was.
    searched: Option<(crate::building::geometry::Point, usize)>,
    variance: Variance,
    /// What the barometer tells, if there is one.
    floors: Option<Floors>,
    /// What map matching compares routes to, where edges are searched for by that.
    history: matching::History,
}

impl<G: Borrow<Graph>> Tracker<G> {
    /// Somebody begins so far along an edge, in its direction. **Units:** m.
    pub fn new(graph: G, parameters: &Parameters, edge: EdgeId, along_m: f64) -> Self {
        let turned_at = graph.borrow().edge(edge).from;
        let mut begun = Self {
            graph,
            parameters: *parameters,
            edge,
            along_m,
            delta: 0.0,
            held: Vec::new(),
            behind_end: false,
            half_turned: false,
            by_turn: false,
            turned_at,
            trail: vec![edge],
            searched: None,
            variance: Variance::default(),
            floors: None,
            history: matching::History::default(),
        };
        begun.history = matching::History::begin(begun.as_turn());
        begun
    }

    fn graph(&self) -> &Graph {
        self.graph.borrow()
    }

    /// Changes floors by the barometer, and by nothing else. Without this floors change where the edges of stairs lead.
    pub fn with_barometer(self, floors: Floors) -> Self {
        Self { floors: Some(floors), ..self }
    }

    /// The edge, and how far along it. **Units:** m.
    pub fn position(&self) -> (EdgeId, f64) {
        (self.edge, self.along_m)
    }

    /// Takes in a step: how the heading has changed since the last, how long the step was if that is measured, and how much
    /// higher it ends. **Units:** rad, m.
    pub fn step(&mut self, turn: f64, measured_m: f64, rise_m: f64) -> Decision {
        let before = self.delta;
        self.delta = wrapped(before + turn);
        let length_m = self.length(measured_m);
        if self.parameters.search == SearchBy::MapMatching {
            self.history.step(turn, length_m);
        }
        let heading = self.heading();
        if let Some((from, _)) = &mut self.searched {
            *from = [from[0] + length_m * heading.cos(), from[1] + length_m * heading.sin()];
        }
        let mut decision = Decision {
            case: Case::Waiting,
            delta: self.delta,
            candidates: Vec::new(),
            limit: self.parameters.fit_deg.to_radians(),
            search: None,
            matching: None,
            change: None,
            window: 0,
            edge: self.edge,
            along_m: 0.0,
            place: [0.0; 2],
            sigma_m: 0.0,
        };
        let off = self.delta.abs();
        let moved = if off < self.parameters.straight_deg.to_radians() {
            self.straight(length_m, &mut decision)
        } else if off > self.parameters.half_turn_deg.to_radians() {
            self.half_turn(before, &mut decision)
        } else {
            self.turn(length_m, &mut decision)
        };
        // Decision II: the position is not on the edge.
        if let Moved::Beyond(along_m) = moved {
            self.beyond(along_m, length_m, &mut decision);
        }
        // Decision III: too many steps are held back.
        if self.held.len() > self.parameters.window {
            self.search(length_m, &mut decision);
        }
        decision.change = self.floors.as_mut().and_then(|floors| floors.step(rise_m, &self.parameters));
        if let Some(change) = decision.change {
            self.change_floor(change);
        }
        decision.window = self.held.len();
        decision.edge = self.edge;
        decision.along_m = self.along_m;
        decision.place = self.graph().on(self.edge, self.along_m);
        decision.sigma_m = self.variance.sigma_m();
        decision
    }

    fn length(&self, measured_m: f64) -> f64 {
        match self.graph().edge(self.edge).kind {
            EdgeKind::Stairs => self.parameters.stairs_step_m,
            _ if self.parameters.step_m > 0.0 => self.parameters.step_m,
            _ => measured_m,
        }
    }

    /// Of the edge plus the deviation. **Units:** rad.
    fn heading(&self) -> f64 {
        self.graph().edge(self.edge).direction + self.delta
    }

    fn hold(&mut self, length_m: f64) {
        self.held.push(Held { heading: self.heading(), length_m });
    }

    /// Case 1 (Graph, 6.6, figure 6.15).
    fn straight(&mut self, length_m: f64, decision: &mut Decision) -> Moved {
        decision.case = Case::Straight;
        self.half_turned = false;
        if self.behind_end {
            return Moved::Beyond(self.along_m);
        }
        let count = self.held.len();
        if count == 0 {
            let along_m = self.along_m + length_m;
            if along_m > self.end() {
                return Moved::Beyond(along_m);
            }
            self.spread(1, length_m);
            self.lay(length_m, length_m);
            return Moved::On;
        }
        let along_m = self.held.drain(..).map(|held| held.length_m).sum::<f64>() + length_m;
        self.spread(count + 1, length_m);
        self.lay(along_m, length_m);
        Moved::On
    }

    /// Case 2 (Graph, 6.7, figure 6.18).
    fn half_turn(&mut self, before: f64, decision: &mut Decision) -> Moved {
        let tolerance = self.parameters.fit_deg.to_radians();
        let steady = wrapped(self.delta - before).abs() < tolerance;
        if self.delta.abs() < PI - tolerance && !steady {
            decision.case = Case::HalfTurnBegun;
            return Moved::On;
        }
        decision.case = Case::HalfTurn;
        let edge = *self.graph().edge(self.edge);
        self.along_m = (edge.length_m - self.along_m).clamp(0.0, edge.length_m);
        self.reach(edge.back);
        self.held.clear();
        self.by_turn = false;
        self.half_turned = true;
        self.history = matching::History::begin(self.as_turn());
        Moved::On
    }

    /// Case 3 (Graph, 6.8, figure 6.21).
    fn turn(&mut self, length_m: f64, decision: &mut Decision) -> Moved {
        if std::mem::take(&mut self.half_turned) {
            // Decision v. What is left of the half turn belongs to it: the deviation begins anew.
            decision.case = Case::RestOfHalfTurn;
            self.delta = 0.0;
            let along_m = self.along_m + length_m;
            if along_m > self.end() {
                return Moved::Beyond(along_m);
            }
            self.spread(1, length_m);
            self.lay(length_m, length_m);
            return Moved::On;
        }
        let edge = *self.graph().edge(self.edge);
        let to_end = (edge.length_m - self.along_m).max(0.0);
        let at_end = self.behind_end || to_end - self.parameters.end_favour_m <= self.along_m;
        let node = if at_end { edge.to } else { edge.from };
        let heading = self.heading();
        let candidates = self.candidates(node, heading);
        let best = candidates.first().copied().filter(|best| best.angle < self.parameters.fit_deg.to_radians());
        decision.candidates = candidates;
        let Some(best) = best else {
            self.hold(length_m);
            return if self.behind_end { Moved::Beyond(self.along_m) } else { Moved::On };
        };
        decision.case = Case::Turn;
        let steps = self.held.iter().map(|held| held.length_m).sum::<f64>() + length_m;
        let metres = if at_end {
            // Steps that fit on the old edge are laid there; where more would fit virtual ones fill it (figure 6.25).
            let room = if self.behind_end { 0.0 } else { (to_end / length_m).floor() * length_m };
            (steps - room).max(length_m)
        } else if self.by_turn {
            // Decision vi: the turn before was a part of this one, its edge is wrong, and what was laid there belongs to
            // the new one (figures 6.22 and 6.23). The heading holds the angle beta of that turn already.
            steps + self.along_m
        } else {
            steps
        };
        self.turn_onto(best.edge, metres, length_m);
        Moved::On
    }

    /// Case 4 (Graph, 6.9, figure 6.27): a step would end so far along the edge, beyond its end.
    fn beyond(&mut self, along_m: f64, length_m: f64, decision: &mut Decision) {
        let edge = *self.graph().edge(self.edge);
        // Decision viii: whether the position before was on the edge.
        let limit = if self.behind_end { self.parameters.fit_deg } else { self.parameters.ahead_deg };
        decision.limit = limit.to_radians();
        decision.candidates = self.candidates(edge.to, self.heading());
        decision.candidates.retain(|candidate| candidate.edge != edge.back);
        let best = decision.candidates.first().copied().filter(|best| best.angle < decision.limit);
        let Some(best) = best else {
            decision.case = Case::Waiting;
            // Case 3 has held this step back already.
            if !self.behind_end || self.delta.abs() < self.parameters.straight_deg.to_radians() {
                self.hold(length_m);
            }
            self.behind_end = true;
            return;
        };
        if !self.behind_end {
            decision.case = Case::Beyond;
            // The document sets the position that was deleted onto the new edge; here it keeps what it has gone too far.
            let over = along_m - edge.length_m;
            self.along_m = 0.0;
            self.trail.push(best.edge);
            self.reach(best.edge);
            self.by_turn = false;
            self.spread(1, length_m);
            self.lay(over.max(0.0), length_m);
            return;
        }
        decision.case = Case::TurnBehindEnd;
        let held: f64 = self.held.iter().map(|held| held.length_m).sum();
        self.turn_onto(best.edge, held.max(length_m), length_m);
    }

    /// A clean turn: the error begins anew, and a search before it has found the right edge.
    fn turn_onto(&mut self, edge: EdgeId, metres: f64, length_m: f64) {
        self.held.clear();
        self.searched = None;
        self.turned_at = self.graph().edge(edge).from;
        self.trail = vec![edge];
        self.along_m = 0.0;
        self.reach(edge);
        self.by_turn = true;
        self.lay(metres, length_m);
        self.variance = Variance::default();
        if self.parameters.search == SearchBy::MapMatching {
            let node = self.turned_at;
            let turn = matching::Turn { node, place: self.graph().node(node).place, ..self.as_turn() };
            self.history.turned(turn, &self.parameters.matching);
        }
    }

    /// The edges that leave a node on foot, by their angle to a heading.
    fn candidates(&self, node: NodeId, heading: f64) -> Vec<Candidate> {
        let walked = |id: &EdgeId| {
            let edge = self.graph().edge(*id);
            edge.kind != EdgeKind::Elevator && edge.length_m >= SHORTEST_M && self.is_open(*id)
        };
        let on_foot = self.graph().leaving(node).filter(walked);
        let candidate = |edge: EdgeId| Candidate { edge, angle: self.angle(edge, heading) };
        let mut candidates: Vec<Candidate> = on_foot.map(candidate).collect();
        candidates.sort_by(|a, b| a.angle.total_cmp(&b.angle).then(a.edge.cmp(&b.edge)));
        candidates
    }

    /// Between an edge and a heading (Graph, 6.9). **Units:** rad.
    fn angle(&self, edge: EdgeId, heading: f64) -> f64 {
        wrapped(self.graph().edge(edge).direction - heading).abs()
    }

    fn end(&self) -> f64 {
        // A position that rounding has put beyond the end is on the edge.
        self.graph().edge(self.edge).length_m + 1e-9
    }

    /// Goes on along the edge; steps that do not fit onto it go on onto those that continue it, and those that fit onto
    /// none vanish (Graph, 6.6, the part of figure 6.15 marked with a star).
    fn lay(&mut self, metres: f64, length_m: f64) {
        self.along_m += metres;
        while self.along_m > self.end() {
            let edge = *self.graph().edge(self.edge);
            let ahead = self.candidates(edge.to, edge.direction);
            let next = ahead.first().filter(|next| next.angle < self.parameters.fit_deg.to_radians());
            let Some(next) = next.filter(|next| next.edge != edge.back) else {
                let over = ((self.along_m - edge.length_m) / length_m - 1e-9).ceil() * length_m;
                self.along_m = (self.along_m - over).clamp(0.0, edge.length_m);
                return;
            };
            self.along_m -= edge.length_m;
            self.trail.push(next.edge);
            self.reach(next.edge);
        }
    }

    /// The error grows by some steps along the edge.
    fn spread(&mut self, steps: usize, length_m: f64) {
        let direction = self.graph().edge(self.edge).direction;
        for _ in 0..steps {
            self.variance = self.variance.step(direction, length_m, &self.parameters);
        }
    }

    /// A new edge (decision IV): the deviation begins at zero.
    fn reach(&mut self, edge: EdgeId) {
        self.edge = edge;
        self.delta = 0.0;
        self.behind_end = false;
        self.half_turned = false;
        if let Some((_, edges)) = &mut self.searched {
            *edges += 1;
        }
    }
}

/// Where a case has left the position.
enum Moved {
    /// On the edge.
    On,
    /// It would be so far along it, beyond its end. **Units:** m.
    Beyond(f64),
}
