//! Files in TOML that people write and edit: read whole, or refused with the line that is wrong.

use serde::de::DeserializeOwned;
use sohle_shared::tracker::settings::Unfit;
use std::path::{Path, PathBuf};

/// Why a file is refused.
#[derive(Debug, thiserror::Error)]
pub enum TomlFileError {
    /// The file cannot be read.
    #[error("{what} {}: {source}", path.display())]
    Read {
        /// What the file is to hold.
        what: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// What stands in it is something else.
    #[error("{what} {}, line {line}: {message}", path.display())]
    Refused {
        /// What the file is to hold.
        what: &'static str,
        /// Which file.
        path: PathBuf,
        /// Where; the first line is 1.
        line: usize,
        /// What is wrong and what was expected.
        message: String,
    },
    /// Settings that make no sense.
    #[error("{what} {}: {source}", path.display())]
    Unfit {
        /// What the file is to hold.
        what: &'static str,
        /// Which file.
        path: PathBuf,
        /// Which setting, and its bounds.
        source: Unfit,
    },
}

/// Reads a `what` from a file. What the file leaves out has its default if the type says so.
pub fn read<T: DeserializeOwned>(what: &'static str, path: &Path) -> Result<T, TomlFileError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| TomlFileError::Read { what, path: path.to_owned(), source })?;
    parse(&text).map_err(|(line, message)| TomlFileError::Refused { what, path: path.to_owned(), line, message })
}

/// What `text` says, or the line that is wrong (the first is 1) and why.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, (usize, String)> {
    toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count() + 1;
        (line, error.message().replace('\n', " "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::tracker::Parameters;

    #[test]
    fn an_unknown_key_is_refused_with_its_name_and_line() {
        let (line, message) = parse::<Parameters>("# mine\n\nshoe_size = 43\n").unwrap_err();
        assert_eq!(line, 3);
        assert!(message.contains("shoe_size"), "{message}");
    }

    #[test]
    fn text_that_is_not_toml_is_refused_with_its_line() {
        let (line, _) = parse::<Parameters>("# mine\nthis is not toml\n").unwrap_err();
        assert_eq!(line, 2);
    }

    #[test]
    fn a_file_is_told_with_what_it_should_be() {
        let told = read::<Parameters>("parameter file", Path::new("absent.toml")).unwrap_err().to_string();
        assert!(told.starts_with("parameter file absent.toml: "), "{told}");
    }
}
