//! `sohle replay`: a recorded walk, tracked and written; judged if the recording knows the truth.

use super::fixes::{Source, alone, incoming};
use super::located::{Following, InBuilding, building, finish_and_tell};
use super::phone::Replay;
use super::report::{Report, Settings};
use super::{Error, Output, convert, parameters, print, shown, window};
use crate::calibration;
use crate::fixes::line::Clock;
use crate::fixes::smoother;
use crate::recording::{self, Profile};
use crate::{particle, phone, toml_file};
use std::path::PathBuf;
use std::sync::Arc;

/// Tracks a recorded walk
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Writes track.svg, track.png, track.geojson, steps.csv, parameters.toml and recording.mcap. A recording\n\
that holds its truth (of 'sohle demo' or 'sohle simulate') is judged by it. Then the window shows the walk, where there\n\
is a display.\n\n\
Examples:\n  sohle replay walk.csv --compare\n  sohle replay sohle-out/demo/recording.mcap --out again\n  \
sohle replay walk.mcap --parameters mine.toml --origin 48.2087,16.3726,35\n  \
sohle replay walk.mcap --building buildings/twin.geojson --start entrances --fixes positions.jsonl"
)]
pub struct Args {
    /// The recording: MCAP of this program, any layout that --profile can name, or a walk with a phone
    file: PathBuf,
    /// How the file is laid out; recognised from the content when left out
    #[arg(long, value_name = "NAME|FILE.toml", long_help = convert::long_help())]
    profile: Option<String>,
    /// Settings of the tracker as 'sohle parameters' prints them, or of a phone's steps; others keep their default
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// What 'sohle calibrate' found of the sensor; every sample is corrected by it before it is tracked
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,
    /// Tracks with the settings of the source document too, side by side
    #[arg(long)]
    compare: bool,
    /// Positions and ranges of other sources, a JSON object to a line (docs/fixes.md); '-' is the standard input. They are
    /// written into the recording, and come in place of those that it brings along
    #[arg(long, value_name = "FILE|-")]
    fixes: Option<Source>,
    /// Opens no window at the end; without a display there is none anyway
    #[arg(long)]
    headless: bool,
    #[command(flatten)]
    place: InBuilding,
    #[command(flatten)]
    output: Output,
}

/// Reads, tracks, tells and writes.
pub fn run(args: Args) -> Result<(), Error> {
    let Args { file, profile, parameters, calibration, compare, fixes, headless, place, output } = args;
    let quiet = output.quiet || place.how.wanted.takes_stdout();
    if phone::open::is_phone(&file) {
        let useless = [("--profile", profile.is_some()), ("--calibration", calibration.is_some())];
        if let Some((option, _)) = useless.into_iter().find(|(_, given)| *given) {
            return Err(Error::new(format!(
                "{option} is for recordings of a shoe; {} is one of a phone",
                file.display()
            )));
        }
        let following = place.prepare(particle::Parameters::phone())?.map(Following::keeping_all);
        let chosen: phone::Parameters = match &parameters {
            Some(path) => toml_file::read("settings of the steps of a phone", path)?,
            None => phone::Parameters::default(),
        };
        let walk = shown::Walk { phone: chosen.clone(), ..shown::Walk::of(file.clone(), following.as_ref()) };
        let fixes = fixes.as_ref();
        let replay = Replay { file: &file, parameters: chosen, compare, following, fixes, output: &output, quiet };
        let heard = replay.run()?;
        if window::is_wanted(headless, quiet) {
            window::show(shown::Walk { fixes: heard.map(Arc::from), ..walk });
        }
        return Ok(());
    }
    let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut settings = vec![match &parameters {
        Some(path) => Settings { label: stem(path), parameters: parameters::read(path)?, ..Settings::default() },
        None => Settings::default(),
    }];
    if compare {
        settings.push(Settings::documented());
    }
    let calibration = calibration.as_deref().map(calibration::read).transpose()?;
    let profile = profile.map(|text| Profile::parse(&text)).transpose()?;
    let mut recording = recording::open(&file, profile.as_ref())?;
    let (particle, positions) = if recording.is_of_phone() {
        (particle::Parameters::phone(), smoother::Parameters::phone())
    } else {
        Default::default()
    };
    let mut following = place.prepare(particle)?.map(Following::keeping_all);
    let again = recording.again;
    if let Some(again) = &again
        && !quiet
    {
        print(&format!("{again}\n"))?;
    }
    let folder = output.folder(&stem(&file));
    let clock = Clock::of_past(recording.began_us());
    let said = (fixes.as_ref(), &recording.fixes[..]);
    let mut incoming = incoming(said, building(following.as_ref()), clock, &positions, quiet)?;
    if let Some(incoming) = incoming.as_ref().filter(|_| fixes.is_some()) {
        recording.fixes = incoming.fixes().to_vec();
    }
    if let Some(following) = &mut following {
        following.hearing(incoming.take());
    }
    let walk = shown::Walk {
        profile,
        tracker: settings.first().map(|settings| settings.parameters).unwrap_or_default(),
        calibration,
        fixes: fixes.is_some().then(|| recording.fixes.as_slice().into()),
        ..shown::Walk::of(file, following.as_ref())
    };
    let recording = Report {
        title: recording.name.clone(),
        recording,
        calibration,
        settings,
        folder: &folder,
        origin: output.origin,
        following: following.as_mut(),
        quiet,
    }
    .run()?;
    if let Some(following) = following {
        finish_and_tell(following, Some(&recording), &folder, quiet)?;
    }
    alone(incoming, &recording.steps, &folder, quiet)?;
    if window::is_wanted(headless, quiet) {
        window::show(walk);
    }
    match again {
        Some(again) if !again.is_whole() => Err(Error::new(format!("computed again, the steps differ: {again}"))),
        _ => Ok(()),
    }
}
