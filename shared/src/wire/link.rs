//! The shoe's end of the wire.
//!
//! A [`Link`] owns the steps that wait, answers hellos, questions for the time and repeated commands, and puts parameters
//! together. The firmware gives it the bytes that come and the steps that are made, sends the frames it hands out, and
//! carries out its [`Request`]s. Before a laptop with the same messages has said hello, nothing but hellos is sent.

use super::frame::{self, Decoder, FRAME_MAX};
use super::message::{
    Action, Command, FromShoe, Hello, LaptopHello, LinkCounters, Outcome, Refusal, Reply, TimeReply, ToShoe, text,
};
use super::outbox::Outbox;
use super::packed::PackedStep;
use super::transfer::{self, Assembly, Item, Value};

use super::{PROTOCOL, SCHEMA};
use crate::calibration::Calibration;
use crate::step::Step;
use crate::time::Micros;
use crate::tracker::{Order, Parameters};
use core::borrow::BorrowMut;

/// Between two hellos that nobody answers. **Units:** microseconds.
const HELLO_US: i64 = 1_000_000;
/// The same while what comes cannot be understood: it may have been the answer. **Units:** microseconds.
const SAID_AGAIN_US: i64 = 100_000;

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
}

/// The laptop that said hello.
#[derive(Clone, Debug)]
struct Peer {
    session: u32,
    command: CommandState,
    /// The reply is to be sent.
    reply_due: bool,
}

/// The last command.
#[derive(Clone, Debug)]
enum CommandState {
    /// None yet.
    None,
    /// To be handed to the firmware.
    Waiting(u32, Request),
    /// In its hands.
    Running(u32, Request),
    /// Answered.
    Answered(u32, Outcome),
}

impl CommandState {
    fn number(&self) -> Option<u32> {
        match self {
            Self::None => None,
            Self::Waiting(number, _) | Self::Running(number, _) | Self::Answered(number, _) => Some(*number),
        }
    }

    fn open(&self) -> bool {
        matches!(self, Self::Waiting(..) | Self::Running(..))
    }
}

/// The shoe's end of the wire, with room for `STEPS` steps.
///
/// They may lie elsewhere (`O` is then `&mut Outbox<STEPS>`): a thousand take 23 kB, which no microcontroller should have
/// on its stack while they are put in their place.
#[derive(Debug)]
pub struct Link<const STEPS: usize, O = Outbox<STEPS>> {
    identity: Identity,
    parameters: Parameters,
    calibration: Calibration,
    assembly: Assembly,
    decoder: ToShoeDecoder,
    outbox: O,
    peer: Option<Peer>,
    hello_due: Micros,
    /// A question for the time, and when it came.
    question: Option<(u32, Micros)>,
    raw: bool,
    messages_dropped: u32,
}

impl<const STEPS: usize, O: BorrowMut<Outbox<STEPS>>> Link<STEPS, O> {
    /// Before the first byte. `parameters` and `calibration` are those in effect, `outbox` is empty.
    pub fn new(identity: Identity, parameters: &Parameters, calibration: &Calibration, mut outbox: O) -> Self {
        outbox.borrow_mut().belong_to(identity.boot);
        Self {
            identity,
            parameters: *parameters,
            calibration: *calibration,
            assembly: Assembly::new(),
            decoder: ToShoeDecoder::new(),
            outbox,
            peer: None,
            hello_due: Micros(0),
            question: None,
            raw: false,
            messages_dropped: 0,
        }
    }

    /// Keeps a step until the laptop has it.
    pub fn push(&mut self, step: &Step) {
        self.outbox.borrow_mut().push(PackedStep::pack(step));
    }

    /// Whether a laptop with the same messages has said hello: only then other messages make sense.
    pub fn connected(&self) -> bool {
        self.peer.is_some()
    }

    /// Whether the laptop wants the counts of the sensor.
    pub fn raw(&self) -> bool {
        self.raw && self.connected()
    }

    /// Steps that wait for their acknowledgement.
    pub fn waiting(&self) -> usize {
        self.outbox.borrow().len()
    }

    /// What was counted since the boot.
    pub fn counters(&self) -> LinkCounters {
        LinkCounters {
            frames: *self.decoder.counters(),
            steps_resent: self.outbox.borrow().resent(),
            steps_dropped: self.outbox.borrow().dropped(),
            messages_dropped: self.messages_dropped,
        }
    }

    /// Counts a message that was not sent because the line was busy.
    pub fn count_dropped_message(&mut self) {
        self.messages_dropped = self.messages_dropped.saturating_add(1);
    }

