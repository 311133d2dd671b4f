//! Where Gauss-Newton alone would end in the wrong place: directions that are not known, and paths that are wrong.

use super::super::held::Belief;
use super::super::state::{Column, HEADING, place};
use super::{KNOWN_DIRECTION, LOOKED_AT, ROUNDS_ANEW, Smoother};
use crate::fixes::Measured;
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

/// Directions that are tried where it is not known.
const DIRECTIONS: usize = 6;
/// Places that are tried on the circle that a range leaves.
const PLACES: usize = 8;
/// Ranges that must bear a place out before it is held for known.
const LEAST_RANGES: usize = 4;
/// A place that is known better than this is one (root of the sum of the variances). **Units:** m.
const KNOWN_M: f64 = 5.0;
/// How much better another path must explain all (logarithm of odds).
const BETTER: f64 = 6.0;
/// With so many of the last positions doubted it is asked whether the path is what is wrong.
const MOST_DOUBTED: usize = 6;
/// Positions that must bear a direction out before it is held for known.
const LEAST_FIXES: usize = 4;

impl Smoother {
    /// Tries places around the anchor of the last range, where nothing is known of the place, and keeps the best.
    pub(super) fn find_place(&mut self) {
        let Some(last) = self.held.last() else { return };
        let Measured::Range { anchor, metres, .. } = last.measured else { return };
        let here = place(&self.states[last.spot.index]);
        self.try_around(PLACES, |window, angle| {
            let (sin, cos) = angle.sin_cos();
            let shift = Vector2::from(anchor) + Vector2::new(cos, sin) * metres - here;
            window.states.iter_mut().for_each(|state| *state += Column::from([shift.x, shift.y, 0.0, 0.0, 0.0]));
        });
        self.rounds(Belief::Settled, 1);
        let Some((_, covariance)) = self.state_of_last() else { return };
        let sigma_m = (covariance[(0, 0)] + covariance[(1, 1)]).max(0.0).sqrt();
        let ranges = self.held.iter().filter(|held| held.weight > 0.5).count();
        self.placed = sigma_m < KNOWN_M && ranges >= LEAST_RANGES;
    }

    /// Changes the states for each of so many angles all around, lets them settle, and keeps the best.
    fn try_around(&mut self, count: usize, change: impl Fn(&mut Self, f64)) {
        let mut best: Option<(f64, Vec<Column>)> = None;
        let before = self.states.clone();
        for number in 0..count {
            self.states.clone_from(&before);
            change(self, TAU * number as f64 / count as f64);
            self.rounds(Belief::Patient, ROUNDS_ANEW);
            self.rounds(Belief::Settled, ROUNDS_ANEW);
            let cost = self.cost();
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, self.states.clone()));
            }
        }
        if let Some((_, states)) = best {
            self.states = states;
        }
    }

    /// Tries all directions, where none is known, and keeps the best.
    pub(super) fn find_direction(&mut self) {
        let first = self.states[0][HEADING];
        self.try_around(DIRECTIONS, Self::turn);
        // Headings are counted on without a jump; the first decides by how many turns they differ.
        let whole = ((self.states[0][HEADING] - first + PI) / TAU).floor() * TAU;
        self.states.iter_mut().for_each(|state| state[HEADING] -= whole);
        self.rounds(Belief::Settled, 1);
        let Some((_, covariance)) = self.state_of_last() else { return };
        let sigma = covariance[(HEADING, HEADING)].max(0.0).sqrt();
        let fixes = self.held.iter().filter(|held| held.weight > 0.5).count();
        self.directed = sigma < KNOWN_DIRECTION && fixes >= LEAST_FIXES;
    }

    /// Turns the path about the middle of what was said of it.
    fn turn(&mut self, angle: f64) {
        let count = self.held.len().max(1) as f64;
        let middle = self.held.iter().map(|held| place(&self.states[held.spot.index])).sum::<Vector2<f64>>() / count;
        let (sin, cos) = angle.sin_cos();
        for state in &mut self.states {
            let off = place(state) - middle;
            state[0] = middle.x + cos * off.x - sin * off.y;
            state[1] = middle.y + sin * off.x + cos * off.y;
            state[HEADING] += angle;
        }
    }

    /// When most of the last positions were doubted, the path may be what is wrong: looks for another.
    pub(super) fn reconsider(&mut self) {
        let doubted = self.doubts.iter().filter(|&&doubted| doubted).count();
        if !self.directed || doubted < MOST_DOUBTED {
            return;
        }
        self.doubts.clear();
        let (kept, cost) = (self.states.clone(), self.cost());
        self.rounds(Belief::Blind, ROUNDS_ANEW);
        self.rounds(Belief::Patient, ROUNDS_ANEW);
        self.rounds(Belief::Settled, ROUNDS_ANEW);
        if self.cost() < cost - BETTER {
            return;
        }
        self.states = kept;
        self.rounds(Belief::Settled, 1);
        self.jump();
    }

    /// Whether all is better explained by somebody who was carried off, so that the path begins anew where it came to be
    /// doubted; if so, it does.
    fn jump(&mut self) {
        let last = self.held.iter().rev().take(LOOKED_AT);
        let Some(first) = last.filter(|held| held.weight < 0.5).map(|held| held.spot.index).min() else { return };
        if first + 2 > self.states.len() {
            return;
        }
        let states = self.states.windows(2).skip(first);
        let links: f64 = self.links[first..].iter().zip(states).map(|(link, ends)| link.cost(&ends[0], &ends[1])).sum();
        let held = self.held.iter().filter(|held| held.spot.index >= first);
        let cost = links + held.map(|held| held.cost(&self.states, &self.parameters)).sum::<f64>();
        let mut trial = self.clone();
        (0..first).for_each(|_| trial.forget_first());
        trial.prior = trial.anywhere(trial.states[0]);
        trial.directed = false;
        trial.settle();
        if trial.cost() < cost - BETTER {
            *self = trial;
        }
    }
}
