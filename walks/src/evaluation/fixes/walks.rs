//! Simulated walks in generated buildings, with positions of known noise, outliers and biases; nothing is known of the start.

use super::figures::{Bounds, Figures};
use crate::evaluation::building::suite::Error;
use crate::evaluation::building::unknown::{Site, random_walks};
use crate::evaluation::building::walk::Walk;
use crate::evaluation::phone::path::Path;
use crate::fixes::extended::Extended;
use crate::fixes::{Documented, Method, Observation, Outcome, Smoother, Start, smoother};
use nalgebra::{Matrix2, Vector2};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use rayon::prelude::*;
use sohle_shared::time::Micros;
use std::f64::consts::TAU;

/// Rooms of a walk, and walks in each of the two buildings.
const STOPS: usize = 6;
const WALKS: usize = 8;
/// Standard deviations of the positions. **Units:** m.
const SIGMAS_M: [f64; 3] = [1.0, 3.0, 5.0];
/// A position comes so often. **Units:** us.
const EVERY_US: i64 = 5_000_000;
/// Scored from here on: nobody knows before where the walk leads. **Units:** us.
const FROM_US: i64 = 60_000_000;
/// Share of outliers, and how far off they are. **Units:** m.
const OUTLIERS: f64 = 0.2;
const OUTLIER_M: f64 = 20.0;
/// How far the middle third of the positions is off to one side, in their standard deviations.
const BIAS: f64 = 2.0;

/// What is wrong with the positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wrong {
    Nothing,
    Outliers,
    Bias,
}

/// One kind of positions.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// Standard deviation. **Units:** m.
    pub sigma_m: f64,
    /// What is wrong with them.
    pub wrong: &'static str,
    /// The extended filter, as it was said.
    pub extended: Figures,
    /// The smoother, as it was said.
    pub live: Figures,
    /// The smoother, corrected.
    pub corrected: Figures,
    /// Squared distance of positions from what was expected of them.
    pub innovation: Bounds,
    /// Squared error of what was said, over its covariance.
    pub estimation: Bounds,
    /// Outliers that were doubted. **Units:** %.
    pub outliers_doubted_percent: f64,
    /// Good positions that were doubted. **Units:** %.
    pub others_doubted_percent: f64,
}

/// What came of one walk.
#[derive(Default)]
struct Found {
    extended: Vec<f64>,
    live: Vec<f64>,
    corrected: Vec<f64>,
    innovation: Vec<f64>,
    estimation: Vec<f64>,
    /// Doubted and all: outliers, others.
    doubted: [[usize; 2]; 2],
}

/// All walks with all kinds of positions.
///
/// # Errors
/// When a walk cannot be made.
pub fn rows(seed: u64) -> Result<Vec<Row>, Error> {
    let mut walks = Vec::new();
    for site in [Site::institute()?, Site::offices()?] {
        walks.extend(random_walks(&site, WALKS, STOPS, seed, || ())?);
    }
    let kinds =
        [("nothing", Wrong::Nothing), ("20 % outliers of 20 m", Wrong::Outliers), ("a third biased", Wrong::Bias)];
    let mut rows = Vec::new();
    for sigma_m in SIGMAS_M {
        for (name, wrong) in kinds {
            let one = |(index, walk): (usize, &Walk)| {
                follow(walk, &said(walk, sigma_m, wrong, seed.wrapping_mul(1_000).wrapping_add(index as u64)), sigma_m)
            };
            let found: Vec<Found> = walks.par_iter().enumerate().map(one).collect();
            rows.push(row(&found, sigma_m, name));
        }
    }
    Ok(rows)
}

fn row(found: &[Found], sigma_m: f64, wrong: &'static str) -> Row {
    let all = |pick: fn(&Found) -> &Vec<f64>| found.iter().flat_map(|found| pick(found).clone()).collect::<Vec<_>>();
    let percent = |kind: usize| {
        let sum = |at: usize| found.iter().map(|found| found.doubted[kind][at]).sum::<usize>() as f64;
        100.0 * sum(0) / sum(1).max(1.0)
    };
    let innovation = all(|found| &found.innovation);
    Row {
        sigma_m,
        wrong,
        extended: Figures::of(all(|found| &found.extended)),
        live: Figures::of(all(|found| &found.live)),
        corrected: Figures::of(all(|found| &found.corrected)),
        innovation: Bounds::of(&innovation, innovation.len()),
        // Errors of one walk hang together for the time of some positions.
        estimation: Bounds::of(&all(|found| &found.estimation), found.len()),
        outliers_doubted_percent: percent(0),
        others_doubted_percent: percent(1),
    }
}

