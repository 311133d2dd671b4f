//! The steps of a live shoe in a building: followed as they come, and the shoe is told its floor mode.

use crate::cli::fixes::Incoming;
use crate::cli::located::{Answer, Following, InBuilding};
use crate::cli::{Error, live::words};
use crate::fixes::Fusion;
use crate::follow::{self, Follower, mode_word, scene};
use crate::link::Connection;
use crate::link::ground::ShoeMode;
use crate::particle::Parameters;
use crate::recording::scene::{Lines, Moment};
use serde_json::{Value as Json, json};
use sohle_shared::step::{FloorMode, Step};
use sohle_shared::time::Micros;
use sohle_shared::wire::message::Outcome;
use std::path::Path;

/// Steps that may wait for the clock of the shoe to be known. They come first when the line is good; a clock that is still not
/// known then is not waited for.
pub(super) const WAITING: usize = 64;

/// What the map knew so long ago says nothing of the ground under the next stance: a stride takes this long.
/// **Units:** microseconds.
const LATE_US: i64 = 1_000_000;

/// Follows a live shoe.
pub struct Places {
    following: Following,
    shoe: ShoeMode,
    /// Whether the walk begins somewhere, now.
    starts_here: bool,
    waiting: Vec<Step>,
    before: u64,
    unusual: u64,
}

/// What is said after a step: for people and for programs.
pub struct Told {
    /// For people.
    pub text: String,
    /// For programs.
    pub object: Json,
    /// For viewers.
    pub moment: Moment,
}

impl Places {
    /// Reads the building and the start, if a building is asked for.
    pub fn prepare(place: &InBuilding) -> Result<Option<Self>, Error> {
        let following = place.prepare(Parameters::default())?;
        Ok(following.map(|following| Self::new(following, place.how.starts_somewhere())))
    }

    /// Of somebody who has not gone yet. `starts_here`: whether the walk begins somewhere, now.
    pub fn new(following: Following, starts_here: bool) -> Self {
        Self { following, shoe: ShoeMode::default(), starts_here, waiting: Vec::new(), before: 0, unusual: 0 }
    }

    /// Who follows.
    pub fn follower(&self) -> &Follower {
        self.following.follower()
    }

    /// Hears of positions of other sources from now on.
    pub fn hearing(&mut self, incoming: Incoming) {
        self.following.hearing(Some(incoming));
    }

    /// The positions of other sources.
    pub fn incoming(&mut self) -> Option<&mut Incoming> {
        self.following.incoming()
    }

    /// Steps and positions together.
    pub fn fusion(&self) -> Option<&Fusion> {
        self.following.fusion()
    }

    /// Hears what has arrived before a time by the clock of the shoe.
    pub fn hear(&mut self, until: Micros) {
        self.following.hear(until);
    }

    /// The walk begins at `start`, now.
    ///
    /// # Errors
    /// As [`Follower::anew`].
    pub fn begin_anew(&mut self, start: &str) -> Result<(), follow::Error> {
        self.following.begin_anew(start)?;
        self.waiting.clear();
        Ok(())
    }

    /// Takes a step in, and tells of all whose time is known by now.
    pub fn step(&mut self, step: &Step, opened_us: i64, connection: &Connection) -> Vec<Told> {
        self.waiting.push(*step);
        self.known(opened_us, connection)
    }

    /// Tells of the steps whose time has become known.
    pub fn known(&mut self, opened_us: i64, connection: &Connection) -> Vec<Told> {
        let clock = connection.session().clock();
        let known = clock.to_host(step_end(self.waiting.first())).is_some();
        if !known && self.waiting.len() < WAITING {
            return Vec::new();
        }
        let steps = std::mem::take(&mut self.waiting);
        let now = connection.now();
        steps
            .iter()
            .filter_map(|step| {
                let ended = clock.to_host(step.stance_end);
                self.follow(step, ended.map(|ended| ended.0), ended.map(|ended| now - ended), opened_us)
            })
            .collect()
    }

