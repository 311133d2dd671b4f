//! Settings of the smoother.

use crate::fixes::outlier::Outliers;

/// Settings of [`super::Smoother`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// Steps that are kept open; what is older is settled. A position may be late by as much.
    pub window: usize,
    /// Most positions in the window; with more the window becomes shorter.
    pub most_fixes: usize,
    /// What a step may be wrong by beyond its own covariance (standard deviation of each coordinate). **Units:** m.
    pub place_sigma_m: f64,
    /// A turn: the same. **Units:** rad.
    pub turn_sigma: f64,
    /// A turn: the share of its own standard deviation that counts.
    pub turn_share: f64,
    /// Step scale at the start (standard deviation of its logarithm).
    pub scale_sigma: f64,
    /// Step scale: its change from step to step.
    pub scale_noise: f64,
    /// Heading drift at the start (standard deviation). **Units:** rad/s.
    pub drift_sigma: f64,
    /// Heading drift: its change in a second. **Units:** rad/s for a root of a second.
    pub drift_noise: f64,
    /// Positions and ranges that have nothing to do with the place.
    pub outliers: Outliers,
}

impl Default for Parameters {
    /// For steps of a shoe.
    fn default() -> Self {
        Self {
            window: 100,
            most_fixes: 400,
            place_sigma_m: 0.02,
            turn_sigma: 0.2_f64.to_radians(),
            turn_share: 0.5,
            scale_sigma: 0.02,
            scale_noise: 0.0005,
            drift_sigma: 0.0005,
            drift_noise: 0.00002,
            outliers: Outliers::default(),
        }
    }
}

impl Parameters {
    /// For steps of a phone in the hand, which wander more and whose gyroscope drifts. Found on the walk of
    /// `sohle evaluate --suite fixes`, where half and double of each of them make a few centimetres.
    pub fn phone() -> Self {
        Self {
            turn_share: 0.7,
            turn_sigma: 0.0,
            scale_sigma: 0.02,
            scale_noise: 0.002,
            drift_sigma: 0.001,
            ..Self::default()
        }
    }
}
