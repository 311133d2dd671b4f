//! Walks from an unknown start, and walks of which a part is missing, in generated buildings of three floors.

use super::follow::{Followed, Said, follow};
use super::suite::{Error, Errors, start_of};
use super::walk::{Walk, Walker};
use crate::building::{Building, generate};
use crate::particle::{Map, Parameters, Start, State};
use crate::simulation::Person;
use nalgebra::Vector3;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use rayon::prelude::*;
use sohle_shared::step::Step;
use std::sync::Arc;

/// A place is wrong when it is further from the truth than this. **Units:** m.
pub const WRONG_M: f64 = 3.0;

/// How long a walk must go on after a disturbance. **Units:** us.
const LEFT_US: i64 = 75_000_000;

/// Where walks take place.
#[derive(Clone, Debug)]
pub struct Site {
    /// Name for tables.
    pub name: &'static str,
    building: Building,
    map: Arc<Map>,
}

impl Site {
    /// Three floors of 860 m² that differ, as those of most buildings do.
    ///
    /// # Errors
    /// None; the building is the project's own.
    pub fn institute() -> Result<Self, Error> {
        Self::of("institute", generate::institute())
    }

    /// Three floors of offices, 1 920 m² each: corridors and staircases repeat in each floor and mirror each other, only the
    /// widths of the rooms differ. The hardest case, where many places look alike for minutes.
    ///
    /// # Errors
    /// None; the building is the project's own.
    pub fn offices() -> Result<Self, Error> {
        Self::of("offices", generate::offices("Offices", 3, 2, 60.0, 1))
    }

    fn of(name: &'static str, building: Building) -> Result<Self, Error> {
        let map = Arc::new(Map::of(&building)?);
        Ok(Self { name, building, map })
    }
}

/// Figures over many walks from an unknown start.
#[derive(Clone, Debug, serde::Serialize)]
pub struct UnknownRow {
    /// Where.
    pub site: &'static str,
    /// Documented or default.
    pub settings: &'static str,
    /// How many walks.
    pub walks: usize,
    /// Located within 60 s. **Units:** %.
    pub located_60_s_percent: f64,
    /// Located within 120 s. **Units:** %.
    pub located_120_s_percent: f64,
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
pub fn random_walks(
    site: &Site,
    count: usize,
    rooms: usize,
    seed: u64,
    done: impl Fn() + Sync,
) -> Result<Vec<Walk>, Error> {
    let people = Person::all();
    let walk = |index: usize| {
        let seed = seed.wrapping_mul(10_000).wrapping_add(index as u64);
        let stops = random_stops(&site.building, rooms, seed);
        let stops: Vec<&str> = stops.iter().map(String::as_str).collect();
        let walk = Walk::through(&site.building, &stops, &Walker { person: people[index % people.len()], seed })?;
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
    site: &Site,
    settings: &'static str,
    parameters: &Parameters,
    walks: &[Walk],
    done: impl Fn() + Sync,
) -> Result<UnknownRow, Error> {
    let one = |(index, walk): (usize, &Walk)| {
        let followed = follow(&site.map, parameters, &Start::Anywhere, (&walk.steps, &walk.truth), index as u64)?;
        done();
        Ok(followed)
    };
    let followed: Vec<Followed> = walks.par_iter().enumerate().map(one).collect::<Result<_, Error>>()?;
    let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
    let first: Vec<&Said> =
        followed.iter().filter_map(|followed| followed.said.iter().find(|said| said.state == State::Located)).collect();
    let said: Vec<&Said> = followed.iter().flat_map(|followed| &followed.said).collect();
    let located: Vec<&&Said> = said.iter().filter(|said| said.state == State::Located).collect();
    let within = |seconds: f64| percent(first.iter().filter(|said| said.seconds <= seconds).count(), walks.len());
    Ok(UnknownRow {
        site: site.name,
        settings,
        walks: walks.len(),
        located_60_s_percent: within(60.0),
        located_120_s_percent: within(120.0),
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
    /// Where.
    pub site: &'static str,
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
    site: &Site,
    settings: &'static str,
    parameters: &Parameters,
    walks: &[Walk],
    done: impl Fn() + Sync,
) -> Result<Vec<LostRow>, Error> {
    let disturbances: [(&'static str, Disturb); 2] = [("10 m unnoticed", teleported), ("2 min missing", holed)];
    let mut rows = Vec::new();
    for (disturbance, disturb) in disturbances {
        let one = |(index, walk): (usize, &Walk)| {
            let Some((steps, truth, from)) = disturb(walk) else { return Ok(None) };
            let floor = site.map.floors().min_by(|a, b| off(a.1, truth[0].z).total_cmp(&off(b.1, truth[0].z)));
            let start = start_of(walk, floor.map_or(0, |(number, _)| number));
            let followed = follow(&site.map, parameters, &start, (&steps, &truth), index as u64)?;
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
            site: site.name,
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

/// Nothing when too little is left of a walk after this step.
fn enough(walk: &Walk, from: usize) -> Option<()> {
    let end = walk.steps.last()?.stance_end.0;
    (end - walk.steps[from].stance_end.0 > LEFT_US).then_some(())
}

/// The steps of 10 m in the middle are not told, and the index says nothing of it.
fn teleported(walk: &Walk) -> Option<(Vec<Step>, Vec<Vector3<f64>>, usize)> {
    let from = walk.steps.len() / 3;
    let gone = |to: usize| (walk.truth[to] - walk.truth[from]).norm();
    let to = (from..walk.steps.len()).find(|&to| gone(to) > 10.0)?;
    enough(walk, to)?;
    let (mut steps, mut truth) = (walk.steps[..=from].to_vec(), walk.truth[..=from].to_vec());
    for (step, place) in walk.steps[to + 1..].iter().zip(&walk.truth[to + 1..]) {
        steps.push(Step { index: step.index - (to - from) as u32, ..*step });
        truth.push(*place);
    }
    Some((steps, truth, from + 1))
}

/// Two minutes in the middle are not told; the index shows it.
fn holed(walk: &Walk) -> Option<(Vec<Step>, Vec<Vector3<f64>>, usize)> {
    let from = walk.steps.len() / 4;
    let end = walk.steps[from].stance_end.0 + 120_000_000;
    let to = (from..walk.steps.len()).find(|&to| walk.steps[to].stance_end.0 > end)?;
    enough(walk, to)?;
    let keep = |range: std::ops::Range<usize>| (walk.steps[range.clone()].to_vec(), walk.truth[range].to_vec());
    let ((mut steps, mut truth), (later, places)) = (keep(0..from + 1), keep(to..walk.steps.len()));
    steps.extend(later);
    truth.extend(places);
    Some((steps, truth, from + 1))
}
