//! What the filter says: where the person is, how sure that is, and where else the person may be.

use super::cluster::Cluster;
use sohle_shared::time::Micros;

/// What is known of the place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Nearly everywhere is possible.
    #[default]
    Searching,
    /// A few places are possible.
    SeveralPlaces,
    /// One place is left.
    Located,
    /// What was believed cannot be: the steps do not fit the building from there.
    Lost,
}

impl State {
    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Searching => "searching",
            Self::SeveralPlaces => "several places",
            Self::Located => "located",
            Self::Lost => "lost",
        }
    }
}

/// How likely a room is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomShare {
    /// Number of the floor.
    pub floor: i32,
    /// Index of the room in the plan of the floor; nothing outside of all rooms.
    pub room: Option<u16>,
    /// Share of the weight.
    pub probability: f64,
}

/// What the filter says after a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// End of the stance; nothing before the first step.
    pub time: Option<Micros>,
    /// Index of the step.
    pub step: u32,
    /// What is known.
    pub state: State,
    /// The places that are possible, the likeliest first.
    pub clusters: Vec<Cluster>,
    /// The rooms that are possible, the likeliest first.
    pub rooms: Vec<RoomShare>,
    /// Share of the weight that stands in stairs, and in elevators.
    pub in_connectors: [f64; 2],
    /// Number of particles.
    pub particles: usize,
    /// Effective number of particles before new ones were drawn.
    pub effective: f64,
    /// Mean likelihood of the step: 1 when it fits everywhere.
    pub likelihood: f64,
}

impl Estimate {
    /// The likeliest place.
    pub fn place(&self) -> Option<&Cluster> {
        self.clusters.first()
    }
}
