//! Which of the true stances were found, which were missed, and which stances were invented.

use crate::track::Stance;
use sohle_shared::time::Micros;

/// How far a true instant may lie outside a detected stance and still be covered by it. **Units:** microseconds.
///
/// Surveyed instants lie at the very end of a stance, when the foot already turns at some 40 degrees per second before
/// push-off; a detector with a tight threshold ends the stance up to 0.23 s earlier (measured on the recordings of
/// `tests/recordings.toml` with the document's 20 deg/s). The width stays well below half of the shortest time between
/// two stances of the same foot, 0.84 s when running, so that no stance can be taken for its neighbour.
pub const TOLERANCE_US: i64 = 250_000;

/// True stances against detected ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Matching {
    /// For each true stance the index of the detected one.
    pub found: Vec<Option<usize>>,
    /// Detected stances between the first and the last true one that cover none, or one that is covered already.
    pub invented: usize,
}

impl Matching {
    /// Gives each true interval (in order; an instant is an interval without length) the nearest stance (in order) that
    /// is at most `tolerance` microseconds away, and each stance to one interval only.
    ///
    /// Stances before the first and after the last interval are neither found nor invented: people stand and shuffle
    /// there, and nobody has surveyed it.
    pub fn of(stances: &[Stance], truth: &[(Micros, Micros)], tolerance: i64) -> Self {
        let mut found = Vec::with_capacity(truth.len());
        let mut free = 0;
        for &(start, end) in truth {
            let nearest = (free..stances.len())
                .map(|index| (apart(&stances[index], start, end), index))
                .take_while(|&(distance, index)| distance <= tolerance || stances[index].start < end)
                .filter(|&(distance, _)| distance <= tolerance)
                .min();
            found.push(nearest.map(|(_, index)| index));
            if let Some((_, index)) = nearest {
                free = index + 1;
            }
        }
        let invented = match (truth.first(), truth.last()) {
            (Some(&(_, first)), Some(&(last, _))) => {
                let within = |stance: &Stance| stance.start > first && stance.end < last;
                // A stance that an elevator carried elsewhere is told of again, and is the same.
                let again = |index: usize| index > 0 && stances[index].start == stances[index - 1].start;
                (0..stances.len())
                    .filter(|&index| within(&stances[index]) && !found.contains(&Some(index)) && !again(index))
                    .count()
            }
            _ => 0,
        };
        Self { found, invented }
    }

    /// True stances that no detected one covers.
    pub fn missed(&self) -> usize {
        self.found.iter().filter(|found| found.is_none()).count()
    }
}

/// Time between `stance` and the interval; 0 if they touch. **Units:** microseconds.
fn apart(stance: &Stance, start: Micros, end: Micros) -> i64 {
    (stance.start - end).max(start - stance.end).max(0)
}

