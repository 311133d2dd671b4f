//! `sohle evaluate`: every recording of a manifest tracked and judged.

use super::suite::{self as table, drawn};
use super::{Error, parameters, print, progress};
use crate::building::open::{Options, open};
use crate::evaluation::building::{suite, unknown};
use crate::evaluation::{Manifest, Perturbation, Report, Settings, evaluate};
use crate::evaluation::{fixes, graph, phone};
use crate::{particle, toml_file};
use clap::ValueEnum;
use std::path::{Path, PathBuf};

/// Tracks all recordings of a manifest and scores each against its truth
#[derive(Debug, clap::Args)]
#[command(after_help = "How a manifest is written for recordings of one's own: docs/manifest.md\n\n\
    Examples:\n  sohle evaluate\n  sohle evaluate --manifest mine.toml --format json\n  \
    sohle evaluate --parameters mine.toml --perturb")]
pub struct Args {
    /// What to run and what is known of it; the project's own tests/recordings.toml when left out
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
    /// Walks in buildings in place of the manifest's recordings
    #[arg(long, value_enum, conflicts_with_all = ["manifest", "parameters", "only", "perturb"])]
    suite: Option<Suite>,
    /// Settings of the particle filter in place of the default
    #[arg(long, value_name = "FILE.toml", requires = "suite")]
    particle: Option<PathBuf>,
    /// Walks in each building in the suites 'building' (200 from an unknown start) and 'graph' (40)
    #[arg(long, value_name = "N", requires = "suite", value_parser = some_walks)]
    walks: Option<usize>,
    /// All that is random in a suite follows from it
    #[arg(long, value_name = "N", default_value_t = 1, requires = "suite")]
    seed: u64,
    /// Draws the recorded walk of the suites 'fixes' and 'graph', as each method has it, into this folder
    #[arg(long, value_name = "DIR", requires = "suite")]
    pictures: Option<PathBuf>,
    /// How to print the scores
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// Settings to be judged in place of the default
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Run these recordings only
    #[arg(long, value_name = "NAME", num_args = 1..)]
    only: Vec<String>,
    /// Changes to the recordings to be judged beside them; all of them when none is named
    #[arg(long, value_name = "CHANGE", num_args = 0..)]
    perturb: Option<Vec<Perturbation>>,
    /// Threads to run on; the number changes no result
    #[arg(long, value_name = "N")]
    threads: Option<std::num::NonZeroUsize>,
}

/// A number of walks: of none there are no figures.
fn some_walks(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&walks| walks > 0).ok_or_else(|| "expected a whole number from 1 on".to_owned())
}

/// Walks in buildings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Suite {
    /// The evaluation of the document (Foot, chapter 7) in a twin of its building
    FootDocument,
    /// Many walks from an unknown start on three floors, and walks of which a part is missing
    Building,
    /// Recorded walks with a phone in the hand, on the plans of their floors
    Phone,
    /// Steps with positions of another source: the document's comparison (Fix, 3.4) on a recorded walk, and simulated walks
    Fixes,
    /// The document's comparison on walk graphs (Graph, 7.5): simulated walks of a phone in both committed buildings, and a
    /// recorded one
    Graph,
}

/// How the scores are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// For people
    Table,
    /// One object
    Json,
    /// A line for each recording and setting
    Csv,
}

/// The project's own manifest.
fn project_manifest() -> PathBuf {
    let host = Path::new(env!("CARGO_MANIFEST_DIR"));
    host.parent().unwrap_or(host).join("tests/recordings.toml")
}

/// Tracks, judges, prints.
pub fn run(args: Args) -> Result<(), Error> {
    if let Some(suite) = args.suite {
        return in_pool(args.threads, || run_suite(suite, &args))?;
    }
    let manifest =
        Manifest::read(&args.manifest.unwrap_or_else(project_manifest))?.only(&args.only).map_err(Error::new)?;
    let parameters = args.parameters.as_deref().map(parameters::read).transpose()?;
    let settings = Settings::both(parameters.unwrap_or_default());
    let perturbations = match args.perturb {
        None => Vec::new(),
        Some(named) if named.is_empty() => Perturbation::value_variants().to_vec(),
        Some(named) => named,
    };
    let report = in_pool(args.threads, || Report {
        evaluation: evaluate(&manifest, &settings, Perturbation::Recorded),
        perturbed: perturbations
            .into_iter()
            .map(|perturbation| (perturbation, evaluate(&manifest, &settings, perturbation)))
            .collect(),
    })?;
    match args.format {
        Format::Table => print(&report.table())?,
        Format::Json => print(&report.json()?)?,
        Format::Csv => print(&report.csv())?,
    }
    if args.format != Format::Table {
        eprint!("{}", report.summary());
    }
    match report.failed().as_slice() {
        [] => Ok(()),
        failed => Err(Error::new(format!("{} recordings failed: {}", failed.len(), failed.join(", ")))),
    }
}

/// Does the work on so many threads.
fn in_pool<T: Send>(threads: Option<std::num::NonZeroUsize>, work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    let threads = threads.map_or(0, std::num::NonZeroUsize::get);
    Ok(rayon::ThreadPoolBuilder::new().num_threads(threads).build()?.install(work))
}

/// Rooms of a walk from an unknown start, and of a walk of which a part is missing.
const SHORT_STOPS: usize = 6;
const LONG_STOPS: usize = 12;
/// So often each walk with a phone is followed, each time with other random numbers.
const PHONE_SEEDS: u64 = 5;
/// Walks in each building.
const UNKNOWN_WALKS: usize = 200;
const GRAPH_WALKS: usize = 40;

