//! Positions of other sources beside the steps of a live shoe.

use super::places::{Places, WAITING};
use super::words;
use crate::cli::Error;
use crate::cli::fixes::{Incoming, Source, Stream};
use crate::fixes::line::Clock;
use crate::fixes::{Fix, Fusion, smoother};
use crate::link::Connection;
use serde_json::{Value as Json, json};
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// A shoe that has walked alone tells all its steps first; so long no position is heard, which would come before them.
/// **Units:** us.
const SETTLING_US: i64 = 1_500_000;

/// Hears positions, and puts them together with the steps where no building is.
pub struct Positions {
    stream: Stream,
    name: String,
    /// Lines that have come.
    lines: u64,
    /// In a building, who is followed there hears them.
    alone: Option<Incoming>,
    /// When the clock of the shoe became known, by that of the laptop.
    since: Option<Micros>,
    /// Steps that wait for the clock of the shoe to be known, where no building is.
    waiting: Vec<Step>,
}

impl Positions {
    /// Begins to listen; who is followed in a building hears what comes.
    pub fn prepare(source: &Source, places: Option<&mut Places>, quiet: bool) -> Result<Self, Error> {
        let settings = smoother::Parameters::default();
        let alone = match places {
            Some(places) => {
                let building = places.follower().building().clone();
                places.hearing(Incoming::new(Some(&building), &settings, quiet)?);
                None
            }
            None => Some(Incoming::new(None, &settings, quiet)?),
        };
        let name = source.to_string();
        Ok(Self { stream: source.stream()?, name, lines: 0, alone, since: None, waiting: Vec::new() })
    }

    /// Takes in what has come, and returns it. As long as nobody knows what the clock of the shoe says, all waits.
    pub fn hear(&mut self, places: Option<&mut Places>, connection: &Connection, opened_us: i64) -> Vec<Fix> {
        let host = connection.now();
        let Some(now) = connection.session().clock().to_shoe(host) else { return Vec::new() };
        let epoch_us = Some(opened_us.saturating_add(host - now));
        let clock = Clock { epoch_us, now: (!self.stream.timed).then_some(now) };
        let settled = host - *self.since.get_or_insert(host) > SETTLING_US;
        let mut fixes = Vec::new();
        let (stream, lines, name) = (&self.stream, &mut self.lines, &self.name);
        let mut read = |incoming: &mut Incoming| {
            while let Some(line) = stream.next() {
                *lines += 1;
                fixes.extend(incoming.line(&line, &format!("{name}, line {lines}"), clock));
            }
        };
        // What says itself when it is to be heard is heard with the step that comes next.
        let until = (!self.stream.timed && self.waiting.is_empty() && settled).then_some(now + 1);
        if let Some(alone) = &mut self.alone {
            read(alone);
            if let Some(until) = until {
                alone.hear(until, |_| ());
            }
        } else if let Some(places) = places {
            if let Some(incoming) = places.incoming() {
                read(incoming);
            }
            if let Some(until) = until {
                places.hear(until);
            }
        }
        fixes
    }

    /// Steps and positions together, where no building is.
    pub fn fusion(&self) -> Option<&Fusion> {
        self.alone.as_ref().map(Incoming::fusion)
    }

    /// Takes in a step, where no building is.
    pub fn step(&mut self, step: &Step) {
        if self.alone.is_some() {
            self.waiting.push(*step);
        }
    }

    /// The place after each step whose time has become known: for people and for programs.
    pub fn known(&mut self, connection: &Connection, opened_us: i64) -> Vec<(String, Json)> {
        let clock = connection.session().clock();
        let date = |step: &Step| clock.to_host(step.stance_end).map(|ended| opened_us + ended.0);
        let known = self.waiting.first().is_some_and(|first| date(first).is_some());
        if !known && self.waiting.len() < WAITING {
            return Vec::new();
        }
        let steps = std::mem::take(&mut self.waiting);
        steps.iter().filter_map(|step| self.follow(step, date(step))).collect()
    }

    fn follow(&mut self, step: &Step, unix_us: Option<i64>) -> Option<(String, Json)> {
        let alone = self.alone.as_mut()?;
        alone.step(step, |_| ());
        let text = words::position(&alone.estimate()?);
        let object = json!({
            "event": "position", "time_us": step.stance_end.0, "unix_us": unix_us, "step": step.index,
            "positions": alone.object(None),
        });
        Some((text, object))
    }

    /// What became of them where no building is, for programs.
    pub fn counts(&self) -> Option<Json> {
        self.alone.as_ref().map(Incoming::counts)
    }

    /// The same for people, after steps whose time never became known.
    pub fn finish(mut self) -> Result<Option<String>, Error> {
        for step in std::mem::take(&mut self.waiting) {
            self.follow(&step, None);
        }
        self.alone.map(|alone| alone.finish(None)).transpose()
    }
}
