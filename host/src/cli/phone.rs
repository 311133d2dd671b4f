//! What `replay` does with a recording of a phone: its steps go the same way as those of a shoe.

use super::fixes::Source;
use super::located::{Following, building, finish_and_tell};
use super::report::RECORDING;
use super::table::Table;
use super::{Error, Output, fixes, print};
use crate::export::picture::{Line, Picture, Placement, Role};
use crate::export::{self, Named};
use crate::fixes::Fix;
use crate::fixes::line::Clock;
use crate::fixes::smoother;
use crate::phone::{self, Parameters};
use crate::recording::{Recording, mcap};
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
        let mut settings = vec![(Role::Chosen, "default", self.parameters)];
        if self.compare {
            settings.push((Role::Documented, "documented", Parameters::documented()));
        }
        let name = self.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let samples = phone::open::open(self.file)?.samples;
        let walk = |parameters| Recording::of_phone_samples(name.clone(), &samples, parameters);
        let walks: Vec<Recording> = settings.iter().map(|(_, _, parameters)| walk(parameters)).collect();
        let tracks: Vec<Track> = walks.iter().map(|walk| Track::of_steps(&walk.steps)).collect();
        let texts = settings.iter().map(|(_, _, parameters)| toml::to_string(parameters));
        let texts: Vec<String> = texts.collect::<Result<_, _>>()?;
        let folder = self.output.folder(&name);
        let mut table = Table::new("settings", &["steps", "distance, m"]);
        let mut picture = Picture::new(name);
        picture.note = "steps of a phone, counted, their length estimated".into();
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
        let mut files = export::write_all(&folder, &picture, &named, self.output.origin)?;
        if !self.quiet {
            print(&format!("{}\n{}\n\n{}\n", picture.title, picture.note, table.text()))?;
        }
        let Some(mut walk) = walks.into_iter().next() else { return Ok(None) };
        let (clock, settings) = (Clock::of_past(walk.began_us()), smoother::Parameters::phone());
        let mut incoming =
            fixes::incoming((self.fixes, &[]), building(self.following.as_ref()), clock, &settings, self.quiet)?;
        let heard = incoming.as_ref().map(|incoming| incoming.fixes().to_vec());
        walk.fixes = heard.clone().unwrap_or_default();
        let mut following = self.following;
        if let Some(following) = &mut following {
            following.hearing(incoming.take());
            for step in &walk.steps {
                following.step(step, walk.began_us().map(|began| began + step.stance_end.0));
            }
        }
        let (building, moments) = following.as_ref().map(Following::shown).unwrap_or_default();
        mcap::write_shown(&folder.join(RECORDING), &walk, &building, moments)?;
        files.push(RECORDING.to_owned());
        if !self.quiet {
            print(&format!("Written to {}: {}\n", folder.display(), files.join(", ")))?;
        }
        if let Some(following) = following {
            finish_and_tell(following, None, &folder, self.quiet)?;
        }
        fixes::alone(incoming, &walk.steps, &folder, self.quiet)?;
        Ok(heard)
    }
}
