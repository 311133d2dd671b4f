//! A walk made of polynomials, and the fingerprint of what a tracker makes of it.
//!
//! The same walk runs on a PC and on the microcontroller; equal fingerprints prove that both compute the same bits. It is
//! no measure of accuracy: its foot moves more smoothly than any foot does.
//!
//! Everything comes from integers, polynomials and [`so3`]; nothing is stored but a table of strides.

use crate::bmx055::{BATCH_FRAMES, Batch, Config, Die};
use crate::sample::{ImuSample, STANDARD_GRAVITY_M_S2};
use crate::so3;
use crate::step::Step;
use crate::time::Micros;
use crate::tracker::{Output, Parameters, Tracker};
use core::fmt;
use nalgebra::{UnitQuaternion, Vector3};

/// Runs what callgrind is to count: it is told the name of this function (`cargo xtask bench`).
#[inline(never)]
pub fn counted<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// A stance and the swing after it.
struct Stride {
    /// **Units:** microseconds.
    stance_us: i64,
    /// **Units:** microseconds.
    swing_us: i64,
    /// Along the heading at the start of the stride. **Units:** m.
    length: f32,
    /// Change of height. **Units:** m.
    climb: f32,
    /// Change of heading. **Units:** rad.
    turn: f32,
    /// Largest pitch of the foot during the swing. **Units:** rad.
    pitch: f32,
    /// Largest pitch of the foot while it stands: a running foot is never quite at rest. **Units:** rad.
    rock: f32,
}

/// One gait: how often, and its stride.
type Gait = (usize, Stride);

/// Stands, walks around a corner, climbs, turns about, runs, stands.
const ROUTE: [Gait; 6] = [
    (1, stride(3_000_000, 650_000, 1.35, 0.0, 0.0, 0.8, 0.0)),
    (8, stride(450_000, 650_000, 1.35, 0.0, 0.2, 0.8, 0.0)),
    (5, stride(600_000, 700_000, 0.58, 0.34, 0.0, 0.4, 0.0)),
    (4, stride(500_000, 650_000, 0.90, 0.0, -0.8, 0.6, 0.0)),
    (8, stride(220_000, 500_000, 2.20, 0.0, 0.0, 1.1, 0.02)),
    (1, stride(1_500_000, 800_000, 0.50, 0.0, 0.0, 0.5, 0.0)),
];

/// How long the foot stands at the end. **Units:** microseconds.
const LAST_STANCE_US: i64 = 1_500_000;

/// How high the foot is lifted above the straight way of a swing. **Units:** m.
const LIFT: f32 = 0.12;

/// The samplings at which fingerprints are compared: 200 Hz and 2 kHz. **Units:** microseconds.
pub const PERIODS_US: [u32; 2] = [5_000, 500];

/// How the sensor sits on the shoe: no axis is along anything. Rotation vector. **Units:** rad.
const MOUNTING: [f32; 3] = [0.9, -0.4, 0.3];

/// **Units:** rad/s; **Frame:** sensor.
const GYRO_BIAS: [f32; 3] = [0.004, -0.003, 0.002];

/// Largest deviations by noise. **Units:** m/s² and rad/s.
const NOISE: (f32, f32) = (0.05, 0.005);

const fn stride(stance_us: i64, swing_us: i64, length: f32, climb: f32, turn: f32, pitch: f32, rock: f32) -> Stride {
    Stride { stance_us, swing_us, length, climb, turn, pitch, rock }
}

/// Strides of the walk.
pub const STRIDES: usize = {
    let mut sum = 0;
    let mut gait = 0;
    while gait < ROUTE.len() {
        sum += ROUTE[gait].0;
        gait += 1;
    }
    sum
};

/// The samples of the walk.
pub struct Walk {
    /// **Units:** microseconds.
    period_us: i64,
    time: Micros,
    /// Index in [`ROUTE`]; its length stands for the last stance.
    gait: usize,
    /// Strides of this gait done.
    done: usize,
    /// When the present stride began.
    begun: Micros,
    mounting: UnitQuaternion<f32>,
    noise: Noise,
}

/// The walk as both FIFOs of a [BMX055](crate::bmx055) give it at 2 kHz, 16 frames at a time, its clocks without fault.
pub struct Batches {
    walk: Walk,
    config: Config,
    sequence: u32,
    /// The gyroscope's batch that comes next.
    waiting: Option<Batch>,
}

