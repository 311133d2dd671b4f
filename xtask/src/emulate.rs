//! A live shoe without hardware: the firmware's loops on an emulated Cortex-M4F, its serial line a TCP port.

mod check;
mod live;
pub mod machine;
mod pace;
mod proxy;
pub mod radio;

use crate::firmware::Budget;
use crate::process::{self, Failure};
use crate::{in_root, tools};
pub use check::check;
use live::{Live, Walk};
use machine::{Running, machine};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the emulated shoe keeps of the sensor that no board has: the twin and its walk.
const TWIN: [&str; 2] = ["TWIN", "WALK"];

/// Which walk the shoe takes, and where it is heard.
#[derive(clap::Args)]
pub struct Arguments {
    /// A recording that 'sohle convert' can read [default: a simulated walk]
    #[arg(value_name = "RECORDING")]
    recording: Option<PathBuf>,
    /// How 'sohle convert' reads the recording
    #[arg(long, value_name = "NAME|FILE.toml", requires = "recording")]
    profile: Option<String>,
    /// The walk that 'sohle simulate' makes
    #[arg(long, value_name = "PRESET", default_value = "demo", conflicts_with = "recording")]
    simulate: String,
    /// Seed of the simulated walk
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Walks recordings and a simulated walk, and compares what the emulated processor computes with what this one does, bit
    /// for bit; then a walk over a line that damages and loses, of which every step must arrive once
    #[arg(long, conflicts_with_all = ["recording", "port"])]
    check: bool,
    /// TCP port on this machine that is the shoe's serial line
    #[arg(long, default_value_t = 7_700)]
    port: u16,
    /// The shoe has Bluetooth, and a virtual radio with a laptop on it runs beside it; with --check, everything that can be
    /// checked of it is
    #[arg(long)]
    ble: bool,
}

/// Recordings that are walked by the check, as far as they are here: name in the folder of recordings, layout, seconds.
const RECORDINGS: [(&str, Option<&str>, u32); 2] =
    [("foot_xio/short_walk.csv", None, 46), ("foot_gaitmap/imu_sample.csv", Some("gaitmap-left"), 45)];
/// How long the simulated walk lasts in the check. **Units:** s.
const SIMULATED_S: u32 = 40;

/// Runs the shoe until it is stopped.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match (arguments.check, arguments.ble) {
        (true, false) => return check(),
        (true, true) => return radio::check(),
        _ => tools::QEMU.required()?,
    }
    let sohle = process::build("dev", "--bin", "sohle")?;
    let folder = in_root("target/emulate");
    std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
    let walk = match &arguments.recording {
        Some(recording) => recording.clone(),
        None => simulated(&sohle, &folder, &arguments.simulate, arguments.seed)?,
    };
    let counts = converted(&sohle, &folder, &walk, arguments.profile.as_deref())?;
    if arguments.ble {
        return radio::run(&folder, &counts, arguments.port);
    }
    machine::build(&[])?;
    println!("the shoe waits for a laptop and walks as soon as it is there: in another terminal, run");
    println!("  cargo run --release -- live tcp:127.0.0.1:{}", arguments.port);
    println!("Ctrl-C ends it");
    process::run(&mut machine(arguments.port, &counts))
}

/// A simulated walk as a recording.
pub fn simulated(sohle: &Path, folder: &Path, preset: &str, seed: u64) -> Result<PathBuf, Failure> {
    let walk = folder.join("simulated.mcap");
    let mut command = Command::new(sohle);
    command.current_dir(crate::root()).args(["simulate", "--preset", preset, "--seed", &seed.to_string()]);
    process::read(command.arg("--out").arg(&walk))?;
    Ok(walk)
}

/// The recording as counts of the sensor's twin.
pub fn converted(sohle: &Path, folder: &Path, recording: &Path, profile: Option<&str>) -> Result<PathBuf, Failure> {
    let counts = folder.join("walk.counts");
    let mut command = Command::new(sohle);
    command.args(["convert", "--force"]).arg(recording).arg(&counts);
    if let Some(profile) = profile {
        command.args(["--profile", profile]);
    }
    process::read(&mut command)?;
    Ok(counts)
}

fn file(path: &Path, source: std::io::Error) -> Failure {
    Failure::File { path: path.display().to_string(), source }
}

/// The part of the summary of `sohle live` that matters here.
#[derive(serde::Deserialize)]
struct Summary {
    steps: u64,
    lost: u64,
    doubled: u64,
    frames_bad: u64,
    delay_median_ms: Option<f64>,
    delay_max_ms: Option<f64>,
    load: Option<u32>,
    stack: Option<u32>,
    waiting: Option<u32>,
    load_max: u32,
    raw: u64,
    raw_lost: u64,
    asleep: Option<bool>,
    sleeps: Option<u32>,
}

/// All that the shoe needs of the RAM, against its budget. What the twin and the walk keep is left out, since no board has
/// either; the stack below the twin's driver is not. It holds the shoe itself, as on the boards.
fn within_budget(statics: u64, stack: u32, budget: Budget) -> Result<(), Failure> {
    let (ram, budget) = (statics + u64::from(stack), budget.ram);
    let told = format!("{statics} bytes of statics and {stack} of stack are {ram} of RAM, of {budget}");
    println!("  {told}");
    if stack > 0 && ram <= budget { Ok(()) } else { Err(Failure::Found(told)) }
}

/// `sohle live` with `more` of its arguments, until the shoe's clock is so far.
fn live_walk(
    sohle: &Path,
    running: &mut Running,
    port: u16,
    seconds: u32,
    more: impl FnOnce(&mut Command),
) -> Result<Walk, Failure> {
    let live = Live::start(sohle, &format!("tcp:127.0.0.1:{port}"), more)?;
    running.pace.wait_until(seconds.into())?;
    live.finish()
}
