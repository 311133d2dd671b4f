//! Opens a recording of a phone of any kind, and tells whether a path is one.

use super::sample::{PhoneRecording, ReadError};
use super::{poslab, xyz10};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// How the accelerometer's file of a poslab walk ends.
const POSLAB_END: &str = "_accel.csv";
/// How it begins.
const POSLAB_HEADING: &str = "timestamp x y z";
/// Of a file so much is looked at to recognise it. **Units:** bytes.
const LOOKED_AT: u64 = 16_384;

/// A kind of recording, and what its reader needs.
enum Kind {
    /// Folder and name of the walk.
    Poslab(PathBuf, String),
    Xyz10,
}

/// Whether there is a recording of a phone at `path`: a poslab folder, the `_accel.csv` in it, or a file of the
/// indoor-location competition.
pub fn is_phone(path: &Path) -> bool {
    recognise(path).is_some()
}

/// Reads the recording at `path`.
///
/// # Errors
/// When nothing there is a recording of a phone, or as [`poslab::read`] and [`xyz10::read`].
pub fn open(path: &Path) -> Result<PhoneRecording, ReadError> {
    match recognise(path) {
        Some(Kind::Poslab(folder, name)) => poslab::read(&folder, &name),
        Some(Kind::Xyz10) => xyz10::read(path),
        None => Err(ReadError::Unknown { file: path.display().to_string() }),
    }
}

fn recognise(path: &Path) -> Option<Kind> {
    if path.is_dir() {
        let mut walks: Vec<PathBuf> = fs::read_dir(path).ok()?.filter_map(|entry| Some(entry.ok()?.path())).collect();
        walks.retain(|path| path.to_string_lossy().ends_with(POSLAB_END));
        walks.sort();
        return recognise_file(walks.first()?);
    }
    recognise_file(path)
}

fn recognise_file(path: &Path) -> Option<Kind> {
    let mut bytes = Vec::new();
    File::open(path).ok()?.take(LOOKED_AT).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    if let Some(name) = path.file_name()?.to_str()?.strip_suffix(POSLAB_END) {
        let folder = path.parent()?.to_owned();
        return text.starts_with(POSLAB_HEADING).then(|| Kind::Poslab(folder, name.to_owned()));
    }
    text.lines().any(|line| line.split('\t').nth(1) == Some("TYPE_ACCELEROMETER")).then_some(Kind::Xyz10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_are_known_by_their_content() {
        let home = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = home.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let accel = write("a_accel.csv", "timestamp x y z\n1000 1 2 3\n1010 1 2 4\n");
        write("a_gyro.csv", "timestamp x y z\n1000 0.1 0.2 0.3\n");
        let mall = write("b.txt", "#\tstartTime:1\n1\tTYPE_GYROSCOPE\t0\t0\t1\t3\n2\tTYPE_ACCELEROMETER\t1\t2\t3\t2\n");
        for path in [home.path(), &accel] {
            assert_eq!(open(path).unwrap().samples.len(), 2, "{}", path.display());
        }
        assert_eq!(open(&mall).unwrap().samples.len(), 1);
        for other in [write("c.txt", "time,x\n1,2\n"), write("d_accel.csv", "time,x\n"), home.path().join("absent")] {
            assert!(!is_phone(&other), "{}", other.display());
        }
        assert!(
            open(&home.path().join("c.txt")).unwrap_err().to_string().ends_with("c.txt is no recording of a phone")
        );
    }
}