impl Batches {
    /// From the start of the walk, with the default setting of the sensor.
    pub fn new() -> Self {
        Self { walk: Walk::new(500), config: Config::default(), sequence: 0, waiting: None }
    }
}

impl Default for Batches {
    fn default() -> Self {
        Self::new()
    }
}

impl Iterator for Batches {
    type Item = Batch;

    fn next(&mut self) -> Option<Batch> {
        if let Some(gyro) = self.waiting.take() {
            return Some(gyro);
        }
        let counts = |value: Vector3<f32>, scale: f32| value.map(|value| libm::roundf(value / scale) as i16).into();
        let empty = |die, temperature| Batch {
            die,
            sequence: self.sequence,
            stamp: Micros(0),
            lost: false,
            temperature,
            frames: heapless::Vec::new(),
        };
        // 25 °C, as far as only the accelerometer knows.
        let (mut accel, mut gyro) = (empty(Die::Accel, Some(4)), empty(Die::Gyro, None));
        for sample in self.walk.by_ref().take(BATCH_FRAMES / 2) {
            // Half of what a batch holds.
            let _ = accel.frames.push(counts(sample.accel.0, self.config.accel.scale()));
            let _ = gyro.frames.push(counts(sample.gyro.0, self.config.gyro.scale()));
            (accel.stamp, gyro.stamp) = (sample.time, sample.time);
        }
        self.sequence += accel.frames.len() as u32;
        self.waiting = Some(gyro).filter(|gyro| !gyro.frames.is_empty());
        Some(accel).filter(|accel| !accel.frames.is_empty())
    }
}

/// Motion of the foot at a moment.
struct Motion {
    /// **Units:** m/s²; **Frame:** x along the heading at the start of the stride, z up.
    acceleration: Vector3<f32>,
    /// Change of heading since the stride began. **Units:** rad and rad/s.
    yaw: (f32, f32),
    /// Nose down. **Units:** rad and rad/s.
    pitch: (f32, f32),
}

impl Walk {
    /// The walk as a sensor takes it every `period_us` microseconds; at least one.
    pub fn new(period_us: u32) -> Self {
        Self {
            period_us: i64::from(period_us.max(1)),
            time: Micros(0),
            gait: 0,
            done: 0,
            begun: Micros(0),
            mounting: so3::exp(&MOUNTING.into()),
            noise: Noise(1),
        }
    }

    /// The motion now; `None` when the walk is over.
    fn motion(&mut self) -> Option<Motion> {
        loop {
            let since = self.time - self.begun;
            let Some((count, stride)) = ROUTE.get(self.gait) else {
                return (since < LAST_STANCE_US).then_some(Motion::REST);
            };
            if since < stride.stance_us {
                return Some(Motion::standing(stride, since));
            }
            if since < stride.stance_us + stride.swing_us {
                return Some(Motion::swinging(stride, since - stride.stance_us));
            }
            self.begun = self.begun + (stride.stance_us + stride.swing_us);
            self.done += 1;
            if self.done == *count {
                self.gait += 1;
                self.done = 0;
            }
        }
    }
}

impl Iterator for Walk {
    type Item = ImuSample;

    fn next(&mut self) -> Option<ImuSample> {
        let motion = self.motion()?;
        let pitched = so3::exp(&Vector3::new(0.0, motion.pitch.0, 0.0)) * self.mounting;
        let force = motion.acceleration + Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2);
        let force = so3::rotation_about_z(motion.yaw.0).inverse_transform_vector(&force);
        let rate = pitched.inverse_transform_vector(&Vector3::new(0.0, motion.pitch.1, motion.yaw.1));
        let accel = pitched.inverse_transform_vector(&force) + self.noise.vector(NOISE.0);
        let gyro = rate + Vector3::from(GYRO_BIAS) + self.noise.vector(NOISE.1);
        let sample = ImuSample::new(self.time, accel.into(), gyro.into());
        self.time = self.time + self.period_us;
        Some(sample)
    }
}

impl Motion {
    const REST: Self = Self { acceleration: Vector3::new(0.0, 0.0, 0.0), yaw: (0.0, 0.0), pitch: (0.0, 0.0) };

