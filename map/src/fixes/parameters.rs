//! Settings of the document's methods.

/// Settings of [`super::kalman`], [`super::extended`] and [`super::adjustment`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Documented {
    /// Standard deviation of each coordinate of a position (Fix, 3.3: `s1`); what the source says is not heard.
    /// **Units:** m.
    pub fix_sigma_m: f64,
    /// Standard deviation of each coordinate of a step (Fix, 3.3: `s2`). **Units:** m.
    pub step_sigma_m: f64,
    /// Extended filter: how well the start direction is known where it was estimated (standard deviation). **Units:** rad.
    pub direction_sigma: f64,
    /// Extended filter: how far steps may be too short or too long (standard deviation of a factor).
    pub scale_sigma: f64,
    /// Where the start direction is not given, it is estimated as soon as positions lie this far apart. **Units:** m.
    pub spread_m: f64,
}

impl Default for Documented {
    /// 3 m and 0.2 m are the document's; of the rest it says nothing.
    fn default() -> Self {
        Self { fix_sigma_m: 3.0, step_sigma_m: 0.2, direction_sigma: 0.35, scale_sigma: 0.1, spread_m: 12.0 }
    }
}
