//! The document's evaluation (Foot, chapter 7) on simulated walks in a twin of its building.

use super::follow::{Followed, Said, dead_reckoned, follow};
use super::walk::{Walk, Walker};
use crate::building::{self, Building, generate};
use crate::particle::{self, Map, Parameters, Start, StartPlace};
use crate::simulation::{Leg, Person, Route};
use rayon::prelude::*;
use std::sync::Arc;

/// Why a suite did not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A walk could not be made.
    #[error(transparent)]
    Building(#[from] building::Error),
    /// The filter refused.
    #[error(transparent)]
    Particle(#[from] particle::Error),
}

/// A distribution of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Errors {
    /// How many.
    pub count: usize,
    /// **Units:** m.
    pub mean_m: f64,
    /// 75th percentile. **Units:** m.
    pub p75_m: f64,
    /// 95th percentile. **Units:** m.
    pub p95_m: f64,
    /// **Units:** m.
    pub worst_m: f64,
}

impl Errors {
    /// Of these; all zero for none.
    pub fn of(mut errors: Vec<f64>) -> Self {
        errors.sort_by(f64::total_cmp);
        let Some(&worst_m) = errors.last() else { return Self::default() };
        let at = |share: f64| errors[((share * errors.len() as f64).ceil() as usize).clamp(1, errors.len()) - 1];
        let mean_m = errors.iter().sum::<f64>() / errors.len() as f64;
        Self { count: errors.len(), mean_m, p75_m: at(0.75), p95_m: at(0.95), worst_m }
    }
}

/// The marked way of the document's evaluation: along both wings of a floor, through rooms and the hall, and back.
const MARKED_WAY: [&str; 7] = ["W01", "W04", "W08", "hall", "E03", "E07", "E05"];

/// One person on the marked way.
#[derive(Clone, Debug, serde::Serialize)]
pub struct KnownRow {
    /// Who, and in which direction.
    pub walk: String,
    /// Stances and metres.
    pub stances: usize,
    /// **Units:** m.
    pub length_m: f64,
    /// Steps alone, with start and heading given (table 7.3).
    pub steps_alone: Errors,
    /// Documented, default: as it was said at the time (table 7.2).
    pub live: [Errors; 2],
    /// Default: as it was said while it was located.
    pub located: Errors,
    /// Default: as it was known at the end.
    pub corrected: Errors,
}

/// Documented and default.
fn both(default: &Parameters) -> [Parameters; 2] {
    [Parameters::documented(), default.clone()]
}

pub(super) fn start_of(walk: &Walk, floor: i32) -> Start {
    let place = walk.truth.first().map_or([0.0; 2], |truth| [truth.x as f32, truth.y as f32]);
    Start::At(vec![StartPlace::exactly(floor, place)])
}

fn twin(floors: i32) -> Result<(Building, Arc<Map>), Error> {
    let building = generate::twin(floors);
    let map = Arc::new(Map::of(&building)?);
    Ok((building, map))
}

/// Tables 7.2 and 7.3: three people, forwards and backwards, start known, heading unknown.
///
/// # Errors
/// When a walk cannot be made.
pub fn known(default: &Parameters, seed: u64) -> Result<Vec<KnownRow>, Error> {
    let (building, map) = twin(2)?;
    let backwards: Vec<_> = MARKED_WAY.iter().rev().copied().collect();
    let ways = [("forwards", MARKED_WAY.to_vec()), ("backwards", backwards)];
    let cases: Vec<_> = Person::all()
        .into_iter()
        .zip(["a", "b", "c"])
        .flat_map(|(person, name)| ways.clone().map(|(direction, way)| (person, name, direction, way)))
        .enumerate()
        .collect();
    let row = |(index, (person, name, direction, way)): (usize, (Person, &str, &str, Vec<&str>))| {
        let seed = seed.wrapping_mul(100).wrapping_add(index as u64);
        let walk = Walk::through(&building, &way, &Walker { person, seed })?;
        let [documented, default] = both(default);
        let said = |parameters| follow(&map, parameters, &start_of(&walk, 0), (&walk.steps, &walk.truth), seed);
        let (documented, default) = (said(&documented)?, said(&default)?);
        let errors = |followed: &Followed| Errors::of(followed.said.iter().map(|said| said.error_m).collect());
        Ok(KnownRow {
            walk: format!("{name} {direction}"),
            stances: walk.steps.len(),
            length_m: walk.length(),
            steps_alone: Errors::of(dead_reckoned(&walk)),
            live: [errors(&documented), errors(&default)],
            located: Errors::of(default.located_errors()),
            corrected: Errors::of(default.corrected_m),
        })
    };
    cases.into_par_iter().map(row).collect()
}