    /// At rest but for the rocking, `since` microseconds after touching the ground.
    fn standing(stride: &Stride, since: i64) -> Self {
        let (_, w, slope, rate) = phase(since, stride.stance_us);
        // 16 w^2 goes from 0 to 1 and back with no jump in its rate.
        Self { pitch: (stride.rock * 16.0 * w * w, stride.rock * 32.0 * w * slope * rate), ..Self::REST }
    }

    /// In the air, `since` microseconds after leaving the ground.
    fn swinging(stride: &Stride, since: i64) -> Self {
        let (u, w, slope, rate) = phase(since, stride.swing_us);
        // Minimum jerk: 10 u^3 - 15 u^4 + 6 u^5, its first and second derivative.
        let way = u * u * u * (10.0 - u * (15.0 - 6.0 * u));
        let way_rate = 30.0 * w * w * rate;
        let way_acceleration = 60.0 * w * slope * rate * rate;
        // 64 w^3, second derivative.
        let lift_acceleration = 384.0 * w * (slope * slope - w) * rate * rate;
        // 269 w^3 (1 - 2 u): heel up first, toe up before landing, largest value 1.
        let pitch = 269.0 * w * w * w * slope;
        let pitch_rate = 269.0 * w * w * (3.0 * slope * slope - 2.0 * w) * rate;
        let vertical = stride.climb * way_acceleration + LIFT * lift_acceleration;
        Self {
            acceleration: Vector3::new(stride.length * way_acceleration, 0.0, vertical),
            yaw: (stride.turn * way, stride.turn * way_rate),
            pitch: (stride.pitch * pitch, stride.pitch * pitch_rate),
        }
    }
}

/// For the phase `u` in 0..1: `u`, `u (1 - u)`, its slope `1 - 2 u`, and `du/dt` in 1/s.
fn phase(since: i64, duration: i64) -> (f32, f32, f32, f32) {
    let u = since as f32 / duration as f32;
    (u, u * (1.0 - u), 1.0 - 2.0 * u, 1e6 / duration as f32)
}

/// Linear congruential numbers (Numerical Recipes, "quick and dirty").
struct Noise(u32);

impl Noise {
    /// Evenly within -1..1.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 8_388_608.0 - 1.0
    }

    fn vector(&mut self, largest: f32) -> Vector3<f32> {
        Vector3::new(self.next(), self.next(), self.next()) * largest
    }
}

/// A hash of bits: FNV-1a over 32-bit words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fingerprint(pub u64);

impl Fingerprint {
    /// Of nothing.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3);
    }

    fn wide(&mut self, word: u64) {
        self.word(word as u32);
        self.word((word >> 32) as u32);
    }

    fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f32>) {
        for number in numbers {
            self.word(number.to_bits());
        }
    }

    fn step(&mut self, step: &Step) {
        self.word(step.index);
        self.wide(step.stance_start.0 as u64);
        self.wide(step.stance_end.0 as u64);
        self.numbers(step.displacement.iter().chain([&step.turn]).chain(step.covariance.iter()));
        self.word(step.mode as u32);
        let quality = &step.quality;
        let flags = [
            quality.accel_clipped,
            quality.gyro_clipped,
            quality.gap,
            quality.long_swing,
            quality.weak_stance,
            quality.repaired,
        ];
        self.word(flags.iter().fold(0, |bits, &flag| bits << 1 | u32::from(flag)));
        self.word(u32::from(step.clipped.accel) << 16 | u32::from(step.clipped.gyro));
    }
}

/// What a tracker made of the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// Over every state, stance, position and step.
    pub fingerprint: Fingerprint,
    /// Samples of the walk.
    pub samples: u32,
    /// Samples at which the foot stood.
    pub standing: u32,
    /// Steps, the start included.
    pub steps: u32,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { fingerprint, samples, standing, steps } = self;
        write!(f, "{:016x} samples {samples} standing {standing} steps {steps}", fingerprint.0)
    }
}

/// Feeds the walk, sampled every `period_us` microseconds, through a tracker. `push` hands a sample to the tracker; it is
/// a parameter so that whoever counts instructions can do it there.
pub fn track(
    period_us: u32,
    parameters: &Parameters,
    mut push: impl FnMut(&mut Tracker, &ImuSample) -> Output,
) -> Report {
    let mut tracker = Tracker::new(parameters);
    let mut report = Report { fingerprint: Fingerprint::EMPTY, samples: 0, standing: 0, steps: 0 };
    for sample in Walk::new(period_us) {
        let output = push(&mut tracker, &sample);
        report.samples += 1;
        report.standing += u32::from(output.stance);
        report.fingerprint.word(output.state as u32 * 2 + u32::from(output.stance));
        for coordinate in &tracker.displacement() {
            report.fingerprint.word(coordinate.to_bits());
        }
        report.take(output.step);
    }
    report.take(tracker.finish());
    report
}

