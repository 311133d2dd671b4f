//! The particle filter: from steps to a place in the building.

mod sights;

use super::Error;
use super::ancestry::{Ancestry, PastPlace};
use super::cloud::{BLOCK, Particle};
use super::cluster::{self, Cluster, Clusters};
use super::estimate::{Estimate, RoomShare, State};
use super::map::{ConnectorKind, Map};
use super::motion::{self, Moved};
use super::parameters::{Method, Parameters};
use super::random::{Purpose, Stream};
use super::resampling;
use super::start::{self, Patch, Seeded, Start};
use crate::sight::Sight;
use rayon::prelude::*;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::collections::VecDeque;
use std::sync::Arc;

/// A bin of the adaptive number of particles. **Units:** m.
const BIN_M: f32 = 0.5;
/// Headings of a bin.
const BIN_HEADINGS: usize = 16;
/// Who does not know where a walk leads does not know where it is, though it is one place still: 0.95 are 18 degrees
/// (standard deviation).
const KNOWN_HEADING: f64 = 0.95;
/// Shares of the weight below this are not told.
const LEAST_SHARE: f64 = 1e-3;
/// Most places and rooms that are told.
const MOST_TOLD: usize = 50;
/// What a step would be worth to a cloud that lies anywhere: about half of all moves meet no wall.
const ANYWHERE_LIKELIHOOD: f64 = 0.5;
/// A larger cloud is no place yet, and its past would take more room than it is worth.
const MOST_REMEMBERED: usize = 20_000;
/// What lies this near to the likeliest place belongs to it. **Units:** m.
const NEAR_M: f64 = 3.0;
/// How fast somebody may have gone whose steps are missing. **Units:** m/s.
const FASTEST_M_S: f32 = 1.8;
/// How far a missing step may have led. **Units:** m.
const LONGEST_STEP_M: f32 = 2.0;
/// Somebody who is lost is looked for this far around at first. **Units:** m.
const LOST_RADIUS_M: f32 = 15.0;
/// Whoever may have gone this far unseen may as well be on another floor. **Units:** m.
const ANYWHERE_M: f32 = 60.0;
/// Part of the weight that stays with what was believed when it counts as lost, and of the rest the part that goes to the
/// surroundings; what is left goes to everywhere.
const BELIEVED_PART: f32 = 0.1;
const AROUND_PART: f32 = 0.8;
/// Most steps that are gone through again when somebody counts as lost.
const MOST_AGAIN: usize = 16;

/// Follows a person in a building.
#[derive(Clone, Debug)]
pub struct ParticleFilter {
    map: Arc<Map>,
    parameters: Parameters,
    seed: u64,
    particles: Vec<Particle>,
    /// The other half of drawing.
    drawn: Vec<Particle>,
    clusters: Clusters,
    bins: Bins,
    ancestry: Ancestry,
    /// The past from before particles were sown anew.
    settled: Vec<PastPlace>,
    /// Counts the steps of this filter.
    number: u64,
    previous: Option<(u32, Micros)>,
    /// Index and end of the last steps that the particles have gone, oldest first.
    times: VecDeque<(u32, Micros)>,
    /// What was said of the place since the last step.
    waiting: Vec<(Micros, Sight)>,
    /// How many positions in succession contradicted what was believed.
    contradicted: usize,
    spread: Spread,
    /// Logarithm of the odds against the cloud, never below 0.
    against: f64,
    /// The last steps since these odds were 0, at most [`MOST_AGAIN`], and where the person was then.
    doubtful: VecDeque<Step>,
    undoubted: Vec<Cluster>,
    /// Steps in a row for which the place was clear.
    clear_steps: u32,
    estimate: Estimate,
}

/// The space that each particle of a sown cloud stands for; it shrinks as the cloud does.
#[derive(Clone, Copy, Debug)]
struct Spread {
    half_spacing_m: f32,
    half_sector: f32,
    /// Share of the sown space that is left.
    volume: f64,
    /// Particles that were sown.
    sown: usize,
}

