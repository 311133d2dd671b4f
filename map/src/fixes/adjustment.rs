//! The document's weighted least squares: all steps and positions so far, adjusted again with each position.
//!
//! Between two positions each step makes an interpolated one of the last (3.8, 3.9), which counts like a measured one; so the
//! covariance says less than there is to doubt. The work grows with the walk.
//!
//! # Source
//! Fix, 2.2 (2.16 - 2.18) and 3.3. The normal matrix of (2.18) has three diagonals, and a border where `Phi0` is estimated
//! together with the places: it is solved from its beginning to its end, without an inverse.

use super::aligner::Aligner;
use super::beginning::Waiting;
use super::method::{Estimate, Method, Start};
use super::observation::Observation;
use super::parameters::Documented;
use super::polar::Polar;
use nalgebra::{Matrix2, Vector2};
use sohle_shared::step::Step;

/// Adjustments of the direction; each brings it some digits nearer.
const MOST_ROUNDS: usize = 20;
/// A direction that changes by less has been found. **Units:** rad.
const SAME: f64 = 1e-13;

/// The end of a step, or the start.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The step that leads here.
    polar: Polar,
    /// The position that was measured here: mean and number.
    fix: Option<(Vector2<f64>, f64)>,
    place: Vector2<f64>,
}

/// The adjustment.
#[derive(Clone, Debug)]
pub struct Adjustment {
    parameters: Documented,
    aligner: Aligner,
    /// `Phi0` is estimated with the places.
    estimated: bool,
    /// The known start and its standard deviation.
    start: Option<(Vector2<f64>, f64)>,
    nodes: Vec<Node>,
    covariance: Matrix2<f64>,
}

impl Adjustment {
    /// Begins. A start direction is believed; without one it is estimated from the first positions, and then adjusted.
    pub fn new(parameters: &Documented, start: &Start) -> Self {
        let node = Node { polar: Polar::default(), fix: None, place: Vector2::zeros() };
        Self {
            parameters: *parameters,
            aligner: Aligner::new(parameters, start),
            estimated: start.direction.is_none(),
            start: start.place.map(|(place, sigma)| (Vector2::from(place), sigma)),
            nodes: vec![Node { place: start.place.map_or_else(Vector2::zeros, |(place, _)| place.into()), ..node }],
            covariance: start.place.map_or_else(Matrix2::zeros, |(_, sigma)| Matrix2::identity() * (sigma * sigma)),
        }
    }

    fn take(&mut self, next: Waiting) {
        let last = self.nodes.len() - 1;
        match (next, self.aligner.phi0()) {
            (Waiting::Step(polar), Some(phi0)) => {
                let place = self.nodes[last].place + Vector2::from(polar.along(phi0));
                self.nodes.push(Node { polar, fix: None, place });
                self.covariance += Matrix2::identity() * self.parameters.step_sigma_m.powi(2);
            }
            (Waiting::Fix(place), _) => {
                let (mean, count) = self.nodes[last].fix.unwrap_or((Vector2::zeros(), 0.0));
                self.nodes[last].fix = Some(((mean * count + Vector2::from(place)) / (count + 1.0), count + 1.0));
                self.adjust();
            }
            (Waiting::Step(_), None) => {}
        }
    }

    /// (2.18) for all nodes, and for `Phi0` if it is estimated.
    fn adjust(&mut self) {
        let Some(mut phi0) = self.aligner.phi0() else { return };
        for _ in 0..MOST_ROUNDS {
            let normal = Normal::of(&self.nodes, self.start, phi0, &self.parameters);
            let solved = normal.solve(self.estimated);
            for (node, place) in self.nodes.iter_mut().zip(&solved.places) {
                node.place = *place;
            }
            self.covariance = solved.covariance;
            phi0 += solved.turn;
            if solved.turn.abs() < SAME {
                break;
            }
        }
        self.aligner.set_phi0(phi0);
    }

    /// The start direction, as it was given or found. **Units:** rad.
    pub fn direction(&self) -> Option<f64> {
        self.aligner.phi0()
    }

    /// All places as they are adjusted now: that of the start, then one for each step. **Units:** m; **Frame:** building.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.nodes.iter().map(|node| node.place.into())
    }
}

/// The normal equations. Both coordinates have the same matrix: diagonal and the values beside it.
struct Normal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    right: Vec<Vector2<f64>>,
    /// The border of `Phi0`, linearised: its column for both coordinates, its own value, its right side.
    border: Vec<Vector2<f64>>,
    own: f64,
    own_right: f64,
}

struct Solved {
    places: Vec<Vector2<f64>>,
    turn: f64,
    covariance: Matrix2<f64>,
}

