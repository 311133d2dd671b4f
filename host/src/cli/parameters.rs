//! `sohle parameters`: the settings of the tracker as a file to be edited.

use super::{Error, print};
use crate::toml_file::{self, TomlFileError};
use sohle_shared::tracker::Parameters;
use std::path::Path;

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

/// Reads settings written like those that `sohle parameters` prints. What a file leaves out keeps its default.
pub fn read(path: &Path) -> Result<Parameters, TomlFileError> {
    toml_file::read("parameter file", path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_can_be_read_back() {
        for parameters in [Parameters::default(), Parameters::documented()] {
            assert_eq!(toml_file::parse(&toml::to_string(&parameters).unwrap()), Ok(parameters));
        }
    }
}