/// The positions, and which of them are outliers.
fn said(walk: &Walk, sigma_m: f64, wrong: Wrong, seed: u64) -> Vec<(Observation, bool)> {
    let mut random = Pcg64Mcg::new(u128::from(seed) << 1 | 1);
    let truth = truth(walk);
    let (Some(&(first, _)), Some(&(last, _))) = (truth.0.first(), truth.0.last()) else { return Vec::new() };
    let mut said = Vec::new();
    let mut time = first.0 + EVERY_US / 2;
    while time < last.0 {
        let Some(place) = truth.at(Micros(time)) else { break };
        let normal = |random: &mut Pcg64Mcg| -> f64 { StandardNormal.sample(random) };
        let mut place = place.map(|value| value + sigma_m * normal(&mut random));
        let unit = |random: &mut Pcg64Mcg| f64::from(random.next_u32()) / f64::from(u32::MAX);
        // All kinds use the same numbers, so that they differ in nothing else.
        let (chance, direction) = (unit(&mut random), TAU * unit(&mut random));
        let part = (time - first.0) as f64 / (last - first) as f64;
        let outlier = wrong == Wrong::Outliers && chance < OUTLIERS;
        if outlier {
            place = [place[0] + OUTLIER_M * direction.cos(), place[1] + OUTLIER_M * direction.sin()];
        }
        if wrong == Wrong::Bias && (1.0 / 3.0..2.0 / 3.0).contains(&part) {
            place[0] += BIAS * sigma_m;
        }
        said.push((Observation::position(Micros(time), place, sigma_m), outlier));
        time += EVERY_US;
    }
    said
}

fn truth(walk: &Walk) -> Path {
    let ends = walk.steps.iter().zip(&walk.truth);
    Path(ends.map(|(step, truth)| (step.stance_end, [truth.x, truth.y])).collect())
}

fn follow(walk: &Walk, said: &[(Observation, bool)], sigma_m: f64) -> Found {
    let truth = truth(walk);
    let Some(&(begin, _)) = truth.0.first() else { return Found::default() };
    let counts = |time: Micros| time - begin >= FROM_US;
    let off = |time: Micros, place: [f64; 2]| truth.at(time).map(|at| Vector2::from(place) - Vector2::from(at));
    let mut smoother = Smoother::new(&smoother::Parameters::default(), &Start::default());
    let documented = Documented { fix_sigma_m: sigma_m, ..Documented::default() };
    let mut extended = Extended::new(&documented, &Start::default());
    let mut found = Found::default();
    let mut waiting = said.iter().peekable();
    for step in &walk.steps {
        while let Some((observation, outlier)) = waiting.next_if(|(said, _)| said.time < step.stance_end) {
            extended.observe(observation);
            let verdict = smoother.hear(observation);
            if !counts(observation.time) {
                continue;
            }
            let [doubted, all] = &mut found.doubted[usize::from(!outlier)];
            *all += 1;
            *doubted += usize::from(verdict.outcome == Outcome::Doubted);
            if !outlier {
                found.innovation.push(verdict.normalised);
            }
        }
        extended.step(step);
        smoother.step(step);
        if !counts(step.stance_end) {
            continue;
        }
        if let Some(off) = extended.estimate().and_then(|estimate| off(step.stance_end, estimate.place)) {
            found.extended.push(off.norm());
        }
        let Some(estimate) = smoother.estimate() else { continue };
        let Some(off) = off(step.stance_end, estimate.place) else { continue };
        found.live.push(off.norm());
        let inverse = estimate.covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
        found.estimation.push(off.dot(&(inverse * off)) / 2.0);
    }
    let settled = smoother.take_settled().into_iter().map(|settled| (settled.time, settled.place));
    let open = smoother.open_part().into_iter().map(|open| (open.time, open.place));
    for (time, place) in settled.chain(open).filter(|&(time, _)| counts(time)) {
        if let Some(off) = off(time, place) {
            found.corrected.push(off.norm());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;
    use crate::evaluation::building::walk::Walker;
    use crate::fixes::Measured;
    use crate::simulation::Person;

    #[test]
    fn kinds_of_positions_differ_in_what_is_wrong_only() {
        let walker = Walker { person: Person::default(), seed: 1 };
        let walk = Walk::through(&generate::twin(2), &["W02", "hall", "E03"], &walker).unwrap();
        let places = |wrong| -> Vec<[f64; 2]> {
            let place = |(said, _): &(Observation, bool)| match said.measured {
                Measured::Position { place, .. } => place,
                Measured::Range { .. } => unreachable!(),
            };
            said(&walk, 2.0, wrong, 7).iter().map(place).collect()
        };
        let (good, biased) = (places(Wrong::Nothing), places(Wrong::Bias));
        assert!(good.len() > 5);
        let moved = good.iter().zip(&biased).filter(|(one, other)| (other[0] - one[0] - 4.0).abs() < 1e-9).count();
        let same = good.iter().zip(&biased).filter(|(one, other)| one == other).count();
        assert!(moved + same == good.len() && moved.abs_diff(good.len() / 3) <= 1, "{moved} {same}");
    }
}