    /// `host_us`: the end of the step, counted from when the program began; `age_us`: how long ago that is.
    fn follow(&mut self, step: &Step, host_us: Option<i64>, age_us: Option<i64>, opened_us: i64) -> Option<Told> {
        // The start is where the person stood when the program began: an earlier step led there, not away from it.
        if self.starts_here && host_us.is_some_and(|host| host < 0) {
            self.before += 1;
            return None;
        }
        let (said, object) = self.following.step(step, host_us.map(|host| opened_us + host));
        self.unusual += u64::from(said.unusual.is_some());
        self.shoe.want(timely(said.mode, age_us));
        let moment = scene::moment(self.following.follower(), &said, object.to_string());
        let mut text = words::place(&said);
        if let Some(Answer::Positions(estimate)) = self.following.answer(&said) {
            text += &words::position(&estimate);
        }
        Some(Told { text, object, moment })
    }

    /// The plan, for viewers.
    pub fn plan(&self) -> Vec<Lines> {
        scene::building(self.following.follower().building())
    }

    /// The floor mode that is to be sent to the shoe now, if one is.
    pub fn mode_due(&self) -> Option<Option<FloorMode>> {
        if self.following.steers() { self.shoe.due() } else { None }
    }

    /// It was sent as the command of this number.
    pub fn mode_sent(&mut self, number: u32, mode: Option<FloorMode>) {
        self.shoe.sent(number, mode);
    }

    /// A command was answered; what there is to tell of it.
    pub fn answered(&mut self, number: u32, outcome: &Outcome) -> Option<String> {
        let (mode, taken) = self.shoe.answered(number, outcome)?;
        let word = mode_word(mode);
        Some(if taken {
            format!("the shoe takes the ground for: {word}")
        } else {
            format!("the shoe refuses the floor mode {word}; it decides alone")
        })
    }

    /// The tracker of the shoe is as new.
    pub fn shoe_forgot(&mut self) {
        self.shoe.forgotten();
    }

    /// Whether the shoe holds a mode that it is to be freed from at the end.
    pub fn holds_a_mode(&self) -> bool {
        self.shoe.holds_a_mode()
    }

    /// For the summary.
    pub fn summary(&mut self) -> Json {
        let positions = self.following.incoming().map(|incoming| incoming.counts());
        let estimate = self.following.follower().estimate();
        json!({
            "state": estimate.state, "followed": self.following.follower().path().len(), "before_start": self.before,
            "unusual": self.unusual, "floor_modes_told": self.shoe.told, "positions": positions,
        })
    }

    /// Tells of the steps whose time will never become known: nothing comes any more.
    pub fn rest(&mut self, opened_us: i64) -> Vec<Told> {
        let steps = std::mem::take(&mut self.waiting);
        steps.iter().filter_map(|step| self.follow(step, None, None, opened_us)).collect()
    }

    /// Ends it: the tracks, the pictures. What there is to tell.
    pub fn finish(self, pictures: Option<&Path>) -> Result<String, Error> {
        let before = match self.before {
            0 => String::new(),
            before => format!("{before} steps from before the start were not followed\n"),
        };
        if self.following.follower().path().is_empty() {
            self.following.abandon()?;
            return Ok(format!("{before}no step was followed in the building\n"));
        }
        Ok(format!("{before}{}", self.following.finish(None, pictures)?))
    }
}

/// The mode that follows from a step that ended `age_us` ago: a late one is worse than none, since it is held to.
fn timely(mode: Option<FloorMode>, age_us: Option<i64>) -> Option<FloorMode> {
    mode.filter(|_| age_us.is_some_and(|age| age < LATE_US))
}

fn step_end(step: Option<&Step>) -> Micros {
    step.map_or(Micros(0), |step| step.stance_end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_that_comes_late_is_left_to_the_shoe() {
        let level = Some(FloorMode::Level);
        assert_eq!(timely(level, Some(20_000)), level);
        assert_eq!((timely(level, Some(1_500_000)), timely(level, None)), (None, None));
    }
}
