//! `cargo xtask recordings`: brings the files of the manifest from their upstream repositories.
//!
//! They are other people's work under their own licences, so none of them is part of this repository. Each is pinned to a
//! commit and checked by its SHA-256; what is complete is not fetched again, and what was interrupted goes on.
//!
//! `curl` does the transfers: it resumes, follows proxies and trusts what the machine trusts. A client of our own would
//! add 33 crates and a C compiler's work (`ring`), 23 s on two cores, to every first build of the checks.

mod fetch;
mod manifest;

use crate::process::Failure;
use crate::{in_root, tools};
use fetch::{Fetcher, Outcome};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

/// What to fetch, and where to.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder for the recordings [default: recordings/ in the checkout]
    #[arg(long)]
    dir: Option<PathBuf>,
    /// Manifest that lists them [default: tests/recordings.toml in the checkout]
    #[arg(long)]
    manifest: Option<PathBuf>,
    /// Server of raw repository files; a mirror with the same paths will do
    #[arg(long, value_name = "URL", default_value = "https://raw.githubusercontent.com")]
    from: String,
}

/// Fetches what is missing.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    tools::CURL.required()?;
    let path = arguments.manifest.clone().unwrap_or_else(|| in_root("tests/recordings.toml"));
    let folder = arguments.dir.clone().unwrap_or_else(|| in_root("recordings"));
    let files = manifest::read(&path)?;
    let fetcher = Fetcher::new(&arguments.from, &folder);
    let terminal = std::io::stderr().is_terminal();
    let (mut fetched, mut present) = (0, 0);
    for (index, file) in files.iter().enumerate() {
        let progress = |bytes| {
            if terminal {
                // Nobody reading this terminal is no reason to stop.
                let _ = write!(std::io::stderr(), "\r{}", bar(index, files.len(), &file.path, bytes));
            }
        };
        let outcome = fetcher.fetch(file, progress);
        if terminal {
            eprint!("\r{:100}\r", "");
        }
        match outcome {
            Ok(Outcome::Present) => present += 1,
            Ok(Outcome::Fetched) => {
                fetched += 1;
                println!("{} ({})", file.path, file.licence);
            }
            Err(error) => {
                fetcher.tidy();
                let done = fetched + present;
                return Err(Failure::Found(format!("{error} ({done} of {} files are complete)", files.len())));
            }
        }
    }
    println!("{fetched} files fetched, {present} were complete, in {}", folder.display());
    Ok(())
}

/// One line of progress: files done of all, and the bytes of the one under way.
fn bar(done: usize, all: usize, path: &str, bytes: u64) -> String {
    const WIDTH: usize = 20;
    let filled = done * WIDTH / all.max(1);
    let name: String = path.chars().take(48).collect();
    format!(
        "[{:=<filled$}{:WIDTH_LEFT$}] {done}/{all} {name:48} {:>7.1} MB",
        "",
        "",
        bytes as f64 * 1e-6,
        WIDTH_LEFT = WIDTH - filled
    )
}

/// Checksums of the files in the project's manifest, but for licences, whose texts anyone may have.
pub fn checksums() -> Result<BTreeSet<String>, Failure> {
    let files = manifest::read(&in_root("tests/recordings.toml"))?;
    Ok(files.into_iter().filter(|file| !file.path.contains("LICENSE")).map(|file| file.sha256).collect())
}

/// SHA-256 in hexadecimal.
pub fn sha256_of(content: &[u8]) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_standard() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(sha256_of(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }

    #[test]
    fn the_bar_keeps_its_width() {
        let widths: Vec<usize> =
            [(0, 3, 0), (3, 3, 9_999_999)].map(|(done, all, bytes)| bar(done, all, "a/b", bytes).len()).to_vec();
        assert_eq!(widths[0], widths[1]);
        assert!(bar(1, 2, "a/b", 1_500_000).starts_with("[==========          ] 1/2 a/b"));
    }
}
