//! The window: the last states, what joins them, and what was said of their places.

mod search;

use super::Parameters;
use super::chain::{Chain, Eliminated};
use super::held::{Belief, Held, Innovation, Spot};
use super::link::Link;
use super::state::{Column, DRIFT, HEADING, Prior, SCALE, place};
use super::verdict::{Outcome, Verdict};
use crate::fixes::Measured;
use crate::fixes::method::{Estimate, Method, Start};
use crate::fixes::observation::Observation;
use nalgebra::{Matrix2, Vector2};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// Nothing is known of a place (standard deviation). **Units:** m.
const ANYWHERE_M: f64 = 1e3;
/// Nothing is known of a direction (standard deviation). **Units:** rad.
const ANY_DIRECTION: f64 = 3.0;
/// A direction known better than this can be linearised (standard deviation). **Units:** rad.
const KNOWN_DIRECTION: f64 = 0.35;
/// Rounds of Gauss-Newton: for a position that comes to what is known, and for a beginning.
const ROUNDS: usize = 6;
const ROUNDS_ANEW: usize = 12;
/// Changes of less than this are none. **Units:** m and rad alike.
const SAME: f64 = 1e-3;
/// No round turns a heading by more. **Units:** rad.
const LARGEST_TURN: f64 = 0.6;
/// Somebody of whom no step comes for so long stands. **Units:** us.
const STANDS_US: i64 = 2_000_000;
/// No position is told to be after the last step by more. **Units:** us.
const LATEST_US: i64 = 3_600_000_000;
/// So many of the last positions are looked at.
const LOOKED_AT: usize = 10;
/// How fast somebody goes, and how far before a step must have been told. **Units:** m/s; m.
const GOES_M_S: f64 = 1.0;
const BETWEEN_M: f64 = 0.4;
/// How far a missing step may have led, and how fast somebody may have gone whose steps are missing. **Units:** m; m/s.
const MISSING_STEP_M: f64 = 2.0;
const MISSING_M_S: f64 = 1.8;

/// Where somebody was, once it is settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// When.
    pub time: Micros,
    /// **Units:** m; **Frame:** building.
    pub place: [f64; 2],
}

/// What was found out about the steps, each with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Direction of the heading frame of the last step. **Units:** rad.
    pub heading: (f64, f64),
    /// How much longer steps are than they are told, as a factor.
    pub scale: (f64, f64),
    /// **Units:** rad/s.
    pub drift: (f64, f64),
}

/// When a state was, and how it came about.
#[derive(Clone, Copy, Debug)]
struct Moment {
    time: Micros,
    /// Nobody told a step; somebody stood.
    standing: bool,
}

/// The smoother.
#[derive(Clone, Debug)]
pub struct Smoother {
    parameters: Parameters,
    start: Start,
    moments: Vec<Moment>,
    states: Vec<Column>,
    /// Between a state and the next.
    links: Vec<Link>,
    held: Vec<Held>,
    prior: Prior,
    /// Places are in the frame of the building.
    placed: bool,
    /// The heading can be linearised.
    directed: bool,
    last_index: Option<u32>,
    chain: Chain,
    known: Eliminated,
    moved: Vec<Column>,
    settled: Vec<Settled>,
    /// Whether the last positions were doubted, newest last.
    doubts: Vec<bool>,
}

impl Smoother {
    /// Its settings.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Begins; whatever is not known of the start is found out.
    pub fn new(parameters: &Parameters, start: &Start) -> Self {
        let mut sigmas =
            Column::from([ANYWHERE_M, ANYWHERE_M, ANY_DIRECTION, parameters.scale_sigma, parameters.drift_sigma]);
        let mut at = Column::zeros();
        if let Some((place, sigma)) = start.place {
            (at[0], at[1]) = (place[0], place[1]);
            (sigmas[0], sigmas[1]) = (sigma, sigma);
        }
        if let Some((direction, sigma)) = start.direction {
            at[HEADING] = direction;
            sigmas[HEADING] = sigma;
        }
        Self {
            parameters: *parameters,
            start: *start,
            moments: Vec::new(),
            states: Vec::new(),
            links: Vec::new(),
            held: Vec::new(),
            prior: Prior::of(at, sigmas),
            placed: start.place.is_some(),
            directed: start.direction.is_some_and(|(_, sigma)| sigma <= KNOWN_DIRECTION),
            last_index: None,
            chain: Chain::default(),
            known: Eliminated::default(),
            moved: Vec::new(),
            settled: Vec::new(),
            doubts: Vec::new(),
        }
    }

