//! `sohle bench`: what the particle filter costs on this machine, what steps with positions do, and what the matcher on a walk graph.

use super::table::Table;
use super::{Error, print};
use crate::evaluation::fixes::pace::{STEP_US, Walker};
use crate::fixes::adjustment::Adjustment;
use crate::fixes::extended::Extended;
use crate::fixes::{Documented, Method, Smoother, Start, smoother};
use crate::graph::speed as corridors;
use crate::particle::speed::{Work, building};
use clap::ValueEnum;
use std::time::{Duration, Instant};

/// Times the particle filter over particles, walls and floors, steps with positions over the length of the walk, and the matcher over
/// the size of the walk graph
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Each figure is the median of several runs. The reference is a textbook's move without walls, in the same \
run: the ratio to it can be compared between machines, times cannot.\n\nExample:\n  sohle bench --runs 21"
)]
pub struct Args {
    /// Runs of each part
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    runs: u32,
    /// How the result is written
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Table,
    Json,
}

/// A building and a cloud to time.
struct Case {
    floors: u16,
    rooms: u16,
    particles: usize,
}

const CASES: [Case; 7] = [
    Case { floors: 2, rooms: 6, particles: 10_000 },
    Case { floors: 2, rooms: 6, particles: 100_000 },
    Case { floors: 6, rooms: 6, particles: 100_000 },
    Case { floors: 6, rooms: 20, particles: 100_000 },
    Case { floors: 6, rooms: 40, particles: 100_000 },
    Case { floors: 6, rooms: 20, particles: 200_000 },
    Case { floors: 6, rooms: 20, particles: 500_000 },
];

/// What was measured of one case. **Units:** as the names say.
#[derive(serde::Serialize)]
struct Row {
    particles: usize,
    floors: u16,
    walls_per_floor: usize,
    /// Millions of moves with walls in a second, on one core.
    moves_one_core: f64,
    /// On two.
    moves_two_cores: f64,
    /// The reference, without walls, on one core.
    reference: f64,
    draw_ms: f64,
    clusters_ms: f64,
    /// Move, drawing and clusters, on two cores.
    step_ms: f64,
    memory_mb: f64,
}

