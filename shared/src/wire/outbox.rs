//! Steps that wait on the shoe until the laptop has them.
//!
//! Selective repeat: up to [`WINDOW`] steps are under way at a time; the laptop tells which of them have come, and those
//! that have not are sent again when their time is over, or at once when a step sent later has come before them. While
//! nothing is heard of the laptop, only the oldest step is tried now and then. When the laptop is back, the rest follows at
//! a bounded pace. When there is no room, the oldest step gives way and is counted; the laptop learns it from the number of
//! the oldest step kept.
//!
//! # Source
//! The waiting time is that of RFC 6298 (sections 2 and 3: smoothed round-trip time, none from a step sent twice).

use super::message::{Ack, SentStep};
use super::packed::PackedStep;
use crate::time::Micros;

/// Steps under way at a time. One less than the laptop's [`Ack`] can tell of.
pub const WINDOW: usize = 64;

/// When steps are sent. All times in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// From one step to the next: bounds the load on the line.
    pub spacing_us: i64,
    /// Waiting time for an acknowledgement before a round trip was measured.
    pub first_timeout_us: i64,
    /// Waiting times are no shorter than this.
    pub shortest_timeout_us: i64,
    /// And no longer.
    pub longest_timeout_us: i64,
    /// When nothing was heard for so long, the laptop counts as gone.
    pub silence_us: i64,
    /// Longest time between two tries while it is gone; they begin at `first_timeout_us`.
    pub longest_probe_us: i64,
}

impl Default for Pace {
    /// For a serial line: 200 steps in a second are 12 % of 921 600 baud.
    fn default() -> Self {
        Self {
            spacing_us: 5_000,
            first_timeout_us: 250_000,
            shortest_timeout_us: 50_000,
            longest_timeout_us: 1_000_000,
            silence_us: 3_000_000,
            longest_probe_us: 8_000_000,
        }
    }
}

/// What is known of a step under way.
#[derive(Clone, Copy, Debug)]
struct Flight {
    /// How often it was sent.
    times: u8,
    arrived: bool,
    /// When it was sent last.
    sent: Micros,
    /// When it is sent again.
    due: Micros,
}

impl Flight {
    const NONE: Self = Self { times: 0, arrived: false, sent: Micros(0), due: Micros(0) };
}

/// The steps that the laptop may not have yet: at most `N`.
#[derive(Clone, Debug)]
pub struct Outbox<const N: usize> {
    pace: Pace,
    boot: u32,
    steps: [PackedStep; N],
    /// Where in `steps` the oldest lies.
    head: usize,
    count: usize,
    /// Number of the oldest.
    oldest: u32,
    /// By the number of the step, modulo [`WINDOW`].
    flights: [Flight; WINDOW],
    /// Smoothed round-trip time and its variation.
    round_trip: Option<(i64, i64)>,
    /// No step is sent before.
    quiet_until: Micros,
    heard: Micros,
    /// Between two tries while nothing is heard.
    probe_us: i64,
    resent: u32,
    dropped: u32,
}

impl<const N: usize> Outbox<N> {
    /// Empty. `boot` goes out with each step.
    pub const fn new(boot: u32, pace: Pace) -> Self {
        const { assert!(N > 0) };
        Self {
            pace,
            boot,
            steps: [PackedStep::EMPTY; N],
            head: 0,
            count: 0,
            oldest: 0,
            flights: [Flight::NONE; WINDOW],
            round_trip: None,
            quiet_until: Micros(0),
            heard: Micros(0),
            probe_us: pace.first_timeout_us,
            resent: 0,
            dropped: 0,
        }
    }

    /// Keeps a step. When there is no room, the oldest gives way.
    pub fn push(&mut self, step: PackedStep) {
        if self.count == N {
            self.forget_oldest();
            self.dropped = self.dropped.saturating_add(1);
        }
        let place = (self.head + self.count) % N;
        self.steps[place] = step;
        self.count += 1;
    }

    fn forget_oldest(&mut self) {
        self.flights[self.oldest as usize % WINDOW] = Flight::NONE;
        self.oldest = self.oldest.wrapping_add(1);
        self.head = (self.head + 1) % N;
        self.count -= 1;
    }

    /// Steps kept.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether the laptop has every step.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Steps sent again so far.
    pub fn resent(&self) -> u32 {
        self.resent
    }

    /// Steps that gave way to newer ones so far.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Something came from the laptop. When it had been gone, all that waits is due again.
    pub fn hear(&mut self, now: Micros) {
        if self.is_silent(now) {
            self.resend_all(now);
        }
        self.heard = now;
        self.probe_us = self.pace.first_timeout_us;
    }