    /// Takes in a position or a range, and tells what became of it.
    pub fn hear(&mut self, observation: &Observation) -> Verdict {
        let verdict = |outcome| Verdict {
            source: observation.source.clone(),
            outcome,
            off_m: 0.0,
            off: Vector2::zeros(),
            normalised: 0.0,
            weight: 0.0,
        };
        self.open(observation.time);
        let (Some(first), Some(last)) = (self.moments.first(), self.moments.last()) else {
            return verdict(Outcome::TooLate(0.0));
        };
        let (first, last) = (first.time, last.time);
        if observation.time < first && self.states.len() > 1 && !self.settled.is_empty() {
            return verdict(Outcome::TooLate((first - observation.time) as f64 * 1e-6));
        }
        if observation.time - last > LATEST_US {
            return verdict(Outcome::TooEarly((observation.time - last) as f64 * 1e-6));
        }
        if observation.time - last > STANDS_US {
            self.stand(observation.time);
        }
        let mut held = Held {
            time: observation.time,
            spot: Spot { index: 0, part: 0.0 },
            measured: observation.measured,
            beyond: 0.0,
            weight: 1.0,
        };
        self.attach(&mut held);
        self.place_first(&held);
        let Innovation { off_m, normalised, right } = self.innovation(&held);
        let off = held.off(&self.states);
        // By its own standard deviation alone, what is exact would never be believed where little is known.
        held.weight = right;
        self.held.push(held);
        self.settle();
        let weight = self.held.last().map_or(0.0, |held| held.weight);
        self.doubts.push(weight < 0.5);
        if self.doubts.len() > LOOKED_AT {
            self.doubts.remove(0);
        }
        self.reconsider();
        let weight = self.held.last().map_or(weight, |held| held.weight);
        let outcome = if weight < 0.5 { Outcome::Doubted } else { Outcome::Taken };
        Verdict { source: observation.source.clone(), outcome, off_m, off, normalised, weight }
    }

    /// A first state, where none is.
    fn open(&mut self, time: Micros) {
        if self.states.is_empty() {
            self.moments.push(Moment { time, standing: false });
            self.states.push(self.prior.at);
            self.eliminate();
        }
    }

    /// Somebody stands still until now.
    fn stand(&mut self, until: Micros) {
        let Some(last) = self.moments.last() else { return };
        let link = Link::standing((until - last.time) as f64 * 1e-6, &self.parameters);
        self.push(link, Moment { time: until, standing: true });
    }

    /// Appends a state, where the link leads to.
    fn push(&mut self, link: Link, moment: Moment) {
        let Some(&before) = self.states.last() else { return };
        let after = link.predict(&before);
        let linear = link.linear(&before, &after);
        self.moments.push(moment);
        self.states.push(after);
        self.links.push(link);
        if self.known.append(&linear.before, &linear.cross, &linear.after).is_none() {
            self.eliminate();
        }
        while self.states.len() > self.parameters.window.max(2) || self.held.len() > self.parameters.most_fixes.max(1) {
            if self.states.len() <= 2 {
                self.held.remove(0);
            } else {
                self.forget_first();
            }
        }
    }

