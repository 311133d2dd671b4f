//! What tracker and particle filter cost on this machine: instructions, counted by callgrind.
//!
//! Counts, unlike times, are the same on every run and on a busy machine. Callgrind itself is called rather than a bench
//! framework: one function is switched on and off, and one number is read.

use crate::cost::{self, Cost};
use crate::process::{self, Failure};
use crate::{together, tools};
use std::path::Path;
use std::process::Command;

/// Sampling of the counted walks. **Units:** microseconds.
const PERIODS_US: [u32; 2] = [5_000, 500];

/// Of the tracker, in the order of [`cost::table`].
const SETTINGS: [&str; 2] = ["default", "documented"];

/// A prediction of the default filter must cost less than this part of a documented one.
const LARGEST_SHARE: f64 = 0.5;

/// Buildings for the particle filter, each with clouds of so many particles: floors, and rooms along each side of them. The
/// largest has six floors of 10 000 m².
const BUILDINGS: [([u16; 2], &[u16]); 3] =
    [([1, 6], &[10_000, 50_000]), ([2, 6], &[10_000]), ([6, 20], &[10_000, 50_000])];

/// To move and to draw a particle in the largest building must cost less than so many times that in the smallest. What a cluster
/// costs depends on how many cells the cloud occupies, at most one for each particle, and so on the cloud.
const LARGEST_GROWTH: f64 = 1.05;

/// Prints what samples, filter steps and particles cost. An error when the default filter costs too much, and when a particle
/// costs more in a larger building.
pub fn run() -> Result<(), Failure> {
    tools::VALGRIND.required()?;
    tracker()?;
    particles()
}

fn particles() -> Result<(), Failure> {
    let program = process::build("release", "--example", "particle_cost")?;
    let clouds = BUILDINGS.iter().flat_map(|&(building, clouds)| clouds.iter().map(move |&cloud| (building, cloud)));
    let clouds: Vec<([u16; 2], u16)> = clouds.collect();
    let parts = ["moves", "draw", "clusters"];
    let wanted =
        clouds.iter().flat_map(|&([floors, rooms], particles)| parts.map(|part| (part, [particles, floors, rooms])));
    let wanted = [("reference", [10_000, 1, 6])].into_iter().chain(wanted).collect();
    let costs = together::each(wanted, together::processors(), |(part, numbers)| {
        let numbers = numbers.map(|number| number.to_string());
        let words = [part].into_iter().chain(numbers.each_ref().map(String::as_str));
        Ok(count(&program, words)?.mean())
    })?;
    let (reference, costs) = (costs[0], costs[1..].chunks_exact(parts.len()));
    println!(
        "instructions for each particle, and the ratio of moves with walls to a textbook's without, {reference:.0} (x86-64)"
    );
    println!("  floors  rooms/floor  particles      moves       draw   clusters      ratio");
    let mut sums = Vec::new();
    for (([floors, rooms], particles), costs) in clouds.into_iter().zip(costs) {
        let (moves, draw, clusters) = (costs[0], costs[1], costs[2]);
        let (ratio, rooms) = (moves / reference, u32::from(rooms).pow(2));
        println!("  {floors:>6} {rooms:>12} {particles:>10} {moves:>10.1} {draw:>10.1} {clusters:>10.1} {ratio:>10.2}");
        sums.push(moves + draw);
    }
    let (first, last) = (sums[0], sums[sums.len() - 1]);
    if last < LARGEST_GROWTH * first {
        return Ok(());
    }
    Err(Failure::Found(format!(
        "a particle costs {last:.0} instructions in the largest building and {first:.0} in the smallest; at most \
         {LARGEST_GROWTH} times as many may be"
    )))
}

fn tracker() -> Result<(), Failure> {
    let program = process::build("release", "--example", "cost")?;
    let phases = PERIODS_US.iter().flat_map(|&period_us| ["swinging", "standing"].map(|part| (part, period_us)));
    let wanted = phases.chain(["prediction", "correction"].map(|part| (part, PERIODS_US[0])));
    let wanted = wanted.flat_map(|(part, period_us)| SETTINGS.map(|setting| (setting, part, period_us))).collect();
    let costs = together::each(wanted, together::processors(), |(setting, part, period_us): (&str, &str, u32)| {
        Ok((part, count(&program, [setting, part, &period_us.to_string()])?))
    })?;
    let mut columns = costs.chunks_exact(SETTINGS.len()).map(|costs| (costs[0].0, costs[0].1, costs[1].1));
    let mut next = || columns.next().expect("as many were counted as are wanted");
    for period_us in PERIODS_US {
        let (swinging, standing) = (next(), next());
        let mean = ("mean", swinging.1.and(standing.1), swinging.2.and(standing.2));
        let title = format!("instructions for each IMU sample at {} Hz (x86-64)", 1_000_000 / period_us);
        println!("{}", cost::table(&title, &[swinging, standing, mean]));
    }
    let steps = [next(), next()];
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

/// What callgrind counts of a program that prints how often its part ran.
fn count<'a>(program: &Path, arguments: impl IntoIterator<Item = &'a str>) -> Result<Cost, Failure> {
    let words = "--tool=callgrind --collect-atstart=no --toggle-collect=*counted* --callgrind-out-file=/dev/null";
    let mut command = Command::new("valgrind");
    command.args(words.split(' ')).arg(program).args(arguments);
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