impl Spread {
    fn of(seeded: &Seeded) -> Self {
        Self {
            half_spacing_m: seeded.half_spacing_m,
            half_sector: seeded.half_sector,
            volume: 1.0,
            sown: seeded.particles.len(),
        }
    }

    /// Side of the space of one of `count` particles, against that at the start.
    fn side(&self, count: usize) -> f32 {
        (self.volume * self.sown as f64 / count.max(1) as f64).cbrt().min(1.0) as f32
    }
}

impl ParticleFilter {
    /// Sows the particles.
    ///
    /// # Errors
    /// Settings out of bounds; a start that is not in the building.
    pub fn new(map: Arc<Map>, parameters: &Parameters, start: &Start, seed: u64) -> Result<Self, Error> {
        parameters.check()?;
        let seeded = start::sow(&map, start, parameters, seed)?;
        let mut filter = Self {
            parameters: parameters.clone(),
            seed,
            drawn: Vec::new(),
            clusters: Clusters::default(),
            ancestry: Ancestry::default(),
            settled: Vec::new(),
            bins: Bins::new(&map),
            map,
            number: 0,
            previous: None,
            times: VecDeque::new(),
            waiting: Vec::new(),
            contradicted: 0,
            spread: Spread::of(&seeded),
            particles: seeded.particles,
            against: 0.0,
            doubtful: VecDeque::new(),
            undoubted: Vec::new(),
            clear_steps: 0,
            estimate: Estimate::default(),
        };
        let all = filter.particles.len() as f64;
        filter.tell(None, 0, all, all, 1.0);
        Ok(filter)
    }

    /// Takes in a step; returns what is known after it. A step that is no number counts as one that is missing.
    pub fn step(&mut self, step: &Step) -> &Estimate {
        let numbers = step.displacement.iter().chain(step.covariance.iter()).chain([&step.turn]);
        if !numbers.into_iter().all(|value| value.is_finite()) {
            return &self.estimate;
        }
        self.number += 1;
        let documented = self.parameters.method == Method::Documented;
        if !documented {
            self.bridge(step);
        }
        self.previous = Some((step.index, step.stance_end));
        let mut moved = motion::advance(&mut self.particles, &self.map, step, &self.parameters, self.seed, self.number);
        let likelihood = moved.likelihood();
        let parents = if documented {
            self.draw_documented(&moved)
        } else if self.judge(likelihood, step) {
            moved = self.search_anew();
            None
        } else {
            self.draw(&moved)
        };
        self.remember(parents.as_deref(), step);
        let moved = self.weigh_waiting().unwrap_or(moved);
        self.tell(Some(step.stance_end), step.index, self.total(), moved.effective(), likelihood);
        &self.estimate
    }

    /// Steps that did not come: the person is somewhere around. The first step of all has none before it.
    fn bridge(&mut self, step: &Step) {
        let Some((index, end)) = self.previous else { return };
        let missing = step.index.saturating_sub(index.saturating_add(1));
        let restarted = step.index <= index;
        let seconds = (step.stance_start - end).max(0) as f32 * 1e-6;
        let radius = if missing > 0 {
            LONGEST_STEP_M * missing as f32
        } else if restarted || step.quality.gap {
            FASTEST_M_S * seconds
        } else {
            return;
        };
        // What a few metres hide, the noise of a few steps finds again; but the heading is gone as well.
        let leaders = self.estimate.clusters.clone();
        self.sow_around(&leaders, radius.max(2.0 * LONGEST_STEP_M));
        self.against = 0.0;
        self.doubtful.clear();
    }

    /// Whether the steps no longer fit the building from where the cloud is.
    fn judge(&mut self, likelihood: f64, step: &Step) -> bool {
        let odds = (ANYWHERE_LIKELIHOOD / likelihood.max(f64::MIN_POSITIVE)).ln();
        self.against = (self.against + odds).max(0.0);
        if self.against == 0.0 || self.doubtful.is_empty() {
            self.doubtful.clear();
            self.undoubted.clone_from(&self.estimate.clusters);
        }
        // Who searches for long may doubt for long.
        if self.doubtful.len() == MOST_AGAIN {
            self.doubtful.pop_front();
        }
        self.doubtful.push_back(*step);
        // Whoever searches everywhere cannot be lost.
        self.against > f64::from(self.parameters.lost_odds) && self.estimate.state != State::Searching
    }

