//! What is drawn on the building: all that changes while somebody walks.

use super::palette::Rgb;
use crate::particle::{Cluster, Particle};
use std::sync::Arc;

/// Everything that is known at a moment. Cheap to copy; what is the same as before, by its [`Arc`], is not sent to the
/// graphics card again.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Hypotheses, one cloud for each shoe.
    pub clouds: Vec<Cloud>,
    /// Ways that were walked.
    pub tracks: Vec<Track>,
    /// Where the persons are.
    pub people: Vec<Person>,
    /// Feet on their way from the last stance; they are another place with each sample.
    pub feet: Vec<Foot>,
    /// The places that are possible for the selected person, the likeliest first.
    pub clusters: Arc<[Cluster]>,
}

/// Particles of one shoe.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// They; those of the floors are told apart by [`Particle::floor`].
    pub particles: Arc<[Particle]>,
    /// Green if it has none of its own.
    pub colour: Option<Rgb>,
}

/// What a way is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Where somebody really went; dark.
    Truth,
    /// By the steps alone, without the map; violet.
    Free,
    /// Another tracker's; its own colour.
    Other,
    /// The past as it looks from today; blue.
    Corrected,
    /// As it was estimated at the time; red.
    Estimate,
}

/// Points of a way, piece by piece. **Units:** m; **Frame:** building.
pub type Pieces = Arc<[Vec<[f64; 3]>]>;

/// A way that was walked.
#[derive(Clone, Debug)]
pub struct Track {
    /// What it is called in the legend.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// Its own colour, instead of that of its role: for several shoes and for other trackers.
    pub colour: Option<Rgb>,
    /// Points in order; between two pieces nothing is drawn. **Units:** m; **Frame:** building.
    pub pieces: Pieces,
}

/// A foot on its way, which goes on where the way by the steps alone ends. **Units:** m; **Frame:** building.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Where it stood last.
    pub from: [f64; 3],
    /// Where it is.
    pub to: [f64; 3],
}

/// Where a person is.
#[derive(Clone, Debug, PartialEq)]
pub struct Person {
    /// What the person, or the shoe, is called. Not shown when there is only one.
    pub name: String,
    /// **Units:** m; **Frame:** building.
    pub position: [f64; 3],
    /// Number of the floor.
    pub floor: i32,
    /// Where the person looks, if that is known. **Units:** rad; **Frame:** building, counter-clockwise from east.
    pub heading: Option<f64>,
    /// Standard deviation of the place. **Units:** m.
    pub sigma_m: f64,
    /// Red if there is none of its own.
    pub colour: Option<Rgb>,
    /// Whether it is the one whose details are shown, and that is followed.
    pub selected: bool,
}
