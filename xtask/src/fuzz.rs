//! Fuzzing: arbitrary input for everything that reads what others wrote.
//!
//! The targets are programs of `fuzz/`, a workspace of its own, which libFuzzer drives: it keeps every input that reaches
//! something new and changes those it has kept. The counters that tell it so are put in by the compiler itself, by flags that
//! the stable one takes; without a sanitizer, since there is no unsafe code to be caught.

use crate::process::{self, Failure};
use crate::{in_root, together, tools};
use std::path::{Path, PathBuf};
use std::process::Command;

mod report;

use report::Report;

/// How long each target runs in the check of a change. **Units:** s.
const GATE_SECONDS: u64 = 20;
/// An input that takes longer is a finding. A building of 5 km takes a second on an idle machine, and was seen to take forty on
/// one that had much else to do. **Units:** s.
const TIMEOUT_S: u32 = 60;
/// A target that needs more memory is a finding. **Units:** MB.
const MEMORY_MB: u32 = 2_048;
/// No input is longer. **Units:** bytes.
const LENGTH_MAX: u32 = 8_192;

/// Where the programs and the inputs that were found on the way go.
const TARGET_FOLDER: &str = "target/fuzz";
/// Inputs to begin with, for each target.
const CORPUS: &str = "fuzz/corpus";
/// Inputs that broke a promise.
const FINDINGS: &str = "fuzz/findings";

/// Counts what is reached, and shows the fuzzer both sides of every comparison.
const FLAGS: [&str; 5] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
];

/// What to fuzz, and for how long.
#[derive(clap::Args)]
pub struct Arguments {
    /// The targets, which are the files of `fuzz/src/bin`; without any, all of them.
    targets: Vec<String>,
    /// How long each target runs, in seconds.
    #[arg(long, default_value_t = 60)]
    seconds: u64,
    /// How many targets run at the same time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Instead, runs the one target that is named on this file and shows what comes of it.
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Instead, writes the inputs that the targets begin with into `fuzz/corpus`.
    #[arg(long, conflicts_with = "input")]
    seeds: bool,
}

/// Fuzzes, or does what is asked for instead.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let targets = chosen(&arguments.targets)?;
    if arguments.input.is_some() && targets.len() != 1 {
        return Err(Failure::Found("--input needs the one target that is to run on it".into()));
    }
    let programs = build()?;
    if arguments.seeds {
        return targets.iter().try_for_each(|target| {
            process::read(Command::new(programs.join(target)).arg("--seeds").arg(in_root(CORPUS).join(target)))
                .map(drop)
        });
    }
    match &arguments.input {
        Some(input) => targets
            .iter()
            .try_for_each(|target| process::run(Command::new(programs.join(target)).args(limits()).arg(input))),
        None => fuzz(&programs, &targets, arguments.seconds, arguments.jobs),
    }
}

/// All targets, for a short time: the check of a change.
pub fn check() -> Result<(), Failure> {
    fuzz(&build()?, &all()?, GATE_SECONDS, 2)
}

/// The names of all targets.
fn all() -> Result<Vec<String>, Failure> {
    let folder = in_root("fuzz/src/bin");
    let failed = |source| Failure::File { path: folder.display().to_string(), source };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
    }
    names.sort();
    Ok(names)
}

/// The targets that are named, or all.
fn chosen(named: &[String]) -> Result<Vec<String>, Failure> {
    let all = all()?;
    if let Some(unknown) = named.iter().find(|name| !all.contains(name)) {
        return Err(Failure::Found(format!("there is no target `{unknown}`; there are {}", all.join(", "))));
    }
    Ok(if named.is_empty() { all } else { named.to_vec() })
}

/// Builds all targets; where their programs are.
fn build() -> Result<PathBuf, Failure> {
    tools::CXX.required()?;
    let host = host()?;
    let mut command = process::cargo();
    command.args(["build", "--locked", "--release", "--manifest-path", "fuzz/Cargo.toml"]);
    // The target is named so that programs that only build others are not instrumented.
    command.args(["--target", &host]).arg("--target-dir").arg(in_root(TARGET_FOLDER));
    command.env("RUSTFLAGS", FLAGS.join(" ")).env_remove("CARGO_ENCODED_RUSTFLAGS");
    process::run(&mut command)?;
    Ok(in_root(TARGET_FOLDER).join(host).join("release"))
}

/// This machine, as the compiler calls it.
fn host() -> Result<String, Failure> {
    let mut command = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    let said = process::read(command.current_dir(crate::root()).arg("-vV"))?;
    let host = said.out.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| Failure::Found("`rustc -vV` names no host".into()))
}

/// What no input may take.
fn limits() -> [String; 3] {
    [format!("-timeout={TIMEOUT_S}"), format!("-report_slow_units={TIMEOUT_S}"), format!("-rss_limit_mb={MEMORY_MB}")]
}

/// Runs the targets, so many at a time, and prints a table. An error when one has a finding.
fn fuzz(programs: &Path, targets: &[String], seconds: u64, jobs: usize) -> Result<(), Failure> {
    report::conclude(together::each(targets.iter().collect(), jobs, |target| run_target(programs, target, seconds))?)
}

/// Runs a target for so long. **Units:** s.
fn run_target(programs: &Path, target: &str, seconds: u64) -> Result<Report, Failure> {
    let (grown, findings) = (in_root(TARGET_FOLDER).join("corpus").join(target), in_root(FINDINGS));
    for folder in [&grown, &findings] {
        std::fs::create_dir_all(folder)
            .map_err(|source| Failure::File { path: folder.display().to_string(), source })?;
    }
    let mut command = Command::new(programs.join(target));
    command.args(limits()).arg(format!("-max_total_time={seconds}")).arg(format!("-max_len={LENGTH_MAX}"));
    command.arg("-print_final_stats=1").arg(format!("-artifact_prefix={}/{target}-", findings.display()));
    // New inputs go into the first folder.
    command.arg(&grown);
    let committed = in_root(CORPUS).join(target);
    if committed.is_dir() {
        command.arg(committed);
    }
    let ended = process::watch(&mut command, || true)?;
    Ok(Report::of(target, &ended.said.err, ended.code))
}