    /// Takes back that somebody stood at or after this time: a step was told of it.
    fn take_back(&mut self, from: Micros) {
        let mut back = false;
        while self.states.len() > 1 && self.moments.last().is_some_and(|last| last.standing && last.time >= from) {
            self.moments.pop();
            self.states.pop();
            self.links.pop();
            back = true;
        }
        if back {
            self.attach_after(self.states.len() - 1);
            self.eliminate();
        }
    }

    /// Where in the window a time is.
    fn attach(&self, held: &mut Held) {
        let after = self.moments.partition_point(|moment| moment.time <= held.time);
        let index = after.saturating_sub(1);
        let seconds = |from: Micros, to: Micros| (to - from) as f64 * 1e-6;
        let from = self.moments[index].time;
        match self.moments.get(index + 1) {
            Some(next) if held.time > from => {
                held.spot = Spot { index, part: seconds(from, held.time) / seconds(from, next.time) };
                held.beyond = 0.0;
            }
            _ => {
                held.spot = Spot { index, part: 0.0 };
                let way = (GOES_M_S * seconds(from, held.time).abs()).min(BETWEEN_M);
                held.beyond = 0.5 * way * way;
            }
        }
    }

    /// The same anew for all that belong to this state or later ones; whether there are any.
    fn attach_after(&mut self, index: usize) -> bool {
        let mut held = std::mem::take(&mut self.held);
        let mut any = false;
        for held in held.iter_mut().filter(|held| held.spot.index >= index) {
            self.attach(held);
            any = true;
        }
        self.held = held;
        any
    }

    /// Lays the path on the first position of all.
    fn place_first(&mut self, held: &Held) {
        let Measured::Position { place: said, .. } = held.measured else { return };
        if self.placed {
            return;
        }
        self.placed = true;
        let shift = Vector2::from(said) - place(&self.states[held.spot.index]);
        let shift = Column::from([shift.x, shift.y, 0.0, 0.0, 0.0]);
        self.states.iter_mut().for_each(|state| *state += shift);
        self.prior.at += shift;
    }

    /// How far off something is from what is known without it.
    fn innovation(&self, held: &Held) -> Innovation {
        let Spot { index, part } = held.spot;
        let covariances = self.known.covariances(index);
        let corner = |block: &super::state::Block| block.fixed_view::<2, 2>(0, 0).into_owned();
        let Some((own, cross)) = covariances.last() else { return Innovation::default() };
        let mut covariance = corner(own) * (1.0 - part) * (1.0 - part);
        if let Some((next, _)) = covariances.len().checked_sub(2).and_then(|at| covariances.get(at)) {
            let both = corner(cross);
            covariance += corner(next) * (part * part) + (both + both.transpose()) * (part * (1.0 - part));
        }
        held.innovation(&self.states, &covariance, &self.parameters)
    }

    /// Finds the states that fit best.
    fn settle(&mut self) {
        if !self.placed {
            self.find_place();
        } else if self.directed {
            // The first with what the last is worth by all that was known before it.
            self.newton();
            self.rounds(Belief::Settled, ROUNDS);
        } else {
            self.find_direction();
        }
    }

    /// Gauss-Newton from where the states are.
    fn rounds(&mut self, belief: Belief, most: usize) {
        for _ in 0..most {
            for held in &mut self.held {
                held.weigh(&self.states, belief, &self.parameters);
            }
            if self.newton().is_none_or(|largest| largest < SAME) {
                break;
            }
        }
    }

    /// One step of Gauss-Newton; the largest change, unless the states are not determined.
    fn newton(&mut self) -> Option<f64> {
        if !self.eliminate() {
            return None;
        }
        let mut moved = std::mem::take(&mut self.moved);
        self.known.solve(&mut moved);
        let turn = moved.iter().map(|moved| moved[HEADING].abs()).fold(0.0, f64::max);
        let part = if turn > LARGEST_TURN { LARGEST_TURN / turn } else { 1.0 };
        let mut largest = 0.0_f64;
        for (state, moved) in self.states.iter_mut().zip(&moved) {
            *state += moved * part;
            largest = largest.max(moved.amax());
        }
        self.moved = moved;
        Some(largest)
    }

