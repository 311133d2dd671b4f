//! The command line: one file for each command, one way to say what went wrong.
//!
//! A command is a `pub struct Args` (clap) and a `pub fn run(args: Args) -> Result<(), Error>`; it is hooked in by a
//! variant of [`Command`] and a line in [`dispatch`]. Results go to the standard output through [`print()`], progress to
//! the standard error output, and an error ends the program with one line and exit code 1 (2 if the command line itself
//! was wrong).

pub mod convert;
mod error;
pub mod evaluate;
pub mod parameters;
pub mod simulate;

pub use error::Error;

use clap::Parser;
use clap::error::ErrorKind;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Tracks a walk from one inertial sensor on the shoe
#[derive(Debug, Parser)]
#[command(name = "sohle", version, max_term_width = 100, disable_help_subcommand = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// What the program can be asked for, in the order of the help.
#[derive(Debug, clap::Subcommand)]
enum Command {
    Convert(convert::Args),
    Evaluate(evaluate::Args),
    Parameters(parameters::Args),
    Simulate(simulate::Args),
}

/// Runs the command.
fn dispatch(command: Command) -> Result<(), Error> {
    match command {
        Command::Convert(args) => convert::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Parameters(args) => parameters::run(args),
        Command::Simulate(args) => simulate::run(args),
    }
}

/// The whole program: reads `arguments` (the first is the program's name), does what they ask for, says what went wrong.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
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
