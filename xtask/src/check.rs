//! What is committed: no data, no licence that the project cannot pass on, a changelog that can take the next entry.

mod licences;

use crate::process::{self, Failure};
use crate::{in_root, recordings};
use std::collections::BTreeSet;
use std::path::Path;

/// Every workspace of the checkout: each has a lock file of its own.
pub const MANIFESTS: [&str; 5] = [
    "Cargo.toml",
    "firmware/ble/Cargo.toml",
    "firmware/emulator/Cargo.toml",
    "firmware/shoe/Cargo.toml",
    "fuzz/Cargo.toml",
];

/// The largest file a commit may hold. **Units:** bytes.
const LARGEST_FILE: u64 = 1_000_000;

/// Endings of files that hold recordings, maps or archives of them.
const DATA_ENDINGS: [&str; 14] =
    ["bag", "bin", "db", "gz", "h5", "mat", "mcap", "npy", "npz", "parquet", "pcap", "pgm", "xz", "zip"];

/// All checks of what is committed.
pub fn run() -> Result<(), Failure> {
    no_data()?;
    licences::run()?;
    changelog()
}

/// A file under version control, as the check sees it.
struct Committed<'a> {
    path: &'a str,
    bytes: u64,
    sha256: String,
}

/// No recording is committed, under its own name or another, and nothing large.
pub fn no_data() -> Result<(), Failure> {
    let known: BTreeSet<String> = recordings::checksums()?;
    let listed = process::read(&mut process::program("git", ["ls-files", "-z"]))?;
    let mut found = Vec::new();
    let mut count = 0;
    for path in listed.out.split('\0').filter(|path| !path.is_empty()) {
        let full = in_root(path);
        let Ok(content) = std::fs::read(&full) else { continue };
        let file = Committed { path, bytes: content.len() as u64, sha256: recordings::sha256_of(&content) };
        found.extend(objection(&file, &known));
        count += 1;
    }
    if found.is_empty() {
        println!("{count} committed files, none of them data");
        return Ok(());
    }
    Err(Failure::Found(found.join("; ")))
}

fn objection(file: &Committed, known: &BTreeSet<String>) -> Option<String> {
    let path = file.path;
    let ending = Path::new(path).extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    if path.starts_with("recordings/") {
        Some(format!("{path} is committed, but recordings are fetched, not committed"))
    } else if known.contains(&file.sha256) {
        Some(format!("{path} is a copy of a recording of the manifest"))
    } else if DATA_ENDINGS.contains(&ending.to_ascii_lowercase().as_str()) {
        Some(format!("{path} looks like a data file (.{ending})"))
    } else if file.bytes > LARGEST_FILE {
        Some(format!("{path} has {} bytes, more than {LARGEST_FILE}", file.bytes))
    } else {
        None
    }
}

/// The changelog begins with the section that the next change goes into.
pub fn changelog() -> Result<(), Failure> {
    let path = in_root("CHANGELOG.md");
    let text =
        std::fs::read_to_string(&path).map_err(|source| Failure::File { path: path.display().to_string(), source })?;
    match text.lines().find(|line| line.starts_with("## ")) {
        Some("## Unreleased") => Ok(()),
        Some(other) => {
            Err(Failure::Found(format!("CHANGELOG.md: the first section is `{other}`, not `## Unreleased`")))
        }
        None => Err(Failure::Found("CHANGELOG.md: no section `## Unreleased`".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, bytes: u64) -> Committed<'_> {
        Committed { path, bytes, sha256: "ab".repeat(32) }
    }

    #[test]
    fn sources_and_pictures_may_be_committed() {
        let known = BTreeSet::new();
        for path in ["shared/src/lib.rs", "docs/track.png", "tests/recordings.toml", "xtask/src/recordings/fetch.rs"] {
            assert_eq!(objection(&file(path, 20_000), &known), None);
        }
    }

    #[test]
    fn data_is_refused_by_folder_ending_size_and_content() {
        let known = BTreeSet::from(["ab".repeat(32)]);
        assert!(objection(&file("recordings/walk.csv", 10), &BTreeSet::new()).is_some());
        assert!(objection(&file("tests/walk.MAT", 10), &BTreeSet::new()).is_some());
        assert!(objection(&file("tests/walk.csv", 2_000_000), &BTreeSet::new()).is_some());
        assert!(objection(&file("tests/renamed.txt", 10), &known).is_some());
    }
}
