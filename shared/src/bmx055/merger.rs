//! Two dies, two clocks, one stream of samples.
//!
//! The tracker wants the rate and the force of the same moment. The gyroscope gives the moments; the accelerometer is
//! interpolated between its own two frames around each of them. Where a die has a gap, so have the samples: no force is
//! made up further than about a period from one that was measured.
//!
//! What comes out is a function of the sequence of batches alone. Batches of the two dies may come in any order as long as
//! neither is more than [`GYRO_FRAMES`] or [`ACCEL_FRAMES`] frames ahead; older frames that still wait are then given up.

use super::batch::{Batch, Die};
use super::clock::{Clock, rounded};
use super::config::{AccelConfig, Config, GyroConfig};
use crate::sample::{Accel, Clipped, Counts, Gyro, ImuSample};
use crate::time::Micros;
use heapless::Deque;
use nalgebra::Vector3;

/// Frames of the gyroscope that wait for the accelerometer at most.
pub const GYRO_FRAMES: usize = 128;

/// Frames of the accelerometer that wait for the gyroscope at most.
pub const ACCEL_FRAMES: usize = 64;

/// A frame of the gyroscope.
#[derive(Clone, Copy, Debug)]
struct Rate {
    /// **Units:** ticks.
    time: i64,
    counts: Counts,
}

/// A frame of the accelerometer.
#[derive(Clone, Copy, Debug)]
struct Force {
    /// **Units:** ticks.
    time: i64,
    /// Reciprocal of the time since the frame before; zero where that is too long ago. **Units:** 1/ticks.
    inverse: f32,
    /// **Units:** m/s².
    value: Vector3<f32>,
    clipped: bool,
}

/// What lies between two frames of the accelerometer.
#[derive(Clone, Debug)]
struct Interval {
    /// Time of its earlier end. **Units:** ticks.
    start: i64,
    /// Force at its earlier end. **Units:** m/s².
    value: Vector3<f32>,
    /// **Units:** m/s² for each tick.
    slope: Vector3<f32>,
    /// Whether one of its ends is at the end of the range.
    clipped: bool,
    /// Its later end.
    end: Force,
}

impl Interval {
    /// Before the first frame.
    const NONE: Self = Self {
        start: i64::MIN,
        value: Vector3::new(0.0, 0.0, 0.0),
        slope: Vector3::new(0.0, 0.0, 0.0),
        clipped: false,
        end: Force { time: i64::MIN, inverse: 0.0, value: Vector3::new(0.0, 0.0, 0.0), clipped: false },
    };

    /// Becomes the one that begins where it ended.
    fn advance(&mut self, end: Force) {
        self.start = self.end.time;
        self.value = self.end.value;
        self.slope = (end.value - self.value) * end.inverse;
        self.clipped = self.end.clipped | end.clipped;
        self.end = end;
    }
}

/// Merges the batches of both dies.
#[derive(Clone, Debug)]
pub struct Merger {
    accel: Stream,
    gyro: Stream,
    forces: Deque<Force, ACCEL_FRAMES>,
    rates: Deque<Rate, GYRO_FRAMES>,
    /// The last frame of the accelerometer that went into the queue. **Units:** ticks.
    last_force: Option<i64>,
    interval: Interval,
    temperature: Option<i8>,
}

/// What is known of a die.
#[derive(Clone, Debug)]
struct Stream {
    clock: Clock,
    /// Weight of a count. **Units:** m/s² or rad/s.
    scale: f32,
}

impl Stream {
    fn new(period_us: u32, scale: f32) -> Self {
        Self { clock: Clock::new(period_us), scale }
    }
}

impl Merger {
    /// For a sensor set up like this.
    pub fn new(config: &Config) -> Self {
        Self {
            accel: Stream::new(config.accel.period_us(), config.accel.scale()),
            gyro: Stream::new(config.gyro.period_us(), config.gyro.scale()),
            forces: Deque::new(),
            rates: Deque::new(),
            last_force: None,
            interval: Interval::NONE,
            temperature: None,
        }
    }

    /// As new, for a sensor set up like this.
    pub fn restart(&mut self, config: &Config) {
        self.accel = Stream::new(config.accel.period_us(), config.accel.scale());
        self.gyro = Stream::new(config.gyro.period_us(), config.gyro.scale());
        self.reset();
    }

    /// Forgets everything, as when the sensor has booted anew.
    pub fn reset(&mut self) {
        self.accel.clock.reset();
        self.gyro.clock.reset();
        self.forces.clear();
        self.rates.clear();
        self.last_force = None;
        self.interval = Interval::NONE;
        self.temperature = None;
    }