    /// Looks for the person around where they were before the steps became doubtful, and goes through these steps again; what
    /// the last of them did to those that were sown.
    fn search_anew(&mut self) -> Moved {
        self.against = 0.0;
        self.clear_steps = 0;
        self.estimate.state = State::Lost;
        let steps = std::mem::take(&mut self.doubtful);
        let leaders = std::mem::take(&mut self.undoubted);
        // The cloud that is believed is here already.
        let believed = std::mem::take(&mut self.particles);
        self.sow_around(&leaders, LOST_RADIUS_M);
        let mut moved = Moved::default();
        for step in &steps {
            self.number += 1;
            moved = motion::advance(&mut self.particles, &self.map, step, &self.parameters, self.seed, self.number);
            self.draw(&moved);
        }
        self.join(believed);
        moved
    }

    /// Looks for the person in these patches, where others see them, against what is believed.
    fn search_in(&mut self, patches: &[Patch]) {
        self.against = 0.0;
        self.clear_steps = 0;
        self.doubtful.clear();
        self.estimate.state = State::Lost;
        let believed = std::mem::take(&mut self.particles);
        self.sow_in(patches);
        self.join(believed);
    }

    /// Leaves a part of the weight to what was believed before the others were sown.
    fn join(&mut self, believed: Vec<Particle>) {
        let count = self.particles.len();
        weigh(&mut self.particles, (1.0 - BELIEVED_PART) * count as f32);
        self.particles.extend(believed);
        weigh(&mut self.particles[count..], BELIEVED_PART * count as f32);
    }

    /// Sows new particles around the likeliest of `leaders` and, thinly, everywhere, in place of all there were; only
    /// everywhere, if the radius is so large that the place of the leaders says nothing.
    fn sow_around(&mut self, leaders: &[Cluster], radius: f32) {
        let leaders = if radius < ANYWHERE_M { leaders } else { &[] };
        let likely = leaders.iter().take(3).filter(|leader| leader.probability > 0.1);
        let patch = |leader: &Cluster| Patch {
            floor: leader.floor_index,
            centre: [leader.position.x as f32, leader.position.y as f32],
            radius: radius + 2.0 * leader.sigma_m() as f32,
        };
        self.sow_in(&likely.map(patch).collect::<Vec<_>>());
    }

    /// Sows new particles in these patches and, thinly, everywhere, in place of all there were.
    fn sow_in(&mut self, patches: &[Patch]) {
        let mut stream = Stream::new(self.seed, Purpose::Recover, self.number, 0);
        let mut parameters = self.parameters.clone();
        if !patches.is_empty() {
            parameters.most /= 2;
        }
        let mut around = Vec::new();
        for &patch in patches {
            around.extend(start::everywhere(&self.map, &parameters, Some(patch), &mut stream).particles);
        }
        let everywhere = start::everywhere(&self.map, &parameters, None, &mut stream);
        let mut spread = Spread::of(&everywhere);
        // Who was sown has no forebears: what is known of the past will not become better.
        self.settled = self.past();
        self.ancestry.clear();
        self.times.clear();
        self.particles = everywhere.particles;
        if !around.is_empty() {
            weigh(&mut self.particles, 1.0 - AROUND_PART);
            weigh(&mut around, AROUND_PART);
            self.particles.append(&mut around);
        }
        // Weights near 1 on average, as after drawing.
        let count = self.particles.len();
        weigh(&mut self.particles, count as f32);
        spread.sown = count;
        self.spread = spread;
    }

