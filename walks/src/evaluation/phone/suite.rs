//! Dead reckoning and the particle filter on the walks with a phone.

use super::path::{Path, rms};
use super::walk::{Error, PhoneWalk};
use crate::particle::{Map, Parameters, ParticleFilter, Start, StartPlace, State};
use crate::phone::{self, length::Length, sample::WayPoint};
use rayon::prelude::*;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::sync::Arc;

/// How well somebody knows where a walk begins (standard deviation). **Units:** m.
pub const START_SIGMA_M: f32 = 0.3;
/// And in which direction, from the first leg. **Units:** rad.
const START_HEADING_SIGMA: f32 = 0.2;

/// Whoever starts from anywhere needs a hundred times the particles: not all seeds are run.
const UNKNOWN_SEEDS: usize = 3;

/// What the particle filter made of one walk.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Found {
    /// As it was said at the time: root mean square error at the way-points from `located_s` on. **Units:** m.
    pub live_m: Option<f64>,
    /// As it was known at the end, at all way-points whose past is remembered. **Units:** m.
    pub corrected_m: Option<f64>,
    /// When it first said that it knew. **Units:** s.
    pub located_s: Option<f64>,
}

/// A line of the table.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// The walk.
    pub walk: &'static str,
    /// Straight from way-point to way-point. **Units:** m.
    pub way_m: f64,
    /// How many were found.
    pub steps: usize,
    /// Steps alone, start and heading from the first leg: root mean square error at the way-points. **Units:** m.
    pub first_leg_m: Option<f64>,
    /// Steps alone, laid where they fit best. **Units:** m.
    pub fitted_m: Option<f64>,
    /// The same two with the step length of the document. **Units:** m.
    pub documented_m: [Option<f64>; 2],
    /// Start and heading of the first leg known; errors at all way-points.
    pub known: Found,
    /// Start unknown on the floor, if it is searched.
    pub unknown: Option<Found>,
}

/// Follows all walks. Each seed of the filter runs; errors are the root mean square over the seeds.
///
/// # Errors
/// When the filter refuses.
pub fn run(
    walks: &[PhoneWalk],
    (phone, particle): (&phone::Parameters, &Parameters),
    seeds: &[u64],
) -> Result<Vec<Row>, Error> {
    walks.par_iter().map(|walk| row(walk, phone, particle, seeds)).collect()
}

fn row(walk: &PhoneWalk, phone: &phone::Parameters, particle: &Parameters, seeds: &[u64]) -> Result<Row, Error> {
    let steps = phone::steps(&walk.samples, phone);
    let points = &walk.way_points;
    let path = Path::of(&steps);
    let laid = path.on_first_leg(points);
    let places: Vec<_> = points.iter().map(|point| point.place).collect();
    let start = match (points.first(), &laid) {
        (Some(first), Some((_, heading))) => Start::At(vec![StartPlace {
            floor: walk.floor,
            place: first.place.map(|value| value as f32),
            sigma_m: START_SIGMA_M,
            heading: Some((*heading as f32, START_HEADING_SIGMA)),
        }]),
        _ => Start::Anywhere,
    };
    let over_seeds = |start: &Start, from_start: bool, count: usize| {
        let found = seeds
            .iter()
            .take(count)
            .map(|&seed| follow(&walk.map, particle, start, &steps, points, (seed, from_start)));
        found.collect::<Result<Vec<_>, _>>().map(|found| together(&found))
    };
    let documented =
        Path::of(&phone::steps(&walk.samples, &phone::Parameters { length: Length::documented(), ..phone.clone() }));
    Ok(Row {
        walk: walk.name,
        way_m: crate::alignment::path_length(&places),
        steps: steps.len(),
        first_leg_m: laid.and_then(|(path, _)| path.rmse(points)),
        fitted_m: path.fitted_rmse(points),
        documented_m: [
            documented.on_first_leg(points).and_then(|(path, _)| path.rmse(points)),
            documented.fitted_rmse(points),
        ],
        known: over_seeds(&start, true, usize::MAX)?,
        unknown: walk.search.then(|| over_seeds(&Start::Anywhere, false, UNKNOWN_SEEDS)).transpose()?,
    })
}

/// Means over the seeds; a walk counts as located when it was with every seed.
fn together(found: &[Found]) -> Found {
    let all = |pick: fn(&Found) -> Option<f64>| found.iter().map(pick).collect::<Option<Vec<f64>>>();
    Found {
        live_m: all(|found| found.live_m).and_then(|errors| rms(&errors)),
        corrected_m: all(|found| found.corrected_m).and_then(|errors| rms(&errors)),
        located_s: all(|found| found.located_s).map(|times| times.iter().sum::<f64>() / times.len() as f64),
    }
}

/// One walk with one seed.
fn follow(
    map: &Arc<Map>,
    parameters: &Parameters,
    start: &Start,
    steps: &[Step],
    points: &[WayPoint],
    (seed, from_start): (u64, bool),
) -> Result<Found, Error> {
    let mut filter = ParticleFilter::new(map.clone(), parameters, start, seed)?;
    let mut said = Path::default();
    let mut located: Option<Micros> = None;
    for step in steps {
        let estimate = filter.step(step);
        if let Some(place) = estimate.place() {
            said.0.push((step.stance_end, [place.position.x, place.position.y]));
        }
        if estimate.state == State::Located && located.is_none() {
            located = Some(step.stance_end);
        }
    }
    let time_of = |index: u32| steps.iter().find(|step| step.index == index).map(|step| step.stance_end);
    let past = filter.past();
    let corrected = past.iter().filter_map(|past| Some((time_of(past.step)?, [past.position[0], past.position[1]])));
    let corrected = Path(corrected.collect());
    let from = if from_start { points.first().map(|point| point.time) } else { located };
    let since = |from: Option<Micros>| -> Vec<WayPoint> {
        points.iter().filter(|point| from.is_some_and(|from| point.time >= from)).copied().collect()
    };
    let remembered = if from_start { from } else { corrected.0.first().map(|point| point.0) };
    let begin = steps.first().map_or(0, |step| step.stance_end.0);
    Ok(Found {
        live_m: said.rmse(&since(from)),
        corrected_m: corrected.rmse(&since(remembered)),
        located_s: located.map(|located| (located.0 - begin) as f64 * 1e-6),
    })
}
