//! Steps in the order they were made, each once, from whatever the line brings.

use super::message::{Ack, SentStep};
use super::outbox::WINDOW;
use super::packed::PackedStep;

/// Steps that may wait for an earlier one: as many as an [`Ack`] can tell of.
const AHEAD: usize = 64;

const _: () = assert!(WINDOW <= AHEAD + 1);

/// What comes next in the order of the steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// A step.
    Step {
        /// Its number since the boot.
        id: u32,
        /// The step.
        step: PackedStep,
    },
    /// Steps that the shoe no longer has: it ran out of room before they were acknowledged.
    Gap {
        /// The number of the first.
        first: u32,
        /// How many.
        count: u32,
    },
}

/// The steps of one boot of the shoe.
#[derive(Clone, Debug)]
pub struct Inbox {
    boot: u32,
    /// The step that is handed out next; unknown before the first has come.
    next: Option<u32>,
    /// Steps before this one that have not come will not come.
    oldest: u32,
    /// Steps from `next` on, by their number modulo the length.
    waiting: [Option<PackedStep>; AHEAD + 1],
}

impl Inbox {
    /// Before the first step of this boot. Whoever comes late begins with the oldest step that the shoe still has.
    pub const fn new(boot: u32) -> Self {
        Self { boot, next: None, oldest: 0, waiting: [None; AHEAD + 1] }
    }

    /// The boot whose steps these are.
    pub fn boot(&self) -> u32 {
        self.boot
    }

    /// Takes in a step. Those of another boot, those that came before and those too far ahead change nothing.
    /// Whether it was new.
    pub fn push(&mut self, sent: &SentStep) -> bool {
        if sent.boot != self.boot || sent.oldest > sent.id {
            return false;
        }
        let next = *self.next.get_or_insert(sent.oldest);
        self.oldest = self.oldest.max(sent.oldest);
        // Of a gap not yet handed out, the steps after it must wait: they come again.
        if sent.id < next || sent.id - next > AHEAD as u32 {
            return false;
        }
        self.waiting[sent.id as usize % (AHEAD + 1)].replace(sent.step).is_none()
    }

    /// What comes next, if it is there.
    pub fn pop(&mut self) -> Option<Delivery> {
        let next = self.next?;
        if let Some(step) = self.waiting[next as usize % (AHEAD + 1)].take() {
            self.next = Some(next.saturating_add(1));
            return Some(Delivery::Step { id: next, step });
        }
        if next >= self.oldest {
            return None;
        }
        let there = (next..=u32::MAX).take(AHEAD + 1).find(|&id| self.waiting[id as usize % (AHEAD + 1)].is_some());
        let end = there.map_or(self.oldest, |there| there.min(self.oldest));
        self.next = Some(end);
        Some(Delivery::Gap { first: next, count: end - next })
    }

