//! Fetching one file: whole and right, or not at all.
//!
//! Bytes go into a file ending in `.part` beside the target. It becomes the target once its checksum is right, it is kept
//! when the transfer breaks off, and it is thrown away when it turns out to be something else.

use super::manifest::File;
use super::sha256_of;
use crate::process::{self, Ended, Failure};
use std::path::{Path, PathBuf};

/// How often a transfer that breaks off is taken up again within one run.
const ATTEMPTS: u32 = 4;

/// What came of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was complete already.
    Present,
    /// It was fetched.
    Fetched,
}

/// Why a file could not be had.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// No connection.
    #[error("cannot reach {server}: {reason}; run again when online")]
    Offline {
        /// Whom.
        server: String,
        /// What curl says.
        reason: String,
    },
    /// The server does not give it.
    #[error("{address}: {reason}")]
    Refused {
        /// Of the file.
        address: String,
        /// What curl says.
        reason: String,
    },
    /// The transfer broke off.
    #[error("{address}: broke off after {bytes} bytes, which are kept: {reason}; run again to go on")]
    BrokenOff {
        /// Of the file.
        address: String,
        /// How many there are.
        bytes: u64,
        /// What curl says.
        reason: String,
    },
    /// The file is another than the manifest says.
    #[error("{address}: sha256 is {found}, the manifest says {expected}; nothing was kept")]
    WrongChecksum {
        /// Of the file.
        address: String,
        /// Of what came.
        found: String,
        /// Of the manifest.
        expected: String,
    },
    /// A file of this machine cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// curl cannot be started.
    #[error(transparent)]
    Curl(#[from] Failure),
}

/// Fetches files from one server into one folder.
pub struct Fetcher<'a> {
    server: &'a str,
    folder: &'a Path,
}

impl<'a> Fetcher<'a> {
    /// From `server` into `folder`.
    pub fn new(server: &'a str, folder: &'a Path) -> Self {
        Self { server, folder }
    }

    /// Makes sure that `file` is in the folder. `progress` is told the bytes there are, now and then.
    pub fn fetch(&self, file: &File, mut progress: impl FnMut(u64)) -> Result<Outcome, FetchError> {
        let target = self.folder.join(&file.path);
        if checksum(&target)?.as_ref() == Some(&file.sha256) {
            return Ok(Outcome::Present);
        }
        let part = PathBuf::from(format!("{}.part", target.display()));
        let parent = target.parent().unwrap_or(self.folder);
        std::fs::create_dir_all(parent).map_err(|source| FetchError::File { path: parent.into(), source })?;
        let address = file.address(self.server);
        let mut resumed = size(&part) > 0;
        loop {
            // A complete part is not asked for again: there is nothing after its end.
            let complete = resumed && checksum(&part)?.as_ref() == Some(&file.sha256);
            if !complete {
                self.transfer(&address, &part, &mut progress)?;
            }
            let found = checksum(&part)?.unwrap_or_default();
            if found == file.sha256 {
                std::fs::rename(&part, &target).map_err(|source| FetchError::File { path: target, source })?;
                return Ok(Outcome::Fetched);
            }
            remove(&part)?;
            if !resumed {
                return Err(FetchError::WrongChecksum { address, found, expected: file.sha256.clone() });
            }
            // The beginning may have been left by another version of the file.
            resumed = false;
        }
    }

    /// Brings the rest of a file, taking it up again as long as that gets on.
    fn transfer(&self, address: &str, part: &Path, progress: &mut impl FnMut(u64)) -> Result<(), FetchError> {
        let mut attempt = 1;
        loop {
            let before = size(part);
            let Ended { said, code } = curl(address, part, progress)?;
            let bytes = size(part);
            let reason = said.out.trim();
            let reason = if reason.is_empty() { said.err.trim() } else { reason }.replace('\n', " ");
            match code {
                // A file without a byte leaves no part.
                Some(0) if bytes == 0 => {
                    return std::fs::write(part, []).map_err(|source| FetchError::File { path: part.into(), source });
                }
                Some(0) => return Ok(()),
                // No range, none of that length, or no way to go on (curl: 22 with status 416, 33, 36).
                Some(22 | 33 | 36) if before > 0 && bytes == before => remove(part)?,
                Some(5..=7) => return Err(FetchError::Offline { server: self.server.into(), reason }),
                Some(22) => return Err(FetchError::Refused { address: address.into(), reason }),
                _ if bytes > before && attempt < ATTEMPTS => attempt += 1,
                _ if bytes == 0 => return Err(FetchError::Offline { server: self.server.into(), reason }),
                _ => return Err(FetchError::BrokenOff { address: address.into(), bytes, reason }),
            }
        }
    }

    /// Removes folders that were made and stayed empty: an empty folder must not pass for the recordings.
    pub fn tidy(&self) {
        let Ok(entries) = std::fs::read_dir(self.folder) else { return };
        for entry in entries.flatten() {
            // Only an empty folder can be removed so; whatever else it is stays.
            let _ = std::fs::remove_dir(entry.path());
        }
        let _ = std::fs::remove_dir(self.folder);
    }
}

/// One transfer from where `part` ends. On failure, curl's own words are on the standard output.
fn curl(address: &str, part: &Path, progress: &mut impl FnMut(u64)) -> Result<Ended, Failure> {
    let words = "--silent --fail --location --continue-at - --connect-timeout 20 --speed-limit 100 --speed-time 30 \
                 --noproxy localhost,127.0.0.1 --write-out %{errormsg} --output";
    let mut command = process::program("curl", words.split_whitespace());
    process::watch(command.arg(part).arg(address), || {
        progress(size(part));
        true
    })
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |data| data.len())
}

fn remove(path: &Path) -> Result<(), FetchError> {
    std::fs::remove_file(path).map_err(|source| FetchError::File { path: path.into(), source })
}

/// Of a file; none when there is no such file.
fn checksum(path: &Path) -> Result<Option<String>, FetchError> {
    match std::fs::read(path) {
        Ok(content) => Ok(Some(sha256_of(&content))),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(FetchError::File { path: path.into(), source }),
    }
}

#[cfg(test)]
mod tests;