impl Report {
    fn take(&mut self, step: Option<Step>) {
        if let Some(step) = step {
            self.steps += 1;
            self.fingerprint.step(&step);
        }
    }
}

/// Of rotations by vectors of all lengths, and of what comes back.
pub fn rotations() -> Fingerprint {
    let mut fingerprint = Fingerprint::EMPTY;
    let mut noise = Noise(7);
    let mut attitude = UnitQuaternion::identity();
    for index in 0..2_000_u32 {
        // From 1e-3 rad to well above pi.
        let largest = 1e-3 * (1 + index % 100 * 50) as f32;
        attitude = so3::box_plus(&attitude, &noise.vector(largest));
        fingerprint.numbers(attitude.coords.iter());
        fingerprint.numbers(so3::log(&attitude).iter());
        let level = so3::level(&noise.vector(10.0));
        fingerprint.numbers(level.coords.iter());
        fingerprint.numbers(&[so3::turn(&level, &attitude)]);
    }
    fingerprint
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strapdown integration by the trapezoidal rule from rest at the origin, up to `end`.
    fn integrated(end: Micros) -> Vector3<f32> {
        let period = 1_000;
        let dt = period as f32 * 1e-6;
        let mut attitude = so3::exp(&MOUNTING.into());
        let (mut velocity, mut position) = (Vector3::zeros(), Vector3::zeros());
        for sample in Walk::new(period).take_while(|sample| sample.time < end) {
            let middle = so3::box_plus(&attitude, &((sample.gyro.0 - Vector3::from(GYRO_BIAS)) * (0.5 * dt)));
            let mut acceleration = middle * sample.accel.0;
            acceleration.z -= STANDARD_GRAVITY_M_S2;
            position += (velocity + acceleration * (0.5 * dt)) * dt;
            velocity += acceleration * dt;
            attitude = so3::box_plus(&attitude, &((sample.gyro.0 - Vector3::from(GYRO_BIAS)) * dt));
        }
        position
    }

    #[test]
    fn the_first_stride_carries_as_far_as_planned() {
        let first = &ROUTE[0].1;
        let end = Micros(first.stance_us + first.swing_us);
        // Noise of 0.005 rad/s at 1 kHz tilts by 3e-4 rad in 4 s, which is worth 2 cm; half a period of drift less.
        assert!((integrated(end) - Vector3::new(first.length, 0.0, 0.0)).norm() < 0.05);
    }

    #[test]
    fn the_walk_ends_and_stands_at_both_ends() {
        let period = 5_000;
        let still = |sample: &ImuSample| (sample.gyro.0 - Vector3::from(GYRO_BIAS)).amax() <= NOISE.1;
        assert!(Walk::new(period).take(600).all(|sample| still(&sample)));
        let (mut count, mut at_rest) = (0, 0);
        for sample in Walk::new(period) {
            count += 1;
            at_rest = if still(&sample) { at_rest + 1 } else { 0 };
        }
        assert!(at_rest >= LAST_STANCE_US / i64::from(period), "{at_rest} of {count}");
    }

    #[test]
    fn the_walk_has_the_peaks_of_a_foot() {
        let rate = Walk::new(1_000).map(|sample| sample.gyro.0.norm()).fold(0.0, f32::max);
        let force = Walk::new(1_000).map(|sample| sample.accel.0.norm()).fold(0.0, f32::max);
        // Recorded walks and runs reach 8 to 20 rad/s and, strike excluded, 30 to 80 m/s^2.
        assert!((8.0..20.0).contains(&rate), "{rate}");
        assert!((30.0..80.0).contains(&force), "{force}");
    }

    #[test]
    fn one_bit_changes_the_fingerprint() {
        let mut fingerprints = [Fingerprint::EMPTY; 2];
        fingerprints[0].numbers(&[1.0]);
        fingerprints[1].numbers(&[1.0 + f32::EPSILON]);
        assert_ne!(fingerprints[0], fingerprints[1]);
    }
}
