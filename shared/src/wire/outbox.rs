//! Steps that wait on the shoe until the laptop has them.
//!
//! Selective repeat: up to [`WINDOW`] steps are under way at a time; the laptop tells which of them have come, and those
//! that have not are sent again when their time is over, or at once when a step sent later has come before them. While
//! nothing is heard of the laptop, only the oldest step is tried now and then. When the laptop is back, the rest follows at
//! a bounded pace. When there is no room, the oldest step gives way and is counted; the laptop learns it from the number of
//! the oldest step kept.
//!
//! What waits is kept as the difference of each step to the one before, in half the bytes that are sent of it.
//!
//! # Source
//! The waiting time is that of RFC 6298 (sections 2 and 3: smoothed round-trip time, none from a step sent twice).

use super::message::{Ack, SentStep};
use super::packed::PackedStep;
use super::shelf::Shelf;
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

impl Pace {
    /// For a serial line: 200 steps in a second are 12 % of 921 600 baud, so waiting ever longer would spare nothing. A
    /// round trip takes 20 ms or less, and where only a few frames come whole, each try counts.
    pub const SERIAL: Self = Self {
        spacing_us: 5_000,
        first_timeout_us: 100_000,
        shortest_timeout_us: 50_000,
        longest_timeout_us: 100_000,
        silence_us: 3_000_000,
        longest_probe_us: 8_000_000,
    };
}

