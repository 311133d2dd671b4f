//! `sohle parameters`: the settings of the tracker as a file to be edited.

use super::{Error, print};
use sohle_shared::tracker::Parameters;
use std::path::{Path, PathBuf};

/// Prints the settings of the tracker as TOML, to be edited and given to --parameters
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sohle parameters > mine.toml\n  sohle replay walk.mcap --parameters mine.toml")]
pub struct Args {
    /// The settings of the source document instead of the default
    #[arg(long)]
    documented: bool,
}

/// Prints the settings.
pub fn run(args: Args) -> Result<(), Error> {
    let parameters = if args.documented { Parameters::documented() } else { Parameters::default() };
    print(&toml::to_string(&parameters)?)
}

/// Why a parameter file is refused.
#[derive(Debug, thiserror::Error)]
pub enum ParameterFileError {
    /// The file cannot be read.
    #[error("parameter file {}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// What stands in it is not a set of parameters.
    #[error("parameter file {}, line {line}: {message}", path.display())]
    Refused {
        /// Which file.
        path: PathBuf,
        /// Where; the first line is 1.
        line: usize,
        /// What is wrong and what was expected.
        message: String,
    },
}

/// Reads settings written like those that `sohle parameters` prints. What a file leaves out keeps its default.
pub fn read(path: &Path) -> Result<Parameters, ParameterFileError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| ParameterFileError::Read { path: path.to_owned(), source })?;
    parse(&text).map_err(|(line, message)| ParameterFileError::Refused { path: path.to_owned(), line, message })
}

/// The settings in `text`, or the line that is wrong and why.
fn parse(text: &str) -> Result<Parameters, (usize, String)> {
    toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count() + 1;
        (line, error.message().to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_can_be_read_back() {
        for parameters in [Parameters::default(), Parameters::documented()] {
            assert_eq!(parse(&toml::to_string(&parameters).unwrap()), Ok(parameters));
        }
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_name_and_line() {
        let (line, message) = parse("# mine\n\nshoe_size = 43\n").unwrap_err();
        assert_eq!(line, 3);
        assert!(message.contains("shoe_size"), "{message}");
    }

    #[test]
    fn text_that_is_not_toml_is_refused_with_its_line() {
        let (line, _) = parse("# mine\nthis is not toml\n").unwrap_err();
        assert_eq!(line, 2);
    }
}