impl Normal {
    fn of(nodes: &[Node], start: Option<(Vector2<f64>, f64)>, phi0: f64, p: &Documented) -> Self {
        let (absolute, relative) = (p.fix_sigma_m.powi(-2), p.step_sigma_m.powi(-2));
        let count = nodes.len();
        let mut normal = Self {
            diagonal: vec![0.0; count],
            beside: vec![0.0; count.saturating_sub(1)],
            right: vec![Vector2::zeros(); count],
            border: vec![Vector2::zeros(); count],
            own: 0.0,
            own_right: 0.0,
        };
        // The position that is carried on by the steps, and how it turns with Phi0.
        let mut carried: Option<(Vector2<f64>, Vector2<f64>)> = None;
        for (index, node) in nodes.iter().enumerate() {
            if index > 0 {
                let along = Vector2::from(node.polar.along(phi0));
                let aside = Vector2::new(-along.y, along.x);
                normal.relative(index, relative, along, aside);
                carried = carried.map(|(place, turned)| (place + along, turned + aside));
            } else if let Some((place, sigma)) = start {
                carried = Some((place, Vector2::zeros()));
                normal.absolute(0, sigma.max(1e-3).powi(-2), place, Vector2::zeros());
                continue;
            }
            let weight = match node.fix {
                Some((place, count)) => {
                    carried = Some((place, Vector2::zeros()));
                    absolute * count
                }
                None => absolute,
            };
            if let Some((place, turned)) = carried {
                normal.absolute(index, weight, place, turned);
            }
        }
        normal
    }

    /// `p = place + turned dPhi`.
    fn absolute(&mut self, index: usize, weight: f64, place: Vector2<f64>, turned: Vector2<f64>) {
        self.diagonal[index] += weight;
        self.right[index] += place * weight;
        self.border[index] -= turned * weight;
        self.own += turned.norm_squared() * weight;
        self.own_right -= turned.dot(&place) * weight;
    }

    /// `p - p_before = along + aside dPhi`.
    fn relative(&mut self, index: usize, weight: f64, along: Vector2<f64>, aside: Vector2<f64>) {
        self.diagonal[index] += weight;
        self.diagonal[index - 1] += weight;
        self.beside[index - 1] -= weight;
        self.right[index] += along * weight;
        self.right[index - 1] -= along * weight;
        self.border[index] -= aside * weight;
        self.border[index - 1] += aside * weight;
        self.own += aside.norm_squared() * weight;
        self.own_right -= aside.dot(&along) * weight;
    }

    fn solve(mut self, estimated: bool) -> Solved {
        let count = self.diagonal.len();
        for index in 1..count {
            let factor = self.beside[index - 1] / self.diagonal[index - 1];
            self.diagonal[index] -= factor * self.beside[index - 1];
            let (right, border) = (self.right[index - 1], self.border[index - 1]);
            self.right[index] -= right * factor;
            self.border[index] -= border * factor;
        }
        let reduced = (self.right.clone(), self.border.clone());
        for index in (0..count).rev() {
            if let Some(&beside) = self.beside.get(index) {
                let (right, border) = (self.right[index + 1], self.border[index + 1]);
                self.right[index] -= right * beside;
                self.border[index] -= border * beside;
            }
            self.right[index] /= self.diagonal[index];
            self.border[index] /= self.diagonal[index];
        }
        let last = count - 1;
        let mut covariance = Matrix2::identity() / self.diagonal[last];
        if !estimated {
            return Solved { places: self.right, turn: 0.0, covariance };
        }
        // The border with its own value: what is left of it once the places are eliminated.
        let left = |ends: &[Vector2<f64>]| {
            let pairs = reduced.1.iter().zip(ends).zip(&self.diagonal);
            pairs.map(|((border, other), diagonal)| border.dot(other) / diagonal).sum::<f64>()
        };
        let own = self.own - left(&reduced.1);
        if own <= 1e-12 * self.own {
            return Solved { places: self.right, turn: 0.0, covariance };
        }
        let turn = (self.own_right - left(&reduced.0)) / own;
        let places = self.right.iter().zip(&self.border).map(|(place, border)| place - border * turn).collect();
        covariance += self.border[last] * self.border[last].transpose() / own;
        Solved { places, turn, covariance }
    }
}

impl Method for Adjustment {
    fn step(&mut self, step: &Step) {
        self.aligner.step(step).into_iter().for_each(|next| self.take(next));
    }

    fn observe(&mut self, observation: &Observation) {
        self.aligner.observe(observation).into_iter().for_each(|next| self.take(next));
    }

