//! What other sources say of the place (5G, UWB, a word of the person): it weighs and corrects each hypothesis where that was when
//! it was measured.
//!
//! Where a hypothesis was some steps ago follows from where it is now, from its heading and from its step scale: so a position
//! that comes late corrects all of them, and no hypothesis has to remember its past.
//!
//! # Source
//! Fix, 3.2, the extended filter's model of start direction and step scale; the mixture of what is right and what is anywhere as in
//! [`crate::sight::Sight`].

use super::hypothesis::{Hypothesis, Move};
use super::{Estimate, Matcher};
use crate::graph::Graph;
use crate::sight::{STANDS_US, Seen, Sight};
use nalgebra::{Matrix2, Matrix2x4, RowVector4, Vector2};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::borrow::Borrow;
use std::collections::VecDeque;

/// Steps that are remembered. Nobody's word is later.
const REMEMBERED: usize = 120;
/// A hypothesis that fits a sight worse than this part of the odds of an outlier is not corrected by it.
const LEAST_FIT: f64 = 0.05;
/// A sight that fits so little of the probability contradicts what is known.
const CONTRADICTS: f64 = 0.1;

/// A step that was made.
#[derive(Clone, Copy, Debug)]
struct Made {
    end: Micros,
    /// In the frame before its turn. **Units:** m, rad.
    by: Vector2<f64>,
    turn: f64,
}

/// The steps of the last while, and what waits to be placed among the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Past {
    made: VecDeque<Made>,
    waiting: Vec<(Micros, Sight)>,
    /// How many sights in succession contradicted what was known.
    contradicted: usize,
}

/// The way back to an earlier moment, in the frame of the next step. **Units:** m, m².
#[derive(Clone, Copy, Debug, Default)]
struct Back {
    way: Vector2<f64>,
    /// How well it is known (variance of each coordinate).
    variance: f64,
}

impl Past {
    pub fn add(&mut self, step: &Step, by: &Move) {
        if self.made.len() == REMEMBERED {
            self.made.pop_front();
        }
        self.made.push_back(Made { end: step.stance_end, by: by.way(), turn: f64::from(step.turn) });
    }

    /// Steps are missing: where anything was before is not known.
    pub fn forget(&mut self) {
        self.made.clear();
    }

    /// The way back to a time; nothing when that is too long ago.
    fn back(&self, time: Micros, place_m: f64) -> Option<Back> {
        let mut back = Back::default();
        let mut turned = 0.0_f64;
        let mut later = self.made.iter().rev().peekable();
        while let Some(made) = later.next() {
            if time >= made.end {
                return Some(back);
            }
            // The first that is remembered began nobody knows when.
            let began = later.peek()?.end;
            let part = ((made.end - time) as f64 / (made.end - began).max(1) as f64).clamp(0.0, 1.0);
            turned -= made.turn;
            let (sin, cos) = turned.sin_cos();
            back.way += part * Vector2::new(cos * made.by.x - sin * made.by.y, sin * made.by.x + cos * made.by.y);
            back.variance += part * place_m * place_m;
        }
        Some(back)
    }
}

impl<G: Borrow<Graph>> Matcher<G> {
    /// Takes in what another source says of the place at a time; returns what is known with it. What was measured since the last
    /// step counts with the next, which tells where in between.
    pub fn sight(&mut self, sight: &Sight, time: Micros) -> &Estimate {
        match self.last {
            Some((_, last)) if time > last && time - last < STANDS_US => self.past.waiting.push((time, *sight)),
            _ => {
                let sown = self.weigh_at(sight, time);
                self.estimate = self.estimated(self.estimate.step, sown);
            }
        }
        &self.estimate
    }

    /// Takes in what has waited for the step that has just been made. Tells how many hypotheses were sown.
    pub(super) fn weigh_waiting(&mut self) -> usize {
        let waiting = std::mem::take(&mut self.past.waiting);
        waiting.iter().map(|(time, sight)| self.weigh_at(sight, *time)).sum()
    }