/// The committed buildings.
const BUILDINGS: [(&str, &str); 2] = [("twin", "buildings/twin.geojson"), ("large", "buildings/large.geojson")];

/// Simulated walks in the committed buildings, and the recorded one.
fn graphs(args: &Args, particle: particle::Parameters) -> Result<(String, serde_json::Value), Error> {
    let host = Path::new(env!("CARGO_MANIFEST_DIR"));
    let settings = graph::follow::Settings { particle, seed: args.seed, ..Default::default() };
    let methods = graph::follow::Method::ALL.len();
    let count = args.walks.unwrap_or(GRAPH_WALKS);
    let bar = progress((BUILDINGS.len() * (1 + methods) * count) as u64, "walks", false);
    let done = || bar.inc(1);
    let mut rows = Vec::new();
    for (name, file) in BUILDINGS {
        let building = open(&host.parent().unwrap_or(host).join(file), &Options::default())?;
        let site = graph::walks::Site::of(name, building)?;
        let walks = graph::walks::random_walks(&site, count, args.seed, done)?;
        rows.extend(graph::suite::rows(&site, &walks, &settings, done)?);
    }
    bar.finish_and_clear();
    let walk = phone::walk::eight()?;
    let comparison = graph::eight::Comparison::of(&walk)?;
    let eight = comparison.rows(&settings)?;
    if let Some(folder) = &args.pictures {
        drawn::graph(&walk, &comparison, &settings, folder)?;
    }
    // Times differ from run to run: they are no part of what is kept.
    eprint!("{}", table::graph_times(&rows).text());
    let text = [table::graph_walks(&rows), table::graph_eight(&eight)].map(|table| table.text()).join("\n");
    Ok((text, serde_json::json!({"walks": rows, "eight": eight})))
}

fn run_suite(which: Suite, args: &Args) -> Result<(), Error> {
    if args.pictures.is_some() && !matches!(which, Suite::Fixes | Suite::Graph) {
        return Err(Error::new("--pictures draws the suites 'fixes' and 'graph' only"));
    }
    let default = match &args.particle {
        Some(path) => toml_file::read("settings of the particle filter", path)?,
        None if matches!(which, Suite::Phone | Suite::Fixes | Suite::Graph) => particle::Parameters::phone(),
        None => particle::Parameters::default(),
    };
    let (mut text, json) = match which {
        Suite::FootDocument => {
            let (known, others) = (suite::known(&default, args.seed)?, suite::others(&default, args.seed)?);
            let text = [table::known(&known), table::others(&others)].map(|table| table.text()).join("\n");
            (text, serde_json::json!({"known": known, "others": others}))
        }
        Suite::Building => {
            let documented = particle::Parameters::documented();
            let count = args.walks.unwrap_or(UNKNOWN_WALKS);
            let bar = progress(2 * 8 * count as u64, "walks", false);
            let done = || bar.inc(1);
            let (mut rows, mut lost) = (Vec::new(), Vec::new());
            for site in [unknown::Site::institute()?, unknown::Site::offices()?] {
                let walks = unknown::random_walks(&site, count, SHORT_STOPS, args.seed, done)?;
                let long = unknown::random_walks(&site, count, LONG_STOPS, args.seed, done)?;
                for (name, parameters) in [("documented", &documented), ("default", &default)] {
                    rows.push(unknown::unknown(&site, name, parameters, &walks, done)?);
                    lost.extend(unknown::lost(&site, name, parameters, &long, done)?);
                }
            }
            bar.finish_and_clear();
            let mut tables = vec![table::unknown(&rows), table::lost(&lost)];
            tables.extend(rows.iter().map(table::reliability));
            let text = tables.iter().map(|table| table.text()).collect::<Vec<_>>().join("\n");
            (text, serde_json::json!({"unknown": rows, "lost": lost}))
        }
        Suite::Phone => {
            let seeds: Vec<u64> = (0..PHONE_SEEDS).map(|seed| args.seed.wrapping_add(seed)).collect();
            let steps = crate::phone::Parameters::default();
            let rows = phone::suite::run(&phone::walk::all()?, (&steps, &default), &seeds)?;
            (table::phone(&rows).text(), serde_json::json!({"phone": rows}))
        }
        Suite::Fixes => {
            // The first has positions of its own.
            let walks = phone::walk::all()?;
            let steps = crate::phone::Parameters::default();
            let [eight, mall @ ..] = &walks[..] else { return Ok(()) };
            let comparison = fixes::eight::Comparison::of(eight, &steps)?;
            if let Some(folder) = &args.pictures {
                drawn::fixes(eight, &comparison, folder)?;
            }
            let rows = comparison.rows(&default, args.seed)?;
            let mall = fixes::mall::rows(mall, &steps, args.seed);
            let walks = fixes::walks::rows(args.seed)?;
            let recorded = fixes::ranges::Recorded::read()?;
            let (ranges, placed) = (recorded.rows(), recorded.placed());
            let tables = [
                table::eight(&rows),
                table::mall(&mall),
                table::walks(&walks),
                table::ranges(&ranges),
                table::placed(&placed),
            ];
            let text = tables.map(|table| table.text()).join("\n");
            (text, serde_json::json!({"eight": rows, "mall": mall, "walks": walks, "ranges": ranges, "placed": placed}))
        }
        Suite::Graph => graphs(args, default)?,
    };
    if args.format == Format::Json {
        text = format!("{}\n", serde_json::to_string_pretty(&json)?);
    }
    print(&text)
}
