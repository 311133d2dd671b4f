//! `sohle window`: the building, the person, the shoe and every signal, live and in replay.

use super::shown::{Enough, Shoe, Walk, Watched};
use super::table::Table;
use super::{Error, fixes, print, progress};
use crate::building::generate;
use crate::export::file;
use crate::follow;
use crate::link::Address;
use crate::recording::Profile;
use crate::window::engine::live::{End, Live};
use crate::window::engine::walk::Settings;
use crate::window::engine::{Opening, Plan, Positions, Source, What};
use crate::window::gpu::offscreen::{Sheet, Studio};
use crate::window::layout::{View, usual_file};
use crate::window::map::measure::measure as map_frames;
use crate::window::run::First;
use crate::window::shoes::PATIENCE;
use crate::window::{measure, picture, run, saving};
use crate::{calibration, particle, toml_file};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

/// Opens the window: plays recordings, or listens to shoes
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Without anything to show, the window asks for it. F1 tells what keys there are. Where the views are is kept\n\
from one run to the next.\n\n\
Examples:\n  sohle window sohle-out/demo/recording.mcap --building buildings/twin.geojson --start W02\n  \
sohle window tcp:127.0.0.1:7700 tcp:127.0.0.1:7701 --building buildings/twin.geojson\n  \
sohle window walk.mcap --picture window.png --at 30\n  \
sohle window --measure"
)]
pub struct Args {
    /// Recordings, or shoes as tcp:HOST:PORT or serial:PATH, which may be followed by @BAUD; each has its colour, the first
    /// is selected
    #[arg(value_name = "FILE|LINK")]
    what: Vec<String>,
    /// Follows the steps through this building: any format that 'sohle building show' takes
    #[arg(long, value_name = "FILE|DIR", requires = "what")]
    building: Option<PathBuf>,
    /// Where the walk begins: anywhere, entrances, a room or an entrance by its name, FLOOR,X,Y or FLOOR,X,Y,HEADING_DEG [default: anywhere]
    #[arg(long, value_name = "WHERE", allow_hyphen_values = true, requires = "building")]
    start: Option<String>,
    /// How the recording is laid out; recognised from the content when left out
    #[arg(long, value_name = "NAME|FILE.toml", requires = "what")]
    profile: Option<String>,
    /// Settings of the tracker as 'sohle parameters' prints them
    #[arg(long, value_name = "FILE.toml", requires = "what")]
    parameters: Option<PathBuf>,
    /// Settings of the particle filter; others keep their default
    #[arg(long, value_name = "FILE.toml", requires = "building")]
    particle: Option<PathBuf>,
    /// What 'sohle calibrate' found of the sensor; every sample is corrected by it before it is tracked
    #[arg(long, value_name = "FILE.toml", requires = "what")]
    calibration: Option<PathBuf>,
    /// Positions and ranges of other sources, a JSON object to a line (docs/fixes.md): of a file or the standard input, of a
    /// shoe by datagrams to HOST:PORT too; they come in place of those that a recording brings along
    #[arg(long, value_name = "FILE|-|udp:HOST:PORT", requires = "what")]
    fixes: Option<fixes::Source>,
    /// Keeps where the views are in this file instead of the user's own; 'none' keeps nothing
    #[arg(long, value_name = "FILE.json|none")]
    layout: Option<PathBuf>,
    /// Closes the window after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    duration: Option<f64>,
    /// Draws the window into this file, and opens none; needs no display
    #[arg(long, value_name = "FILE.png", conflicts_with = "duration")]
    picture: Option<PathBuf>,
    /// The second of the recording that the picture shows [default: its end]; of a shoe, how long it is listened to
    #[arg(long, value_name = "SECONDS", requires = "picture")]
    at: Option<f64>,
    /// Size of the picture [default: 1280x800]
    #[arg(long, value_name = "WIDTHxHEIGHT", requires = "picture", value_parser = size)]
    size: Option<[f32; 2]>,
    /// A picture light on dark
    #[arg(long, requires = "picture")]
    dark: bool,
    /// Measures how long frames of the map take, against particles and buildings, and how long it takes from a step to its
    /// picture; needs no display
    #[arg(long, conflicts_with_all = ["what", "picture", "duration", "layout"])]
    measure: bool,
    /// Shows the plot of this number in front; may be repeated
    #[arg(long, value_name = "N", requires = "picture")]
    plot: Vec<usize>,
}

