//! A finished step in 40 bytes: what the shoe sends of it to the laptop, and keeps of it (in still less) until it is there.
//!
//! What is lost of the 120 bytes of a [`Step`] is far below what a step knows:
//!
//! | value | unit | range | error at most |
//! |---|---|---|---|
//! | stance | 1 µs | 8.9 years, 71 min long | none |
//! | displacement | 2⁻¹⁴ m = 0.061 mm | ±512 m | 0.031 mm; after 10 000 steps 1.8 mm (standard deviation) |
//! | turn | 2π/65536 = 0.0055° | ±π | 0.0028°; after 10 000 steps 0.16° (standard deviation) |
//! | standard deviations | 8 bits of mantissa | 1e-6 to 4096 | 0.4 % |
//! | correlations | 1/128 | partial ±127/128 | 1/256 of each, unless one is beyond the range |
//!
//! Every rounding is to the nearest and at ties to the even, so it has no bias. A value beyond its range stays at the end
//! of it and marks the step as [`PackedStep::saturated`]; nothing ever wraps.
//!
//! Correlations are kept as canonical partial correlations, each independent of the others: whatever they are, the
//! matrix they stand for is positive definite, so no damage and no rounding can make a covariance that is none.
//! Unpacking, packing and unpacking again gives the same bits.
//!
//! # Source
//! Lewandowski, Kurowicka and Joe, "Generating random correlation matrices based on vines and extended onion method", J.
//! Multivariate Analysis 100, 2009, section 2: partial correlations on a C-vine.

use crate::sample::ClippedSamples;
use crate::step::{FloorMode, Step, StepQuality};
use crate::time::Micros;
use core::f32::consts::PI;
use nalgebra::{Matrix4, Vector3};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// **Units:** 1/m. A power of two: the products are exact.
const PER_METRE: f32 = 16_384.0;
/// The largest displacement in units of 1/[`PER_METRE`], both ways.
const DISPLACEMENT_MAX: f32 = 8_388_607.0;
/// **Units:** 1/rad.
const PER_RADIAN: f32 = 32_768.0 / PI;
/// Partial correlations are multiples of this.
const CORRELATION_UNIT: f32 = 1.0 / 128.0;
/// The largest partial correlation, in units. One step from 1: the conditional variance that is left is far above what
/// single precision would lose.
const CORRELATION_MAX: f32 = 127.0;
/// A standard deviation is the upper half of an `f32` above this, in 12 bits: from 2⁻²⁰ to 2¹².
const SIGMA_BASE: u32 = 107 << 7;
/// Largest code of a standard deviation.
const SIGMA_MAX: u32 = 0xfff;
/// Mark of a saturated step beside its index.
const SATURATED: u32 = 1 << 31;

/// A [`Step`] in 40 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct PackedStep {
    /// 31 bits, and [`SATURATED`].
    pub(super) index: [u8; 4],
    /// **Units:** microseconds since the boot.
    pub(super) stance_end: [u8; 6],
    /// **Units:** microseconds.
    pub(super) stance_duration: [u8; 4],
    pub(super) displacement: [[u8; 3]; 3],
    pub(super) turn: [u8; 2],
    /// Two codes of 12 bits in each.
    pub(super) sigmas: [[u8; 3]; 2],
    /// Row by row of the lower triangle: (y, x), (z, x), (z, y), (turn, x), (turn, y), (turn, z).
    pub(super) correlations: [i8; 6],
    /// Bits 0 and 1 the mode, 2 to 7 the quality.
    pub(super) mode_and_quality: u8,
    pub(super) clipped: [u8; 2],
}

const _: () = assert!(size_of::<PackedStep>() == 40);

impl PackedStep {
    /// Before the first step.
    pub(super) const EMPTY: Self = Self {
        index: [0; 4],
        stance_end: [0; 6],
        stance_duration: [0; 4],
        displacement: [[0; 3]; 3],
        turn: [0; 2],
        sigmas: [[0; 3]; 2],
        correlations: [0; 6],
        mode_and_quality: 0,
        clipped: [0; 2],
    };

