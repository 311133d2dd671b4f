//! A live shoe without hardware: the firmware's loops on an emulated Cortex-M4F, its serial line a TCP port.

use crate::process::{self, Failure};
use crate::{device, in_root, tools};
use std::path::{Path, PathBuf};
use std::process::Command;

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
    /// TCP port on this machine that is the shoe's serial line
    #[arg(long, default_value_t = 7_700)]
    port: u16,
}

/// Virtual nanoseconds of an instruction, as a power of two: 62.5 million instructions in a second, about what a Cortex-M4F
/// at 64 MHz executes.
const SHIFT: &str = "shift=4,sleep=on";

/// Runs the shoe until it is stopped.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    tools::QEMU.required()?;
    let sohle = process::build("dev", "--bin", "sohle")?;
    let folder = in_root("target/emulate");
    std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
    let walk = match &arguments.recording {
        Some(recording) => recording.clone(),
        None => simulated(&sohle, &folder, &arguments.simulate, arguments.seed)?,
    };
    let counts = converted(&sohle, &folder, &walk, arguments.profile.as_deref())?;
    build()?;
    println!("the shoe waits for a laptop and walks as soon as it is there: in another terminal, run");
    println!("  cargo run --release -- live tcp:127.0.0.1:{}", arguments.port);
    println!("Ctrl-C ends it");
    process::run(&mut machine(arguments.port, &counts))
}

/// Builds the firmware for the emulator.
pub fn build() -> Result<(), Failure> {
    process::run(&mut device::Route::find()?.build(&in_root("firmware/emulator")))
}

/// A simulated walk as a recording.
pub fn simulated(sohle: &Path, folder: &Path, preset: &str, seed: u64) -> Result<PathBuf, Failure> {
    let walk = folder.join("simulated.mcap");
    let mut command = Command::new(sohle);
    command.current_dir(crate::root()).args(["simulate", "--preset", preset, "--seed", &seed.to_string(), "--force"]);
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

/// The emulator with the shoe in it. It waits for the first connection to its port.
pub fn machine(port: u16, counts: &Path) -> Command {
    let words = "-machine mps2-an386 -display none -monitor none";
    let mut command = process::program("qemu-system-arm", words.split_whitespace());
    command.args(["-icount", SHIFT, "-serial"]).arg(format!("tcp:127.0.0.1:{port},server=on,wait=on"));
    // The command line of the emulated program is cut at spaces, the path is not.
    command.arg("-semihosting-config");
    command
        .arg(format!("enable=on,target=native,arg=sohle-shoe,arg={}", counts.display().to_string().replace(',', ",,")));
    command.arg("-kernel").arg(device::binary("sohle-shoe"));
    command
}

fn file(path: &Path, source: std::io::Error) -> Failure {
    Failure::File { path: path.display().to_string(), source }
}
