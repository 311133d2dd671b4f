//! The shoe's end of the wire.
//!
//! A [`Link`] owns the steps that wait, answers hellos, questions for the time and repeated commands, and puts parameters
//! together. The firmware gives it the bytes that come and the steps that are made, sends the frames it hands out, and
//! carries out its [`Request`]s. Before a laptop with the same messages has said hello, nothing but hellos is sent.

use super::frame::{self, Decoder, FRAME_MAX};
use super::message::{
    Action, Calibration, Command, FromShoe, Hello, LaptopHello, LinkCounters, Outcome, Refusal, Reply, TimeReply,
    ToShoe, text,
};
use super::outbox::{Outbox, Pace};
use super::packed::PackedStep;
use super::transfer::{self, Assembly};
use super::{PROTOCOL, SCHEMA};
use crate::step::{FloorMode, Step};
use crate::time::Micros;
use crate::tracker::Parameters;

/// Between two hellos that nobody answers. **Units:** microseconds.
const HELLO_US: i64 = 1_000_000;

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
    /// Back to RESET.
    Reset,
    /// Wait for a rest and start from there.
    Init,
    /// Start from the next stance.
    Track,
    /// What the ground does.
    FloorMode(Option<FloorMode>),
    /// Put these parameters into effect.
    Parameters(Parameters),
    /// A step of a calibration.
    Calibrate(Calibration),
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
#[derive(Debug)]
pub struct Link<const STEPS: usize> {
    identity: Identity,
    parameters: Parameters,
    assembly: Assembly,
    decoder: ToShoeDecoder,
    outbox: Outbox<STEPS>,
    peer: Option<Peer>,
    hello_due: Micros,
    /// A question for the time, and when it came.
    question: Option<(u32, Micros)>,
    raw: bool,
    messages_dropped: u32,
}

impl<const STEPS: usize> Link<STEPS> {
    /// Before the first byte. `parameters` are those in effect.
    pub fn new(identity: Identity, parameters: &Parameters, pace: Pace) -> Self {
        Self {
            identity,
            parameters: *parameters,
            assembly: Assembly::new(),
            decoder: ToShoeDecoder::new(),
            outbox: Outbox::new(identity.boot, pace),
            peer: None,
            hello_due: Micros(0),
            question: None,
            raw: false,
            messages_dropped: 0,
        }
    }

    /// Keeps a step until the laptop has it.
    pub fn push(&mut self, step: &Step) {
        self.outbox.push(PackedStep::pack(step));
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
        self.outbox.len()
    }

    /// What was counted since the boot.
    pub fn counters(&self) -> LinkCounters {
        LinkCounters {
            frames: *self.decoder.counters(),
            steps_resent: self.outbox.resent(),
            steps_dropped: self.outbox.dropped(),
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
            let Ok(message) = frame else { continue };
            self.outbox.hear(now);
            match message {
                ToShoe::Hello(hello) => self.greet(&hello, now),
                ToShoe::Ack(ack) => {
                    if ack.boot == self.identity.boot {
                        self.outbox.acknowledge(&ack, now);
                    }
                }
                ToShoe::TimeRequest(number) => self.question = Some((number, now)),
                ToShoe::Command(command) => self.command(command, now),
            }
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
        }
        self.outbox.resend_all(now);
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
        let outcome = match command.action {
            Action::Reset => Err(Request::Reset),
            Action::Init => Err(Request::Init),
            Action::Track => Err(Request::Track),
            Action::FloorMode(mode) => Err(Request::FloorMode(mode)),
            Action::Calibrate(calibration) => Err(Request::Calibrate(calibration)),
            Action::WriteParameters(chunk) => match self.assembly.push(&chunk) {
                Ok(Some(parameters)) => Err(Request::Parameters(parameters)),
                Ok(None) => Ok(Outcome::Done),
                Err(refusal) => Ok(Outcome::Refused(refusal)),
            },
            Action::ReadParameters(offset) => {
                Ok(transfer::chunk(&self.parameters, offset).map_or_else(Outcome::Refused, Outcome::Parameters))
            }
            Action::Raw(on) => {
                self.raw = on;
                Ok(Outcome::Done)
            }
            Action::Resend => {
                self.outbox.resend_all(now);
                Ok(Outcome::Done)
            }
        };
        peer.command = match outcome {
            Ok(outcome) => CommandState::Answered(command.number, outcome),
            Err(request) => CommandState::Waiting(command.number, request),
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

    /// Answers the request that was handed out last.
    pub fn answer(&mut self, result: Result<(), Refusal>) {
        let Some(peer) = &mut self.peer else { return };
        let CommandState::Running(number, request) = peer.command else { return };
        if let (Request::Parameters(parameters), Ok(())) = (request, result) {
            self.parameters = parameters;
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
        self.outbox.next(now).map(FromShoe::Step)
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
        self.outbox.deadline(now).map_or(self.hello_due, |due| due.min(self.hello_due))
    }
}
