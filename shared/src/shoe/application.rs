//! The application on the shoe.

use super::frames::Frames;
use super::pipeline::{Pipeline, celsius};
use crate::bmx055::{Batch, Config, DieCounters};
use crate::calibration::Calibration;
use crate::sample::ImuSample;
use crate::time::Micros;
use crate::tracker::{Output, Parameters, State, Tracker};
use crate::wire::frame::{self, FRAME_MAX};
use crate::wire::link::{Identity, Link, Request};
use crate::wire::message::{
    Attitude, FromShoe, Level, LinkCounters, Log, Raw, RawItem, Refusal, ResetReason, Status, text,
};
use crate::wire::outbox::Outbox;
use crate::wire::port::Port;
use crate::wire::transfer::Value;
use core::borrow::BorrowMut;

/// Between two messages with the attitude. **Units:** microseconds.
const ATTITUDE_US: i64 = 50_000;
/// Raw messages that may wait for the line. **Units:** bytes. Both dies fill eight messages of a moving foot, 160 bytes each, in
/// 32 ms; as much again waits in the line's own buffer, and the line empties one in 2 ms.
const RAW_BYTES: usize = 1_280;
/// Lines of the log that may wait for a laptop: all that happens while the shoe starts. **Units:** bytes. Last words are a line of
/// 120 letters.
const LOG_BYTES: usize = 512;

/// What only the board knows of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Health {
    /// Time the processor was busy since the last report. **Units:** 1/1000.
    pub load: u16,
    /// Longest time from a FIFO's interrupt to its samples being through the tracker, since the last report. **Units:**
    /// microseconds.
    pub lateness_us: u32,
    /// **Units:** V.
    pub battery: Option<f32>,
    /// Largest depth of the stack since the boot. **Units:** bytes.
    pub stack: u32,
    /// Why the processor started.
    pub reset: ResetReason,
    /// Accelerometer.
    pub accel: DieCounters,
    /// Gyroscope.
    pub gyro: DieCounters,
}

/// What waits for one laptop, or for the one that is to come.
#[derive(Debug)]
struct Outlet {
    logs: Frames<LOG_BYTES>,
    /// The status is to be sent.
    status: bool,
    /// The attitude is.
    attitude: bool,
}

impl Outlet {
    const EMPTY: Self = Self { logs: Frames::new(), status: false, attitude: false };
}

/// The shoe, with room for `STEPS` steps that the laptops do not have yet; they may lie elsewhere, as in [`Link`]. There is one
/// laptop at most at each of `PORTS` ports.
///
/// Whoever calls it does one of many things at a time. What is never inlined has its part of the stack for itself, and not
/// beside that of all the others.
#[derive(Debug)]
pub struct Shoe<const STEPS: usize, O = Outbox<STEPS>, const PORTS: usize = 1> {
    sensor: Config,
    pipeline: Pipeline,
    link: Link<STEPS, O, PORTS>,
    /// Number of the next raw message.
    raw_number: u32,
    raw: Frames<RAW_BYTES>,
    outlets: [Outlet; PORTS],
    /// The last one, but for what is different from one laptop to the other.
    status: Option<Status>,
    attitude: Option<Attitude>,
    attitude_due: Micros,
    /// The link runs a request whose value takes effect when the board has kept it.
    keeping: bool,
    /// Others may pair for so long, which the radio is to be told. **Units:** s.
    pairing: Option<u16>,
    temperature: Option<i8>,
    /// The foot was seen to move, or somebody wanted something.
    moved: Micros,
    /// Time of the last sample.
    seen: Micros,
    asleep: bool,
    /// Times the sensor was put to sleep.
    sleeps: u16,
}

