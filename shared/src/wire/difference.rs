//! A step as what is new in it: its difference to the step before, in as few bits as steps usually need.
//!
//! A [`PackedStep`] has 320 bits. Of those of a walker who goes on as before about 130 are news: the covariance hardly
//! changes from step to step, a stride is nearly as long as the last one, and nothing is clipped. What is unusual takes more
//! bits and is told as exactly: **any** step comes back bit for bit, after any other.
//!
//! Each number of the step is guessed from the step before. The residual, modulo the width of the number, is written as an
//! exponential Golomb code, whose length grows with the logarithm of the residual. The orders in [`FIELDS`] are those that
//! need the fewest bits for recorded and simulated walks, in all gaits together.
//!
//! # Source
//! Teuhola, "A compression method for clustered bit-vectors", Information Processing Letters 7, 1978: the code.

use super::packed::PackedStep;

/// Numbers of a step.
const NUMBERS: usize = 20;

/// How a number is written.
struct Field {
    /// **Units:** bits.
    width: u32,
    /// Order of the code: residuals below 2^order take order + 1 bits.
    order: u32,
}

const fn field(width: u32, order: u32) -> Field {
    Field { width, order }
}

/// Index, swing, stance; displacement; turn; standard deviations; correlations; flags; clipped samples.
const FIELDS: [Field; NUMBERS] = [
    field(32, 0),
    field(48, 16),
    field(32, 16),
    field(24, 10),
    field(24, 11),
    field(24, 4),
    field(16, 10),
    field(12, 4),
    field(12, 4),
    field(12, 4),
    field(12, 4),
    field(8, 1),
    field(8, 1),
    field(8, 1),
    field(8, 1),
    field(8, 2),
    field(8, 0),
    field(8, 0),
    field(8, 0),
    field(8, 0),
];

/// No step takes more. **Units:** bits.
pub(super) const LONGEST: u32 = {
    let (mut sum, mut at) = (0, 0);
    while at < NUMBERS {
        let Field { width, order } = FIELDS[at];
        sum += code_length((1 << width) - 1, order);
        at += 1;
    }
    sum
};

/// **Units:** bits.
const fn code_length(residual: u64, order: u32) -> u32 {
    let digits = u64::BITS - (residual + (1 << order)).leading_zeros();
    2 * digits - 1 - order
}

/// Where bits are put.
pub(super) trait Sink {
    /// Puts the lowest `count` bits of `bits`, the highest of them first. What lies above them is zero.
    fn put(&mut self, bits: u64, count: u32);
}

/// Where they come from.
pub(super) trait Source {
    /// The next `count` bits.
    fn take(&mut self, count: u32) -> u64;
}

/// The step before, as far as it tells of the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    step: PackedStep,
    /// From the stance before it to its own, 48 bits. **Units:** microseconds.
    swing: u64,
}

impl Before {
    /// Before the first step.
    pub(super) const NOTHING: Self = Self { step: PackedStep::EMPTY, swing: 0 };

    /// Bits that the step takes.
    pub(super) fn length(&self, step: &PackedStep) -> u32 {
        self.residuals(step).zip(&FIELDS).map(|(residual, field)| code_length(residual, field.order)).sum()
    }

    /// Tells of the step.
    pub(super) fn write(&self, step: &PackedStep, sink: &mut impl Sink) {
        for (residual, field) in self.residuals(step).zip(&FIELDS) {
            let code = residual + (1 << field.order);
            let digits = u64::BITS - code.leading_zeros();
            sink.put(0, digits - 1 - field.order);
            sink.put(code, digits);
        }
    }

    /// The step that was told of.
    pub(super) fn read(&self, source: &mut impl Source) -> PackedStep {
        let mut numbers = self.guess();
        for (number, field) in numbers.iter_mut().zip(&FIELDS) {
            // No code has more digits than the number and one.
            let mut digits = field.order + 1;
            while digits <= field.width + 1 && source.take(1) == 0 {
                digits += 1;
            }
            let code = 1 << (digits - 1) | source.take(digits - 1);
            let residual = code - (1 << field.order);
            *number = number.wrapping_add(residual >> 1 ^ (residual & 1).wrapping_neg()) & mask(field.width);
        }
        PackedStep::of_numbers(numbers, self.step.end())
    }

    /// What comes after this and that step.
    pub(super) fn then(&self, step: &PackedStep) -> Self {
        Self { step: *step, swing: step.numbers(self.step.end())[1] }
    }

    /// The numbers of the next step if nothing new happened.
    fn guess(&self) -> [u64; NUMBERS] {
        let mut numbers = self.step.numbers(0);
        numbers[0] = numbers[0].wrapping_add(1);
        numbers[1] = self.swing;
        // A turn is as likely the other way.
        numbers[6] = 0;
        numbers
    }

    /// Differences to the guess: 0, -1, 1, -2, 2 and so on have the numbers 0, 1, 2, 3, 4.
    fn residuals(&self, step: &PackedStep) -> impl Iterator<Item = u64> {
        let numbers = step.numbers(self.step.end());
        numbers.into_iter().zip(self.guess()).zip(&FIELDS).map(|((number, guess), field)| {
            let unused = u64::BITS - field.width;
            let difference = (number.wrapping_sub(guess) << unused) as i64 >> unused;
            (difference << 1 ^ difference >> 63) as u64
        })
    }
}

const fn mask(width: u32) -> u64 {
    (1 << width) - 1
}

/// Little-endian.
fn number<const N: usize>(bytes: [u8; N]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}

fn bytes<const N: usize>(number: u64) -> [u8; N] {
    core::array::from_fn(|at| (number >> (8 * at)) as u8)
}

impl PackedStep {
    fn end(&self) -> u64 {
        number(self.stance_end)
    }

    /// The step as numbers, after a stance that ended at `before`.
    fn numbers(&self, before: u64) -> [u64; NUMBERS] {
        let duration = number(self.stance_duration);
        let swing = self.end().wrapping_sub(duration).wrapping_sub(before) & mask(48);
        let [x, y, z] = self.displacement.map(number);
        let [low, high] = self.sigmas.map(number);
        let [a, b, c, d, e, f] = self.correlations.map(|code| u64::from(code as u8));
        let [accel, gyro] = self.clipped.map(u64::from);
        let [s, t, u, v] = [low & mask(12), low >> 12, high & mask(12), high >> 12];
        let (turn, flags) = (number(self.turn), u64::from(self.mode_and_quality));
        [number(self.index), swing, duration, x, y, z, turn, s, t, u, v, a, b, c, d, e, f, flags, accel, gyro]
    }

    fn of_numbers(numbers: [u64; NUMBERS], before: u64) -> Self {
        let [index, swing, duration, x, y, z, turn, s, t, u, v, a, b, c, d, e, f, flags, accel, gyro] = numbers;
        Self {
            index: bytes(index),
            stance_end: bytes(before.wrapping_add(swing).wrapping_add(duration)),
            stance_duration: bytes(duration),
            displacement: [x, y, z].map(bytes),
            turn: bytes(turn),
            sigmas: [s | t << 12, u | v << 12].map(bytes),
            correlations: [a, b, c, d, e, f].map(|code| code as i8),
            mode_and_quality: flags as u8,
            clipped: [accel, gyro].map(|count| count as u8),
        }
    }
}
