//! The matcher: several hypotheses on the graph at once, each with its probability.
//!
//! The documented [`tracker`](crate::graph::tracker) decides at every step for one edge and cannot take a wrong turn back. Here
//! each hypothesis is a place in the plane with a direction and a step scale, all with their covariance, that is tied to a
//! way of the graph. A step moves it freely; then it may be on each way that it can have reached, and becomes one hypothesis
//! for each that fits. How far beside the way it is, how far beyond its ends, how far from its direction and how far above it
//! weighs the hypothesis and corrects it. So drift of the heading and wrong step lengths are corrected by every corridor and
//! every turn, a corner may be cut, and on a net over an open area one walks where one likes. Of hypotheses that have come to
//! the same place on the same way the likeliest is kept, and those that are hopeless are given up: their number is that of
//! the places that are possible. When none fits any more, new ones are sown around.
//!
//! Positions of other sources weigh and correct the hypotheses too ([`Matcher::sight`]); when several of them in succession say that
//! somebody is elsewhere, new hypotheses are sown there.
//!
//! Nothing is drawn at random: equal steps give equal results. A step costs about a quarter of a millisecond while few places
//! are possible, whatever the size of the graph: only ways that can have been reached are looked at. From an unknown start
//! it looks at all ways at first, which takes some 50 microseconds for each directed edge and step, until the first turns
//! have left few of them. Where many places look alike an unknown start is not always found, and a wrong place may be told
//! with confidence until it no longer fits: the particle filter knows walls and is better at it.
//!
//! # Source
//! Graph, 7.2 and 7.5, for what the document's tracker lacks. Multiple hypotheses: Reid, An Algorithm for Tracking Multiple
//! Targets (1979); likeliest sequence of edges: Newson and Krumm, Hidden Markov Map Matching (2009).
//!
//! # Example
//! ```
//! use sohle_map::building::{Node, WalkGraph};
//! use sohle_map::graph::Graph;
//! use sohle_map::graph::matcher::{Matcher, Parameters, Place, Start};
//!
//! let node = |x, y| Node { place: [x, y], ..Node::default() };
//! let drawn = WalkGraph { nodes: vec![node(0.0, 0.0), node(5.0, 0.0), node(5.0, 5.0)], edges: vec![[0, 1], [1, 2]] };
//! let graph = Graph::new(&drawn, &[])?;
//! let place = Place { floor: 0, place: [0.0, 0.2], sigma_m: 0.3, heading: Some((0.0, 0.2)) };
//! let matcher = Matcher::new(&graph, &Parameters::default(), &Start::At(vec![place]))?;
//! let here = &matcher.estimate().places[0];
//! assert!(here.probability > 0.99 && here.position[0].abs() < 1e-9);
//! # Ok::<(), sohle_map::graph::Error>(())
//! ```

mod estimate;
mod hypothesis;
mod net;
mod parameters;
mod sights;
mod start;
#[cfg(test)]
mod tests;

pub use estimate::{Estimate, Likely};
pub use parameters::Parameters;
pub use start::{Place, Start};

use super::{EdgeKind, Error, Graph};
use crate::building::geometry::Point;
use hypothesis::{Hypothesis, Move, Moved};
use net::{Net, Reached};
use sights::Past;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::borrow::Borrow;

/// Missing steps: how fast somebody may have gone meanwhile, how far in one of them, and how far at most. **Units:** m/s, m.
const FASTEST_M_S: f64 = 1.5;
const MISSING_M: f64 = 1.5;
const FARTHEST_M: f64 = 60.0;
/// How well the direction is known then. **Units:** rad.
const MISSING_HEADING: f64 = 0.5;
/// Sown hypotheses look as the best does, to within this. **Units:** rad.
const SOWN_HEADING: f64 = 0.3;
/// They are sown on ways so near to the height of the best. **Units:** m.
const SAME_HEIGHT_M: f64 = 1.5;
/// Nodes within this of the height of a floor are on it. **Units:** m.
const LEVEL_M: f64 = 0.1;
/// Hypotheses are put together as if none was less well known. **Units:** m.
const MERGE_SIGMA_M: f64 = 1.0;
/// Shorter steps tell no direction. **Units:** m.
const MOVES_M: f64 = 0.2;

