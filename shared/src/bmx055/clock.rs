//! When the frames of a die were taken, from the stamps of its interrupts.
//!
//! A die has an oscillator of its own, some 0.5 % off, which drifts with its temperature. What is seen of it are stamps of
//! interrupts, and these are only ever late: by the latency of the processor, by much more when an interrupt was missed.
//!
//! A Kalman filter of two states, time and period, lays a line through the middle of the stamps, and so finds the period as
//! fast as they allow. The frames were taken at the lower edge of the stamps: of the last [`BLOCK`] to twice as many batches
//! the stamp that lies lowest under the line is kept, and the times handed out are those of the line through it.
//!
//! These times always move forward and never jump: frames are spread evenly from the last one of the batch before to the
//! line. Only where frames were lost the line begins anew, with the period that is known.

use super::batch::Batch;

/// Binary digits of a tick after the point of a microsecond.
const TICK_BITS: u32 = 12;

/// Further digits of the line and its period, so that their smallest corrections are not rounded away.
const FINE_BITS: u32 = 4;

/// Fine ticks. **Units:** 1/microseconds.
const FINE_PER_US: i64 = 1 << (TICK_BITS + FINE_BITS);

/// Stamps are brought within ± this, 13 months, so that no sum of times overflows. **Units:** microseconds.
const STAMP_MAX_US: i64 = 1 << 45;

/// No time is handed out beyond this: 26 months. **Units:** ticks.
const LAST: i64 = 1 << 58;

/// Batches after which the lowest stamp but one block is forgotten; at 16 frames and 2 kHz half a second.
const BLOCK: u32 = 64;

/// Variance of an interrupt's lateness in ordinary use: evenly spread over 100 us. **Units:** square microseconds.
const LATENESS: f32 = 100.0 * 100.0 / 12.0;

/// A stamp later than so many standard deviations says nothing of the line: an interrupt was missed.
const GATE: f32 = 3.5;

/// So many of these in a row and the line is wrong.
const LATE_MAX: u32 = 16;

/// Standard deviation of the period from the data sheet's before anything is known, relative. BMI088, table 5: 0.3 % for
/// the gyroscope; not specified for the accelerometer.
const PERIOD_SPREAD: f32 = 5e-3;

/// Standard deviation of the change of the period in 1000 frames, relative: 1 K changes an oscillator by some 1e-5.
const PERIOD_DRIFT: f32 = 3e-6;

/// Frames that may be missing by their number before the line begins anew.
const MISSING_MAX: u32 = 1_000;

/// A stamp that is so much too early belongs to another line. **Units:** microseconds; and 1/32 of the time since the last.
const EARLY_US: i64 = 2_000;

/// Times of the frames of a batch. **Units:** ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Times {
    /// Of the first frame.
    pub first: i64,
    /// From one to the next.
    pub spacing: i64,
}

/// A stamp as seen from the line.
#[derive(Clone, Copy, Debug)]
struct Low {
    /// How far it is above the line. **Units:** fine ticks.
    above: i64,
    /// Frames since.
    age: u32,
}

/// The clock of a die.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    /// By the data sheet. **Units:** fine ticks.
    nominal: i64,
    /// As estimated. **Units:** fine ticks.
    period: i64,
    /// The line at the last frame. **Units:** fine ticks.
    line: i64,
    /// Covariance of line and period: of the line, of both, of the period. **Units:** square microseconds.
    covariance: [f32; 3],
    /// Lowest stamps of this block and of the one before.
    lows: [Option<Low>; 2],
    /// Batches of this block.
    batches: u32,
    /// Stamps in a row that were too late to be used.
    late: u32,
    /// Number of the next frame and time of the last one in ticks, once there was one.
    last: Option<(u32, i64)>,
}