    /// Everything that is under way is due again.
    pub fn resend_all(&mut self, now: Micros) {
        for flight in self.flights.iter_mut().filter(|flight| flight.times > 0 && !flight.arrived) {
            flight.due = now;
        }
    }

    fn is_silent(&self, now: Micros) -> bool {
        now - self.heard > self.pace.silence_us
    }

    /// Takes in what has arrived. An acknowledgement of steps that were never kept changes nothing.
    pub fn acknowledge(&mut self, ack: &Ack, now: Micros) {
        let before_next = ack.next.wrapping_sub(self.oldest) as i32;
        if before_next > self.count as i32 {
            return;
        }
        let mut latest_sent = None;
        for id in (self.oldest..).take(before_next.max(0) as usize) {
            latest_sent = latest_sent.max(self.arrive(id, now));
            self.forget_oldest();
        }
        for bit in (0..64).filter(|bit| ack.later >> bit & 1 == 1) {
            let id = ack.next.wrapping_add(1 + bit);
            if (id.wrapping_sub(self.oldest) as usize) < self.count.min(WINDOW) {
                latest_sent = latest_sent.max(self.arrive(id, now));
            }
        }
        // What was sent before a step that has come, and has not come itself, is probably lost.
        if let Some(latest) = latest_sent {
            for flight in self.flights.iter_mut() {
                if flight.times > 0 && !flight.arrived && flight.sent < latest {
                    flight.due = flight.due.min(now);
                }
            }
        }
    }

    /// Marks a step as arrived; the time it was sent, if that is news.
    fn arrive(&mut self, id: u32, now: Micros) -> Option<Micros> {
        let flight = &mut self.flights[id as usize % WINDOW];
        if flight.times == 0 || flight.arrived {
            return None;
        }
        flight.arrived = true;
        let sent = flight.sent;
        if flight.times == 1 {
            let measured = (now - sent).max(0);
            self.round_trip = Some(match self.round_trip {
                None => (measured, measured / 2),
                Some((mean, variation)) => {
                    (mean + (measured - mean) / 8, variation + ((measured - mean).abs() - variation) / 4)
                }
            });
        }
        Some(sent)
    }

    /// How long a step that was sent so often waits for its acknowledgement.
    fn timeout(&self, times: u8) -> i64 {
        let first = match self.round_trip {
            None => self.pace.first_timeout_us,
            Some((mean, variation)) => mean + 4 * variation,
        };
        let doubled = first.max(self.pace.shortest_timeout_us) << times.saturating_sub(1).min(4);
        doubled.min(self.pace.longest_timeout_us)
    }

    /// The step that is to be sent now, if one is.
    pub fn next(&mut self, now: Micros) -> Option<SentStep> {
        if now < self.quiet_until {
            return None;
        }
        let (offset, due) = self.first_due(now)?;
        if due > now {
            return None;
        }
        let id = self.oldest.wrapping_add(offset as u32);
        let times = self.flights[id as usize % WINDOW].times.saturating_add(1);
        self.resent = self.resent.saturating_add(u32::from(times > 1));
        let wait = if self.is_silent(now) {
            let wait = self.probe_us;
            self.probe_us = (wait * 2).min(self.pace.longest_probe_us);
            wait
        } else {
            self.timeout(times)
        };
        self.flights[id as usize % WINDOW] = Flight { times, arrived: false, sent: now, due: now + wait };
        self.quiet_until = now + self.pace.spacing_us;
        let step = self.steps[(self.head + offset) % N];
        Some(SentStep { boot: self.boot, id, oldest: self.oldest, step })
    }

    /// When [`Outbox::next`] should be asked again; `None` when only a new step or the laptop can change anything.
    pub fn deadline(&self, now: Micros) -> Option<Micros> {
        self.first_due(now).map(|(_, due)| due.max(self.quiet_until))
    }

    /// Place after the oldest, and time, of what is to be sent next.
    fn first_due(&self, now: Micros) -> Option<(usize, Micros)> {
        let mut under_way = (0..self.count.min(WINDOW)).filter_map(|offset| {
            let flight = &self.flights[self.oldest.wrapping_add(offset as u32) as usize % WINDOW];
            let due = if flight.times == 0 { Micros(i64::MIN) } else { flight.due };
            (!flight.arrived).then_some((offset, due))
        });
        if self.is_silent(now) { under_way.next() } else { under_way.min_by_key(|&(_, due)| due) }
    }
}
