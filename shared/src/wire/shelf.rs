//! Steps one after the other in little memory: the newest is added, the oldest taken away, any looked at.
//!
//! Each is kept as its [difference](super::difference) to the one before, bit by bit in a ring. To look at one, those
//! between it and the one that was looked at last are read over, or those between it and the oldest: of the steps that are
//! sent one after the other each is read once.

use super::difference::{Before, LONGEST, Sink, Source};
use super::packed::PackedStep;

/// Room for a step as it usually is. **Units:** bytes. Walks and stairs, recorded and simulated, take 15 to 18 on average, runs 20
/// to 21.
pub(super) const ROOM: usize = 22;

/// Where a step lies in the ring, and what it is the difference to.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// **Units:** bits.
    position: u32,
    before: Before,
}

impl Place {
    const FIRST: Self = Self { position: 0, before: Before::NOTHING };
}

/// Steps, with room for `N` of the usual ones.
#[derive(Clone, Debug)]
pub(super) struct Shelf<const N: usize> {
    ring: [[u8; ROOM]; N],
    count: usize,
    /// Bits in use.
    filled: u32,
    /// Of the oldest.
    oldest: Place,
    /// Of the next to come.
    next: Place,
    /// Of the one that was looked at last, and how many are older.
    last_seen: (Place, usize),
}

impl<const N: usize> Shelf<N> {
    /// **Units:** bits.
    const SIZE: u32 = {
        assert!(N < 1 << 24);
        let bits = 8 * (ROOM * N) as u32;
        assert!(bits >= LONGEST, "there is no room for a single step");
        bits
    };

    /// Empty: nothing but zeros.
    pub(super) const fn new() -> Self {
        const { assert!(Self::SIZE > 0) };
        Self {
            ring: [[0; ROOM]; N],
            count: 0,
            filled: 0,
            oldest: Place::FIRST,
            next: Place::FIRST,
            last_seen: (Place::FIRST, 0),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Whether there is room for this step without taking an old one away. When the shelf is empty there is.
    pub(super) fn fits(&self, step: &PackedStep) -> bool {
        self.next.before.length(step) <= Self::SIZE - self.filled
    }

    /// Adds a step that [fits](Self::fits).
    pub(super) fn push(&mut self, step: &PackedStep) {
        let Place { position, before } = self.next;
        let mut pen = Pen { ring: self.ring.as_flattened_mut(), position };
        before.write(step, &mut pen);
        let position = pen.position;
        self.filled += distance::<N>(self.next.position, position);
        self.next = Place { position, before: before.then(step) };
        self.count += 1;
    }

    /// Takes the oldest away, if there is one.
    pub(super) fn pop(&mut self) {
        if self.count == 0 {
            return;
        }
        let (_, after) = self.read(&self.oldest);
        self.filled -= distance::<N>(self.oldest.position, after.position);
        self.oldest = after;
        self.count -= 1;
        self.last_seen = match self.last_seen {
            (_, 0) => (self.oldest, 0),
            (place, older) => (place, older - 1),
        };
    }

    /// The step that so many are older than; `None` if there is none.
    pub(super) fn get(&mut self, older: usize) -> Option<PackedStep> {
        if older >= self.count {
            return None;
        }
        let (mut place, mut at) = self.last_seen;
        if at > older {
            (place, at) = (self.oldest, 0);
        }
        loop {
            let (step, after) = self.read(&place);
            if at == older {
                self.last_seen = (place, at);
                return Some(step);
            }
            (place, at) = (after, at + 1);
        }
    }

    /// The step at this place, and the place after it.
    fn read(&self, place: &Place) -> (PackedStep, Place) {
        let mut eye = Eye { ring: self.ring.as_flattened(), position: place.position };
        let step = place.before.read(&mut eye);
        (step, Place { position: eye.position, before: place.before.then(&step) })
    }
}

/// Bits of one step, which is never as long as the whole ring unless it is all of it.
fn distance<const N: usize>(from: u32, to: u32) -> u32 {
    let size = Shelf::<N>::SIZE;
    if to > from { to - from } else { to + size - from }
}

/// Writes into the ring.
struct Pen<'a> {
    ring: &'a mut [u8],
    position: u32,
}

impl Sink for Pen<'_> {
    fn put(&mut self, bits: u64, count: u32) {
        let mut left = count;
        while left > 0 {
            let (at, used) = (self.position as usize / 8, self.position % 8);
            let Some(byte) = self.ring.get_mut(at) else { return };
            let free = 8 - used;
            let some = free.min(left);
            left -= some;
            // Fewer than eight, or all of them.
            let mask = ((1_u32 << some) - 1) << (free - some);
            let piece = ((bits >> left) as u32) << (free - some) & mask;
            *byte = *byte & !(mask as u8) | piece as u8;
            self.position = ahead(self.position, some, self.ring.len());
        }
    }
}

/// Reads from it.
struct Eye<'a> {
    ring: &'a [u8],
    position: u32,
}

impl Source for Eye<'_> {
    fn take(&mut self, count: u32) -> u64 {
        let (mut left, mut bits) = (count, 0);
        while left > 0 {
            let (at, used) = (self.position as usize / 8, self.position % 8);
            let byte = u32::from(self.ring.get(at).copied().unwrap_or(0));
            let free = 8 - used;
            let some = free.min(left);
            left -= some;
            bits = bits << some | u64::from(byte >> (free - some) & ((1 << some) - 1));
            self.position = ahead(self.position, some, self.ring.len());
        }
        bits
    }
}

