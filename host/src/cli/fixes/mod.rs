//! Positions of other sources, as `replay` and `live` take them: lines come in, are put together with the steps, and what became
//! of them is told.

mod source;
mod summary;

pub use source::{Source, Stream};

use super::{Error, print};
use crate::building::Building;
use crate::building::georeference::Projection;
use crate::fixes::line::Clock;
use crate::fixes::{Estimate, Fix, Fusion, Observation, Outcome, smoother};
use serde_json::{Value as Json, json};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::path::Path;

/// So many messages of a kind are told one by one.
const MOST_TOLD: usize = 10;

/// Fixes that come in while steps are gone through, put together with them; what is wrong with them is told.
pub struct Incoming {
    fusion: Fusion,
    /// All that was said, in the order of the lines.
    fixes: Vec<Fix>,
    told: usize,
    quiet: bool,
}

/// Those of `source`, if one is given, or else those of a recording, if it has some; in the frame of the building, if there is one.
pub fn incoming(
    (source, recorded): (Option<&Source>, &[Fix]),
    building: Option<&Building>,
    clock: Clock,
    parameters: &smoother::Parameters,
    quiet: bool,
) -> Result<Option<Incoming>, Error> {
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
        Ok(Self { fusion: Fusion::new(building, parameters)?, fixes: Vec::new(), told: 0, quiet })
    }

    /// Reads all lines.
    pub fn read(&mut self, source: &Source, clock: Clock) -> Result<(), Error> {
        for (index, line) in source.text(source::FIXES)?.lines().enumerate() {
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
        match self.fusion.line(line, clock) {
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
        if let Err(why) = self.fusion.take(fix) {
            self.tell(&format!("{name}: {}: {why}", fix.source));
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
        while let Some(heard) = self.fusion.hear(until) {
            let time = heard.observation.time.as_seconds();
            if heard.verdict.outcome != Outcome::Taken {
                self.tell(&format!("{time:.1} s: {}", heard.verdict));
            }
            if let Some(contradiction) = &heard.contradiction
                && !self.quiet
            {
                eprintln!("{time:.1} s: {contradiction}");
            }
            if heard.counts() {
                also(&heard.observation);
            }
        }
    }

    /// Takes in a step, after all that arrived until its end; the latter go to `also` too.
    pub fn step(&mut self, step: &Step, also: impl FnMut(&Observation)) {
        self.hear(step.stance_end + 1, also);
        self.fusion.step(step);
    }

    /// Steps and positions together.
    pub fn fusion(&self) -> &Fusion {
        &self.fusion
    }

    /// Where steps and positions say that somebody is now, if they know.
    pub fn estimate(&self) -> Option<Estimate> {
        self.fusion.estimate()
    }

    /// The same for programs.
    pub fn object(&self, projection: Option<&Projection>) -> Option<Json> {
        let (estimate, found) = (self.estimate()?, self.fusion.smoother().calibration()?);
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
