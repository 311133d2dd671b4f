//! One laptop's part of the outbox: which of the steps kept it has, which are under way to it, and when they are sent again.
//!
//! # Source
//! The waiting time is that of RFC 6298 (sections 2 and 3: smoothed round-trip time, none from a step sent twice).

use super::message::Ack;
use super::outbox::{Pace, WINDOW};
use crate::time::Micros;

/// What is known of a step under way.
#[derive(Clone, Copy, Debug)]
struct Flight {
    /// How often it was sent.
    times: u8,
    arrived: bool,
    /// When it was sent last.
    sent: Micros,
    /// After so long it is sent again. **Units:** microseconds; the longest waiting time is a few seconds.
    wait_us: u32,
}

impl Flight {
    const NONE: Self = Self { times: 0, arrived: false, sent: Micros(0), wait_us: 0 };

    /// When it is sent again.
    fn due(&self) -> Micros {
        self.sent + i64::from(self.wait_us)
    }

    /// It is sent again no later than `now`.
    fn hurry(&mut self, now: Micros) {
        self.wait_us = self.wait_us.min(whole(now - self.sent));
    }
}

/// A time that is neither negative nor an hour long.
fn whole(time_us: i64) -> u32 {
    time_us.clamp(0, i64::from(u32::MAX)) as u32
}

/// The way to one laptop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lane {
    pub(super) pace: Pace,
    /// Number of the oldest step that the laptop may not have; never older than the oldest kept.
    pub(super) next: u32,
    /// A laptop has greeted here.
    engaged: bool,
    /// By the number of the step, modulo [`WINDOW`].
    flights: [Flight; WINDOW],
    /// Smoothed round-trip time and its variation.
    round_trip: Option<(i64, i64)>,
    /// No step is sent before.
    quiet_until: Micros,
    heard: Micros,
    /// Between two tries while nothing is heard.
    pub(super) probe_us: i64,
    pub(super) resent: u32,
    pub(super) dropped: u32,
}

impl Lane {
    pub(super) const fn new(pace: Pace) -> Self {
        Self {
            pace,
            next: 0,
            engaged: false,
            flights: [Flight::NONE; WINDOW],
            round_trip: None,
            quiet_until: Micros(0),
            heard: Micros(0),
            probe_us: pace.first_timeout_us,
            resent: 0,
            dropped: 0,
        }
    }

    /// Steps before `end` that the laptop may not have.
    pub(super) fn waiting(&self, end: u32) -> usize {
        end.wrapping_sub(self.next) as usize
    }

    /// Whether steps are kept for this laptop: it has greeted and was heard not too long ago.
    pub(super) fn counts(&self, now: Micros) -> bool {
        self.engaged && now - self.heard <= self.pace.patience_us
    }

    /// The laptop does not speak this language: nothing is kept for it.
    pub(super) fn disengage(&mut self) {
        self.engaged = false;
    }

    /// Steps before `oldest` are no more; how many of them the laptop did not have.
    pub(super) fn give_up_before(&mut self, oldest: u32) -> u32 {
        let missed = (oldest.wrapping_sub(self.next) as i32).max(0) as u32;
        for _ in 0..missed {
            self.forget();
        }
        missed
    }

    /// The oldest is no longer under way.
    fn forget(&mut self) {
        self.flights[self.next as usize % WINDOW] = Flight::NONE;
        self.next = self.next.wrapping_add(1);
    }

    /// Something came from the laptop. When it had been gone, all that waits is due again.
    pub(super) fn hear(&mut self, now: Micros) {
        if self.is_silent(now) {
            self.resend_all(now);
        }
        self.heard = now;
        self.probe_us = self.pace.first_timeout_us;
    }

    /// Everything that is under way is due again.
    pub(super) fn resend_all(&mut self, now: Micros) {
        for flight in self.flights.iter_mut().filter(|flight| flight.times > 0 && !flight.arrived) {
            flight.hurry(now);
        }
    }

    /// Another program listens: it does not have what came to the one before it ahead of the oldest, so that is due too.
    pub(super) fn start_over(&mut self, now: Micros) {
        self.engaged = true;
        self.flights.iter_mut().for_each(|flight| flight.arrived = false);
        self.resend_all(now);
    }

    pub(super) fn is_silent(&self, now: Micros) -> bool {
        now - self.heard > self.pace.silence_us
    }

    /// Takes in what has arrived of the steps before `end`. An acknowledgement of others changes nothing.
    pub(super) fn acknowledge(&mut self, ack: &Ack, end: u32, now: Micros) {
        let before_next = ack.next.wrapping_sub(self.next) as i32;
        if before_next > self.waiting(end) as i32 {
            return;
        }
        let mut latest_sent = None;
        for id in (self.next..).take(before_next.max(0) as usize) {
            latest_sent = latest_sent.max(self.arrive(id, now));
            self.forget();
        }
        for bit in (0..64).filter(|bit| ack.later >> bit & 1 == 1) {
            let id = ack.next.wrapping_add(1 + bit);
            if (id.wrapping_sub(self.next) as usize) < self.waiting(end).min(WINDOW) {
                latest_sent = latest_sent.max(self.arrive(id, now));
            }
        }
        // What was sent before a step that has come, and has not come itself, is probably lost.
        if let Some(latest) = latest_sent {
            for flight in self.flights.iter_mut() {
                if flight.times > 0 && !flight.arrived && flight.sent < latest {
                    flight.hurry(now);
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

    /// The number of the step before `end` that is to be sent now, if one is.
    pub(super) fn due(&self, end: u32, now: Micros) -> Option<u32> {
        if now < self.quiet_until {
            return None;
        }
        self.first_due(end, now).filter(|&(_, due)| due <= now).map(|(id, _)| id)
    }

    /// The step of this number was sent.
    pub(super) fn sent(&mut self, id: u32, now: Micros) {
        let times = self.flights[id as usize % WINDOW].times.saturating_add(1);
        self.resent = self.resent.saturating_add(u32::from(times > 1));
        let wait = if self.is_silent(now) {
            let wait = self.probe_us;
            self.probe_us = (wait * 2).min(self.pace.longest_probe_us);
            wait
        } else {
            self.timeout(times)
        };
        self.flights[id as usize % WINDOW] = Flight { times, arrived: false, sent: now, wait_us: whole(wait) };
        self.quiet_until = now + self.pace.spacing_us;
    }

    /// When a step before `end` may be due; `None` when only a new step or the laptop can change anything.
    pub(super) fn deadline(&self, end: u32, now: Micros) -> Option<Micros> {
        self.first_due(end, now).map(|(_, due)| due.max(self.quiet_until))
    }

    /// Number and time of what is to be sent next.
    fn first_due(&self, end: u32, now: Micros) -> Option<(u32, Micros)> {
        let mut under_way = (0..self.waiting(end).min(WINDOW) as u32).filter_map(|offset| {
            let id = self.next.wrapping_add(offset);
            let flight = &self.flights[id as usize % WINDOW];
            let due = if flight.times == 0 { now } else { flight.due().max(now) };
            (!flight.arrived).then_some((id, due))
        });
        // Of several that are due, the oldest: others wait for it.
        if self.is_silent(now) { under_way.next() } else { under_way.min_by_key(|&(_, due)| due) }
    }
}
