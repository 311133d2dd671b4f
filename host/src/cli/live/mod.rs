//! `sohle live`: a shoe's steps as they come, and everything it says in a recording.

mod listening;
mod places;
mod positions;
mod show;
mod words;

pub use listening::Listening;
pub use places::{Places, Told};
pub use positions::Positions;
pub use show::Show;

use super::fixes::Source;
use super::located::InBuilding;
use super::shown::{Enough, Shoe, Watched};
use super::{Error, parameters, window};
use crate::calibration;
use crate::link::recorder::Recorder;
use crate::link::{Address, Connection};
use clap::ValueEnum;
use sohle_shared::wire::transfer::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Shows a shoe's steps as they come and records what it says
#[derive(Debug, clap::Args)]
#[command(
    after_help = "The window shows it where there is a display, unless --headless or --quiet is given; closing it ends it, as\n\
Ctrl-C does. The port is opened anew as often as needed; steps that the shoe made meanwhile follow then.\n\
'sohle replay' takes the recording; with --raw it computes the steps again from the sensor's counts and tells whether\n\
they are the same.\n\n\
Examples:\n  sohle live serial:/dev/ttyACM0\n  sohle live tcp:127.0.0.1:7700 --raw --out walk.mcap\n  \
sohle live serial:/dev/ttyACM0 --building buildings/twin.geojson --start entrances --serve 8765"
)]
pub struct Args {
    /// Where the shoe is: a serial port, at 921600 baud unless it says otherwise, a network port, or a shoe on Bluetooth by name,
    /// address or 'any'
    #[arg(value_name = "serial:PATH[@BAUD]|tcp:HOST:PORT|ble:SHOE")]
    address: Address,
    /// The recording [default: sohle-live-TIME.mcap]
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "no_record")]
    out: Option<PathBuf>,
    /// Records nothing
    #[arg(long)]
    no_record: bool,
    /// Records the counts of the sensor at its full rate too; the shoe's tracker starts anew for it
    #[arg(long, conflicts_with = "no_record")]
    raw: bool,
    /// Gives the shoe these settings of its tracker first
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Gives the shoe this calibration of its sensor first
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,
    /// Ends after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    duration: Option<f64>,
    /// Ends after so many steps
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Opens no window; without a display there is none anyway
    #[arg(long)]
    headless: bool,
    /// How steps and summary are told
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    #[command(flatten)]
    place: InBuilding,
    /// Positions and ranges of other sources, a JSON object to a line (docs/fixes.md): of a file, the standard input, or
    /// datagrams to HOST:PORT
    #[arg(long, value_name = "FILE|-|udp:HOST:PORT")]
    fixes: Option<Source>,
    /// Draws the floors with the walk into this folder at the end
    #[arg(long, value_name = "DIR", requires = "building")]
    pictures: Option<PathBuf>,
    /// Tells nothing but the summary and errors
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A line for each step, for people
    #[default]
    Table,
    /// A JSON object in each line
    Json,
}

/// How soon Ctrl-C is noticed.
const LOOK: Duration = Duration::from_millis(100);

/// Connects, shows, records.
pub fn run(args: Args) -> Result<(), Error> {
    let mut values = Vec::new();
    if let Some(path) = &args.parameters {
        values.push(Value::Parameters(parameters::read(path)?));
    }
    if let Some(path) = &args.calibration {
        values.push(Value::Calibration(calibration::read(path)?));
    }
    let until = match args.duration {
        Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
            return Err(Error::new(format!("--for {seconds}: expected more than 0 seconds")));
        }
        seconds => seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds)),
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;

    let mut places = Places::prepare(&args.place)?;
    let hear = |source| Positions::prepare(source, places.as_mut(), args.quiet);
    let positions = args.fixes.as_ref().map(hear).transpose()?;
    let start = places.as_ref().map(|places| places.follower().settings().start.clone()).unwrap_or_default();
    let recording = if args.no_record { None } else { Some(path(args.out.as_deref())) };
    let recorder = recording.as_deref().map(begin).transpose()?;
    let opened = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let connection = Connection::open(args.address.clone());
    let opened_us = i64::try_from(opened.as_micros()).unwrap_or_default();
    let show = Show::new(&args, recorder, (places, positions), opened_us);
    show.head()?;
    let listening = Listening::new(connection, show, values, args.raw);
    let steps = args.steps;
    let enough: Enough = Box::new(move |show| {
        let walked = steps.is_some_and(|steps| show.steps >= steps);
        walked || stop.load(Ordering::Relaxed) || until.is_some_and(|until| Instant::now() >= until)
    });
    let shoe = Shoe { address: args.address.clone(), start, recording, listening };
    let (listening, result) = if window::is_wanted(args.headless, args.quiet) {
        match window::watch(shoe, enough)? {
            Watched::Whole(listening) => (*listening, Ok(())),
            Watched::Unopened(error, shoe, enough) => {
                eprintln!("{error}");
                listen(shoe.listening, enough)
            }
        }
    } else {
        listen(shoe.listening, enough)
    };
    let (connection, show) = listening.into_parts();
    show.finish(&connection)?;
    result
}

/// Listens until it is enough.
fn listen(mut listening: Listening, mut enough: Enough) -> (Listening, Result<(), Error>) {
    while !enough(listening.show()) {
        if let Err(error) = listening.turn(LOOK, |_, _| {}) {
            return (listening, Err(error));
        }
    }
    listening.take_leave();
    (listening, Ok(()))
}

/// The recording that was asked for, or one that says when it was begun.
fn path(asked: Option<&Path>) -> PathBuf {
    asked.map_or_else(
        || {
            let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
            PathBuf::from(format!("sohle-live-{}.mcap", since.as_secs()))
        },
        Path::to_path_buf,
    )
}

fn begin(path: &Path) -> Result<Recorder, Error> {
    // What was heard once comes never again.
    if path.is_file() {
        return Err(Error::new(format!("{} is there already; a live recording replaces nothing", path.display())));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Recorder::begin(path, &name)?)
}
