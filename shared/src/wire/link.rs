//! The shoe's end of the wire.
//!
//! A [`Link`] owns the steps that wait, answers hellos, questions for the time and repeated commands, and puts parameters
//! together. The firmware gives it the bytes that come and the steps that are made, sends the frames it hands out, and
//! carries out its [`Request`]s. Before a laptop with the same messages has said hello, nothing but hellos is sent. With two
//! [`Port`]s there can be two laptops at a time, which know nothing of each other.

use super::desk::{CommandState, Desk, Peer};
use super::frame::{self, Decoder, FRAME_MAX};
use super::message::{Action, Command, FromShoe, Hello, LaptopHello, LinkCounters, Outcome, Refusal, ToShoe, text};
use super::outbox::Outbox;
use super::packed::PackedStep;
use super::port::Port;
use super::transfer::{self, Assembly, Item, Value};

use super::{PROTOCOL, SCHEMA};
use crate::calibration::Calibration;
use crate::step::Step;
use crate::time::Micros;
use crate::tracker::{Order, Parameters};
use core::borrow::BorrowMut;

/// The laptop's longest message with its checksum: a piece of the parameters. **Units:** bytes.
const TO_SHOE_MAX: usize = transfer::CHUNK_MAX + 40;

/// Finds the laptop's messages.
pub type ToShoeDecoder = Decoder<TO_SHOE_MAX>;

/// Who this shoe is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Differs from boot to boot: from a counter in flash memory, or from a random number generator.
    pub boot: u32,
    /// Version of the firmware.
    pub firmware: &'static str,
    /// What it runs on.
    pub board: &'static str,
}

/// What the firmware has to do for the laptop, and to answer with [`Link::answer`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is no heap on the shoe, and one request at a time")]
pub enum Request {
    /// Something for the tracker.
    Order(Order),
    /// Reset the tracker and send [`Raw`](super::message::Raw) messages from there on, or stop to send them.
    Raw(bool),
    /// Put this into effect, and keep it.
    Write(Value),
    /// Let other devices pair by Bluetooth for so long. **Units:** s.
    Pair(u16),
}

/// The shoe's end of the wire, with room for `STEPS` steps and `PORTS` laptops, one at each port.
///
/// The steps may lie elsewhere (`O` is then `&mut Outbox<STEPS, PORTS>`): a thousand take 23 kB, which no microcontroller
/// should have on its stack while they are put in their place.
#[derive(Debug)]
pub struct Link<const STEPS: usize, O = Outbox<STEPS>, const PORTS: usize = 1> {
    identity: Identity,
    parameters: Parameters,
    calibration: Calibration,
    assembly: Assembly,
    outbox: O,
    desks: [Desk; PORTS],
    /// Whose request is in the hands of the firmware.
    running: Option<Port>,
    /// Who wants the counts of the sensor.
    raw: Option<Port>,
}

impl<const STEPS: usize, const PORTS: usize, O: BorrowMut<Outbox<STEPS, PORTS>>> Link<STEPS, O, PORTS> {
    /// Before the first byte. `parameters` and `calibration` are those in effect, `outbox` is empty.
    pub fn new(identity: Identity, parameters: &Parameters, calibration: &Calibration, mut outbox: O) -> Self {
        outbox.borrow_mut().belong_to(identity.boot);
        Self {
            identity,
            parameters: *parameters,
            calibration: *calibration,
            assembly: Assembly::new(),
            outbox,
            desks: core::array::from_fn(|_| Desk::new()),
            running: None,
            raw: None,
        }
    }

    fn desk(&self, port: Port) -> &Desk {
        &self.desks[port.index()]
    }

    fn desk_mut(&mut self, port: Port) -> &mut Desk {
        &mut self.desks[port.index()]
    }

    /// Keeps a step until the laptops have it.
    pub fn push(&mut self, step: &Step) {
        self.outbox.borrow_mut().push(PackedStep::pack(step));
    }

