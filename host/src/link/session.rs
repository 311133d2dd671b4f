//! The laptop's end of the wire: bytes of the shoe to events, and what is said to it.
//!
//! A [`Session`] is one run of the program. It says hello until it is answered, asks for the time, acknowledges steps and
//! repeats a command until its reply comes. Whoever owns it gives it the bytes that come ([`Session::receive`]), takes the
//! events and keeps them ([`Session::event`]), and only then sends what is due ([`Session::transmit`]): what is acknowledged
//! is forgotten by the shoe. Times are those of one clock of the laptop.

use super::clock::Clock;
pub use super::event::{Event, mismatch};
use super::questions::Questions;
use sohle_shared::time::Micros;
use sohle_shared::wire::frame::{AnyDecoder, FRAME_MAX, FrameCounters, encode};
use sohle_shared::wire::inbox::{Delivery, Inbox};
use sohle_shared::wire::message::{Action, Command, FromShoe, Hello, LaptopHello, Reply, SentStep, ToShoe, text};
use sohle_shared::wire::{PROTOCOL, SCHEMA};
use std::collections::VecDeque;

/// Between two hellos that nobody answers. **Units:** microseconds, as all of these.
const HELLO_US: i64 = 1_000_000;
/// A shoe that asks for a hello gets one no more often than this.
const HELLO_SHORTEST_US: i64 = 100_000;
/// Between two acknowledgements.
const ACK_US: i64 = 20_000;
/// Between two tries of a command.
const COMMAND_US: i64 = 300_000;
/// After so many tries the shoe probably does not know this session.
const COMMAND_TRIES: u32 = 4;
/// Nothing was heard for so long.
const SILENCE_US: i64 = 3_000_000;
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
}

/// One run of the program at its end of the wire.
#[derive(Debug)]
pub struct Session {
    hello: LaptopHello,
    /// The latest time told.
    now: Micros,
    decoder: AnyDecoder,
    events: VecDeque<Event>,
    counters: Counters,
    clock: Clock,
    /// Steps by boot; the last is the boot that is spoken to.
    boots: VecDeque<Inbox>,
    /// The boot has accepted our hello: what it says is understood.
    greeted: bool,
    /// The line was opened anew, perhaps to a shoe that was there before.
    reopened: bool,
    /// What was last told as refused.
    refused: Option<Hello>,
    hello_due: Option<Micros>,
    hello_sent: Option<Micros>,
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
}