    /// Draws as the document does: after each step, as many as are left, but not fewer than N0 (5.24).
    fn draw_documented(&mut self, moved: &Moved) -> Option<Vec<usize>> {
        let count = moved.alive.max(self.parameters.least);
        let mut stream = Stream::new(self.seed, Purpose::Draw, self.number, 0);
        let mut parents = Vec::with_capacity(count);
        let sink = |parent| parents.push(parent);
        if resampling::draw(&self.particles, count, &mut stream, &mut self.drawn, sink) == 0 {
            return None;
        }
        std::mem::swap(&mut self.particles, &mut self.drawn);
        Some(parents)
    }

    /// Keeps the past, as soon as the cloud is small enough for it.
    fn remember(&mut self, parents: Option<&[usize]>, step: &Step) {
        if self.times.len() == sights::REMEMBERED {
            self.times.pop_front();
        }
        self.times.push_back((step.index, step.stance_end));
        if self.particles.len() > MOST_REMEMBERED {
            self.settled = self.past();
            self.ancestry.clear();
        } else {
            self.ancestry.grow(&self.particles, parents, step.index);
        }
    }

    /// Where the likeliest hypothesis has been, corrected by all that was learned since: from the first step that is
    /// remembered. While the cloud is large, nothing is added.
    pub fn past(&self) -> Vec<PastPlace> {
        self.past_of_some(usize::MAX)
    }

    /// The same by at most so many of the particles, for pictures: it takes a time for each particle and step that all of them do
    /// not share. Copies lie side by side, so that every so many of them are as good a sample as drawing makes.
    pub fn past_of_some(&self, most: usize) -> Vec<PastPlace> {
        let every = self.particles.len().div_ceil(most.max(1));
        let mut past = self.settled.clone();
        if let Some(place) = self.estimate.place() {
            let reach = NEAR_M.max(3.0 * place.sigma_m());
            past.extend(self.ancestry.past(&self.particles, every, |particle| {
                let at = nalgebra::Vector3::new(particle.x, particle.y, particle.z).map(f64::from);
                (place.position - at).norm() <= reach
            }));
        }
        past
    }

    /// Draws when too few particles carry the weight, or when fewer would do.
    fn draw(&mut self, moved: &Moved) -> Option<Vec<usize>> {
        if !(moved.after > 0.0 && moved.after.is_finite()) {
            // Nothing but what cannot be: all alike.
            self.particles.iter_mut().for_each(|particle| particle.weight = 1.0);
            return None;
        }
        let p = &self.parameters;
        let mean = moved.after / self.particles.len() as f64;
        let bins = self.bins.occupied(&self.particles, (mean * 1e-3) as f32);
        let count = resampling::needed(bins, p.kld_error).clamp(p.least, p.most);
        // More than there are come only from a cloud that has spread; a little less is not worth the drawing.
        let few = moved.effective() < f64::from(p.resample_below) * self.particles.len() as f64;
        let fewer = (count as f64) < 0.7 * self.particles.len() as f64;
        let more = count as f64 > 1.5 * self.particles.len() as f64;
        if !(few || fewer || more) {
            let factor = (1.0 / mean) as f32;
            self.particles.iter_mut().for_each(|particle| particle.weight *= factor);
            return None;
        }
        let before = self.particles.len();
        let mut stream = Stream::new(self.seed, Purpose::Draw, self.number, 0);
        let mut parents = Vec::with_capacity(count);
        let different =
            resampling::draw(&self.particles, count, &mut stream, &mut self.drawn, |parent| parents.push(parent));
        std::mem::swap(&mut self.particles, &mut self.drawn);
        // Where nearly all survive, what is drawn away is not space but only number.
        let survived = (moved.effective() / before as f64).min(1.0);
        self.spread.volume *= survived.max(different as f64 / before as f64);
        self.roughen(&parents);
        Some(parents)
    }

