//! How somebody looks at the map: kept from run to run.

use super::camera::{Camera, Projection};
use super::overlay::Role;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Least and most that floors stand apart, as a factor.
pub const SPREAD: (f64, f64) = (1.0, 6.0);

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Layers {
    /// The particles.
    pub particles: bool,
    /// The path as it was estimated.
    pub estimate: bool,
    /// The path by the steps alone.
    pub free: bool,
    /// The past as it looks from today.
    pub corrected: bool,
    /// Where somebody really went.
    pub truth: bool,
    /// Tracks of the other trackers.
    pub others: bool,
    /// The places that are possible.
    pub clusters: bool,
    /// Names of rooms and floors.
    pub names: bool,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            particles: true,
            estimate: true,
            free: true,
            corrected: true,
            truth: true,
            others: true,
            clusters: true,
            names: true,
        }
    }
}

impl Layers {
    /// Whether ways of a kind are drawn.
    pub fn shows(&self, role: Role) -> bool {
        match role {
            Role::Truth => self.truth,
            Role::Free => self.free,
            Role::Other => self.others,
            Role::Corrected => self.corrected,
            Role::Estimate => self.estimate,
        }
    }
}

/// How somebody looks at the map. A file of it may lack any part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct View {
    /// In perspective or flat.
    pub projection: Projection,
    /// From where; nothing until the building was fitted into the view for the first time.
    pub camera: Option<Camera>,
    /// Numbers of the floors that are not drawn.
    pub hidden: BTreeSet<i32>,
    /// Number of the floor that is looked at: the only one of a flat map, and in perspective the highest that is not
    /// only hinted at. Nothing for all floors.
    pub level: Option<i32>,
    /// As long as no floor is chosen, those above the person, or the likeliest place, are only hinted at.
    pub auto: bool,
    /// How many times as far as in truth floors stand apart.
    pub spread: f64,
    /// Whether the map goes with the selected person.
    pub follow: bool,
    /// What is drawn.
    pub layers: Layers,
}

impl Default for View {
    fn default() -> Self {
        Self {
            projection: Projection::Orbit,
            camera: None,
            hidden: BTreeSet::new(),
            level: None,
            auto: true,
            spread: 1.0,
            follow: false,
            layers: Layers::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_is_read_as_it_was_written() {
        let view = View { camera: Some(Camera::default()), hidden: [2].into(), level: Some(1), ..View::default() };
        let text = toml::to_string(&view).unwrap();
        assert_eq!(toml::from_str::<View>(&text).unwrap(), view);
        assert_eq!(toml::from_str::<View>("follow = true").unwrap(), View { follow: true, ..View::default() });
        assert!(toml::from_str::<View>("colour = 3").is_err());
    }
}
