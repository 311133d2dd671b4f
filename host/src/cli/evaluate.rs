//! `sohle evaluate`: every recording of a manifest tracked and judged.

use super::{Error, parameters, print};
use crate::evaluation::{Manifest, Perturbation, Report, Settings, evaluate};
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
    let manifest =
        Manifest::read(&args.manifest.unwrap_or_else(project_manifest))?.only(&args.only).map_err(Error::new)?;
    let parameters = args.parameters.as_deref().map(parameters::read).transpose()?;
    let settings = Settings::both(parameters.unwrap_or_default());
    let perturbations = match args.perturb {
        None => Vec::new(),
        Some(named) if named.is_empty() => Perturbation::value_variants().to_vec(),
        Some(named) => named,
    };
    let threads = args.threads.map_or(0, std::num::NonZeroUsize::get);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let report = pool.install(|| Report {
        evaluation: evaluate(&manifest, &settings, Perturbation::Recorded),
        perturbed: perturbations
            .into_iter()
            .map(|perturbation| (perturbation, evaluate(&manifest, &settings, perturbation)))
            .collect(),
    });
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