impl<const STEPS: usize, const PORTS: usize, O: BorrowMut<Outbox<STEPS, PORTS>>> Shoe<STEPS, O, PORTS> {
    /// A shoe that has just started, with what was kept of parameters and calibration.
    pub fn new(
        identity: Identity,
        sensor: &Config,
        parameters: &Parameters,
        calibration: &Calibration,
        outbox: O,
    ) -> Self {
        Self {
            sensor: *sensor,
            pipeline: Pipeline::new(sensor, parameters, calibration),
            link: Link::new(identity, parameters, calibration, outbox),
            raw_number: 0,
            raw: Frames::new(),
            outlets: [const { Outlet::EMPTY }; PORTS],
            status: None,
            attitude: None,
            attitude_due: Micros(i64::MIN),
            keeping: false,
            pairing: None,
            temperature: None,
            moved: Micros(0),
            seen: Micros(0),
            asleep: false,
            sleeps: 0,
        }
    }

    /// The driver read something.
    #[inline(never)]
    pub fn sensed(&mut self, batch: &Batch) {
        if self.link.raw().is_some() {
            self.record(RawItem::Batch(batch.clone()));
        }
        self.temperature = batch.temperature.or(self.temperature);
        let Self { pipeline, link, outlets, attitude, attitude_due, moved, seen, .. } = self;
        pipeline.push(batch, |sample, output, tracker| {
            *seen = sample.time;
            if !output.stance || tracker.rides() {
                *moved = sample.time;
            }
            if let Some(step) = &output.step {
                link.push(step);
            }
            if sample.time >= *attitude_due {
                *attitude_due = sample.time + ATTITUDE_US;
                *attitude = Some(attitude_of(sample, output, tracker));
                outlets.iter_mut().for_each(|outlet| outlet.attitude = true);
            }
        });
    }

    /// Bytes came from the laptop of this port.
    #[inline(never)]
    pub fn received(&mut self, port: Port, bytes: &[u8], now: Micros) {
        self.link.receive(port, bytes, now);
        while let Some((port, request)) = self.link.request() {
            self.moved = now;
            if let Some(result) = self.carry_out(port, request, now) {
                self.link.answer(result);
            }
        }
    }

    /// The connection at this port ended.
    pub fn parted(&mut self, port: Port, now: Micros) {
        self.link.part(port, now);
    }

    /// Does what was asked for; `None` while it is the board's turn.
    fn carry_out(&mut self, port: Port, request: Request, now: Micros) -> Option<Result<(), Refusal>> {
        match request {
            Request::Order(order) => {
                let obeyed = self.pipeline.obey(order);
                if obeyed && self.link.raw().is_some() {
                    self.record(RawItem::Order(order));
                }
                Some(if obeyed { Ok(()) } else { Err(Refusal::NotNow) })
            }
            // The tracker cannot be reset in the recording of another laptop.
            Request::Raw(_) if self.link.raw_for_another(port, now) => Some(Err(Refusal::NotNow)),
            Request::Raw(on) => {
                self.raw.clear();
                self.raw_number = 0;
                if on {
                    self.pipeline.reset();
                    self.record(RawItem::Start(self.sensor));
                }
                Some(Ok(()))
            }
            // A raw recording is computed again with one set of values.
            Request::Write(_) if self.link.raw().is_some() => Some(Err(Refusal::NotNow)),
            Request::Write(Value::Parameters(parameters)) if !parameters.method.available() => {
                Some(Err(Refusal::Unsupported))
            }
            Request::Write(_) => {
                self.keeping = true;
                None
            }
            Request::Pair(_) if PORTS <= Port::Radio.index() => Some(Err(Refusal::Unsupported)),
            Request::Pair(seconds) => {
                self.pairing = Some(seconds);
                Some(Ok(()))
            }
        }
    }

    #[inline(never)]
    fn record(&mut self, item: RawItem) {
        let raw = Raw { number: self.raw_number, item };
        self.raw_number = self.raw_number.wrapping_add(1);
        if !self.raw.push(&FromShoe::Raw(raw)) {
            let port = self.link.raw().unwrap_or(Port::Serial);
            self.link.count_dropped_message(port);
        }
    }