    /// The step, rounded. Any step can be packed.
    pub fn pack(step: &Step) -> Self {
        let mut saturated = false;
        let mut clamp = |value: i64, largest: i64| {
            saturated |= !(0..=largest).contains(&value);
            value.clamp(0, largest) as u64
        };
        let end = clamp(step.stance_end.0, (1 << 48) - 1);
        let duration = clamp(step.stance_end - step.stance_start, i64::from(u32::MAX));
        let index = clamp(i64::from(step.index), i64::from(SATURATED - 1)) as u32;

        let mut packed = Self {
            stance_duration: (duration as u32).to_le_bytes(),
            turn: pack_turn(step.turn, &mut saturated).to_le_bytes(),
            mode_and_quality: pack_flags(step.mode, step.quality),
            clipped: [step.clipped.accel, step.clipped.gyro].map(|count| count.min(255) as u8),
            ..Self::EMPTY
        };
        packed.stance_end.copy_from_slice(&end.to_le_bytes()[..6]);
        for (code, value) in packed.displacement.iter_mut().zip(&step.displacement) {
            let units = nearest(value * PER_METRE, DISPLACEMENT_MAX, &mut saturated);
            code.copy_from_slice(&units.to_le_bytes()[..3]);
        }
        let codes: [u32; 4] = core::array::from_fn(|i| pack_variance(step.covariance[(i, i)], &mut saturated));
        packed.sigmas = [[codes[0], codes[1]], [codes[2], codes[3]]].map(|[low, high]| {
            let [a, b, c, _] = (low | high << 12).to_le_bytes();
            [a, b, c]
        });
        packed.correlations = pack_correlations(&step.covariance, &codes);
        packed.index = (index | if saturated { SATURATED } else { 0 }).to_le_bytes();
        packed
    }

    /// The step. Any bytes are one.
    pub fn unpack(&self) -> Step {
        let [a, b, c, d, e, f] = self.stance_end;
        let stance_end = Micros(i64::from_le_bytes([a, b, c, d, e, f, 0, 0]));
        let displacement = self.displacement.map(|[a, b, c]| {
            // Shifted down again, so that the sign is carried along.
            (i32::from_le_bytes([0, a, b, c]) >> 8).max(-(DISPLACEMENT_MAX as i32)) as f32 / PER_METRE
        });
        let turn = match i16::from_le_bytes(self.turn) {
            i16::MIN => PI,
            units => f32::from(units) / PER_RADIAN,
        };
        let (mode, quality) = unpack_flags(self.mode_and_quality);
        let [accel, gyro] = self.clipped.map(u16::from);
        Step {
            index: u32::from_le_bytes(self.index) & !SATURATED,
            stance_start: Micros(stance_end.0 - i64::from(u32::from_le_bytes(self.stance_duration))),
            stance_end,
            displacement: Vector3::from(displacement),
            turn,
            covariance: unpack_covariance(&self.sigmas(), &self.correlations),
            mode,
            quality,
            clipped: ClippedSamples { accel, gyro },
        }
    }

    /// Whether a value of the step was beyond its range or no number.
    pub fn saturated(&self) -> bool {
        u32::from_le_bytes(self.index) & SATURATED != 0
    }

    fn sigmas(&self) -> [f32; 4] {
        let [low, high] = self.sigmas.map(|[a, b, c]| u32::from_le_bytes([a, b, c, 0]));
        [low & SIGMA_MAX, low >> 12, high & SIGMA_MAX, high >> 12].map(unpack_sigma)
    }
}

/// The nearest integer within `±largest`; 0 for what is no number.
fn nearest(value: f32, largest: f32, saturated: &mut bool) -> i32 {
    let rounded = libm::rintf(value);
    *saturated |= rounded.is_nan() || libm::fabsf(rounded) > largest;
    // NaN becomes 0.
    rounded.clamp(-largest, largest) as i32
}

/// In units of 2π/65536. -π and π are the same turn; it is unpacked as π.
fn pack_turn(turn: f32, saturated: &mut bool) -> i16 {
    let units = nearest(turn * PER_RADIAN, 32_768.0, saturated);
    i16::try_from(units).unwrap_or(i16::MIN)
}

fn pack_flags(mode: FloorMode, quality: StepQuality) -> u8 {
    let StepQuality { accel_clipped, gyro_clipped, gap, long_swing, weak_stance, repaired } = quality;
    let flags = [repaired, weak_stance, long_swing, gap, gyro_clipped, accel_clipped];
    let mode = match mode {
        FloorMode::Level => 0,
        FloorMode::Stairs => 1,
        FloorMode::Elevator => 2,
    };
    flags.iter().fold(0, |bits, &flag| bits << 1 | u8::from(flag)) << 2 | mode
}

