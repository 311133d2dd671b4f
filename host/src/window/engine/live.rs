//! A shoe that is listened to, for the window: the same as `sohle live` does, without a word on the terminal.

use super::beside::Followed;
use super::drawing::Drawing;
use super::replay::{warnings, whereabouts};
use super::sensed::Sensed;
use super::signals::{History, Row, Signal};
use super::snapshot::{Kind, Link, Pace, Snapshot, Warning};
use super::walk::Anchor;
use super::{Command, Source, Work, opening};
use crate::cli::fixes as positions;
use crate::cli::live::{Listening, Places, Positions, Show};
use crate::cli::located::{Following, Wanted};
use crate::follow::{self, Follower};
use crate::link::connection::Happening;
use crate::link::event::Event;
use crate::link::recorder::Recorder;
use crate::link::{Address, Connection};
use crate::recording::heard::Heard;
use crate::track::Track;
use crate::window::map::Scene;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sohle_shared::tracker::Order;
use sohle_shared::wire::message::{Attitude, FromShoe, Hello, Log, Outcome, Status};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

/// Listens for somebody who wants to know when it is enough, and what came of it.
pub struct End {
    /// Whether it is enough.
    pub enough: Box<dyn FnMut(&Show) -> bool + Send>,
    /// Takes what was listened with, after all of it.
    pub ended: Box<dyn FnOnce(Listening) + Send>,
}

/// A shoe.
pub struct Live {
    address: Address,
    /// Nothing after it was handed back.
    listening: Option<Listening>,
    end: Option<End>,
    ended: bool,
    heard: Told,
    /// Where the walk begins.
    start: String,
    scene: Option<Arc<Scene>>,
    drawing: Drawing,
    epoch: usize,
    fault: Option<String>,
    /// The recording that is being written.
    recording: Option<PathBuf>,
}

/// Only who drops it takes that away.
const WHOLE: &str = "what is listened with is there until the end";

/// What the shoe has told.
#[derive(Default)]
struct Told {
    hello: Option<Hello>,
    /// Steps since the shoe started.
    track: Track,
    attitude: Option<Attitude>,
    status: Option<Status>,
    sensed: Sensed,
    history: History,
    state: String,
    speaks: bool,
    lost: u64,
    delay_ms: Option<f64>,
    stepped: Option<Instant>,
    anchor: Option<Anchor>,
    /// Orders that were not answered yet, by the numbers of their commands.
    asked: Vec<(u32, Order)>,
    /// What is to be told of an order.
    answer: Option<String>,
    /// Something is new.
    fresh: bool,
}

impl Live {
    /// Begins to listen at an address.
    ///
    /// # Errors
    /// As [`Follower::new`], and when the positions cannot be listened to.
    pub fn new(
        address: Address,
        building: Option<crate::building::Building>,
        settings: &follow::Settings,
        source: Option<&positions::Source>,
    ) -> Result<Self, opening::Error> {
        let mut places = match building {
            None => None,
            Some(building) => {
                let following = Following::new(Follower::new(building, settings)?, &Wanted::default());
                // Nothing that could be refused was asked for.
                following.ok().map(|following| Places::new(following, settings.start.trim() != "anywhere"))
            }
        };
        let opened = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let hear = |source| Positions::prepare(source, places.as_mut(), true);
        let positions = source.map(hear).transpose().map_err(opening::Error::positions)?;
        let show = Show::silent((places, positions), i64::try_from(opened.as_micros()).unwrap_or_default());
        let connection = Connection::open(address.clone());
        let listening = Listening::new(connection, show, Vec::new(), false);
        Ok(Self::of(address, listening, settings.start.clone(), None))
    }

    /// Shows what somebody listens to, who recorded it, if at all, into `recording`, and followed it from `start`.
    pub fn of(address: Address, listening: Listening, start: String, recording: Option<PathBuf>) -> Self {
        let places = listening.show().places.as_ref();
        let scene = places.map(|places| Arc::new(Scene::of(places.follower().building())));
        Self {
            address,
            listening: Some(listening),
            end: None,
            ended: false,
            heard: Told { state: "looking for the shoe".into(), ..Told::default() },
            start,
            scene,
            drawing: Drawing::default(),
            epoch: 0,
            fault: None,
            recording,
        }
    }

