//! `sohle simulate`: a walk with the truth, as a recording.

use super::{Error, print};
use crate::building;
use crate::building::open::{Options, open};
use crate::recording::{self, Profile};
use crate::simulation::gait::Gait;
use crate::simulation::output;
use crate::simulation::peaks::Peaks;
use crate::simulation::{Leg, Orientation, Person, Route, Scenario, SensorModel, Simulation};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use sohle_shared::sample::ImuSample;
use std::path::PathBuf;

/// Simulates a walk with the sensor on the shoe and writes it with the truth
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    sohle simulate --preset demo --out walk.csv\n  \
    sohle simulate --gait run --person c --strides 50 --mounting x-up --out run.csv\n  \
    sohle simulate --preset endless --duration 86400 --out day.csv\n  \
    sohle simulate --preset demo --print > mine.toml; sohle simulate --scenario mine.toml --out walk.csv\n  \
    sohle simulate --building buildings/twin.geojson --route W02,hall,stairs,E14 --out walk.mcap\n  \
    sohle simulate --describe")]
pub struct Args {
    /// Scenario file
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["preset", "gait", "person"])]
    scenario: Option<PathBuf>,
    /// Ready-made scenario
    #[arg(long, value_enum, conflicts_with = "gait")]
    preset: Option<Preset>,
    /// Walks through this building: any format that 'sohle building show' takes
    #[arg(long, value_name = "FILE|DIR", requires = "route", conflicts_with_all = ["scenario", "preset", "gait"])]
    building: Option<PathBuf>,
    /// The way: rooms, and between them stairs, ramp, elevator or the name of one
    #[arg(long, value_name = "ROOM,ROOM,...", requires = "building", value_delimiter = ',')]
    route: Vec<String>,
    /// Only this, around a rectangle of corridors or back and forth [default: the demo]
    #[arg(long, value_enum)]
    gait: Option<Motion>,
    /// Who walks
    #[arg(long, value_enum)]
    person: Option<Who>,
    /// Number of strides after which the person stops
    #[arg(long, value_name = "N")]
    strides: Option<u32>,
    /// Length of the recording in seconds
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// All that is random follows from it
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// How the sensor sits on the shoe
    #[arg(long, value_enum)]
    mounting: Option<Orientation>,
    /// Which sensor
    #[arg(long, value_enum)]
    sensor: Option<Sensor>,
    /// Where to write: a table of samples and truth, or a recording
    #[arg(long, value_name = "FILE.csv|FILE.mcap")]
    out: Option<PathBuf>,
    /// Prints the scenario instead of simulating it
    #[arg(long, conflicts_with = "describe")]
    print: bool,
    /// True pose of every Nth sample only
    #[arg(long, value_name = "N", default_value_t = 1)]
    thinning: u32,
    /// Prints how violent the gait in recordings is, or, without a file, each gait of the simulation
    #[arg(long, value_name = "FILE", num_args = 0..)]
    describe: Option<Vec<PathBuf>>,
    /// Layout of the recordings to describe: a name, or a file that describes it
    #[arg(long, value_name = "NAME|FILE.toml", requires = "describe")]
    profile: Option<String>,
}

/// Ready-made scenarios.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Preset {
    /// Some minutes with stairs, an elevator, corners and both paces
    Demo,
    /// 200 strides of one person in one gait
    Detector,
    /// Walking on and on; needs --duration
    Endless,
    /// The sensor laid down in twelve attitudes, for 'sohle calibrate'; the same seed is the same sensor in any walk
    Calibration,
}

/// Gaits and other motions that a walk can consist of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Motion {
    /// At the normal pace
    Walk,
    /// At a fast pace
    Fast,
    /// At a jogger's pace
    Run,
    /// Up a staircase
    Up,
    /// Down a staircase
    Down,
    /// Standing
    Stand,
    /// Steps to the side
    Side,
    /// Rides in an elevator
    Elevator,
}

/// The three people of the detector test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Who {
    /// Short, quick steps, a flat and quiet foot
    A,
    /// The usual
    B,
    /// Long, slow, uneven strides, a high swing, a hard heel
    C,
}

/// Ready-made sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Sensor {
    /// As it comes from the factory
    Bmx055,
    /// After a calibration on a bench
    Calibrated,
    /// Range, resolution and rate only
    Ideal,
}

impl Who {
    fn person(self) -> Person {
        match self {
            Self::A => Person::a(),
            Self::B => Person::b(),
            Self::C => Person::c(),
        }
    }
}

