//! What the tracker costs on this machine: instructions, counted by callgrind.
//!
//! Counts, unlike times, are the same on every run and on a busy machine. Callgrind itself is called rather than a bench
//! framework: one function is switched on and off, and one number is read.

use crate::cost::{self, Cost, Phases};
use crate::process::{self, Failure};
use crate::tools;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sampling of the counted walks. **Units:** microseconds.
const PERIODS_US: [u32; 2] = [5_000, 500];

/// What the default filter may cost of the documented one, while the foot moves.
const LARGEST_SHARE: f64 = 0.5;

/// Prints the cost of both settings at both samplings. An error when the default filter costs too much.
pub fn run() -> Result<(), Failure> {
    tools::VALGRIND.required()?;
    let program = build()?;
    let mut shares = Vec::new();
    for period_us in PERIODS_US {
        let default = phases(&program, "default", period_us)?;
        let documented = phases(&program, "documented", period_us)?;
        println!("instructions for each IMU sample at {} Hz (x86-64, callgrind)", 1_000_000 / period_us);
        println!("{}", cost::table(default, documented));
        shares.push(default.share_of_predictions(documented));
    }
    match shares.iter().find(|&&share| share.is_nan() || share > LARGEST_SHARE) {
        None => Ok(()),
        Some(share) => Err(Failure::Found(format!(
            "a prediction of the default filter costs {share:.2} of the documented one, more than {LARGEST_SHARE}"
        ))),
    }
}

fn phases(program: &Path, setting: &str, period_us: u32) -> Result<Phases, Failure> {
    let swinging = count(program, setting, "swinging", period_us)?;
    Ok(Phases { swinging, standing: count(program, setting, "standing", period_us)? })
}

fn build() -> Result<PathBuf, Failure> {
    let mut command = process::cargo();
    let words =
        "build --release --locked --package sohle-shared --example cost --message-format json-render-diagnostics";
    let said = process::read(command.args(words.split(' ')))?;
    let messages = said.out.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let built = messages.filter_map(|message| message.get("executable")?.as_str().map(PathBuf::from)).next_back();
    built.ok_or_else(|| Failure::Found("cargo built no example `cost`".into()))
}

fn count(program: &Path, setting: &str, phase: &str, period_us: u32) -> Result<Cost, Failure> {
    let words = "--tool=callgrind --collect-atstart=no --toggle-collect=*counted* --callgrind-out-file=/dev/null";
    let mut command = Command::new("valgrind");
    command.args(words.split(' ')).arg(program).args([setting, phase, &period_us.to_string()]);
    let said = process::read(&mut command)?;
    let samples = said.out.trim().parse().ok();
    match (samples, collected(&said.err)) {
        (Some(samples), Some(instructions)) => Ok(Cost { samples, instructions }),
        _ => Err(Failure::Found(format!("callgrind printed no count: {}", said.err.replace('\n', " ")))),
    }
}

/// The count in callgrind's last words, `==123== Collected : 456`.
fn collected(text: &str) -> Option<u64> {
    let line = text.lines().find(|line| line.contains("Collected :"))?;
    line.rsplit(' ').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_of_callgrind_is_read() {
        let text = "==7== Callgrind, a call-graph profiler\n==7== Events    : Ir\n==7== Collected : 123456\n==7== \n";
        assert_eq!(collected(text), Some(123_456));
        assert_eq!(collected("==7== Events    : Ir\n"), None);
    }
}
