//! What has nothing to do with the place: how often it comes, and where it lies.

use std::f64::consts::TAU;

/// Outliers, as a mixture knows them: so many, anywhere.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Outliers {
    /// Share of all positions.
    pub share: f64,
    /// Share of all ranges.
    pub range_share: f64,
    /// Positions among them lie anywhere in such an area. **Units:** m².
    pub area_m2: f64,
    /// Ranges among them are anything up to this. **Units:** m.
    pub range_m: f64,
}

impl Default for Outliers {
    /// Those of ranges as 62 745 recorded ones of UWB have them: `sohle evaluate --suite fixes`.
    fn default() -> Self {
        Self { share: 0.1, range_share: 0.05, area_m2: 2_500.0, range_m: 30.0 }
    }
}

impl Outliers {
    /// Odds that a position is one, against one that is right and not off at all; from the determinant of its covariance.
    pub fn odds_of_place(&self, determinant: f64) -> f64 {
        self.share / (1.0 - self.share) * TAU * determinant.max(0.0).sqrt() / self.area_m2
    }

    /// The same of a range, from its variance.
    pub fn odds_of_range(&self, variance: f64) -> f64 {
        self.range_share / (1.0 - self.range_share) * (TAU * variance).sqrt() / self.range_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_vaguely_is_an_outlier_sooner() {
        let outliers = Outliers::default();
        assert!((outliers.odds_of_place(1.0) - TAU / 9.0 / 2_500.0).abs() < 1e-12);
        assert!(outliers.odds_of_place(81.0) > 8.9 * outliers.odds_of_place(1.0));
        assert!(outliers.odds_of_range(0.04) > outliers.odds_of_range(0.01));
    }
}
