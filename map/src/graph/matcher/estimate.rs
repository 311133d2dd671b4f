//! What the matcher says: where somebody may be, how likely each place is, and how well it is known.

use super::hypothesis::Hypothesis;
use super::{LEVEL_M, Matcher, near};
use crate::building::geometry::Point;
use crate::graph::{EdgeId, Graph};
use nalgebra::{Matrix2, Vector2};
use std::borrow::Borrow;
use std::fmt;

/// What belongs to one place is no farther from its likeliest hypothesis. **Units:** m.
const PLACE_M: f64 = 3.0;
/// And in height. **Units:** m.
const PLACE_HEIGHT_M: f64 = 2.0;
/// Hypotheses this near to each other are one that is tied to several ways. **Units:** m, rad.
const SAME_M: f64 = 0.5;
const SAME_RAD: f64 = 0.2;
/// More hypotheses are not looked at one by one; those after them count in the sum only.
const MOST_LOOKED_AT: usize = 300;
/// Less likely places are not told, and no more than so many.
const LEAST: f64 = 1e-3;
const MOST_TOLD: usize = 50;
/// Located: the likeliest place has so much of the probability and is known so well. **Units:** m.
const LOCATED: (f64, f64) = (0.9, 2.0);

/// A place where somebody may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Likely {
    /// Of all places.
    pub probability: f64,
    /// Number of the floor; on stairs and in elevators that of the node below.
    pub floor: i32,
    /// Mean, beside the graph where somebody walks beside it. **Units:** m; **Frame:** building.
    pub position: Point,
    /// Above the origin of the building. **Units:** m.
    pub height_m: f64,
    /// Of the position. **Units:** m²; **Frame:** building.
    pub covariance: Matrix2<f64>,
    /// Heading of the frame of the next step. **Units:** rad; **Frame:** building.
    pub heading: f64,
    /// How much longer steps are than they say.
    pub scale: f64,
    /// The likeliest edge, in the direction of the two in which somebody looks.
    pub edge: EdgeId,
    /// How far along it, on it. **Units:** m.
    pub along_m: f64,
}

impl Likely {
    /// Standard deviation: root of the sum over both coordinates. **Units:** m.
    pub fn sigma_m(&self) -> f64 {
        self.covariance.trace().max(0.0).sqrt()
    }
}

/// What is known after a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Index of the step.
    pub step: u32,
    /// The places that are possible, the likeliest first. Those below a thousandth are left out.
    pub places: Vec<Likely>,
    /// Number of hypotheses.
    pub hypotheses: usize,
    /// How many of them were sown at this step, because none fitted any more or steps were missing.
    pub sown: usize,
    /// What the best hypothesis has lost in each of the last metres (logarithm of odds): around 0.3 where all fits.
    pub loss: f64,
}

impl Estimate {
    /// The likeliest place.
    pub fn place(&self) -> Option<&Likely> {
        self.places.first()
    }

    /// Whether one place is left, and is known well.
    pub fn is_located(&self) -> bool {
        self.place().is_some_and(|place| place.probability >= LOCATED.0 && place.sigma_m() <= LOCATED.1)
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{} hypotheses, loss {:.2} a metre", self.hypotheses, self.loss)?;
        if self.sown > 0 {
            write!(out, ", {} sown", self.sown)?;
        }
        for place in self.places.iter().take(3) {
            let [x, y] = place.position;
            write!(
                out,
                "; {:.0} % edge {} at {:.2} m, ({x:.2}, {y:.2}) +- {:.1} m on floor {}, heading {:.0} deg, scale {:.2}",
                100.0 * place.probability,
                place.edge.0,
                place.along_m,
                place.sigma_m(),
                place.floor,
                place.heading.to_degrees(),
                place.scale
            )?;
        }
        match self.places.len().saturating_sub(3) {
            0 => Ok(()),
            more => write!(out, "; {more} more places"),
        }
    }
}

/// Sums over the hypotheses of a place.
struct Sums<'h> {
    best: &'h Hypothesis,
    height_m: f64,
    weight: f64,
    first: Vector2<f64>,
    second: Matrix2<f64>,
    scale: f64,
}

