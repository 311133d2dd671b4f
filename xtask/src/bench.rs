//! What the tracker costs on this machine: instructions, counted by callgrind.
//!
//! Counts, unlike times, are the same on every run and on a busy machine. Callgrind itself is called rather than a bench
//! framework: one function is switched on and off, and one number is read.

use crate::process::{self, Failure};
use crate::tools;
use std::path::PathBuf;
use std::process::Command;

/// Sampling of the counted walks. **Units:** microseconds.
const PERIODS_US: [u32; 2] = [5_000, 500];

/// What the default filter may cost of the documented one, in the mean over a walk at 200 Hz.
const LARGEST_SHARE: f64 = 0.5;

/// Instructions over the samples of one phase of the walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cost {
    samples: u64,
    instructions: u64,
}

impl Cost {
    fn mean(self) -> f64 {
        self.instructions as f64 / self.samples.max(1) as f64
    }

    fn with(self, other: Self) -> Self {
        Self { samples: self.samples + other.samples, instructions: self.instructions + other.instructions }
    }
}

/// Prints the cost of both settings at both samplings. An error when the default filter costs too much.
pub fn run() -> Result<(), Failure> {
    tools::VALGRIND.required()?;
    let program = build()?;
    let mut share = 0.0;
    for period_us in PERIODS_US {
        println!("instructions for each IMU sample at {} Hz (x86-64, callgrind)", 1_000_000 / period_us);
        println!("{:<12} {:>10} {:>10} {:>10} {:>10}", "setting", "swinging", "standing", "mean", "samples");
        let [default, documented] = [row(&program, "default", period_us)?, row(&program, "documented", period_us)?];
        let ratios = default.iter().zip(&documented).map(|(default, documented)| default.mean() / documented.mean());
        let ratios: Vec<f64> = ratios.collect();
        println!("{:<12} {:>10.3} {:>10.3} {:>10.3}\n", "ratio", ratios[0], ratios[1], ratios[2]);
        if period_us == PERIODS_US[0] {
            share = ratios[2];
        }
    }
    if share <= LARGEST_SHARE {
        return Ok(());
    }
    Err(Failure::Found(format!("the default filter costs {share:.2} of the documented one, more than {LARGEST_SHARE}")))
}

/// Swinging, standing, both; printed.
fn row(program: &PathBuf, setting: &str, period_us: u32) -> Result<[Cost; 3], Failure> {
    let swinging = count(program, setting, "swinging", period_us)?;
    let standing = count(program, setting, "standing", period_us)?;
    let both = swinging.with(standing);
    let [a, b, c] = [swinging, standing, both].map(Cost::mean);
    println!("{setting:<12} {a:>10.0} {b:>10.0} {c:>10.0} {:>10}", both.samples);
    Ok([swinging, standing, both])
}

fn build() -> Result<PathBuf, Failure> {
    let mut command = process::cargo();
    let words =
        "build --release --locked --package sohle-shared --example cost --message-format json-render-diagnostics";
    let said = process::read(command.args(words.split(' ')))?;
    let messages = said.out.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let built = messages.filter_map(|message| message.get("executable")?.as_str().map(PathBuf::from)).last();
    built.ok_or_else(|| Failure::Found("cargo built no example `cost`".into()))
}

fn count(program: &PathBuf, setting: &str, phase: &str, period_us: u32) -> Result<Cost, Failure> {
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

    #[test]
    fn means_are_weighted_by_samples() {
        let all = Cost { samples: 1, instructions: 100 }.with(Cost { samples: 3, instructions: 60 });
        assert_eq!(all.mean(), 40.0);
        assert_eq!(Cost::default().mean(), 0.0);
    }
}