    /// Whether a laptop with the same messages has said hello: only then other messages make sense.
    pub fn connected(&self, port: Port) -> bool {
        self.desk(port).peer.is_some()
    }

    /// The laptop that wants the counts of the sensor.
    pub fn raw(&self) -> Option<Port> {
        self.raw.filter(|&port| self.connected(port))
    }

    /// Whether another laptop, which is still there, records the counts of the sensor.
    pub fn raw_for_another(&self, port: Port, now: Micros) -> bool {
        self.raw().is_some_and(|other| other != port && !self.outbox.borrow().is_silent(other, now))
    }

    /// Steps that wait for the acknowledgement of this laptop.
    pub fn waiting(&self, port: Port) -> usize {
        self.outbox.borrow().waiting(port)
    }

    /// What was counted since the boot.
    pub fn counters(&self, port: Port) -> LinkCounters {
        let (desk, outbox) = (self.desk(port), self.outbox.borrow());
        LinkCounters {
            frames: *desk.decoder.counters(),
            steps_resent: outbox.resent(port),
            steps_dropped: outbox.dropped(port),
            messages_dropped: desk.messages_dropped,
        }
    }

    /// Counts a message that was not sent because the line was busy.
    pub fn count_dropped_message(&mut self, port: Port) {
        let desk = self.desk_mut(port);
        desk.messages_dropped = desk.messages_dropped.saturating_add(1);
    }

    /// Takes in bytes of the laptop, in whatever pieces they come.
    pub fn receive(&mut self, port: Port, mut bytes: &[u8], now: Micros) {
        while let Some(frame) = self.desk_mut(port).decoder.next(&mut bytes) {
            let Ok(message) = frame else {
                self.desk_mut(port).unreadable(now);
                continue;
            };
            self.outbox.borrow_mut().hear(port, now);
            match message {
                ToShoe::Hello(hello) => self.greet(port, &hello, now),
                ToShoe::Ack(ack) => {
                    if ack.boot == self.identity.boot {
                        self.outbox.borrow_mut().acknowledge(port, &ack, now);
                    }
                }
                ToShoe::TimeRequest(number) => self.desk_mut(port).question = Some((number, now)),
                ToShoe::Command(command) => self.command(port, command, now),
            }
        }
    }

    /// The connection at this port ended; a cable that is pulled out does not tell.
    pub fn part(&mut self, port: Port, now: Micros) {
        self.desk_mut(port).part(now);
        self.raw = self.raw.filter(|&of| of != port);
    }

    fn greet(&mut self, port: Port, hello: &LaptopHello, now: Micros) {
        let outbox = self.outbox.borrow_mut();
        let desk = &mut self.desks[port.index()];
        desk.hello_due = now;
        if (hello.protocol, hello.schema) != (PROTOCOL, SCHEMA) {
            desk.peer = None;
            outbox.disengage(port);
            return;
        }
        if desk.peer.as_ref().is_none_or(|peer| peer.session != hello.session) {
            desk.peer = Some(Peer::new(hello.session));
            self.raw = self.raw.filter(|&of| of != port);
            self.running = self.running.filter(|&of| of != port);
            outbox.start_over(port, now);
        }
        outbox.resend_all(port, now);
    }

    fn command(&mut self, port: Port, command: Command, now: Micros) {
        let Some(peer) = self.desks[port.index()].peer.as_mut() else { return };
        if !peer.accepts(&command) {
            return;
        }
        let ask = |request| CommandState::Waiting(command.number, request);
        let tell = |outcome| CommandState::Answered(command.number, outcome);
        peer.command = match command.action {
            Action::Order(order) => ask(Request::Order(order)),
            Action::Raw(on) => ask(Request::Raw(on)),
            Action::Write(item, chunk) => match self.assembly.push(item, &chunk) {
                Ok(Some(value)) => ask(Request::Write(value)),
                Ok(None) => tell(Outcome::Done),
                Err(refusal) => tell(Outcome::Refused(refusal)),
            },
            Action::Read(item, offset) => {
                let value = match item {
                    Item::Parameters => Value::Parameters(self.parameters),
                    Item::Calibration => Value::Calibration(self.calibration),
                };
                tell(value.chunk(offset).map_or_else(Outcome::Refused, Outcome::Piece))
            }
            Action::Resend => {
                self.outbox.borrow_mut().resend_all(port, now);
                tell(Outcome::Done)
            }
            Action::Pair(_) if port == Port::Radio => tell(Outcome::Refused(Refusal::Port)),
            Action::Pair(seconds) => ask(Request::Pair(seconds)),
        };
        peer.reply_due = !peer.command.open();
    }