    /// Sets copies of one particle apart within the space that it stood for.
    fn roughen(&mut self, parents: &[usize]) {
        let share = self.parameters.roughening * self.spread.side(self.particles.len());
        let (place, sector) = (share * self.spread.half_spacing_m, share * self.spread.half_sector);
        if !(place > 1e-3 || sector > 1e-3) {
            return;
        }
        let mut stream = Stream::new(self.seed, Purpose::Roughen, self.number, 0);
        for i in 1..self.particles.len() {
            if parents[i] != parents[i - 1] {
                continue;
            }
            let particle = &mut self.particles[i];
            let from = [particle.x, particle.y];
            let to = [particle.x + place * stream.symmetric(), particle.y + place * stream.symmetric()];
            particle.heading += sector * stream.symmetric();
            // Nothing changes its room or its connector by this.
            let floor = usize::from(particle.floor);
            let connector = self.map.connector(floor, to).unwrap_or(Particle::ON_FLOOR);
            if !self.map.blocked(floor, from, to) && connector == particle.connector {
                [particle.x, particle.y] = to;
            }
        }
    }

    /// Makes the estimate.
    fn tell(&mut self, time: Option<Micros>, step: u32, total: f64, effective: f64, likelihood: f64) {
        let p = &self.parameters;
        let mut clusters = if total <= 0.0 {
            Vec::new()
        } else if p.method == Method::Documented && self.particles.len() <= p.cluster_most {
            let mut stream = Stream::new(self.seed, Purpose::Cluster, self.number, 0);
            cluster::documented(&self.particles, total, &self.map, p.cluster_m, &mut stream)
        } else {
            self.clusters.find(&self.particles, total, &self.map)
        };
        let clear = clusters.first().is_some_and(|first| {
            first.probability >= f64::from(p.located_share)
                && first.sigma_m() <= f64::from(p.located_sigma_m)
                && first.heading_agreement >= KNOWN_HEADING
        });
        self.clear_steps = if clear { self.clear_steps.saturating_add(1) } else { 0 };
        let state = self.state(&clusters);
        let (rooms, in_connectors) = self.rooms(total);
        clusters.retain(|cluster| cluster.probability >= LEAST_SHARE);
        clusters.truncate(MOST_TOLD);
        self.estimate = Estimate {
            time,
            step,
            state,
            clusters,
            rooms,
            in_connectors,
            particles: self.particles.len(),
            effective,
            likelihood,
        };
    }

    fn state(&self, clusters: &[Cluster]) -> State {
        let p = &self.parameters;
        let Some(first) = clusters.first() else { return State::Lost };
        let sure = f64::from(p.located_share);
        if p.method == Method::Documented {
            // One cluster is left (Foot, 5.6).
            return match (clusters.len(), self.particles.len() <= p.cluster_most) {
                (1, true) => State::Located,
                (_, true) => State::SeveralPlaces,
                _ => State::Searching,
            };
        }
        if self.clear_steps >= p.located_steps {
            return State::Located;
        }
        // Who was located stays so while most of the weight is still in one place of a few metres.
        let wide = 2.0 * f64::from(p.located_sigma_m);
        if self.estimate.state == State::Located && first.probability > 0.9 * sure && first.sigma_m() < wide {
            return State::Located;
        }
        let places = clusters.iter().take(5).filter(|cluster| cluster.sigma_m() < wide);
        let share: f64 = places.map(|cluster| cluster.probability).sum();
        match self.estimate.state {
            State::Lost if share < sure => State::Lost,
            _ if share >= 0.9 * sure => State::SeveralPlaces,
            _ => State::Searching,
        }
    }

