//! How long steps take from their arrival to the picture, as the program itself measures it.

use super::gpu::Frame;
use super::status::Latency;
use std::collections::VecDeque;
use std::time::Instant;

/// So many of the last steps count.
const COUNTED: usize = 1_000;
/// Fewer say nothing.
const LEAST: usize = 5;
/// No more frames are on their way to a picture at once.
const UNDERWAY: usize = 16;

/// Measures.
#[derive(Debug, Default)]
pub struct Latencies {
    /// The step that is shown, and whether its picture was painted.
    last: Option<Instant>,
    waiting: Option<Instant>,
    /// Frames that show a step and are not drawn yet: when each began, and when its step arrived.
    underway: VecDeque<[Instant; 2]>,
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

    /// A frame begins.
    pub fn begun(&mut self, frame: Instant) {
        if let Some(stepped) = self.waiting.take() {
            if self.underway.len() == UNDERWAY {
                self.underway.pop_front();
            }
            self.underway.push_back([frame, stepped]);
        }
    }

    /// A frame is drawn.
    pub fn drawn(&mut self, frame: Frame) {
        let Some(index) = self.underway.iter().position(|[begun, _]| *begun == frame.begun) else { return };
        // Frames are drawn in their order: one before it that was not told of will not be.
        let [_, stepped] = self.underway.drain(..=index).next_back().expect("it is one of them");
        if self.taken.len() == COUNTED {
            self.taken.pop_front();
        }
        self.taken.push_back(frame.drawn.saturating_duration_since(stepped).as_secs_f64() * 1e3);
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
    use std::time::Duration;

    #[test]
    fn each_step_counts_once_when_its_frame_is_drawn() {
        let mut latencies = Latencies::default();
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        for index in 0..10_u64 {
            let stepped = at(1_000 * index);
            // The frame begins 1 to 10 ms after the step; the next one begins before it is drawn, and shows the same step.
            let frames = [at(1_000 * index + index + 1), at(1_000 * index + 50)];
            for frame in frames {
                latencies.arrived(Some(stepped));
                latencies.begun(frame);
            }
            assert_eq!(latencies.told().is_some(), index >= LEAST as u64, "{index}");
            for begun in frames {
                latencies.drawn(Frame { begun, drawn: begun + Duration::from_millis(100) });
            }
        }
        let told = latencies.told().unwrap();
        assert_eq!((told.steps, told.median_ms, told.p99_ms), (10, 106.0, 110.0));
    }

    #[test]
    fn a_frame_that_nobody_tells_of_is_not_counted() {
        let mut latencies = Latencies::default();
        let start = Instant::now();
        for index in 0..3 * UNDERWAY as u64 {
            let frame = start + Duration::from_secs(index);
            latencies.arrived(Some(frame));
            latencies.begun(frame);
        }
        assert!(latencies.told().is_none() && latencies.underway.len() == UNDERWAY);
        let [begun, _] = latencies.underway[3];
        latencies.drawn(Frame { begun, drawn: begun + Duration::from_millis(7) });
        assert_eq!((latencies.taken.make_contiguous(), latencies.underway.len()), (&mut [7.0][..], UNDERWAY - 4));
    }
}
