//! Runs the self-test's walk so that callgrind can count what the tracker costs; `cargo xtask bench` calls it.
//!
//! `cost SETTING PHASE PERIOD_US`: the samples of one phase (`swinging`, `standing`) go through [`counted`], the others
//! do not. Prints how many samples were counted.

use sohle_shared::sample::ImuSample;
use sohle_shared::selftest;
use sohle_shared::tracker::{Output, Parameters, Tracker};
use std::process::ExitCode;

/// What callgrind counts: it is told the name of this function.
#[inline(never)]
fn counted(tracker: &mut Tracker, sample: &ImuSample) -> Output {
    tracker.push(sample)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (parameters, standing, period_us) = match words[..] {
        [setting, phase, period_us] => (
            match setting {
                "default" => Some(Parameters::default()),
                "documented" => Some(Parameters::documented()),
                _ => None,
            },
            match phase {
                "swinging" => Some(false),
                "standing" => Some(true),
                _ => None,
            },
            period_us.parse().ok(),
        ),
        _ => (None, None, None),
    };
    let (Some(parameters), Some(standing), Some(period_us)) = (parameters, standing, period_us) else {
        eprintln!("error: usage: cost default|documented swinging|standing PERIOD_US");
        return ExitCode::from(2);
    };
    // Whether the foot stands is known only after the sample: a first run finds out.
    let mut stands = Vec::new();
    selftest::track(period_us, &parameters, |tracker, sample| {
        let output = tracker.push(sample);
        stands.push(output.stance);
        output
    });
    let mut phases = stands.iter();
    selftest::track(period_us, &parameters, |tracker, sample| match phases.next() {
        Some(&stands) if stands == standing => counted(tracker, sample),
        _ => tracker.push(sample),
    });
    println!("{}", stands.iter().filter(|&&stands| stands == standing).count());
    ExitCode::SUCCESS
}
