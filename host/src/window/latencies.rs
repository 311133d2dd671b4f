//! How long steps take from their arrival to the picture, as the program itself measures it.

use super::status::Latency;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// So many of the last steps count.
const COUNTED: usize = 1_000;
/// Fewer say nothing.
const LEAST: usize = 5;

/// Measures.
#[derive(Debug, Default)]
pub struct Latencies {
    /// The step that is shown, and whether its picture was painted.
    last: Option<Instant>,
    waiting: Option<Instant>,
    /// From the arrival of a step to the beginning of the frame that shows it.
    begun: Option<Duration>,
    /// **Units:** ms.
    taken: VecDeque<f64>,
}

impl Latencies {
    /// A snapshot has arrived whose last step came at this time.
    pub fn arrived(&mut self, stepped: Option<Instant>) {
        if stepped != self.last {
            self.last = stepped;
            self.waiting = stepped;
        }
    }

    /// A frame begins. How long one takes, until the card has all of it, is known when the next one begins: `before` is what
    /// the frame before took; nothing where nobody measures that.
    pub fn frame(&mut self, before: Option<Duration>) {
        if let (Some(begun), Some(frame)) = (self.begun.take(), before) {
            if self.taken.len() == COUNTED {
                self.taken.pop_front();
            }
            self.taken.push_back((begun + frame).as_secs_f64() * 1e3);
        }
        self.begun = self.waiting.take().map(|stepped| stepped.elapsed());
    }

    /// What came of it, once there were enough steps.
    pub fn told(&self) -> Option<Latency> {
        if self.taken.len() < LEAST {
            return None;
        }
        let mut taken: Vec<f64> = self.taken.iter().copied().collect();
        taken.sort_by(f64::total_cmp);
        let at = |share: f64| taken[((taken.len() as f64 * share) as usize).min(taken.len() - 1)];
        Some(Latency { steps: taken.len(), median_ms: at(0.5), p99_ms: at(0.99) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_counts_once_when_its_frame_is_done() {
        let mut latencies = Latencies::default();
        let start = Instant::now();
        let frame = Some(Duration::from_millis(100));
        for index in 0..10_u32 {
            let stepped = start.checked_sub(Duration::from_millis(u64::from(index) + 1));
            latencies.arrived(stepped);
            latencies.frame(frame);
            latencies.arrived(stepped);
            assert_eq!(latencies.told().is_some(), index >= LEAST as u32, "{index}");
            latencies.frame(frame);
        }
        let told = latencies.told().unwrap();
        assert!(latencies.taken.len() == 10 && told.median_ms >= 105.0 && told.p99_ms >= 110.0, "{told:?}");
    }

    #[test]
    fn a_frame_that_nobody_measures_is_not_counted() {
        let mut latencies = Latencies::default();
        for _ in 0..2 * LEAST {
            latencies.arrived(Some(Instant::now()));
            latencies.frame(None);
        }
        assert!(latencies.told().is_none() && latencies.taken.is_empty());
    }
}