/// Least and most points of a picture along one side.
const SIDE: std::ops::RangeInclusive<f32> = 200.0..=8_000.0;

fn size(text: &str) -> Result<[f32; 2], String> {
    let sides = text.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sides
        .filter(|sides: &[f32; 2]| sides.iter().all(|side| SIDE.contains(side)))
        .ok_or_else(|| format!("expected WIDTHxHEIGHT, each from {} to {}", SIDE.start(), SIDE.end()))
}

/// Opens it, or draws it.
pub fn run(args: Args) -> Result<(), Error> {
    if args.measure {
        return measured();
    }
    let layout = match &args.layout {
        Some(path) if path.as_os_str() == "none" => None,
        Some(path) => Some(path.clone()),
        // A picture does not depend on who draws it.
        None if args.picture.is_some() => None,
        None => usual_file(),
    };
    if args.fixes.is_some() && args.what.len() > 1 {
        return Err(Error::new("--fixes says where one person is; expected one recording or one shoe"));
    }
    let openings = args.what.iter().map(|what| opening(&args, what)).collect::<Result<Vec<_>, _>>()?;
    let Some(path) = args.picture else {
        let duration = match args.duration {
            Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
                return Err(Error::new(format!("--for {seconds}: expected more than 0 seconds")));
            }
            seconds => seconds.map(Duration::from_secs_f64),
        };
        let first = openings.into_iter().map(|opening| First::Opening(Box::new(opening))).collect();
        return Ok(run::window(first, layout, duration)?);
    };
    let sheet = Sheet { size: args.size.unwrap_or([1280.0, 800.0]), pixels_per_point: 1.0, dark: args.dark };
    let views = args.plot.into_iter().map(View::Plot).collect();
    let drawn = picture::draw(picture::Wanted { openings, layout, at: args.at, views, sheet })?;
    let bytes = saving::rgba(drawn.size, &drawn.pixels).map_err(Error::new)?;
    Ok(file::write(&path, &bytes)?)
}

/// Whether a command is to show what it does: there is a display, and nobody wants to do without.
pub fn is_wanted(headless: bool, quiet: bool) -> bool {
    !headless && !quiet && run::has_display()
}

/// Shows a walk whose results are written. Without a window the results are still there.
pub fn show(walk: Walk) {
    let Walk { file, profile, tracker, phone, calibration, fixes, place } = walk;
    let (plan, follow) = place.unzip();
    let settings = Settings { tracker, follow: follow.unwrap_or_default(), calibration, ..Settings::default() };
    let opening = Opening {
        profile,
        building: plan.map(Plan::Read),
        settings,
        phone,
        positions: fixes.map(Positions::Read),
        ..Opening::of(What::Recording(file))
    };
    if let Err(error) = run::window(vec![First::Opening(Box::new(opening))], usual_file(), None) {
        eprintln!("{error}");
    }
}

/// Shows a shoe until it is enough, or until the window is closed.
pub fn watch(shoe: Shoe, enough: Enough) -> Result<Watched, Error> {
    let name = shoe.address.to_string();
    let held = Arc::new(Mutex::new(Some((shoe, enough))));
    let take = |held: &Mutex<Option<_>>| held.lock().unwrap_or_else(PoisonError::into_inner).take();
    let (told, ended) = mpsc::channel();
    let given = held.clone();
    let make = move || {
        // A window makes once what it shows.
        let (Shoe { address, start, recording, listening }, enough) = take(&given).expect("it is shown once");
        let end = End { enough, ended: Box::new(move |listening| drop(told.send(listening))) };
        Ok(Box::new(Live::of(address, listening, start, recording).until(end)) as Box<dyn Source>)
    };
    let opened = run::window(vec![First::Made(name, Box::new(make))], usual_file(), None);
    match (opened, take(&held)) {
        (Err(error), Some((shoe, enough))) => Ok(Watched::Unopened(Error::from(error), Box::new(shoe), enough)),
        (Err(error), None) => Err(Error::from(error)),
        (Ok(()), _) => match ended.recv_timeout(PATIENCE) {
            Ok(listening) => Ok(Watched::Whole(Box::new(listening))),
            Err(_) => Err(Error::new("what listens to the shoe did not end; the recording may not be whole")),
        },
    }
}

