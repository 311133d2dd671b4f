//! The recorded walks with a phone: where they lie, and in which building and frame.

use crate::building::open::{Options, open};
use crate::building::{self, Building, Georeference};
use crate::particle::{self, Map};
use crate::phone;
use crate::phone::sample::{PhoneSample, ReadError, WayPoint};
use crate::recording::recordings_dir;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why the walks are not there.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The folder of recordings is not there.
    #[error(
        "the recordings of phones are not there: set SOHLE_RECORDINGS to the folder that holds hcu_hamburg and xyz10_mall"
    )]
    NoRecordings,
    /// A recording or a plan is not in it.
    #[error("{} is not there; the recordings of phones are hcu_hamburg and xyz10_mall", .0.display())]
    Absent(PathBuf),
    /// A recording cannot be read.
    #[error(transparent)]
    Recording(#[from] ReadError),
    /// A plan cannot be read.
    #[error(transparent)]
    Building(#[from] building::Error),
    /// The filter refused.
    #[error(transparent)]
    Particle(#[from] particle::Error),
}

/// A walk in the folder of recordings.
#[derive(Clone, Copy, Debug)]
struct Source {
    name: &'static str,
    recording: &'static str,
    plan: &'static str,
    floor: i32,
    search: bool,
}

const SOURCES: [Source; 6] = [
    Source {
        name: "hcu eight",
        recording: "hcu_hamburg/eight_walk",
        plan: "hcu_hamburg/floorplans/4OG.geojson",
        floor: 4,
        search: true,
    },
    mall("mall F1 a", "xyz10_mall/site1/F1/5dd9ef979191710006b57086.txt", "xyz10_mall/site1/F1", 1),
    mall("mall F1 b", "xyz10_mall/site1/F1/5dd9fd549191710006b570e6.txt", "xyz10_mall/site1/F1", 1),
    mall("mall F4 a", "xyz10_mall/site1/F4/5ddb6558c5b77e0006b17918.txt", "xyz10_mall/site1/F4", 4),
    mall("mall F4 b", "xyz10_mall/site1/F4/5ddb656fc5b77e0006b1792e.txt", "xyz10_mall/site1/F4", 4),
    mall("mall F4 c", "xyz10_mall/site1/F4/5ddb6573c5b77e0006b17932.txt", "xyz10_mall/site1/F4", 4),
];

const fn mall(name: &'static str, recording: &'static str, plan: &'static str, floor: i32) -> Source {
    Source { name, recording, plan, floor, search: false }
}

/// A walk, its way-points and the plan of its floor.
#[derive(Clone, Debug)]
pub struct PhoneWalk {
    /// What it is called in tables.
    pub name: &'static str,
    /// What the phone measured.
    pub samples: Vec<PhoneSample>,
    /// **Frame:** building.
    pub way_points: Vec<WayPoint>,
    /// What a source of positions said. **Frame:** building.
    pub positions: Vec<WayPoint>,
    /// The plan of the floor.
    pub building: Building,
    /// The same for the particle filter.
    pub map: Arc<Map>,
    /// Number of the floor.
    pub floor: i32,
    /// Whether to look for the walk from anywhere on the floor. Those of the mall have 40 000 m², and way-points only in
    /// corridors that look alike.
    pub search: bool,
}

impl PhoneWalk {
    fn read(home: &Path, source: &Source) -> Result<Self, Error> {
        let [recording, plan] = [source.recording, source.plan].map(|path| home.join(path));
        for path in [&recording, &plan] {
            if !path.exists() {
                return Err(Error::Absent(path.clone()));
            }
        }
        let recording = phone::open::open(&recording)?;
        let building = open(&plan, &Options::default())?;
        // Surveyed places are in the zone of the map; those on the image of a floor are in the frame of its plan.
        let origin = match &building.georeference {
            Georeference::Utm { origin, .. } => *origin,
            _ => [0.0; 2],
        };
        let moved =
            |point: &WayPoint| WayPoint { place: [point.place[0] - origin[0], point.place[1] - origin[1]], ..*point };
        Ok(Self {
            name: source.name,
            way_points: recording.way_points.iter().map(moved).collect(),
            positions: recording.positions.iter().map(moved).collect(),
            samples: recording.samples,
            map: Arc::new(Map::of(&building)?),
            building,
            floor: source.floor,
            search: source.search,
        })
    }
}

/// All recorded walks; the first, along an eight in the university, has positions of another source.
///
/// # Errors
/// When the folder or one of the walks is not there, or cannot be read.
pub fn all() -> Result<Vec<PhoneWalk>, Error> {
    let home = recordings_dir().ok_or(Error::NoRecordings)?;
    SOURCES.iter().map(|source| PhoneWalk::read(&home, source)).collect()
}

/// The walk along an eight in the university alone.
///
/// # Errors
/// As [`all`].
pub fn eight() -> Result<PhoneWalk, Error> {
    let home = recordings_dir().ok_or(Error::NoRecordings)?;
    PhoneWalk::read(&home, &SOURCES[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_absent_is_named() {
        let home = tempfile::tempdir().unwrap();
        let told = PhoneWalk::read(home.path(), &SOURCES[0]).unwrap_err().to_string();
        assert!(told.contains("hcu_hamburg/eight_walk is not there"), "{told}");
    }
}
