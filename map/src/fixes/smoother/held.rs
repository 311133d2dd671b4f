//! A position or a range in the window, and how far it is believed.

use super::Parameters;
use super::state::{Block, Column, place};
use crate::fixes::fix::Measured;
use nalgebra::{Matrix2, Vector2};
use sohle_shared::time::Micros;

/// Where in the window something belongs: after so many of its states, this part of the way to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Index of the state before.
    pub index: usize,
    /// From 0 at that state to 1 at the next.
    pub part: f64,
}

/// One that is held.
#[derive(Clone, Debug)]
pub struct Held {
    /// When it was measured.
    pub time: Micros,
    /// Where that is.
    pub spot: Spot,
    pub measured: Measured,
    /// How far the person may have gone since the state that it belongs to (variance). **Units:** m².
    pub beyond: f64,
    /// From 0 for what has nothing to do with the place to 1.
    pub weight: f64,
}

/// How far off something is from what is known without it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Innovation {
    /// **Units:** m.
    pub off_m: f64,
    /// In squared standard deviations over the degrees of freedom.
    pub normalised: f64,
    /// The probability that it is no outlier, as far as can be told from what is known without it.
    pub right: f64,
}

/// How the weight follows from how far something is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Belief {
    /// All alike, whatever they say.
    Blind,
    /// Less for what is far off, but something: for a beginning that may be wrong (Cauchy).
    Patient,
    /// The probability that it is no outlier.
    Settled,
}

/// A linearised observation: what it is off, by which rows of the state, with which information.
struct Seen {
    off: Vector2<f64>,
    rows: Matrix2<f64>,
    information: Matrix2<f64>,
}

impl Held {
    fn at(&self, states: &[Column]) -> Vector2<f64> {
        let from = place(&states[self.spot.index]);
        match states.get(self.spot.index + 1) {
            Some(next) if self.spot.part > 0.0 => from.lerp(&place(next), self.spot.part),
            _ => from,
        }
    }

    /// From where the person is believed to be to a position; zero for a range.
    pub fn off(&self, states: &[Column]) -> Vector2<f64> {
        match self.measured {
            Measured::Position { place, .. } => Vector2::from(place) - self.at(states),
            Measured::Range { .. } => Vector2::zeros(),
        }
    }

    fn seen(&self, at: Vector2<f64>) -> Seen {
        match self.measured {
            Measured::Position { place, covariance } => {
                let covariance = covariance + Matrix2::identity() * self.beyond;
                let information = covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
                Seen { off: at - Vector2::from(place), rows: Matrix2::identity(), information }
            }
            Measured::Range { anchor, above_m, metres, sigma_m } => {
                let way = at - Vector2::from(anchor);
                let distance = way.norm().hypot(above_m).max(1e-6);
                let along = way / distance;
                let mut rows = Matrix2::zeros();
                rows.set_row(0, &along.transpose());
                let information = (sigma_m * sigma_m + self.beyond).recip();
                Seen {
                    off: Vector2::new(distance - metres, 0.0),
                    rows,
                    information: Matrix2::from_diagonal(&Vector2::new(information, 0.0)),
                }
            }
        }
    }

    /// How far off it is, in squared standard deviations of its own.
    fn squared(seen: &Seen) -> f64 {
        seen.off.dot(&(seen.information * seen.off))
    }

    /// Odds of an outlier against what is right and not off at all.
    fn odds(&self, seen: &Seen, p: &Parameters) -> f64 {
        match self.measured {
            Measured::Position { .. } => p.outliers.odds_of_place(seen.information.determinant().max(1e-12).recip()),
            Measured::Range { .. } => p.outliers.odds_of_range(seen.information[(0, 0)].recip()),
        }
    }

    /// Weighs it by how far it is off.
    pub fn weigh(&mut self, states: &[Column], belief: Belief, p: &Parameters) {
        let seen = self.seen(self.at(states));
        let squared = Self::squared(&seen);
        self.weight = match belief {
            Belief::Blind => 1.0,
            Belief::Patient => 1.0 / (1.0 + squared / 9.0),
            Belief::Settled => 1.0 / (1.0 + self.odds(&seen, p) * (0.5 * squared).min(500.0).exp()),
        };
    }

    /// Its part of the cost, as that of something that may be an outlier.
    pub fn cost(&self, states: &[Column], p: &Parameters) -> f64 {
        let seen = self.seen(self.at(states));
        -((-0.5 * Self::squared(&seen)).exp() + self.odds(&seen, p)).ln()
    }

