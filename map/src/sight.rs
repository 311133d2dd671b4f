//! What another source says of the place: a position or a range, as particle filter and matcher weigh what they believe by it.
//!
//! # Source
//! A mixture of what is right, with its covariance, and of what is anywhere: Thrun, Burgard and Fox, "Probabilistic
//! robotics", 6.3.

use nalgebra::Matrix2;

/// Somebody of whom no step comes for so long stands. **Units:** us.
pub(crate) const STANDS_US: i64 = 1_500_000;
/// Who contradicts a position is looked for within so many standard deviations of it, and this. **Units:** 1, m.
const SOUGHT_SIGMAS: f64 = 2.0;
const SOUGHT_M: f64 = 3.0;

/// What was seen of the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// A place and its covariance. **Units:** m, m²; **Frame:** building.
    Place([f64; 2], Matrix2<f64>),
    /// The distance to an anchor in space, how much higher that is than the sensor, and the standard deviation. **Units:** m.
    Range {
        /// **Frame:** building.
        anchor: [f64; 2],
        /// How much higher it is.
        above_m: f64,
        /// In space.
        metres: f64,
        /// Standard deviation.
        sigma_m: f64,
    },
}

/// A place or a distance that a source tells of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// What.
    pub seen: Seen,
    /// Number of the floor, if the source knows it.
    pub floor: Option<i32>,
    /// How likely it has nothing to do with the place, against a belief that fits it exactly: such a sight costs no
    /// belief more than this. From 1e-9 to 1.
    pub outlier: f64,
}

impl Sight {
    /// [`Self::outlier`], within its bounds.
    pub(crate) fn odds(&self) -> f64 {
        if self.outlier.is_finite() { self.outlier.clamp(1e-9, 1.0) } else { 1.0 }
    }

    /// The same of somebody who may have gone on since (variance of each coordinate). **Units:** m².
    pub(crate) fn within(&self, variance: f64) -> Self {
        let seen = match self.seen {
            Seen::Place(place, covariance) => Seen::Place(place, covariance + Matrix2::identity() * variance),
            Seen::Range { anchor, above_m, metres, sigma_m } => {
                Seen::Range { anchor, above_m, metres, sigma_m: (sigma_m * sigma_m + variance).sqrt() }
            }
        };
        Self { seen, ..*self }
    }

    /// Around which place, and how far from it, somebody is looked for whom this place contradicts; nothing of a range.
    /// **Units:** m; **Frame:** building.
    pub(crate) fn around(&self) -> Option<([f64; 2], f64)> {
        let Seen::Place(place, covariance) = self.seen else { return None };
        Some((place, SOUGHT_SIGMAS * covariance.trace().max(0.0).sqrt() + SOUGHT_M))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_contradicts_a_place_is_looked_for_the_farther_around_it_the_less_sure_it_is() {
        let sight = |sigma_m: f64| Sight {
            seen: Seen::Place([3.0, 4.0], Matrix2::identity() * (sigma_m * sigma_m)),
            floor: None,
            outlier: 0.01,
        };
        let [(place, exact), (_, unsure)] = [0.0, 5.0].map(|sigma_m| sight(sigma_m).around().unwrap());
        assert_eq!((place, exact), ([3.0, 4.0], SOUGHT_M));
        // Both coordinates are that unsure.
        assert!((unsure - exact - 2.0 * 50.0_f64.sqrt()).abs() < 1e-12, "{unsure}");
        let range = Seen::Range { anchor: [0.0; 2], above_m: 0.0, metres: 1.0, sigma_m: 0.1 };
        assert_eq!(Sight { seen: range, ..sight(1.0) }.around(), None);
    }

    #[test]
    fn who_may_have_gone_on_is_seen_less_well() {
        let seen = Seen::Range { anchor: [0.0; 2], above_m: 0.0, metres: 1.0, sigma_m: 3.0 };
        let later = Sight { seen, floor: None, outlier: f64::NAN }.within(16.0);
        assert!(matches!(later.seen, Seen::Range { sigma_m, .. } if (sigma_m - 5.0).abs() < 1e-12));
        assert_eq!(later.odds(), 1.0);
    }
}