/// Numbers of particles that are measured.
const COUNTS: [usize; 5] = [1_000, 10_000, 50_000, 150_000, 500_000];
/// How large the map is while it is measured, as in a window of the usual size; and that window.
const MAP: Sheet = Sheet { size: [920.0, 560.0], pixels_per_point: 1.0, dark: false };
const WINDOW: Sheet = Sheet { size: [1280.0, 800.0], pixels_per_point: 1.0, dark: false };
/// A walk is played as fast as it is walked while steps are measured, and so many of them count.
const SPEED: f64 = 1.0;
const STEPS: usize = 100;

/// Measures, and tells what came of it.
fn measured() -> Result<(), Error> {
    let mut studio = Studio::new()?;
    print(&format!("drawn by {}\n\n", studio.adapter()))?;
    let buildings = [generate::twin(2), generate::institute(), generate::large(1)];
    let bar = progress((buildings.len() * COUNTS.len()) as u64, "drawing", false);
    let rows = map_frames(&mut studio, MAP, &buildings.each_ref(), &COUNTS, |_| bar.inc(1))?;
    bar.finish_and_clear();
    let mut table = Table::new(
        "frames of the map, ms",
        &["floors", "walls", "particles", "after a step", "turned", "nothing changes"],
    );
    for row in rows {
        let times = [row.stepping_ms, row.turning_ms, row.still_ms].map(|ms| format!("{ms:.2}"));
        let counts = [row.floors, row.walls, row.particles].map(|count| count.to_string());
        table.row(&row.building, counts.into_iter().chain(times).collect());
    }
    print(&format!("{}\n", table.text()))?;
    let bar = progress(STEPS as u64, "walking", false);
    let mut table = Table::new("from a step to its picture, ms", &["steps", "median", "99 of 100 within"]);
    for particles in measure::PARTICLES {
        let latency = measure::latency(&mut studio, WINDOW, particles, SPEED, STEPS, |steps| bar.set_position(steps))?;
        let times = [latency.median_ms, latency.p99_ms].map(|ms| format!("{ms:.1}"));
        let name = format!("{particles} particles");
        table.row(&name, std::iter::once(latency.steps.to_string()).chain(times).collect());
    }
    bar.finish_and_clear();
    print(&table.text())
}

fn opening(args: &Args, what: &str) -> Result<Opening, Error> {
    let path = PathBuf::from(what);
    let what = match what.parse::<Address>() {
        Ok(address) => What::Shoe(address),
        Err(error) if Address::is_meant(what) && !path.exists() => {
            return Err(Error::from(error));
        }
        Err(_) => What::Recording(path),
    };
    let usual = follow::Settings::default();
    let settings = Settings {
        tracker: args.parameters.as_deref().map(super::parameters::read).transpose()?.unwrap_or_default(),
        follow: follow::Settings {
            start: args.start.clone().unwrap_or_else(|| usual.start.clone()),
            particle: match &args.particle {
                Some(path) => toml_file::read("settings of the particle filter", path)?,
                None => particle::Parameters::default(),
            },
            ..usual
        },
        calibration: args.calibration.as_deref().map(calibration::read).transpose()?,
        ..Settings::default()
    };
    let profile = args.profile.as_deref().map(Profile::parse).transpose()?;
    let building = args.building.clone().map(Plan::File);
    let positions = args.fixes.clone().map(Positions::From);
    Ok(Opening { profile, building, settings, positions, ..Opening::of(what) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers() {
        assert_eq!(size("1280x800"), Ok([1280.0, 800.0]));
        for wrong in ["", "1280", "1280x", "0x800", "axb", "1280x99999", "NaNx800"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
