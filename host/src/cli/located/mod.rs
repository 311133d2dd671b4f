//! What `replay`, `demo` and `live` do with a building: somebody is followed through it, and it is told, drawn and written.

mod following;
mod outputs;
mod picture;
mod summary;

pub use following::{Answer, Following, building, finish_and_tell};
pub use outputs::{Wanted, walk};

use super::Error;
use crate::building::Building;
use crate::building::open::{Options, open};
use crate::follow::{Follower, Settings, Steering};
use crate::particle::Parameters;
use crate::toml_file;
use std::path::PathBuf;

/// The building to follow the steps in.
#[derive(Clone, Debug, clap::Args)]
pub struct InBuilding {
    /// Follows the steps through this building: any format that 'sohle building show' takes
    #[arg(long, value_name = "FILE|DIR")]
    pub building: Option<PathBuf>,
    /// How.
    #[command(flatten)]
    pub how: How,
}

/// How somebody is followed in it.
#[derive(Clone, Debug, clap::Args)]
pub struct How {
    /// Where the walk begins: anywhere, entrances, a room or an entrance by its name, FLOOR,X,Y or FLOOR,X,Y,HEADING_DEG [default: anywhere]
    ///
    /// X east and Y north in metres of the building, the heading counter-clockwise from east.
    #[arg(long, value_name = "WHERE", allow_hyphen_values = true)]
    start: Option<String>,
    /// Settings of the particle filter; others keep their default
    #[arg(long, value_name = "FILE.toml")]
    particle: Option<PathBuf>,
    /// All that is random in the particle filter follows from it [default: 1]
    #[arg(long, value_name = "N")]
    particle_seed: Option<u64>,
    /// What the map tells the tracker of the ground [default: document]
    #[arg(long, value_enum, value_name = "WHAT")]
    floor_mode: Option<Steering>,
    /// Where it goes beside the folder of results.
    #[command(flatten)]
    pub wanted: Wanted,
}

impl InBuilding {
    /// Reads the building and the start, if a building is asked for; the filter has the settings `default` unless a file says
    /// otherwise.
    pub fn prepare(&self, default: Parameters) -> Result<Option<Following>, Error> {
        match (&self.building, self.how.given()) {
            (Some(path), _) => self.how.follow(open(path, &Options::default())?, default).map(Some),
            (None, Some(option)) => Err(Error::new(format!("{option} needs a building: --building FILE"))),
            (None, None) => Ok(None),
        }
    }
}

impl How {
    /// Whether the walk begins at a known place.
    pub fn starts_somewhere(&self) -> bool {
        self.start.as_ref().is_some_and(|start| start.trim() != "anywhere")
    }

    /// An option that was given.
    fn given(&self) -> Option<&'static str> {
        let given = [
            ("--start", self.start.is_some()),
            ("--particle", self.particle.is_some()),
            ("--particle-seed", self.particle_seed.is_some()),
            ("--floor-mode", self.floor_mode.is_some()),
            ("--track", !self.wanted.track.is_empty()),
            ("--places", self.wanted.places.is_some()),
            ("--serve", self.wanted.serve.is_some()),
        ];
        given.iter().find(|(_, given)| *given).map(|(option, _)| *option)
    }

    /// Begins to follow in a building, by the settings `default` unless a file says otherwise.
    pub fn follow(&self, building: Building, default: Parameters) -> Result<Following, Error> {
        let usual = Settings::default();
        let settings = Settings {
            start: self.start.clone().unwrap_or(usual.start),
            particle: match &self.particle {
                Some(path) => toml_file::read("settings of the particle filter", path)?,
                None => default,
            },
            seed: self.particle_seed.unwrap_or(usual.seed),
            steering: self.floor_mode.unwrap_or(usual.steering),
        };
        let follower = Follower::new(building, &settings)?;
        for warning in follower.warnings() {
            eprintln!("warning: {warning}");
        }
        Following::new(follower, &self.wanted)
    }
}