    /// What the firmware has to do, once, and for whom. It must be answered before the next one comes.
    pub fn request(&mut self) -> Option<(Port, Request)> {
        if self.running.is_some() {
            return None;
        }
        for (desk, port) in self.desks.iter_mut().zip(Port::ALL) {
            if let Some(peer) = &mut desk.peer
                && let CommandState::Waiting(number, request) = peer.command
            {
                peer.command = CommandState::Running(number, request);
                self.running = Some(port);
                return Some((port, request));
            }
        }
        None
    }

    /// The request that was handed out last, as long as it is not answered.
    pub fn running(&self) -> Option<&Request> {
        match &self.desk(self.running?).peer.as_ref()?.command {
            CommandState::Running(_, request) => Some(request),
            _ => None,
        }
    }

    /// Answers the request that was handed out last.
    pub fn answer(&mut self, result: Result<(), Refusal>) {
        let Some(port) = self.running.take() else { return };
        let Some(peer) = &mut self.desks[port.index()].peer else { return };
        let CommandState::Running(number, request) = peer.command else { return };
        peer.command = CommandState::Answered(number, result.map_or_else(Outcome::Refused, |()| Outcome::Done));
        peer.reply_due = true;
        if result.is_ok() {
            match request {
                Request::Write(Value::Parameters(parameters)) => self.parameters = parameters,
                Request::Write(Value::Calibration(calibration)) => self.calibration = calibration,
                Request::Raw(true) => self.raw = Some(port),
                Request::Raw(false) => self.raw = self.raw.filter(|&of| of != port),
                Request::Order(_) | Request::Pair(_) => {}
            }
        }
    }

    /// The next frame of the link's own that is to be sent now to the laptop of this port.
    pub fn transmit<'a>(&mut self, port: Port, now: Micros, buffer: &'a mut [u8; FRAME_MAX]) -> Option<&'a [u8]> {
        let message = self.next(port, now)?;
        // Every message fits, as the tests show for the largest of each.
        frame::encode(&message, buffer).ok()
    }

    fn next(&mut self, port: Port, now: Micros) -> Option<FromShoe> {
        let desk = self.desk_mut(port);
        if desk.take_hello(now) {
            return Some(FromShoe::Hello(self.hello(port)));
        }
        desk.peer.as_ref()?;
        desk.take_answer(now).or_else(|| self.outbox.borrow_mut().next(port, now).map(FromShoe::Step))
    }

    fn hello(&self, port: Port) -> Hello {
        Hello {
            protocol: PROTOCOL,
            schema: SCHEMA,
            boot: self.identity.boot,
            accepted: self.connected(port),
            firmware: text(self.identity.firmware),
            board: text(self.identity.board),
        }
    }

    /// When [`Link::transmit`] should be asked again if nothing happens before; a time that has passed means at once.
    pub fn deadline(&self, port: Port, now: Micros) -> Micros {
        let desk = self.desk(port);
        let Some(peer) = &desk.peer else { return desk.hello_due };
        if peer.reply_due || desk.question.is_some() {
            return now;
        }
        self.outbox.borrow().deadline(port, now).map_or(desk.hello_due, |due| due.min(desk.hello_due))
    }
}

