//! Where fixes come in: lines are read and checked, what becomes of them is counted, and sources that contradict each other
//! are told of.

use super::fix::{Fix, Frame};
use super::line::LineError;
use super::line::{self, Clock};
use super::observation::{Frames, Observation, Refused};
use super::smoother::{Outcome, Verdict};
use crate::building::{Building, Error, Georeference};
use nalgebra::Vector2;
use sohle_shared::time::Micros;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// Positions of a source that are compared with those of another, at least and at most.
const COMPARED: (usize, usize) = (5, 12);
/// Two sources contradict each other when their means differ by more than so many standard deviations.
const CONTRADICT: f64 = 4.0;
/// Nearer means than this are no contradiction that anybody would want to hear of. **Units:** m.
const NEAR_M: f64 = 1.0;

/// What became of the fixes of one source.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Those that count.
    pub taken: usize,
    /// Those that are likelier outliers.
    pub doubted: usize,
    /// Those that came too late, or too early.
    pub out_of_time: usize,
    /// Refused, by why.
    pub refused: BTreeMap<&'static str, usize>,
    /// The last ones: how far off the belief, and its variance for each axis.
    last: VecDeque<(Vector2<f64>, f64)>,
}

impl Tally {
    /// All that came.
    pub fn count(&self) -> usize {
        self.taken + self.doubted + self.out_of_time + self.refused.values().sum::<usize>()
    }

    /// Mean of the last ones and its variance.
    fn mean(&self) -> Option<(Vector2<f64>, f64)> {
        let count = self.last.len();
        let sum: Vector2<f64> = self.last.iter().map(|(off, _)| off).sum();
        let variance: f64 = self.last.iter().map(|(_, variance)| variance).sum();
        (count >= COMPARED.0).then(|| (sum / count as f64, variance / (count * count) as f64))
    }
}

/// An observation that waits for its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrived {
    /// When it came, by the clock of the steps.
    pub time: Micros,
    /// Itself.
    pub observation: Observation,
}

/// Takes lines in, and counts.
#[derive(Clone, Debug, Default)]
pub struct Intake {
    frames: Option<Frames>,
    tallies: BTreeMap<Arc<str>, Tally>,
    /// Lines that are no fixes.
    spoilt: usize,
    /// Pairs of sources that were told of.
    contradicting: BTreeSet<(Arc<str>, Arc<str>)>,
}

impl Intake {
    /// For a building, or for wherever the first fix is.
    ///
    /// # Errors
    /// As [`Georeference::projection`].
    pub fn new(building: Option<&Building>) -> Result<Self, Error> {
        Ok(Self { frames: building.map(Frames::of).transpose()?, ..Self::default() })
    }

    /// Reads a line.
    ///
    /// # Errors
    /// As [`line::parse`]; it is counted.
    pub fn line(&mut self, text: &str, clock: Clock) -> Result<Fix, LineError> {
        line::parse(text, clock).inspect_err(|_| self.spoilt += 1)
    }

    /// Puts a fix into the frame of the building.
    ///
    /// # Errors
    /// Why it is of no use; it is counted.
    pub fn admit(&mut self, fix: &Fix) -> Result<Arrived, Refused> {
        if self.frames.is_none() {
            let place = match fix.measured {
                super::Measured::Position { place, .. } => place,
                super::Measured::Range { anchor, .. } => anchor,
            };
            let around = match fix.frame {
                Frame::Building => Ok(Georeference::Local),
                Frame::Utm(epsg) => Ok(Georeference::Utm { epsg, origin: place.map(f64::round) }),
                Frame::Geographic => Georeference::around(place[0], place[1]),
            };
            // A first fix that is nowhere is refused below; the next decides.
            self.frames = around.and_then(Frames::at).ok();
        }
        let observed = match &self.frames {
            Some(frames) => frames.observe(fix),
            None => Frames::default().observe(fix),
        };
        let arrived = |observation| Arrived { time: fix.arrived.max(fix.time), observation };
        observed.map(arrived).inspect_err(|refused| {
            let tally = self.tallies.entry(fix.source.clone()).or_default();
            *tally.refused.entry(refused.word()).or_default() += 1;
        })
    }

    /// Counts what became of one; tells of a contradiction that comes to light.
    pub fn judged(&mut self, observation: &Observation, verdict: &Verdict) -> Option<String> {
        let tally = self.tallies.entry(verdict.source.clone()).or_default();
        match verdict.outcome {
            Outcome::Taken => tally.taken += 1,
            Outcome::Doubted => tally.doubted += 1,
            Outcome::TooLate(_) | Outcome::TooEarly(_) => {
                tally.out_of_time += 1;
                return None;
            }
        }
        let super::Measured::Position { covariance, .. } = observation.measured else { return None };
        tally.last.push_back((verdict.off, covariance.trace() / 2.0));
        if tally.last.len() > COMPARED.1 {
            tally.last.pop_front();
        }
        self.contradiction(&verdict.source)
    }