    /// Builds and eliminates the normal equations; whether they are determined.
    fn eliminate(&mut self) -> bool {
        let count = self.states.len();
        self.chain.clear(count);
        if count == 0 {
            return false;
        }
        self.chain.diagonal[0] += self.prior.information;
        self.chain.right[0] -= self.prior.gradient(&self.states[0]);
        for (index, link) in self.links.iter().enumerate() {
            let linear = link.linear(&self.states[index], &self.states[index + 1]);
            self.chain.diagonal[index] += linear.before;
            self.chain.diagonal[index + 1] += linear.after;
            self.chain.beside[index] += linear.cross;
            self.chain.right[index] -= linear.gradient_before;
            self.chain.right[index + 1] -= linear.gradient_after;
        }
        let Chain { diagonal, beside, right } = &mut self.chain;
        for held in &self.held {
            held.add(&self.states, diagonal, beside, right);
        }
        self.chain.eliminate(&mut self.known).is_some()
    }

    /// Cost of all, outliers being what they are.
    fn cost(&self) -> f64 {
        let links = self.links.iter().enumerate();
        let links: f64 = links.map(|(index, link)| link.cost(&self.states[index], &self.states[index + 1])).sum();
        let held: f64 = self.held.iter().map(|held| held.cost(&self.states, &self.parameters)).sum();
        links + held + self.states.first().map_or(0.0, |first| self.prior.cost(first))
    }

    /// Forgets the oldest state; what is known of it goes to the next.
    fn forget_first(&mut self) {
        self.settled.push(Settled { time: self.moments[0].time, place: [self.states[0][0], self.states[0][1]] });
        if self.directed || self.start.place.is_some() {
            self.prior = self.marginal();
        } else {
            // Nothing was known but what the beginning looked like; the next is no worse a beginning.
            self.prior = self.anywhere(self.states[1]);
        }
        self.moments.remove(0);
        self.states.remove(0);
        self.links.remove(0);
        self.held.retain(|held| held.spot.index > 0);
        self.held.iter_mut().for_each(|held| held.spot.index -= 1);
        self.known.forget_first();
    }

    /// Nothing is known of a state but what steps usually are.
    fn anywhere(&self, state: Column) -> Prior {
        let p = &self.parameters;
        let sigmas = Column::from([ANYWHERE_M, ANYWHERE_M, ANY_DIRECTION, p.scale_sigma, p.drift_sigma]);
        Prior::of(state, sigmas)
    }

    /// What is known of the second state from the first and all before, at the states as they are.
    fn marginal(&self) -> Prior {
        let mut chain = Chain::default();
        chain.clear(2);
        let linear = self.links[0].linear(&self.states[0], &self.states[1]);
        chain.diagonal[0] += self.prior.information + linear.before;
        chain.diagonal[1] += linear.after;
        chain.beside[0] += linear.cross;
        chain.right[0] -= self.prior.gradient(&self.states[0]) + linear.gradient_before;
        chain.right[1] -= linear.gradient_after;
        for held in self.held.iter().filter(|held| held.spot.index == 0) {
            held.add(&self.states[..2], &mut chain.diagonal, &mut chain.beside, &mut chain.right);
        }
        chain.reduced(self.states[1])
    }

    /// The place and the scale are kept; where the walk leads is not known any more.
    fn begin_anew(&mut self, time: Micros, radius_m: f64) {
        let Some(estimate) = self.state_of_last() else { return };
        let (last, covariance) = estimate;
        let settled = self.moments.iter().zip(&self.states);
        self.settled.extend(settled.map(|(moment, state)| Settled { time: moment.time, place: [state[0], state[1]] }));
        let sigma = |index: usize| covariance[(index, index)].max(0.0).sqrt();
        let place = if self.placed { sigma(0).hypot(sigma(1)).hypot(radius_m) } else { ANYWHERE_M };
        let sigmas = Column::from([place, place, ANY_DIRECTION, sigma(SCALE), sigma(DRIFT)]);
        self.prior = Prior::of(last, sigmas);
        self.moments = vec![Moment { time, standing: false }];
        self.states = vec![last];
        self.links.clear();
        self.held.clear();
        self.doubts.clear();
        self.directed = false;
        self.eliminate();
    }

