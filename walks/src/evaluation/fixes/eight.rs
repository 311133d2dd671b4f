//! The recorded walk along an eight, with positions as 5G would tell them.

use super::figures::{Figures, live};
use crate::evaluation::phone::path::{Path, rms};
use crate::evaluation::phone::suite::START_SIGMA_M;
use crate::evaluation::phone::walk::{Error, PhoneWalk};
use crate::fixes::adjustment::Adjustment;
use crate::fixes::extended::Extended;
use crate::fixes::kalman::Kalman;
use crate::fixes::{Documented, Measured, Observation, Outliers, Smoother, smoother};
use crate::follow::sight;
use crate::graph::draw::{self, draw};
use crate::graph::matcher::{self, Matcher};
use crate::graph::{self, Graph};
use crate::particle::{self, ParticleFilter, StartPlace};
use crate::phone;
use crate::phone::sample::WayPoint;
use rayon::prelude::*;
use sohle_shared::step::Step;

/// How well the positions of the walk are known (standard deviation of each coordinate): they were simulated with it.
/// **Units:** m.
const SIGMA_M: f64 = 1.8;
/// How well the direction of the start is known, from the first leg of 17 m (standard deviation). **Units:** rad.
const DIRECTION_SIGMA: f64 = 0.1;
/// Rates of positions, and every which of the recorded two in a second is kept for it. **Units:** Hz.
const RATES: [(f64, usize); 5] = [(2.0, 1), (1.0, 2), (0.2, 10), (0.1, 20), (1.0 / 30.0, 60)];
/// People stamp a way-point when they have passed it, or before; so much later. The first is as it was stamped.
/// **Units:** us.
const LATE_US: [i64; 10] = [0, -200_000, -100_000, 100_000, 200_000, 300_000, 400_000, 500_000, 600_000, 700_000];
/// The particle filter is random and slow: so many beginnings of the thinning, with so many seeds each.
const PARTICLE_PHASES: usize = 3;
const PARTICLE_SEEDS: u64 = 2;
/// Of all beginnings of the thinning, so many at most, evenly.
const MOST_PHASES: usize = 10;
/// Without a start nothing is to be found at less. **Units:** Hz.
const LEAST_RATE_HZ: f64 = 0.05;

/// One method at one rate of positions.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// Place and direction of the start known, or nothing.
    pub start: &'static str,
    /// **Units:** Hz.
    pub rate_hz: f64,
    /// Which.
    pub method: &'static str,
    /// Errors at the way-points, of up to ten beginnings of the thinning together.
    pub figures: Figures,
    /// How much later than the person was there the way-points would be stamped, if the path were right: what fits best.
    /// **Units:** s.
    pub late_s: f64,
    /// Root mean square error with that taken away. **Units:** m.
    pub timed_m: f64,
}

impl Row {
    fn of(start: &'static str, rate_hz: f64, method: &'static str, mut errors: Vec<Vec<f64>>) -> Self {
        let timed = errors.iter().enumerate().filter_map(|(index, errors)| Some((index, rms(errors)?)));
        let (index, timed_m) = timed.min_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or_default();
        let late_s = LATE_US[index] as f64 * 1e-6;
        Self { start, rate_hz, method, figures: Figures::of(std::mem::take(&mut errors[0])), late_s, timed_m }
    }
}

/// Errors of several paths together, for each of [`LATE_US`].
fn together(found: Vec<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new(); LATE_US.len()];
    for errors in found {
        all.iter_mut().zip(errors).for_each(|(all, errors)| all.extend(errors));
    }
    all
}

/// What is compared on the walk.
#[derive(Debug)]
pub struct Comparison<'a> {
    walk: &'a PhoneWalk,
    steps: Vec<Step>,
    observations: Vec<Observation>,
    /// Direction of the first heading frame along the first leg. **Units:** rad.
    direction: Option<f64>,
    graph: Graph,
}

impl<'a> Comparison<'a> {
    /// Finds the steps, and draws the walk graph of the floor.
    ///
    /// # Errors
    /// When the graph is of no use.
    pub fn of(walk: &'a PhoneWalk, parameters: &phone::Parameters) -> Result<Self, graph::Error> {
        let mut building = walk.building.clone();
        building.graph = Some(draw(&building, &draw::Parameters::default()));
        let steps = phone::steps(&walk.samples, parameters);
        let said = walk.positions.iter().map(|said| Observation::position(said.time, said.place, SIGMA_M));
        let direction = Path::of(&steps).on_first_leg(&walk.way_points).map(|(_, direction)| direction);
        Ok(Self { walk, observations: said.collect(), steps, direction, graph: Graph::of(&building)? })
    }