    /// Whether the laptop of this port records the counts of the sensor.
    pub fn records(&self, port: Port) -> bool {
        self.link.raw() == Some(port)
    }

    /// For how long others may pair from now on, if a laptop has asked for it; told once. **Units:** s.
    pub fn take_pairing(&mut self) -> Option<u16> {
        self.pairing.take()
    }

    /// A value that the board has to keep over a loss of power; [`Shoe::kept`] tells when it has.
    pub fn keep(&self) -> Option<&Value> {
        match self.link.running() {
            Some(Request::Write(value)) if self.keeping => Some(value),
            _ => None,
        }
    }

    /// The board has kept the value, or could not. With a new value the tracker starts anew.
    #[inline(never)]
    pub fn kept(&mut self, result: Result<(), Refusal>) {
        let Some(value) = self.keep().copied() else { return };
        self.keeping = false;
        if result.is_ok() {
            let (parameters, calibration) = (*self.tracker().parameters(), *self.pipeline.calibration());
            match &value {
                Value::Parameters(parameters) => self.pipeline.restart(&self.sensor, parameters, &calibration),
                Value::Calibration(calibration) => self.pipeline.restart(&self.sensor, &parameters, calibration),
            }
        }
        self.link.answer(result);
    }

    /// The board says how it is, about once in a second.
    #[inline(never)]
    pub fn report(&mut self, now: Micros, health: &Health) {
        let tracker = self.pipeline.tracker();
        self.status = Some(Status {
            time: now,
            state: tracker.state(),
            load: health.load,
            lateness_us: health.lateness_us,
            temperature: self.temperature.map(celsius),
            battery: health.battery,
            stack: health.stack,
            reset: health.reset,
            asleep: self.asleep,
            sleeps: self.sleeps,
            waiting: 0,
            accel: health.accel,
            gyro: health.gyro,
            tracker: *tracker.counters(),
            link: LinkCounters::default(),
        });
        self.outlets.iter_mut().for_each(|outlet| outlet.status = true);
    }

    /// The last status, as the laptop of this port is told it.
    pub fn status(&self, port: Port) -> Option<Status> {
        let waiting = u16::try_from(self.link.waiting(port)).unwrap_or(u16::MAX);
        self.status.map(|status| Status { waiting, link: self.link.counters(port), ..status })
    }

    /// A line for the log; kept for a while when there is no laptop. The oldest gives way.
    #[inline(never)]
    pub fn log(&mut self, time: Micros, level: Level, line: &str) {
        let line = FromShoe::Log(Log { time, level, text: text(line) });
        for (outlet, port) in self.outlets.iter_mut().zip(Port::ALL) {
            while !outlet.logs.push(&line) {
                if outlet.logs.pop(&mut [0; FRAME_MAX]).is_none() {
                    break;
                }
                self.link.count_dropped_message(port);
            }
        }
    }

