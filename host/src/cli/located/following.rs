//! Somebody who is followed, and where what is said of it goes.

use super::outputs::{Outputs, Wanted, walk};
use super::{picture, summary};
use crate::building::Building;
use crate::building::georeference::Projection;
use crate::cli::fixes::Incoming;
use crate::cli::{Error, print};
use crate::export::{file, png};
use crate::fixes::{self, Fusion};
use crate::follow::{self, Follower, LONGEST_STEP_M, Said, Unusual, scene};
use crate::particle::State;
use crate::recording::Recording;
use crate::recording::scene::{Lines, Moment};
use serde_json::Value;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::path::Path;

/// The estimate after each step, a JSON object to a line.
const STREAM: &str = "places.jsonl";

/// The plan is not believed against positions that are farther from it than this, and than so many standard deviations of both.
/// **Units:** m.
const APART_M: f64 = 5.0;
const APART_SIGMAS: f64 = 4.0;

/// Whose answer is the best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// That of steps, plan and positions in the particle filter.
    Map,
    /// This one, of steps and positions alone.
    Positions(fixes::Estimate),
}

impl Answer {
    fn word(self) -> &'static str {
        match self {
            Self::Map => "map",
            Self::Positions(_) => "positions",
        }
    }
}

/// Where somebody is followed, if anybody is.
pub fn building(following: Option<&Following>) -> Option<&Building> {
    following.map(|following| &**following.follower().building())
}

/// A follower and its outputs.
pub struct Following {
    follower: Follower,
    projection: Option<Projection>,
    outputs: Outputs,
    /// The date of each step, where it is known. **Units:** microseconds since the beginning of 1970.
    unix_us: Vec<Option<i64>>,
    /// The lines that were handed on, when they are kept for the folder of results.
    lines: Option<String>,
    /// What viewers show, when it is kept for the recording.
    moments: Option<Vec<Moment>>,
    /// Positions of other sources.
    incoming: Option<Incoming>,
}

impl Following {
    /// Of somebody who has not gone yet.
    pub fn new(follower: Follower, wanted: &Wanted) -> Result<Self, Error> {
        let projection = follower.building().georeference.projection()?;
        let outputs = wanted.open(projection.as_ref())?;
        Ok(Self { follower, projection, outputs, unix_us: Vec::new(), lines: None, moments: None, incoming: None })
    }

    /// Keeps the lines, for [`Following::finish`] to write them into its folder, and what viewers show.
    pub fn keeping_all(mut self) -> Self {
        self.lines = Some(String::new());
        self.moments = Some(Vec::new());
        self
    }

    /// Hears of positions of other sources too.
    pub fn hearing(&mut self, incoming: Option<Incoming>) {
        self.incoming = incoming;
    }

    /// The positions of other sources.
    pub fn incoming(&mut self) -> Option<&mut Incoming> {
        self.incoming.as_mut()
    }

    /// Steps and positions together.
    pub fn fusion(&self) -> Option<&Fusion> {
        self.incoming.as_ref().map(Incoming::fusion)
    }

    /// Hears the positions that have arrived before a time.
    pub fn hear(&mut self, until: Micros) {
        if let Some(incoming) = &mut self.incoming {
            incoming.hear(until, |observation| _ = self.follower.observe(observation));
        }
    }

    /// What viewers show of it: the plan, and the moments that were kept.
    pub fn shown(&self) -> (Vec<Lines>, &[Moment]) {
        (scene::building(self.follower.building()), self.moments.as_deref().unwrap_or_default())
    }

    /// The follower.
    pub fn follower(&self) -> &Follower {
        &self.follower
    }

    /// Follows a step, and hands on what is said, which is also the second answer, as JSON. `unix_us` is the date of its end, if that
    /// is known. **Units:** microseconds since the beginning of 1970.
    pub fn step(&mut self, step: &Step, unix_us: Option<i64>) -> (Said, Value) {
        if let Some(incoming) = &mut self.incoming {
            incoming.step(step, |observation| _ = self.follower.observe(observation));
        }
        let said = self.follower.step(step);
        match said.unusual {
            Some(Unusual::TooLong(length)) => eprintln!(
                "step {}: {length:.1} m is longer than any stride ({LONGEST_STEP_M} m); taken for a hole in the walk",
                step.index
            ),
            Some(Unusual::NoNumber) => eprintln!("step {}: is no number; passed over", step.index),
            None => {}
        }
        self.unix_us.push(unix_us);
        let mut object = follow::line(&self.follower, &said, self.projection.as_ref());
        object["unix_us"] = unix_us.into();
        if let Some(incoming) = &self.incoming {
            object["positions"] = incoming.object(self.projection.as_ref()).into();
            object["answer"] = self.answer(&said).map(Answer::word).into();
        }
        let line = object.to_string();
        self.outputs.line(&line);
        if let Some(lines) = &mut self.lines {
            *lines += &line;
            lines.push('\n');
        }
        if let Some(moments) = &mut self.moments {
            moments.push(scene::moment(&self.follower, &said, line));
        }
        (said, object)
    }

