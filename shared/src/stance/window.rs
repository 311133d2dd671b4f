//! The newest samples of the last few hundredths of a second, with their mean and variance.
//!
//! The length is a time, not a number of samples, so a detector does the same at 50 Hz and at 2 kHz. The sums behind mean
//! and variance are integers: what enters one is later taken out of it exactly, so they do not drift in days of samples,
//! and the variance of a small motion on top of gravity loses no digits to cancellation.

use crate::time::Micros;

/// Weight of one count of the integer sums: 2^-18, that is 3.8e-6 m/s² or rad/s, far below the noise of any sensor.
const COUNT: f32 = 1.0 / 262_144.0;
/// Values are held within ±512 m/s² or rad/s; then the squares of 1023 samples fit into 64 bits.
const LARGEST: f32 = 512.0;
/// A hole in the time line longer than the window and this empties the window. **Units:** µs.
const GAP_US: i64 = 100_000;

/// A sliding window over `CHANNELS` values per sample, with room for `CAPACITY` samples.
///
/// When more samples fall into its time than it has room for, it holds the newest of them.
#[derive(Clone, Debug)]
pub struct Window<const CHANNELS: usize, const CAPACITY: usize> {
    length_us: i64,
    minimum: usize,
    times: [Micros; CAPACITY],
    values: [[i32; CHANNELS]; CAPACITY],
    sums: [i64; CHANNELS],
    squares: [u64; CHANNELS],
    oldest: usize,
    len: usize,
    complete: bool,
}

impl<const CHANNELS: usize, const CAPACITY: usize> Window<CHANNELS, CAPACITY> {
    /// An empty window over the last `seconds` of samples, but never over fewer than `minimum` samples. **Units:** s.
    ///
    /// The minimum keeps a variance meaningful where the samples are as far apart as the window is long.
    pub fn over(seconds: f32, minimum: usize) -> Self {
        const { assert!(CAPACITY > 0 && CAPACITY < 1024, "the sums hold 1 to 1023 samples") };
        let (length_us, minimum) = Self::extent(seconds, minimum);
        Self {
            length_us,
            minimum,
            times: [Micros(0); CAPACITY],
            values: [[0; CHANNELS]; CAPACITY],
            sums: [0; CHANNELS],
            squares: [0; CHANNELS],
            oldest: 0,
            len: 0,
            complete: false,
        }
    }

    /// An empty window over the last `CAPACITY` samples, however long they took.
    pub fn of_newest() -> Self {
        Self::over(f32::MAX, CAPACITY)
    }

    fn extent(seconds: f32, minimum: usize) -> (i64, usize) {
        ((seconds * 1e6) as i64, minimum.clamp(1, CAPACITY))
    }

    /// As a new one of [`Window::over`], in its place.
    pub fn restart(&mut self, seconds: f32, minimum: usize) {
        (self.length_us, self.minimum) = Self::extent(seconds, minimum);
        self.clear();
    }

    /// Forgets every sample.
    pub fn clear(&mut self) {
        self.sums = [0; CHANNELS];
        self.squares = [0; CHANNELS];
        self.len = 0;
        self.complete = false;
    }

    /// Takes one sample in and lets go of those that are too old.
    ///
    /// Time that runs backwards, a hole in the time line and a value that is not finite empty the window.
    pub fn push(&mut self, time: Micros, values: [f32; CHANNELS]) {
        if let Some(newest) = self.newest() {
            let passed = time - newest;
            if passed < 0 || passed > self.length_us.saturating_add(GAP_US) {
                self.clear();
            }
        }
        if !values.iter().all(|value| value.is_finite()) {
            self.clear();
            return;
        }
        if self.len == CAPACITY {
            self.drop_oldest();
        }
        let slot = (self.oldest + self.len) % CAPACITY;
        let counts = values.map(|value| (value.clamp(-LARGEST, LARGEST) / COUNT) as i32);
        self.times[slot] = time;
        self.values[slot] = counts;
        self.len += 1;
        for (channel, count) in counts.into_iter().enumerate() {
            self.sums[channel] += i64::from(count);
            self.squares[channel] = self.squares[channel].wrapping_add(square(count));
        }
        while self.len > self.minimum && time - self.times[self.oldest] >= self.length_us {
            self.drop_oldest();
        }
    }

    fn newest(&self) -> Option<Micros> {
        (self.len > 0).then(|| self.times[(self.oldest + self.len - 1) % CAPACITY])
    }

    fn drop_oldest(&mut self) {
        for (channel, count) in self.values[self.oldest].into_iter().enumerate() {
            self.sums[channel] -= i64::from(count);
            self.squares[channel] = self.squares[channel].wrapping_sub(square(count));
        }
        self.oldest = (self.oldest + 1) % CAPACITY;
        self.len -= 1;
        self.complete = true;
    }

    /// Number of samples held.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no sample is held.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether the samples reach back over the whole length: one has already been let go since the window was empty.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// Mean of each channel, 0 when empty. **Units:** those of the values.
    pub fn mean(&self) -> [f32; CHANNELS] {
        let n = self.len.max(1) as f32;
        self.sums.map(|sum| sum as f32 / n * COUNT)
    }