impl Motion {
    /// A scenario of nothing else.
    fn scenario(self) -> Scenario {
        let route = |endless, legs| Route { endless, legs, ..Route::default() };
        let around = vec![[36.0, 0.0], [36.0, 14.0], [0.0, 14.0], [0.0, 0.0]];
        let (route, strides) = match self {
            Self::Walk => (route(true, vec![Leg::with_gait(Gait::Walk, around)]), Some(100)),
            Self::Fast => (route(true, vec![Leg::with_gait(Gait::Fast, around)]), Some(100)),
            Self::Run => (route(true, vec![Leg::with_gait(Gait::Run, around)]), Some(100)),
            Self::Up => (route(false, vec![Leg::stairs(60)]), None),
            Self::Down => (route(false, vec![Leg::stairs(-60)]), None),
            Self::Stand => (route(false, vec![Leg::Stand { seconds: 60.0 }]), None),
            Self::Side => (route(true, vec![Leg::SideStep { left: 3.0 }, Leg::SideStep { left: -3.0 }]), Some(40)),
            Self::Elevator => (route(false, vec![Leg::ride(9.0), Leg::ride(-6.0), Leg::ride(-3.0)]), None),
        };
        Scenario { route, strides, ..Scenario::default() }
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<(), Error> {
    if let Some(files) = &args.describe {
        return describe(&args, files);
    }
    let scenario = scenario(&args)?;
    if args.print {
        return print(&toml::to_string(&scenario)?);
    }
    let Some(out) = &args.out else {
        return Err(Error::new("nowhere to write to: --out FILE.csv or --out FILE.mcap is needed"));
    };
    let seconds = scenario.length()?;
    let bar = ProgressBar::new(seconds as u64);
    bar.set_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} s simulated, {eta} left")?);
    let summary = output::write(&scenario, out, args.thinning, |second| bar.set_position(second));
    bar.finish_and_clear();
    let summary = summary?;
    print(&format!("{summary}\nwritten to {}\n", out.display()))
}

/// What the arguments ask for.
fn scenario(args: &Args) -> Result<Scenario, Error> {
    let mut scenario = match (&args.scenario, args.preset, args.gait) {
        _ if args.building.is_some() => in_building(args)?,
        (Some(path), ..) => {
            let text = std::fs::read_to_string(path)
                .map_err(|error| Error::new(format!("scenario file {}: {error}", path.display())))?;
            Scenario::from_toml(&text)
                .map_err(|error| Error::new(format!("scenario file {}, {error}", path.display())))?
        }
        (_, Some(Preset::Detector), _) => Scenario::detector_test(Person::default(), Gait::Walk),
        (_, Some(Preset::Endless), _) => Scenario::endless(1),
        (_, Some(Preset::Calibration), _) => Scenario::calibration(1),
        (_, _, Some(gait)) => gait.scenario(),
        _ => Scenario::demo(),
    };
    scenario.person = args.person.map_or(scenario.person, Who::person);
    scenario.seed = args.seed.unwrap_or(scenario.seed);
    if args.strides.is_some() {
        scenario.strides = args.strides;
    }
    if args.duration.is_some() {
        scenario.duration = args.duration;
        // A walk around and around goes on for as long as it is asked to.
        if args.strides.is_none() && args.gait.is_some() {
            scenario.strides = None;
        }
    }
    if let Some(orientation) = args.mounting {
        scenario.mounting.orientation = orientation;
    }
    scenario.sensor = match args.sensor {
        Some(Sensor::Bmx055) => SensorModel::bmx055(),
        Some(Sensor::Calibrated) => SensorModel::bmx055_calibrated(),
        Some(Sensor::Ideal) => SensorModel::ideal(),
        None => scenario.sensor,
    };
    scenario.check()?;
    Ok(scenario)
}

/// A walk through a building.
fn in_building(args: &Args) -> Result<Scenario, Error> {
    let Some(path) = &args.building else { return Ok(Scenario::default()) };
    let building = open(path, &Options::default())?;
    let stops: Vec<&str> = args.route.iter().map(String::as_str).collect();
    let route = Route::through(&building, &building::route::plan(&building, &stops)?)?;
    Ok(Scenario { route, ..Scenario::default() })
}

/// Prints the figures of every gait.
fn describe(args: &Args, files: &[PathBuf]) -> Result<(), Error> {
    let mut text = format!("{:<24} | {}\n", "", Peaks::COLUMNS);
    let profile = args.profile.as_deref().map(Profile::parse).transpose()?;
    for file in files {
        let walk = recording::open(file, profile.as_ref())?;
        text += &format!("{:<24} | {}\n", walk.name, Peaks::of(&walk.samples));
    }
    if !files.is_empty() {
        return print(&text);
    }
    let motions = [Motion::Walk, Motion::Fast, Motion::Run, Motion::Up, Motion::Down, Motion::Side];
    for motion in motions.into_iter().filter(|&motion| args.gait.is_none_or(|asked| asked == motion)) {
        for who in Who::value_variants().iter().filter(|&&who| args.person.is_none_or(|asked| asked == who)) {
            let scenario = Scenario { person: who.person(), seed: args.seed.unwrap_or(1), ..motion.scenario() };
            let samples: Vec<ImuSample> = Simulation::new(&scenario)?.map(|moment| moment.sample).collect();
            let name = format!("{motion:?} {who:?}").to_lowercase();
            text += &format!("{name:<24} | {}\n", Peaks::of(&samples));
        }
    }
    print(&text)
}
