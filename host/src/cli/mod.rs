//! The command line: one file for each command, one way to say what went wrong.
//!
//! A command is a `pub struct Args` (clap) and a `pub fn run(args: Args) -> Result<(), Error>`; it is hooked in by a
//! variant of [`Command`] and a line in [`dispatch`]. Results go to the standard output through [`print()`], progress to
//! the standard error output, and an error ends the program with one line and exit code 1 (2 if the command line itself
//! was wrong).

pub mod beacons;
pub mod bench;
pub mod building;
pub mod calibrate;
pub mod command;
pub mod convert;
pub mod demo;
pub mod endurance;
mod error;
pub mod evaluate;
pub mod fixes;
pub mod graph;
pub mod line;
pub mod live;
pub mod located;
pub mod pair;
pub mod parameters;
mod phone;
pub mod ports;
pub mod replay;
pub mod report;
pub mod route;
pub mod shown;
pub mod simulate;
mod suite;
pub mod table;
#[cfg_attr(not(feature = "window"), path = "no_window.rs")]
pub mod window;

pub use error::Error;

use crate::export::geojson::Origin;
use clap::Parser;
use clap::error::ErrorKind;
use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Tracks a walk from one inertial sensor on the shoe
#[derive(Debug, Parser)]
#[command(name = "sohle", version, override_usage = "sohle [COMMAND]", disable_help_subcommand = true)]
#[command(after_help = "Without a command 'sohle' does what 'sohle demo' does.\n\n\
Examples:\n  sohle\n  sohle replay walk.csv --compare\n  sohle parameters > mine.toml")]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// What the program can be asked for, in the order of the help.
#[derive(Debug, clap::Subcommand)]
enum Command {
    Demo(demo::Args),
    Replay(replay::Args),
    Building(building::Args),
    Route(route::Args),
    Graph(graph::Args),
    Calibrate(calibrate::Args),
    Convert(convert::Args),
    Evaluate(evaluate::Args),
    Endurance(endurance::Args),
    Bench(bench::Args),
    Line(line::Args),
    Live(live::Args),
    Ports(ports::Args),
    Pair(pair::Args),
    Window(Box<window::Args>),
    #[command(name = "command")]
    Ask(command::Args),
    Parameters(parameters::Args),
    Simulate(simulate::Args),
}

/// Where the results of a walk go, and how much is said about them.
#[derive(Debug, clap::Args)]
pub struct Output {
    /// Folder of the results; same names are replaced [default: sohle-out/ and the walk's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Where the walk began, and the bearing of its x axis [default bearing: 90, east]
    ///
    /// Degrees, WGS84; the bearing clockwise from north. Dead reckoning knows neither: without this the GeoJSON is in
    /// metres and says so.
    #[arg(long, value_name = "LAT,LON[,HEADING_DEG]", allow_hyphen_values = true)]
    origin: Option<Origin>,
    /// Says nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

impl Output {
    /// The folder asked for, or that of the walk called `name`.
    fn folder(&self, name: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("sohle-out").join(name))
    }
}

/// Runs the command.
fn dispatch(command: Command) -> Result<(), Error> {
    match command {
        Command::Demo(args) => demo::run(args),
        Command::Replay(args) => replay::run(args),
        Command::Building(args) => building::run(args),
        Command::Route(args) => route::run(args),
        Command::Graph(args) => graph::run(args),
        Command::Calibrate(args) => calibrate::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Endurance(args) => endurance::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Line(args) => line::run(args),
        Command::Live(args) => live::run(args),
        Command::Ports(args) => ports::run(args),
        Command::Pair(args) => pair::run(args),
        Command::Window(args) => window::run(*args),
        Command::Ask(args) => command::run(args),
        Command::Parameters(args) => parameters::run(args),
        Command::Simulate(args) => simulate::run(args),
    }
}

/// The whole program: reads `arguments` (the first is the program's name), does what they ask for, says what went wrong.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let mut arguments: Vec<_> = arguments.into_iter().collect();
    if arguments.len() <= 1 {
        arguments = vec!["sohle".into(), "demo".into()];
    }
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    match dispatch(cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Writes a result to the standard output. A reader that has gone away (`sohle ... | head`) is no error.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::new(format!("cannot write to the standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// A bar on the standard error output; invisible when that is no terminal or when `quiet`.
fn progress(length: u64, message: &str, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}");
    let bar = ProgressBar::new(length).with_message(message.to_owned());
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())).with_finish(ProgressFinish::AndClear)
}

/// Prints help and version as clap has them, and a wrong command line as one line.
fn usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return match print(&error.render().to_string()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(_) => ExitCode::FAILURE,
        };
    }
    eprintln!("{}", one_line(&error.render().to_string()));
    ExitCode::from(2)
}

/// What clap says, without the paragraphs on usage.
fn one_line(message: &str) -> String {
    let end = ["\nUsage:", "\nFor more information"].iter().filter_map(|mark| message.find(mark)).min();
    let told = message[..end.unwrap_or(message.len())].split_whitespace().collect::<Vec<_>>().join(" ");
    format!("{told}; see 'sohle --help'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn a_wrong_command_line_is_told_in_one_line() {
        let error = Cli::try_parse_from(["sohle", "parameters", "--documentd"]).unwrap_err();
        let line = one_line(&error.render().to_string());
        assert!(!line.contains('\n'));
        assert!(line.starts_with("error: unexpected argument '--documentd' found"), "{line}");
        assert!(!line.contains("Usage"), "{line}");
    }
}
