//! What `sohle live` shows, and what has been so far.

use super::places::{Places, Told};
use super::positions::Positions;
use super::{Args, Format, words};
use crate::cli::{Error, print};
use crate::fixes::Fusion;
use crate::link::Connection;
use crate::link::connection::Happening;
use crate::link::event::{Event, mismatch};
use crate::link::recorder::Recorder;
use crate::recording::heard::Heard;
use crate::recording::live::BEGAN;
use serde_json::{Value as Json, json};
use sohle_shared::step::FloorMode;
use sohle_shared::time::Micros;
use sohle_shared::wire::message::{FromShoe, Level, Raw, RawItem, SentStep, Status};
use sohle_shared::wire::packed::PackedStep;
use std::path::PathBuf;

/// What is shown, and what has been so far.
#[derive(Default)]
pub struct Show {
    /// Where it is written, while it is.
    pub recorder: Option<Recorder>,
    format: Format,
    quiet: bool,
    /// The boot of the shoe that is connected.
    pub boot: Option<u32>,
    /// Boot and number of the last step.
    last: Option<(u32, u32)>,
    /// Steps so far.
    pub steps: u64,
    lost: u64,
    doubled: u64,
    distance: f64,
    /// From the end of a stance to the arrival of its step. **Units:** ms.
    delays: Vec<f64>,
    raw: u64,
    raw_lost: u64,
    raw_next: u32,
    status: Option<Status>,
    load_max: u16,
    /// Why it cannot go on.
    pub fault: Option<String>,
    /// The walk in a building.
    pub places: Option<Places>,
    /// Positions of other sources.
    positions: Option<Positions>,
    /// The standard output belongs to the lines of the places.
    output_taken: bool,
    /// Where pictures of the walk go.
    pictures: Option<PathBuf>,
    /// When the connection was begun. **Units:** microseconds since the beginning of 1970.
    opened_us: i64,
    /// The boot whose date is in the recording.
    dated: Option<u32>,
    plan_recorded: bool,
}

impl Show {
    /// Nothing has been so far. `opened_us` is when the connection was begun, in microseconds since the beginning of 1970.
    pub fn new(
        args: &Args,
        recorder: Option<Recorder>,
        (places, positions): (Option<Places>, Option<Positions>),
        opened_us: i64,
    ) -> Self {
        Self {
            recorder,
            places,
            positions,
            opened_us,
            format: args.format,
            quiet: args.quiet,
            output_taken: args.place.how.wanted.takes_stdout(),
            pictures: args.pictures.clone(),
            ..Self::default()
        }
    }

    /// Says nothing, and records nothing yet. `opened_us` is when the connection was begun, in microseconds since the
    /// beginning of 1970.
    pub fn silent((places, positions): (Option<Places>, Option<Positions>), opened_us: i64) -> Self {
        Self { places, positions, opened_us, quiet: true, ..Self::default() }
    }

    /// Steps and positions of other sources together, if there are some.
    pub fn fusion(&self) -> Option<&Fusion> {
        let places = self.places.as_ref().and_then(Places::fusion);
        places.or_else(|| self.positions.as_ref().and_then(Positions::fusion))
    }

    /// Begins to record, in the midst of what is said: `heard` is what the recording begins with.
    pub fn record(&mut self, mut recorder: Recorder, heard: Option<Heard>) {
        if let Some(heard) = heard {
            recorder.heard(heard);
        }
        (self.dated, self.plan_recorded) = (None, false);
        self.recorder = Some(recorder);
    }

    /// Ends the recording. What there is to tell, if one was going on.
    pub fn recorded(&mut self) -> Option<String> {
        self.recorder.take().map(|recorder| words::recorded(&recorder.finish()))
    }

    /// Over the lines.
    pub fn head(&self) -> Result<(), Error> {
        if self.quiet || self.output_taken || self.format == Format::Json {
            return Ok(());
        }
        print(words::HEAD)
    }