fn unpack_flags(bits: u8) -> (FloorMode, StepQuality) {
    let mode = match bits & 3 {
        0 => FloorMode::Level,
        2 => FloorMode::Elevator,
        // Where nothing is known, the height is free.
        _ => FloorMode::Stairs,
    };
    let flag = |bit: u8| bits >> bit & 1 == 1;
    let quality = StepQuality {
        accel_clipped: flag(2),
        gyro_clipped: flag(3),
        gap: flag(4),
        long_swing: flag(5),
        weak_stance: flag(6),
        repaired: flag(7),
    };
    (mode, quality)
}

/// Code of the square root. 0 is exactly 0; what is smaller than the range is not taken for it.
fn pack_variance(variance: f32, saturated: &mut bool) -> u32 {
    if variance == 0.0 {
        return 0;
    }
    let bits = libm::sqrtf(variance).to_bits();
    // To the nearest upper half, at ties to the even one.
    let upper = (u64::from(bits) + 0x7fff + u64::from(bits >> 16 & 1)) >> 16;
    // Infinity, and the root of a negative variance, which is no number, have the largest exponent and so lie above.
    let code = (upper as u32).saturating_sub(SIGMA_BASE);
    *saturated |= code > SIGMA_MAX;
    code.clamp(1, SIGMA_MAX)
}

fn unpack_sigma(code: u32) -> f32 {
    if code == 0 { 0.0 } else { f32::from_bits((SIGMA_BASE + code) << 16) }
}

/// One row of the Cholesky factor of a correlation matrix, from its partial correlations.
struct Row {
    factor: [f32; 4],
    /// Square root of what the correlations so far leave of the variance.
    rest: f32,
}

impl Row {
    const EMPTY: Self = Self { factor: [0.0; 4], rest: 1.0 };

    /// Takes the partial correlation with variable `column`, in units.
    fn push(&mut self, column: usize, code: i8) {
        let partial = f32::from(code.max(-(CORRELATION_MAX as i8))) * CORRELATION_UNIT;
        self.factor[column] = partial * self.rest;
        self.rest *= libm::sqrtf(1.0 - partial * partial);
    }

    /// Ends the row with its diagonal.
    fn close(&mut self, row: usize) {
        self.factor[row] = self.rest;
    }

    /// Sum over the first `columns` products with another row.
    fn product(&self, other: &Self, columns: usize) -> f32 {
        self.factor.iter().zip(&other.factor).take(columns).fold(0.0, |sum, (a, b)| sum + a * b)
    }
}

/// Each code is found with the rounded ones before it, so that roundings do not add up.
fn pack_correlations(covariance: &Matrix4<f32>, sigma_codes: &[u32; 4]) -> [i8; 6] {
    // Not the rounded standard deviations: with them, correlations near 1 might end beyond it.
    let sigmas: [f32; 4] = core::array::from_fn(|i| libm::sqrtf(covariance[(i, i)]));
    let known = |i: usize| sigma_codes[i] != 0 && sigmas[i].is_finite();
    let mut codes = [0; 6];
    let mut code = codes.iter_mut();
    let mut rows = [Row::EMPTY; 4];
    for i in 0..4 {
        let (before, row) = rows.split_at_mut(i);
        for (j, other) in before.iter().enumerate() {
            let correlation = covariance[(i, j)] / (sigmas[i] * sigmas[j]);
            let partial = (correlation - row[0].product(other, j)) / (other.factor[j] * row[0].rest);
            let units = libm::rintf(partial / CORRELATION_UNIT).clamp(-CORRELATION_MAX, CORRELATION_MAX) as i8;
            // Of a variable without variance, and of what is no number, there is no correlation.
            let units = if known(i) && known(j) { units } else { 0 };
            row[0].push(j, units);
            if let Some(code) = code.next() {
                *code = units;
            }
        }
        row[0].close(i);
    }
    codes
}

