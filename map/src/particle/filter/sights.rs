//! What other sources say of the place: it counts where the particles were when it was measured.

use super::ParticleFilter;
use crate::particle::estimate::{Estimate, State};
use crate::particle::motion::Moved;
use crate::particle::parameters::Method;
use crate::particle::start::Patch;
use crate::sight::{STANDS_US, Seen, Sight};
use sohle_shared::time::Micros;

/// Steps whose times are remembered. Nobody's word is later.
pub(super) const REMEMBERED: usize = 120;
/// How fast somebody goes, and how far before a step must have been told. **Units:** m/s; m.
const GOES_M_S: f64 = 1.4;
const BETWEEN_M: f64 = 0.4;
/// When so many positions in succession fit nothing that is believed, the person is looked for around the last.
const CONTRADICTED: usize = 3;
/// Nothing that is older counts where the past of the particles is not remembered. **Units:** s.
const OLDEST_S: f64 = 5.0;

impl ParticleFilter {
    /// Takes in what another source says of the place at a time; returns what is known with it. What was measured since the last
    /// step counts with the next, which tells where in between; what was measured before counts where each particle was then. A
    /// floor that is not in the building is not heard.
    pub fn sight(&mut self, sight: &Sight, time: Micros) -> &Estimate {
        match self.times.back() {
            Some(&(_, last)) if time > last && time - last < STANDS_US => self.waiting.push((time, *sight)),
            _ => {
                if let Some(moved) = self.weigh_at(sight, time) {
                    let (time, step, likelihood) = (self.estimate.time, self.estimate.step, self.estimate.likelihood);
                    self.tell(time, step, self.total(), moved.effective(), likelihood);
                }
            }
        }
        &self.estimate
    }

    /// Takes in what has waited for the step that has just been made; what the last of it did to the particles.
    pub(super) fn weigh_waiting(&mut self) -> Option<Moved> {
        let waiting = std::mem::take(&mut self.waiting);
        waiting.iter().filter_map(|(time, sight)| self.weigh_at(sight, *time)).last()
    }

    /// Weighs the particles by where they were, and draws; nothing for what is too old.
    fn weigh_at(&mut self, sight: &Sight, time: Micros) -> Option<Moved> {
        let floor = sight.floor.and_then(|number| self.map.floor(number));
        let seconds = |from: Micros, to: Micros| (to - from) as f64 * 1e-6;
        let after = self.times.partition_point(|&(_, end)| end < time);
        let last = self.times.back().map_or(time, |&(_, end)| end);
        let before = after.checked_sub(1).and_then(|before| self.times.get(before));
        let moved = match (before, self.times.get(after)) {
            (Some(&(from, began)), Some(&(to, ended))) => {
                let part = seconds(began, time) / seconds(began, ended).max(1e-6);
                let spots = self.ancestry.between(from, to, part as f32);
                match spots.filter(|spots| spots.len() == self.particles.len()) {
                    Some(spots) => sight.weigh(&mut self.particles, Some(&spots), floor),
                    None => self.weigh_now(sight, floor, seconds(time, last))?,
                }
            }
            (None, Some(_)) => self.weigh_now(sight, floor, seconds(time, last))?,
            (_, None) => {
                let way = (GOES_M_S * seconds(last, time)).min(BETWEEN_M);
                sight.within(0.5 * way * way).weigh(&mut self.particles, None, floor)
            }
        };
        self.number += 1;
        let moved = if self.contradicts(sight, &moved) { self.search_where_seen(sight, floor) } else { moved };
        let parents = match self.parameters.method {
            Method::Documented => self.draw_documented(&moved),
            Method::Covariance => self.draw(&moved),
        };
        if let Some(parents) = parents {
            self.ancestry.redraw(&parents);
        }
        Some(moved)
    }

    /// Whether it is time to believe others more than the cloud.
    fn contradicts(&mut self, sight: &Sight, moved: &Moved) -> bool {
        let all = matches!(self.parameters.method, Method::Covariance) && self.estimate.state != State::Searching;
        // Nothing fits when all weights are those of an outlier.
        let fits = moved.after > 2.0 * sight.odds() * moved.before;
        if !matches!(sight.seen, Seen::Place(..)) || !all || fits {
            self.contradicted = 0;
            return false;
        }
        self.contradicted += 1;
        self.contradicted >= CONTRADICTED
    }

    /// Sows around a place that others tell of, and weighs by it.
    fn search_where_seen(&mut self, sight: &Sight, floor: Option<usize>) -> Moved {
        self.contradicted = 0;
        if let Some(([x, y], radius)) = sight.around() {
            let patch = |floor| Patch { floor, centre: [x as f32, y as f32], radius: radius as f32 };
            let floors = floor.map_or(0..self.map.floors().count(), |floor| floor..floor + 1);
            self.search_in(&floors.map(patch).collect::<Vec<_>>());
        }
        sight.weigh(&mut self.particles, None, floor)
    }

    /// Weighs the particles by where they are, though it was measured before: somebody may have gone anywhere since.
    fn weigh_now(&mut self, sight: &Sight, floor: Option<usize>, age_s: f64) -> Option<Moved> {
        let gone = GOES_M_S * age_s;
        (age_s < OLDEST_S).then(|| sight.within(0.5 * gone * gone).weigh(&mut self.particles, None, floor))
    }

    /// Sum of the weights.
    pub(super) fn total(&self) -> f64 {
        self.particles.iter().map(|particle| f64::from(particle.weight)).sum()
    }
}