    /// Adds its part to the normal equations of the states before and after: diagonal blocks, the one beside, right sides.
    pub fn add(&self, states: &[Column], diagonal: &mut [Block], beside: &mut [Block], right: &mut [Column]) {
        let seen = self.seen(self.at(states));
        let information = seen.rows.tr_mul(&(seen.information * seen.rows)) * self.weight;
        let gradient = seen.rows.tr_mul(&(seen.information * seen.off)) * self.weight;
        let Spot { index, part } = self.spot;
        let mut put = |at: usize, share: f64| {
            let mut corner = diagonal[at].fixed_view_mut::<2, 2>(0, 0);
            corner += information * (share * share);
            let mut top = right[at].fixed_rows_mut::<2>(0);
            top -= gradient * share;
        };
        put(index, 1.0 - part);
        if part > 0.0 {
            put(index + 1, part);
            let mut corner = beside[index].fixed_view_mut::<2, 2>(0, 0);
            corner += information * (part * (1.0 - part));
        }
    }

    /// How far off it is when the place has this covariance without it.
    pub fn innovation(&self, states: &[Column], place: &Matrix2<f64>, p: &Parameters) -> Innovation {
        let seen = self.seen(self.at(states));
        let (off_m, squared, freedom, odds) = match self.measured {
            Measured::Position { covariance, .. } => {
                let spread = covariance + place + Matrix2::identity() * self.beyond;
                let inverse = spread.try_inverse().unwrap_or_else(Matrix2::zeros);
                let squared = seen.off.dot(&(inverse * seen.off));
                (seen.off.norm(), squared, 2.0, p.outliers.odds_of_place(spread.determinant()))
            }
            Measured::Range { sigma_m, .. } => {
                let row = seen.rows.row(0);
                let variance = sigma_m * sigma_m + self.beyond + (row * place * row.transpose())[(0, 0)];
                (seen.off.x.abs(), seen.off.x * seen.off.x / variance, 1.0, p.outliers.odds_of_range(variance))
            }
        };
        let right = 1.0 / (1.0 + odds * (0.5 * squared).min(500.0).exp());
        Innovation { off_m, normalised: squared / freedom, right }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixes::outlier::Outliers;

    fn held(measured: Measured) -> Held {
        Held { time: Micros(0), spot: Spot { index: 0, part: 0.25 }, measured, beyond: 0.01, weight: 1.0 }
    }

    fn states(nudge: Column) -> [Column; 2] {
        [Column::from([1.0, 2.0, 0.0, 0.0, 0.0]) + nudge, Column::from([3.0, 1.0, 0.0, 0.0, 0.0])]
    }

    #[test]
    fn gradients_are_those_of_the_cost_of_what_is_believed() {
        // Without outliers the cost is a half of the squares.
        let outliers = Outliers { share: 0.0, range_share: 0.0, ..Outliers::default() };
        let p = Parameters { outliers, ..Parameters::default() };
        for measured in [
            Measured::Position { place: [0.5, 2.5], covariance: Matrix2::new(1.0, 0.3, 0.3, 0.5) },
            Measured::Range { anchor: [7.0, -3.0], above_m: 2.0, metres: 7.0, sigma_m: 0.3 },
        ] {
            let held = held(measured);
            let (mut diagonal, mut beside, mut right) = ([Block::zeros(); 2], [Block::zeros()], [Column::zeros(); 2]);
            held.add(&states(Column::zeros()), &mut diagonal, &mut beside, &mut right);
            for i in 0..2 {
                let mut nudge = Column::zeros();
                nudge[i] = 1e-6;
                let slope = (held.cost(&states(nudge), &p) - held.cost(&states(-nudge), &p)) / 2e-6;
                assert!((-right[0][i] - slope).abs() < 1e-5, "{i}: {right:?} {slope}");
            }
        }
    }

    #[test]
    fn what_is_far_off_has_no_weight() {
        let p = Parameters::default();
        let weight = |x: f64| {
            let covariance = Matrix2::identity();
            let mut held = held(Measured::Position { place: [x, 1.75], covariance });
            held.weigh(&states(Column::zeros()), Belief::Settled, &p);
            held.weight
        };
        assert!(weight(1.5) > 0.99 && weight(4.5) > 0.9 && weight(7.5) < 1e-3, "{} {}", weight(4.5), weight(7.5));
    }
}
