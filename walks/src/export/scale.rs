//! Ranges, and the round numbers at which a grid is drawn.

/// From the least to the greatest of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least.
    pub from: f64,
    /// The greatest.
    pub to: f64,
}

impl Range {
    /// The range of `values` but for those that are not finite; `None` if no other is there.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        values.into_iter().filter(|value| value.is_finite()).fold(None, |range: Option<Self>, value| {
            Some(range.map_or(Self { from: value, to: value }, |range| Self {
                from: range.from.min(value),
                to: range.to.max(value),
            }))
        })
    }

    /// How long it is.
    pub fn length(&self) -> f64 {
        self.to - self.from
    }

    /// The same middle, but at least `length` long.
    pub fn at_least(self, length: f64) -> Self {
        let missing = (length - self.length()).max(0.0);
        Self { from: self.from - missing / 2.0, to: self.to + missing / 2.0 }
    }

    /// Longer by `margin` at both ends.
    pub fn padded(self, margin: f64) -> Self {
        Self { from: self.from - margin, to: self.to + margin }
    }

    /// Made to reach to the ends of `other`, those that are not further away than `most`.
    pub fn reaching(self, other: Self, most: f64) -> Self {
        Self {
            from: if self.from - other.from <= most { self.from.min(other.from) } else { self.from },
            to: if other.to - self.to <= most { self.to.max(other.to) } else { self.to },
        }
    }

    /// Whether `value` lies inside.
    pub fn contains(&self, value: f64) -> bool {
        (self.from..=self.to).contains(&value)
    }

    /// The multiples of `spacing` inside.
    pub fn ticks(self, spacing: f64) -> impl Iterator<Item = f64> {
        let first = (self.from / spacing).ceil() as i64;
        let last = (self.to / spacing).floor() as i64;
        (first..=last).map(move |count| count as f64 * spacing)
    }
}

/// The smallest of 1, 2 or 5 times a power of ten that is at least `least`.
pub fn round_spacing(least: f64) -> f64 {
    let power = 10_f64.powf(least.max(1e-6).log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|factor| factor * power).find(|&spacing| spacing >= least).unwrap_or(10.0 * power)
}

/// A number as the label of a grid line `spacing` apart.
pub fn label(value: f64, spacing: f64) -> String {
    let digits = (-spacing.log10().floor()).clamp(0.0, 6.0) as usize;
    // Adding zero turns a negative zero into zero.
    format!("{:.digits$}", value + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacings_are_round() {
        for (least, round) in [(0.03, 0.05), (1.0, 1.0), (1.1, 2.0), (4.0, 5.0), (7.0, 10.0), (60.0, 100.0)] {
            // Powers of ten are rounded in their last digit.
            assert!((round_spacing(least) - round).abs() < 1e-9, "{least}");
        }
    }

    #[test]
    fn ticks_lie_inside_and_their_labels_have_the_digits_they_need() {
        let labels: Vec<_> = Range { from: -0.7, to: 0.6 }.ticks(0.5).map(|value| label(value, 0.5)).collect();
        assert_eq!(labels, ["-0.5", "0.0", "0.5"]);
        assert_eq!(label(-0.0, 5.0), "0");
    }

    #[test]
    fn a_range_reaches_as_far_as_it_may() {
        let range = Range { from: 0.0, to: 10.0 };
        let reached = range.reaching(Range { from: -100.0, to: 12.0 }, 5.0);
        assert_eq!(reached, Range { from: 0.0, to: 12.0 });
        assert_eq!(range.reaching(Range { from: 3.0, to: 4.0 }, 5.0), range);
    }

    #[test]
    fn values_that_are_not_finite_have_no_range() {
        assert_eq!(Range::of([f64::NAN, f64::INFINITY]), None);
        assert_eq!(Range::of([2.0, f64::NAN, 1.0]), Some(Range { from: 1.0, to: 2.0 }));
    }
}