fn unpack_covariance(sigmas: &[f32; 4], codes: &[i8; 6]) -> Matrix4<f32> {
    let mut code = codes.iter();
    let mut rows = [Row::EMPTY; 4];
    let mut covariance = Matrix4::zeros();
    for i in 0..4 {
        let (before, row) = rows.split_at_mut(i);
        for (j, other) in before.iter().enumerate() {
            let known = sigmas[i] > 0.0 && sigmas[j] > 0.0;
            let code = code.next().copied().filter(|_| known).unwrap_or(0);
            row[0].push(j, code);
            let value = row[0].product(other, j + 1) * (sigmas[i] * sigmas[j]);
            covariance[(i, j)] = value;
            covariance[(j, i)] = value;
        }
        row[0].close(i);
        covariance[(i, i)] = sigmas[i] * sigmas[i];
    }
    covariance
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::*;
    use proptest::prelude::*;

    /// Any bytes.
    fn bytes() -> impl Strategy<Value = PackedStep> {
        proptest::collection::vec(prop_oneof![Just(0_u8), Just(0x80), Just(0xff), any::<u8>()], 40)
            .prop_map(|bytes| postcard::from_bytes(&bytes).unwrap())
    }

    /// Steps as a tracker makes them, and larger ones. The covariance is that of a random factor.
    fn steps() -> impl Strategy<Value = Step> {
        let factor = proptest::array::uniform16(-1.0_f32..1.0);
        let size = proptest::array::uniform4(-4.0_f32..1.0);
        let moved = (proptest::array::uniform3(-500.0_f32..500.0), -PI..PI);
        let time = (0..1_i64 << 47, 0..1_i64 << 32);
        (any::<u32>(), time, moved, factor, size, any::<(u8, u16, u16)>()).prop_map(
            |(index, (start, long), (displacement, turn), factor, size, (flags, accel, gyro))| {
                let factor = Matrix4::from_row_slice(&factor);
                let scale = Matrix4::from_diagonal(&size.map(libm::exp10f).into());
                let (mode, quality) = unpack_flags(flags);
                Step {
                    index: index & !SATURATED,
                    stance_start: Micros(start),
                    stance_end: Micros(start + long),
                    displacement: displacement.into(),
                    turn,
                    covariance: scale * (factor * factor.transpose() + Matrix4::identity() * 0.1) * scale,
                    mode,
                    quality,
                    clipped: ClippedSamples { accel, gyro },
                }
            },
        )
    }

    fn correlation(covariance: &Matrix4<f32>, i: usize, j: usize) -> f32 {
        covariance[(i, j)] / libm::sqrtf(covariance[(i, i)] * covariance[(j, j)])
    }

    #[test]
    fn a_step_comes_back() {
        let step = golden::step();
        let packed = PackedStep::pack(&step);
        let back = packed.unpack();
        assert!(!packed.saturated());
        let whole = (back.index, back.stance_start, back.stance_end, back.mode, back.quality, back.clipped);
        assert_eq!(whole, (step.index, step.stance_start, step.stance_end, step.mode, step.quality, step.clipped));
        assert!((back.displacement - step.displacement).amax() <= 0.5 / PER_METRE);
        // A standard deviation is wrong by half a unit of 1/128, a product of two by a unit, and a correlation by half
        // a unit of 1/128.
        assert!((back.covariance - step.covariance).amax() < 9e-5 / 100.0);
    }

    #[test]
    fn the_first_step_has_no_covariance_and_keeps_none() {
        let step = Step { covariance: Matrix4::zeros(), displacement: Vector3::zeros(), turn: 0.0, ..golden::step() };
        assert_eq!(PackedStep::pack(&step).unpack(), step);
    }

    #[test]
    fn what_does_not_fit_saturates_and_tells() {
        type Case = (&'static str, fn(&mut Step), fn(&Step) -> bool);
        let cases: [Case; 11] = [
            ("index", |step| step.index = u32::MAX, |step| step.index == SATURATED - 1),
            ("before the boot", |step| step.stance_end = Micros(-1), |step| step.stance_end == Micros(0)),
            ("late", |step| step.stance_end = Micros(i64::MAX), |step| step.stance_end == Micros((1 << 48) - 1)),
            ("backwards", |step| step.stance_start = step.stance_end + 1, |step| step.stance_start == step.stance_end),
            (
                "long",
                |step| step.stance_start = Micros(i64::MIN),
                |step| step.stance_end - step.stance_start == i64::from(u32::MAX),
            ),
            ("far", |step| step.displacement.y = -513.0, |step| step.displacement.y == -DISPLACEMENT_MAX / PER_METRE),
            ("no number", |step| step.displacement.z = f32::NAN, |step| step.displacement.z == 0.0),
            ("turn", |step| step.turn = f32::INFINITY, |step| step.turn == PI),
            ("variance", |step| step.covariance[(2, 2)] = f32::NAN, |step| step.covariance[(2, 2)] > 1e7),
            ("negative", |step| step.covariance[(0, 0)] = -1.0, |step| step.covariance[(0, 0)] > 1e7),
            ("infinite", |step| step.covariance[(3, 3)] = f32::INFINITY, |step| step.covariance[(3, 3)] > 1e7),
        ];
        for (name, change, expected) in cases {
            let mut step = golden::step();
            change(&mut step);
            let packed = PackedStep::pack(&step);
            assert!(packed.saturated() && expected(&packed.unpack()), "{name}: {:?}", packed.unpack());
            assert!(packed.unpack().covariance.cholesky().is_some(), "{name}");
        }
        let often = Step { clipped: ClippedSamples { accel: 256, gyro: u16::MAX }, ..golden::step() };
        assert_eq!(PackedStep::pack(&often).unpack().clipped, ClippedSamples { accel: 255, gyro: 255 });
    }

    #[test]
    fn roundings_have_no_bias() {
        let (mut displacement, mut turn, mut sigma) = (0.0_f64, 0.0_f64, 0.0_f64);
        let count = 20_000;
        for i in 0..count {
            let value = 1.0 + i as f32 * 1.7e-5;
            let mut step = golden::step();
            step.displacement.x = value;
            step.turn = value;
            step.covariance[(0, 0)] = value * value;
            let back = PackedStep::pack(&step).unpack();
            displacement += f64::from(back.displacement.x - value);
            turn += f64::from(back.turn - value);
            sigma += f64::from(libm::sqrtf(back.covariance[(0, 0)]) - value);
        }
        // The standard deviation of a mean of that many roundings is 0.29/141 = 0.2 % of a unit; the values run through
        // the units evenly, so it is smaller still. A unit of the third is 1/128.
        let count = f64::from(count);
        assert!((displacement / count * f64::from(PER_METRE)).abs() < 0.01);
        assert!((turn / count * f64::from(PER_RADIAN)).abs() < 0.01);
        assert!((sigma / count * 128.0).abs() < 0.01);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn any_bytes_are_a_step_that_packs_to_itself(packed in bytes()) {
            let step = packed.unpack();
            let again = PackedStep::pack(&step).unpack();
            prop_assert_eq!(step, again);
            prop_assert!(step.covariance.iter().zip(&again.covariance).all(|(a, b)| a.to_bits() == b.to_bits()));
            prop_assert!(step.turn.abs() <= PI && step.displacement.amax() <= 512.0);
        }

        #[test]
        fn any_bytes_are_a_covariance(packed in bytes()) {
            let covariance = packed.unpack().covariance;
            let known = [0, 1, 2, 3].map(|i| covariance[(i, i)] > 0.0);
            let correlations = Matrix4::from_fn(|i, j| match (i == j, known[i] && known[j]) {
                (true, _) => 1.0,
                (false, true) => correlation(&covariance, i, j),
                (false, false) => 0.0,
            });
            prop_assert!(correlations.cholesky().is_some());
            prop_assert!((0..4).all(|i| known[i] || covariance.row(i).iter().all(|&value| value == 0.0)));
        }

        #[test]
        fn errors_are_bounded(step in steps()) {
            let packed = PackedStep::pack(&step);
            let back = packed.unpack();
            prop_assert!(!packed.saturated());
            prop_assert_eq!((back.index, back.stance_start, back.stance_end), (step.index, step.stance_start, step.stance_end));
            prop_assert!((back.displacement - step.displacement).amax() <= 0.5 / PER_METRE + 1e-9);
            // -π and π are the same turn.
            let off = (back.turn - step.turn).abs();
            prop_assert!(off.min(2.0 * PI - off) <= 0.5 / PER_RADIAN + 1e-6);
            let beyond = packed.correlations.iter().any(|code| code.abs() == 127);
            for i in 0..4 {
                let ratio = back.covariance[(i, i)] / step.covariance[(i, i)];
                // Twice the relative error of a standard deviation, which is half a unit of 1/128.
                prop_assert!((ratio - 1.0).abs() < 1.0 / 127.0, "{ratio}");
                for j in 0..i {
                    let before = correlation(&step.covariance, i, j);
                    let error = correlation(&back.covariance, i, j) - before;
                    // Half a unit, and single precision. Near the edge of what a covariance can be, where one is cut,
                    // nothing is promised but a covariance.
                    let limit = 0.5 / 128.0 + 1e-5;
                    prop_assert!(beyond || error.abs() < limit, "({i}, {j}): {before} wrong by {error}");
                }
            }
        }
    }
}