    /// For somebody who is told when it ends.
    pub fn until(mut self, end: End) -> Self {
        self.end = Some(end);
        self
    }

    fn listening(&self) -> &Listening {
        self.listening.as_ref().expect(WHOLE)
    }

    fn listening_mut(&mut self) -> &mut Listening {
        self.listening.as_mut().expect(WHOLE)
    }

    fn follower(&self) -> Option<&Follower> {
        self.listening().show().places.as_ref().map(Places::follower)
    }

    fn order(&mut self, order: Order) {
        if self.heard.hello.is_none() {
            self.fault = Some("no shoe is connected yet".into());
            return;
        }
        let number = self.listening_mut().order(order);
        self.heard.asked.push((number, order));
    }

    fn begin(&mut self, start: &str) {
        let Some(places) = &mut self.listening_mut().show_mut().places else { return };
        match places.begin_anew(start) {
            Ok(()) => self.heard.anchor = None,
            Err(error) => self.fault = Some(error.to_string()),
        }
        self.epoch += 1;
    }

    fn record(&mut self, path: Option<PathBuf>) {
        let ended = self.listening_mut().show_mut().recorded();
        self.recording = None;
        let Some(path) = path else {
            self.fault = ended;
            return;
        };
        if path.exists() {
            self.fault = Some(format!("{} is there already; a live recording replaces nothing", path.display()));
            return;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match Recorder::begin(&path, &name) {
            Ok(recorder) => {
                let time = self.listening().connection().now();
                let hello = self.heard.hello.clone().map(|hello| Heard { time, message: FromShoe::Hello(hello) });
                self.listening_mut().show_mut().record(recorder, hello);
                self.recording = Some(path);
            }
            Err(error) => self.fault = Some(error.to_string()),
        }
    }
}

impl Source for Live {
    fn obey(&mut self, command: Command) {
        self.fault = None;
        match command {
            Command::Reset => {
                self.order(Order::Reset);
                if self.fault.is_none() {
                    self.begin(&self.start.clone());
                }
            }
            Command::Init => self.order(Order::Init),
            Command::Track => self.order(Order::Track),
            Command::Start(start) => self.begin(&start),
            Command::Record(path) => self.record(path),
            Command::Beside(which, on) => {
                let building = self.follower().map(|follower| follower.building().clone());
                let followed = self.drawing.beside(which, on, building.as_deref(), true);
                self.fault = followed.err().map(|error| error.to_string());
            }
            Command::Export(path) => {
                let told = super::export::track(&path, &self.heard.track, self.follower());
                self.fault = Some(told);
            }
            // The window asks for these of recordings only.
            Command::Play(_)
            | Command::Speed(_)
            | Command::Jump(_)
            | Command::StepAhead
            | Command::StepBack
            | Command::Tracker(_)
            | Command::Particle(_) => self.fault = Some("a shoe cannot be asked for this".into()),
        }
    }

    fn work(&mut self, until: Instant) -> Work {
        self.heard.fresh = false;
        let before = self.heard.stepped;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let Self { heard, listening, .. } = self;
            let listening = listening.as_mut().expect(WHOLE);
            let turned = listening.turn(left, |happening, connection| heard.take(happening, connection));
            if let Err(error) = turned {
                self.fault = Some(error.to_string());
                self.heard.fresh = true;
            }
            if let Some(answer) = self.heard.answer.take() {
                self.fault = Some(answer);
            }
            if left.is_zero() || self.heard.stepped != before {
                break;
            }
        }
        if self.heard.fresh {
            let estimate = self.listening().show().places.as_ref().map(|places| places.follower().estimate());
            let found = estimate.and_then(|estimate| Anchor::found(&self.heard.track, estimate));
            self.heard.anchor = self.heard.anchor.or(found);
        }
        if let (Some(end), Some(listening), false) = (&mut self.end, &self.listening, self.ended) {
            self.ended = (end.enough)(listening.show());
            self.heard.fresh |= self.ended;
        }
        // The work itself waits for what comes.
        let stepped = self.heard.stepped != before;
        let stands = self.heard.attitude.as_ref().is_some_and(|attitude| attitude.stance);
        Work { changed: self.heard.fresh, stepped, stands, pause: Some(Duration::ZERO) }
    }

