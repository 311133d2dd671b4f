//! A recorded walk that is played: at any speed, forwards and backwards, step by step.

use super::beside::Beside;
use super::drawing::Drawing;
use super::snapshot::{Kind, Pace, Snapshot, Warning, Whereabouts};
use super::walk::{Act, Moment, Settings, Walk};
use super::{Command, Source, Work};
use crate::follow::Follower;
use crate::window::map::Scene;
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Counters, Order, State};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Between two looks at the clock while a recording is played.
const TICK: Duration = Duration::from_millis(8);

/// Where one is going.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Goal {
    /// Nowhere.
    Here,
    /// To so many items.
    Item(usize),
    /// To the next step.
    Step,
}

/// A recording that is played.
pub struct Replay {
    walk: Walk,
    scene: Option<Arc<Scene>>,
    drawing: Drawing,
    pace: Pace,
    /// When playing began, and at which time of the walk.
    since: (Instant, Micros),
    goal: Goal,
    /// Items that were behind one when the goal was set.
    from: usize,
    /// Another number for each change that is not a step.
    epoch: usize,
    fault: Option<String>,
    stepped: Option<Instant>,
}

impl Replay {
    /// A walk that begins to be played.
    pub fn new(walk: Walk) -> Self {
        let drawing = Drawing::of(walk.recording(), walk.building().map(|building| building.name.as_str()));
        let scene = walk.building().map(|building| Arc::new(Scene::of(building)));
        let since = (Instant::now(), walk.time());
        let pace = Pace { playing: !walk.is_empty(), ..Pace::default() };
        Self { walk, scene, drawing, pace, since, goal: Goal::Here, from: 0, epoch: 0, fault: None, stepped: None }
    }

    fn jump(&mut self, index: usize) {
        let index = index.min(self.walk.len());
        self.walk.leap(index);
        self.from = self.walk.now().index;
        self.goal = Goal::Item(index);
        self.epoch += 1;
    }

    fn act(&mut self, act: Act) {
        self.fault = self.walk.act(act).err().map(|error| error.to_string());
        self.epoch += 1;
    }

    fn set(&mut self, settings: Settings) {
        let index = self.walk.now().index;
        self.fault = self.walk.set(settings).err().map(|error| error.to_string());
        self.jump(index);
    }

    fn beside(&mut self, which: Beside, on: bool) {
        // Those of a phone are guessed: it has no samples of a foot.
        let measured = !self.walk.recording().samples.is_empty();
        let followed = self.drawing.beside(which, on, self.walk.building(), measured);
        self.fault = followed.err().map(|error| error.to_string());
    }

    fn play(&mut self, playing: bool) {
        if playing && self.walk.now().index == self.walk.len() {
            self.jump(0);
        }
        self.pace.playing = playing;
        self.since = (Instant::now(), self.walk.time());
    }

    /// The item that playing has come to.
    fn due(&self) -> usize {
        let (begun, from) = self.since;
        let passed = begun.elapsed().as_secs_f64() * self.pace.speed * 1e6;
        if passed.is_finite() { self.walk.index_at(from + passed as i64) } else { self.walk.len() }
    }
}

impl Source for Replay {
    fn obey(&mut self, command: Command) {
        self.fault = None;
        match command {
            Command::Play(playing) => self.play(playing),
            Command::Speed(speed) => {
                self.pace.speed = speed;
                self.since = (Instant::now(), self.walk.time());
            }
            Command::Jump(seconds) => {
                self.jump(self.walk.index_at(Micros::from_seconds(seconds)));
            }
            Command::StepAhead => {
                self.play(false);
                self.from = self.walk.now().index;
                self.goal = Goal::Step;
            }
            Command::StepBack => {
                self.pace.playing = false;
                let now = self.walk.now();
                let before = now.stepped.iter().rev().find(|at| **at < now.index);
                self.jump(before.copied().unwrap_or(0));
            }
            Command::Reset => self.act(Act::Reset),
            Command::Init => self.act(Act::Order(Order::Init)),
            Command::Track if self.walk.now().tracker.state() == State::Tracking => {
                self.fault = Some("TRACK: the tracker follows the foot already".into());
            }
            Command::Track => self.act(Act::Order(Order::Track)),
            Command::Start(start) => self.act(Act::Start(start)),
            Command::Tracker(tracker) => {
                self.set(Settings { tracker: *tracker, ..self.walk.settings().clone() });
            }
            Command::Particle(particle) => {
                let mut settings = self.walk.settings().clone();
                settings.follow.particle = *particle;
                self.set(settings);
            }
            Command::Beside(which, on) => self.beside(which, on),
            Command::Record(_) => self.fault = Some("a recording is recorded already".into()),
            Command::Export(path) => {
                let now = self.walk.now();
                self.fault = Some(super::export::track(&path, &now.track, now.follower.as_ref()));
            }
        }
    }

