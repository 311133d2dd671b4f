//! The recorded walks in a mall, with simulated positions: so that nothing is found good that is good on one walk only.
//!
//! Their way-points are ten metres apart. Between them the steps lead, laid on both ends of each leg; positions are that way with
//! noise. The way-points themselves are scored.

use super::figures::{Figures, live};
use crate::alignment::Rigid;
use crate::evaluation::phone::path::Path;
use crate::evaluation::phone::walk::PhoneWalk;
use crate::fixes::extended::Extended;
use crate::fixes::{Documented, Observation, Smoother, Start, smoother};
use crate::phone;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// Rates of positions. **Units:** Hz.
const RATES: [f64; 3] = [1.0, 0.2, 0.1];
/// Standard deviation of each coordinate, as on the eight. **Units:** m.
const SIGMA_M: f64 = 1.8;
/// Times that each walk is gone with other noise.
const TIMES: u64 = 10;

/// All walks at one rate; nothing is known of the start.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// **Units:** Hz.
    pub rate_hz: f64,
    /// The extended filter, as it was said.
    pub extended: Figures,
    /// The smoother, as it was said.
    pub live: Figures,
    /// The smoother, corrected.
    pub corrected: Figures,
}

/// Follows all of them.
pub fn rows(walks: &[PhoneWalk], parameters: &phone::Parameters, seed: u64) -> Vec<Row> {
    let walked = |walk: &PhoneWalk| (walk.clone(), phone::steps(&walk.samples, parameters));
    let walks: Vec<(PhoneWalk, Vec<Step>)> = walks.par_iter().map(walked).collect();
    let runs: Vec<(usize, u64)> = (0..walks.len()).flat_map(|walk| (0..TIMES).map(move |time| (walk, time))).collect();
    let row = |rate_hz: f64| {
        let run = |&(index, time): &(usize, u64)| {
            let (walk, steps) = &walks[index];
            let seed = seed.wrapping_mul(1_000).wrapping_add(TIMES * index as u64 + time);
            errors(walk, steps, &said(walk, steps, rate_hz, seed))
        };
        let found: Vec<[Vec<f64>; 3]> = runs.par_iter().map(run).collect();
        let figures = |kind: usize| Figures::of(found.iter().flat_map(|errors| errors[kind].clone()).collect());
        Row { rate_hz, extended: figures(0), live: figures(1), corrected: figures(2) }
    };
    RATES.into_iter().map(row).collect()
}

/// Errors at the way-points from the third on: nobody knows before where the walk leads.
fn errors(walk: &PhoneWalk, steps: &[Step], said: &[Observation]) -> [Vec<f64>; 3] {
    let points = &walk.way_points[2.min(walk.way_points.len())..];
    let documented = Documented { fix_sigma_m: SIGMA_M, ..Documented::default() };
    let extended = live(&mut Extended::new(&documented, &Start::default()), steps, said);
    let mut smoother = Smoother::new(&smoother::Parameters::phone(), &Start::default());
    let said = live(&mut smoother, steps, said);
    let settled = smoother.take_settled().into_iter().map(|settled| (settled.time, settled.place));
    let corrected = Path(settled.chain(smoother.open_part().into_iter().map(|open| (open.time, open.place))).collect());
    [extended, said, corrected].map(|path| path.errors(points))
}

/// Positions on the way, with noise.
fn said(walk: &PhoneWalk, steps: &[Step], rate_hz: f64, seed: u64) -> Vec<Observation> {
    let (way, mut random) = (way(walk, steps), Pcg64Mcg::new(u128::from(seed) << 1 | 1));
    let (Some(&(first, _)), Some(&(last, _))) = (way.0.first(), way.0.last()) else { return Vec::new() };
    let every = (1e6 / rate_hz) as usize;
    let times = (first.0 + every as i64 / 2..last.0).step_by(every);
    times
        .filter_map(|time| {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let place = way.at(Micros(time))?.map(|value| value + SIGMA_M * normal());
            Some(Observation::position(Micros(time), place, SIGMA_M))
        })
        .collect()
}

/// The steps, laid on both ends of each leg between two way-points.
fn way(walk: &PhoneWalk, steps: &[Step]) -> Path {
    let (own, mut way) = (Path::of(steps), Path::default());
    for ends in walk.way_points.windows(2) {
        let [Some(from), Some(to)] = [ends[0].time, ends[1].time].map(|time| own.at(time)) else { continue };
        let (told, true_ends) = ([from, to], [ends[0].place, ends[1].place]);
        let rigid = Rigid::fit(&told, &true_ends);
        let between = own.0.iter().filter(|(time, _)| ends[0].time < *time && *time < ends[1].time);
        way.note(ends[0].time, ends[0].place);
        for &(time, place) in between {
            // What the length is wrong by is spread over the time of the leg.
            let part = (time - ends[0].time) as f64 / (ends[1].time - ends[0].time) as f64;
            let [at, start, end] = [place, from, to].map(|place| rigid.apply(place));
            let left = |axis: usize| {
                (1.0 - part) * (true_ends[0][axis] - start[axis]) + part * (true_ends[1][axis] - end[axis])
            };
            way.note(time, [at[0] + left(0), at[1] + left(1)]);
        }
    }
    way.0.extend(walk.way_points.last().map(|point| (point.time, point.place)));
    way
}