    /// Takes in bytes of the laptop, in whatever pieces they come.
    pub fn receive(&mut self, mut bytes: &[u8], now: Micros) {
        while let Some(frame) = self.decoder.next(&mut bytes) {
            let Ok(message) = frame else {
                self.unreadable(now);
                continue;
            };
            self.outbox.borrow_mut().hear(now);
            match message {
                ToShoe::Hello(hello) => self.greet(&hello, now),
                ToShoe::Ack(ack) => {
                    if ack.boot == self.identity.boot {
                        self.outbox.borrow_mut().acknowledge(&ack, now);
                    }
                }
                ToShoe::TimeRequest(number) => self.question = Some((number, now)),
                ToShoe::Command(command) => self.command(command, now),
            }
        }
    }

    fn unreadable(&mut self, now: Micros) {
        if !self.connected() {
            let soonest = self.hello_due + (SAID_AGAIN_US - HELLO_US);
            self.hello_due = self.hello_due.min(soonest.max(now));
        }
    }

    fn greet(&mut self, hello: &LaptopHello, now: Micros) {
        self.hello_due = now;
        if (hello.protocol, hello.schema) != (PROTOCOL, SCHEMA) {
            self.peer = None;
            return;
        }
        if self.peer.as_ref().is_none_or(|peer| peer.session != hello.session) {
            self.peer = Some(Peer { session: hello.session, command: CommandState::None, reply_due: false });
            self.raw = false;
            self.outbox.borrow_mut().start_over(now);
        }
        self.outbox.borrow_mut().resend_all(now);
    }

    fn command(&mut self, command: Command, now: Micros) {
        let Some(peer) = self.peer.as_mut().filter(|peer| peer.session == command.session) else { return };
        match peer.command.number() {
            Some(number) if number == command.number => {
                peer.reply_due = !peer.command.open();
                return;
            }
            // An old one that comes late has been answered; a new one has to wait for the one before.
            Some(number) if number > command.number || peer.command.open() => return,
            _ => {}
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
                self.outbox.borrow_mut().resend_all(now);
                tell(Outcome::Done)
            }
        };
        peer.reply_due = !peer.command.open();
    }

    /// What the firmware has to do, once. It must be answered before the next one comes.
    pub fn request(&mut self) -> Option<Request> {
        let command = &mut self.peer.as_mut()?.command;
        let CommandState::Waiting(number, request) = *command else { return None };
        *command = CommandState::Running(number, request);
        Some(request)
    }

    /// The request that was handed out last, as long as it is not answered.
    pub fn running(&self) -> Option<&Request> {
        match &self.peer.as_ref()?.command {
            CommandState::Running(_, request) => Some(request),
            _ => None,
        }
    }

    /// Answers the request that was handed out last.
    pub fn answer(&mut self, result: Result<(), Refusal>) {
        let Some(peer) = &mut self.peer else { return };
        let CommandState::Running(number, request) = peer.command else { return };
        if result.is_ok() {
            match request {
                Request::Write(Value::Parameters(parameters)) => self.parameters = parameters,
                Request::Write(Value::Calibration(calibration)) => self.calibration = calibration,
                Request::Raw(on) => self.raw = on,
                Request::Order(_) => {}
            }
        }
        peer.command = CommandState::Answered(number, result.map_or_else(Outcome::Refused, |()| Outcome::Done));
        peer.reply_due = true;
    }

    /// The next frame of the link's own that is to be sent now.
    pub fn transmit<'a>(&mut self, now: Micros, buffer: &'a mut [u8; FRAME_MAX]) -> Option<&'a [u8]> {
        let message = self.next(now)?;
        // Every message fits, as the tests show for the largest of each.
        frame::encode(&message, buffer).ok()
    }

    fn next(&mut self, now: Micros) -> Option<FromShoe> {
        if now >= self.hello_due {
            self.hello_due = if self.connected() { Micros(i64::MAX) } else { now + HELLO_US };
            return Some(FromShoe::Hello(self.hello()));
        }
        let peer = self.peer.as_mut()?;
        if let Some((number, received)) = self.question.take() {
            return Some(FromShoe::TimeReply(TimeReply { number, received, sent: now }));
        }
        if let (true, CommandState::Answered(number, outcome)) = (peer.reply_due, &peer.command) {
            peer.reply_due = false;
            return Some(FromShoe::Reply(Reply { session: peer.session, number: *number, outcome: outcome.clone() }));
        }
        self.outbox.borrow_mut().next(now).map(FromShoe::Step)
    }

    fn hello(&self) -> Hello {
        Hello {
            protocol: PROTOCOL,
            schema: SCHEMA,
            boot: self.identity.boot,
            accepted: self.connected(),
            firmware: text(self.identity.firmware),
            board: text(self.identity.board),
        }
    }

    /// When [`Link::transmit`] should be asked again if nothing happens before; a time that has passed means at once.
    pub fn deadline(&self, now: Micros) -> Micros {
        let Some(peer) = &self.peer else { return self.hello_due };
        if peer.reply_due || self.question.is_some() {
            return now;
        }
        self.outbox.borrow().deadline(now).map_or(self.hello_due, |due| due.min(self.hello_due))
    }
}

