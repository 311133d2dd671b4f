//! Every check that a change must pass, in stages.

use crate::process::{self, Failure};
use crate::stage::{Beside, Run, Tally};
use crate::{bench, check, determinism, emulate, emulator, fuzz, tools, window};
use std::process::Command;

/// The shoe's Bluetooth, which no workspace has: it is built for the host here, and with the firmware for the boards.
const BLUETOOTH: &str = "--manifest-path firmware/ble/Cargo.toml --target-dir target";

/// How to run the checks.
#[derive(clap::Args)]
pub struct Arguments {
    /// Install missing Debian packages first; so does CI=true in the environment.
    #[arg(long)]
    install: bool,
}

/// Runs all stages and prints what came of them. Whether everything passed.
pub fn run(arguments: &Arguments) -> bool {
    let mut run = Run::default();
    if arguments.install || std::env::var("CI").is_ok_and(|value| value == "true") {
        run.check("install", || tools::install(&tools::ALL));
    }
    run.check("format", format);
    run.check("committed files", check::run);
    let boards = Beside::start(boards());
    run.check("lint", || {
        process::run(&mut cargo("clippy --locked --workspace --all-features --all-targets -- -D warnings"))
    });
    run.check("documentation", || {
        process::run(
            cargo("doc --locked --workspace --all-features --no-deps --document-private-items")
                .env("RUSTDOCFLAGS", "-D warnings"),
        )
    });
    run.check("Bluetooth lint", || {
        process::run(&mut cargo(&format!("clippy --locked {BLUETOOTH} --all-targets -- -D warnings")))
    });
    run.check("fuzz lint", || {
        // With the folder of the others, most of it is built already.
        process::run(&mut cargo(
            "clippy --locked --manifest-path fuzz/Cargo.toml --target-dir target --all-targets -- -D warnings",
        ))
    });
    // Nothing builds while tests run.
    run.join(boards);
    run.stage("tests", tests);
    run.stage("documentation tests", || counted(cargo("test --locked --workspace --all-features --doc")));
    run.stage("Bluetooth tests", || counted(cargo(&format!("test --locked {BLUETOOTH}"))));
    run.check("fuzzing", fuzz::check);
    run.check("bits on a Cortex-M4F", emulator::run);
    run.check("the emulated shoe", emulate::check);
    run.check("the same on Bluetooth", emulate::radio::check);
    run.check("the window", window::check);
    run.check("cost", bench::run);
    run.check("determinism", determinism::run);
    run.summary()
}

/// What is built for the boards by this program's own commands. They have a target folder of their own and one thing to do
/// at a time for the most part: core, then the linking of one program after the other.
fn boards() -> Vec<(&'static str, Command)> {
    let stages =
        [("no_std build", &["device"][..]), ("firmware lint", &["firmware", "--lint"]), ("firmware", &["firmware"])];
    let itself = std::env::current_exe().unwrap_or_else(|_| "xtask".into());
    stages.map(|(name, words)| (name, process::program(&itself.to_string_lossy(), words))).into()
}

/// A cargo command from its words.
fn cargo(words: &str) -> Command {
    let mut command = process::cargo();
    command.args(words.split(' '));
    command
}

fn format() -> Result<(), Failure> {
    for manifest in check::MANIFESTS {
        process::run(cargo("fmt --all --check --manifest-path").arg(manifest))?;
    }
    Ok(())
}

fn tests() -> (Tally, Result<(), Failure>) {
    let nextest = process::read(&mut cargo("nextest --version")).is_ok();
    let words = if nextest {
        "nextest run --locked --workspace --all-features --no-fail-fast"
    } else {
        "test --locked --workspace --all-features --all-targets --no-fail-fast"
    };
    counted(cargo(words))
}

fn counted(mut command: Command) -> (Tally, Result<(), Failure>) {
    let (said, result) = process::show_and_read(&mut command);
    // nextest writes its summary to standard error, the standard harness to standard output.
    let mut tally = Tally::of_test_output(&said.out);
    tally += Tally::of_test_output(&said.err);
    (tally, result)
}