/// The stance that covers `instant` or lies nearest to it, at most `tolerance` away.
pub fn stance_at(stances: &[Stance], instant: Micros, tolerance: i64) -> Option<&Stance> {
    stances
        .iter()
        .map(|stance| (apart(stance, instant, instant), stance))
        .filter(|&(distance, _)| distance <= tolerance)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, stance)| stance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn stance(start: f64, end: f64) -> Stance {
        Stance { start: Micros::from_seconds(start), end: Micros::from_seconds(end), position: [0.0; 3], heading: 0.0 }
    }

    fn instants(seconds: &[f64]) -> Vec<(Micros, Micros)> {
        seconds.iter().map(|&second| (Micros::from_seconds(second), Micros::from_seconds(second))).collect()
    }

    #[test]
    fn each_instant_takes_its_stance() {
        let stances = [stance(0.0, 2.0), stance(2.6, 3.0), stance(3.6, 4.0)];
        let matching = Matching::of(&stances, &instants(&[2.0, 3.1, 4.2]), TOLERANCE_US);
        assert_eq!(matching, Matching { found: vec![Some(0), Some(1), Some(2)], invented: 0 });
    }

    #[test]
    fn a_stance_that_nobody_stood_is_invented() {
        let stances = [stance(0.0, 2.0), stance(2.3, 2.4), stance(2.8, 3.0)];
        let matching = Matching::of(&stances, &instants(&[2.0, 3.0]), TOLERANCE_US);
        assert_eq!((matching.missed(), matching.invented), (0, 1));
    }

    #[test]
    fn a_stance_cut_in_two_counts_once_as_invented() {
        let stances = [stance(0.0, 1.0), stance(2.0, 2.2), stance(2.3, 2.5), stance(3.0, 3.5)];
        let matching = Matching::of(&stances, &instants(&[1.0, 2.5, 3.5]), TOLERANCE_US);
        assert_eq!((matching.missed(), matching.invented), (0, 1));
    }

    #[test]
    fn a_stance_told_again_after_a_ride_is_the_same() {
        let stances = [stance(0.0, 1.0), stance(2.0, 3.0), stance(2.0, 9.0), stance(10.0, 11.0)];
        let truth =
            [(0.0, 1.0), (2.0, 9.0), (10.0, 11.0)].map(|(a, b)| (Micros::from_seconds(a), Micros::from_seconds(b)));
        let matching = Matching::of(&stances, &truth, 0);
        assert_eq!((matching.missed(), matching.invented), (0, 0));
    }

    #[test]
    fn two_stances_melted_into_one_miss_one() {
        let stances = [stance(0.0, 1.0), stance(2.0, 4.0), stance(5.0, 6.0)];
        let matching = Matching::of(&stances, &instants(&[1.0, 2.5, 3.9, 6.0]), TOLERANCE_US);
        assert_eq!((matching.missed(), matching.invented), (1, 0));
        assert_eq!(matching.found[1], Some(1));
    }

    #[test]
    fn standing_before_the_first_and_after_the_last_instant_is_not_judged() {
        let stances = [stance(0.0, 0.5), stance(0.6, 1.0), stance(2.0, 2.5), stance(2.6, 4.0), stance(4.1, 5.0)];
        let matching = Matching::of(&stances, &instants(&[1.0, 2.5]), TOLERANCE_US);
        assert_eq!((matching.missed(), matching.invented), (0, 0));
    }

    #[test]
    fn without_stances_all_are_missed() {
        let matching = Matching::of(&[], &instants(&[1.0, 2.0]), TOLERANCE_US);
        assert_eq!((matching.missed(), matching.invented), (2, 0));
    }

    #[test]
    fn true_intervals_are_found_by_overlap() {
        let truth = [
            (Micros(0), Micros(1_000_000)),
            (Micros(2_000_000), Micros(2_300_000)),
            (Micros(3_000_000), Micros(4_000_000)),
        ];
        let stances = [stance(0.0, 0.9), stance(1.4, 1.5), stance(2.1, 2.2), stance(2.25, 2.28), stance(3.1, 3.9)];
        let matching = Matching::of(&stances, &truth, 0);
        assert_eq!(matching, Matching { found: vec![Some(0), Some(2), Some(4)], invented: 2 });
    }

    proptest! {
        /// Law: found, missed and invented account for every instant and every stance between the first and the last.
        #[test]
        fn every_stance_and_every_instant_is_accounted_for(
            gaps in proptest::collection::vec((0.3..1.0_f64, 0.1..0.6_f64), 0..30),
            spacings in proptest::collection::vec(0.6..1.6_f64, 0..30),
        ) {
            let mut time = 0.0;
            let stances: Vec<Stance> = gaps.iter().map(|(gap, width)| {
                let start = time + gap;
                time = start + width;
                stance(start, time)
            }).collect();
            let mut time = 0.0;
            let truth: Vec<f64> = spacings.iter().map(|spacing| { time += spacing; time }).collect();
            let truth = instants(&truth);
            let matching = Matching::of(&stances, &truth, TOLERANCE_US);
            let taken: Vec<usize> = matching.found.iter().flatten().copied().collect();
            prop_assert!(taken.windows(2).all(|pair| pair[0] < pair[1]), "in order, each once");
            prop_assert_eq!(matching.missed() + taken.len(), truth.len());
            prop_assert!(matching.invented + taken.len() <= stances.len());
            for (index, found) in matching.found.iter().enumerate() {
                if let Some(found) = found {
                    prop_assert!(apart(&stances[*found], truth[index].0, truth[index].1) <= TOLERANCE_US);
                }
            }
        }
    }
}