    /// Tells how it goes, beside the results.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// Takes in what happened.
    pub fn take(&mut self, happening: Happening, connection: &Connection) {
        self.date(connection);
        if let Some(places) = &mut self.places {
            let told = places.known(self.opened_us, connection);
            self.tell(told);
        }
        let event = match happening {
            Happening::Opened => return self.say("the port is open"),
            Happening::Closed(reason) => return self.say(&format!("the port is closed: {reason}; opening it anew")),
            Happening::Unreachable(reason) => return self.say(&format!("no shoe yet: {reason}; trying on")),
            Happening::Event(event) => event,
        };
        let message = match event {
            Event::Connected(hello) => {
                let (board, firmware, boot) = (&hello.board, &hello.firmware, hello.boot);
                self.say(&format!("connected: {board}, firmware {firmware}, boot {boot:08x}"));
                self.boot = Some(boot);
                FromShoe::Hello(hello)
            }
            Event::Refused(hello) => {
                self.fault = Some(mismatch(&hello));
                return;
            }
            Event::Rebooted { boot } => {
                if let Some(places) = &mut self.places {
                    places.shoe_forgot();
                }
                return self.say(&format!("the shoe has started anew: boot {boot:08x}"));
            }
            Event::Step { boot, id, step } => {
                self.step(boot, id, &step, connection);
                FromShoe::Step(SentStep { boot, id, oldest: id, step })
            }
            Event::Gap { boot, first, count } => {
                self.lost += u64::from(count);
                self.last = Some((boot, first.wrapping_add(count).wrapping_sub(1)));
                eprintln!("{count} steps are lost: the shoe ran out of room for them");
                return;
            }
            Event::Status(status) => {
                self.status(&status);
                FromShoe::Status(status)
            }
            Event::Attitude(attitude) => FromShoe::Attitude(attitude),
            Event::Raw(raw) => {
                self.raw(&raw);
                FromShoe::Raw(raw)
            }
            Event::Log(log) => {
                if log.level <= Level::Warn || !self.quiet {
                    eprintln!("shoe, {:.3} s: {}", log.time.as_seconds(), log.text);
                }
                FromShoe::Log(log)
            }
            Event::Reply { number, outcome } => {
                let told = self.places.as_mut().and_then(|places| places.answered(number, &outcome));
                return told.map_or((), |told| self.say(&told));
            }
            Event::Asleep => return self.say("the shoe stands still and is asleep"),
            Event::Woken => return self.say("the shoe has woken"),
            Event::Silent => return self.say("nothing is heard of the shoe any more"),
            Event::Back => return self.say("the shoe is heard again"),
        };
        if let Some(recorder) = &mut self.recorder {
            let whole = recorder.heard(Heard { time: connection.now(), message });
            if !whole && self.fault.is_none() && recorder.has_ended() {
                self.end_recording();
            }
        }
    }

    /// Takes in the positions that have come.
    pub fn hear(&mut self, connection: &Connection) {
        let Some(positions) = &mut self.positions else { return };
        let fixes = positions.hear(self.places.as_mut(), connection, self.opened_us);
        if let Some(recorder) = &mut self.recorder {
            fixes.into_iter().for_each(|fix| _ = recorder.fix(fix));
        }
        let told = positions.known(connection, self.opened_us);
        told.iter().for_each(|(text, object)| self.print(text, object));
    }

    fn step(&mut self, boot: u32, id: u32, packed: &PackedStep, connection: &Connection) {
        let step = packed.unpack();
        match self.last {
            Some((before, last)) if before == boot && id <= last => self.doubled += 1,
            Some((before, last)) if before == boot => self.lost += u64::from(id - last - 1),
            _ => {}
        }
        self.last = Some((boot, id));
        self.steps += 1;
        self.distance += f64::from(step.length());
        let arrived = connection.session().clock().to_host(step.stance_end);
        let delay = arrived.map(|arrived| (connection.now() - arrived) as f64 * 1e-3);
        self.delays.extend(delay);
        if !self.quiet && !self.output_taken {
            let text = match self.format {
                Format::Table => words::row(id, &step, delay),
                Format::Json => format!("{}\n", words::object(boot, id, &step, delay)),
            };
            // Nobody who reads is no reason to stop recording.
            let _ = print(&text);
        }
        if let Some(places) = &mut self.places {
            let told = places.step(&step, self.opened_us, connection);
            self.tell(told);
        } else if let Some(positions) = &mut self.positions {
            positions.step(&step);
            self.hear(connection);
        }
    }

    /// Prints what is said of a place.
    fn print(&self, text: &str, object: &Json) {
        // Nobody who reads is no reason to stop recording.
        let _ = match self.format {
            _ if self.quiet || self.output_taken => Ok(()),
            Format::Table => print(text),
            Format::Json => print(&format!("{object}\n")),
        };
    }

    /// Tells where somebody is, and records it for viewers.
    fn tell(&mut self, told: Vec<Told>) {
        for Told { text, object, moment } in told {
            self.print(&text, &object);
            let Some(recorder) = &mut self.recorder else { continue };
            if let Some(places) = self.places.as_ref().filter(|_| !self.plan_recorded) {
                self.plan_recorded = recorder.building(places.plan(), moment.time);
            }
            recorder.moment(moment);
        }
    }

    /// Notes the date of the shoe's clock in the recording, once for each boot.
    fn date(&mut self, connection: &Connection) {
        if self.dated == self.boot {
            return;
        }
        let Some(zero) = connection.session().clock().to_host(Micros(0)) else { return };
        self.dated = self.boot;
        if let Some(recorder) = &mut self.recorder {
            recorder.about(BEGAN, (self.opened_us + zero.0).to_string());
        }
    }

    /// The floor mode that is to be sent to the shoe now, if one is.
    pub fn mode_due(&self) -> Option<Option<FloorMode>> {
        self.places.as_ref().and_then(Places::mode_due)
    }

    /// It was sent as the command of this number.
    pub fn mode_sent(&mut self, number: u32, mode: Option<FloorMode>) {
        if let Some(places) = &mut self.places {
            places.mode_sent(number, mode);
        }
    }

    /// The tracker of the shoe is as new.
    pub fn shoe_forgot(&mut self) {
        if let Some(places) = &mut self.places {
            places.shoe_forgot();
        }
    }