#[cfg(test)]
mod tests {
    use super::super::desk::{HELLO_US, SAID_AGAIN_US};
    use super::super::frame::AnyDecoder;
    use super::super::golden;
    use super::super::message::{Ack, TimeReply};
    use super::super::outbox::Pace;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const SESSION: u32 = 77;

    fn link() -> Link<16> {
        let identity = Identity { boot: 3, firmware: "1.2.3", board: "bench" };
        Link::new(identity, &Parameters::default(), &Calibration::default(), Outbox::new(0, Pace::default()))
    }

    fn hear(link: &mut Link<16>, message: &ToShoe, now: Micros) {
        link.receive(Port::Serial, frame::encode(message, &mut [0; FRAME_MAX]).unwrap(), now);
    }

    fn say(link: &mut Link<16>, now: Micros) -> Vec<FromShoe> {
        let mut said = Vec::new();
        let mut buffer = [0; FRAME_MAX];
        while let Some(mut frame) = link.transmit(Port::Serial, now, &mut buffer) {
            said.push(AnyDecoder::new().next(&mut frame).unwrap().unwrap());
        }
        said
    }

    fn hello(session: u32, schema: u64) -> ToShoe {
        ToShoe::Hello(LaptopHello { protocol: PROTOCOL, schema, session, software: text("test") })
    }

    fn command(number: u32, action: Action) -> ToShoe {
        ToShoe::Command(Command { session: SESSION, number, action })
    }

    fn connected() -> Link<16> {
        let mut link = link();
        hear(&mut link, &hello(SESSION, SCHEMA), Micros(0));
        assert!(matches!(&say(&mut link, Micros(0))[..], [FromShoe::Hello(hello)] if hello.accepted));
        link
    }

    fn replies(link: &mut Link<16>) -> Vec<(u32, Outcome)> {
        let said = say(link, Micros(1));
        said.into_iter()
            .filter_map(|message| match message {
                FromShoe::Reply(reply) => Some((reply.number, reply.outcome)),
                _ => None,
            })
            .collect()
    }

    #[test]
    fn nothing_but_hellos_is_said_before_a_laptop_with_the_same_messages_is_there() {
        let mut link = link();
        link.push(&golden::step());
        hear(&mut link, &ToShoe::TimeRequest(1), Micros(0));
        let only_hello = |said: &[FromShoe]| matches!(said, [FromShoe::Hello(hello)] if !hello.accepted);
        assert!(only_hello(&say(&mut link, Micros(0))));
        assert_eq!(link.deadline(Port::Serial, Micros(0)), Micros(HELLO_US));
        assert!(say(&mut link, Micros(HELLO_US - 1)).is_empty());
        assert!(only_hello(&say(&mut link, Micros(HELLO_US))));
        hear(&mut link, &hello(SESSION, SCHEMA ^ 1), Micros(HELLO_US + 1));
        assert!(only_hello(&say(&mut link, Micros(HELLO_US + 1))), "the answer names the other schema");
        hear(&mut link, &hello(SESSION, SCHEMA), Micros(HELLO_US + 2));
        let said = say(&mut link, Micros(HELLO_US + 2));
        assert!(matches!(said[..], [FromShoe::Hello(_), FromShoe::TimeReply(_), FromShoe::Step(_)]));
        // Another program replaces the one that was there.
        hear(&mut link, &hello(SESSION, SCHEMA ^ 1), Micros(HELLO_US + 3));
        assert!(!link.connected(Port::Serial));
    }

    #[test]
    fn what_cannot_be_read_before_the_greeting_is_answered_with_a_hello_but_not_too_often() {
        let mut link = link();
        assert_eq!(say(&mut link, Micros(0)).len(), 1);
        let garbage = [0, 9, 9, 0];
        link.receive(Port::Serial, &garbage, Micros(20_000));
        assert_eq!(link.deadline(Port::Serial, Micros(20_000)), Micros(SAID_AGAIN_US));
        assert_eq!(say(&mut link, Micros(SAID_AGAIN_US)).len(), 1);
        link.receive(Port::Serial, &garbage, Micros(500_000));
        assert_eq!(say(&mut link, Micros(500_000)).len(), 1);
        assert_eq!(link.deadline(Port::Serial, Micros(500_000)), Micros(500_000 + HELLO_US));
        let mut link = connected();
        link.receive(Port::Serial, &garbage, Micros(500_000));
        assert!(say(&mut link, Micros(900_000)).is_empty());
    }