    /// Whose answer is the best after a step: that of the plan, unless it knows none or one that positions and steps are against.
    pub fn answer(&self, said: &Said) -> Option<Answer> {
        let located = said.estimate.state == State::Located;
        let positions = self.incoming.as_ref().and_then(Incoming::estimate);
        match (said.estimate.place().filter(|_| located), positions) {
            (None, None) => None,
            (Some(_), None) => Some(Answer::Map),
            (None, Some(positions)) => Some(Answer::Positions(positions)),
            (Some(map), Some(positions)) => {
                let [x, y] = positions.place;
                let apart = (map.position.x - x).hypot(map.position.y - y);
                let most = APART_M.max(APART_SIGMAS * map.sigma_m().hypot(positions.sigma_m()));
                Some(if apart > most { Answer::Positions(positions) } else { Answer::Map })
            }
        }
    }

    /// The walk begins at `start`, now; what was said before is forgotten.
    ///
    /// # Errors
    /// As [`Follower::anew`].
    pub fn begin_anew(&mut self, start: &str) -> Result<(), follow::Error> {
        self.follower = self.follower.anew(start)?;
        self.unix_us.clear();
        Ok(())
    }

    /// Whether the shoe is to be told its floor mode.
    pub fn steers(&self) -> bool {
        self.follower.steers()
    }

    /// Ends it where there was nothing to follow: tracks without a place, farewell to the clients.
    pub fn abandon(self) -> Result<(), Error> {
        let Self { follower, projection, outputs, unix_us, .. } = self;
        outputs.finish(&walk(&follower, &unix_us, projection.as_ref()))
    }

    /// Writes the tracks that were asked for and, with a folder, the pictures of the floors; returns what there is to tell.
    pub fn finish(self, recording: Option<&Recording>, folder: Option<&Path>) -> Result<String, Error> {
        let Self { follower, projection, outputs, unix_us, lines, incoming, .. } = self;
        outputs.finish(&walk(&follower, &unix_us, projection.as_ref()))?;
        if follower.path().is_empty() {
            return Err(Error::new("there are no steps to follow in the building"));
        }
        let truth = recording.and_then(|recording| recording.truth_in(&follower.building().name));
        let mut told = summary::told(&follower);
        if let Some(truth) = truth {
            told += &format!("\n{}", summary::judged(&follower, truth));
        }
        if let Some(incoming) = incoming {
            told += &format!("\n{}", incoming.finish(folder)?);
        }
        let Some(folder) = folder else { return Ok(told) };
        file::folder(folder)?;
        let mut files = Vec::new();
        if let Some(lines) = lines {
            file::write(&folder.join(STREAM), lines.as_bytes())?;
            files.push(STREAM.to_owned());
        }
        let way: Vec<_> = truth.into_iter().flat_map(|truth| &truth.poses).map(|pose| pose.position).collect();
        for (index, floor) in follower.building().floors.iter().enumerate() {
            let drawing = picture::draw(&follower, index, &way);
            let name = |kind: &str| format!("floor{}.{kind}", floor.number);
            file::write(&folder.join(name("svg")), drawing.as_bytes())?;
            file::write(&folder.join(name("png")), &png::render(&drawing)?)?;
            files.extend([name("svg"), name("png")]);
        }
        told += &format!("\n{}: {}\n", folder.display(), files.join(", "));
        Ok(told)
    }
}

/// The same, told on the standard output unless `quiet`.
pub fn finish_and_tell(
    following: Following,
    recording: Option<&Recording>,
    folder: &Path,
    quiet: bool,
) -> Result<(), Error> {
    let told = following.finish(recording, Some(folder))?;
    if quiet { Ok(()) } else { print(&format!("\n{told}")) }
}