    /// What to tell the shoe; `None` before the first step.
    pub fn ack(&self) -> Option<Ack> {
        let next = self.next?;
        let later = (0..AHEAD as u32).filter(|bit| {
            next.checked_add(1 + bit).is_some_and(|id| self.waiting[id as usize % (AHEAD + 1)].is_some())
        });
        Some(Ack { boot: self.boot, next, later: later.fold(0, |bits, bit| bits | 1 << bit) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::super::outbox::{Outbox, Pace};
    use super::super::port::Port;
    use super::*;
    use crate::step::Step;
    use crate::time::Micros;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn sent(id: u32, oldest: u32) -> SentStep {
        SentStep { boot: 1, id, oldest, step: PackedStep::pack(&Step { index: id, ..golden::step() }) }
    }

    /// Numbers of the steps, and gaps as `(first, count)`.
    fn drain(inbox: &mut Inbox) -> Vec<Result<u32, (u32, u32)>> {
        core::iter::from_fn(|| inbox.pop())
            .map(|delivery| match delivery {
                Delivery::Step { id, step } => {
                    assert_eq!(step.unpack().index, id);
                    Ok(id)
                }
                Delivery::Gap { first, count } => Err((first, count)),
            })
            .collect()
    }

    #[test]
    fn steps_wait_for_those_before_them() {
        let mut inbox = Inbox::new(1);
        assert_eq!(inbox.ack(), None);
        assert!(inbox.push(&sent(2, 0)) && inbox.push(&sent(1, 0)) && !inbox.push(&sent(2, 0)));
        assert_eq!(drain(&mut inbox), []);
        assert_eq!(inbox.ack(), Some(Ack { boot: 1, next: 0, later: 0b11 }));
        inbox.push(&sent(0, 0));
        assert_eq!(drain(&mut inbox), [Ok(0), Ok(1), Ok(2)]);
        assert_eq!(inbox.ack(), Some(Ack { boot: 1, next: 3, later: 0 }));
        assert!(!inbox.push(&sent(1, 0)));
        assert_eq!(drain(&mut inbox), []);
    }

    #[test]
    fn who_comes_late_begins_with_what_is_there() {
        let mut inbox = Inbox::new(1);
        inbox.push(&sent(41, 40));
        inbox.push(&sent(40, 40));
        assert_eq!(drain(&mut inbox), [Ok(40), Ok(41)]);
    }

    #[test]
    fn what_the_shoe_has_given_up_is_a_gap() {
        let mut inbox = Inbox::new(1);
        inbox.push(&sent(0, 0));
        inbox.push(&sent(3, 0));
        assert_eq!(drain(&mut inbox), [Ok(0)]);
        inbox.push(&sent(6, 5));
        assert_eq!(drain(&mut inbox), [Err((1, 2)), Ok(3), Err((4, 1))]);
        inbox.push(&sent(5, 5));
        assert_eq!(drain(&mut inbox), [Ok(5), Ok(6)]);
        // Far ahead: first the gap, then the step when it comes again.
        assert!(!inbox.push(&sent(1_000, 900)));
        assert_eq!(drain(&mut inbox), [Err((7, 893))]);
        assert!(inbox.push(&sent(900, 900)));
        assert_eq!(drain(&mut inbox), [Ok(900)]);
    }

    #[test]
    fn steps_of_another_boot_are_none_of_ours() {
        let mut inbox = Inbox::new(1);
        assert!(!inbox.push(&SentStep { boot: 2, ..sent(0, 0) }));
        assert_eq!(drain(&mut inbox), []);
    }

    proptest! {
        #[test]
        fn every_step_comes_once_and_in_order_over_a_bad_line(
            seed in proptest::collection::vec(any::<u8>(), 64..256),
            loss in 0..160_u8,
        ) {
            let mut outbox = Outbox::<128>::new(1, Pace::default());
            let mut inbox = Inbox::new(1);
            let mut chance = seed.iter().cycle().enumerate().map(|(i, byte)| byte.wrapping_add((i * i) as u8));
            let (mut now, mut got, mut late) = (Micros(0), Vec::new(), Vec::new());
            for tick in 0..6_000_u32 {
                now = now + 5_000;
                if tick % 100 == 0 && tick < 3_000 {
                    outbox.push(sent(tick / 100, 0).step);
                }
                if let Some(sent) = outbox.next(Port::Serial, now) {
                    match chance.next().unwrap() {
                        lost if lost < loss => {}
                        delayed if delayed % 3 == 0 => late.push(sent),
                        _ => {
                            inbox.push(&sent);
                        }
                    }
                }
                if tick % 7 == 0 && let Some(sent) = late.pop() {
                    inbox.push(&sent);
                    inbox.push(&sent);
                }
                got.extend(drain(&mut inbox));
                if let Some(ack) = inbox.ack().filter(|_| chance.next().unwrap() >= loss) {
                    outbox.hear(Port::Serial, now);
                    outbox.acknowledge(Port::Serial, &ack, now);
                }
            }
            prop_assert_eq!(got, (0..30).map(Ok).collect::<Vec<_>>());
        }

        #[test]
        fn whatever_comes_the_numbers_are_without_hole_or_repetition(
            steps in proptest::collection::vec((any::<u32>(), any::<u32>(), 0..3_u8), 1..100),
        ) {
            let mut inbox = Inbox::new(1);
            let mut next = None;
            for (id, oldest, far) in steps {
                let (id, oldest) = if far == 0 { (id, oldest) } else { (id % 200, oldest % 200) };
                inbox.push(&SentStep { id, oldest, ..sent(0, 0) });
                while let Some(delivery) = inbox.pop() {
                    let (first, count) = match delivery {
                        Delivery::Step { id, .. } => (id, 1),
                        Delivery::Gap { first, count } => (first, count),
                    };
                    prop_assert!(count > 0 && next.is_none_or(|next| next == first));
                    next = first.checked_add(count).or(Some(u32::MAX));
                }
                inbox.ack();
            }
        }
    }
}