    #[test]
    fn the_time_is_told_at_both_ends() {
        let mut link = connected();
        hear(&mut link, &ToShoe::TimeRequest(9), Micros(1_000));
        let expected = TimeReply { number: 9, received: Micros(1_000), sent: Micros(1_400) };
        assert_eq!(say(&mut link, Micros(1_400)), [FromShoe::TimeReply(expected)]);
    }

    #[test]
    fn a_command_is_carried_out_once_and_answered_each_time_it_comes() {
        let mut link = connected();
        let init = command(1, Action::Order(Order::Init));
        hear(&mut link, &init, Micros(1));
        assert_eq!(link.request(), Some((Port::Serial, Request::Order(Order::Init))));
        // It is still being carried out when it comes again, and so is another one.
        hear(&mut link, &init, Micros(1));
        hear(&mut link, &command(2, Action::Order(Order::Reset)), Micros(1));
        assert_eq!((link.request(), replies(&mut link)), (None, Vec::new()));
        link.answer(Err(Refusal::NotNow));
        let reply = (1, Outcome::Refused(Refusal::NotNow));
        assert_eq!(replies(&mut link), std::slice::from_ref(&reply));
        hear(&mut link, &init, Micros(1));
        assert_eq!((link.request(), replies(&mut link)), (None, [reply].into()));
        hear(&mut link, &command(2, Action::Order(Order::Reset)), Micros(1));
        assert_eq!(link.request(), Some((Port::Serial, Request::Order(Order::Reset))));
        link.answer(Ok(()));
        assert_eq!(replies(&mut link), [(2, Outcome::Done)]);
        hear(&mut link, &init, Micros(1));
        assert_eq!((link.request(), replies(&mut link)), (None, Vec::new()), "a late one");
    }

    #[test]
    fn the_numbers_of_another_session_begin_anew() {
        let mut link = connected();
        hear(&mut link, &command(1, Action::Raw(true)), Micros(1));
        assert_eq!((link.request(), link.raw()), (Some((Port::Serial, Request::Raw(true))), None));
        link.answer(Ok(()));
        assert_eq!(link.raw(), Some(Port::Serial));
        hear(&mut link, &hello(SESSION + 1, SCHEMA), Micros(2));
        assert_eq!(link.raw(), None);
        say(&mut link, Micros(2));
        hear(&mut link, &command(2, Action::Raw(true)), Micros(3));
        assert!(link.request().is_none() && replies(&mut link).is_empty(), "a command of the session before");
        hear(
            &mut link,
            &ToShoe::Command(Command { session: SESSION + 1, number: 1, action: Action::Order(Order::Init) }),
            Micros(4),
        );
        assert_eq!(link.request(), Some((Port::Serial, Request::Order(Order::Init))));
    }

    #[test]
    fn parameters_are_written_and_read_back() {
        let new = Parameters { start_after_s: 9.0, ..Parameters::default() };
        let mut link = connected();
        let (mut number, mut offset) = (0, 0);
        loop {
            let piece = Value::Parameters(new).chunk(offset).unwrap();
            offset += piece.bytes.len() as u16;
            number += 1;
            let total = piece.total;
            hear(&mut link, &command(number, Action::Write(Item::Parameters, piece)), Micros(1));
            if offset == total {
                break;
            }
            assert_eq!(replies(&mut link), [(number, Outcome::Done)]);
        }
        hear(&mut link, &command(number + 1, Action::Read(Item::Parameters, 0)), Micros(1));
        assert_eq!(link.request(), Some((Port::Serial, Request::Write(Value::Parameters(new)))));
        link.answer(Ok(()));
        assert_eq!(replies(&mut link), [(number, Outcome::Done)]);
        hear(&mut link, &command(number + 1, Action::Read(Item::Parameters, 128)), Micros(1));
        assert_eq!(replies(&mut link), [(number + 1, Outcome::Piece(Value::Parameters(new).chunk(128).unwrap()))]);
    }

