//! One laptop as the shoe's end of the wire knows it: its session, its last command, and what it is owed.

use super::link::{Request, ToShoeDecoder};
use super::message::{Command, FromShoe, Outcome, Reply, TimeReply};
use crate::time::Micros;

/// Between two hellos that nobody answers. **Units:** microseconds.
pub(super) const HELLO_US: i64 = 1_000_000;
/// The same while what comes cannot be understood: it may have been the answer. **Units:** microseconds.
pub(super) const SAID_AGAIN_US: i64 = 100_000;

/// The laptop that said hello.
#[derive(Clone, Debug)]
pub(super) struct Peer {
    pub(super) session: u32,
    pub(super) command: CommandState,
    /// The reply is to be sent.
    pub(super) reply_due: bool,
}

impl Peer {
    pub(super) fn new(session: u32) -> Self {
        Self { session, command: CommandState::None, reply_due: false }
    }

    /// Whether this is a new command, which the state is to be set for. Others are answered again, or have been.
    pub(super) fn accepts(&mut self, command: &Command) -> bool {
        match self.command.number() {
            _ if self.session != command.session => false,
            Some(number) if number == command.number => {
                self.reply_due = !self.command.open();
                false
            }
            // An old one that comes late has been answered; a new one has to wait for the one before.
            Some(number) => number < command.number && !self.command.open(),
            None => true,
        }
    }
}

/// The last command.
#[derive(Clone, Debug)]
pub(super) enum CommandState {
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

    pub(super) fn open(&self) -> bool {
        matches!(self, Self::Waiting(..) | Self::Running(..))
    }
}

/// What is known of the laptop of one port.
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) decoder: ToShoeDecoder,
    pub(super) peer: Option<Peer>,
    pub(super) hello_due: Micros,
    /// A question for the time, and when it came.
    pub(super) question: Option<(u32, Micros)>,
    pub(super) messages_dropped: u32,
}

impl Desk {
    pub(super) fn new() -> Self {
        Self { decoder: ToShoeDecoder::new(), peer: None, hello_due: Micros(0), question: None, messages_dropped: 0 }
    }

    /// Something came that could not be read.
    pub(super) fn unreadable(&mut self, now: Micros) {
        if self.peer.is_none() {
            let soonest = self.hello_due + (SAID_AGAIN_US - HELLO_US);
            self.hello_due = self.hello_due.min(soonest.max(now));
        }
    }

    /// The connection ended. Who comes next hears a hello first; the one who was there goes on when it comes back.
    pub(super) fn part(&mut self, now: Micros) {
        self.decoder.restart();
        (self.question, self.hello_due) = (None, now);
    }

    /// Whether a hello is to be sent now; the next one is planned then.
    pub(super) fn take_hello(&mut self, now: Micros) -> bool {
        let due = now >= self.hello_due;
        if due {
            self.hello_due = if self.peer.is_some() { Micros(i64::MAX) } else { now + HELLO_US };
        }
        due
    }

    /// The answer that is to be sent now.
    pub(super) fn take_answer(&mut self, now: Micros) -> Option<FromShoe> {
        let peer = self.peer.as_mut()?;
        if let Some((number, received)) = self.question.take() {
            return Some(FromShoe::TimeReply(TimeReply { number, received, sent: now }));
        }
        match &peer.command {
            CommandState::Answered(number, outcome) if peer.reply_due => {
                peer.reply_due = false;
                let (session, number) = (peer.session, *number);
                Some(FromShoe::Reply(Reply { session, number, outcome: outcome.clone() }))
            }
            _ => None,
        }
    }
}