    /// All methods at all rates.
    ///
    /// # Errors
    /// When the particle filter refuses.
    pub fn rows(&self, particle: &particle::Parameters, seed: u64) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::new();
        let alone = self.errors(Path::of(&self.steps).on_first_leg(&self.walk.way_points).map(|(path, _)| path));
        rows.push(Row::of("known", 0.0, "steps alone", alone));
        for (start, known) in [("known", true), ("unknown", false)] {
            for (rate_hz, every) in RATES.into_iter().filter(|&(rate, _)| known || rate >= LEAST_RATE_HZ) {
                let mut push = |method, errors| {
                    rows.push(Row::of(start, rate_hz, method, errors));
                };
                let of_all = |path: &(dyn Fn(&[Observation]) -> Path + Sync)| {
                    let phase = |phase| self.errors(Some(path(&self.thinned(every, phase))));
                    let count = every.min(MOST_PHASES);
                    let phases = (0..count).into_par_iter().map(|number| number * every / count);
                    together(phases.map(phase).collect())
                };
                let documented = Documented::default();
                let start = self.start(known);
                push("kalman", of_all(&|said| live(&mut Kalman::new(&documented, &start), &self.steps, said)));
                push("extended", of_all(&|said| live(&mut Extended::new(&documented, &start), &self.steps, said)));
                push(
                    "least squares",
                    of_all(&|said| live(&mut Adjustment::new(&documented, &start), &self.steps, said)),
                );
                push("smoother", of_all(&|said| self.smoothed(known, said)[0].clone()));
                push("smoother, corrected", of_all(&|said| self.smoothed(known, said)[1].clone()));
                if known {
                    let [said, corrected] = self.on_the_map(every, particle, seed)?;
                    push("map", said);
                    push("map, corrected", corrected);
                    let matched = |said: &[Observation]| self.matched(said).unwrap_or_default();
                    push("graph", of_all(&matched));
                }
            }
        }
        Ok(rows)
    }

    /// The walk by each method, for a picture: positions at this rate, start known.
    pub fn paths(&self, rate_hz: f64) -> Vec<(&'static str, Path)> {
        let every = RATES.iter().find(|(rate, _)| *rate == rate_hz).map_or(1, |&(_, every)| every);
        let said = self.thinned(every, 0);
        let (documented, start) = (Documented::default(), self.start(true));
        let alone = Path::of(&self.steps).on_first_leg(&self.walk.way_points).map(|(path, _)| path);
        let [_, corrected] = self.smoothed(true, &said);
        let positions = said.iter().filter_map(|said| match said.measured {
            Measured::Position { place, .. } => Some((said.time, place)),
            Measured::Range { .. } => None,
        });
        vec![
            ("positions", Path(positions.collect())),
            ("steps alone", alone.unwrap_or_default()),
            ("Kalman", live(&mut Kalman::new(&documented, &start), &self.steps, &said)),
            ("extended Kalman", live(&mut Extended::new(&documented, &start), &self.steps, &said)),
            ("least squares", live(&mut Adjustment::new(&documented, &start), &self.steps, &said)),
            ("smoother", corrected),
            ("way-points", Path(self.walk.way_points.iter().map(|point| (point.time, point.place)).collect())),
        ]
    }

    fn start(&self, known: bool) -> crate::fixes::Start {
        let first = self.walk.way_points.first().filter(|_| known);
        crate::fixes::Start {
            place: first.map(|point| (point.place, f64::from(START_SIGMA_M))),
            direction: self.direction.filter(|_| known).map(|direction| (direction, DIRECTION_SIGMA)),
        }
    }

    fn thinned(&self, every: usize, phase: usize) -> Vec<Observation> {
        self.observations.iter().skip(phase).step_by(every).cloned().collect()
    }

    /// Errors at the way-points, for each of [`LATE_US`].
    fn errors(&self, path: Option<Path>) -> Vec<Vec<f64>> {
        let path = path.unwrap_or_default();
        let earlier = |late_us: i64| -> Vec<_> {
            self.walk.way_points.iter().map(|point| WayPoint { time: point.time + -late_us, ..*point }).collect()
        };
        LATE_US.map(|late_us| path.errors(&earlier(late_us))).to_vec()
    }

    /// As it was said, and as it was corrected.
    fn smoothed(&self, known: bool, said: &[Observation]) -> [Path; 2] {
        let mut smoother = Smoother::new(&smoother::Parameters::phone(), &self.start(known));
        let live = live(&mut smoother, &self.steps, said);
        let mut corrected = Path::default();
        smoother.take_settled().iter().for_each(|settled| corrected.note(settled.time, settled.place));
        smoother.open_part().iter().for_each(|open| corrected.note(open.time, open.place));
        [live, corrected]
    }

    /// Steps, positions and the plan in the particle filter: errors as it was said, and as it was corrected.
    fn on_the_map(
        &self,
        every: usize,
        particle: &particle::Parameters,
        seed: u64,
    ) -> Result<[Vec<Vec<f64>>; 2], Error> {
        let phases = every.min(PARTICLE_PHASES);
        let runs: Vec<_> = (0..phases).flat_map(|phase| (0..PARTICLE_SEEDS).map(move |seed| (phase, seed))).collect();
        let run = |&(phase, number): &(usize, u64)| -> Result<[Vec<Vec<f64>>; 2], Error> {
            let said = self.thinned(every, phase * every / phases);
            let paths = self.followed(&said, particle, seed.wrapping_add(number))?;
            Ok(paths.map(|path| self.errors(Some(path))))
        };
        let found = runs.par_iter().map(run).collect::<Result<Vec<_>, _>>()?;
        Ok([0, 1].map(|kind| together(found.iter().map(|errors| errors[kind].clone()).collect())))
    }

    /// Steps, positions and the walk graph in the matcher, as it is said; nothing of a walk without a first leg.
    fn matched(&self, said: &[Observation]) -> Option<Path> {
        let place = matcher::Place {
            floor: self.walk.floor,
            place: self.walk.way_points.first()?.place,
            sigma_m: f64::from(START_SIGMA_M),
            heading: Some((self.direction?, DIRECTION_SIGMA)),
        };
        let start = matcher::Start::At(vec![place]);
        let mut matcher = Matcher::new(&self.graph, &matcher::Parameters::phone(), &start).ok()?;
        let mut path = Path::default();
        let mut waiting = said.iter().peekable();
        for step in &self.steps {
            while let Some(observation) = waiting.next_if(|observation| observation.time < step.stance_end) {
                matcher.sight(&sight(observation, &Outliers::default()), observation.time);
            }
            if let Some(place) = matcher.step(step).place() {
                path.note(step.stance_end, place.position);
            }
        }
        Some(path)
    }

    fn followed(&self, said: &[Observation], p: &particle::Parameters, seed: u64) -> Result<[Path; 2], Error> {
        let (Some(first), Some(direction)) = (self.walk.way_points.first(), self.direction) else {
            return Ok(Default::default());
        };
        let start = particle::Start::At(vec![StartPlace {
            floor: self.walk.floor,
            place: first.place.map(|value| value as f32),
            sigma_m: START_SIGMA_M,
            heading: Some((direction as f32, DIRECTION_SIGMA as f32)),
        }]);
        let mut filter = ParticleFilter::new(self.walk.map.clone(), p, &start, seed)?;
        let mut path = Path::default();
        let mut waiting = said.iter().peekable();
        for step in &self.steps {
            while let Some(observation) = waiting.next_if(|observation| observation.time < step.stance_end) {
                filter.sight(&sight(observation, &Outliers::default()), observation.time);
            }
            filter.step(step);
            if let Some(place) = filter.estimate().place() {
                path.note(step.stance_end, [place.position.x, place.position.y]);
            }
        }
        let time_of = |index: u32| self.steps.iter().find(|step| step.index == index).map(|step| step.stance_end);
        let mut corrected = Path::default();
        for past in filter.past() {
            if let Some(time) = time_of(past.step) {
                corrected.note(time, [past.position[0], past.position[1]]);
            }
        }
        Ok([path, corrected])
    }
}
