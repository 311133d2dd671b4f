//! `sohle calibrate`: from a sensor that was laid down in twelve attitudes to its calibration and a verdict on it.

use super::table::Table;
use super::{Error, command, convert, print, progress};
use crate::calibration::{Conclusion, Line, Session};
use crate::export::file;
use crate::gravity::Place;
use crate::link::address::AddressError;
use crate::link::connection::Happening;
use crate::link::event::Event;
use crate::link::raw::Samples;
use crate::link::{Address, Connection};
use crate::recording::{self, Profile, Recording};
use crate::simulation::sensor::G_M_S2;
use indicatif::ProgressIterator;
use sohle_shared::calibration::{Grade, Parameters};
use sohle_shared::wire::message::Action;
use sohle_shared::wire::transfer::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How soon Ctrl-C is noticed.
const LOOK: Duration = Duration::from_millis(100);

/// Finds the constants of a sensor from it at rest, live or recorded, and tells whether it is good enough
#[derive(Debug, clap::Args)]
#[command(
    after_help = "With a shoe in place of a recording it says what to do next, and the shoe keeps a calibration that is good enough.\n\n\
How to record: let the sensor run for some minutes, then lay it down on a firm table for 4 seconds in each of\n\
twelve attitudes, in any order, and let go of it each time: each of its six sides up, then leaning on six edges, halfway\n\
between two sides (+x and +y, +x and -y, +x and +z, +x and -z, +y and +z, -y and +z up). A few degrees do not matter.\n\n\
The exit code is 0 if the sensor is good or acceptable, and 1, with the reason in one line, if it is not or if too little\n\
was shown. What could be computed is written all the same.\n\n\
Examples:\n  sohle calibrate serial:/dev/ttyACM0\n  sohle calibrate rests.mcap --out mine.toml --gravity-at 48.2,170\n  \
sohle replay walk.mcap --calibration mine.toml\n  \
sohle simulate --preset calibration --seed 3 --out rests.mcap; sohle calibrate rests.mcap"
)]
pub struct Args {
    /// The recording of the rests, or the shoe: a serial port or a network port
    #[arg(value_name = "FILE|serial:PATH[@BAUD]|tcp:HOST:PORT|ble:SHOE")]
    source: Source,
    /// How the file is laid out; recognised from the content when left out
    #[arg(long, value_name = "NAME|FILE.toml", long_help = convert::long_help())]
    profile: Option<String>,
    /// File of the calibration; one that is there is replaced [default: sohle-out/, the recording's name, calibration.toml]
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Gravity where it was recorded, in m/s²
    #[arg(long, value_name = "M_S2", default_value_t = G_M_S2, value_parser = gravity)]
    gravity: f64,
    /// Where it was recorded, in place of --gravity: latitude in degrees, height in metres
    #[arg(long, value_name = "LAT[,HEIGHT_M]", allow_hyphen_values = true, conflicts_with = "gravity")]
    gravity_at: Option<Place>,
    /// Says nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Where the samples come from.
#[derive(Clone, Debug)]
enum Source {
    File(PathBuf),
    Shoe(Address),
}

impl std::str::FromStr for Source {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        if Address::is_meant(text) { text.parse().map(Self::Shoe) } else { Ok(Self::File(text.into())) }
    }
}

/// Gravity of some place on Earth, a mountain or a mine included.
fn gravity(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (9.7..=9.9).contains(value));
    value.ok_or_else(|| "expected 9.7 to 9.9 m/s²".to_owned())
}

