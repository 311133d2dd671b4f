//! What the tracker costs on this machine: instructions, counted by callgrind.
//!
//! Counts, unlike times, are the same on every run and on a busy machine. Callgrind itself is called rather than a bench
//! framework: one function is switched on and off, and one number is read.

use crate::cost::{self, Cost};
use crate::process::{self, Failure};
use crate::tools;
use std::path::Path;
use std::process::Command;

/// Sampling of the counted walks. **Units:** microseconds.
const PERIODS_US: [u32; 2] = [5_000, 500];

/// A prediction of the default filter must cost less than this part of a documented one.
const LARGEST_SHARE: f64 = 0.5;

/// Prints what samples and filter steps cost with both settings. An error when the default filter costs too much.
pub fn run() -> Result<(), Failure> {
    tools::VALGRIND.required()?;
    let program = process::build("release", "--example", "cost")?;
    let both = |part: &'static str, period_us| {
        let default = count(&program, "default", part, period_us)?;
        Ok::<_, Failure>((part, default, count(&program, "documented", part, period_us)?))
    };
    for period_us in PERIODS_US {
        let (swinging, standing) = (both("swinging", period_us)?, both("standing", period_us)?);
        let mean = ("mean", swinging.1.and(standing.1), swinging.2.and(standing.2));
        let title = format!("instructions for each IMU sample at {} Hz (x86-64)", 1_000_000 / period_us);
        println!("{}", cost::table(&title, &[swinging, standing, mean]));
    }
    let steps = [both("prediction", PERIODS_US[0])?, both("correction", PERIODS_US[0])?];
    println!("{}", cost::table("instructions for each step of the filter (x86-64)", &steps));
    let (_, default, documented) = steps[0];
    let share = default.mean() / documented.mean();
    if share < LARGEST_SHARE {
        return Ok(());
    }
    Err(Failure::Found(format!(
        "a prediction of the default filter costs {share:.2} of a documented one; it must stay below {LARGEST_SHARE}"
    )))
}

fn count(program: &Path, setting: &str, part: &str, period_us: u32) -> Result<Cost, Failure> {
    let words = "--tool=callgrind --collect-atstart=no --toggle-collect=*counted* --callgrind-out-file=/dev/null";
    let mut command = Command::new("valgrind");
    command.args(words.split(' ')).arg(program).args([setting, part, &period_us.to_string()]);
    let said = process::read(&mut command)?;
    let count = said.out.trim().parse().ok();
    match (count, collected(&said.err)) {
        (Some(count), Some(instructions)) => Ok(Cost { count, instructions }),
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