    #[test]
    fn refused_parameters_leave_the_old_ones() {
        let mut link = connected();
        for offset in [0, 128, 256] {
            let piece = Value::Parameters(Parameters::documented()).chunk(offset).unwrap();
            hear(&mut link, &command(1 + u32::from(offset), Action::Write(Item::Parameters, piece)), Micros(1));
        }
        assert!(matches!(link.request(), Some((Port::Serial, Request::Write(Value::Parameters(_))))));
        link.answer(Err(Refusal::Value));
        hear(&mut link, &command(999, Action::Read(Item::Parameters, 0)), Micros(1));
        let old = Outcome::Piece(Value::Parameters(Parameters::default()).chunk(0).unwrap());
        assert_eq!(replies(&mut link).last(), Some(&(999, old)));
    }

    #[test]
    fn acknowledged_steps_are_forgotten_but_not_by_those_of_another_boot() {
        let mut link = connected();
        link.push(&golden::step());
        assert!(matches!(say(&mut link, Micros(10))[..], [FromShoe::Step(_)]));
        hear(&mut link, &ToShoe::Ack(Ack { boot: 2, next: 1, later: 0 }), Micros(20));
        assert_eq!(link.waiting(Port::Serial), 1);
        hear(&mut link, &ToShoe::Ack(Ack { boot: 3, next: 1, later: 0 }), Micros(20));
        assert_eq!(link.waiting(Port::Serial), 0);
        assert_eq!(link.deadline(Port::Serial, Micros(20)), Micros(i64::MAX));
    }

    /// A shoe with a radio, and a laptop at each of its ports.
    fn both() -> Link<16, Outbox<16, 2>, 2> {
        let identity = Identity { boot: 3, firmware: "1.2.3", board: "bench" };
        let outbox = Outbox::new(0, Pace::default());
        let mut link = Link::new(identity, &Parameters::default(), &Calibration::default(), outbox);
        for (session, port) in (SESSION..).zip(Port::ALL) {
            hear_at(&mut link, port, &hello(session, SCHEMA), Micros(0));
            assert!(matches!(&say_at(&mut link, port, Micros(0))[..], [FromShoe::Hello(hello)] if hello.accepted));
        }
        link
    }

    fn hear_at(link: &mut Link<16, Outbox<16, 2>, 2>, port: Port, message: &ToShoe, now: Micros) {
        link.receive(port, frame::encode(message, &mut [0; FRAME_MAX]).unwrap(), now);
    }

    fn say_at(link: &mut Link<16, Outbox<16, 2>, 2>, port: Port, now: Micros) -> Vec<FromShoe> {
        let mut said = Vec::new();
        let mut buffer = [0; FRAME_MAX];
        while let Some(mut frame) = link.transmit(port, now, &mut buffer) {
            said.push(AnyDecoder::new().next(&mut frame).unwrap().unwrap());
        }
        said
    }

    fn command_at(port: Port, number: u32, action: Action) -> ToShoe {
        ToShoe::Command(Command { session: SESSION + port.index() as u32, number, action })
    }