    /// A result, which gives way to the lines of the places.
    fn result(&self, text: &str) -> Result<(), Error> {
        if self.output_taken {
            eprint!("{text}");
            return Ok(());
        }
        print(text)
    }

    /// Tells what went wrong on the shoe since the status before.
    fn status(&mut self, status: &Status) {
        let before = self.status.replace(*status);
        self.load_max = self.load_max.max(status.load);
        let counts = |status: &Status| {
            [
                ("accelerometer FIFO overruns", status.accel.overruns),
                ("gyroscope FIFO overruns", status.gyro.overruns),
                ("accelerometer bus errors", status.accel.bus_errors),
                ("gyroscope bus errors", status.gyro.bus_errors),
                ("accelerometer restarts", status.accel.restarts),
                ("gyroscope restarts", status.gyro.restarts),
                ("gaps in the samples", status.tracker.gaps),
                ("restarts of the tracker", status.tracker.restarts),
                ("steps given up", status.link.steps_dropped),
            ]
        };
        let Some(before) = before else { return };
        for ((what, now), (_, then)) in counts(status).into_iter().zip(counts(&before)) {
            if now > then {
                self.say(&format!("shoe, {:.3} s: {} more {what}", status.time.as_seconds(), now - then));
            }
        }
    }

    fn raw(&mut self, raw: &Raw) {
        if !matches!(raw.item, RawItem::Start(_)) {
            self.raw_lost += u64::from(raw.number.wrapping_sub(self.raw_next));
        }
        self.raw_next = raw.number.wrapping_add(1);
        self.raw += 1;
    }

    /// The disk refuses: what was heard before is kept, the rest goes on.
    fn end_recording(&mut self) {
        if let Some(told) = self.recorded() {
            eprintln!("{told}");
        }
    }

    /// Tells how it went. An error if it went badly.
    pub fn finish(mut self, connection: &Connection) -> Result<(), Error> {
        if let Some(places) = &mut self.places {
            let told = places.rest(self.opened_us);
            self.tell(told);
        }
        let counters = connection.session().counters();
        let bound = connection.session().clock().error_bound().map(|bound| bound * 1e3);
        let in_building = self.places.as_mut().map(Places::summary);
        self.delays.sort_by(f64::total_cmp);
        let (median, longest) = (self.delays.get(self.delays.len() / 2).copied(), self.delays.last().copied());
        match self.format {
            Format::Json => self.result(&format!(
                "{}\n",
                json!({
                    "event": "summary", "connected": self.boot.is_some(), "steps": self.steps, "lost": self.lost,
                    "doubled": self.doubled, "distance_m": self.distance, "delay_median_ms": median,
                    "delay_max_ms": longest, "clock_error_bound_ms": bound, "frames": counters.frames.good,
                    "frames_bad": counters.frames.bad(), "mended": counters.mended, "reboots": counters.reboots, "raw": self.raw,
                    "raw_lost": self.raw_lost, "waiting": self.status.map(|status| status.waiting),
                    "load": self.status.map(|status| status.load), "stack": self.status.map(|status| status.stack),
                    "lateness_us": self.status.map(|status| status.lateness_us),
                    "load_max": self.load_max,
                    "asleep": self.status.map(|status| status.asleep), "sleeps": self.status.map(|status| status.sleeps),
                    "places": in_building, "positions": self.positions.as_ref().and_then(Positions::counts),
                })
            ))?,
            Format::Table => {
                let ms = |value: Option<f64>| value.map_or("unknown".into(), |value| format!("{value:.1} ms"));
                let Self { steps, lost, doubled, distance, .. } = self;
                let mended = match counters.mended {
                    0 => String::new(),
                    mended => format!(", {mended} messages put together from those"),
                };
                self.result(&format!(
                    "{steps} steps, {lost} lost, {doubled} doubled, {distance:.1} m; from the end of the stance {} (median), \
                     {} (longest)\nclock of the shoe known within {}; {} frames, {} damaged{mended}{}\n",
                    ms(median),
                    ms(longest),
                    ms(bound),
                    counters.frames.good,
                    counters.frames.bad(),
                    if self.raw > 0 {
                        format!("; {} raw messages, {} lost", self.raw, self.raw_lost)
                    } else {
                        String::new()
                    }
                ))?;
            }
        }
        if let Some(told) = self.positions.take().map(Positions::finish).transpose()?.flatten()
            && self.format == Format::Table
        {
            self.result(&told)?;
        }
        let placed = match self.places.take() {
            Some(places) => places.finish(self.pictures.as_deref()).and_then(|told| match self.format {
                Format::Table => self.result(&told),
                Format::Json => Ok(()),
            }),
            None => Ok(()),
        };
        if let Some(recorder) = self.recorder.take() {
            let recorded = recorder.finish();
            self.say(&words::recorded(&recorded));
            recorded.size?;
        }
        placed?;
        if self.boot.is_none() && self.fault.is_none() {
            return Err(Error::new("no shoe was found"));
        }
        if self.lost + self.doubled > 0 {
            return Err(Error::new(format!("{} steps were lost, {} came twice", self.lost, self.doubled)));
        }
        Ok(())
    }
}