impl<G: Borrow<Graph>> Matcher<G> {
    /// Puts hypotheses together that mean the same place.
    pub(super) fn estimated(&self, step: u32, sown: usize) -> Estimate {
        let measured = self.with_heights.then_some(self.height_m);
        let mut order: Vec<&Hypothesis> = self.hypotheses.iter().collect();
        let rank = |a: &&Hypothesis, b: &&Hypothesis| {
            b.weight.total_cmp(&a.weight).then(a.way.cmp(&b.way)).then(a.mean[2].total_cmp(&b.mean[2]))
        };
        let mut rest = 0.0;
        if order.len() > MOST_LOOKED_AT {
            order.select_nth_unstable_by(MOST_LOOKED_AT, rank);
            rest = order[MOST_LOOKED_AT..].iter().map(|hypothesis| hypothesis.weight.exp()).sum();
            order.truncate(MOST_LOOKED_AT);
        }
        order.sort_unstable_by(rank);
        let mut seen: Vec<&Hypothesis> = Vec::new();
        let mut places: Vec<Sums<'_>> = Vec::new();
        let mut total = rest;
        for hypothesis in order {
            // Tied to another way it is the same place in the same direction.
            if seen.iter().any(|seen| near(seen, &hypothesis.mean, SAME_M, SAME_RAD)) {
                continue;
            }
            seen.push(hypothesis);
            let weight = hypothesis.weight.exp();
            total += weight;
            let height_m = hypothesis.height_m(&self.net, measured);
            let off = |place: &Sums<'_>| Vector2::from(hypothesis.place()) - Vector2::from(place.best.place());
            let here = places
                .iter_mut()
                .find(|place| off(place).norm() < PLACE_M && (place.height_m - height_m).abs() < PLACE_HEIGHT_M);
            let spread: Matrix2<f64> = hypothesis.covariance.fixed_view::<2, 2>(0, 0).into();
            match here {
                Some(place) => {
                    let off = off(place);
                    place.weight += weight;
                    place.first += weight * off;
                    place.second += weight * (off * off.transpose() + spread);
                    place.scale += weight * hypothesis.mean[3];
                }
                None => places.push(Sums {
                    best: hypothesis,
                    height_m,
                    weight,
                    first: Vector2::zeros(),
                    second: weight * spread,
                    scale: weight * hypothesis.mean[3],
                }),
            }
        }
        let mut places: Vec<Likely> = places.iter().map(|sums| self.likely(sums, total)).collect();
        places.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        places.retain(|place| place.probability >= LEAST);
        places.truncate(MOST_TOLD);
        Estimate { step, places, hypotheses: self.hypotheses.len(), sown, loss: self.loss }
    }

    fn likely(&self, sums: &Sums<'_>, total: f64) -> Likely {
        let off = sums.first / sums.weight;
        let [x, y] = sums.best.place();
        let (way, graph) = (self.net.way(sums.best.way), self.graph.borrow());
        let along = way.project(sums.best.place())[0].clamp(0.0, way.length_m);
        let heading = sums.best.mean[2];
        let forwards = (heading - way.direction).cos() >= 0.0;
        let (edge, along_m) =
            if forwards { (way.edge, along) } else { (graph.edge(way.edge).back, way.length_m - along) };
        let ends = way.ends.map(|end| graph.node(end));
        // A node on stairs is of the floor below, but somebody who has arrived is on that above.
        let near = ends.iter().find(|end| (end.height_m - sums.height_m).abs() < LEVEL_M);
        let low = if ends[0].height_m <= ends[1].height_m { ends[0] } else { ends[1] };
        Likely {
            probability: sums.weight / total,
            floor: near.unwrap_or(&low).floor,
            position: [x + off.x, y + off.y],
            height_m: sums.height_m,
            covariance: sums.second / sums.weight - off * off.transpose(),
            heading,
            scale: sums.scale / sums.weight,
            edge,
            along_m,
        }
    }
}
