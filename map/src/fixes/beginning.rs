//! The beginning of a walk whose start direction nobody gave: steps and positions wait until they show it.

use super::polar::Polar;
use crate::alignment::{Rigid, distance};

/// What waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Waiting {
    /// A step.
    Step(Polar),
    /// A position. **Units:** m.
    Fix([f64; 2]),
}

/// Waits for `Phi0`.
#[derive(Clone, Debug, Default)]
pub struct Beginning {
    start: Option<[f64; 2]>,
    waiting: Vec<Waiting>,
}

impl Beginning {
    /// Nothing has come; where the first step begins may be known.
    pub fn new(start: Option<[f64; 2]>) -> Self {
        Self { start, waiting: Vec::new() }
    }

    /// Takes in what comes.
    pub fn push(&mut self, next: Waiting) {
        self.waiting.push(next);
    }

    /// The last position.
    pub fn last(&self) -> Option<[f64; 2]> {
        let fix = |waiting: &Waiting| match *waiting {
            Waiting::Fix(place) => Some(place),
            Waiting::Step(_) => None,
        };
        self.waiting.iter().rev().find_map(fix).or(self.start)
    }

    /// The start direction, once positions lie `spread_m` apart. **Units:** rad.
    pub fn direction(&self, spread_m: f64) -> Option<f64> {
        let mut here = [0.0; 2];
        let (mut own, mut said): (Vec<_>, Vec<_>) = self.start.into_iter().map(|start| (here, start)).unzip();
        for waiting in &self.waiting {
            match waiting {
                Waiting::Step(step) => {
                    let [dx, dy] = step.along(0.0);
                    here = [here[0] + dx, here[1] + dy];
                }
                Waiting::Fix(place) => {
                    own.push(here);
                    said.push(*place);
                }
            }
        }
        let first = *said.first()?;
        let apart = said.iter().any(|&place| distance(place, first) >= spread_m);
        apart.then(|| Rigid::fit(&own, &said).angle())
    }

    /// All that has waited, in its order.
    pub fn into_waiting(self) -> Vec<Waiting> {
        self.waiting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_is_found_once_positions_are_apart() {
        let mut beginning = Beginning::new(Some([5.0, 5.0]));
        let mut place = [5.0; 2];
        for i in 0..20 {
            let step = Polar { length: 0.7, direction: 0.02 * f64::from(i) };
            beginning.push(Waiting::Step(step));
            assert_eq!((beginning.direction(10.0), beginning.last()), (None, Some([5.0, 5.0])));
            let [dx, dy] = step.along(3.5);
            place = [place[0] + dx, place[1] + dy];
        }
        beginning.push(Waiting::Fix(place));
        assert!((beginning.direction(10.0).unwrap() - (3.5 - std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!((beginning.last(), beginning.into_waiting().len()), (Some(place), 21));
    }
}