    /// Variance of each channel about its mean (divided by n), 0 when empty. **Units:** those of the values, squared.
    pub fn variance(&self) -> [f32; CHANNELS] {
        let n = self.len.max(1) as f32;
        core::array::from_fn(|channel| {
            let sum = self.sums[channel];
            // About an integer near the mean, in exact arithmetic modulo 2^64: the true value fits, so it is found. What
            // the integer is off the mean is taken out afterwards.
            let near = (sum as f32 / n) as i64;
            let rest = sum - near * self.len as i64;
            let taken_out = (near as u64).wrapping_mul((sum + rest) as u64);
            let spread = self.squares[channel].wrapping_sub(taken_out) as f32;
            let off = rest as f32 / n;
            (spread / n - off * off).max(0.0) * (COUNT * COUNT)
        })
    }
}

/// The square of a value in counts.
fn square(count: i32) -> u64 {
    let magnitude = u64::from(count.unsigned_abs());
    magnitude * magnitude
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Mean and variance of the last `n` of `values`, in f64.
    fn truth(values: &[f32]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
        let variance = values.iter().map(|&v| (f64::from(v) - mean) * (f64::from(v) - mean)).sum::<f64>() / n;
        (mean, variance)
    }

    proptest! {
        #[test]
        fn mean_and_variance_are_those_of_the_newest(
            values in proptest::collection::vec(-600.0_f32..600.0, 1..150),
            offset in -500.0_f32..500.0,
            decade in -4..1,
        ) {
            let scale = libm::powf(10.0, decade as f32);
            let values: Vec<f32> = values.iter().map(|v| (offset + v * scale).clamp(-LARGEST, LARGEST)).collect();
            let mut window = Window::<1, 64>::over(0.05, 1);
            for (i, &value) in values.iter().enumerate() {
                window.push(Micros(i as i64 * 1_000), [value]);
            }
            let held = values.len().min(50);
            prop_assert_eq!(window.len(), held);
            let (mean, variance) = truth(&values[values.len() - held..]);
            // One count for what is cut off each value, and the rounding of the results.
            let count = f64::from(COUNT);
            let sigma = libm::sqrt(variance);
            prop_assert!((f64::from(window.mean()[0]) - mean).abs() <= count + 2e-7 * mean.abs());
            prop_assert!(
                (f64::from(window.variance()[0]) - variance).abs() <= 3e-6 * variance + 3.0 * count * (sigma + count)
            );
        }

        #[test]
        fn no_input_breaks_it(
            samples in proptest::collection::vec((any::<i64>(), any::<u32>(), any::<u32>()), 1..100),
            seconds in any::<f32>(),
        ) {
            let mut window = Window::<2, 7>::over(seconds, 3);
            for (time, x, y) in samples {
                window.push(Micros(time), [f32::from_bits(x), f32::from_bits(y)]);
                prop_assert!(window.len() <= 7);
                prop_assert!(window.mean().iter().all(|m| m.abs() <= LARGEST));
                prop_assert!(window.variance().iter().all(|&v| (0.0..=LARGEST * LARGEST).contains(&v)));
            }
        }
    }

    #[test]
    fn the_sums_do_not_drift_in_an_hour_at_2_khz() {
        let mut window = Window::<1, 64>::over(0.03, 3);
        for i in 0..7_200_000_i64 {
            let value = if i % 1_000 < 500 { 150.0 } else { 9.81 } + (i % 7) as f32 * 0.01;
            window.push(Micros(i * 500), [value]);
        }
        for i in 0..64 {
            window.push(Micros(3_600_000_000 + i * 500), [9.81]);
        }
        assert!((window.mean()[0] - 9.81).abs() < COUNT);
        assert_eq!(window.variance()[0], 0.0);
    }

    #[test]
    fn it_covers_the_same_time_at_every_rate() {
        for rate in [50_i64, 100, 200, 820, 2_000] {
            let mut window = Window::<1, 256>::over(0.1, 3);
            for i in 0..rate {
                window.push(Micros(i * 1_000_000 / rate), [1.0]);
            }
            assert!(window.is_complete());
            assert_eq!(window.len() as i64, rate / 10);
        }
    }

    #[test]
    fn slow_samples_keep_the_minimum() {
        let mut window = Window::<1, 8>::over(0.03, 3);
        for (i, value) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            assert!(!window.is_complete());
            window.push(Micros(i as i64 * 20_000), [value]);
        }
        assert!(window.is_complete());
        assert_eq!((window.len(), window.mean()), (3, [3.0]));
    }

    #[test]
    fn gaps_and_time_running_backwards_empty_it() {
        for next in [Micros(1_000_000), Micros(5)] {
            let mut window = Window::<1, 8>::over(0.002, 1);
            for i in 0..8 {
                window.push(Micros(10 + i * 1_000), [f32::from(i as i16)]);
            }
            window.push(next, [5.0]);
            assert_eq!((window.len(), window.is_complete(), window.mean()), (1, false, [5.0]));
        }
    }
}
