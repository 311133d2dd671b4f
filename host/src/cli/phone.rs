//! What `replay` does with a recording of a phone: its steps go the same way as those of a shoe.

use super::fixes::Source;
use super::located::{Following, building, finish_and_tell};
use super::table::Table;
use super::{Error, Output, fixes, print};
use crate::export::picture::{Line, Picture, Placement, Role};
use crate::export::{self, Named};
use crate::fixes::Fix;
use crate::fixes::line::Clock;
use crate::fixes::smoother;
use crate::phone::{self, Parameters};
use crate::track::Track;
use std::path::Path;

/// A recording of a phone, and what is to be done with it.
pub struct Replay<'a> {
    /// The recording.
    pub file: &'a Path,
    /// Settings of the steps.
    pub parameters: Parameters,
    /// Also with the step length of the source document.
    pub compare: bool,
    /// Who is followed, if there is a building.
    pub following: Option<Following>,
    /// Positions of other sources.
    pub fixes: Option<&'a Source>,
    /// Where the results go.
    pub output: &'a Output,
    /// Tells nothing.
    pub quiet: bool,
}

impl Replay<'_> {
    /// Reads, finds the steps, tells and writes. The positions of other sources that were heard, if there were some.
    pub fn run(self) -> Result<Option<Vec<Fix>>, Error> {
        let recording = phone::open::open(self.file)?;
        let mut settings = vec![(Role::Chosen, "default", self.parameters)];
        if self.compare {
            settings.push((Role::Documented, "documented", Parameters::documented()));
        }
        let tracks: Vec<Track> = settings
            .iter()
            .map(|(_, _, parameters)| Track::of_steps(&phone::steps(&recording.samples, parameters)))
            .collect();
        let texts = settings.iter().map(|(_, _, parameters)| toml::to_string(parameters));
        let texts: Vec<String> = texts.collect::<Result<_, _>>()?;
        let name = self.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = self.output.folder(&name);
        let mut table = Table::new("settings", &["steps", "distance, m"]);
        let mut picture = Picture::new(name);
        picture.note = format!("{} samples of a phone; steps counted, their length estimated", recording.samples.len());
        picture.columns = table.headings().to_vec();
        let named: Vec<Named<'_>> = settings
            .iter()
            .zip(tracks.iter().zip(&texts))
            .map(|((role, label, _), (track, parameters))| {
                let placement = Placement::default();
                Named { role: *role, label, track, parameters, placement }
            })
            .collect();
        for named in &named {
            let cells = vec![named.track.steps.len().to_string(), format!("{:.1}", named.track.distance())];
            picture.lines.push(Line::of(named, cells.clone()));
            table.row(named.label, cells);
        }
        let files = export::write_all(&folder, &picture, &named, self.output.origin)?;
        if !self.quiet {
            print(&format!("{}\n{}\n\n{}\n", picture.title, picture.note, table.text()))?;
            print(&format!("Written to {}: {}\n", folder.display(), files.join(", ")))?;
        }
        let Some(track) = tracks.first() else { return Ok(None) };
        // The clock of a phone counts from 1970.
        let (clock, settings) = (Clock::of_past(Some(0)), smoother::Parameters::phone());
        let incoming =
            fixes::incoming((self.fixes, &[]), building(self.following.as_ref()), clock, &settings, self.quiet)?;
        let heard = incoming.as_ref().map(|incoming| incoming.fixes().to_vec());
        let Some(mut following) = self.following else {
            fixes::alone(incoming, &track.steps, &folder, self.quiet)?;
            return Ok(heard);
        };
        following.hearing(incoming);
        for step in &track.steps {
            following.step(step, None);
        }
        finish_and_tell(following, None, &folder, self.quiet)?;
        Ok(heard)
    }
}