    /// Temperature of the accelerometer as it was read last. **Units:** °C.
    pub fn temperature(&self) -> Option<f32> {
        self.temperature.map(|counts| 23.0 + 0.5 * f32::from(counts))
    }

    /// Takes a batch in; the samples that it completes go to `sink`, their times strictly increasing.
    pub fn push(&mut self, batch: &Batch, sink: impl FnMut(&ImuSample)) {
        self.temperature = batch.temperature.or(self.temperature);
        match batch.die {
            Die::Accel => self.push_accel(batch),
            Die::Gyro => self.push_gyro(batch),
        }
        self.merge(sink);
    }

    fn push_gyro(&mut self, batch: &Batch) {
        let Some(times) = self.gyro.clock.push(batch) else { return };
        let mut time = times.first;
        for &frame in &batch.frames {
            if self.rates.is_full() {
                self.rates.pop_front();
            }
            // There is room.
            let _ = self.rates.push_back(Rate { time, counts: Counts(frame) });
            time += times.spacing;
        }
    }

    fn push_accel(&mut self, batch: &Batch) {
        let Some(times) = self.accel.clock.push(batch) else { return };
        let usual = 1.0 / times.spacing as f32;
        let mut inverse = self.last_force.map_or(0.0, |last| {
            let since = times.first - last;
            // One missing frame is bridged: from its middle a measured one is a period away.
            if since <= self.accel.clock.period() * 5 / 2 { 1.0 / since as f32 } else { 0.0 }
        });
        let mut time = times.first;
        for &frame in &batch.frames {
            let counts = Counts(frame);
            let clipped = counts.saturated(AccelConfig::BITS);
            if self.forces.is_full() {
                self.forces.pop_front();
                if let Some(first) = self.forces.front_mut() {
                    first.inverse = 0.0;
                }
            }
            // There is room.
            let _ = self.forces.push_back(Force { time, inverse, value: counts.scaled(self.accel.scale), clipped });
            self.last_force = Some(time);
            time += times.spacing;
            inverse = usual;
        }
    }