impl Clock {
    /// **Units:** microseconds.
    pub fn new(period_us: u32) -> Self {
        let nominal = i64::from(period_us.max(1)) * FINE_PER_US;
        let mut clock = Self {
            nominal,
            period: nominal,
            line: 0,
            covariance: [0.0; 3],
            lows: [None; 2],
            batches: 0,
            late: 0,
            last: None,
        };
        clock.reset();
        clock
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.period = self.nominal;
        self.covariance = [0.0, 0.0, square(PERIOD_SPREAD * microseconds(self.nominal))];
        self.last = None;
    }

    /// Time from one frame to the next as estimated. **Units:** ticks.
    pub fn period(&self) -> i64 {
        self.period >> FINE_BITS
    }

    /// Takes a batch in; `None` when it is empty.
    pub fn push(&mut self, batch: &Batch) -> Option<Times> {
        let count = batch.frames.len() as u32;
        if count == 0 {
            return None;
        }
        let stamp = batch.stamp.0.clamp(-STAMP_MAX_US, STAMP_MAX_US) * FINE_PER_US;
        let missing = self.last.map_or(0, |(next, _)| batch.sequence.wrapping_sub(next));
        let mut lost = batch.lost || self.last.is_none() || missing > MISSING_MAX;
        // Frames from the last one of the batch before.
        let steps = if lost { count } else { missing + count };
        lost = lost || !self.follow(steps, stamp);
        if lost {
            self.begin(stamp);
        }
        let low = self.lows.iter().flatten().map(|low| low.above).min().unwrap_or(0);
        let target = (self.line + low) >> FINE_BITS;
        let (period, shortest) = (self.period(), self.period() / 2);
        let longest = if lost { period } else { period + shortest };
        let even = self.last.map_or(period, |(_, last)| (target - last) / i64::from(steps));
        let spacing = even.clamp(shortest, longest);
        let last = match self.last {
            // After a loss the times go on from the last only where there is no room for what comes.
            Some((_, last)) if !lost || even < shortest => last + i64::from(steps) * spacing,
            _ => target,
        };
        let last = last.min(LAST);
        self.last = Some((batch.sequence.wrapping_add(count), last));
        Some(Times { first: last - i64::from(count - 1) * spacing, spacing })
    }

    /// Lays a new line through a stamp; the period stays.
    fn begin(&mut self, stamp: i64) {
        self.line = stamp;
        let [.., period] = self.covariance;
        self.covariance = [LATENESS, 0.0, period];
        self.lows = [Some(Low { above: 0, age: 0 }), None];
        self.batches = 1;
        self.late = 0;
    }

    /// Goes `steps` frames on, to the frame of `stamp`. False when the stamp cannot belong to this line.
    fn follow(&mut self, steps: u32, stamp: i64) -> bool {
        let elapsed = i64::from(steps) * self.period;
        self.line += elapsed;
        let n = steps as f32;
        let [line, both, period] = self.covariance;
        let line = line + n * (2.0 * both + n * period);
        let both = both + n * period;
        let period = period + n * square(PERIOD_DRIFT * microseconds(self.nominal)) / 1_000.0;
        self.covariance = [line, both, period];
        for low in self.lows.iter_mut().flatten() {
            low.age = low.age.saturating_add(steps);
        }
        let above = stamp - self.line;
        if above < -(EARLY_US * FINE_PER_US + elapsed / 32) {
            return false;
        }
        let variance = line + LATENESS;
        if microseconds(above) > GATE * libm::sqrtf(variance) {
            self.late += 1;
            return self.late < LATE_MAX;
        }
        self.late = 0;
        self.update(above, line / variance, both / variance);
        self.keep(Low { above: stamp - self.line, age: 0 });
        true
    }

    /// Kalman update of line and period.
    fn update(&mut self, above: i64, line_gain: f32, period_gain: f32) {
        let [line, both, period] = self.covariance;
        self.covariance = [line * (1.0 - line_gain), both * (1.0 - line_gain), (period - period_gain * both).max(0.0)];
        let limit = self.nominal / 20;
        let raise = fine(line_gain * microseconds(above));
        let period = self.period + fine(period_gain * microseconds(above));
        let period = period.clamp(self.nominal - limit, self.nominal + limit);
        let stretch = period - self.period;
        self.line += raise;
        self.period = period;
        // The old stamps stay where they are; the line has turned about the present.
        for low in self.lows.iter_mut().flatten() {
            low.above += i64::from(low.age) * stretch - raise;
        }
    }