    fn state_of_last(&self) -> Option<(Column, super::state::Block)> {
        let last = self.states.len().checked_sub(1)?;
        let (covariance, _) = *self.known.covariances(last).first()?;
        Some((self.states[last], covariance))
    }

    /// What was found out about the steps.
    pub fn calibration(&self) -> Option<Calibration> {
        let (state, covariance) = self.state_of_last()?;
        let sigma = |index: usize| covariance[(index, index)].max(0.0).sqrt();
        let scale = state[SCALE].exp();
        Some(Calibration {
            heading: (state[HEADING], sigma(HEADING)),
            scale: (scale, scale * sigma(SCALE)),
            drift: (state[DRIFT], sigma(DRIFT)),
        })
    }

    /// What is settled since this was last asked.
    pub fn take_settled(&mut self) -> Vec<Settled> {
        std::mem::take(&mut self.settled)
    }

    /// What is still open, oldest first, as it is known now.
    pub fn open_part(&self) -> Vec<Estimate> {
        let covariances = self.known.covariances(0);
        let moments = self.moments.iter().zip(&self.states).zip(covariances.iter().rev());
        let told = moments.map(|((moment, state), (covariance, _))| estimate(moment.time, state, covariance));
        if self.placed { told.collect() } else { Vec::new() }
    }
}

fn estimate(time: Micros, state: &Column, covariance: &super::state::Block) -> Estimate {
    let covariance: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into_owned();
    Estimate { time, place: [state[0], state[1]], covariance }
}

impl Method for Smoother {
    fn step(&mut self, step: &Step) {
        let numbers = step.displacement.iter().chain(step.covariance.iter()).chain([&step.turn]);
        if !numbers.into_iter().all(|value| value.is_finite()) {
            return;
        }
        // The first state is where the first step begins.
        self.open(Micros(step.stance_start.0 - 1));
        self.take_back(step.stance_end);
        if let ([first], true) = (&mut self.moments[..], self.last_index.is_none())
            && first.time >= step.stance_end
        {
            // A position was heard before the steps that had been made by then.
            first.time = Micros(step.stance_start.0 - 1);
        }
        let missing = self.last_index.map(|last| step.index.wrapping_sub(last).wrapping_sub(1));
        self.last_index = Some(step.index);
        let Some(last) = self.moments.last().map(|last| last.time) else { return };
        let seconds = ((step.stance_end - last).max(1)) as f64 * 1e-6;
        match missing {
            None | Some(0) if !step.quality.gap => {}
            Some(missing) => {
                let restarted = missing > u32::MAX / 2;
                let by_steps = if restarted { 0.0 } else { MISSING_STEP_M * f64::from(missing) };
                self.begin_anew(Micros(step.stance_end.0 - 1), by_steps.max(MISSING_M_S * seconds.min(60.0)));
            }
            None => {}
        }
        let end = Micros(step.stance_end.0.max(self.moments.last().map_or(0, |last| last.time.0 + 1)));
        let before = self.states.len() - 1;
        self.push(Link::of(step, seconds, &self.parameters), Moment { time: end, standing: false });
        if self.attach_after(before.min(self.states.len() - 2)) && self.directed {
            // What was said between two steps belongs between them.
            self.rounds(Belief::Settled, ROUNDS);
        }
    }

    fn observe(&mut self, observation: &Observation) {
        self.hear(observation);
    }

    fn estimate(&self) -> Option<Estimate> {
        let (state, covariance) = self.state_of_last()?;
        let time = self.moments.last()?.time;
        self.placed.then(|| estimate(time, &state, &covariance))
    }
}