    /// The next frame for the laptop of this port: steps and answers first.
    #[inline(never)]
    pub fn transmit<'a>(&mut self, port: Port, now: Micros, buffer: &'a mut [u8; FRAME_MAX]) -> Option<&'a [u8]> {
        if let Some(length) = self.link.transmit(port, now, buffer).map(<[u8]>::len) {
            return buffer.get(..length);
        }
        let raw = self.link.raw();
        if raw.is_none() {
            self.raw.clear();
        }
        let outlet = &mut self.outlets[port.index()];
        if !self.link.connected(port) {
            (outlet.status, outlet.attitude) = (false, false);
            return None;
        }
        if !outlet.logs.is_empty() {
            return outlet.logs.pop(buffer);
        }
        if raw == Some(port) && !self.raw.is_empty() {
            return self.raw.pop(buffer);
        }
        let (status, attitude) = (core::mem::take(&mut outlet.status), outlet.attitude);
        let message = match self.status(port).filter(|_| status) {
            Some(status) => FromShoe::Status(status),
            None => {
                self.outlets[port.index()].attitude = false;
                FromShoe::Attitude(self.attitude.filter(|_| attitude)?)
            }
        };
        frame::encode(&message, buffer).ok()
    }

    /// When [`Shoe::transmit`] should be asked again if nothing happens before; a time that has passed means at once.
    pub fn deadline(&self, port: Port, now: Micros) -> Micros {
        let outlet = &self.outlets[port.index()];
        let raw = self.link.raw() == Some(port) && !self.raw.is_empty();
        let pending = raw || !outlet.logs.is_empty() || outlet.status || outlet.attitude;
        if pending && self.link.connected(port) { now } else { self.link.deadline(port, now) }
    }

    /// Whether the sensor should sleep: the foot has stood for the time that is set, nobody wants anything, and no raw
    /// recording runs. While it sleeps that stays so until a command comes.
    pub fn drowsy(&self) -> bool {
        let after_us = (self.tracker().parameters().sleep_after_s * 1e6) as i64;
        let still = self.pipeline.tracker().state() == State::Tracking && self.link.raw().is_none();
        still && after_us > 0 && self.seen - self.moved >= after_us
    }

    /// The sensor was put to sleep.
    pub fn fell_asleep(&mut self) {
        self.asleep = true;
        self.sleeps = self.sleeps.saturating_add(1);
        // It would be old when the next one comes.
        self.attitude = None;
    }

    /// The sensor was woken at `time`, by motion or by a command: until then the foot stood.
    pub fn woke(&mut self, time: Micros) {
        self.asleep = false;
        self.moved = self.moved.max(time);
        self.pipeline.stood_until(time);
    }

    /// Whether the sensor sleeps.
    pub fn asleep(&self) -> bool {
        self.asleep
    }

    /// The tracker as it is.
    pub fn tracker(&self) -> &Tracker {
        self.pipeline.tracker()
    }
}

