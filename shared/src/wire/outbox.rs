//! Steps that wait on the shoe until the laptops have them.
//!
//! Selective repeat: up to [`WINDOW`] steps are under way at a time; the laptop tells which of them have come, and those
//! that have not are sent again when their time is over, or at once when a step sent later has come before them. While
//! nothing is heard of the laptop, only the oldest step is tried now and then. When the laptop is back, the rest follows at
//! a bounded pace. When there is no room, the oldest step gives way and is counted; the laptop learns it from the number of
//! the oldest step kept.
//!
//! Each [`Port`] has a laptop of its own, which neither hurries nor delays that of another. A step is kept until it was
//! acknowledged by all laptops that have greeted, except for those not heard for [`Pace::patience_us`], and by at least one.
//!
//! What waits is kept as the difference of each step to the one before, in half the bytes that are sent of it.

use super::lane::Lane;
use super::message::{Ack, SentStep};
use super::packed::PackedStep;
use super::port::Port;
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
    /// When nothing was heard for so long, nothing is kept any more for a laptop that another one has got already.
    pub patience_us: i64,
}

impl Pace {
    /// For a serial line: 200 steps in a second are 12 % of 921 600 baud, so waiting ever longer would spare nothing. A
    /// round trip takes 20 ms or less, and where only a few frames come whole, each try counts. Steps are kept for a laptop
    /// for a quarter of an hour, in which one who walks makes as many as there is room for.
    pub const SERIAL: Self = Self {
        spacing_us: 5_000,
        first_timeout_us: 100_000,
        shortest_timeout_us: 50_000,
        longest_timeout_us: 100_000,
        silence_us: 3_000_000,
        longest_probe_us: 8_000_000,
        patience_us: 900_000_000,
    };

    /// For Bluetooth, whose link layer itself repeats what was lost and keeps the order: a step is missing only when the
    /// connection broke. A round trip takes two connection intervals and more while the radio is disturbed.
    pub const RADIO: Self = Self {
        first_timeout_us: 1_000_000,
        shortest_timeout_us: 500_000,
        longest_timeout_us: 2_000_000,
        ..Self::SERIAL
    };
}

impl Pace {
    /// Zeros.
    const NONE: Self = Self {
        spacing_us: 0,
        first_timeout_us: 0,
        shortest_timeout_us: 0,
        longest_timeout_us: 0,
        silence_us: 0,
        longest_probe_us: 0,
        patience_us: 0,
    };
}

impl Default for Pace {
    fn default() -> Self {
        Self::SERIAL
    }
}

/// The steps that a laptop may not have yet, for `PORTS` laptops. There is room for `N` as they usually are, for more when
/// they are small and for fewer when they are unlike each other.
#[derive(Clone, Debug)]
pub struct Outbox<const N: usize, const PORTS: usize = 1> {
    boot: u32,
    steps: Shelf<N>,
    /// Number of the oldest.
    oldest: u32,
    lanes: [Lane; PORTS],
}

impl<const N: usize, const PORTS: usize> Outbox<N, PORTS> {
    /// Empty. `boot` goes out with each step.
    pub const fn new(boot: u32, pace: Pace) -> Self {
        Self { boot, steps: Shelf::new(), oldest: 0, lanes: [Lane::new(pace); PORTS] }
    }

    /// Empty, and nothing but zeros, so that a static takes no flash; [`Outbox::begin`] comes before anything else.
    pub const fn blank() -> Self {
        Self::new(0, Pace::NONE)
    }

    /// Sends at this pace to the laptop of this port from now on.
    pub fn begin(&mut self, port: Port, pace: Pace) {
        let lane = self.lane_mut(port);
        (lane.pace, lane.probe_us) = (pace, pace.first_timeout_us);
    }

    fn lane(&self, port: Port) -> &Lane {
        &self.lanes[port.index()]
    }

    fn lane_mut(&mut self, port: Port) -> &mut Lane {
        &mut self.lanes[port.index()]
    }

    /// The boot that the steps belong to from now on: it is not known yet when an empty outbox is made at compile time.
    pub(super) fn belong_to(&mut self, boot: u32) {
        self.boot = boot;
    }

    /// Keeps a step. When there is no room, the oldest gives way.
    pub fn push(&mut self, step: PackedStep) {
        while !self.steps.fits(&step) {
            self.forget_oldest();
            for lane in &mut self.lanes {
                lane.dropped = lane.dropped.saturating_add(lane.give_up_before(self.oldest));
            }
        }
        self.steps.push(&step);
    }

