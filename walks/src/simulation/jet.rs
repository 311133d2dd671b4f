//! Numbers that know how fast they change: a value with its first and second derivative with respect to time.
//!
//! The simulated foot is written down as a formula for its position. Evaluated on [`Jet`]s, the formula yields velocity
//! and acceleration as well, exact to rounding, so that the simulated sensor and the truth cannot disagree.

use std::ops::{Add, Mul, Neg, Sub};

/// A value and its first two derivatives with respect to time. **Units:** x, x/s, x/s² for a value in x.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// Its first derivative.
    pub rate: f64,
    /// Its second derivative.
    pub bend: f64,
}

impl Jet {
    /// A value that does not change.
    pub const fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, bend: 0.0 }
    }

    /// A value that changes evenly.
    pub const fn linear(value: f64, rate: f64) -> Self {
        Self { value, rate, bend: 0.0 }
    }

    /// `f` of this value, given `f`, `f'` and `f''` at it (chain rule).
    pub fn chain(self, [f, df, ddf]: [f64; 3]) -> Self {
        Self { value: f, rate: df * self.rate, bend: ddf * self.rate * self.rate + df * self.bend }
    }

    /// Sine and cosine. **Units:** value in rad.
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.value);
        (self.chain([sin, cos, -sin]), self.chain([cos, -sin, -cos]))
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate, bend: self.bend + other.bend }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            bend: self.bend * other.value + 2.0 * self.rate * other.rate + self.value * other.bend,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, rate: self.rate * factor, bend: self.bend * factor }
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, constant: f64) -> Self {
        Self { value: self.value + constant, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Some formula with every operation in it.
    fn formula(t: f64) -> Jet {
        let time = Jet::linear(t, 1.0);
        let (sin, cos) = (time * time * 0.7 + 0.3).sin_cos();
        sin * cos * time - cos * 2.0 + -time
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_finite_differences(t in -3.0..3.0_f64) {
            let h = 1e-4;
            let (before, here, after) = (formula(t - h), formula(t), formula(t + h));
            // The truncation error of a central difference is h^2/6 times the third derivative (some hundreds here).
            prop_assert!(((after.value - before.value) / (2.0 * h) - here.rate).abs() < 1e-5);
            prop_assert!(((after.rate - before.rate) / (2.0 * h) - here.bend).abs() < 1e-4);
        }
    }
}