/// What one walk of the document's other tests has shown.
#[derive(Clone, Debug, serde::Serialize)]
pub struct OtherRow {
    /// Which test.
    pub test: &'static str,
    /// Documented or default.
    pub settings: &'static str,
    /// Share of the steps whose floor was right. **Units:** %.
    pub floor_right_percent: f64,
    /// Errors over all steps.
    pub live: Errors,
    /// Errors of the last ten steps.
    pub end: Errors,
    /// When it was first located. **Units:** s.
    pub located_s: Option<f64>,
    /// Places left at the end.
    pub clusters: usize,
    /// Particles after the start, and after 1, 2, 5 and 10 steps.
    pub particles: Vec<usize>,
}

/// Elevator (7.4), ten minutes in a large room (7.5), unknown start (7.6), stairs of a symmetric building (7.7).
///
/// # Errors
/// When a walk cannot be made.
pub fn others(default: &Parameters, seed: u64) -> Result<Vec<OtherRow>, Error> {
    let (building, map) = twin(2)?;
    let walker = Walker { person: Person::default(), seed };
    let hall = Walk::along(&around_the_hall(&building)?, &walker)?;
    let through = |stops: &[&str]| Walk::through(&building, stops, &walker);
    // Once up and down in one wing: nothing tells it from the other.
    let stairs = through(&["corridor-W0", "stairs-W", "corridor-W1", "stairs-W", "corridor-W0"])?;
    let tests = [
        ("elevator", through(&["W03", "elevator", "E13", "elevator", "W02"])?, true),
        ("10 min in the hall", hall, true),
        ("unknown start", through(&["W02", "W08", "hall", "E04"])?, false),
        ("symmetric stairs", stairs, false),
    ];
    let row = |(test, walk, known): &(&'static str, Walk, bool), settings, parameters: &Parameters| {
        let start = if *known { start_of(walk, 0) } else { Start::Anywhere };
        let followed = follow(&map, parameters, &start, (&walk.steps, &walk.truth), seed)?;
        let errors = |said: &[Said]| Errors::of(said.iter().map(|said| said.error_m).collect());
        let said = &followed.said;
        let right = said.iter().filter(|said| said.floor_right).count();
        Ok::<_, Error>(OtherRow {
            test,
            settings,
            floor_right_percent: 100.0 * right as f64 / said.len().max(1) as f64,
            live: errors(said),
            end: errors(&said[said.len().saturating_sub(10)..]),
            located_s: followed.located_s(),
            clusters: said.last().map_or(0, |said| said.clusters),
            particles: [0, 1, 2, 5, 10].iter().filter_map(|&at| said.get(at)).map(|said| said.particles).collect(),
        })
    };
    let [documented, default] = both(default);
    tests
        .par_iter()
        .map(|test| Ok([row(test, "documented", &documented)?, row(test, "default", &default)?]))
        .collect::<Result<Vec<_>, Error>>()
        .map(|rows| rows.into_iter().flatten().collect())
}

/// Ten minutes around the hall, then into an office and back to the start.
fn around_the_hall(building: &Building) -> Result<Route, Error> {
    let mut route = Route::through(building, &building::route::plan(building, &["hall", "W04", "hall"])?)?;
    let [x, y, _] = route.start;
    // A figure of eight, 44 m a round at some 1.2 m/s.
    let round = [[23.0, 3.0], [29.5, 6.0], [29.5, 12.0], [24.0, 13.0], [23.5, 9.0], [29.0, 2.5]];
    let mut legs: Vec<Leg> = (0..16).map(|_| Leg::with_gait(crate::simulation::Gait::Walk, round.to_vec())).collect();
    legs.push(Leg::walk(x, y));
    legs.append(&mut route.legs);
    route.legs = legs;
    Ok(route)
}