    fn forget_oldest(&mut self) {
        self.oldest = self.oldest.wrapping_add(1);
        self.steps.pop();
    }

    /// Number of the step to come.
    fn end(&self) -> u32 {
        self.oldest.wrapping_add(self.len() as u32)
    }

    /// Steps kept.
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Whether no step is kept.
    pub fn is_empty(&self) -> bool {
        self.steps.len() == 0
    }

    /// Steps that the laptop of this port may not have.
    pub fn waiting(&self, port: Port) -> usize {
        self.lane(port).waiting(self.end())
    }

    /// Steps sent to it again so far.
    pub fn resent(&self, port: Port) -> u32 {
        self.lane(port).resent
    }

    /// Steps that gave way to newer ones before it had them.
    pub fn dropped(&self, port: Port) -> u32 {
        self.lane(port).dropped
    }

    /// Something came from the laptop. When it had been gone, all that waits is due again.
    pub fn hear(&mut self, port: Port, now: Micros) {
        self.lane_mut(port).hear(now);
    }

    /// Everything that is under way is due again.
    pub fn resend_all(&mut self, port: Port, now: Micros) {
        self.lane_mut(port).resend_all(now);
    }

    /// Another program listens: it does not have what came to the one before it ahead of the oldest, so that is due too.
    pub fn start_over(&mut self, port: Port, now: Micros) {
        self.lane_mut(port).start_over(now);
    }

    /// Who is there does not understand steps: none are kept for it.
    pub fn disengage(&mut self, port: Port) {
        self.lane_mut(port).disengage();
    }

    /// Whether nothing was heard of the laptop for [`Pace::silence_us`].
    pub fn is_silent(&self, port: Port, now: Micros) -> bool {
        self.lane(port).is_silent(now)
    }

    /// Takes in what has arrived. An acknowledgement of steps that were never kept changes nothing.
    pub fn acknowledge(&mut self, port: Port, ack: &Ack, now: Micros) {
        let end = self.end();
        self.lane_mut(port).acknowledge(ack, end, now);
        self.release(now);
    }

    /// Lets go of what nobody waits for.
    fn release(&mut self, now: Micros) {
        let oldest = self.oldest;
        let has = |lane: &Lane| lane.next.wrapping_sub(oldest);
        let one = self.lanes.iter().map(has).max().unwrap_or(0);
        let all = self.lanes.iter().filter(|lane| lane.counts(now)).map(has).min().unwrap_or(one);
        for _ in 0..all.min(one) {
            self.forget_oldest();
        }
        for lane in &mut self.lanes {
            lane.give_up_before(self.oldest);
        }
    }

    /// The step that is to be sent now, if one is.
    pub fn next(&mut self, port: Port, now: Micros) -> Option<SentStep> {
        let end = self.end();
        let id = self.lane(port).due(end, now)?;
        let step = self.steps.get(id.wrapping_sub(self.oldest) as usize)?;
        let lane = self.lane_mut(port);
        lane.sent(id, now);
        let oldest = lane.next;
        Some(SentStep { boot: self.boot, id, oldest, step })
    }

    /// When [`Outbox::next`] should be asked again; `None` when only a new step or the laptop can change anything.
    pub fn deadline(&self, port: Port, now: Micros) -> Option<Micros> {
        self.lane(port).deadline(self.end(), now)
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
        outbox.hear(Port::Serial, Micros(0));
        (0..count).for_each(|index| outbox.push(step(index)));
        outbox
    }

