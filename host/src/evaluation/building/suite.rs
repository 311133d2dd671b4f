//! Walks in generated buildings, put together to figures.

use super::follow::{Followed, Said, dead_reckoned, follow};
use super::walk::{Walk, Walker};
use crate::building::{self, Building, generate};
use crate::particle::{self, Map, Parameters, Start, StartPlace, State};
use crate::simulation::{Leg, Person, Route};
use nalgebra::Vector3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use rayon::prelude::*;
use sohle_shared::step::Step;
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

/// A place is wrong when it is further from the truth than this. **Units:** m.
pub const WRONG_M: f64 = 3.0;

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

fn start_of(walk: &Walk, floor: i32) -> Start {
    let place = walk.truth.first().map_or([0.0; 2], |truth| [truth.x as f32, truth.y as f32]);
    Start::At(vec![StartPlace::exactly(floor, place)])
}

fn twin(floors: i32) -> Result<(Building, Arc<Map>), Error> {
    let building = generate::twin(floors);
    let map = Arc::new(Map::of(&building)?);
    Ok((building, map))
}

/// Three floors of offices, 1 920 m² each, no two rooms alike.
fn offices() -> Result<(Building, Arc<Map>), Error> {
    let building = generate::offices("Offices", 3, 2, 60.0, 1);
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

/// Figures over many walks from an unknown start.
#[derive(Clone, Debug, serde::Serialize)]
pub struct UnknownRow {
    /// Documented or default.
    pub settings: &'static str,
    /// How many walks.
    pub walks: usize,
    /// Located within 60 s. **Units:** %.
    pub located_60_s_percent: f64,
    /// Located at all. **Units:** %.
    pub located_percent: f64,
    /// Walks that were first called located at a wrong place. **Units:** %.
    pub wrongly_percent: f64,
    /// Errors of all moments that were called located.
    pub located: Errors,
    /// Floor right, of those moments. **Units:** %.
    pub floor_right_percent: f64,
    /// How often a probability of the likeliest room was right.
    pub reliability: Vec<Reliability>,
}

/// How often it was right when it said a probability.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Reliability {
    /// Lower bound of the probability. **Units:** %.
    pub from_percent: f64,
    /// Upper bound. **Units:** %.
    pub to_percent: f64,
    /// Moments.
    pub moments: usize,
    /// Mean probability said. **Units:** %.
    pub said_percent: f64,
    /// How often it was right. **Units:** %.
    pub right_percent: f64,
}

/// Random ways on three floors: from room to room, over stairs and with elevators.
fn random_stops(building: &Building, rooms: usize, seed: u64) -> Vec<String> {
    let mut random = Pcg64Mcg::new(u128::from(seed) << 1 | 1);
    let mut pick = move |count: usize| (random.next_u32() as usize) % count.max(1);
    let mut stops: Vec<String> = Vec::new();
    let mut floor = pick(building.floors.len());
    for _ in 0..rooms {
        if !stops.is_empty() {
            // Half of the ways change the floor.
            let next = if pick(2) == 0 { floor } else { pick(building.floors.len()) };
            if next != floor {
                stops.push(["stairs", "elevator"][usize::from(pick(4) == 0)].to_owned());
                floor = next;
            }
        }
        let here = &building.floors[floor].rooms;
        stops.push(here[pick(here.len())].name.clone());
    }
    stops
}

/// Random walks through so many rooms of three floors.
///
/// # Errors
/// When a walk cannot be made.
pub fn random_walks(count: usize, rooms: usize, seed: u64, done: impl Fn() + Sync) -> Result<Vec<Walk>, Error> {
    let (building, _) = offices()?;
    let people = Person::all();
    let walk = |index: usize| {
        let seed = seed.wrapping_mul(10_000).wrapping_add(index as u64);
        let stops = random_stops(&building, rooms, seed);
        let stops: Vec<&str> = stops.iter().map(String::as_str).collect();
        let walk = Walk::through(&building, &stops, &Walker { person: people[index % people.len()], seed })?;
        done();
        Ok(walk)
    };
    (0..count).into_par_iter().map(walk).collect()
}

/// Follows each of the walks from anywhere.
///
/// # Errors
/// When the filter refuses.
pub fn unknown(
    settings: &'static str,
    parameters: &Parameters,
    walks: &[Walk],
    done: impl Fn() + Sync,
) -> Result<UnknownRow, Error> {
    let (_, map) = offices()?;
    let one = |(index, walk): (usize, &Walk)| {
        let followed = follow(&map, parameters, &Start::Anywhere, (&walk.steps, &walk.truth), index as u64)?;
        done();
        Ok(followed)
    };
    let followed: Vec<Followed> = walks.par_iter().enumerate().map(one).collect::<Result<_, Error>>()?;
    let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
    let first: Vec<&Said> =
        followed.iter().filter_map(|followed| followed.said.iter().find(|said| said.state == State::Located)).collect();
    let said: Vec<&Said> = followed.iter().flat_map(|followed| &followed.said).collect();
    let located: Vec<&&Said> = said.iter().filter(|said| said.state == State::Located).collect();
    Ok(UnknownRow {
        settings,
        walks: walks.len(),
        located_60_s_percent: percent(first.iter().filter(|said| said.seconds <= 60.0).count(), walks.len()),
        located_percent: percent(first.len(), walks.len()),
        wrongly_percent: percent(
            first.iter().filter(|said| said.error_m > WRONG_M || !said.floor_right).count(),
            walks.len(),
        ),
        located: Errors::of(located.iter().map(|said| said.error_m).collect()),
        floor_right_percent: percent(located.iter().filter(|said| said.floor_right).count(), located.len()),
        reliability: reliability(&said),
    })
}