    fn weigh_at(&mut self, sight: &Sight, time: Micros) -> usize {
        let Some(back) = self.past.back(time, self.parameters.place_m) else { return 0 };
        let outlier = sight.odds();
        let (mut best, mut mass, mut right) = (f64::NEG_INFINITY, 0.0, 0.0);
        for hypothesis in &mut self.hypotheses {
            let on = sight.floor.is_none_or(|floor| self.net.way(hypothesis.way).floors.contains(&floor));
            let weight = hypothesis.weight.exp();
            let fit = if on { hypothesis.see(&sight.seen, &back, outlier) } else { 0.0 };
            hypothesis.weight += ((fit + outlier) / (1.0 + outlier)).ln();
            best = best.max(hypothesis.weight);
            mass += weight;
            right += weight * fit / (fit + outlier);
        }
        self.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.weight -= best);
        self.hypotheses.retain(|hypothesis| hypothesis.weight > -self.parameters.given_up);
        let Some((place, radius)) = sight.around() else { return 0 };
        self.past.contradicted = if right < CONTRADICTS * mass { self.past.contradicted + 1 } else { 0 };
        if self.past.contradicted < self.parameters.contradicted {
            return 0;
        }
        self.past.contradicted = 0;
        self.sow_around(place, radius, sight.floor)
    }
}

impl Hypothesis {
    /// Corrects it by a sight, as far as that fits; how well it did, against one that fits exactly.
    fn see(&mut self, seen: &Seen, back: &Back, outlier: f64) -> f64 {
        let [_, _, heading, scale] = self.mean.into();
        let (sin, cos) = heading.sin_cos();
        // In the building, the way back for each unit of the scale.
        let way = Vector2::new(cos * back.way.x - sin * back.way.y, sin * back.way.x + cos * back.way.y);
        let then = Vector2::from(self.place()) - scale * way;
        // Jacobian of where it was, by its state.
        let jacobian = Matrix2x4::new(1.0, 0.0, scale * way.y, -way.x, 0.0, 1.0, -scale * way.x, -way.y);
        let slack = Matrix2::identity() * back.variance;
        match *seen {
            Seen::Place(place, covariance) => {
                let covariance = covariance + slack;
                let spread = jacobian * self.covariance * jacobian.transpose() + covariance;
                let off = Vector2::from(place) - then;
                let Some(inverse) = spread.try_inverse() else { return 0.0 };
                let narrow = (covariance.determinant() / spread.determinant()).clamp(0.0, 1.0).sqrt();
                let fit = narrow * (-0.5 * off.dot(&(inverse * off))).exp();
                let part = fit / (fit + outlier);
                if part > LEAST_FIT {
                    // What may be an outlier corrects less.
                    let Some(inverse) = (spread + covariance * (part.recip() - 1.0)).try_inverse() else { return fit };
                    let gain = self.covariance * jacobian.transpose() * inverse;
                    self.mean += gain * off;
                    self.covariance -= gain * jacobian * self.covariance;
                    self.covariance = 0.5 * (self.covariance + self.covariance.transpose());
                }
                fit
            }
            Seen::Range { anchor, above_m, metres, sigma_m } => {
                let aside = then - Vector2::from(anchor);
                let far = aside.norm().hypot(above_m);
                let row: RowVector4<f64> = (aside / far.max(1e-6)).transpose() * jacobian;
                let variance = sigma_m * sigma_m + back.variance;
                let spread = (row * self.covariance * row.transpose()).x + variance;
                let off = metres - far;
                let fit = (variance / spread).clamp(0.0, 1.0).sqrt() * (-0.5 * off * off / spread).exp();
                let part = fit / (fit + outlier);
                if part > LEAST_FIT {
                    self.correct(row.transpose(), off, variance / part);
                }
                fit
            }
        }
    }
}
