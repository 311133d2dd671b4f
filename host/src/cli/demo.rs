//! `sohle demo`: a simulated walk, tracked, judged and written; nothing is needed for it.

use super::report::{Report, Settings};
use super::{Error, Output};
use super::{progress, report};
use crate::export::file;
use crate::recording;
use crate::simulation::{Scenario, output};

/// Simulates a walk with stairs, tracks it, compares it with the truth (what 'sohle' alone does)
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Writes track.svg, track.png, track.geojson, steps.csv, parameters.toml (the last two also for the\n\
documented settings) and recording.mcap. Needs no network and no display.\n\n\
Examples:\n  sohle demo\n  sohle demo --seed 7 --out /tmp/walk"
)]
pub struct Args {
    /// Opens no window. There is no window yet: today this changes nothing
    #[arg(long)]
    pub headless: bool,
    /// Seed of the walker's and the sensor's chance; the same seed gives the same files
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    output: Output,
}

/// One true pose is kept for so many samples: a hundred in a second.
const THINNING: u32 = 20;

/// Simulates, tracks, tells and writes.
pub fn run(args: Args) -> Result<(), Error> {
    let Args { seed, output: Output { quiet, origin, .. }, .. } = args;
    let folder = args.output.folder("demo");
    file::folder(&folder)?;
    // What is tracked is read back from the file: a simulated walk takes the way of every recording.
    let path = folder.join(report::RECORDING);
    let scenario = Scenario { seed, ..Scenario::demo() };
    let bar = progress(scenario.length()? as u64, "simulating", quiet);
    output::write(&scenario, &path, THINNING, |second| bar.set_position(second))?;
    bar.finish_and_clear();
    let recording = recording::open(&path, None)?;
    let settings = vec![Settings::default(), Settings::documented()];
    let title = format!("A simulated walk with stairs, seed {seed}");
    Report { title, recording, calibration: None, settings, folder: &folder, origin, following: None, quiet }.run()?;
    Ok(())
}
