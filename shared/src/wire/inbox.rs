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
