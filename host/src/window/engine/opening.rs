//! What is to be shown: read by the engine, since a large file takes its time.

use super::live::Live;
use super::replay::Replay;
use super::walk::{Settings, Walk};
use crate::building::Building;
use crate::building::open::{Options, open};
use crate::cli::fixes::{Incoming, Source};
use crate::fixes::line::Clock;
use crate::fixes::{Fix, smoother};
use crate::link::Address;
use crate::recording::{self, Profile, Recording};
use crate::{building, follow, particle, phone};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why nothing can be shown.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] recording::RecordingError),
    /// Nor that of a phone.
    #[error(transparent)]
    Phone(#[from] phone::sample::ReadError),
    /// The building cannot be read.
    #[error(transparent)]
    Building(#[from] building::Error),
    /// Nobody can be followed.
    #[error(transparent)]
    Follow(#[from] follow::Error),
    /// Positions of other sources cannot be read.
    #[error("{0}")]
    Positions(String),
    /// There is nothing in it.
    #[error("{0} has neither samples nor steps")]
    Empty(String),
}

impl Error {
    /// Positions of other sources cannot be read.
    pub fn positions(why: impl fmt::Display) -> Self {
        Self::Positions(why.to_string())
    }
}

/// What is to be opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum What {
    /// A recording.
    Recording(PathBuf),
    /// A shoe.
    Shoe(Address),
}

impl fmt::Display for What {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recording(path) => write!(out, "{}", path.display()),
            Self::Shoe(address) => write!(out, "{address}"),
        }
    }
}

/// A building that somebody is followed in.
#[derive(Clone, Debug)]
pub enum Plan {
    /// It is read first.
    File(PathBuf),
    /// It was read.
    Read(Arc<Building>),
}

impl fmt::Display for Plan {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(out, "{}", path.display()),
            Self::Read(building) => write!(out, "{}", building.name),
        }
    }
}

impl Plan {
    fn building(&self) -> Result<Building, building::Error> {
        match self {
            Self::File(path) => open(path, &Options::default()),
            Self::Read(building) => Ok(Building::clone(building)),
        }
    }
}

/// Positions of other sources.
#[derive(Clone, Debug)]
pub enum Positions {
    /// They are read first, or as they come.
    From(Source),
    /// They were read.
    Read(Arc<[Fix]>),
}

/// What is to be opened, and how.
#[derive(Clone, Debug)]
pub struct Opening {
    /// What.
    pub what: What,
    /// How a recording is laid out; recognised from the content when left out.
    pub profile: Option<Profile>,
    /// The building to follow in.
    pub building: Option<Plan>,
    /// How it is followed.
    pub settings: Settings,
    /// How a phone's steps are found.
    pub phone: phone::Parameters,
    /// Positions of other sources, in place of those that a recording brings along.
    pub positions: Option<Positions>,
}

impl Opening {
    /// A recording or a shoe, by the steps alone.
    pub fn of(what: What) -> Self {
        Self {
            what,
            profile: None,
            building: None,
            settings: Settings::default(),
            phone: phone::Parameters::default(),
            positions: None,
        }
    }

    /// What it is called.
    pub fn name(&self) -> String {
        match &self.what {
            What::Recording(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            What::Shoe(address) => address.to_string(),
        }
    }

    /// Opens it.
    ///
    /// # Errors
    /// When recording or building cannot be read, have nothing in them, or do not go together.
    pub fn open(&self) -> Result<Box<dyn super::Source>, Error> {
        let building = self.building.as_ref().map(Plan::building).transpose()?;
        match &self.what {
            What::Shoe(address) => {
                let source = match &self.positions {
                    Some(Positions::From(source)) => Some(source),
                    // Nobody has read what a shoe will be told of.
                    Some(Positions::Read(_)) | None => None,
                };
                Ok(Box::new(Live::new(address.clone(), building, &self.settings.follow, source)?))
            }
            What::Recording(path) => self.replay(path, building),
        }
    }

    fn replay(&self, path: &Path, building: Option<Building>) -> Result<Box<dyn super::Source>, Error> {
        let mut settings = self.settings.clone();
        let mut recording = if phone::open::is_phone(path) {
            Recording { name: self.name(), ..Recording::of_phone(path, &self.phone)? }
        } else {
            recording::open(path, self.profile.as_ref())?
        };
        if recording.is_of_phone() {
            if settings.follow.particle == particle::Parameters::default() {
                settings.follow.particle = particle::Parameters::phone();
            }
            settings.positions = smoother::Parameters::phone();
        }
        if recording.samples.is_empty() && recording.steps.is_empty() {
            return Err(Error::Empty(self.name()));
        }
        match &self.positions {
            Some(Positions::Read(fixes)) => recording.fixes = fixes.to_vec(),
            Some(Positions::From(source)) => recording.fixes = read(source, &recording, building.as_ref(), &settings)?,
            None => {}
        }
        Ok(Box::new(Replay::new(Walk::new(Arc::new(recording), building, settings)?)))
    }
}

/// Positions for a recording; what is wrong with lines is told on the terminal.
fn read(
    source: &Source,
    recording: &Recording,
    building: Option<&Building>,
    settings: &Settings,
) -> Result<Vec<Fix>, Error> {
    let mut incoming = Incoming::new(building, &settings.positions, false).map_err(Error::positions)?;
    incoming.read(source, Clock::of_past(recording.began_us())).map_err(Error::positions)?;
    Ok(incoming.fixes().to_vec())
}
