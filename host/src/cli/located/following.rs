//! Somebody who is followed, and where what is said of it goes.

use super::{picture, summary};
use crate::building::georeference::Projection;
use crate::cli::{Error, print};
use crate::export::{file, png};
use crate::follow::{self, Follower, LONGEST_STEP_M, Said, Unusual};
use crate::recording::Recording;
use sohle_shared::step::Step;
use std::path::Path;

/// The estimate after each step, a JSON object to a line.
const STREAM: &str = "places.jsonl";

/// A follower and its outputs.
pub struct Following {
    follower: Follower,
    projection: Option<Projection>,
    lines: String,
}

impl Following {
    /// Of somebody who has not gone yet.
    pub fn new(follower: Follower) -> Result<Self, Error> {
        let projection = follower.building().georeference.projection()?;
        Ok(Self { follower, projection, lines: String::new() })
    }

    /// Follows a step, and hands on what is said.
    pub fn step(&mut self, step: &Step) -> Said {
        let said = self.follower.step(step);
        match said.unusual {
            Some(Unusual::TooLong(length)) => eprintln!(
                "step {}: {length:.1} m is longer than any stride ({LONGEST_STEP_M} m); taken for a hole in the walk",
                step.index
            ),
            Some(Unusual::NoNumber) => eprintln!("step {}: is no number; passed over", step.index),
            None => {}
        }
        self.lines += &follow::line(&self.follower, &said, self.projection.as_ref()).to_string();
        self.lines.push('\n');
        said
    }

    /// Writes the stream and the pictures of the floors, and tells.
    pub fn finish(self, recording: &Recording, folder: &Path, quiet: bool) -> Result<(), Error> {
        if self.follower.path().is_empty() {
            return Err(Error::new("there are no steps to follow in the building"));
        }
        file::folder(folder)?;
        file::write(&folder.join(STREAM), self.lines.as_bytes())?;
        let mut files = vec![STREAM.to_owned()];
        let truth = summary::truth(&self.follower, recording);
        let way: Vec<_> = truth.into_iter().flat_map(|truth| &truth.poses).map(|pose| pose.position).collect();
        for (index, floor) in self.follower.building().floors.iter().enumerate() {
            let drawing = picture::draw(&self.follower, index, &way);
            let name = |kind: &str| format!("floor{}.{kind}", floor.number);
            file::write(&folder.join(name("svg")), drawing.as_bytes())?;
            file::write(&folder.join(name("png")), &png::render(&drawing)?)?;
            files.extend([name("svg"), name("png")]);
        }
        if quiet {
            return Ok(());
        }
        let judged = truth.map(|truth| format!("\n{}", summary::judged(&self.follower, truth))).unwrap_or_default();
        let told = summary::told(&self.follower);
        print(&format!("\n{told}{judged}\n{}: {}\n", folder.display(), files.join(", ")))
    }
}
