//! How long steps take from their arrival to the picture, as the program itself measures it.

use super::status::Latency;
use std::collections::VecDeque;
use std::time::Instant;

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

    /// It has been painted.
    pub fn painted(&mut self) {
        let Some(stepped) = self.waiting.take() else { return };
        if self.taken.len() == COUNTED {
            self.taken.pop_front();
        }
        self.taken.push_back(stepped.elapsed().as_secs_f64() * 1e3);
    }

    /// What came of it, once there were enough steps.
    pub fn told(&self) -> Option<Latency> {
        if self.taken.len() < LEAST {
            return None;
        }
        let mut taken: Vec<f64> = self.taken.iter().copied().collect();
        taken.sort_by(f64::total_cmp);
        let at = |share: f64| taken[((taken.len() as f64 * share) as usize).min(taken.len() - 1)];
        Some(Latency { median_ms: at(0.5), p99_ms: at(0.99) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_counts_once_when_it_is_painted() {
        let mut latencies = Latencies::default();
        let start = Instant::now();
        for index in 0..10_u32 {
            let stepped = start.checked_sub(std::time::Duration::from_millis(u64::from(index) + 1));
            latencies.arrived(stepped);
            latencies.painted();
            latencies.arrived(stepped);
            latencies.painted();
            assert_eq!(latencies.told().is_some(), index + 1 >= LEAST as u32, "{index}");
        }
        let told = latencies.told().unwrap();
        assert!(latencies.taken.len() == 10 && told.median_ms >= 5.0 && told.p99_ms >= 10.0, "{told:?}");
    }
}