    fn work(&mut self, until: Instant) -> Work {
        let before = (self.walk.now().index, self.walk.now().track.steps.len());
        let begun = Instant::now();
        let late = |_: &Moment| Instant::now() >= until;
        match self.goal {
            Goal::Item(index) => {
                if self.walk.go(index, late) {
                    self.goal = Goal::Here;
                    self.since = (Instant::now(), self.walk.time());
                }
            }
            Goal::Step => {
                let steps = before.1;
                let stepped = |now: &Moment| now.track.steps.len() > steps;
                let end = self.walk.go(usize::MAX, |now| stepped(now) || late(now));
                if end || stepped(self.walk.now()) {
                    self.goal = Goal::Here;
                }
            }
            Goal::Here if self.pace.playing => {
                let due = self.due();
                self.walk.go(due, late);
                // Who cannot compute so fast plays slower.
                if self.walk.now().index < due && self.pace.speed.is_finite() {
                    self.since = (Instant::now(), self.walk.time());
                }
                if self.walk.now().index == self.walk.len() {
                    self.pace.playing = false;
                }
            }
            Goal::Here => {}
        }
        let after = (self.walk.now().index, self.walk.now().track.steps.len());
        let stepped = after.1 > before.1;
        if stepped {
            // It came since then, and was followed.
            self.stepped = Some(begun);
        }
        let pause = match self.goal {
            Goal::Here if !self.pace.playing => None,
            Goal::Here if self.pace.speed.is_finite() => Some(TICK),
            _ => Some(Duration::ZERO),
        };
        Work { changed: after != before, stepped, stands: self.pace.playing && self.walk.now().stance, pause }
    }

    fn snapshot(&mut self) -> Snapshot {
        let now = self.walk.now();
        let (index, [first, last]) = (now.index, self.walk.span());
        let part = |goal: usize| (index - self.from.min(index)) as f32 / (goal - self.from.min(goal)).max(1) as f32;
        let settings = self.walk.settings();
        Snapshot {
            name: self.walk.recording().name.clone(),
            kind: Kind::Replay,
            time: self.walk.time().as_seconds(),
            span: [first.as_seconds(), last.as_seconds()],
            pace: self.pace,
            computing: match self.goal {
                Goal::Item(goal) => Some(part(goal)),
                _ => None,
            },
            phase: now.tracker.state(),
            stance: now.stance,
            steps: now.track.steps.len(),
            distance: now.track.distance(),
            attitude: now.attitude(),
            whereabouts: now.follower.as_ref().map(whereabouts),
            scene: self.scene.clone(),
            overlay: self.drawing.moment(now, self.epoch),
            signals: self.walk.signals(),
            others: self.drawing.others(),
            positions: now.fusion.is_some(),
            warnings: warnings(now.tracker.counters(), now.follower.as_ref()),
            settings: Some(Arc::new(settings.tracker)),
            particle: now.follower.as_ref().map(|_| Arc::new(settings.follow.particle.clone())),
            link: None,
            fault: self.fault.clone(),
            stepped: self.stepped,
            ended: false,
        }
    }
}

/// Where somebody is who is followed.
pub fn whereabouts(follower: &Follower) -> Whereabouts {
    let estimate = follower.estimate();
    let place = estimate.place();
    let floor = place.and_then(|place| follower.building().floor(place.floor));
    let room = place.zip(floor).and_then(|(place, floor)| {
        let point = [place.position.x, place.position.y];
        let room = floor.room_at(point).map(|room| room.name.clone());
        // Stairs and elevators are no rooms, and yet a word for where somebody is.
        room.or_else(|| follower.building().connector_at(floor.number, point).map(|connector| connector.name.clone()))
    });
    let name = |floor: &crate::building::Floor| {
        if floor.name.is_empty() { format!("floor {}", floor.number) } else { floor.name.clone() }
    };
    Whereabouts {
        state: estimate.state,
        room,
        floor: floor.map(name),
        place: place.cloned(),
        particles: follower.particles().len(),
        effective: estimate.effective,
    }
}

/// What is wrong with the samples and the building.
pub fn warnings(counters: &Counters, follower: Option<&Follower>) -> Vec<Warning> {
    let counted = [
        (counters.accel_clipped, "samples with a clipped accelerometer", "choose a wider range of the accelerometer"),
        (counters.gyro_clipped, "samples with a clipped gyroscope", "choose a wider range of the gyroscope"),
        (counters.gaps, "gaps in the samples", "look whether the sensor loses samples: load, bus, line"),
        (counters.backwards, "time stamps in the past", "look at the clock of the recording"),
        (counters.repeated, "repeated time stamps", "look at the clock of the recording"),
        (counters.not_finite, "samples without a number", "look at the file: some values are not numbers"),
        (counters.restarts, "restarts of the tracker", "stand still for a second; calibrate the sensor if it goes on"),
    ];
    let counted = counted.into_iter().filter(|(count, ..)| *count > 0);
    let told = follower.into_iter().flat_map(Follower::warnings);
    counted
        .map(|(count, what, advice)| Warning { what: format!("{count} {what}"), advice })
        .chain(told.map(|what| Warning { what, advice: "complete the plan; 'sohle building check' tells where" }))
        .collect()
}