/// Follows somebody on a graph with several hypotheses.
///
/// The graph is borrowed, or shared by who keeps the matcher (`G` is then `Arc<Graph>`).
#[derive(Clone, Debug)]
pub struct Matcher<G> {
    graph: G,
    parameters: Parameters,
    net: Net,
    hypotheses: Vec<Hypothesis>,
    /// More are not kept, if that is more than the setting. **Units:** none.
    most_now: usize,
    /// Whether heights count, and the sum of all rises. **Units:** m.
    with_heights: bool,
    height_m: f64,
    /// The hypotheses know in which direction the steps count.
    turned: bool,
    /// What the best loses in each metre (logarithm of odds).
    loss: f64,
    last: Option<(u32, Micros)>,
    past: Past,
    estimate: Estimate,
    /// Kept from step to step, so that nothing is allocated.
    work: Work,
}

#[derive(Clone, Debug, Default)]
struct Work {
    moved: Vec<Moved>,
    /// Which has moved, where it may be, and how likely that is.
    children: Vec<(u32, Reached, f64)>,
    reached: Vec<Reached>,
    open: Vec<(super::NodeId, f64, f64)>,
}

impl<G: Borrow<Graph>> Matcher<G> {
    /// Somebody begins.
    ///
    /// # Errors
    /// When a setting is out of its bounds, or the graph has no way on the floor where somebody is to begin.
    pub fn new(graph: G, parameters: &Parameters, start: &Start) -> Result<Self, Error> {
        parameters.check().map_err(Error::Setting)?;
        let net = Net::of(graph.borrow(), [parameters.fork, parameters.open_fork]);
        let mut hypotheses = Vec::new();
        match start {
            Start::Anywhere => hypotheses = start::anywhere(&net, parameters),
            Start::At(places) => {
                for place in places {
                    let floor = |way: &net::Way| way.is_on(place.floor);
                    let begun = start::at(&net, place, floor, parameters);
                    if begun.is_empty() {
                        return Err(Error::NoFloor(place.floor));
                    }
                    hypotheses.extend(begun);
                }
            }
        }
        if hypotheses.is_empty() {
            return Err(Error::None);
        }
        let mut matcher = Self {
            graph,
            parameters: *parameters,
            net,
            most_now: 4 * hypotheses.len(),
            hypotheses,
            with_heights: false,
            height_m: 0.0,
            turned: false,
            loss: 0.0,
            last: None,
            past: Past::default(),
            estimate: Estimate::default(),
            work: Work::default(),
        };
        matcher.estimate = matcher.estimated(0, 0);
        Ok(matcher)
    }

    /// Takes in how high the steps go, as a phone's barometer or a shoe tells it. Without this floors change where stairs
    /// lead, and by elevator after a while without steps.
    pub fn with_heights(mut self) -> Self {
        self.with_heights = true;
        for hypothesis in &mut self.hypotheses {
            hypothesis.offset_m = -hypothesis.height_m(&self.net, None);
            hypothesis.offset_m2 = self.parameters.height_m * self.parameters.height_m;
        }
        self
    }