    /// Hands out what lies between frames of the accelerometer that are there.
    fn merge(&mut self, mut sink: impl FnMut(&ImuSample)) {
        while let Some(&Rate { time, counts }) = self.rates.front() {
            while self.interval.end.time < time {
                let Some(end) = self.forces.pop_front() else { return };
                self.interval.advance(end);
            }
            self.rates.pop_front();
            let Interval { start, value, slope, clipped, end } = &self.interval;
            if end.inverse <= 0.0 || time < *start {
                continue;
            }
            // An interval is shorter than 2^31 ticks: 0.5 s.
            let since = (time - start) as i32 as f32;
            sink(&ImuSample {
                time: Micros(rounded(time)),
                accel: Accel(value + slope * since),
                gyro: Gyro(counts.scaled(self.gyro.scale)),
                clipped: Clipped { accel: *clipped, gyro: counts.saturated(GyroConfig::BITS) },
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bmx055::rig::{Rig, number, timed};
    use crate::bmx055::twin::SimulatedBmx055;
    use core::cell::RefCell;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn merged(merger: &mut Merger, batches: &[Batch]) -> Vec<ImuSample> {
        let mut samples = Vec::new();
        for batch in batches {
            merger.push(batch, |sample| samples.push(*sample));
        }
        samples
    }

    /// **Units:** counts.
    const SWING: f64 = 1_500.0;

    /// 3 Hz: as fast as a foot turns about. **Units:** rad/s.
    const PULSE: f64 = 18.85;

    /// Of the signal at a time. **Units:** counts.
    fn swing(time_us: f64, phase: f64) -> f64 {
        SWING * libm::sin(PULSE * time_us * 1e-6 + phase)
    }

    const PHASES: [f64; 3] = [0.0, 2.0, 4.0];

    /// Gyroscope: the time. Accelerometer: three sines.
    fn swinging(die: Die, time_ns: u64) -> [i16; 3] {
        match die {
            Die::Accel => PHASES.map(|phase| libm::round(swing(time_ns as f64 * 1e-3, phase)) as i16),
            Die::Gyro => timed(die, time_ns),
        }
    }

    /// When a sample was taken, as its rate tells. **Units:** microseconds.
    fn truth(sample: &ImuSample) -> i64 {
        let per_count = Config::default().gyro.scale();
        let counts: [f32; 3] = (sample.gyro.0 / per_count).into();
        number(&counts.map(|count| libm::roundf(count) as i16))
    }

    /// Every sample from `from_us` on has its time within `bound_us`, and the force of that moment.
    fn assert_true(samples: &[ImuSample], from_us: i64, bound_us: i64) {
        let per_count = Config::default().accel.scale();
        for sample in samples.iter().filter(|sample| sample.time.0 >= from_us) {
            let taken = truth(sample);
            let error = sample.time.0 - taken;
            assert!(error.abs() <= bound_us, "{error} us at {taken} us");
            for (axis, phase) in PHASES.into_iter().enumerate() {
                let expected = swing(taken as f64, phase);
                let error = f64::from(sample.accel.0[axis] / per_count) - expected;
                // Both clocks may be off, at the steepest; half a count of rounding; the chord of a bent curve 0.1.
                let bound = SWING * PULSE * 2e-6 * bound_us as f64 + 0.6;
                assert!(error.abs() < bound, "{error} counts at {taken} us");
            }
        }
    }

    /// One in 1e10 of the stamps that the line goes through is later; see the clock.
    const SETTLED_US: i64 = 30;

    #[test]
    fn forces_are_those_of_the_moment_of_the_rate() {
        for (accel_ns, gyro_ns) in [(497_500, 502_500), (502_500, 497_500), (500_000, 500_000)] {
            let twin = RefCell::new(SimulatedBmx055::new(accel_ns, gyro_ns, swinging));
            let mut rig = Rig::new(&twin, &Config::default());
            rig.late_us = 100;
            twin.borrow_mut().set_temperature(-6);
            rig.run(8_000_000);
            let mut merger = Merger::new(&Config::default());
            let samples = merged(&mut merger, &rig.batches);
            assert_eq!(merger.temperature(), Some(20.0));
            assert!(samples.len() as i64 > 7_900_000_000 / i64::from(gyro_ns));
            assert_true(&samples, 400_000, SETTLED_US);
            for pair in samples.windows(2) {
                // Every frame is there; the counts hold whole microseconds.
                let error = truth(&pair[1]) - truth(&pair[0]) - i64::from(gyro_ns) / 1_000;
                assert!((0..=1).contains(&error), "{error}");
            }
        }
    }

    #[test]
    fn a_lost_interrupt_and_an_overrun_move_no_sample() {
        let twin = RefCell::new(SimulatedBmx055::new(497_500, 502_500, swinging));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.late_us = 100;
        rig.run(1_000_000);
        for die in [Die::Accel, Die::Gyro] {
            twin.borrow_mut().faults(die).interrupts = 1;
            rig.run(500_000);
            assert_eq!(rig.driver.counters(die).missed_interrupts, 1);
        }
        // Nobody comes for 40 ms: the FIFO of the accelerometer runs over, the gyroscope's does not.
        rig.now = rig.now + 40_000;
        rig.run(1_000_000);
        assert_eq!(rig.driver.counters(Die::Accel).overruns, 1);
        let samples = merged(&mut Merger::new(&Config::default()), &rig.batches);
        let overrun_us = 2_050_000;
        let before: Vec<_> = samples.iter().copied().filter(|sample| sample.time.0 < overrun_us).collect();
        assert_true(&before, 400_000, SETTLED_US);
        let gaps: Vec<_> =
            samples.windows(2).map(|pair| pair[1].time - pair[0].time).filter(|&gap| gap > 600).collect();
        // 40 ms, and the part of a watermark of 8 ms that waited in the FIFO before: what has run over is thrown away.
        assert!(matches!(gaps[..], [first] if (40_000..48_000).contains(&first)), "{gaps:?}");
        // The first stamp after the gap is as late as its interrupt, and two roundings to a microsecond.
        assert_true(&samples, overrun_us, 102);
        assert_true(&samples, overrun_us + 600_000, SETTLED_US);
    }

    /// Batches of 16 frames on time, of a die whose counts are all `count`, from frame `first` on.
    fn batches(die: Die, count: i16, first: u32, number: u32) -> Vec<Batch> {
        let batch = |index: u32| {
            let sequence = first + index * 16;
            Batch {
                die,
                sequence,
                stamp: Micros(i64::from(sequence + 16) * 500 + if die == Die::Gyro { 130 } else { 0 }),
                lost: false,
                temperature: None,
                frames: core::iter::repeat_n([count, 0, 0], 16).collect(),
            }
        };
        (0..number).map(batch).collect()
    }

    fn in_order(mut batches: Vec<Batch>) -> Vec<Batch> {
        batches.sort_by_key(|batch| batch.stamp);
        batches
    }

    #[test]
    fn one_missing_frame_is_bridged_and_two_are_a_gap() {
        for (missing, gap_us) in [(0, 500), (1, 500), (2, 2_000)] {
            let mut all = batches(Die::Accel, 128, 0, 4);
            all.extend(batches(Die::Accel, 256, 64 + missing, 4));
            all.extend(batches(Die::Gyro, 100, 0, 8));
            let samples = merged(&mut Merger::new(&Config::default()), &in_order(all));
            let gap = samples.windows(2).map(|pair| pair[1].time - pair[0].time).max();
            // The longest gap: two frames of the accelerometer are 1.5 ms, with three rates inside.
            assert_eq!(gap, Some(gap_us), "{missing}");
        }
    }

    #[test]
    fn nothing_comes_while_a_die_is_silent_and_the_rest_is_bounded() {
        let mut merger = Merger::new(&Config::default());
        assert!(merged(&mut merger, &batches(Die::Gyro, 100, 0, 1_000)).is_empty());
        // Of the last 128 rates those that lie between the forces have one.
        let samples = merged(&mut merger, &batches(Die::Accel, 128, 15_900, 10));
        assert_eq!((samples.len(), samples[0].time), (100, Micros(15_901 * 500 + 130)));
        merger.reset();
        assert!(merged(&mut merger, &batches(Die::Accel, 128, 0, 1_000)).is_empty());
        let samples = merged(&mut merger, &batches(Die::Gyro, 100, 0, 1_000));
        assert_eq!((samples.len(), samples[0].time), (63, Micros(15_937 * 500 + 130)));
    }

    #[test]
    fn samples_at_the_end_of_a_range_are_marked() {
        for (accel, gyro) in [(2_047, 5), (-2_048, 5), (5, i16::MIN), (5, i16::MAX), (2_046, i16::MAX - 1)] {
            let mut all = batches(Die::Accel, accel, 0, 4);
            all.extend(batches(Die::Gyro, gyro, 0, 4));
            let samples = merged(&mut Merger::new(&Config::default()), &in_order(all));
            let clipped =
                Clipped { accel: accel == 2_047 || accel == -2_048, gyro: gyro == i16::MIN || gyro == i16::MAX };
            assert!(!samples.is_empty() && samples.iter().all(|sample| sample.clipped == clipped), "{accel} {gyro}");
        }
    }

    fn any_batch() -> impl Strategy<Value = Batch> {
        let stamp = prop_oneof![4 => 0..200_000_i64, 1 => any::<i64>()];
        let sequence = prop_oneof![4 => 0..400_u32, 1 => any::<u32>()];
        let frames = prop::collection::vec(any::<[i16; 3]>(), 0..=32);
        (any::<bool>(), sequence, stamp, prop::bool::weighted(0.1), any::<Option<i8>>(), frames).prop_map(
            |(accel, sequence, stamp, lost, temperature, frames)| Batch {
                die: if accel { Die::Accel } else { Die::Gyro },
                sequence,
                stamp: Micros(stamp),
                lost,
                temperature,
                frames: frames.into_iter().collect(),
            },
        )
    }

    proptest! {
        #[test]
        fn times_increase_whatever_comes(batches in prop::collection::vec(any_batch(), 0..60)) {
            let mut merger = Merger::new(&Config::default());
            let samples = merged(&mut merger, &batches);
            prop_assert!(samples.windows(2).all(|pair| pair[0].time < pair[1].time));
            // A force between two measured ones is never beyond the range.
            prop_assert!(samples.iter().all(|sample| sample.is_finite()));
            merger.reset();
            prop_assert_eq!(&samples, &merged(&mut merger, &batches), "a reset forgets everything");
        }

        /// Whole batches with the errors that a driver can make.
        #[test]
        fn forces_stay_between_measured_ones(losses in prop::collection::vec((0..5_u32, 0..3_000_i64, any::<bool>()), 1..80)) {
            let mut all = Vec::new();
            for die in [Die::Accel, Die::Gyro] {
                let mut first = 0;
                for (index, &(missing, late, flag)) in losses.iter().enumerate() {
                    first += if index % 7 == die as usize { missing * 10 } else { 0 };
                    let mut batch = batches(die, if index % 2 == 0 { 100 } else { 228 }, first, 1).remove(0);
                    batch.stamp = batch.stamp + late;
                    batch.lost = flag && missing > 0;
                    all.push(batch);
                    first += 16;
                }
            }
            let per_count = Config::default().accel.scale();
            let samples = merged(&mut Merger::new(&Config::default()), &in_order(all));
            for sample in samples {
                prop_assert!((99.99..228.01).contains(&(sample.accel.0.x / per_count)));
            }
        }
    }
}
