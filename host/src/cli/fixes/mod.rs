//! Positions of other sources, as `replay` and `live` take them: lines come in, are put together with the steps, and what became
//! of them is told.

mod source;
mod summary;

pub use source::{Source, Stream};

use super::located::Following;
use super::{Error, print};
use crate::building::Building;
use crate::building::georeference::Projection;
use crate::fixes::intake::Arrived;
use crate::fixes::line::Clock;
use crate::fixes::{Estimate, Fix, Intake, Method, Observation, Outcome, Smoother, Start, smoother};
use serde_json::{Value as Json, json};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::collections::VecDeque;
use std::path::Path;

/// So many messages of a kind are told one by one.
const MOST_TOLD: usize = 10;
/// A place that is known no better (root of the sum of the variances) is none. **Units:** m.
const KNOWN_M: f64 = 10.0;

/// Fixes that come in while steps are gone through, and the smoother that takes both.
pub struct Incoming {
    intake: Intake,
    /// What will be heard later, in the order of arrival.
    waiting: VecDeque<Arrived>,
    smoother: Smoother,
    /// All that was said, in the order of the lines.
    fixes: Vec<Fix>,
    /// The place as it was said after each step.
    said: Vec<Estimate>,
    told: usize,
    quiet: bool,
}

/// Those of `source`, if one is given, or else those of a recording, if it has some; in the frame of the building where somebody is
/// followed.
pub fn incoming(
    (source, recorded): (Option<&Source>, &[Fix]),
    following: Option<&Following>,
    clock: Clock,
    parameters: &smoother::Parameters,
    quiet: bool,
) -> Result<Option<Incoming>, Error> {
    let building = following.map(|following| &**following.follower().building());
    let new = || Incoming::new(building, parameters, quiet);
    match source {
        Some(source) => {
            let mut incoming = new()?;
            incoming.read(source, clock)?;
            Ok(Some(incoming))
        }
        None if recorded.is_empty() => Ok(None),
        None => {
            let mut incoming = new()?;
            recorded.iter().for_each(|fix| incoming.take(fix, "of the recording"));
            Ok(Some(incoming))
        }
    }
}

/// Steps and positions without a building: goes through all, writes and tells.
pub fn alone(incoming: Option<Incoming>, steps: &[Step], folder: &Path, quiet: bool) -> Result<(), Error> {
    let Some(mut incoming) = incoming else { return Ok(()) };
    steps.iter().for_each(|step| incoming.step(step, |_| ()));
    let told = incoming.finish(Some(folder))?;
    if quiet { Ok(()) } else { print(&format!("\n{told}")) }
}

impl Incoming {
    /// Nothing has come, and nothing is known of the start.
    pub fn new(building: Option<&Building>, parameters: &smoother::Parameters, quiet: bool) -> Result<Self, Error> {
        Ok(Self {
            intake: Intake::new(building)?,
            waiting: VecDeque::new(),
            smoother: Smoother::new(parameters, &Start::default()),
            fixes: Vec::new(),
            said: Vec::new(),
            told: 0,
            quiet,
        })
    }

    /// Reads all lines.
    fn read(&mut self, source: &Source, clock: Clock) -> Result<(), Error> {
        for (index, line) in source.text()?.lines().enumerate() {
            if let Some(fix) = self.line(line, &format!("{source}, line {}", index + 1), clock) {
                self.fixes.push(fix);
            }
        }
        Ok(())
    }

    /// Reads a line, which is told by `name` if something is wrong with it; it is passed over then. What it says, if it is a fix.
    pub fn line(&mut self, line: &str, name: &str, clock: Clock) -> Option<Fix> {
        if line.trim().is_empty() {
            return None;
        }
        match self.intake.line(line, clock) {
            Ok(fix) => {
                self.take(&fix, name);
                Some(fix)
            }
            Err(why) => {
                self.tell(&format!("{name}: {why}"));
                None
            }
        }
    }

    /// Keeps a fix until it is its turn, unless it is of no use.
    fn take(&mut self, fix: &Fix, name: &str) {
        match self.intake.admit(fix) {
            Ok(arrived) => {
                let after = self.waiting.partition_point(|other| other.time <= arrived.time);
                self.waiting.insert(after, arrived);
            }
            Err(why) => self.tell(&format!("{name}: {}: {why}", fix.source)),
        }
    }

    /// All that was said, for a recording.
    pub fn fixes(&self) -> &[Fix] {
        &self.fixes
    }

    /// Tells of something that may happen often.
    fn tell(&mut self, message: &str) {
        self.told += 1;
        match self.told {
            _ if self.quiet => {}
            told if told <= MOST_TOLD => eprintln!("{message}"),
            told if told == MOST_TOLD + 1 => eprintln!("more of that kind is counted only"),
            _ => {}
        }
    }

    /// Hears all that has arrived before a time; the observations go to `also` too.
    pub fn hear(&mut self, until: Micros, mut also: impl FnMut(&Observation)) {
        while self.waiting.front().is_some_and(|arrived| arrived.time < until) {
            let Some(Arrived { observation, .. }) = self.waiting.pop_front() else { break };
            let verdict = self.smoother.hear(&observation);
            if verdict.outcome != Outcome::Taken {
                self.tell(&format!("{:.1} s: {verdict}", observation.time.as_seconds()));
            }
            if let Some(contradiction) = self.intake.judged(&observation, &verdict)
                && !self.quiet
            {
                eprintln!("{:.1} s: {contradiction}", observation.time.as_seconds());
            }
            if !matches!(verdict.outcome, Outcome::TooLate(_) | Outcome::TooEarly(_)) {
                also(&observation);
            }
        }
    }

    /// Takes in a step, after all that arrived until its end; the latter go to `also` too.
    pub fn step(&mut self, step: &Step, also: impl FnMut(&Observation)) {
        self.hear(step.stance_end + 1, also);
        self.smoother.step(step);
        self.said.extend(self.smoother.estimate());
    }

    /// Where steps and positions say that somebody is now, if they know.
    pub fn estimate(&self) -> Option<Estimate> {
        self.smoother.estimate().filter(|estimate| estimate.sigma_m() < KNOWN_M)
    }

    /// The same for programs.
    pub fn object(&self, projection: Option<&Projection>) -> Option<Json> {
        let (estimate, found) = (self.estimate()?, self.smoother.calibration()?);
        let c = estimate.covariance;
        let lon_lat = projection.and_then(|projection| projection.to_earth(estimate.place).ok());
        Some(json!({
            "position_m": estimate.place, "sigma_m": estimate.sigma_m(),
            "covariance_m2": [[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]],
            "heading_deg": found.heading.0.to_degrees(), "heading_sigma_deg": found.heading.1.to_degrees(),
            "lon_lat": lon_lat,
        }))
    }
}
