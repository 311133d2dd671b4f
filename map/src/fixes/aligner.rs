//! The way into each of the document's methods: steps become polar ones, and while nobody knows the start direction, all waits
//! until positions show it.

use super::beginning::{Beginning, Waiting};
use super::fix::Measured;
use super::method::{Estimate, Start};
use super::observation::Observation;
use super::parameters::Documented;
use super::polar::Polars;
use nalgebra::Matrix2;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// Hands on what comes, as soon as `Phi0` is known for it.
#[derive(Clone, Debug)]
pub struct Aligner {
    polars: Polars,
    phi0: Result<f64, Beginning>,
    time: Micros,
    spread_m: f64,
    fix_sigma_m: f64,
}

impl Aligner {
    /// Believes a start direction that is given.
    pub fn new(parameters: &Documented, start: &Start) -> Self {
        let beginning = || Beginning::new(start.place.map(|(place, _)| place));
        Self {
            polars: Polars::default(),
            phi0: start.direction.map(|(phi0, _)| phi0).ok_or_else(beginning),
            time: Micros(0),
            spread_m: parameters.spread_m,
            fix_sigma_m: parameters.fix_sigma_m,
        }
    }

    /// Takes in a step; what the method is to take now. A step that is no number is none.
    pub fn step(&mut self, step: &Step) -> Vec<Waiting> {
        let Some(polar) = self.polars.next(step) else { return Vec::new() };
        self.time = step.stance_end;
        self.hand_on(Waiting::Step(polar))
    }

    /// Takes in a position; what the method is to take now. The document has no ranges.
    pub fn observe(&mut self, observation: &Observation) -> Vec<Waiting> {
        match observation.measured {
            Measured::Position { place, .. } => self.hand_on(Waiting::Fix(place)),
            Measured::Range { .. } => Vec::new(),
        }
    }

    fn hand_on(&mut self, next: Waiting) -> Vec<Waiting> {
        let Err(beginning) = &mut self.phi0 else { return vec![next] };
        beginning.push(next);
        let Some(phi0) = beginning.direction(self.spread_m) else { return Vec::new() };
        std::mem::replace(&mut self.phi0, Ok(phi0)).err().map(Beginning::into_waiting).unwrap_or_default()
    }

    /// `Phi0`, as it was given or found. **Units:** rad.
    pub fn phi0(&self) -> Option<f64> {
        self.phi0.as_ref().ok().copied()
    }

    /// `Phi0` is known better.
    pub fn set_phi0(&mut self, phi0: f64) {
        self.phi0 = Ok(phi0);
    }

    /// What the method says now: place and covariance as it knows them, or the last position while all waits.
    pub fn estimate(&self, known: Option<([f64; 2], Matrix2<f64>)>) -> Option<Estimate> {
        let time = self.time;
        match &self.phi0 {
            Ok(_) => known.map(|(place, covariance)| Estimate { time, place, covariance }),
            Err(beginning) => beginning.last().map(|place| Estimate::of_fix(time, place, self.fix_sigma_m)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::polar::tests::step;
    use super::*;

    #[test]
    fn all_waits_for_the_direction_and_comes_in_its_order() {
        let mut aligner = Aligner::new(&Documented::default(), &Start::default());
        let fix = |x: f64| Observation::position(Micros(0), [x, 0.0], 1.0);
        let mut released = aligner.observe(&fix(0.0));
        for index in 0..20 {
            released.extend(aligner.step(&step(index, f64::from(index), 0.7, 0.0)));
        }
        assert!(released.is_empty() && aligner.phi0().is_none());
        assert_eq!(aligner.estimate(None).unwrap().place, [0.0; 2]);
        let released = aligner.observe(&fix(14.0));
        assert_eq!((released.first(), released.len()), (Some(&Waiting::Fix([0.0; 2])), 22));
        assert!(aligner.phi0().unwrap().abs() < 1e-9);
        assert_eq!(aligner.step(&step(20, 20.0, 0.7, 0.0)).len(), 1);
        // Whoever knows nothing of a place says nothing from now on.
        assert_eq!(aligner.estimate(None), None);
    }
}
