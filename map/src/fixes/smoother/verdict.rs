//! What became of a position, and why.

use nalgebra::Vector2;
use std::fmt;
use std::sync::Arc;

/// What became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// It counts.
    Taken,
    /// It is so far off that it is likelier an outlier; it counts if later ones bear it out.
    Doubted,
    /// It is older than the window. **Units:** s.
    TooLate(f64),
    /// It is later than anything that was said of the way, by more than somebody may stand still. **Units:** s.
    TooEarly(f64),
}

/// Why it is so.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Who said it.
    pub source: Arc<str>,
    /// What became of it.
    pub outcome: Outcome,
    /// How far it was from where the person was believed to be, or how much too long or short a range. **Units:** m.
    pub off_m: f64,
    /// The same as a vector, for a position. **Units:** m; **Frame:** building.
    pub off: Vector2<f64>,
    /// The same squared, over what it may be off by both uncertainties, and over its degrees of freedom: 1 on average when
    /// all is as it is said (normalised innovation).
    pub normalised: f64,
    /// The probability that it is no outlier.
    pub weight: f64,
}

impl fmt::Display for Verdict {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { source, off_m, normalised, weight, .. } = self;
        let times = normalised.sqrt();
        match self.outcome {
            Outcome::Taken => write!(out, "{source}: taken, {off_m:.1} m off, {times:.1} times what was expected"),
            Outcome::Doubted => write!(
                out,
                "{source}: doubted, {off_m:.1} m off, {times:.1} times what was expected; no outlier with a probability of {weight:.2}"
            ),
            Outcome::TooLate(seconds) => {
                write!(out, "{source}: {seconds:.1} s older than what is still open to change")
            }
            Outcome::TooEarly(seconds) => write!(out, "{source}: {seconds:.1} s after the last step"),
        }
    }
}
