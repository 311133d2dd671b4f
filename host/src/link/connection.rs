//! A [`Session`] over a [`Transport`]: what happens at a shoe, one thing after the other.

use super::address::Address;
use super::event::{Event, mismatch};
use super::session::Session;
use super::transport::{HostClock, Outlet, Signal, Transport};
use sohle_shared::time::Micros;
use sohle_shared::wire::message::{Action, Outcome, Refusal};
use sohle_shared::wire::transfer::{Assembly, Item, Value};
use std::time::{Duration, Instant, SystemTime};

/// What happened.
#[derive(Debug)]
pub enum Happening {
    /// The port is open.
    Opened,
    /// The port was open and is no longer, for this reason.
    Closed(String),
    /// The port cannot be opened, for this reason.
    Unreachable(String),
    /// The shoe said something, or went silent.
    Event(Event),
}

/// Why a question to the shoe has no answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AskError {
    /// It did not come in time.
    #[error("the shoe did not answer within {0} s")]
    Late(u64),
    /// The shoe cannot be understood.
    #[error("{0}")]
    Refused(String),
    /// The shoe refused.
    #[error("the shoe refused: {}", reason(.0))]
    Refusal(Refusal),
    /// The answer is that to another question.
    #[error("the shoe answered something else")]
    Other,
}

fn reason(refusal: &Refusal) -> &'static str {
    match refusal {
        Refusal::Unsupported => "its firmware cannot do this",
        Refusal::NotNow => "not in its present state",
        Refusal::Failed => "it tried and failed",
        Refusal::Piece(_) => "a piece of the value did not follow the one before",
        Refusal::TooLong => "the value is too long",
        Refusal::Checksum => "the value was damaged on the way",
        Refusal::Value => "the numbers make no sense",
        Refusal::Port => "only over its serial line",
    }
}

/// How long a question waits for its answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// The laptop's end of the wire to one shoe.
#[derive(Debug)]
pub struct Connection {
    transport: Transport,
    outlet: Option<Outlet>,
    session: Session,
    clock: HostClock,
    out: Vec<u8>,
}

impl Connection {
    /// Begins to connect. The port is opened anew as often as needed.
    pub fn open(address: Address) -> Self {
        let clock = HostClock::start();
        Self::over(Transport::open(address, clock), clock)
    }

    /// Speaks over this port, by the clock that it was given.
    pub(super) fn over(transport: Transport, clock: HostClock) -> Self {
        // Another number for every run of the program: the shoe knows its commands by it.
        let nanoseconds = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_nanos());
        let session = (nanoseconds ^ nanoseconds >> 32) as u32 ^ std::process::id().rotate_left(16);
        Self {
            transport,
            outlet: None,
            session: Session::new(session, env!("CARGO_PKG_VERSION")),
            clock,
            out: Vec::new(),
        }
    }

    /// Leaves the steps on the shoe, for the next program.
    pub fn leaving_steps(mut self) -> Self {
        self.session.leave_steps();
        self
    }

    /// The time since the connection was begun.
    pub fn now(&self) -> Micros {
        self.clock.now()
    }

    /// What is known of the shoe.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// What happens next, if something does within `patience`.
    pub fn next(&mut self, patience: Duration) -> Option<Happening> {
        let until = Instant::now() + patience;
        loop {
            if let Some(event) = self.session.event() {
                return Some(Happening::Event(event));
            }
            self.speak();
            let left = until.saturating_duration_since(Instant::now());
            let now = self.now();
            let due = Duration::from_micros(u64::try_from(self.session.deadline(now) - now).unwrap_or(0));
            let pause = if self.outlet.is_some() { left.min(due) } else { left };
            match self.transport.next(pause) {
                Some(Signal::Opened(outlet)) => {
                    self.outlet = Some(outlet);
                    self.session.reconnected();
                    return Some(Happening::Opened);
                }
                Some(Signal::Bytes(bytes, time)) => self.session.receive(&bytes, time),
                Some(Signal::Closed(reason)) => {
                    self.outlet = None;
                    return Some(Happening::Closed(reason));
                }
                Some(Signal::Unreachable(reason)) => return Some(Happening::Unreachable(reason)),
                None if left.is_zero() => return None,
                None => {}
            }
        }
    }

    /// Sends what is due. A port that takes nothing is opened anew, and what was lost is sent again.
    fn speak(&mut self) {
        let Some(outlet) = &mut self.outlet else { return };
        self.out.clear();
        self.session.transmit(self.clock.now(), &mut self.out);
        if !self.out.is_empty() && outlet.write(&self.out).is_err() {
            self.outlet = None;
        }
    }

    /// Asks the shoe to do something and waits for the answer; what happens meanwhile is given to `meanwhile`.
    pub fn ask(&mut self, action: Action, meanwhile: &mut impl FnMut(Happening, &Self)) -> Result<Outcome, AskError> {
        let asked = self.session.command(action);
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            match self.next(until.saturating_duration_since(Instant::now())) {
                Some(Happening::Event(Event::Reply { number, outcome })) if number == asked => {
                    return match outcome {
                        Outcome::Refused(refusal) => Err(AskError::Refusal(refusal)),
                        other => Ok(other),
                    };
                }
                Some(Happening::Event(Event::Refused(hello))) => return Err(AskError::Refused(mismatch(&hello))),
                Some(happening) => meanwhile(happening, self),
                None => {}
            }
        }
        Err(AskError::Late(PATIENCE.as_secs()))
    }

    /// Asks the shoe to do something, and does not wait: the answer is a [`Event::Reply`] with the number that is returned.
    pub fn tell(&mut self, action: Action) -> u32 {
        self.session.command(action)
    }

    /// Reads a value of the shoe.
    pub fn read(&mut self, item: Item, meanwhile: &mut impl FnMut(Happening, &Self)) -> Result<Value, AskError> {
        let mut assembly = Assembly::new();
        loop {
            let Outcome::Piece(piece) = self.ask(Action::Read(item, assembly.next_offset()), meanwhile)? else {
                return Err(AskError::Other);
            };
            if let Some(value) = assembly.push(item, &piece).map_err(AskError::Refusal)? {
                return Ok(value);
            }
        }
    }

    /// Gives the shoe a value, which takes effect when all of it is there.
    pub fn write(&mut self, value: &Value, meanwhile: &mut impl FnMut(Happening, &Self)) -> Result<(), AskError> {
        let item = match value {
            Value::Parameters(_) => Item::Parameters,
            Value::Calibration(_) => Item::Calibration,
        };
        let mut offset = 0;
        loop {
            let piece = value.chunk(offset).map_err(AskError::Refusal)?;
            // A piece is at most CHUNK_MAX long.
            offset += piece.bytes.len() as u16;
            let last = offset >= piece.total;
            self.ask(Action::Write(item, piece), meanwhile)?;
            if last {
                return Ok(());
            }
        }
    }
}