#[cfg(test)]
mod tests {
    use super::super::frame::AnyDecoder;
    use super::super::golden;
    use super::super::message::Ack;
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
        link.receive(frame::encode(message, &mut [0; FRAME_MAX]).unwrap(), now);
    }

    fn say(link: &mut Link<16>, now: Micros) -> Vec<FromShoe> {
        let mut said = Vec::new();
        let mut buffer = [0; FRAME_MAX];
        while let Some(mut frame) = link.transmit(now, &mut buffer) {
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
        assert_eq!(link.deadline(Micros(0)), Micros(HELLO_US));
        assert!(say(&mut link, Micros(HELLO_US - 1)).is_empty());
        assert!(only_hello(&say(&mut link, Micros(HELLO_US))));
        hear(&mut link, &hello(SESSION, SCHEMA ^ 1), Micros(HELLO_US + 1));
        assert!(only_hello(&say(&mut link, Micros(HELLO_US + 1))), "the answer names the other schema");
        hear(&mut link, &hello(SESSION, SCHEMA), Micros(HELLO_US + 2));
        let said = say(&mut link, Micros(HELLO_US + 2));
        assert!(matches!(said[..], [FromShoe::Hello(_), FromShoe::TimeReply(_), FromShoe::Step(_)]));
        // Another program replaces the one that was there.
        hear(&mut link, &hello(SESSION, SCHEMA ^ 1), Micros(HELLO_US + 3));
        assert!(!link.connected());
    }

    #[test]
    fn what_cannot_be_read_before_the_greeting_is_answered_with_a_hello_but_not_too_often() {
        let mut link = link();
        assert_eq!(say(&mut link, Micros(0)).len(), 1);
        let garbage = [0, 9, 9, 0];
        link.receive(&garbage, Micros(20_000));
        assert_eq!(link.deadline(Micros(20_000)), Micros(SAID_AGAIN_US));
        assert_eq!(say(&mut link, Micros(SAID_AGAIN_US)).len(), 1);
        link.receive(&garbage, Micros(500_000));
        assert_eq!(say(&mut link, Micros(500_000)).len(), 1);
        assert_eq!(link.deadline(Micros(500_000)), Micros(500_000 + HELLO_US));
        let mut link = connected();
        link.receive(&garbage, Micros(500_000));
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
        assert_eq!(link.request(), Some(Request::Order(Order::Init)));
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
        assert_eq!(link.request(), Some(Request::Order(Order::Reset)));
        link.answer(Ok(()));
        assert_eq!(replies(&mut link), [(2, Outcome::Done)]);
        hear(&mut link, &init, Micros(1));
        assert_eq!((link.request(), replies(&mut link)), (None, Vec::new()), "a late one");
    }

    #[test]
    fn the_numbers_of_another_session_begin_anew() {
        let mut link = connected();
        hear(&mut link, &command(1, Action::Raw(true)), Micros(1));
        assert_eq!((link.request(), link.raw()), (Some(Request::Raw(true)), false));
        link.answer(Ok(()));
        assert!(link.raw());
        hear(&mut link, &hello(SESSION + 1, SCHEMA), Micros(2));
        assert!(!link.raw());
        say(&mut link, Micros(2));
        hear(&mut link, &command(2, Action::Raw(true)), Micros(3));
        assert!(link.request().is_none() && replies(&mut link).is_empty(), "a command of the session before");
        hear(
            &mut link,
            &ToShoe::Command(Command { session: SESSION + 1, number: 1, action: Action::Order(Order::Init) }),
            Micros(4),
        );
        assert_eq!(link.request(), Some(Request::Order(Order::Init)));
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
        assert_eq!(link.request(), Some(Request::Write(Value::Parameters(new))));
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
        assert!(matches!(link.request(), Some(Request::Write(Value::Parameters(_)))));
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
        assert_eq!(link.waiting(), 1);
        hear(&mut link, &ToShoe::Ack(Ack { boot: 3, next: 1, later: 0 }), Micros(20));
        assert_eq!(link.waiting(), 0);
        assert_eq!(link.deadline(Micros(20)), Micros(i64::MAX));
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
                    0 => link.receive(&bytes, Micros(now)),
                    1 => link.receive(frame::encode(&bytes[..], &mut [0; FRAME_MAX]).unwrap(), Micros(now)),
                    _ => link.push(&golden::step()),
                }
                link.request();
                link.answer(Ok(()));
                link.deadline(Micros(now));
                for _ in 0..4 {
                    link.transmit(Micros(now), &mut [0; FRAME_MAX]);
                }
            }
        }
    }
}