    /// The share of each room, and of stairs and elevators.
    fn rooms(&self, total: f64) -> (Vec<RoomShare>, [f64; 2]) {
        let nothing = || -> Vec<Vec<f64>> {
            self.map.floors.iter().map(|floor| vec![0.0; floor.rooms.outlines().len() + 1]).collect()
        };
        let block = |particles: &[Particle]| {
            let (mut shares, mut in_connectors) = (nothing(), [0.0; 2]);
            for particle in particles {
                let floor = &self.map.floors[usize::from(particle.floor)];
                let point = [particle.x, particle.y];
                let room = floor.grid.cell(point).and_then(|cell| floor.rooms.at(cell, point));
                let shares = &mut shares[usize::from(particle.floor)];
                let place = room.map_or(shares.len() - 1, usize::from);
                shares[place] += f64::from(particle.weight);
                if let Some(joint) = self.map.connectors.get(usize::from(particle.connector)) {
                    in_connectors[usize::from(joint.kind == ConnectorKind::Elevator)] += f64::from(particle.weight);
                }
            }
            (shares, in_connectors)
        };
        // Collected in order and added in order: the sums do not depend on who was first.
        let blocks: Vec<(Vec<Vec<f64>>, [f64; 2])> = self.particles.par_chunks(BLOCK).map(block).collect();
        let (mut shares, mut in_connectors) = (nothing(), [0.0; 2]);
        for (part, in_part) in &blocks {
            shares.iter_mut().zip(part).for_each(|(shares, part)| cluster::add_all(shares, part));
            cluster::add_all(&mut in_connectors, in_part);
        }
        let mut rooms = Vec::new();
        for (floor, shares) in self.map.floors.iter().zip(&shares) {
            for (room, &weight) in shares.iter().enumerate() {
                let probability = weight / total;
                if probability >= LEAST_SHARE {
                    let room = (room + 1 < shares.len()).then_some(room as u16);
                    rooms.push(RoomShare { floor: floor.number, room, probability });
                }
            }
        }
        rooms.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        rooms.truncate(MOST_TOLD);
        (rooms, in_connectors.map(|weight| if total > 0.0 { weight / total } else { 0.0 }))
    }

    /// What is known after the last step.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// The particles as they are.
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// The map it works on.
    pub fn map(&self) -> &Arc<Map> {
        &self.map
    }
}

/// Gives all together the weight `part`, shared as it was.
fn weigh(particles: &mut [Particle], part: f32) {
    let total: f64 = particles.iter().map(|particle| f64::from(particle.weight)).sum();
    if total > 0.0 {
        let factor = (f64::from(part) / total) as f32;
        particles.iter_mut().for_each(|particle| particle.weight *= factor);
    }
}

/// Counts the bins that a cloud occupies.
#[derive(Clone, Debug)]
struct Bins {
    /// First bin, lower left corner and columns of each floor.
    floors: Vec<(usize, [f32; 2], usize, usize)>,
    /// The number of the count that saw the bin last.
    seen: Vec<u32>,
    count: u32,
}

impl Bins {
    fn new(map: &Map) -> Self {
        let mut first = 0;
        let floors = map
            .floors
            .iter()
            .map(|floor| {
                let [low, high] = floor.bounds();
                let size = |axis: usize| ((high[axis] - low[axis]) / BIN_M).ceil() as usize + 1;
                let (columns, rows) = (size(0), size(1));
                let start = first;
                first += columns * rows * BIN_HEADINGS;
                (start, low, columns, rows)
            })
            .collect();
        Self { floors, seen: vec![0; first], count: 0 }
    }

    fn occupied(&mut self, particles: &[Particle], least_weight: f32) -> usize {
        self.count = self.count.wrapping_add(1);
        if self.count == 0 {
            self.seen.fill(0);
            self.count = 1;
        }
        let mut occupied = 0;
        for particle in particles.iter().filter(|particle| particle.weight >= least_weight) {
            let (start, low, columns, rows) = self.floors[usize::from(particle.floor)];
            let place = |value: f32, low: f32, count: usize| (((value - low) / BIN_M).max(0.0) as usize).min(count - 1);
            let (column, row) = (place(particle.x, low[0], columns), place(particle.y, low[1], rows));
            let turn = (particle.heading / std::f32::consts::TAU + 0.5) * BIN_HEADINGS as f32;
            let heading = (turn.max(0.0) as usize).min(BIN_HEADINGS - 1);
            let bin = &mut self.seen[start + (row * columns + column) * BIN_HEADINGS + heading];
            occupied += usize::from(*bin != self.count);
            *bin = self.count;
        }
        occupied
    }
}
