//! The laptop's end of the wire: bytes of the shoe to events, and what is said to it.
//!
//! A [`Session`] is one run of the program. It says hello until it is answered, asks for the time, acknowledges steps and
//! repeats a command until its reply comes. Whoever owns it gives it the bytes that come ([`Session::receive`]), takes the
//! events and keeps them ([`Session::event`]), and only then sends what is due ([`Session::transmit`]): what is acknowledged
//! is forgotten by the shoe. Times are those of one clock of the laptop.

mod hear;
#[cfg(test)]
mod tests;

use super::clock::Clock;
use super::copies::Decoder;
pub use super::event::{Event, mismatch};
use super::questions::Questions;
use sohle_shared::time::Micros;
use sohle_shared::wire::frame::{FRAME_MAX, FrameCounters, encode};
use sohle_shared::wire::inbox::Inbox;
use sohle_shared::wire::message::{Action, Command, Hello, LaptopHello, ToShoe, text};
use sohle_shared::wire::{PROTOCOL, SCHEMA};
use std::collections::VecDeque;

/// Between two hellos that nobody answers. **Units:** microseconds, as all of these.
const HELLO_US: i64 = 1_000_000;
/// A shoe that asks for a hello, or cannot be understood, is told again what it may not have heard no more often than this.
const SAID_AGAIN_US: i64 = 100_000;
/// Between two acknowledgements.
const ACK_US: i64 = 20_000;
/// Between two tries of a command.
const COMMAND_US: i64 = 300_000;
/// After so many tries the shoe probably does not know this session.
const COMMAND_TRIES: u32 = 4;
/// Nothing was heard for so long.
const SILENCE_US: i64 = 3_000_000;
/// The same for a shoe that sleeps: it tells every five seconds that it does.
const SILENCE_ASLEEP_US: i64 = 16_000_000;
/// Boots of the shoe whose steps are told apart.
const BOOTS: usize = 16;

/// What the session has counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Steps handed out.
    pub steps: u64,
    /// Steps that came though they had come before, or too early to be kept.
    pub repeated: u64,
    /// Steps that the shoe no longer had.
    pub gaps: u64,
    /// Reboots of the shoe.
    pub reboots: u64,
    /// Questions for the time that were answered.
    pub round_trips: u64,
    /// Frames that came.
    pub frames: FrameCounters,
    /// Messages put together from damaged frames.
    pub mended: u64,
}

/// One run of the program at its end of the wire.
#[derive(Debug)]
pub struct Session {
    hello: LaptopHello,
    /// The latest time told.
    now: Micros,
    decoder: Decoder,
    events: VecDeque<Event>,
    counters: Counters,
    clock: Clock,
    /// Steps by boot; the last is the boot that is spoken to.
    boots: VecDeque<Inbox>,
    /// The boot has accepted our hello: what it says is understood.
    greeted: bool,
    /// The line was opened anew, perhaps to a shoe that was there before.
    reopened: bool,
    /// What came last could not be read.
    garbled: bool,
    /// What was last told as refused.
    refused: Option<Hello>,
    hello_due: Option<Micros>,
    hello_sent: Option<Micros>,
    /// Steps are acknowledged.
    takes_steps: bool,
    ack_due: Option<Micros>,
    ack_sent: Micros,
    questions: Questions,
    commands: VecDeque<Command>,
    command_number: u32,
    command_due: Micros,
    /// Tries of the first command.
    tries: u32,
    heard: Option<Micros>,
    silent: bool,
    /// The shoe said last that its sensor sleeps.
    asleep: bool,
}

