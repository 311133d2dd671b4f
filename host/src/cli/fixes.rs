//! Positions of other sources, as `replay` takes them: a file of lines, or the standard input.

use super::located::Following;
use super::table::Table;
use super::{Error, print};
use crate::building::Building;
use crate::export::file;
use crate::fixes::intake::Arrived;
use crate::fixes::line::Epoch;
use crate::fixes::{Estimate, Intake, Method, Observation, Outcome, Smoother, Start, smoother};
use sohle_shared::step::Step;
use std::collections::VecDeque;
use std::fmt::Write;
use std::io::Read;
use std::path::Path;

/// The path that steps and positions give together.
const PATH: &str = "fixes.csv";
/// So many messages of a kind are told one by one.
const MOST_TOLD: usize = 10;

/// Fixes that come in while steps are gone through, and the smoother that takes both.
pub struct Incoming {
    intake: Intake,
    waiting: VecDeque<Arrived>,
    smoother: Smoother,
    /// As it was said after each step.
    said: Vec<Estimate>,
    told: usize,
    quiet: bool,
}

/// Those of a file, if one is given, in the frame of the building where somebody is followed.
pub fn incoming(
    path: Option<&Path>,
    following: Option<&Following>,
    epoch: Epoch,
    parameters: &smoother::Parameters,
    quiet: bool,
) -> Result<Option<Incoming>, Error> {
    let building = following.map(|following| &**following.follower().building());
    path.map(|path| Incoming::read(path, building, epoch, parameters, quiet)).transpose()
}

/// Steps and positions without a building: goes through all, writes and tells.
pub fn alone(incoming: Option<Incoming>, steps: &[Step], folder: &Path, quiet: bool) -> Result<(), Error> {
    let Some(mut incoming) = incoming else { return Ok(()) };
    steps.iter().for_each(|step| incoming.step(step, |_| ()));
    let told = incoming.finish(folder)?;
    if quiet { Ok(()) } else { print(&format!("\n{told}")) }
}

impl Incoming {
    /// Reads all lines; '-' is the standard input. What is wrong with a line is told, and the line is passed over.
    pub fn read(
        path: &Path,
        building: Option<&Building>,
        epoch: Epoch,
        parameters: &smoother::Parameters,
        quiet: bool,
    ) -> Result<Self, Error> {
        let refused = |error: std::io::Error| Error::new(format!("fixes {}: {error}", path.display()));
        let text = if path == Path::new("-") {
            let mut text = String::new();
            std::io::stdin().read_to_string(&mut text).map_err(refused)?;
            text
        } else {
            std::fs::read_to_string(path).map_err(refused)?
        };
        let mut incoming = Self {
            intake: Intake::new(building, epoch)?,
            waiting: VecDeque::new(),
            smoother: Smoother::new(parameters, &Start::default()),
            said: Vec::new(),
            told: 0,
            quiet,
        };
        for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            match incoming.intake.line(line) {
                Ok(arrived) => incoming.waiting.push_back(arrived),
                Err(why) => incoming.tell(&format!("{}, line {}: {why}", path.display(), index + 1)),
            }
        }
        incoming.waiting.make_contiguous().sort_by_key(|arrived| arrived.time);
        Ok(incoming)
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

    /// Takes in a step, after all that arrived before its end; the latter go to `also` too.
    pub fn step(&mut self, step: &Step, mut also: impl FnMut(&Observation)) {
        while self.waiting.front().is_some_and(|arrived| arrived.time < step.stance_end) {
            let Some(Arrived { observation, .. }) = self.waiting.pop_front() else { break };
            let verdict = self.smoother.hear(&observation);
            if verdict.outcome != Outcome::Taken {
                self.tell(&format!("{:.1} s: {verdict}", observation.time.as_seconds()));
            }
            if let Some(contradiction) = self.intake.judged(&observation, &verdict) {
                eprintln!("{:.1} s: {contradiction}", observation.time.as_seconds());
            }
            if !matches!(verdict.outcome, Outcome::TooLate(_) | Outcome::TooEarly(_)) {
                also(&observation);
            }
        }
        self.smoother.step(step);
        self.said.extend(self.smoother.estimate());
    }

    /// Writes the path, and returns what there is to tell.
    pub fn finish(mut self, folder: &Path) -> Result<String, Error> {
        file::folder(folder)?;
        let mut text = String::from("kind,time_s,x_m,y_m,sigma_m\n");
        let mut row = |kind: &str, time: f64, [x, y]: [f64; 2], sigma: Option<f64>| {
            let sigma = sigma.map_or_else(String::new, |sigma| format!("{sigma:.3}"));
            let _ = writeln!(text, "{kind},{time:.3},{x:.3},{y:.3},{sigma}");
        };
        for said in &self.said {
            row("said", said.time.as_seconds(), said.place, Some(said.sigma_m()));
        }
        for settled in self.smoother.take_settled() {
            row("corrected", settled.time.as_seconds(), settled.place, None);
        }
        for open in self.smoother.open_part() {
            row("corrected", open.time.as_seconds(), open.place, Some(open.sigma_m()));
        }
        file::write(&folder.join(PATH), text.as_bytes())?;
        Ok(format!("{}Written to {}: {PATH}\n", self.summary(), folder.display()))
    }

    /// What became of the fixes, and what they told of the steps.
    fn summary(&self) -> String {
        let mut table = Table::new("positions of", &["all", "taken", "doubted", "too late", "refused", "because"]);
        for (source, tally) in self.intake.tallies() {
            let refused: usize = tally.refused.values().sum();
            let why: Vec<_> = tally.refused.iter().map(|(why, count)| format!("{why} {count}")).collect();
            let counts = [tally.count(), tally.taken, tally.doubted, tally.out_of_time, refused];
            let mut cells: Vec<_> = counts.iter().map(usize::to_string).collect();
            cells.push(why.join(", "));
            table.row(source.to_string(), cells);
        }
        let mut text = table.text();
        if self.intake.spoilt() > 0 {
            let _ = writeln!(text, "{} lines were no fixes", self.intake.spoilt());
        }
        if !self.waiting.is_empty() {
            let _ = writeln!(text, "{} came after the last step", self.waiting.len());
        }
        if let (Some(estimate), Some(found)) = (self.smoother.estimate(), self.smoother.calibration()) {
            let [x, y] = estimate.place;
            let _ = writeln!(
                text,
                "at the end ({x:.2}, {y:.2}) m within {:.2} m; heading {:.0} deg within {:.0}, step scale {:.3} within {:.3}, \
                 heading drift {:.2} deg/min within {:.2}",
                estimate.sigma_m(),
                found.heading.0.to_degrees().rem_euclid(360.0),
                found.heading.1.to_degrees(),
                found.scale.0,
                found.scale.1,
                found.drift.0.to_degrees() * 60.0,
                found.drift.1.to_degrees() * 60.0
            );
        }
        text
    }
}
