//! Where hypotheses begin: around known places, or everywhere.

use super::hypothesis::Hypothesis;
use super::net::Net;
use super::{Parameters, net::Way};
use crate::building::geometry::Point;
use crate::graph::EdgeKind;
use std::f64::consts::{PI, TAU};

/// What is known of the start.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// One of these places, all alike.
    At(Vec<Place>),
    /// Anywhere, in any direction.
    Anywhere,
}

/// A place where somebody may begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Number of the floor.
    pub floor: i32,
    /// **Units:** m; **Frame:** building.
    pub place: Point,
    /// Standard deviation of each coordinate. **Units:** m.
    pub sigma_m: f64,
    /// Direction of the first step and its standard deviation, if it is known. **Units:** rad; **Frame:** building.
    pub heading: Option<(f64, f64)>,
}

/// Pieces of ways that begin with a hypothesis are no longer. **Units:** m.
const PIECE_M: f64 = 2.5;
/// Headings at a place of which no heading is known.
const HEADINGS: u32 = 12;
/// And on a net over an open area, where people go in any direction.
const OPEN_HEADINGS: u32 = 8;
/// How far from a way somebody walks on it who begins there (standard deviation). **Units:** rad.
const ALONG: f64 = 0.25;
/// A known place is on the ways within so many standard deviations, and this. **Units:** m.
const WITHIN: (f64, f64) = (3.0, 2.0);

/// Hypotheses everywhere, as many to the metre.
pub(super) fn anywhere(net: &Net, p: &Parameters) -> Vec<Hypothesis> {
    let mut begun = Vec::new();
    for (number, way) in net.ways.iter().enumerate().filter(|(_, way)| way.kind != EdgeKind::Elevator) {
        let pieces = (way.length_m / PIECE_M).ceil().max(1.0);
        for piece in 0..pieces as u32 {
            let middle = way.at((f64::from(piece) + 0.5) / pieces * way.length_m);
            let along = way.length_m / pieces / 12.0_f64.sqrt();
            let width = if way.open { p.open_aside_m } else { p.aside_m };
            for heading in headings(way) {
                let place = (middle, spread(way, along, width));
                begun.push(Hypothesis::new(number as u32, place, heading, p.scale));
            }
        }
    }
    begun
}

/// The directions of somebody on a way, and their standard deviation.
pub(super) fn headings(way: &Way) -> Vec<(f64, f64)> {
    if way.open { around(OPEN_HEADINGS) } else { [0.0, PI].map(|turn| (way.direction + turn, ALONG)).to_vec() }
}

fn around(count: u32) -> Vec<(f64, f64)> {
    let step = TAU / f64::from(count);
    (0..count).map(|number| (f64::from(number) * step, 0.5 * step)).collect()
}

/// Covariance along and beside a way.
fn spread(way: &Way, along: f64, aside: f64) -> [[f64; 2]; 2] {
    let [cos, sin] = way.along;
    let [a, b] = [along * along, aside * aside];
    let xy = (a - b) * sin * cos;
    [[a * cos * cos + b * sin * sin, xy], [xy, a * sin * sin + b * cos * cos]]
}

/// Hypotheses around a place. At least one, if the floor has ways.
pub(super) fn at(net: &Net, place: &Place, on_floor: impl Fn(&Way) -> bool, p: &Parameters) -> Vec<Hypothesis> {
    let fits = |way: &u32| net.way(*way).kind != EdgeKind::Elevator && on_floor(net.way(*way));
    let far = |way: &u32| net.way(*way).distance(place.place);
    let mut ways: Vec<u32> =
        net.near(place.place, WITHIN.0 * place.sigma_m + WITHIN.1).into_iter().filter(fits).collect();
    if ways.is_empty() {
        let all = (0..net.ways.len() as u32).filter(fits);
        ways.extend(all.min_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b))));
    }
    let headings = place.heading.map_or_else(|| around(HEADINGS), |heading| vec![heading]);
    let variance = place.sigma_m * place.sigma_m;
    let mut begun = Vec::new();
    for way in ways {
        for &heading in &headings {
            let place = (place.place, [[variance, 0.0], [0.0, variance]]);
            begun.push(Hypothesis::new(way, place, heading, p.scale));
        }
    }
    begun
}
