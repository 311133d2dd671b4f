//! All that the window shows of a moment. Made by the engine, never changed, cheap to hand on.

use super::beside::Beside;
use super::signals::Signals;
use crate::particle::{self, Cluster, State};
use crate::window::map::{Overlay, Scene};
use nalgebra::UnitQuaternion;
use sohle_shared::tracker;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Where it comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Nothing is open.
    #[default]
    Nothing,
    /// Something is being read.
    Opening,
    /// A recording.
    Replay,
    /// A shoe.
    Live,
}

/// How a recording is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Whether it goes on.
    pub playing: bool,
    /// How many times as fast as it was; infinite for as fast as it can be computed.
    pub speed: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { playing: false, speed: 1.0 }
    }
}

/// The line to a shoe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Link {
    /// Where the shoe is.
    pub address: String,
    /// How it goes, in words.
    pub state: String,
    /// Whether something was heard of the shoe of late.
    pub heard: bool,
    /// Frames that came whole.
    pub frames: u64,
    /// Frames that came damaged.
    pub damaged: u64,
    /// Steps that are lost.
    pub lost: u64,
    /// How well the clock of the shoe is known. **Units:** ms.
    pub clock_ms: Option<f64>,
    /// **Units:** 1/1000.
    pub load: Option<u16>,
    /// **Units:** V.
    pub battery: Option<f32>,
    /// **Units:** °C.
    pub temperature: Option<f32>,
    /// The recording that is being written.
    pub recording: Option<PathBuf>,
}

/// Something that is not as it should be, and what helps.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub advice: &'static str,
}

/// Where somebody is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whereabouts {
    /// What is known.
    pub state: State,
    /// Name of the room of the likeliest place.
    pub room: Option<String>,
    /// Name of the floor.
    pub floor: Option<String>,
    /// The likeliest place.
    pub place: Option<Cluster>,
    /// Number of particles.
    pub particles: usize,
    /// Effective number of them.
    pub effective: f64,
}

/// A moment.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// What is shown: the name of a recording or the address of a shoe.
    pub name: String,
    /// Where it comes from.
    pub kind: Kind,
    /// **Units:** s.
    pub time: f64,
    /// First and last moment. **Units:** s.
    pub span: [f64; 2],
    /// How it is played.
    pub pace: Pace,
    /// How much of a jump has been computed, while it is.
    pub computing: Option<f32>,
    /// What the tracker is doing.
    pub phase: tracker::State,
    /// Whether the foot stands.
    pub stance: bool,
    /// Steps so far.
    pub steps: usize,
    /// By the steps. **Units:** m.
    pub distance: f64,
    /// How the sensor lies.
    pub attitude: Option<UnitQuaternion<f64>>,
    /// Where somebody is, in a building.
    pub whereabouts: Option<Whereabouts>,
    /// The building.
    pub scene: Option<Arc<Scene>>,
    /// What is drawn on it.
    pub overlay: Overlay,
    /// All signals so far.
    pub signals: Signals,
    /// Other methods that follow too, and what each decided at the last step.
    pub others: Vec<(Beside, String)>,
    /// Whether positions of other sources come too.
    pub positions: bool,
    /// What is not as it should be.
    pub warnings: Vec<Warning>,
    /// Settings of the tracker.
    pub settings: Option<Arc<tracker::Parameters>>,
    /// Settings of the particle filter.
    pub particle: Option<Arc<particle::Parameters>>,
    /// The line to the shoe.
    pub link: Option<Link>,
    /// What there is to tell of what was asked for last: why it was not done, or what came of it.
    pub fault: Option<String>,
    /// When the last step came.
    pub stepped: Option<Instant>,
    /// It was to be shown until now; whoever opened it for so long closes the window.
    pub ended: bool,
}
