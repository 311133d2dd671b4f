//! Time as data: whole microseconds since an arbitrary start.
//!
//! Nothing in this crate reads a clock. The start is chosen by whoever makes the samples (the boot of the shoe, the
//! first line of a recording).

use core::ops::{Add, Sub};

/// A point in time. **Units:** microseconds since the recording's or the device's start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Micros(pub i64);

impl Micros {
    /// The point in time nearest to `seconds` after the start. **Units:** s.
    pub fn from_seconds(seconds: f64) -> Self {
        let scaled = seconds * 1e6;
        Self(if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 } as i64)
    }

    /// Seconds since the start. **Units:** s. For display and files; differences belong to [`Micros::since`].
    pub fn as_seconds(self) -> f64 {
        self.0 as f64 * 1e-6
    }

    /// Time elapsed since `earlier`, negative when `earlier` is later. **Units:** s.
    pub fn since(self, earlier: Self) -> f32 {
        (self.0.saturating_sub(earlier.0)) as f32 * 1e-6
    }
}

impl Add<i64> for Micros {
    type Output = Self;
    /// The point in time `rhs` microseconds later.
    fn add(self, rhs: i64) -> Self {
        Self(self.0.saturating_add(rhs))
    }
}

impl Sub for Micros {
    type Output = i64;
    /// Microseconds from `rhs` to `self`.
    fn sub(self, rhs: Self) -> i64 {
        self.0.saturating_sub(rhs.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_stay_exact_after_months() {
        let month = Micros::from_seconds(30.0 * 86_400.0);
        let next = month + 500;
        assert_eq!(next - month, 500);
        assert!((next.since(month) - 5e-4).abs() < 1e-10);
    }

    #[test]
    fn rounds_to_the_nearest_microsecond() {
        assert_eq!(Micros::from_seconds(0.004_997_4), Micros(4_997));
        assert_eq!(Micros::from_seconds(-0.000_001_6), Micros(-2));
    }
}