    fn snapshot(&mut self) -> Snapshot {
        let Self { listening, drawing, heard, .. } = self;
        let listening = listening.as_ref().expect(WHOLE);
        let follower = listening.show().places.as_ref().map(Places::follower);
        let foot = heard.foot();
        let fusion = listening.show().fusion();
        let followed = Followed { steps: &heard.track, follower, anchor: heard.anchor.as_ref(), fusion };
        let overlay = drawing.draw(&followed, foot, self.epoch);
        let signals = heard.history.share();
        let span = signals.span().unwrap_or_default();
        let session = listening.connection().session();
        let frames = session.counters().frames;
        let status = heard.status.as_ref();
        let mut warnings = warnings(&status.map(|status| status.tracker).unwrap_or_default(), follower);
        warnings.extend(status.into_iter().flat_map(told));
        let turned = |attitude: &Attitude| {
            let heading = heard.track.stances.last().map_or(0.0, |stance| stance.heading);
            let yaw = heading + heard.anchor.map_or(0.0, |anchor| anchor.yaw);
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw) * unit(attitude)
        };
        Snapshot {
            name: self.address.to_string(),
            kind: Kind::Live,
            time: span[1],
            span,
            pace: Pace { playing: true, speed: 1.0 },
            computing: None,
            phase: heard.attitude.as_ref().map(|attitude| attitude.state).unwrap_or_default(),
            stance: heard.attitude.as_ref().is_some_and(|attitude| attitude.stance),
            steps: heard.track.steps.len(),
            distance: heard.track.distance(),
            attitude: heard.attitude.as_ref().map(turned),
            whereabouts: follower.map(whereabouts),
            scene: self.scene.clone(),
            overlay,
            signals,
            others: drawing.others(),
            positions: fusion.is_some(),
            warnings,
            settings: None,
            particle: None,
            link: Some(Link {
                address: self.address.to_string(),
                state: heard.state.clone(),
                heard: heard.speaks,
                frames: u64::from(frames.good),
                damaged: u64::from(frames.bad()),
                lost: heard.lost,
                clock_ms: session.clock().error_bound().map(|bound| bound * 1e3),
                load: status.map(|status| status.load),
                battery: status.and_then(|status| status.battery),
                temperature: status.and_then(|status| status.temperature),
                recording: self.recording.clone(),
            }),
            fault: self.fault.clone(),
            stepped: heard.stepped,
            ended: self.ended,
        }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let Some(mut listening) = self.listening.take() else { return };
        listening.take_leave();
        match self.end.take() {
            Some(end) => (end.ended)(listening),
            None => _ = listening.show_mut().recorded(),
        }
    }
}

impl Told {
    /// Takes in what happened, before anybody else does.
    fn take(&mut self, happening: &Happening, connection: &Connection) {
        self.fresh = true;
        match happening {
            Happening::Opened => self.state = "the port is open".into(),
            Happening::Closed(reason) => self.silent(format!("the port is closed: {reason}; opening it anew")),
            Happening::Unreachable(reason) => self.silent(format!("no shoe yet: {reason}; trying on")),
            Happening::Event(event) => self.event(event, connection),
        }
    }

    fn silent(&mut self, state: String) {
        self.state = state;
        self.speaks = false;
    }