impl Session {
    /// Before the first byte. `session` differs from one run of the program to the next; `software` is its version.
    pub fn new(session: u32, software: &str) -> Self {
        Self {
            hello: LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session, software: text(software) },
            now: Micros(0),
            decoder: Decoder::default(),
            events: VecDeque::new(),
            counters: Counters::default(),
            clock: Clock::default(),
            boots: VecDeque::new(),
            greeted: false,
            reopened: false,
            garbled: false,
            refused: None,
            hello_due: Some(Micros(0)),
            hello_sent: None,
            takes_steps: true,
            ack_due: None,
            ack_sent: Micros(-ACK_US),
            questions: Questions::default(),
            commands: VecDeque::new(),
            command_number: 0,
            command_due: Micros(0),
            tries: 0,
            heard: None,
            silent: false,
            asleep: false,
        }
    }

    /// Acknowledges no step from now on: they stay on the shoe for the next program.
    pub fn leave_steps(&mut self) {
        self.takes_steps = false;
    }

    /// What happened next.
    pub fn event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Asks the shoe for something, after everything that it was asked for before. Returns the number of the reply.
    ///
    /// It is carried out once, unless the shoe is rebooted meanwhile: then it is asked again.
    pub fn command(&mut self, action: Action) -> u32 {
        self.command_number = self.command_number.wrapping_add(1);
        let number = self.command_number;
        self.commands.push_back(Command { session: self.hello.session, number, action });
        number
    }

    /// Appends the frames that are due. Events must have been taken before.
    pub fn transmit(&mut self, now: Micros, out: &mut Vec<u8>) {
        self.advance(now);
        if self.ack_due.is_some_and(|due| due <= now) {
            (self.ack_due, self.ack_sent) = (None, now);
            if let Some(ack) = self.boots.back().and_then(Inbox::ack) {
                say(&ToShoe::Ack(ack), out);
            }
        }
        if self.question_due().is_some_and(|due| due <= now) {
            say(&ToShoe::TimeRequest(self.questions.ask(now)), out);
        }
        if self.command_due().is_some_and(|due| due <= now)
            && let Some(command) = self.commands.front()
        {
            say(&ToShoe::Command(command.clone()), out);
            self.command_due = now + COMMAND_US;
            self.tries += 1;
            if self.tries.is_multiple_of(COMMAND_TRIES) {
                self.ask_for_hello(now, HELLO_US);
            }
        }
        if self.hello_due.is_some_and(|due| due <= now) {
            // Of many on such a line one is heard, and the shoe has no reason to say anything before.
            let again_us = if self.garbled { SAID_AGAIN_US } else { HELLO_US };
            (self.hello_due, self.hello_sent) = (Some(now + again_us), Some(now));
            // Whoever answers may have another clock.
            self.questions.forget();
            say(&ToShoe::Hello(self.hello.clone()), out);
        }
    }

    fn question_due(&self) -> Option<Micros> {
        self.understood().then_some(self.questions.due())
    }

    fn command_due(&self) -> Option<Micros> {
        (self.understood() && !self.commands.is_empty()).then_some(self.command_due)
    }

    /// The shoe has accepted the last hello.
    fn understood(&self) -> bool {
        self.greeted && self.hello_due.is_none()
    }

    /// When [`Session::transmit`] should be called if nothing comes before; not before `now`.
    pub fn deadline(&self, now: Micros) -> Micros {
        let silence = match (self.silent, self.heard) {
            (true, _) => None,
            (false, heard) => Some(heard.unwrap_or(now) + self.silence_us()),
        };
        let due = [self.hello_due, self.ack_due, self.question_due(), self.command_due(), silence];
        due.into_iter().flatten().min().map_or(Micros(i64::MAX), |due| due.max(now))
    }

    /// Who says nothing for so long is silent. **Units:** microseconds.
    fn silence_us(&self) -> i64 {
        if self.asleep { SILENCE_ASLEEP_US } else { SILENCE_US }
    }

    /// The line was opened anew: half a frame is forgotten and hello is said again.
    pub fn reconnected(&mut self) {
        self.decoder.restart();
        (self.greeted, self.reopened, self.garbled, self.refused) = (false, true, false, None);
        self.hello_due = Some(self.now);
    }

    /// The clock of the shoe's present boot.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// What was counted so far.
    pub fn counters(&self) -> Counters {
        Counters { frames: *self.decoder.counters(), mended: self.decoder.mended(), ..self.counters }
    }
}

/// Appends a frame.
fn say(message: &ToShoe, out: &mut Vec<u8>) {
    let mut buffer = [0; FRAME_MAX];
    out.extend(encode(message, &mut buffer).expect("no message of the protocol is longer than a frame"));
}
