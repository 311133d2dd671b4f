//! A step between two states.

use super::Parameters;
use super::state::{Block, Column, DRIFT, HEADING, SCALE, place};
use nalgebra::{Matrix3, Vector2};
use sohle_shared::step::Step;

/// Nothing is known better than that. **Units:** m², rad².
const LEAST_VARIANCE: f64 = 1e-8;
/// How fast a place wanders about while somebody stands. **Units:** m for a root of a second.
const STANDING_SIGMA_M: f64 = 0.02;

/// What a step says of the two states at its ends.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    moved: Vector2<f64>,
    turn: f64,
    seconds: f64,
    /// Of (x, y, turn, scale, drift).
    information: Block,
}

/// Second derivatives of the cost by the state before, by both, and by the state after; and the gradients.
pub struct Linear {
    pub before: Block,
    pub cross: Block,
    pub after: Block,
    pub gradient_before: Column,
    pub gradient_after: Column,
}

impl Link {
    /// Of a step that took so long. **Units:** s.
    pub fn of(step: &Step, seconds: f64, p: &Parameters) -> Self {
        let c = step.covariance.map(f64::from);
        let share = p.turn_share;
        let mut covariance = Matrix3::new(
            c[(0, 0)],
            c[(0, 1)],
            c[(0, 3)] * share, //
            c[(1, 0)],
            c[(1, 1)],
            c[(1, 3)] * share, //
            c[(3, 0)] * share,
            c[(3, 1)] * share,
            c[(3, 3)] * share * share, //
        );
        let [place, turn] = [p.place_sigma_m, p.turn_sigma].map(|sigma| sigma * sigma + LEAST_VARIANCE);
        covariance += Matrix3::from_diagonal(&nalgebra::Vector3::new(place, place, turn));
        // A covariance that is none (a step made by hand) leaves what its diagonal says.
        let inverse = covariance.cholesky().map_or_else(
            || Matrix3::from_diagonal(&covariance.diagonal().map(|value| 1.0 / value.max(LEAST_VARIANCE))),
            |cholesky| cholesky.inverse(),
        );
        let moved = Vector2::new(f64::from(step.displacement.x), f64::from(step.displacement.y));
        Self::new(moved, f64::from(step.turn), seconds, &inverse, p)
    }

    /// Of somebody who stands.
    pub fn standing(seconds: f64, p: &Parameters) -> Self {
        let still = (STANDING_SIGMA_M * STANDING_SIGMA_M * seconds.max(0.1)).recip();
        // A foot that is turned while standing is seen in the turn of the next step.
        let inverse = Matrix3::from_diagonal(&nalgebra::Vector3::new(still, still, 1.0 / LEAST_VARIANCE));
        // At rest the gyroscope shows its bias, and the heading does not drift.
        Self { seconds: 0.0, ..Self::new(Vector2::zeros(), 0.0, seconds, &inverse, p) }
    }

    fn new(moved: Vector2<f64>, turn: f64, seconds: f64, inverse: &Matrix3<f64>, p: &Parameters) -> Self {
        let mut information = Block::zeros();
        information.fixed_view_mut::<3, 3>(0, 0).copy_from(inverse);
        information[(SCALE, SCALE)] = (p.scale_noise * p.scale_noise + LEAST_VARIANCE * LEAST_VARIANCE).recip();
        let drift = p.drift_noise * p.drift_noise * seconds.max(0.1) + LEAST_VARIANCE * LEAST_VARIANCE;
        information[(DRIFT, DRIFT)] = drift.recip();
        Self { moved, turn, seconds, information }
    }

    /// The state after, if the step is right.
    pub fn predict(&self, before: &Column) -> Column {
        let (sin, cos) = before[HEADING].sin_cos();
        let moved = self.moved * before[SCALE].exp();
        Column::from([
            before[0] + cos * moved.x - sin * moved.y,
            before[1] + sin * moved.x + cos * moved.y,
            before[HEADING] + self.turn + before[DRIFT] * self.seconds,
            before[SCALE],
            before[DRIFT],
        ])
    }

    fn residual(&self, before: &Column, after: &Column) -> Column {
        let (sin, cos) = before[HEADING].sin_cos();
        let way = place(after) - place(before);
        let scaled = self.moved * before[SCALE].exp();
        Column::from([
            cos * way.x + sin * way.y - scaled.x,
            -sin * way.x + cos * way.y - scaled.y,
            after[HEADING] - before[HEADING] - self.turn - before[DRIFT] * self.seconds,
            after[SCALE] - before[SCALE],
            after[DRIFT] - before[DRIFT],
        ])
    }

    /// Its part of the cost.
    pub fn cost(&self, before: &Column, after: &Column) -> f64 {
        let residual = self.residual(before, after);
        0.5 * residual.dot(&(self.information * residual))
    }

    /// Its part of the normal equations.
    pub fn linear(&self, before: &Column, after: &Column) -> Linear {
        let (sin, cos) = before[HEADING].sin_cos();
        let way = place(after) - place(before);
        let ahead = Vector2::new(cos * way.x + sin * way.y, -sin * way.x + cos * way.y);
        let scaled = self.moved * before[SCALE].exp();
        let mut to = Block::identity();
        (to[(0, 0)], to[(0, 1)], to[(1, 0)], to[(1, 1)]) = (cos, sin, -sin, cos);
        let mut from = -to;
        (from[(0, HEADING)], from[(1, HEADING)]) = (ahead.y, -ahead.x);
        (from[(0, SCALE)], from[(1, SCALE)]) = (-scaled.x, -scaled.y);
        from[(HEADING, DRIFT)] = -self.seconds;
        let residual = self.residual(before, after);
        let (weighed_from, weighed_to) = (self.information * from, self.information * to);
        let weighed = self.information * residual;
        Linear {
            before: from.tr_mul(&weighed_from),
            cross: from.tr_mul(&weighed_to),
            after: to.tr_mul(&weighed_to),
            gradient_before: from.tr_mul(&weighed),
            gradient_after: to.tr_mul(&weighed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::polar::tests::step;
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_cost() {
        let mut turned = step(3, 1.0, 0.8, 0.3);
        turned.displacement.y = 0.2;
        turned.covariance[(0, 1)] = 2e-4;
        turned.covariance[(1, 0)] = 2e-4;
        let link = Link::of(&turned, 0.6, &Parameters::default());
        let before = Column::from([3.0, -2.0, 0.7, 0.05, 1e-3]);
        let after = link.predict(&before) + Column::from([0.05, -0.03, 0.01, 0.001, 1e-4]);
        let linear = link.linear(&before, &after);
        for i in 0..5 {
            let mut nudge = Column::zeros();
            nudge[i] = 1e-6;
            let numeric = |up: f64, down: f64| (up - down) / 2e-6;
            let by_before = numeric(link.cost(&(before + nudge), &after), link.cost(&(before - nudge), &after));
            let by_after = numeric(link.cost(&before, &(after + nudge)), link.cost(&before, &(after - nudge)));
            // Central differences of a cost that reaches 1e6 by its stiffest part.
            for (found, expected) in [(linear.gradient_before[i], by_before), (linear.gradient_after[i], by_after)] {
                assert!((found - expected).abs() < 1e-4 * expected.abs().max(10.0), "{i}: {found} {expected}");
            }
        }
        assert!(link.cost(&before, &link.predict(&before)) < 1e-18);
    }
}