impl Default for Pace {
    fn default() -> Self {
        Self::SERIAL
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

/// The steps that the laptop may not have yet. There is room for `N` as they usually are, for more when they are small and for
/// fewer when they are unlike each other.
#[derive(Clone, Debug)]
pub struct Outbox<const N: usize> {
    pace: Pace,
    boot: u32,
    steps: Shelf<N>,
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
        Self {
            pace,
            boot,
            steps: Shelf::new(),
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

    /// Empty, and nothing but zeros, so that a static takes no flash; [`Outbox::begin`] comes before anything else.
    pub const fn blank() -> Self {
        let none = Pace {
            spacing_us: 0,
            first_timeout_us: 0,
            shortest_timeout_us: 0,
            longest_timeout_us: 0,
            silence_us: 0,
            longest_probe_us: 0,
        };
        Self::new(0, none)
    }

    /// Sends at this pace from now on.
    pub fn begin(&mut self, pace: Pace) {
        (self.pace, self.probe_us) = (pace, pace.first_timeout_us);
    }

    /// The boot that the steps belong to from now on: it is not known yet when an empty outbox is made at compile time.
    pub(super) fn belong_to(&mut self, boot: u32) {
        self.boot = boot;
    }

    /// Keeps a step. When there is no room, the oldest gives way.
    pub fn push(&mut self, step: PackedStep) {
        while !self.steps.fits(&step) {
            self.forget_oldest();
            self.dropped = self.dropped.saturating_add(1);
        }
        self.steps.push(&step);
    }

    fn forget_oldest(&mut self) {
        self.flights[self.oldest as usize % WINDOW] = Flight::NONE;
        self.oldest = self.oldest.wrapping_add(1);
        self.steps.pop();
    }

    /// Steps kept.
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Whether the laptop has every step.
    pub fn is_empty(&self) -> bool {
        self.steps.len() == 0
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
            flight.hurry(now);
        }
    }

    /// Another program listens: it does not have what came to the one before it ahead of the oldest, so that is due too.
    pub fn start_over(&mut self, now: Micros) {
        self.flights.iter_mut().for_each(|flight| flight.arrived = false);
        self.resend_all(now);
    }

    fn is_silent(&self, now: Micros) -> bool {
        now - self.heard > self.pace.silence_us
    }

    /// Takes in what has arrived. An acknowledgement of steps that were never kept changes nothing.
    pub fn acknowledge(&mut self, ack: &Ack, now: Micros) {
        let before_next = ack.next.wrapping_sub(self.oldest) as i32;
        if before_next > self.len() as i32 {
            return;
        }
        let mut latest_sent = None;
        for id in (self.oldest..).take(before_next.max(0) as usize) {
            latest_sent = latest_sent.max(self.arrive(id, now));
            self.forget_oldest();
        }
        for bit in (0..64).filter(|bit| ack.later >> bit & 1 == 1) {
            let id = ack.next.wrapping_add(1 + bit);
            if (id.wrapping_sub(self.oldest) as usize) < self.len().min(WINDOW) {
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

    /// The step that is to be sent now, if one is.
    pub fn next(&mut self, now: Micros) -> Option<SentStep> {
        if now < self.quiet_until {
            return None;
        }
        let (offset, due) = self.first_due(now)?;
        if due > now {
            return None;
        }
        let step = self.steps.get(offset)?;
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
        self.flights[id as usize % WINDOW] = Flight { times, arrived: false, sent: now, wait_us: whole(wait) };
        self.quiet_until = now + self.pace.spacing_us;
        Some(SentStep { boot: self.boot, id, oldest: self.oldest, step })
    }

    /// When [`Outbox::next`] should be asked again; `None` when only a new step or the laptop can change anything.
    pub fn deadline(&self, now: Micros) -> Option<Micros> {
        self.first_due(now).map(|(_, due)| due.max(self.quiet_until))
    }

    /// Place after the oldest, and time, of what is to be sent next.
    fn first_due(&self, now: Micros) -> Option<(usize, Micros)> {
        let mut under_way = (0..self.len().min(WINDOW)).filter_map(|offset| {
            let flight = &self.flights[self.oldest.wrapping_add(offset as u32) as usize % WINDOW];
            let due = if flight.times == 0 { now } else { flight.due().max(now) };
            (!flight.arrived).then_some((offset, due))
        });
        // Of several that are due, the oldest: others wait for it.
        if self.is_silent(now) { under_way.next() } else { under_way.min_by_key(|&(_, due)| due) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const BOOT: u32 = 5;

    fn step(index: u32) -> PackedStep {
        PackedStep::pack(&crate::step::Step { index, ..golden::step() })
    }

    fn filled<const N: usize>(count: u32) -> Outbox<N> {
        let mut outbox = Outbox::new(BOOT, Pace::default());
        outbox.hear(Micros(0));
        (0..count).for_each(|index| outbox.push(step(index)));
        outbox
    }

    /// What goes out until `end`: time in milliseconds and number. Asks only when told to.
    fn sent<const N: usize>(outbox: &mut Outbox<N>, now: &mut Micros, end: Micros) -> Vec<(i64, u32)> {
        let mut sent = Vec::new();
        while let Some(due) = outbox.deadline(*now).filter(|&due| due < end) {
            *now = due.max(*now);
            sent.extend(outbox.next(*now).map(|sent| (now.0 / 1_000, sent.id)));
        }
        *now = end;
        sent
    }

    fn ack(next: u32, later: u64) -> Ack {
        Ack { boot: BOOT, next, later }
    }

    #[test]
    fn steps_go_one_after_the_other_and_wait_for_their_acknowledgement() {
        let mut outbox = filled::<8>(3);
        let mut now = Micros(0);
        assert_eq!(sent(&mut outbox, &mut now, Micros(100_000)), [(0, 0), (5, 1), (10, 2)]);
        outbox.acknowledge(&ack(3, 0), now);
        assert!(outbox.is_empty());
        assert_eq!(outbox.deadline(now), None);
        assert_eq!((outbox.resent(), outbox.dropped()), (0, 0));
    }

    #[test]
    fn only_the_missing_step_is_sent_again_and_at_once() {
        let mut outbox = filled::<8>(4);
        let mut now = Micros(0);
        sent(&mut outbox, &mut now, Micros(30_000));
        // 0, 2 and 3 have come.
        outbox.acknowledge(&ack(1, 0b11), now);
        assert_eq!(sent(&mut outbox, &mut now, Micros(60_000)), [(30, 1)]);
        outbox.acknowledge(&ack(4, 0), now);
        assert!(outbox.is_empty());
    }

    #[test]
    fn another_program_gets_what_the_one_before_had_ahead_of_the_oldest() {
        let mut outbox = filled::<8>(3);
        let mut now = Micros(0);
        sent(&mut outbox, &mut now, Micros(30_000));
        // 1 and 2 have come.
        outbox.acknowledge(&ack(0, 0b11), now);
        outbox.start_over(now);
        assert_eq!(sent(&mut outbox, &mut now, Micros(60_000)), [(30, 0), (35, 1), (40, 2)]);
    }

    #[test]
    fn unanswered_steps_wait_twice_as_long_each_time() {
        let mut outbox = filled::<8>(1);
        outbox.begin(Pace { first_timeout_us: 250_000, longest_timeout_us: 1_000_000, ..Pace::default() });
        let mut now = Micros(0);
        assert_eq!(
            sent(&mut outbox, &mut now, Micros(2_900_000)),
            [(0, 0), (250, 0), (750, 0), (1_750, 0), (2_750, 0)]
        );
        assert_eq!(outbox.resent(), 4);
    }

    #[test]
    fn on_a_serial_line_each_try_comes_soon() {
        let mut outbox = filled::<8>(1);
        let mut now = Micros(0);
        assert_eq!(sent(&mut outbox, &mut now, Micros(350_000)), [(0, 0), (100, 0), (200, 0), (300, 0)]);
        outbox.push(step(1));
        now = Micros(360_000);
        outbox.acknowledge(&ack(1, 0), now);
        sent(&mut outbox, &mut now, Micros(361_000));
        outbox.acknowledge(&ack(2, 0), Micros(365_000));
        // A round trip was measured.
        outbox.push(step(2));
        assert_eq!(sent(&mut outbox, &mut now, Micros(700_000)), [(365, 2), (415, 2), (515, 2), (615, 2)]);
    }

    #[test]
    fn in_silence_only_the_oldest_is_tried_ever_more_rarely() {
        let mut outbox = filled::<2_000>(1_000);
        let mut now = Micros(10_000_000);
        let tries = sent(&mut outbox, &mut now, Micros(610_000_000));
        assert!(tries.iter().all(|&(_, id)| id == 0));
        // 0.1, 0.2, 0.4 and so on to 6.4 s, then every 8 s.
        assert_eq!(tries.len(), 7 + 74);
        assert!(tries.windows(2).all(|pair| pair[1].0 - pair[0].0 <= 8_000));
    }

    #[test]
    fn after_the_silence_everything_follows_at_the_pace() {
        let mut outbox = filled::<2_000>(1_000);
        let mut now = Micros(600_000_000);
        outbox.next(now);
        outbox.hear(now);
        let mut last = now;
        let mut arrived = 0;
        while !outbox.is_empty() {
            now = outbox.deadline(now).unwrap().max(now);
            let sent = outbox.next(now).unwrap();
            assert!(now == last || now - last >= 5_000);
            last = now;
            assert_eq!(sent.id, arrived);
            arrived += 1;
            outbox.acknowledge(&ack(arrived, 0), now + 1_000);
        }
        assert_eq!(arrived, 1_000);
        assert!((now.0 - 600_000_000) < 6_000_000, "1000 steps at 200 in a second");
    }

    #[test]
    fn a_full_outbox_gives_up_the_oldest_and_tells() {
        let mut outbox = filled::<4>(60);
        let dropped = outbox.dropped();
        assert!(dropped > 40 && outbox.len() as u32 + dropped == 60);
        let sent = outbox.next(Micros(0)).unwrap();
        assert_eq!((sent.oldest, sent.id, sent.step.unpack().index), (dropped, dropped, dropped));
    }

    #[test]
    fn acknowledgements_of_what_was_never_kept_change_nothing() {
        let mut outbox = filled::<8>(2);
        let mut now = Micros(0);
        sent(&mut outbox, &mut now, Micros(20_000));
        for next in [3, 1_000, u32::MAX / 2] {
            outbox.acknowledge(&ack(next, u64::MAX), now);
            assert_eq!(outbox.len(), 2);
        }
        outbox.acknowledge(&ack(1, 0), now);
        outbox.acknowledge(&ack(0, 0), now);
        assert_eq!(outbox.len(), 1);
    }

    proptest! {
        #[test]
        fn whatever_is_acknowledged_only_the_oldest_go(
            operations in proptest::collection::vec((0..4_u8, any::<u32>(), any::<u64>(), 0..10_000_000_i64), 1..200),
        ) {
            let mut outbox = filled::<16>(0);
            let (mut now, mut pushed) = (Micros(0), 0);
            for (kind, next, later, passed) in operations {
                now = now + passed;
                match kind {
                    0 => {
                        outbox.push(step(pushed));
                        pushed += 1;
                    }
                    1 => outbox.hear(now),
                    2 => outbox.acknowledge(&ack(if next % 4 == 0 { next } else { next % 64 }, later), now),
                    _ => {
                        if let Some(sent) = outbox.next(now) {
                            prop_assert!(sent.id < pushed && sent.oldest <= sent.id);
                            prop_assert_eq!(sent.step.unpack().index, sent.id);
                            prop_assert_eq!(sent.oldest + outbox.len() as u32, pushed);
                        }
                    }
                }
                prop_assert!(outbox.len() as u32 + outbox.dropped() <= pushed);
            }
        }
    }
}
