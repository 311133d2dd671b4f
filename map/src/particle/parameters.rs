//! Settings of the particle filter.

use super::Error;
use super::settings::SETTINGS;

/// How particles move, are weighed and are drawn anew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// As the document has it: fixed noise, walls that nothing passes, drawing after each step.
    Documented,
    /// With the covariance that the step brings, a step-scale of each particle, walls that cost dearly instead of
    /// everything, and as many particles as the cloud needs.
    #[default]
    Covariance,
}

/// Settings of [`super::ParticleFilter`]. Lengths in metres, angles in radians, unless said otherwise.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// Which of the two.
    pub method: Method,

    /// Unknown start: spacing of the places (Foot, 5.3: 0.30 m).
    pub spacing_m: f32,
    /// Unknown start: headings at each place (16).
    pub headings: u32,
    /// Unknown start: 0 holds every square metre for as likely as any other, 1 every room; between them the exponent of its area
    /// counts as much less.
    pub room_prior: f32,
    /// Most particles; places are further apart in a building that would need more.
    pub most: usize,
    /// Fewest particles (N0; 501).
    pub least: usize,

    /// Documented: noise of displacement in x and y, and of z and turn, that grows with the change (Phi in 5.14 - 5.17), as
    /// variances: m², m², rad².
    pub phi: [f32; 3],
    /// Documented: noise that is always there (Psi in 5.14 - 5.17), as variances: m², m², rad².
    pub psi: [f32; 3],
    /// Documented: standard deviation of the difference of heights (Phi_z in 5.23).
    pub phi_z_m: f32,
    /// Documented: how far apart particles of a cluster are at most, in the plane and in height (5 m, 1 m).
    pub cluster_m: [f32; 2],
    /// Documented: clusters are not looked for among more particles, since its way to find them is quadratic.
    pub cluster_most: usize,

    /// Displacement: what a step may be wrong beyond its own covariance (standard deviation).
    pub place_sigma_m: f32,
    /// Turn: the same.
    pub turn_sigma: f32,
    /// Turn: the share of its own standard deviation that counts.
    pub turn_share: f32,
    /// Step scale at the start (standard deviation of a factor).
    pub scale_sigma: f32,
    /// Step scale: its change from step to step.
    pub scale_noise: f32,
    /// Height of a step on the level (standard deviation).
    pub level_sigma_m: f32,
    /// Height of the floor where somebody leaves stairs or an elevator, after all its steps (standard deviation).
    pub exit_sigma_m: f32,
    /// The likelihood of what cannot be, a move through a wall for instance: plans and sensors err.
    pub leak: f32,
    /// Particles for each occupied bin: the share of the bound of Fox (KLD sampling) for an error of `kld_error`.
    pub kld_error: f32,
    /// New particles are drawn when the effective number is below this share of their number.
    pub resample_below: f32,
    /// Copies of one particle are set apart by this share of the space that each stands for.
    pub roughening: f32,
    /// Logarithm of the odds against the cloud at which it counts as lost.
    pub lost_odds: f32,
    /// Located: the leading cluster has at least this share of the weight.
    pub located_share: f32,
    /// Located: and at most this standard deviation of the place.
    pub located_sigma_m: f32,
    /// Located: for so many steps in a row.
    pub located_steps: u32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::Covariance,
            spacing_m: 0.3,
            headings: 16,
            room_prior: 0.5,
            most: 500_000,
            least: 4_000,
            phi: [0.02, 0.01, 0.02],
            psi: [1e-4, 1e-4, 4e-4],
            phi_z_m: 0.1,
            cluster_m: [5.0, 1.0],
            cluster_most: 10_000,
            place_sigma_m: 0.02,
            turn_sigma: 0.2_f32.to_radians(),
            turn_share: 0.5,
            scale_sigma: 0.01,
            scale_noise: 0.001,
            level_sigma_m: 0.08,
            exit_sigma_m: 0.3,
            leak: 1e-3,
            kld_error: 0.02,
            resample_below: 0.7,
            roughening: 1.0,
            lost_odds: 9.0,
            located_share: 0.98,
            located_sigma_m: 1.0,
            located_steps: 3,
        }
    }
}

impl Parameters {
    /// The settings of the document. Of its noise it gives the form but no figures; these are the project's.
    pub fn documented() -> Self {
        Self {
            method: Method::Documented,
            least: 501,
            most: 2_000_000,
            room_prior: 0.0,
            scale_sigma: 0.0,
            ..Self::default()
        }
    }

    /// The settings for steps of a phone in the hand. Each step says itself how far it may lead astray; what is added is what
    /// the hand does. Its noise drives particles against the walls at every step, and those that have got through one would
    /// outlive the others if walls cost them no more than with steps of a shoe. The scale differs little: somebody with
    /// freedom of scale lags behind in a corridor, since what hits a wall early is what walks fast. Found on all six recorded
    /// walks together.
    pub fn phone() -> Self {
        Self {
            place_sigma_m: 0.1,
            turn_sigma: 0.0,
            scale_sigma: 0.03,
            scale_noise: 0.002,
            leak: 1e-7,
            // Along a corridor nothing says better where somebody is.
            located_sigma_m: 2.0,
            ..Self::default()
        }
    }

    /// # Errors
    /// Names the first setting that makes no sense.
    pub fn check(&self) -> Result<(), Error> {
        let p = self;
        let between = |name: &'static str, value: f32, low: f32, high: f32| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(Error::Setting { name, value, low, high }) }
        };
        for setting in SETTINGS {
            between(setting.name, setting.value(p), setting.least, setting.largest)?;
        }
        between("most", p.most as f32, p.least as f32, 1e7)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sets_make_sense_and_nonsense_is_named() {
        Parameters::default().check().unwrap();
        Parameters::documented().check().unwrap();
        Parameters::phone().check().unwrap();
        let nonsense = Parameters { leak: f32::NAN, ..Parameters::default() };
        assert!(nonsense.check().unwrap_err().to_string().contains("leak"));
    }
}