    fn estimate(&self) -> Option<Estimate> {
        let known = self.start.is_some() || self.nodes.iter().any(|node| node.fix.is_some());
        let place = self.nodes[self.nodes.len() - 1].place.into();
        self.aligner.estimate(known.then_some((place, self.covariance)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::polar::{Polars, tests::step};
    use super::*;
    use nalgebra::{SMatrix, SVector};
    use sohle_shared::time::Micros;

    const STEPS: usize = 48;
    /// Two coordinates of the start and of each step, and `Phi0`.
    const UNKNOWN: usize = 2 * (STEPS + 1) + 1;

    /// (2.18) as it stands: the whole design matrix, all weights, a dense inverse; for `Phi0` again and again.
    fn dense(
        polars: &[Polar],
        fixes: &[(usize, [f64; 2])],
        start: [f64; 2],
        mut phi0: f64,
        free: bool,
    ) -> (Vec<f64>, f64) {
        let p = Documented::default();
        type Row = SVector<f64, UNKNOWN>;
        let count = STEPS + 1;
        let mut found = Vec::new();
        for _ in 0..30 {
            let mut rows: Vec<(Row, f64, f64)> = Vec::new();
            let unit = |column: usize| Row::from_fn(|row, _| f64::from(row == column));
            let turn = unit(2 * count);
            let (mut carried, mut turned) = (start, [0.0; 2]);
            for index in 0..count {
                let [dx, dy] = if index > 0 { polars[index - 1].along(phi0) } else { [0.0; 2] };
                carried = [carried[0] + dx, carried[1] + dy];
                turned = [turned[0] - dy, turned[1] + dx];
                let fix = fixes.iter().find(|&&(after, _)| after == index);
                if let Some(&(_, place)) = fix {
                    (carried, turned) = (place, [0.0; 2]);
                }
                for axis in 0..2 {
                    let here = unit(2 * index + axis);
                    let sigma = if index == 0 { 0.5 } else { p.fix_sigma_m };
                    rows.push((here - turn * turned[axis], carried[axis], sigma));
                    if index > 0 {
                        let moved = [dx, dy][axis];
                        let aside = [-dy, dx][axis];
                        rows.push((here - unit(2 * index - 2 + axis) - turn * aside, moved, p.step_sigma_m));
                    }
                }
            }
            if !free {
                rows.iter_mut().for_each(|(row, ..)| row[UNKNOWN - 1] = 0.0);
                rows.push((turn, 0.0, 1.0));
            }
            let mut normal = SMatrix::<f64, UNKNOWN, UNKNOWN>::zeros();
            let mut right = Row::zeros();
            for (row, value, sigma) in &rows {
                normal += row * row.transpose() / (sigma * sigma);
                right += row * (*value / (sigma * sigma));
            }
            let solved = normal.lu().solve(&right).unwrap();
            if free {
                phi0 += solved[UNKNOWN - 1];
            }
            found = solved.iter().take(2 * count).copied().collect();
        }
        (found, phi0)
    }

    fn agrees(direction: Option<(f64, f64)>) {
        let start = Start { place: Some(([3.0, -2.0], 0.5)), direction };
        let mut adjustment = Adjustment::new(&Documented::default(), &start);
        let (mut polars, mut fixes, mut maker) = (Vec::new(), Vec::new(), Polars::default());
        let mut truth = [3.0, -2.0];
        for index in 0..STEPS as u32 {
            let next = step(index, f64::from(index), 0.7, 0.25 * f64::from(index).sin());
            let polar = maker.next(&next).unwrap();
            polars.push(polar);
            adjustment.step(&next);
            let [dx, dy] = polar.along(3.5);
            truth = [truth[0] + dx, truth[1] + dy];
            if index % 6 == 5 {
                let place = [truth[0] + 2.0 * f64::from(index).cos(), truth[1] - f64::from(index).sin()];
                fixes.push((polars.len(), place));
                adjustment.observe(&Observation::position(next.stance_end, place, 1.0));
            }
        }
        let first = direction.map_or(3.5, |(phi0, _)| phi0);
        let (places, phi0) = dense(&polars, &fixes, [3.0, -2.0], first, direction.is_none());
        let off = (adjustment.direction().unwrap() - phi0).rem_euclid(std::f64::consts::TAU);
        assert!(off.min(std::f64::consts::TAU - off) < 1e-9, "{off}");
        for (place, expected) in adjustment.places().zip(places.chunks(2)) {
            assert!((place[0] - expected[0]).abs() < 1e-9 && (place[1] - expected[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn with_a_given_direction_it_agrees_with_the_dense_solution() {
        agrees(Some((3.4, 0.0)));
    }

    #[test]
    fn with_an_estimated_direction_too() {
        agrees(None);
    }

    #[test]
    fn its_covariance_is_that_of_the_dense_inverse() {
        // Start known to 0.5 m, two steps, a position: by hand. In weights of 1/m²: start 4, step 25, position 1/9.
        let start = Start { place: Some(([0.0; 2], 0.5)), direction: Some((0.0, 0.0)) };
        let mut adjustment = Adjustment::new(&Documented::default(), &start);
        adjustment.step(&step(0, 0.0, 1.0, 0.0));
        adjustment.step(&step(1, 1.0, 1.0, 0.0));
        adjustment.observe(&Observation::position(Micros(1_000_000), [2.0, 0.3], 1.0));
        let first = 1.0 / 9.0 + 1.0 / (1.0 / 25.0 + 1.0 / 4.0);
        let expected = 1.0 / (1.0 / 9.0 + 1.0 / (1.0 / 25.0 + 1.0 / first));
        let found = adjustment.estimate().unwrap();
        assert!((found.covariance[(0, 0)] - expected).abs() < 1e-12 && found.covariance[(0, 1)] == 0.0, "{found:?}");
    }
}