fn attitude_of(sample: &ImuSample, output: &Output, tracker: &Tracker) -> Attitude {
    let attitude = tracker.attitude();
    Attitude {
        time: sample.time,
        state: output.state,
        stance: output.stance,
        attitude: [attitude.w, attitude.i, attitude.j, attitude.k],
        displacement: tracker.displacement().into(),
        velocity: tracker.velocity().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::selftest::{Batches, STRIDES};
    use crate::step::FloorMode;
    use crate::tracker::Order;
    use crate::wire::frame::AnyDecoder;
    use crate::wire::message::{Ack, Action, Command, LaptopHello, Outcome, ToShoe};
    use crate::wire::outbox::Pace;
    use crate::wire::packed::PackedStep;
    use crate::wire::transfer::Item;
    use crate::wire::{PROTOCOL, SCHEMA};
    use std::vec::Vec;

    fn batches() -> Vec<Batch> {
        Batches::new().collect()
    }

    fn shoe() -> Shoe<64> {
        let identity = Identity { boot: 9, firmware: "1.2.3", board: "none" };
        Shoe::new(
            identity,
            &Config::default(),
            &Parameters::default(),
            &Calibration::default(),
            Outbox::new(0, Pace::default()),
        )
    }

    fn hear(shoe: &mut Shoe<64>, message: &ToShoe, now: Micros) {
        shoe.received(Port::Serial, frame::encode(message, &mut [0; FRAME_MAX]).unwrap(), now);
    }

    fn say(shoe: &mut Shoe<64>, now: Micros) -> Vec<FromShoe> {
        let mut said = Vec::new();
        let mut buffer = [0; FRAME_MAX];
        while let Some(mut frame) = shoe.transmit(Port::Serial, now, &mut buffer) {
            said.push(AnyDecoder::new().next(&mut frame).unwrap().unwrap());
        }
        said
    }

    fn connected() -> Shoe<64> {
        let mut shoe = shoe();
        let hello = LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session: 1, software: text("test") };
        hear(&mut shoe, &ToShoe::Hello(hello), Micros(0));
        say(&mut shoe, Micros(0));
        shoe
    }

    fn command(shoe: &mut Shoe<64>, number: u32, action: Action, now: Micros) {
        hear(shoe, &ToShoe::Command(Command { session: 1, number, action }), now);
    }

    fn outcomes(said: &[FromShoe]) -> Vec<Outcome> {
        let outcome = |message: &FromShoe| match message {
            FromShoe::Reply(reply) => Some(reply.outcome.clone()),
            _ => None,
        };
        said.iter().filter_map(outcome).collect()
    }

    /// All that is said; the laptop acknowledges each step.
    fn listen(shoe: &mut Shoe<64>, now: Micros) -> Vec<FromShoe> {
        let said = say(shoe, now);
        for message in &said {
            if let FromShoe::Step(sent) = message {
                hear(shoe, &ToShoe::Ack(Ack { boot: sent.boot, next: sent.id + 1, later: 0 }), now);
            }
        }
        said
    }

    fn walk(shoe: &mut Shoe<64>, mut between: impl FnMut(&mut Shoe<64>, usize, Micros)) -> Vec<FromShoe> {
        let mut said = Vec::new();
        for (at, batch) in batches().iter().enumerate() {
            shoe.sensed(batch);
            between(shoe, at, batch.stamp);
            said.extend(listen(shoe, batch.stamp));
        }
        said
    }

    /// Writes a value in pieces, the first of them as command `number`.
    fn write(shoe: &mut Shoe<64>, number: u32, item: Item, value: &Value) {
        let mut offset = 0;
        for number in number.. {
            let piece = value.chunk(offset).unwrap();
            offset += piece.bytes.len() as u16;
            let last = offset == piece.total;
            command(shoe, number, Action::Write(item, piece), Micros(1));
            if last {
                return;
            }
        }
    }

    fn steps(said: &[FromShoe]) -> Vec<PackedStep> {
        let step = |message: &FromShoe| match message {
            FromShoe::Step(sent) => Some(sent.step),
            _ => None,
        };
        said.iter().filter_map(step).collect()
    }

    /// Computes the steps again from what was said.
    fn again(said: &[FromShoe]) -> Vec<PackedStep> {
        let mut pipeline = None;
        let mut steps = Vec::new();
        let items = said.iter().filter_map(|message| match message {
            FromShoe::Raw(raw) => Some(raw),
            _ => None,
        });
        for (raw, number) in items.zip(0..) {
            assert_eq!(raw.number, number, "one was lost");
            match &raw.item {
                RawItem::Start(sensor) => {
                    pipeline = Some(Pipeline::new(sensor, &Parameters::default(), &Calibration::default()));
                }
                RawItem::Order(order) => assert!(pipeline.as_mut().unwrap().obey(*order)),
                RawItem::Batch(batch) => pipeline.as_mut().unwrap().push(batch, |_, output, _| {
                    steps.extend(output.step.as_ref().map(PackedStep::pack));
                }),
            }
        }
        steps
    }

    #[test]
    fn a_walk_arrives_as_steps_and_attitudes() {
        let mut shoe = connected();
        let said = walk(&mut shoe, |_, _, _| {});
        // Of the stance at the end of the walk the shoe tells when the foot leaves it.
        assert!(steps(&said).len() >= STRIDES, "{}", steps(&said).len());
        let duration = batches().last().unwrap().stamp.as_seconds();
        let attitudes = said.iter().filter(|message| matches!(message, FromShoe::Attitude(_))).count() as f64;
        assert!((attitudes / duration - 20.0).abs() < 1.0, "{attitudes} in {duration} s");
    }

    #[test]
    fn what_was_recorded_leads_to_the_same_bits() {
        let mut shoe = connected();
        let said = walk(&mut shoe, |shoe, at, now| match at {
            // The walk has begun: the tracker starts anew.
            900 => command(shoe, 1, Action::Raw(true), now),
            2_500 => command(shoe, 2, Action::Order(Order::FloorMode(Some(FloorMode::Stairs))), now),
            3_000 => command(shoe, 3, Action::Order(Order::Init), now),
            _ => {}
        });
        assert_eq!(outcomes(&said), [Outcome::Done, Outcome::Done, Outcome::Done]);
        let begun = said.iter().position(|message| matches!(message, FromShoe::Raw(_))).unwrap();
        let recorded = again(&said);
        assert_eq!(recorded, steps(&said[begun..]));
        assert!(recorded.len() > STRIDES / 2 && recorded[0].unpack().index == 0, "{}", recorded.len());
        let modes = recorded.iter().filter(|step| step.unpack().mode == FloorMode::Stairs).count();
        assert!(modes > 3, "the order was obeyed");
    }

    #[test]
    fn a_new_value_takes_effect_when_the_board_has_kept_it() {
        let mut shoe = connected();
        let mut new = Calibration::default();
        new.accel.bias[2] = 0.5;
        let value = Value::Calibration(new);
        write(&mut shoe, 1, Item::Calibration, &value);
        assert_eq!(shoe.keep(), Some(&value));
        shoe.kept(Err(Refusal::Failed));
        assert_eq!(outcomes(&say(&mut shoe, Micros(2))).last(), Some(&Outcome::Refused(Refusal::Failed)));
        let read = |shoe: &mut Shoe<64>, number| {
            command(shoe, number, Action::Read(Item::Calibration, 0), Micros(3));
            outcomes(&say(shoe, Micros(3)))
        };
        assert_eq!(
            read(&mut shoe, 100),
            [Outcome::Piece(Value::Calibration(Calibration::default()).chunk(0).unwrap())]
        );
        write(&mut shoe, 101, Item::Calibration, &value);
        shoe.kept(Ok(()));
        assert_eq!(read(&mut shoe, 110), [Outcome::Piece(value.chunk(0).unwrap())]);
    }

    #[test]
    fn values_stay_while_a_recording_runs() {
        let mut shoe = connected();
        command(&mut shoe, 1, Action::Raw(true), Micros(1));
        write(&mut shoe, 2, Item::Parameters, &Value::Parameters(Parameters::documented()));
        assert_eq!(outcomes(&say(&mut shoe, Micros(1))).last(), Some(&Outcome::Refused(Refusal::NotNow)));
        assert!(shoe.keep().is_none());
    }

    #[test]
    fn the_log_of_the_boot_waits_for_a_laptop() {
        let mut shoe = shoe();
        let lines = |count: usize| [1, 4].map(|shorter| std::format!("{:1$}", "", count / shorter));
        for (at, line) in (0..6).flat_map(|_| lines(120)).enumerate() {
            shoe.log(Micros(at as i64), Level::Info, &line);
        }
        shoe.report(Micros(20), &Health { stack: 1_234, ..Health::default() });
        assert!(say(&mut shoe, Micros(20)).iter().all(|message| matches!(message, FromShoe::Hello(_))));
        let hello = LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session: 1, software: text("test") };
        hear(&mut shoe, &ToShoe::Hello(hello), Micros(30));
        shoe.report(Micros(40), &Health { stack: 1_234, ..Health::default() });
        assert_eq!(shoe.deadline(Port::Serial, Micros(40)), Micros(40));
        let said = say(&mut shoe, Micros(40));
        let lines: Vec<_> = said.iter().filter(|message| matches!(message, FromShoe::Log(_))).collect();
        // The newest: two pairs of a long and a short line are 300 bytes with their times.
        assert!(matches!(lines[..], [.., FromShoe::Log(long), FromShoe::Log(last)]
            if long.text.len() == 120 && last.text.len() == 30 && last.time == Micros(11) && (4..12).contains(&lines.len())));
        assert!(said.iter().any(|message| matches!(message, FromShoe::Status(status) if status.stack == 1_234)));
        assert!(shoe.deadline(Port::Serial, Micros(40)) > Micros(40), "nothing is left");
    }
}