    /// Keeps the lowest of each block.
    fn keep(&mut self, stamp: Low) {
        let [present, before] = &mut self.lows;
        if self.batches >= BLOCK {
            *before = present.take();
            self.batches = 0;
        }
        self.batches += 1;
        if present.is_none_or(|low| stamp.above < low.above) {
            *present = Some(stamp);
        }
    }
}

/// The nearest microsecond.
pub(super) fn rounded(ticks: i64) -> i64 {
    (ticks + (1 << (TICK_BITS - 1))) >> TICK_BITS
}

fn square(value: f32) -> f32 {
    value * value
}

fn microseconds(fine: i64) -> f32 {
    fine as f32 / FINE_PER_US as f32
}

fn fine(microseconds: f32) -> i64 {
    libm::roundf(microseconds * FINE_PER_US as f32) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bmx055::batch::Die;
    use crate::time::Micros;
    use std::vec::Vec;

    const TICKS_PER_US: f64 = (1 << TICK_BITS) as f64;

    /// A die that tells true time.
    struct Oscillator {
        /// **Units:** microseconds.
        period: f64,
        /// Relative change of the period in a second.
        drift: f64,
        /// Time of the last frame. **Units:** microseconds.
        time: f64,
        sequence: u32,
        random: u32,
    }

    impl Oscillator {
        fn new(period: f64) -> Self {
            Self { period, drift: 0.0, time: 31_234.5, sequence: 0, random: 1 }
        }

        /// Evenly within 0..1.
        fn random(&mut self) -> f64 {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(self.random >> 8) / f64::from(1 << 24)
        }

        fn go_on(&mut self, frames: u32) {
            self.period *= 1.0 + self.drift * self.period * f64::from(frames) * 1e-6;
            self.time += self.period * f64::from(frames);
            self.sequence += frames;
        }

        /// The next batch; its interrupt is late by `late`. **Units:** microseconds.
        fn batch(&mut self, frames: u32, late: f64) -> Batch {
            let sequence = self.sequence;
            self.go_on(frames);
            Batch {
                die: Die::Gyro,
                sequence,
                stamp: Micros((self.time + late).ceil() as i64),
                lost: false,
                temperature: None,
                frames: core::iter::repeat_n([0; 3], frames as usize).collect(),
            }
        }

        /// How far `clock` is off at the last frame of the next batch. **Units:** microseconds.
        fn error(&mut self, clock: &mut Clock, frames: u32, late: f64) -> f64 {
            let batch = self.batch(frames, late);
            self.error_of(clock, &batch)
        }

        fn error_of(&self, clock: &mut Clock, batch: &Batch) -> f64 {
            let times = clock.push(batch).unwrap();
            let last = times.first + (batch.frames.len() as i64 - 1) * times.spacing;
            last as f64 / TICKS_PER_US - self.time
        }
    }

    /// Largest error over `batches` batches of 16 frames whose interrupts are up to 100 us late.
    fn worst(die: &mut Oscillator, clock: &mut Clock, batches: usize) -> f64 {
        (0..batches).fold(0.0, |worst, _| {
            let late = 100.0 * die.random();
            f64::max(worst, die.error(clock, 16, late).abs())
        })
    }

    /// Of the smallest of 64 delays spread over 100 us one in 1e10 is above 30 us.
    const SETTLED_US: f64 = 30.0;

    #[test]
    fn settles_on_any_period_the_data_sheet_allows() {
        for deviation in [-5e-3, -1e-3, 0.0, 2e-3, 5e-3] {
            let mut die = Oscillator::new(500.0 * (1.0 + deviation));
            let mut clock = Clock::new(500);
            // Until then nothing is better known than the lateness of one interrupt.
            let first = worst(&mut die, &mut clock, 32);
            assert!(first < 101.0, "{deviation}: {first}");
            let settled = worst(&mut die, &mut clock, 5_000);
            assert!(settled < SETTLED_US, "{deviation}: {settled}");
            let period = clock.period as f64 / FINE_PER_US as f64;
            // The filter's own standard deviation of the period is 4.5e-6 by then.
            assert!((period / die.period - 1.0).abs() < 2e-5, "{period}");
        }
    }

    #[test]
    fn a_punctual_interrupt_is_followed_to_the_microsecond() {
        let mut die = Oscillator::new(501.3);
        let mut clock = Clock::new(500);
        for _ in 0..200 {
            die.error(&mut clock, 16, 0.0);
        }
        for _ in 0..1_000 {
            let error = die.error(&mut clock, 16, 0.0);
            assert!(error.abs() < 2.0, "{error}");
        }
    }

    #[test]
    fn follows_a_sensor_that_warms_up() {
        for drift in [-1e-5, 1e-5] {
            let mut die = Oscillator::new(501.0);
            let mut clock = Clock::new(500);
            worst(&mut die, &mut clock, 200);
            die.drift = drift;
            let warm = worst(&mut die, &mut clock, 125 * 60);
            assert!(warm < SETTLED_US, "{drift}: {warm}");
        }
    }

    #[test]
    fn half_a_year_later_it_is_as_good() {
        let mut die = Oscillator::new(498.7);
        let mut clock = Clock::new(500);
        die.time += 180.0 * 86_400e6;
        worst(&mut die, &mut clock, 200);
        assert!(worst(&mut die, &mut clock, 2_000) < SETTLED_US);
    }

    #[test]
    fn late_stamps_and_known_gaps_change_nothing() {
        let mut die = Oscillator::new(502.0);
        let mut clock = Clock::new(500);
        worst(&mut die, &mut clock, 200);
        for round in 0..200 {
            // As when an interrupt was missed, at every place within a block.
            let late = 1_500.0 * die.random();
            let error = die.error(&mut clock, 16, late);
            assert!(error.abs() < SETTLED_US, "{round}: {error}");
            die.go_on(3);
            assert!(worst(&mut die, &mut clock, 1 + round % 9) < SETTLED_US);
        }
    }

    #[test]
    fn begins_anew_where_frames_were_lost() {
        let mut die = Oscillator::new(498.0);
        let mut clock = Clock::new(500);
        worst(&mut die, &mut clock, 200);
        die.go_on(50);
        die.sequence -= 49;
        let mut batch = die.batch(16, 80.0);
        batch.lost = true;
        assert!((die.error_of(&mut clock, &batch) - 80.0).abs() < 1.0, "all there is to go by is its stamp");
        // The period is known: no more than the lateness of one interrupt, soon of the smallest of many.
        assert!(worst(&mut die, &mut clock, 10) < 101.0);
        worst(&mut die, &mut clock, 64);
        assert!(worst(&mut die, &mut clock, 2_000) < SETTLED_US);
        // Nobody noticed.
        die.go_on(40);
        die.sequence -= 40;
        worst(&mut die, &mut clock, 256);
        assert!(worst(&mut die, &mut clock, 2_000) < SETTLED_US);
    }

    #[test]
    fn times_move_forward_evenly() {
        let mut die = Oscillator::new(502.5);
        let mut clock = Clock::new(500);
        let mut all = Vec::new();
        for _ in 0..500 {
            let late = 100.0 * die.random();
            let times = clock.push(&die.batch(16, late)).unwrap();
            all.extend((0..16).map(|index| times.first + index * times.spacing));
        }
        // 100 us of correction spread over 16 frames are 6.3 us each, besides the 2.5 us that the first period lacks.
        for pair in all.windows(2) {
            let spacing = (pair[1] - pair[0]) as f64 / TICKS_PER_US;
            assert!((490.0..510.0).contains(&spacing), "{spacing}");
        }
    }
}