    /// What goes out until `end`: time in milliseconds and number. Asks only when told to.
    fn sent<const N: usize>(outbox: &mut Outbox<N>, now: &mut Micros, end: Micros) -> Vec<(i64, u32)> {
        let mut sent = Vec::new();
        while let Some(due) = outbox.deadline(Port::Serial, *now).filter(|&due| due < end) {
            *now = due.max(*now);
            sent.extend(outbox.next(Port::Serial, *now).map(|sent| (now.0 / 1_000, sent.id)));
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
        outbox.acknowledge(Port::Serial, &ack(3, 0), now);
        assert!(outbox.is_empty());
        assert_eq!(outbox.deadline(Port::Serial, now), None);
        assert_eq!((outbox.resent(Port::Serial), outbox.dropped(Port::Serial)), (0, 0));
    }

    #[test]
    fn only_the_missing_step_is_sent_again_and_at_once() {
        let mut outbox = filled::<8>(4);
        let mut now = Micros(0);
        sent(&mut outbox, &mut now, Micros(30_000));
        // 0, 2 and 3 have come.
        outbox.acknowledge(Port::Serial, &ack(1, 0b11), now);
        assert_eq!(sent(&mut outbox, &mut now, Micros(60_000)), [(30, 1)]);
        outbox.acknowledge(Port::Serial, &ack(4, 0), now);
        assert!(outbox.is_empty());
    }

    #[test]
    fn another_program_gets_what_the_one_before_had_ahead_of_the_oldest() {
        let mut outbox = filled::<8>(3);
        let mut now = Micros(0);
        sent(&mut outbox, &mut now, Micros(30_000));
        // 1 and 2 have come.
        outbox.acknowledge(Port::Serial, &ack(0, 0b11), now);
        outbox.start_over(Port::Serial, now);
        assert_eq!(sent(&mut outbox, &mut now, Micros(60_000)), [(30, 0), (35, 1), (40, 2)]);
    }

    #[test]
    fn unanswered_steps_wait_twice_as_long_each_time() {
        let mut outbox = filled::<8>(1);
        outbox
            .begin(Port::Serial, Pace { first_timeout_us: 250_000, longest_timeout_us: 1_000_000, ..Pace::default() });
        let mut now = Micros(0);
        assert_eq!(
            sent(&mut outbox, &mut now, Micros(2_900_000)),
            [(0, 0), (250, 0), (750, 0), (1_750, 0), (2_750, 0)]
        );
        assert_eq!(outbox.resent(Port::Serial), 4);
    }

    #[test]
    fn on_a_serial_line_each_try_comes_soon() {
        let mut outbox = filled::<8>(1);
        let mut now = Micros(0);
        assert_eq!(sent(&mut outbox, &mut now, Micros(350_000)), [(0, 0), (100, 0), (200, 0), (300, 0)]);
        outbox.push(step(1));
        now = Micros(360_000);
        outbox.acknowledge(Port::Serial, &ack(1, 0), now);
        sent(&mut outbox, &mut now, Micros(361_000));
        outbox.acknowledge(Port::Serial, &ack(2, 0), Micros(365_000));
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
        outbox.next(Port::Serial, now);
        outbox.hear(Port::Serial, now);
        let mut last = now;
        let mut arrived = 0;
        while !outbox.is_empty() {
            now = outbox.deadline(Port::Serial, now).unwrap().max(now);
            let sent = outbox.next(Port::Serial, now).unwrap();
            assert!(now == last || now - last >= 5_000);
            last = now;
            assert_eq!(sent.id, arrived);
            arrived += 1;
            outbox.acknowledge(Port::Serial, &ack(arrived, 0), now + 1_000);
        }
        assert_eq!(arrived, 1_000);
        assert!((now.0 - 600_000_000) < 6_000_000, "1000 steps at 200 in a second");
    }

    #[test]
    fn a_full_outbox_gives_up_the_oldest_and_tells() {
        let mut outbox = filled::<4>(60);
        let dropped = outbox.dropped(Port::Serial);
        assert!(dropped > 40 && outbox.len() as u32 + dropped == 60);
        let sent = outbox.next(Port::Serial, Micros(0)).unwrap();
        assert_eq!((sent.oldest, sent.id, sent.step.unpack().index), (dropped, dropped, dropped));
    }

    #[test]
    fn acknowledgements_of_what_was_never_kept_change_nothing() {
        let mut outbox = filled::<8>(2);
        let mut now = Micros(0);
        sent(&mut outbox, &mut now, Micros(20_000));
        for next in [3, 1_000, u32::MAX / 2] {
            outbox.acknowledge(Port::Serial, &ack(next, u64::MAX), now);
            assert_eq!(outbox.len(), 2);
        }
        outbox.acknowledge(Port::Serial, &ack(1, 0), now);
        outbox.acknowledge(Port::Serial, &ack(0, 0), now);
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
                    1 => outbox.hear(Port::Serial, now),
                    2 => outbox.acknowledge(Port::Serial, &ack(if next % 4 == 0 { next } else { next % 64 }, later), now),
                    _ => {
                        if let Some(sent) = outbox.next(Port::Serial, now) {
                            prop_assert!(sent.id < pushed && sent.oldest <= sent.id);
                            prop_assert_eq!(sent.step.unpack().index, sent.id);
                            prop_assert_eq!(sent.oldest + outbox.len() as u32, pushed);
                        }
                    }
                }
                prop_assert!(outbox.len() as u32 + outbox.dropped(Port::Serial) <= pushed);
            }
        }
    }
}