/// Reads, calibrates, tells, writes.
pub fn run(args: Args) -> Result<(), Error> {
    let Args { source, profile, out, gravity, gravity_at, quiet } = args;
    let profile = profile.map(|text| Profile::parse(&text)).transpose()?;
    let gravity = gravity_at.map_or(gravity, |place| place.gravity());
    let (name, shown, conclusion, connection) = match source {
        Source::File(file) => {
            let recording = recording::open(&file, profile.as_ref())?;
            let name = file.file_stem().unwrap_or_default().to_owned();
            (name, file.display().to_string(), calibrate(&recording, gravity, quiet)?, None)
        }
        Source::Shoe(address) => {
            let mut connection = Connection::open(address).leaving_steps();
            let conclusion = live(&mut connection, gravity, quiet)?;
            ("shoe".into(), "the shoe".into(), conclusion, Some(connection))
        }
    };
    if conclusion.is_computed() {
        if !quiet {
            print(&report(&conclusion, gravity))?;
        }
        let out = out.unwrap_or_else(|| Path::new("sohle-out").join(&name).join("calibration.toml"));
        if let Some(folder) = out.parent() {
            file::folder(folder)?;
        }
        file::write(&out, toml::to_string(&conclusion.calibration)?.as_bytes())?;
        if !quiet {
            print(&format!("Written to {}\n", out.display()))?;
        }
    }
    if let Some(fault) = conclusion.fault() {
        return Err(Error::new(format!("{shown}: {fault}")));
    }
    if let Some(mut connection) = connection {
        connection.write(&Value::Calibration(conclusion.calibration), &mut |_, _| {})?;
        if !quiet {
            print("The shoe keeps it.\n")?;
        }
    }
    Ok(())
}

/// Leads a person through the attitudes by what the shoe shows, until all are there or Ctrl-C.
fn live(connection: &mut Connection, gravity: f64, quiet: bool) -> Result<Conclusion, Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    command::connect(connection)?;
    let mut session = Session::new(&Parameters::default(), gravity);
    let mut samples = Samples::default();
    let mut fault = None;
    let mut take = |happening: Happening| {
        let Happening::Event(Event::Raw(raw)) = happening else { return };
        samples.take(&raw.item, |sample, temperature| {
            for line in session.push(sample, temperature) {
                if !quiet && let Err(error) = print(&format!("{line}\n")) {
                    fault = Some(error);
                }
            }
        });
        if session.is_complete() {
            stop.store(true, Ordering::Relaxed);
        }
    };
    connection.ask(Action::Raw(true), &mut |happening, _| take(happening))?;
    while !stop.load(Ordering::Relaxed) {
        if let Some(happening) = connection.next(LOOK) {
            take(happening);
        }
    }
    connection.ask(Action::Raw(false), &mut |_, _| {})?;
    match fault {
        Some(error) => Err(error),
        None => Ok(session.conclusion()),
    }
}

/// Feeds the whole recording to a session and tells what became of each rest.
fn calibrate(recording: &Recording, gravity: f64, quiet: bool) -> Result<Conclusion, Error> {
    let mut session = Session::new(&Parameters::default(), gravity);
    let bar = progress(recording.samples.len() as u64, "calibrating", quiet);
    for sample in recording.samples.iter().progress_with(bar.clone()) {
        for line in session.push(sample, None) {
            if !quiet && matches!(line, Line::Event { .. }) {
                bar.suspend(|| print(&format!("{line}\n")))?;
            }
        }
    }
    Ok(session.conclusion())
}

/// What was found, against its limits, and what follows from it.
fn report(conclusion: &Conclusion, gravity: f64) -> String {
    let mut table = Table::new("property", &["value", "good up to", "unit", "grade"]);
    let mut advice = String::new();
    for finding in conclusion.verdict.findings() {
        let figure = |value: f32| format!("{value:.3}");
        let cells = vec![
            figure(finding.shown()),
            figure(finding.limit()),
            finding.unit().to_owned(),
            finding.grade.to_string(),
        ];
        table.row(finding.name(), cells);
        if let Some(why) = finding.advice() {
            advice += &format!("{}: {why}\n", finding.name());
        }
    }
    let whole = match conclusion.verdict.grade() {
        Grade::Good => "The sensor is good.",
        Grade::Acceptable => "The sensor is good enough.",
        Grade::Bad => "This calibration is not good enough to be used.",
    };
    let unseen = conclusion.unseen().map_or_else(String::new, |unseen| format!("The sensor was {unseen}.\n"));
    format!("\n{}\n{advice}{unseen}{whole} Gravity was taken as {gravity:.4} m/s².\n", table.text())
}