/// The position so many bits on; the ring has `length` bytes. No piece goes beyond its end.
fn ahead(position: u32, bits: u32, length: usize) -> u32 {
    let next = position + bits;
    if next as usize == 8 * length { 0 } else { next }
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::*;
    use crate::selftest::Batches;
    use crate::shoe::Pipeline;
    use crate::time::Micros;
    use proptest::prelude::*;
    use std::collections::VecDeque;
    use std::vec::Vec;

    fn any_step() -> impl Strategy<Value = PackedStep> {
        let byte = prop_oneof![Just(0_u8), Just(1), Just(0x7f), Just(0x80), Just(0xff), any::<u8>()];
        proptest::collection::vec(byte, 40).prop_map(|bytes| postcard::from_bytes(&bytes).unwrap())
    }

    /// Any step, or the one before with some bytes changed.
    fn any_steps() -> impl Strategy<Value = Vec<PackedStep>> {
        let change = prop_oneof![
            1 => any_step().prop_map(Ok),
            3 => proptest::collection::vec((0..40_usize, any::<u8>()), 0..4).prop_map(Err),
        ];
        proptest::collection::vec(change, 1..60).prop_map(|changes| {
            let mut bytes = [0; 40];
            let step = |change: Result<PackedStep, Vec<(usize, u8)>>| {
                match change {
                    Ok(step) => _ = postcard::to_slice(&step, &mut bytes).unwrap(),
                    Err(changes) => changes.iter().for_each(|&(at, byte)| bytes[at] = byte),
                }
                postcard::from_bytes(&bytes).unwrap()
            };
            changes.into_iter().map(step).collect()
        })
    }

    /// The steps of a simulated walk, again and again: each time the tracker starts anew.
    fn walks() -> impl Iterator<Item = PackedStep> {
        let mut pipeline = Pipeline::new(&Default::default(), &Default::default(), &Default::default());
        let mut walk = Vec::new();
        for batch in Batches::new() {
            pipeline.push(&batch, |_, output, _| walk.extend(output.step.as_ref().map(PackedStep::pack)));
        }
        (0..).flat_map(move |_| walk.clone())
    }

    #[test]
    fn a_thousand_steps_of_a_walk_fit() {
        let mut shelf = Shelf::<1_000>::new();
        let steps: Vec<_> = walks().take_while(|step| shelf.fits(step).then(|| shelf.push(step)).is_some()).collect();
        // Between two walks, a quarter of a minute of them, are the largest steps: the time goes back.
        assert!(steps.len() >= 1_000 && shelf.len() == steps.len(), "{}", steps.len());
        (0..steps.len()).for_each(|at| assert_eq!(shelf.get(at), Some(steps[at])));
        assert_eq!(shelf.get(steps.len()), None);
    }

    #[test]
    fn a_step_like_the_one_before_takes_a_few_bytes() {
        let mut step = golden::step();
        let mut before = Before::NOTHING.then(&PackedStep::pack(&step));
        let mut lengths = Vec::new();
        for _ in 0..3 {
            step.index += 1;
            (step.stance_start, step.stance_end) = (step.stance_start + 1_000_000, step.stance_end + 1_000_000);
            let packed = PackedStep::pack(&step);
            lengths.push(before.length(&packed));
            before = before.then(&packed);
        }
        // Each of the 20 numbers takes a bit and its order, 98 together; the turn, which is not compared, takes 15 more.
        assert_eq!(lengths[1..], [113, 113]);
    }

    #[test]
    fn the_longest_step_has_room_in_the_smallest_shelf() {
        let least = PackedStep::pack(&crate::step::Step { index: 0, stance_end: Micros(0), ..golden::step() });
        let mut shelf = Shelf::<4>::new();
        for bytes in [[0x80; 40], [0x7f; 40], [0; 40], [0xff; 40]] {
            let step: PackedStep = postcard::from_bytes(&bytes).unwrap();
            for step in [least, step] {
                while !shelf.fits(&step) {
                    assert!(shelf.len() > 0);
                    shelf.pop();
                }
                shelf.push(&step);
                assert_eq!(shelf.get(shelf.len() - 1), Some(step));
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn any_steps_come_back_as_they_were(
            steps in any_steps(),
            looks in proptest::collection::vec((0..70_usize, 0..4_usize), 60),
        ) {
            let mut shelf = Shelf::<16>::new();
            let mut kept = VecDeque::new();
            for (step, (look, taken)) in steps.iter().zip(looks) {
                while !shelf.fits(step) {
                    prop_assert!(kept.pop_front().is_some());
                    shelf.pop();
                }
                shelf.push(step);
                kept.push_back(*step);
                prop_assert_eq!(shelf.get(look), kept.get(look).copied());
                if look % 8 == 0 {
                    (0..taken).for_each(|_| {
                        kept.pop_front();
                        shelf.pop();
                    });
                }
                prop_assert_eq!(shelf.get(look / 4), kept.get(look / 4).copied());
                prop_assert_eq!(shelf.len(), kept.len());
            }
            let all: VecDeque<_> = (0..shelf.len()).filter_map(|at| shelf.get(at)).collect();
            prop_assert_eq!(all, kept);
        }

        #[test]
        fn what_is_said_of_the_length_is_so(before in any_step(), step in any_step()) {
            struct Count(u32);
            impl Sink for Count {
                fn put(&mut self, bits: u64, count: u32) {
                    assert!(count == 64 || bits >> count == 0);
                    self.0 += count;
                }
            }
            let before = Before::NOTHING.then(&before);
            let mut count = Count(0);
            before.write(&step, &mut count);
            prop_assert_eq!(count.0, before.length(&step));
            prop_assert!(count.0 <= LONGEST);
        }
    }
}
