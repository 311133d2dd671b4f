//! A line between shoe and laptop that does everything a bad one does.
//!
//! One direction; deterministic from its random numbers.

use crate::simulation::random::Random;
use sohle_shared::time::Micros;
use std::collections::BTreeMap;
use std::ops::Range;

/// What a line does to what is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Chance of a byte to come with one bit flipped.
    pub damage: f64,
    /// Chance of a bit to come flipped.
    pub flips: f64,
    /// Chance of a whole write to be lost.
    pub loss: f64,
    /// Chance of a piece of a write to come twice.
    pub doubling: f64,
    /// Chance of a piece of a write to come after those behind it.
    pub overtaking: f64,
    /// Shortest time on the way. **Units:** microseconds.
    pub delay_us: i64,
    /// Mean of what a write takes longer (exponential). **Units:** microseconds.
    pub jitter_us: f64,
    /// Whatever is written meanwhile is lost.
    pub silence: Range<Micros>,
}

/// One direction of a line.
#[derive(Clone, Debug)]
pub struct Line {
    faults: Faults,
    random: Random,
    /// By the time of arrival, and by the order of writing where that is the same.
    under_way: BTreeMap<(Micros, u64), Vec<u8>>,
    pieces: u64,
    /// When the last piece arrives that kept its place.
    last: Micros,
}

impl Line {
    /// A line that carries nothing yet.
    pub fn new(faults: Faults, random: Random) -> Self {
        Self { faults, random, under_way: BTreeMap::new(), pieces: 0, last: Micros(0) }
    }

    /// Writes bytes. They arrive in up to two pieces.
    pub fn write(&mut self, bytes: &[u8], now: Micros) {
        if bytes.is_empty() || self.faults.silence.contains(&now) || self.happens(self.faults.loss) {
            return;
        }
        let mut bytes = bytes.to_vec();
        for byte in &mut bytes {
            if self.happens(self.faults.damage) {
                *byte ^= 1 << (8.0 * self.random.unit()) as u32;
            }
            // Lines without it keep their random numbers.
            if self.faults.flips > 0.0 {
                *byte = (0..8).fold(*byte, |byte, bit| byte ^ u8::from(self.happens(self.faults.flips)) << bit);
            }
        }
        let cut = (bytes.len() as f64 * self.random.unit()) as usize;
        let jitter = -self.faults.jitter_us * libm::log(1.0 - self.random.unit());
        let arrival = now + self.faults.delay_us + jitter as i64;
        for piece in [&bytes[..cut], &bytes[cut..]].into_iter().filter(|piece| !piece.is_empty()) {
            if self.happens(self.faults.overtaking) {
                self.send(piece, self.last.max(arrival) + 2 * self.faults.delay_us);
            } else {
                self.last = self.last.max(arrival);
                self.send(piece, self.last);
            }
            if self.happens(self.faults.doubling) {
                self.send(piece, self.last.max(arrival) + self.faults.delay_us);
            }
        }
    }

    fn happens(&mut self, chance: f64) -> bool {
        self.random.unit() < chance
    }

    fn send(&mut self, piece: &[u8], arrival: Micros) {
        self.under_way.insert((arrival, self.pieces), piece.to_vec());
        self.pieces += 1;
    }

    /// What has arrived until now, in the order of arrival.
    pub fn read(&mut self, now: Micros) -> Vec<u8> {
        let later = self.under_way.split_off(&(now + 1, 0));
        std::mem::replace(&mut self.under_way, later).into_values().flatten().collect()
    }

    /// When something arrives next.
    pub fn arrival(&self) -> Option<Micros> {
        self.under_way.first_key_value().map(|(&(time, _), _)| time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::random::Purpose;

    /// Writes a thousand times 20 bytes with their number in each, a millisecond apart, and reads it all.
    fn carried(faults: Faults, seed: u64) -> Vec<u8> {
        let mut line = Line::new(faults, Random::new(seed, Purpose::FromShoe));
        (0..1_000_u16).for_each(|i| line.write(&[i.to_le_bytes(); 10].concat(), Micros(i64::from(i) * 1_000)));
        let mut bytes = Vec::new();
        while let Some(time) = line.arrival() {
            bytes.extend(line.read(time));
        }
        bytes
    }

    fn written() -> Vec<u8> {
        (0..1_000_u16).flat_map(|i| [i.to_le_bytes(); 10].concat()).collect()
    }

    #[test]
    fn a_line_without_faults_only_delays() {
        let faults = Faults { delay_us: 5_000, jitter_us: 3_000.0, ..Faults::default() };
        assert_eq!(carried(faults.clone(), 1), written());
        let mut line = Line::new(faults, Random::new(1, Purpose::FromShoe));
        line.write(&[1, 2, 3], Micros(7));
        assert!(line.arrival().unwrap() >= Micros(5_007));
        assert!(line.read(Micros(5_006)).is_empty());
    }

    #[test]
    fn each_fault_is_as_frequent_as_asked() {
        let clean = Faults { delay_us: 5_000, ..Faults::default() };
        // Four standard deviations of a binomial count each.
        let damaged = carried(Faults { damage: 0.01, ..clean.clone() }, 2);
        let wrong = damaged.iter().zip(written()).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
        assert!(damaged.len() == 20_000 && wrong.abs_diff(200) < 57, "{wrong}");
        let flipped = carried(Faults { flips: 0.01, ..clean.clone() }, 8);
        let wrong = flipped.iter().zip(written()).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
        assert!(flipped.len() == 20_000 && wrong.abs_diff(1_600) < 159, "{wrong}");
        let lost = 1_000 - carried(Faults { loss: 0.1, ..clean.clone() }, 3).len() / 20;
        assert!(lost.abs_diff(100) < 38, "{lost}");
        let doubled = carried(Faults { doubling: 0.1, ..clean.clone() }, 4).len();
        // Pieces have 10 bytes on average, in even distribution: 200 +- 16 of them.
        assert!(doubled.abs_diff(22_000) < 700, "{doubled}");
        let overtaken = carried(Faults { overtaking: 0.1, ..clean.clone() }, 5);
        let sorted = |mut bytes: Vec<u8>| {
            bytes.sort_unstable();
            bytes
        };
        assert!(overtaken != written() && sorted(overtaken) == sorted(written()));
        let silence = Micros(100_000)..Micros(300_000);
        assert_eq!(carried(Faults { silence, ..clean }, 6).len(), 800 * 20);
    }

    #[test]
    fn the_same_seed_does_the_same() {
        let faults = Faults { damage: 0.01, loss: 0.1, doubling: 0.1, overtaking: 0.1, ..Faults::default() };
        assert_eq!(carried(faults.clone(), 7), carried(faults.clone(), 7));
        assert_ne!(carried(faults.clone(), 7), carried(faults, 8));
    }
}