/// Times and tells.
pub fn run(args: Args) -> Result<(), Error> {
    let mut rows = Vec::new();
    let bar = super::progress(CASES.len() as u64, "timing", false);
    for case in &CASES {
        rows.push(measure(case, args.runs)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let paces: Vec<Pace> = HOURS.into_iter().flat_map(paces).collect();
    let matches = MATCHED.into_iter().map(|(edges, known)| matched(edges, known)).collect::<Result<Vec<_>, _>>()?;
    match args.format {
        Format::Table => {
            print(&[table(&rows), paces_table(&paces), matches_table(&matches)].map(|table| table.text()).join("\n"))
        }
        Format::Json => print(&format!(
            "{}\n",
            serde_json::to_string_pretty(&serde_json::json!({"particles": rows, "fixes": paces, "graph": matches}))?
        )),
    }
}

/// Walks of so many hours, and the steps at their ends that are timed.
const HOURS: [f64; 3] = [1.0, 5.0, 10.0];
const TIMED: usize = 200;

/// A step with a position at the end of a long walk. **Units:** as the names say.
#[derive(serde::Serialize)]
struct Pace {
    method: &'static str,
    hours: f64,
    median_us: f64,
    longest_us: f64,
}

fn paces(hours: f64) -> [Pace; 3] {
    let (documented, start) = (Documented::default(), Start::default());
    // The adjustment takes all steps again with each position: only some of those on the way are told.
    [
        pace("least squares", hours, &mut Adjustment::new(&documented, &start), 500),
        pace("extended", hours, &mut Extended::new(&documented, &start), 1),
        pace("smoother", hours, &mut Smoother::new(&smoother::Parameters::default(), &start), 1),
    ]
}

fn pace(method: &'static str, hours: f64, told: &mut dyn Method, every: usize) -> Pace {
    let steps = (hours * 3.6e9 / STEP_US as f64) as usize;
    let mut walker = Walker::default();
    (0..steps).for_each(|step| walker.step(told, step % every == 0));
    let mut times: Vec<Duration> = (0..TIMED)
        .map(|_| {
            let start = Instant::now();
            walker.step(told, true);
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    let us = |time: Duration| time.as_secs_f64() * 1e6;
    Pace { method, hours, median_us: us(times[TIMED / 2]), longest_us: us(times[TIMED - 1]) }
}

fn paces_table(paces: &[Pace]) -> Table {
    // What does not grow with the walk stays at 1; times differ between machines, this does not.
    let headings = ["after hours", "median us", "longest us", "to the first"];
    let mut table = Table::new("a step with a position", &headings);
    for pace in paces {
        let first =
            paces.iter().find(|first| first.method == pace.method).map_or(pace.median_us, |first| first.median_us);
        let mut cells = vec![format!("{:.0}", pace.hours)];
        cells.extend([pace.median_us, pace.longest_us].map(|us| format!("{us:.1}")));
        cells.push(format!("{:.2}", pace.median_us / first));
        table.row(pace.method, cells);
    }
    table
}

/// Graphs with so many directed edges, and whether the start is known.
const MATCHED: [(usize, bool); 4] = [(1_000, true), (10_000, true), (100_000, true), (100_000, false)];
/// So many steps on each are timed, from the first.
const WALKED: usize = 1_000;

/// Steps on a walk graph. **Units:** as the names say.
#[derive(serde::Serialize)]
struct Matched {
    edges: usize,
    start: &'static str,
    median_us: f64,
    longest_us: f64,
}

fn matched(edges: usize, known: bool) -> Result<Matched, Error> {
    let mut work = corridors::Work::new(edges, known)?;
    let mut times: Vec<Duration> = (0..WALKED)
        .map(|_| {
            let start = Instant::now();
            work.step();
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    let us = |time: Duration| time.as_secs_f64() * 1e6;
    let start = if known { "known" } else { "anywhere" };
    Ok(Matched { edges: work.edges(), start, median_us: us(times[WALKED / 2]), longest_us: us(times[WALKED - 1]) })
}

fn matches_table(matches: &[Matched]) -> Table {
    let mut table = Table::new("a step on a walk graph", &["edges", "median us", "longest us"]);
    for matched in matches {
        let mut cells = vec![matched.edges.to_string()];
        cells.extend([matched.median_us, matched.longest_us].map(|us| format!("{us:.1}")));
        table.row(format!("start {}", matched.start), cells);
    }
    table
}

fn measure(case: &Case, runs: u32) -> Result<Row, Error> {
    let mut work = Work::new(building(case.floors, case.rooms)?, case.particles)?;
    let pool = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| Error::new(format!("cannot start {threads} threads: {error}")))
    };
    let (one, two) = (pool(1)?, pool(2)?);
    let millions = |time: Duration| case.particles as f64 / time.as_secs_f64() / 1e6;
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let reference = millions(median(runs, &mut work, |work| _ = work.reference()));
    let moves_one_core = millions(median(runs, &mut work, |work| _ = one.install(|| work.moves())));
    let moves_two_cores = millions(median(runs, &mut work, |work| _ = two.install(|| work.moves())));
    let draw_ms = ms(median(runs, &mut work, |work| _ = work.draw(case.particles)));
    let clusters_ms = ms(median(runs, &mut work, |work| _ = work.clusters()));
    let step = median(runs, &mut work, |work| {
        two.install(|| work.moves());
        work.draw(case.particles);
        work.clusters();
    });
    Ok(Row {
        particles: case.particles,
        floors: case.floors,
        walls_per_floor: work.walls(),
        moves_one_core,
        moves_two_cores,
        reference,
        draw_ms,
        clusters_ms,
        step_ms: ms(step),
        memory_mb: work.bytes() as f64 / 1e6,
    })
}

/// The median time of some work, each time on the cloud as it was at the start.
fn median(runs: u32, work: &mut Work, part: impl Fn(&mut Work)) -> Duration {
    let mut times: Vec<Duration> = (0..runs)
        .map(|_| {
            work.renew();
            let start = Instant::now();
            part(work);
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    times[times.len() / 2]
}

fn table(rows: &[Row]) -> Table {
    let headings = [
        "floors",
        "walls/floor",
        "M moves/s, 1 core",
        "2 cores",
        "reference",
        "ratio",
        "draw ms",
        "clusters ms",
        "step ms",
        "MB",
    ];
    let mut table = Table::new("particles", &headings);
    for row in rows {
        let cells = vec![
            row.floors.to_string(),
            row.walls_per_floor.to_string(),
            format!("{:.1}", row.moves_one_core),
            format!("{:.1}", row.moves_two_cores),
            format!("{:.1}", row.reference),
            format!("{:.2}", row.moves_one_core / row.reference),
            format!("{:.2}", row.draw_ms),
            format!("{:.2}", row.clusters_ms),
            format!("{:.1}", row.step_ms),
            format!("{:.1}", row.memory_mb),
        ];
        table.row(row.particles.to_string(), cells);
    }
    table
}
