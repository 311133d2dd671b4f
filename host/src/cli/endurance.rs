//! `sohle endurance`: walks for as long as asked and tells whether the last hour is as good as the first.

use super::table::Table;
use super::{Error, parameters, print, progress};
use crate::evaluation::endurance::{Judge, Window};
use crate::simulation::{Scenario, Simulation};
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Counters, Parameters, Tracker};
use std::io::IsTerminal;
use std::path::PathBuf;

/// Simulates walking for hours to months and compares the steps of the first hour with those of the last
#[derive(Debug, clap::Args)]
#[command(after_help = "A day at 200 Hz takes about a minute, a month half an hour; nothing is kept in memory.\n\n\
Example:\n  sohle endurance --days 30 --rate 100")]
pub struct Args {
    /// How long the person walks
    #[arg(long, value_name = "DAYS", default_value_t = 1.0)]
    days: f64,
    /// Samples per second of both dies
    #[arg(long, value_name = "HZ", default_value_t = 200.0)]
    rate: f64,
    /// All that is random follows from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Settings of the tracker, as 'sohle parameters' prints them
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Says nothing but the table
    #[arg(short, long)]
    quiet: bool,
}

/// Length of a window. **Units:** s.
const HOUR_S: f64 = 3600.0;

/// Simulates, tracks and judges.
pub fn run(args: Args) -> Result<(), Error> {
    if !(args.days > 0.0 && args.days <= 366.0) {
        return Err(Error::new(format!("--days {}: expected more than 0 and at most 366", args.days)));
    }
    let settings = match &args.parameters {
        Some(path) => parameters::read(path)?,
        None => Parameters::default(),
    };
    let mut scenario = Scenario::endless(args.seed);
    scenario.duration = Some(args.days * 24.0 * HOUR_S);
    for die in [&mut scenario.sensor.accel, &mut scenario.sensor.gyro] {
        die.rate = args.rate;
    }
    let (windows, counters) = walk(&scenario, &settings, args.quiet)?;
    print(&format!("{}\n{}\n", table(&windows).text(), told(&counters)))
}

fn walk(scenario: &Scenario, settings: &Parameters, quiet: bool) -> Result<(Vec<Window>, Counters), Error> {
    let mut tracker = Tracker::new(settings);
    let mut judge = Judge::new(HOUR_S);
    let bar = progress(scenario.duration.unwrap_or_default() as u64, "walking", quiet);
    // Where a bar cannot be seen, who waits half an hour still wants to know.
    let told_by_line = !quiet && !std::io::stderr().is_terminal();
    let mut shown = Micros(0);
    for moment in Simulation::new(scenario)? {
        if let Some(step) = tracker.push(&moment.sample).step {
            judge.step(step);
        }
        if let Some(stance) = moment.stance {
            judge.stance(stance);
        }
        if moment.sample.time.since(shown) > 60.0 {
            let tenths = |time: Micros| (10.0 * time.as_seconds() / scenario.duration.unwrap_or(f64::INFINITY)) as u32;
            if told_by_line && tenths(moment.sample.time) > tenths(shown) {
                eprintln!("walking: {} %", 10 * tenths(moment.sample.time));
            }
            shown = moment.sample.time;
            bar.set_position(shown.as_seconds() as u64);
        }
    }
    if let Some(step) = tracker.finish() {
        judge.step(step);
    }
    bar.finish_and_clear();
    Ok((judge.finish(), *tracker.counters()))
}

fn table(windows: &[Window]) -> Table {
    let headings = ["stances", "missed", "invented", "length mm", "height mm", "turn deg"];
    let mut table = Table::new("errors of a step (rms)", &headings);
    let mut row = |name: String, window: &Window| {
        let [length, height, turn] = window.errors();
        table.row(
            name,
            vec![
                window.stances.to_string(),
                window.missed.to_string(),
                window.invented.to_string(),
                format!("{:.1}", length * 1e3),
                format!("{:.1}", height * 1e3),
                format!("{:.2}", turn.to_degrees()),
            ],
        );
    };
    // An hour that was cut short says little.
    let whole: Vec<_> = windows.iter().filter(|window| 2 * window.stances > windows[0].stances).collect();
    let mut hours = vec![0, whole.len() / 4, whole.len() / 2, 3 * whole.len() / 4, whole.len().saturating_sub(1)];
    hours.dedup();
    for at in hours {
        let name = format!("hour {}", at + 1);
        if let Some(window) = whole.get(at) {
            row(name, window);
        }
    }
    table
}

fn told(counters: &Counters) -> String {
    let Counters { samples, repaired, restarts, .. } = counters;
    format!("{samples} samples, {repaired} covariances repaired, {restarts} restarts")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two hours here; `sohle endurance --days 30` is the month.
    #[test]
    fn the_second_hour_is_as_good_as_the_first() {
        let mut scenario = Scenario::endless(3);
        scenario.duration = Some(2.0 * HOUR_S);
        for die in [&mut scenario.sensor.accel, &mut scenario.sensor.gyro] {
            die.rate = 100.0;
        }
        let (windows, counters) = walk(&scenario, &Parameters::default(), true).unwrap();
        assert_eq!((counters.repaired, counters.restarts), (0, 0));
        let [first, second] = [windows[0], windows[1]];
        assert!(first.stances > 2_000 && second.stances > 2_000);
        assert_eq!(first.invented + second.invented, 0);
        assert!(first.missed + second.missed < 10, "{} and {}", first.missed, second.missed);
        for (early, late) in first.errors().into_iter().zip(second.errors()) {
            // Some thousand strides of a random walk each: their errors differ by chance, by less than a third.
            assert!(late < 1.33 * early, "{early} became {late}");
        }
    }
}
