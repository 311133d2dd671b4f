//! A position or a range, as the particle filter takes it.

use crate::fixes::{Measured, Observation, Outliers};
use crate::sight::{Seen, Sight};

/// The likelihood of an observation for particles.
pub fn sight(observation: &Observation, outliers: &Outliers) -> Sight {
    let (seen, outlier) = match observation.measured {
        Measured::Position { place, covariance } => {
            (Seen::Place(place, covariance), outliers.odds_of_place(covariance.determinant()))
        }
        Measured::Range { anchor, above_m, metres, sigma_m } => {
            (Seen::Range { anchor, above_m, metres, sigma_m }, outliers.odds_of_range(sigma_m * sigma_m))
        }
    };
    Sight { seen, floor: observation.floor, outlier }
}
