//! Steps and positions as they come in, put together: what the programs hold beside whoever follows in a building.

use super::intake::Arrived;
use super::line::{Clock, LineError};
use super::{Estimate, Fix, Intake, Method, Observation, Outcome, Refused, Smoother, Start, Verdict, smoother};
use crate::building::{Building, Error};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::collections::VecDeque;

/// A place that is known no better (root of the sum of the variances) is none. **Units:** m.
const KNOWN_M: f64 = 10.0;

/// Positions and steps, and the smoother that takes both.
#[derive(Clone, Debug)]
pub struct Fusion {
    intake: Intake,
    /// What will be heard later, in the order of arrival.
    waiting: VecDeque<Arrived>,
    smoother: Smoother,
    /// Index of the last step.
    step: Option<u32>,
    said: Vec<Estimate>,
    counted: Vec<(Option<u32>, Observation)>,
}

/// A position that was heard.
#[derive(Clone, Debug)]
pub struct Heard {
    /// In the frame of the building.
    pub observation: Observation,
    /// What became of it.
    pub verdict: Verdict,
    /// Sources that turn out to contradict each other.
    pub contradiction: Option<String>,
}

impl Heard {
    /// Whether it is of use to other methods too: it came in time.
    pub fn counts(&self) -> bool {
        !matches!(self.verdict.outcome, Outcome::TooLate(_) | Outcome::TooEarly(_))
    }
}

impl Fusion {
    /// Nothing has come, and nothing is known of the start.
    ///
    /// # Errors
    /// As [`Intake::new`].
    pub fn new(building: Option<&Building>, parameters: &smoother::Parameters) -> Result<Self, Error> {
        Ok(Self {
            intake: Intake::new(building)?,
            waiting: VecDeque::new(),
            smoother: Smoother::new(parameters, &Start::default()),
            step: None,
            said: Vec::new(),
            counted: Vec::new(),
        })
    }

    /// As if no step had been made and nothing had been heard, but for what waits.
    pub fn anew(&self) -> Self {
        let smoother = Smoother::new(self.smoother.parameters(), &Start::default());
        Self { smoother, step: None, said: Vec::new(), counted: Vec::new(), ..self.clone() }
    }

    /// Reads a line.
    ///
    /// # Errors
    /// As [`Intake::line`].
    pub fn line(&mut self, text: &str, clock: Clock) -> Result<Fix, LineError> {
        self.intake.line(text, clock)
    }

    /// Keeps a fix until it is its turn.
    ///
    /// # Errors
    /// Why it is of no use; it is counted.
    pub fn take(&mut self, fix: &Fix) -> Result<(), Refused> {
        let arrived = self.intake.admit(fix)?;
        let after = self.waiting.partition_point(|other| other.time <= arrived.time);
        self.waiting.insert(after, arrived);
        Ok(())
    }

    /// Hears the next that has arrived before a time, if there is one.
    pub fn hear(&mut self, until: Micros) -> Option<Heard> {
        let Arrived { observation, .. } = self.waiting.pop_front_if(|arrived| arrived.time < until)?;
        let verdict = self.smoother.hear(&observation);
        let contradiction = self.intake.judged(&observation, &verdict);
        let heard = Heard { observation, verdict, contradiction };
        if heard.counts() {
            self.counted.push((self.step, heard.observation.clone()));
        }
        Some(heard)
    }

    /// Takes in a step, after what has arrived until its end was heard.
    pub fn step(&mut self, step: &Step) {
        self.step = Some(step.index);
        self.smoother.step(step);
        self.said.extend(self.smoother.estimate());
    }

    /// Where steps and positions say that somebody is now, if they know.
    pub fn estimate(&self) -> Option<Estimate> {
        self.smoother.estimate().filter(|estimate| estimate.sigma_m() < KNOWN_M)
    }

    /// The place as it was said after each step, since there was one.
    pub fn said(&self) -> &[Estimate] {
        &self.said
    }

    /// All that counted, each with the index of the step before it, if there was one.
    pub fn counted(&self) -> &[(Option<u32>, Observation)] {
        &self.counted
    }

    /// How many have come that were not heard yet.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// What came in.
    pub fn intake(&self) -> &Intake {
        &self.intake
    }

    /// What puts them together.
    pub fn smoother(&self) -> &Smoother {
        &self.smoother
    }

    /// The same, to take out what is settled.
    pub fn smoother_mut(&mut self) -> &mut Smoother {
        &mut self.smoother
    }
}

#[cfg(test)]
mod tests {
    use super::super::polar::tests::step;
    use super::*;

    #[test]
    fn positions_are_heard_in_the_order_of_their_arrival_and_kept_with_the_step_before_them() {
        let settings = smoother::Parameters { window: 15, ..smoother::Parameters::default() };
        let mut fusion = Fusion::new(None, &settings).unwrap();
        let line = |measured: f64, arrived: f64, x: f64| {
            let [measured, arrived] = [measured, arrived].map(|seconds| Micros::from_seconds(seconds).0);
            format!(r#"{{"time_us":{measured},"arrived_us":{arrived},"position":[{x},0.0],"sigma_m":0.5}}"#)
        };
        // The second was measured before the first and comes after it; the last one is of no use so late.
        for text in [
            line(2.0, 2.0, 1.4),
            line(1.0, 3.5, 0.7),
            line(14.0, 14.0, 9.8),
            line(20.0, 20.0, 14.0),
            line(1.0, 9_000.0, 0.7),
        ] {
            let fix = fusion.line(&text, Clock::default()).unwrap();
            fusion.take(&fix).unwrap();
        }
        assert_eq!(fusion.waiting(), 5);
        let mut heard = Vec::new();
        for index in 0..30 {
            let step = step(index, f64::from(index), 0.7, 0.0);
            heard.extend(std::iter::from_fn(|| fusion.hear(step.stance_end + 1)));
            fusion.step(&step);
        }
        let times: Vec<f64> = heard.iter().map(|heard| heard.observation.time.as_seconds()).collect();
        assert_eq!((times, fusion.waiting()), (vec![2.0, 1.0, 14.0, 20.0], 1));
        assert!(fusion.estimate().is_some() && !fusion.said().is_empty());
        let late = fusion.hear(Micros::from_seconds(1e4)).unwrap();
        assert!(!late.counts(), "{:?}", late.verdict);
        let before: Vec<_> = fusion.counted().iter().filter_map(|(step, _)| *step).collect();
        assert_eq!(before, [1, 3, 13, 19]);
    }
}