impl Session {
    /// Before the first byte. `session` differs from one run of the program to the next; `software` is its version.
    pub fn new(session: u32, software: &str) -> Self {
        Self {
            hello: LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session, software: text(software) },
            now: Micros(0),
            decoder: AnyDecoder::new(),
            events: VecDeque::new(),
            counters: Counters::default(),
            clock: Clock::default(),
            boots: VecDeque::new(),
            greeted: false,
            reopened: false,
            refused: None,
            hello_due: Some(Micros(0)),
            hello_sent: None,
            ack_due: None,
            ack_sent: Micros(-ACK_US),
            questions: Questions::default(),
            commands: VecDeque::new(),
            command_number: 0,
            command_due: Micros(0),
            tries: 0,
            heard: None,
            silent: false,
        }
    }

    /// Takes in bytes of the shoe, in whatever pieces they come.
    pub fn receive(&mut self, mut bytes: &[u8], now: Micros) {
        self.advance(now);
        while let Some(frame) = self.decoder.next(&mut bytes) {
            let Ok(message) = frame else { continue };
            self.heard = Some(now);
            if std::mem::take(&mut self.silent) {
                self.events.push_back(Event::Back);
            }
            match message {
                FromShoe::Hello(hello) => self.greet(hello, now),
                FromShoe::Step(sent) => self.step(&sent, now),
                _ if !self.greeted => {}
                FromShoe::Reply(reply) => self.reply(reply, now),
                FromShoe::TimeReply(reply) => {
                    if let Some(asked) = self.questions.answered(reply.number) {
                        self.clock.exchange(asked, &reply, now);
                        self.counters.round_trips += 1;
                    }
                }
                FromShoe::Raw(raw) => self.events.push_back(Event::Raw(raw)),
                FromShoe::Attitude(attitude) => self.events.push_back(Event::Attitude(attitude)),
                FromShoe::Status(status) => self.events.push_back(Event::Status(status)),
                FromShoe::Log(log) => self.events.push_back(Event::Log(log)),
            }
        }
    }

    fn advance(&mut self, now: Micros) {
        self.now = now;
        self.clock.advance(now);
        let heard = *self.heard.get_or_insert(now);
        if !self.silent && now - heard >= SILENCE_US {
            self.silent = true;
            self.events.push_back(Event::Silent);
        }
    }

    fn greet(&mut self, hello: Hello, now: Micros) {
        if (hello.protocol, hello.schema) != (PROTOCOL, SCHEMA) {
            // Such a shoe goes on to say hello: we shall hear when it has another firmware.
            (self.greeted, self.hello_due) = (false, None);
            if self.refused.as_ref() != Some(&hello) {
                self.events.push_back(Event::Refused(hello.clone()));
                self.refused = Some(hello);
            }
            return;
        }
        let current = self.boots.back().map(Inbox::boot);
        if current != Some(hello.boot) {
            let known = self.boots.iter().position(|inbox| inbox.boot() == hello.boot);
            match known.map(|at| (at, self.reopened)) {
                // A hello that was long on its way: nothing boots twice by the same number.
                Some((_, false)) => return,
                // Another shoe that was there before.
                Some((at, true)) => self.boots.rotate_left(at + 1),
                None => self.meet(hello.boot, current.is_some()),
            }
            self.clock = Clock::default();
            (self.greeted, self.ack_due) = (false, None);
            self.questions.forget();
        }
        self.refused = None;
        if !hello.accepted {
            self.ask_for_hello(now, HELLO_SHORTEST_US);
            return;
        }
        (self.hello_due, self.reopened) = (None, false);
        if !self.greeted {
            self.greeted = true;
            self.questions.begin(now);
            self.command_due = now;
            self.events.push_back(Event::Connected(hello));
        }
    }

    fn meet(&mut self, boot: u32, rebooted: bool) {
        if self.boots.len() == BOOTS {
            self.boots.pop_front();
        }
        self.boots.push_back(Inbox::new(boot));
        if rebooted {
            self.counters.reboots += 1;
            self.events.push_back(Event::Rebooted { boot });
        }
    }

    /// Makes a hello due, so long after the last one.
    fn ask_for_hello(&mut self, now: Micros, spacing_us: i64) {
        let due = self.hello_sent.map_or(now, |sent| now.max(sent + spacing_us));
        self.hello_due = Some(self.hello_due.map_or(due, |planned| planned.min(due)));
    }

    fn step(&mut self, sent: &SentStep, now: Micros) {
        let Some(inbox) = self.boots.iter_mut().find(|inbox| inbox.boot() == sent.boot) else {
            // The hello that told of this boot was lost. The step comes again.
            self.ask_for_hello(now, HELLO_US);
            return;
        };
        self.counters.repeated += u64::from(!inbox.push(sent));
        while let Some(delivery) = inbox.pop() {
            let boot = sent.boot;
            self.events.push_back(match delivery {
                Delivery::Step { id, step } => {
                    self.counters.steps += 1;
                    Event::Step { boot, id, step }
                }
                Delivery::Gap { first, count } => {
                    self.counters.gaps += u64::from(count);
                    Event::Gap { boot, first, count }
                }
            });
        }
        self.ack_due.get_or_insert(now.max(self.ack_sent + ACK_US));
    }

    fn reply(&mut self, reply: Reply, now: Micros) {
        let awaited = |command: &mut Command| (reply.session, reply.number) == (command.session, command.number);
        if self.tries > 0 && self.commands.pop_front_if(awaited).is_some() {
            self.events.push_back(Event::Reply { number: reply.number, outcome: reply.outcome });
            (self.command_due, self.tries) = (now, 0);
        }
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
        if self.hello_due.is_some_and(|due| due <= now) {
            (self.hello_due, self.hello_sent) = (Some(now + HELLO_US), Some(now));
            // Whoever answers may have another clock.
            self.questions.forget();
            say(&ToShoe::Hello(self.hello.clone()), out);
        }
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
            (false, heard) => Some(heard.unwrap_or(now) + SILENCE_US),
        };
        let due = [self.hello_due, self.ack_due, self.question_due(), self.command_due(), silence];
        due.into_iter().flatten().min().map_or(Micros(i64::MAX), |due| due.max(now))
    }

    /// The line was opened anew: half a frame is forgotten and hello is said again.
    pub fn reconnected(&mut self) {
        self.decoder.restart();
        (self.greeted, self.reopened, self.refused) = (false, true, None);
        self.hello_due = Some(self.now);
    }

    /// The clock of the shoe's present boot.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// What was counted so far.
    pub fn counters(&self) -> Counters {
        Counters { frames: *self.decoder.counters(), ..self.counters }
    }
}

/// Appends a frame.
fn say(message: &ToShoe, out: &mut Vec<u8>) {
    let mut buffer = [0; FRAME_MAX];
    out.extend(encode(message, &mut buffer).expect("no message of the protocol is longer than a frame"));
}