    fn contradiction(&mut self, source: &Arc<str>) -> Option<String> {
        let (own, variance) = self.tallies.get(source)?.mean()?;
        for (other, tally) in self.tallies.iter().filter(|(other, _)| *other != source) {
            let Some((mean, other_variance)) = tally.mean() else { continue };
            let apart = (own - mean).norm();
            if apart < NEAR_M || apart < CONTRADICT * (variance + other_variance).sqrt() {
                continue;
            }
            let pair = if source < other { (source.clone(), other.clone()) } else { (other.clone(), source.clone()) };
            let told = format!(
                "{} and {} contradict each other: their last positions are {apart:.1} m apart on average, by their own words \
                 {:.1} m",
                pair.0,
                pair.1,
                (variance + other_variance).sqrt()
            );
            if self.contradicting.insert(pair) {
                return Some(told);
            }
        }
        None
    }

    /// What became of all, by source.
    pub fn tallies(&self) -> &BTreeMap<Arc<str>, Tally> {
        &self.tallies
    }

    /// Lines that were no fixes.
    pub fn spoilt(&self) -> usize {
        self.spoilt
    }

    /// Pairs of sources that contradict each other.
    pub fn contradicting(&self) -> usize {
        self.contradicting.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(source: &str, off: [f64; 2]) -> (Observation, Verdict) {
        let source: Arc<str> = source.into();
        let off = Vector2::from(off);
        let outcome = Outcome::Taken;
        let verdict = Verdict { source: source.clone(), outcome, off_m: off.norm(), off, normalised: 1.0, weight: 1.0 };
        (Observation { source, ..Observation::position(Micros(0), [0.0; 2], 1.0) }, verdict)
    }

    #[test]
    fn lines_are_counted_by_what_is_wrong_with_them() {
        let building = crate::building::generate::twin(2);
        let mut intake = Intake::new(Some(&building)).unwrap();
        let clock = Clock::default();
        let good = r#"{"time_us":1,"arrived_us":3,"source":"uwb","position":[1,2],"sigma_m":1}"#;
        let fix = intake.line(good, clock).unwrap();
        assert_eq!(intake.admit(&fix).unwrap().time, Micros(3));
        assert!(intake.line("no JSON", clock).is_err());
        for (line, word) in [
            (good.replace("}", r#","floor":7}"#), "floor 7 is not in the building"),
            (good.replace("}", r#","frame":"EPSG:4326"}"#), "has no georeference"),
            (good.replace(r#""time_us":1"#, r#""time_us":9000000"#), "after it arrived"),
            (good.replace(r#""sigma_m":1"#, r#""sigma_m":-1"#), "covariance"),
        ] {
            let fix = intake.line(&line, clock).unwrap();
            let told = intake.admit(&fix).unwrap_err().to_string();
            assert!(told.contains(word), "{told}");
        }
        let tally = &intake.tallies()["uwb"];
        assert_eq!((tally.count(), tally.refused.len(), intake.spoilt()), (4, 4, 1));
    }

    #[test]
    fn sources_that_contradict_each_other_are_told_of_once() {
        let mut intake = Intake::default();
        let mut told = Vec::new();
        for i in 0..20 {
            let wobble = 0.3 * f64::from(i).sin();
            for (source, off) in [("5g", [2.5 + wobble, 0.0]), ("uwb", [-2.5, wobble]), ("wifi", [2.2, wobble])] {
                let (observation, verdict) = verdict(source, off);
                told.extend(intake.judged(&observation, &verdict));
            }
        }
        assert_eq!((told.len(), intake.contradicting()), (2, 2), "{told:?}");
        assert!(told[0].starts_with("5g and uwb contradict each other"), "{told:?}");
        assert_eq!(intake.tallies()["5g"].taken, 20);
    }

    #[test]
    fn without_a_building_the_first_fix_tells_where_it_is() {
        let mut intake = Intake::new(None).unwrap();
        let mut observed = |line: &str| {
            let fix = intake.line(line, Clock::default()).unwrap();
            intake.admit(&fix)
        };
        let first = observed(r#"{"time_us":1,"frame":"EPSG:4326","position":[10.0,53.5],"sigma_m":5}"#);
        let first = first.unwrap().observation;
        let super::super::Measured::Position { place, .. } = first.measured else { panic!("{first:?}") };
        // The origin is rounded to metres.
        assert!(place[0].abs() < 1.0 && place[1].abs() < 1.0, "{place:?}");
        assert!(observed(r#"{"time_us":2,"position":[3,4],"sigma_m":5}"#).is_ok());
    }
}