    fn event(&mut self, event: &Event, connection: &Connection) {
        match event {
            Event::Connected(hello) => {
                self.state = format!("connected: {}, firmware {}", hello.board, hello.firmware);
                self.hello = Some(hello.clone());
                self.speaks = true;
            }
            Event::Refused(_) => self.silent("the shoe speaks another protocol".into()),
            Event::Rebooted { .. } => {
                // Its clock and its steps begin anew.
                (self.track, self.history, self.anchor) = (Track::default(), History::default(), None);
                self.sensed = Sensed::default();
                self.state = "the shoe has started anew".into();
            }
            Event::Step { step, .. } => {
                let step = step.unpack();
                let arrived = connection.session().clock().to_host(step.stance_end);
                self.delay_ms = arrived.map(|arrived| (connection.now() - arrived) as f64 * 1e-3);
                self.track.add(step);
                self.stepped = Some(Instant::now());
            }
            Event::Gap { count, .. } => self.lost += u64::from(*count),
            Event::Status(status) => self.status = Some(*status),
            Event::Attitude(attitude) => {
                self.attitude = Some(*attitude);
                let row = self.row(attitude, connection);
                self.history.push(attitude.time.as_seconds(), &row);
            }
            Event::Raw(raw) => self.sensed.take(&raw.item),
            Event::Log(Log { text, .. }) => self.state = text.to_string(),
            Event::Reply { number, outcome } => {
                let Some(place) = self.asked.iter().position(|(asked, _)| asked == number) else { return };
                let (_, order) = self.asked.remove(place);
                self.answer = Some(match outcome {
                    Outcome::Refused(refusal) => format!("{order:?}: the shoe refused ({refusal:?})"),
                    _ => format!("{order:?}: done"),
                });
            }
            Event::Asleep => self.state = "the shoe stands still and is asleep".into(),
            Event::Woken => self.state = "the shoe has woken".into(),
            Event::Silent => self.silent("nothing is heard of the shoe any more".into()),
            Event::Back => {
                self.state = "the shoe is heard again".into();
                self.speaks = true;
            }
        }
    }

    fn foot(&self) -> [f64; 3] {
        let displacement = self.attitude.as_ref().map_or([0.0; 3], |attitude| attitude.displacement);
        self.track.ahead(displacement.into())
    }

    fn row(&self, attitude: &Attitude, connection: &Connection) -> Row {
        let mut row = [f32::NAN; Signal::COUNT];
        self.sensed.write(attitude.time, &mut row);
        let mut set = |signal: Signal, value: f32| row[signal.index()] = value;
        let velocity = Vector3::from(attitude.velocity);
        set(Signal::Stance, f32::from(u8::from(attitude.stance)));
        set(Signal::Speed, velocity.norm());
        set(Signal::Climb, velocity.z);
        set(Signal::Height, self.foot()[2] as f32);
        if let Some(step) = self.track.steps.last() {
            set(Signal::StepLength, step.length());
        }
        if let Some(delay) = self.delay_ms {
            set(Signal::Delay, delay as f32);
        }
        set(Signal::FramesBad, connection.session().counters().frames.bad() as f32);
        if let Some(status) = &self.status {
            set(Signal::Load, f32::from(status.load));
            set(Signal::Waiting, f32::from(status.waiting));
        }
        row
    }
}

fn unit(attitude: &Attitude) -> UnitQuaternion<f64> {
    let [w, x, y, z] = attitude.attitude.map(f64::from);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// What is wrong on the shoe.
fn told(status: &Status) -> Vec<Warning> {
    let counted = [
        (status.accel.overruns, "FIFO overruns of the accelerometer", "the processor is too busy: look at its load"),
        (status.gyro.overruns, "FIFO overruns of the gyroscope", "the processor is too busy: look at its load"),
        (status.accel.bus_errors, "bus errors of the accelerometer", "look at the wires between sensor and board"),
        (status.gyro.bus_errors, "bus errors of the gyroscope", "look at the wires between sensor and board"),
        (status.link.steps_dropped, "steps given up by the shoe", "come nearer, or look at the cable"),
    ];
    let counted = counted.into_iter().filter(|(count, ..)| *count > 0);
    counted.map(|(count, what, advice)| Warning { what: format!("{count} {what}"), advice }).collect()
}
