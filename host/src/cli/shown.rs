//! What `demo`, `replay` and `live` show in the window, where there is a display.

use super::Error;
use super::live::{Listening, Show};
use super::located::Following;
use crate::building::Building;
use crate::fixes::Fix;
use crate::link::Address;
use crate::recording::Profile;
use crate::{follow, phone};
use sohle_shared::calibration::Calibration;
use sohle_shared::tracker::Parameters;
use std::path::PathBuf;
use std::sync::Arc;

/// A walk whose results are written, to be gone through.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    /// The recording.
    pub file: PathBuf,
    /// How it is laid out, if that was said.
    pub profile: Option<Profile>,
    /// Settings of the tracker.
    pub tracker: Parameters,
    /// Settings of a phone's steps.
    pub phone: phone::Parameters,
    /// What the samples are corrected by.
    pub calibration: Option<Calibration>,
    /// Positions of other sources that were heard, if not those of the recording.
    pub fixes: Option<Arc<[Fix]>>,
    /// The building, and how it was followed in.
    pub place: Option<(Arc<Building>, follow::Settings)>,
}

impl Walk {
    /// A recording that was followed by somebody, or by nobody.
    pub fn of(file: PathBuf, following: Option<&Following>) -> Self {
        let place = following.map(|following| {
            let follower = following.follower();
            (follower.building().clone(), follower.settings().clone())
        });
        Self { file, place, ..Self::default() }
    }
}

/// A shoe that is listened to.
pub struct Shoe {
    /// Where it is.
    pub address: Address,
    /// Where the walk begins.
    pub start: String,
    /// The recording that is being written.
    pub recording: Option<PathBuf>,
    /// What it is listened to with.
    pub listening: Listening,
}

/// Whether it is enough.
pub type Enough = Box<dyn FnMut(&Show) -> bool + Send>;

/// What came of a window with a shoe in it.
pub enum Watched {
    /// It was looked at until it was enough, or the window was closed.
    Whole(Box<Listening>),
    /// There is no window: why, and what was to be looked at.
    Unopened(Error, Box<Shoe>, Enough),
}
