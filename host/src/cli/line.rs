//! `sohle line`: whether every step arrives over a bad line.

use super::table::Table;
use super::{Error, print};
use crate::link::endurance::{Kind, Tally, run as endure};
use clap::ValueEnum;

/// Sends steps from a simulated shoe over a simulated bad line and tells what became of them
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Both ends of the wire are those of the firmware and of 'sohle live'; an hour takes seconds.\n\n\
Example:\n  sohle line --seed 7"
)]
pub struct Args {
    /// Steps to send, one in about 1.1 s of simulated time
    #[arg(long, value_name = "N", default_value_t = 3273, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    steps: u32,
    /// All that is random follows from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How the result is written
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Table,
    Json,
}

/// A line of the result.
#[derive(serde::Serialize)]
struct Row {
    line: &'static str,
    #[serde(flatten)]
    tally: Tally,
}

/// Sends and tells. Fails if a step was lost, doubled or wrong.
pub fn run(args: Args) -> Result<(), Error> {
    let rows = Kind::ALL.map(|kind| Row { line: kind.name(), tally: endure(kind, args.steps, args.seed) });
    match args.format {
        Format::Table => print(&table(&rows).text())?,
        Format::Json => print(&format!("{}\n", serde_json::to_string_pretty(&rows)?))?,
    }
    let bad = |row: &&Row| row.tally.lost + row.tally.doubled + row.tally.wrong > 0;
    match rows.iter().find(bad) {
        Some(row) => Err(Error::new(format!("{}: steps were lost, doubled or wrong", row.line))),
        None => Ok(()),
    }
}

fn table(rows: &[Row]) -> Table {
    let headings =
        ["made", "arrived", "lost", "erased", "doubled", "wrong", "median ms", "longest s", "clock ms", "shoe kB"];
    let mut table = Table::new("line", &headings);
    for Row { line, tally } in rows {
        let counts = [tally.made, tally.arrived, tally.lost, tally.erased, tally.doubled, tally.wrong];
        let figures = [
            format!("{:.1}", tally.delay_median_s * 1e3),
            format!("{:.2}", tally.delay_max_s),
            format!("{:.2}", tally.clock_error_max_s * 1e3),
            format!("{:.1}", tally.bytes as f64 * 1e-3),
        ];
        table.row(*line, counts.iter().map(u32::to_string).chain(figures).collect());
    }
    table
}
