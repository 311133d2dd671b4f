//! What the manifest of recordings says of files: where they come from. The rest of it belongs to the evaluation.

use crate::process::Failure;
use serde::Deserialize;
use std::path::{Component, Path};

/// The part of the manifest that is read here.
#[derive(Deserialize)]
struct Manifest {
    #[serde(default, rename = "file")]
    files: Vec<File>,
}

/// A file of a public repository.
#[derive(Clone, Debug, Deserialize)]
pub struct File {
    /// Where it lies in the folder of recordings.
    pub path: String,
    /// Of the whole file, hexadecimal.
    pub sha256: String,
    /// SPDX expression, or a word on where the licence is stated.
    pub licence: String,
    /// Where it can be had.
    pub upstream: Upstream,
}

/// Where a file can be had.
#[derive(Clone, Debug, Deserialize)]
pub struct Upstream {
    /// Web address of the repository.
    pub repository: String,
    /// Full commit.
    pub commit: String,
    /// Path in the repository.
    pub path: String,
}

/// Reads and checks the files of a manifest.
pub fn read(path: &Path) -> Result<Vec<File>, Failure> {
    let text =
        std::fs::read_to_string(path).map_err(|source| Failure::File { path: path.display().to_string(), source })?;
    parse(&text).map_err(|message| Failure::Found(format!("{}: {message}", path.display())))
}

fn parse(text: &str) -> Result<Vec<File>, String> {
    let manifest: Manifest = toml::from_str(text).map_err(|error| error.message().replace('\n', " "))?;
    if manifest.files.is_empty() {
        return Err("no [[file]] entry says where a recording comes from".into());
    }
    for file in &manifest.files {
        file.check().map_err(|message| format!("file '{}': {message}", file.path))?;
    }
    Ok(manifest.files)
}

impl File {
    fn check(&self) -> Result<(), String> {
        let inside = |path: &str| {
            !path.is_empty() && Path::new(path).components().all(|part| matches!(part, Component::Normal(_)))
        };
        if !inside(&self.path) || !inside(&self.upstream.path) {
            return Err("a path must be relative and stay inside its folder".into());
        }
        if !is_hexadecimal(&self.sha256, 64) {
            return Err("sha256 must be 64 lower-case hexadecimal digits".into());
        }
        if !is_hexadecimal(&self.upstream.commit, 40) {
            return Err(
                "upstream.commit must be 40 lower-case hexadecimal digits: a branch would not stay the same".into()
            );
        }
        self.upstream.owner_and_name().map(|_| ())
    }

    /// Where the raw file is on a server that lays repositories out as GitHub does.
    pub fn address(&self, server: &str) -> String {
        let repository = self.upstream.owner_and_name().unwrap_or_default();
        let Upstream { commit, path, .. } = &self.upstream;
        format!("{}/{repository}/{commit}/{}", server.trim_end_matches('/'), encoded(path))
    }
}

impl Upstream {
    /// `owner/name` of the repository.
    fn owner_and_name(&self) -> Result<&str, String> {
        let rest = self.repository.strip_prefix("https://github.com/").map(|rest| rest.trim_end_matches('/'));
        match rest {
            Some(rest) if rest.split('/').count() == 2 && rest.split('/').all(|part| !part.is_empty()) => Ok(rest),
            _ => Err(format!("upstream.repository '{}' is not https://github.com/OWNER/NAME", self.repository)),
        }
    }
}

fn is_hexadecimal(text: &str, length: usize) -> bool {
    text.len() == length && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// A path as part of a web address (RFC 3986, 2.3: unreserved characters stand for themselves).
fn encoded(path: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte);
    path.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(path: &str, sha256: &str, repository: &str, commit: &str) -> String {
        format!(
            "[[recording]]\nname = 'not read here'\n[[file]]\npath = '{path}'\nsha256 = '{sha256}'\nlicence = 'MIT'\n\
             upstream = {{ repository = '{repository}', commit = '{commit}', path = 'A b/c.txt' }}\n"
        )
    }

    #[test]
    fn a_file_has_an_address() {
        let text = manifest("a/c.txt", &"0a".repeat(32), "https://github.com/owner/name", &"1b".repeat(20));
        let files = parse(&text).unwrap();
        assert_eq!(files[0].address("http://here/"), format!("http://here/owner/name/{}/A%20b/c.txt", "1b".repeat(20)));
    }

    #[test]
    fn what_cannot_be_fetched_safely_is_refused() {
        let (sha256, commit, repository) = ("0a".repeat(32), "1b".repeat(20), "https://github.com/owner/name");
        let refused = |text: String| parse(&text).err().unwrap_or_default();
        assert!(refused(manifest("../c.txt", &sha256, repository, &commit)).contains("stay inside"));
        assert!(refused(manifest("/etc/c.txt", &sha256, repository, &commit)).contains("stay inside"));
        assert!(refused(manifest("c.txt", "0a", repository, &commit)).contains("64 lower-case"));
        assert!(refused(manifest("c.txt", &sha256, repository, "main")).contains("40 lower-case"));
        assert!(refused(manifest("c.txt", &sha256, "https://example.org/a/b", &commit)).contains("OWNER/NAME"));
        assert!(refused("[[recording]]\nname = 'mine'".into()).contains("no [[file]]"));
        assert!(refused("[[file]]\npath = 3".into()).contains("expected a string"));
    }
}