    /// What is known.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// Takes in a step of any source; returns what is known then. A step with a value that is no number changes nothing.
    pub fn step(&mut self, step: &Step) -> &Estimate {
        let numbers = step.displacement.iter().chain(step.covariance.iter()).chain([&step.turn]);
        if !numbers.into_iter().all(|value| value.is_finite()) {
            return &self.estimate;
        }
        let mut sown = self.bridge(step);
        self.height_m += f64::from(step.displacement.z);
        // What is not measured is told with a variance that says so.
        let known = self.with_heights && step.covariance[(2, 2)] < 1.0;
        let by = Move::new(step, known.then_some(self.height_m), &self.parameters);
        if !self.turned && by.length_m > MOVES_M {
            let direction = f64::from(step.displacement.y).atan2(f64::from(step.displacement.x));
            self.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.mean[2] -= direction);
            self.turned = true;
        }
        let elevator = known || self.waited(step);
        let best = self.advance(&by, elevator.then_some(self.parameters.elevator));
        self.merge(best);
        let part = (by.length_m / self.parameters.doubt_over_m).min(1.0);
        if by.length_m > MOVES_M {
            self.loss += part * (-best / by.length_m - self.loss);
        }
        if self.loss > self.parameters.doubt {
            sown += self.sow(self.parameters.sow_m);
            self.loss = 0.0;
        }
        self.last = Some((step.index, step.stance_end));
        self.past.add(step, &by);
        sown += self.weigh_waiting();
        self.estimate = self.estimated(step.index, sown);
        &self.estimate
    }

    /// Whether so much time has gone by without a step that somebody may have been carried.
    fn waited(&self, step: &Step) -> bool {
        let waited = |(_, time): (u32, Micros)| (step.stance_end - time) as f64 * 1e-6 >= self.parameters.elevator_s;
        self.last.is_some_and(waited)
    }

    /// Steps that are missing: less is known. Tells how many hypotheses were sown.
    fn bridge(&mut self, step: &Step) -> usize {
        let Some((index, time)) = self.last else { return 0 };
        let missing = step.index.wrapping_sub(index).saturating_sub(1).min(1_000);
        if missing == 0 && !step.quality.gap {
            return 0;
        }
        let seconds = (step.stance_end - time).max(0) as f64 * 1e-6;
        let far = (FASTEST_M_S * seconds).min(if missing > 0 { MISSING_M * f64::from(missing) } else { f64::INFINITY });
        let far = far.min(FARTHEST_M);
        self.past.forget();
        for hypothesis in &mut self.hypotheses {
            hypothesis.blur(0.5 * far, MISSING_HEADING);
        }
        self.sow(far)
    }

    /// Moves all hypotheses, and lists on which ways they may be. Returns the weight of the best.
    fn advance(&mut self, by: &Move, elevator: Option<f64>) -> f64 {
        let Work { moved, children, reached, open } = &mut self.work;
        moved.clear();
        children.clear();
        let mut best = f64::NEG_INFINITY;
        let slack = self.parameters.slack_m + by.length_m;
        for hypothesis in &self.hypotheses {
            let number = moved.len() as u32;
            let next = hypothesis.moved(by, &self.net, &self.parameters);
            let along = self.net.way(hypothesis.way).project(hypothesis.place())[0];
            let reach = slack + hypothesis.sigma_m().min(self.parameters.slack_m);
            self.net.reached(hypothesis.way, along, reach, elevator, open, reached);
            for &reached in &*reached {
                let weight = next.weight_on(self.net.way(reached.way), reached.cost, &self.parameters);
                best = best.max(weight);
                if weight > best - self.parameters.given_up {
                    children.push((number, reached, weight));
                }
            }
            moved.push(next);
        }
        best
    }

    /// Makes hypotheses of where those before may be: of those on one way that are near to each other the likeliest.
    fn merge(&mut self, best: f64) {
        let p = &self.parameters;
        let Work { moved, children, .. } = &mut self.work;
        children.retain(|(_, _, weight)| *weight > best - p.given_up);
        // From an unknown start it takes a while until few are possible.
        let most = p.most.max(self.most_now);
        if children.len() > most {
            children.select_nth_unstable_by(most, |a, b| b.2.total_cmp(&a.2).then((a.0, a.1.way).cmp(&(b.0, b.1.way))));
            children.truncate(most);
        }
        children.sort_unstable_by(|a, b| a.1.way.cmp(&b.1.way).then(b.2.total_cmp(&a.2)).then(a.0.cmp(&b.0)));
        self.hypotheses.clear();
        let turned = p.merge_deg.to_radians();
        // Where those of the same way begin.
        let mut first = 0;
        for &(number, reached, _) in &*children {
            let moved = &moved[number as usize];
            if self.hypotheses.last().is_some_and(|last| last.way != reached.way) {
                first = self.hypotheses.len();
            }
            let merged = self.hypotheses[first..].iter().any(|kept| {
                let near_m = p.merge_m.max(p.merge_sigmas * kept.sigma_m().min(MERGE_SIGMA_M));
                near(kept, &moved.mean, near_m, turned)
            });
            if !merged {
                let mut new = moved.on(reached.way, self.net.way(reached.way), reached.cost, p);
                new.weight -= best;
                self.hypotheses.push(new);
            }
        }
        self.most_now = (p.fewer * self.most_now as f64) as usize;
    }

    /// Sows hypotheses around the best. Tells how many.
    fn sow(&mut self, radius_m: f64) -> usize {
        let place = self.best().map(Hypothesis::place);
        place.map_or(0, |place| self.sow_around(place, radius_m, None))
    }

    fn best(&self) -> Option<&Hypothesis> {
        self.hypotheses.iter().max_by(|a, b| a.weight.total_cmp(&b.weight))
    }

    /// Sows hypotheses around a place, on a floor or at the height of the best: they look where it looks, or along the way they
    /// are on. Tells how many.
    fn sow_around(&mut self, place: Point, radius_m: f64, floor: Option<i32>) -> usize {
        let Some(best) = self.best().cloned() else { return 0 };
        let measured = self.with_heights.then_some(self.height_m);
        let height = best.height_m(&self.net, measured);
        let before = self.hypotheses.len();
        for number in self.net.near(place, radius_m) {
            let way = self.net.way(number);
            let [low, high] = way.heights(0.5 * way.length_m);
            let there = match floor {
                Some(floor) => way.is_on(floor),
                None => height - high <= SAME_HEIGHT_M && low - height <= SAME_HEIGHT_M,
            };
            if way.kind == EdgeKind::Elevator || !there {
                continue;
            }
            let middle = way.at(0.5 * way.length_m);
            let sigma = (way.length_m / 12.0_f64.sqrt()).max(self.parameters.aside_m);
            let variance = [[sigma * sigma, 0.0], [0.0, sigma * sigma]];
            let looks = start::headings(way).into_iter().chain([(best.mean[2], SOWN_HEADING)]);
            for heading in looks {
                let mut new = Hypothesis::new(number, (middle, variance), heading, self.parameters.scale);
                (new.offset_m, new.offset_m2) = match (floor, measured) {
                    (Some(_), Some(measured)) => (measured - low, self.parameters.height_m.powi(2)),
                    _ => (best.offset_m, best.offset_m2),
                };
                self.hypotheses.push(new);
            }
        }
        let sown = &mut self.hypotheses[before..];
        let each = self.parameters.sown + (sown.len().max(1) as f64).ln();
        sown.iter_mut().for_each(|new| new.weight = -each.min(self.parameters.given_up - 1.0));
        self.most_now = self.most_now.max(2 * sown.len());
        sown.len()
    }
}

/// Whether a place with a direction is near to a hypothesis. **Units:** m, rad.
fn near(kept: &Hypothesis, other: &nalgebra::Vector4<f64>, near_m: f64, turned: f64) -> bool {
    let off = [kept.mean[0] - other[0], kept.mean[1] - other[1]];
    if off[0] * off[0] + off[1] * off[1] > near_m * near_m {
        return false;
    }
    let turn = kept.mean[2] - other[2];
    let turn = turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
    turn.abs() < turned
}