fn reliability(said: &[&Said]) -> Vec<Reliability> {
    const BOUNDS: [f64; 9] = [0.0, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95, 0.99, 1.0];
    BOUNDS
        .windows(2)
        .map(|bounds| {
            let last = bounds[1] == 1.0;
            let here: Vec<_> = said
                .iter()
                .map(|said| said.room)
                .filter(|(share, _)| *share >= bounds[0] && (*share < bounds[1] || last))
                .collect();
            let mean = |sum: f64| if here.is_empty() { 0.0 } else { 100.0 * sum / here.len() as f64 };
            Reliability {
                from_percent: 100.0 * bounds[0],
                to_percent: 100.0 * bounds[1],
                moments: here.len(),
                said_percent: mean(here.iter().map(|(share, _)| share).sum()),
                right_percent: mean(here.iter().filter(|(_, right)| *right).count() as f64),
            }
        })
        .collect()
}

/// Figures over walks that were disturbed.
#[derive(Clone, Debug, serde::Serialize)]
pub struct LostRow {
    /// How.
    pub disturbance: &'static str,
    /// Documented or default.
    pub settings: &'static str,
    /// How many walks.
    pub walks: usize,
    /// Right again, and said so, within 30 s and within 60 s. **Units:** %.
    pub back_30_s_percent: f64,
    /// **Units:** %.
    pub back_60_s_percent: f64,
    /// Moments called located at a wrong place after 60 s. **Units:** %.
    pub wrongly_percent: f64,
}

/// Walks of which a part is missing: the filter is told nothing of 10 m, or of two minutes.
///
/// # Errors
/// When the filter refuses.
pub fn lost(
    settings: &'static str,
    parameters: &Parameters,
    walks: &[Walk],
    done: impl Fn() + Sync,
) -> Result<Vec<LostRow>, Error> {
    let (_, map) = offices()?;
    let disturbances: [(&'static str, Disturb); 2] = [("10 m unnoticed", teleported), ("2 min missing", holed)];
    let mut rows = Vec::new();
    for (disturbance, disturb) in disturbances {
        let one = |(index, walk): (usize, &Walk)| {
            let Some((steps, truth, from)) = disturb(walk) else { return Ok(None) };
            let floor = map.floors().min_by(|a, b| off(a.1, truth[0].z).total_cmp(&off(b.1, truth[0].z)));
            let start = start_of(walk, floor.map_or(0, |(number, _)| number));
            let followed = follow(&map, parameters, &start, (&steps, &truth), index as u64)?;
            done();
            Ok(Some(followed.said[from..].to_vec()))
        };
        let said: Vec<Vec<Said>> =
            walks.par_iter().enumerate().map(one).collect::<Result<Vec<_>, Error>>()?.into_iter().flatten().collect();
        let right = |said: &Said| said.state == State::Located && said.error_m < WRONG_M && said.floor_right;
        let back = |within: f64| {
            let found = |said: &&Vec<Said>| {
                said.iter().any(|moment| moment.seconds - said[0].seconds <= within && right(moment))
            };
            100.0 * said.iter().filter(found).count() as f64 / said.len().max(1) as f64
        };
        let late: Vec<&Said> =
            said.iter().flat_map(|said| said.iter().filter(|moment| moment.seconds - said[0].seconds > 60.0)).collect();
        let wrong = late.iter().filter(|said| said.state == State::Located && !right(said)).count();
        rows.push(LostRow {
            disturbance,
            settings,
            walks: said.len(),
            back_30_s_percent: back(30.0),
            back_60_s_percent: back(60.0),
            wrongly_percent: 100.0 * wrong as f64 / late.len().max(1) as f64,
        });
    }
    Ok(rows)
}

/// Makes of a walk the steps that are told, their truth, and from which of them on the filter may be lost; nothing of a
/// walk that is too short.
type Disturb = fn(&Walk) -> Option<(Vec<Step>, Vec<Vector3<f64>>, usize)>;

fn off(height: f32, z: f64) -> f64 {
    (f64::from(height) - z).abs()
}

/// The steps of 10 m in the middle are not told, and the index says nothing of it.
fn teleported(walk: &Walk) -> Option<(Vec<Step>, Vec<Vector3<f64>>, usize)> {
    let from = walk.steps.len() / 3;
    let gone = |to: usize| (walk.truth[to] - walk.truth[from]).norm();
    let to = (from..walk.steps.len()).find(|&to| gone(to) > 10.0)?;
    if walk.steps.len() - to < 20 {
        return None;
    }
    let (mut steps, mut truth) = (walk.steps[..=from].to_vec(), walk.truth[..=from].to_vec());
    for (step, place) in walk.steps[to + 1..].iter().zip(&walk.truth[to + 1..]) {
        steps.push(Step { index: step.index - (to - from) as u32, ..*step });
        truth.push(*place);
    }
    Some((steps, truth, from + 1))
}

/// Two minutes in the middle are not told; the index shows it. What is left of a short walk is repeated after it.
fn holed(walk: &Walk) -> Option<(Vec<Step>, Vec<Vector3<f64>>, usize)> {
    let from = walk.steps.len() / 4;
    let end = walk.steps[from].stance_end.0 + 120_000_000;
    let to = (from..walk.steps.len()).find(|&to| walk.steps[to].stance_end.0 > end)?;
    if walk.steps.len() - to < 30 {
        return None;
    }
    let keep = |range: std::ops::Range<usize>| (walk.steps[range.clone()].to_vec(), walk.truth[range].to_vec());
    let ((mut steps, mut truth), (later, places)) = (keep(0..from + 1), keep(to..walk.steps.len()));
    steps.extend(later);
    truth.extend(places);
    Some((steps, truth, from + 1))
}
