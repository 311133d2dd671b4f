//! A walk of hours with a phone, step by step and position by position, to be timed.

use crate::fixes::{Method, Observation};
use crate::phone::{self, Measured};
use sohle_shared::time::Micros;

/// From step to step. **Units:** us.
pub const STEP_US: i64 = 600_000;
/// Rounds of a hundred steps, so that the walk comes by where it was.
const ROUND: u32 = 100;

/// A walk round and round, with a position for each step. They are right up to something that comes again and again.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walker {
    count: u32,
    place: [f64; 2],
    heading: f64,
}

impl Walker {
    /// Makes a step and, if it is `told` of it, hears of a position; both go to the method.
    pub fn step<M: Method + ?Sized>(&mut self, method: &mut M, told: bool) {
        let time = Micros(i64::from(self.count) * STEP_US);
        let turn = std::f64::consts::TAU / f64::from(ROUND);
        let length = 0.7;
        let settings = phone::Parameters::default();
        let measured = Measured { index: self.count, time, length, part: settings.length_part, turn, rise: Some(0.0) };
        self.heading += turn;
        let (sin, cos) = self.heading.sin_cos();
        self.place = [self.place[0] + length * cos, self.place[1] + length * sin];
        method.step(&measured.step(&settings));
        let noise = |part: f64| (f64::from(self.count) * part).sin();
        if told {
            let said = [self.place[0] + noise(12.9898), self.place[1] + noise(78.233)];
            method.observe(&Observation::position(time, said, 1.0));
        }
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixes::{Smoother, Start, smoother};

    #[test]
    fn after_an_hour_the_smoother_holds_no_more_than_before_and_knows_the_place() {
        let parameters = smoother::Parameters { window: 30, ..smoother::Parameters::default() };
        let (mut walker, mut smoother) = (Walker::default(), Smoother::new(&parameters, &Start::default()));
        for _ in 0..6_000 {
            walker.step(&mut smoother, true);
            smoother.take_settled();
        }
        assert_eq!(smoother.open_part().len(), 30);
        let place = smoother.estimate().unwrap().place;
        let off = (place[0] - walker.place[0]).hypot(place[1] - walker.place[1]);
        assert!(off < 1.0, "{off}");
    }
}
