//! Moments of a walk that are kept, so that going back does not begin at the beginning.

use super::walk::Moment;
use sohle_shared::time::Micros;
use std::collections::BTreeMap;

/// More moments are not kept.
const MOST: usize = 64;
/// All of them together have at most so many particles: a hundred megabytes.
const MOST_PARTICLES: usize = 3_000_000;
/// From one to the next at first. **Units:** microseconds.
const SPACING_US: i64 = 4_000_000;

/// Intervals become no longer. **Units:** microseconds.
const LONGEST_US: i64 = 1 << 50;

/// One moment of each interval. When there are too many, intervals become twice as long.
pub struct Kept {
    spacing_us: i64,
    moments: BTreeMap<i64, Moment>,
}

impl Default for Kept {
    fn default() -> Self {
        Self { spacing_us: SPACING_US, moments: BTreeMap::new() }
    }
}

impl Kept {
    /// Keeps a moment, if it is the first of its interval.
    pub fn offer(&mut self, Micros(time): Micros, moment: &Moment) {
        let interval = time.div_euclid(self.spacing_us);
        if self.moments.get(&interval).is_some_and(|kept| kept.index <= moment.index) {
            return;
        }
        self.moments.insert(interval, moment.clone());
        let too_many = |kept: &Self| kept.moments.len() > MOST || kept.particles() > MOST_PARTICLES;
        while self.moments.len() > 1 && self.spacing_us < LONGEST_US && too_many(self) {
            self.spacing_us *= 2;
            let mut fewer = BTreeMap::new();
            for (interval, moment) in std::mem::take(&mut self.moments) {
                fewer.entry(interval.div_euclid(2)).or_insert(moment);
            }
            self.moments = fewer;
        }
    }

    /// The latest that is not after a number of items, the last of which is at `time`.
    pub fn before(&self, Micros(time): Micros, index: usize) -> Option<&Moment> {
        let until = time.div_euclid(self.spacing_us);
        self.moments.range(..=until).rev().map(|(_, moment)| moment).find(|moment| moment.index <= index)
    }

    /// Forgets those of this number of items and more.
    pub fn forget_from(&mut self, index: usize) {
        self.moments.retain(|_, moment| moment.index < index);
    }

    fn particles(&self) -> usize {
        let count = |moment: &Moment| moment.follower.as_ref().map_or(0, |follower| follower.particles().len());
        self.moments.values().map(count).sum()
    }
}
