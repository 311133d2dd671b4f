//! The project's own commands, beyond what cargo has: `cargo xtask --help` lists them.

mod bench;
mod check;
mod ci;
mod cost;
mod determinism;
mod device;
mod emulate;
mod emulator;
mod firmware;
mod fuzz;
mod process;
mod recordings;
mod stage;
mod together;
mod tools;
mod window;

use clap::{Parser, Subcommand};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The project's own commands.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Runs every check that a change must pass; `.ci/run` calls this.
    Ci(ci::Arguments),
    /// Builds `sohle-shared` without std for the microcontroller, with and without serde.
    Device,
    /// Runs the tracker on an emulated Cortex-M4F: the bits must be the host's; prints its cost.
    Emulator,
    /// Runs the shoe on an emulated Cortex-M4F that walks a recording; its serial line is a TCP port.
    Emulate(emulate::Arguments),
    /// Builds the firmware of the boards; prints what it takes of flash and RAM, which must be within the budget.
    Firmware(firmware::Arguments),
    /// Puts the firmware onto a board with probe-rs and shows what it says.
    Flash(firmware::FlashArguments),
    /// Counts the instructions of the documented and the default filter under callgrind.
    Bench,
    /// Opens the window on a display of its own by 'demo', 'replay' and 'live' with an emulated shoe, and looks at it.
    Window,
    /// Evaluates in debug and release builds, on one and two threads: the outputs must be the same.
    Determinism,
    /// Gives arbitrary input to everything that reads what others wrote; exit code 1 when a promise is broken.
    Fuzz(fuzz::Arguments),
    /// Fetches the recordings of the manifest from their upstream repositories.
    Recordings(recordings::Arguments),
    /// Checks what is committed: no data, licences of the dependencies, the changelog.
    Check,
    /// Installs the Debian packages that the other commands need and that are missing.
    Install,
}

/// The root of the checkout.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask/ lies in the root of the checkout")
}

/// A path inside the checkout.
fn in_root(path: &str) -> PathBuf {
    root().join(path)
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Ci(arguments) => return if ci::run(&arguments) { ExitCode::SUCCESS } else { ExitCode::FAILURE },
        Command::Device => device::build_shared(),
        Command::Emulator => emulator::run(),
        Command::Emulate(arguments) => emulate::run(&arguments),
        Command::Firmware(arguments) => firmware::run(&arguments),
        Command::Flash(arguments) => firmware::flash(&arguments),
        Command::Bench => bench::run(),
        Command::Window => window::check(),
        Command::Determinism => determinism::run(),
        Command::Fuzz(arguments) => fuzz::run(&arguments),
        Command::Recordings(arguments) => recordings::run(&arguments),
        Command::Check => check::run(),
        Command::Install => tools::install(&tools::ALL),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}