    #[test]
    fn each_laptop_is_answered_what_it_has_asked() {
        let mut link = both();
        hear_at(&mut link, Port::Serial, &command_at(Port::Serial, 1, Action::Order(Order::Init)), Micros(1));
        hear_at(&mut link, Port::Radio, &command_at(Port::Radio, 1, Action::Order(Order::Reset)), Micros(1));
        hear_at(&mut link, Port::Radio, &ToShoe::TimeRequest(8), Micros(1));
        assert_eq!(link.request(), Some((Port::Serial, Request::Order(Order::Init))));
        assert_eq!(link.request(), None, "one after the other");
        link.answer(Err(Refusal::NotNow));
        assert_eq!(link.request(), Some((Port::Radio, Request::Order(Order::Reset))));
        link.answer(Ok(()));
        let refused = Outcome::Refused(Refusal::NotNow);
        assert!(matches!(&say_at(&mut link, Port::Serial, Micros(2))[..],
            [FromShoe::Reply(reply)] if reply.outcome == refused && reply.session == SESSION));
        assert!(matches!(&say_at(&mut link, Port::Radio, Micros(2))[..],
            [FromShoe::TimeReply(_), FromShoe::Reply(reply)] if reply.outcome == Outcome::Done));
    }

    #[test]
    fn others_may_pair_when_who_has_the_cable_says_so() {
        let mut link = both();
        hear_at(&mut link, Port::Radio, &command_at(Port::Radio, 1, Action::Pair(60)), Micros(1));
        assert_eq!(link.request(), None);
        assert!(matches!(&say_at(&mut link, Port::Radio, Micros(1))[..],
            [FromShoe::Reply(reply)] if reply.outcome == Outcome::Refused(Refusal::Port)));
        hear_at(&mut link, Port::Serial, &command_at(Port::Serial, 1, Action::Pair(60)), Micros(1));
        assert_eq!(link.request(), Some((Port::Serial, Request::Pair(60))));
    }

    #[test]
    fn who_comes_back_is_greeted_first_and_goes_on() {
        let mut link = both();
        hear_at(&mut link, Port::Radio, &command_at(Port::Radio, 1, Action::Raw(true)), Micros(1));
        assert_eq!(link.request(), Some((Port::Radio, Request::Raw(true))));
        link.answer(Ok(()));
        say_at(&mut link, Port::Radio, Micros(1));
        assert!(link.raw_for_another(Port::Serial, Micros(2)) && !link.raw_for_another(Port::Radio, Micros(2)));
        // Half a frame, then the connection breaks.
        link.receive(Port::Radio, &[0, 9, 9], Micros(2));
        link.part(Port::Radio, Micros(2));
        assert_eq!(link.raw(), None);
        link.push(&golden::step());
        hear_at(&mut link, Port::Radio, &hello(SESSION + 1, SCHEMA), Micros(3));
        let said = say_at(&mut link, Port::Radio, Micros(3));
        assert!(matches!(said[..], [FromShoe::Hello(_), FromShoe::Step(_)]), "{said:?}");
        assert_eq!(link.counters(Port::Radio).frames.good, 3, "the hello came whole");
        // Its command comes again and is not carried out again.
        hear_at(&mut link, Port::Radio, &command_at(Port::Radio, 1, Action::Raw(true)), Micros(4));
        assert_eq!(link.request(), None);
    }

    #[test]
    fn a_thousand_steps_fit_the_memory() {
        // 22 bytes for each, 16 for each of the 64 under way, and what the rest of the link needs.
        assert!(size_of::<Link<1_000>>() < 26_000, "{}", size_of::<Link<1_000>>());
    }

    proptest! {
        #[test]
        fn no_bytes_panic(
            chunks in proptest::collection::vec((proptest::collection::vec(any::<u8>(), 0..80), 0..3_u8, any::<i64>()), 0..40),
        ) {
            let mut link = connected();
            for (bytes, kind, now) in chunks {
                match kind {
                    0 => link.receive(Port::Serial, &bytes, Micros(now)),
                    1 => link.receive(Port::Serial, frame::encode(&bytes[..], &mut [0; FRAME_MAX]).unwrap(), Micros(now)),
                    _ => link.push(&golden::step()),
                }
                link.request();
                link.answer(Ok(()));
                link.deadline(Port::Serial, Micros(now));
                for _ in 0..4 {
                    link.transmit(Port::Serial, Micros(now), &mut [0; FRAME_MAX]);
                }
            }
        }
    }
}
