//! `sohle demo`: a simulated walk in a building, tracked, followed, judged and written; nothing is needed for it.

use super::located::{Following, How, finish_and_tell};
use super::report::{Report, Settings};
use super::{Error, Output, progress, report, shown, window};
use crate::building::open::{Options, open};
use crate::building::{Building, geojson, route};
use crate::export::file;
use crate::particle::Parameters;
use crate::recording;
use crate::simulation::{Route, Scenario, output};
use std::path::PathBuf;

/// Simulates a walk in a building, tracks it, follows it on the plan, compares it with the truth (what 'sohle' alone does)
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Writes the floors with the walk on them (floor0.png, floor1.png, as SVG too), places.jsonl, the track by\n\
itself (track.svg, track.png, track.geojson, steps.csv, parameters.toml; the last two also for the documented\n\
settings) and recording.mcap; then the window shows the walk, where there is a display. Needs no network.\n\n\
Examples:\n  sohle demo\n  sohle demo --seed 7 --out /tmp/walk\n  sohle demo --start W02 --track walk.geojson\n  \
sohle demo --building buildings/large.geojson --route 'F0/101,stairs,F1/101'\n  sohle demo --no-building"
)]
pub struct Args {
    /// Opens no window at the end; without a display there is none anyway
    #[arg(long)]
    pub headless: bool,
    /// Seed of the walker's and the sensor's chance; the same seed gives the same files
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Walks in this building instead of the one that the program brings along
    #[arg(long, value_name = "FILE|DIR", requires = "route")]
    building: Option<PathBuf>,
    /// Walks from room to room, as 'sohle simulate --route' does
    #[arg(long, value_name = "ROOM,ROOM,...", value_delimiter = ',')]
    route: Vec<String>,
    /// Walks in no building: both paces, a run, side steps, stairs, an elevator; tracked by the steps alone
    #[arg(long, conflicts_with_all = ["building", "route", "start", "particle", "particle_seed", "floor_mode", "track",
        "places", "serve"])]
    no_building: bool,
    #[command(flatten)]
    how: How,
    #[command(flatten)]
    output: Output,
}

/// One true pose is kept for so many samples: a hundred in a second.
const THINNING: u32 = 20;

/// The building that is committed with the program: a twin of the document's.
const TWIN: &str = include_str!("../../../buildings/twin.geojson");
const TWIN_FILE: &str = "buildings/twin.geojson";
/// From one wing up the stairs to the other, and down by the elevator.
const TWIN_ROUTE: [&str; 7] = ["W02", "hall", "stairs-E", "E14", "W16", "elevator", "E05"];

/// Simulates, tracks, follows, tells and writes.
pub fn run(args: Args) -> Result<(), Error> {
    let Args { seed, output: Output { origin, .. }, .. } = args;
    let quiet = args.output.quiet || args.how.wanted.takes_stdout();
    let (scenario, title, mut following) = if args.no_building {
        (Scenario::demo(), format!("A simulated walk with stairs, seed {seed}"), None)
    } else {
        let building = building(&args)?;
        let stops: Vec<&str> = match args.route[..] {
            [] => TWIN_ROUTE.to_vec(),
            _ => args.route.iter().map(String::as_str).collect(),
        };
        let route = Route::through(&building, &route::plan(&building, &stops)?)?;
        let title = format!("A simulated walk in {}, seed {seed}", building.name);
        let following = args.how.follow(building, Parameters::default())?.keeping_all();
        (Scenario { route, ..Scenario::default() }, title, Some(following))
    };
    let scenario = Scenario { seed, ..scenario };
    let folder = args.output.folder("demo");
    file::folder(&folder)?;
    // What is tracked is read back from the file: a simulated walk takes the way of every recording.
    let path = folder.join(report::RECORDING);
    let bar = progress(scenario.length()? as u64, "simulating", quiet);
    output::write(&scenario, &path, THINNING, |second| bar.set_position(second))?;
    bar.finish_and_clear();
    let recording = recording::open(&path, None)?;
    let settings = vec![Settings::default(), Settings::documented()];
    let report = Report {
        title,
        recording,
        calibration: None,
        settings,
        folder: &folder,
        origin,
        following: following.as_mut(),
        quiet,
    };
    let recording = report.run()?;
    let walk = shown::Walk::of(path, following.as_ref());
    following.map_or(Ok(()), |following: Following| finish_and_tell(following, Some(&recording), &folder, quiet))?;
    if window::is_wanted(args.headless, quiet) {
        window::show(walk);
    }
    Ok(())
}

/// The building to walk in.
fn building(args: &Args) -> Result<Building, Error> {
    Ok(match &args.building {
        Some(path) => open(path, &Options::default())?,
        None => geojson::parse(TWIN, TWIN_FILE)?,
    })
}
