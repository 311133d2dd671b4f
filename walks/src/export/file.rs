//! Files that are complete or absent.

use super::ExportError;
use std::ffi::OsString;
use std::path::Path;

/// Makes `path` and the folders above it.
pub fn folder(path: &Path) -> Result<(), ExportError> {
    std::fs::create_dir_all(path).map_err(|source| ExportError::Write { path: path.to_owned(), source })
}

/// Writes `bytes` to a file beside `path` and gives it the name `path` when it is complete.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path));
    written.map_err(|source| {
        // Nothing more can be done if the system does not let go of the part either.
        let _ = std::fs::remove_file(&part);
        ExportError::Write { path: path.to_owned(), source }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_get_its_name_leaves_nothing() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("taken");
        std::fs::create_dir_all(target.join("by a folder")).unwrap();
        assert!(write(&target, b"bytes").is_err());
        assert_eq!(std::fs::read_dir(home.path()).unwrap().count(), 1);
    }
}
