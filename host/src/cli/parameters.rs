//! `sohle parameters`: the settings of the tracker as a file to be edited.

use super::table::Table;
use super::{Error, print};
use crate::toml_file::{self, TomlFileError};
use sohle_shared::tracker::Parameters;
use sohle_shared::tracker::settings::SETTINGS;
use std::path::Path;

/// Prints the settings of the tracker as TOML, to be edited and given to --parameters
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  sohle parameters > mine.toml\n  sohle replay walk.mcap --parameters mine.toml")]
pub struct Args {
    /// The settings of the source document instead of the default
    #[arg(long)]
    documented: bool,
    /// A table of all settings with their units and bounds instead
    #[arg(long)]
    bounds: bool,
}

/// Prints the settings.
pub fn run(args: Args) -> Result<(), Error> {
    let parameters = if args.documented { Parameters::documented() } else { Parameters::default() };
    print(&if args.bounds { bounds(&parameters).text() } else { toml::to_string(&parameters)? })
}

/// All settings that are numbers, with what a file may say of them.
fn bounds(parameters: &Parameters) -> Table {
    let mut table = Table::new("setting", &["value", "least", "largest", "unit"]);
    for setting in SETTINGS {
        let numbers = [setting.value(parameters), setting.least, setting.largest].map(|number| number.to_string());
        table.row(setting.name, numbers.into_iter().chain([setting.unit.to_owned()]).collect());
    }
    table
}

/// Reads settings written like those that `sohle parameters` prints. What a file leaves out keeps its default; what makes no
/// sense is refused.
pub fn read(path: &Path) -> Result<Parameters, TomlFileError> {
    const WHAT: &str = "parameter file";
    let parameters: Parameters = toml_file::read(WHAT, path)?;
    let unfit = |unfit| TomlFileError::Unfit { what: WHAT, path: path.to_owned(), source: unfit };
    parameters.check().map_err(unfit)?;
    Ok(parameters)
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

    /// Keys and values of all numbers below `at`.
    fn numbers(at: &str, value: &toml::Value, found: &mut Vec<(String, f64)>) {
        match value {
            toml::Value::Table(table) => {
                for (key, value) in table {
                    numbers(&if at.is_empty() { key.clone() } else { format!("{at}.{key}") }, value, found);
                }
            }
            toml::Value::Array(values) => {
                values.iter().enumerate().for_each(|(i, value)| numbers(&format!("{at}[{i}]"), value, found));
            }
            toml::Value::Float(number) => found.push((at.to_owned(), *number)),
            toml::Value::Integer(number) => found.push((at.to_owned(), *number as f64)),
            _ => {}
        }
    }

    #[test]
    fn every_number_of_a_file_has_its_bounds_under_its_keys() {
        let parameters = Parameters::default();
        let mut written = Vec::new();
        numbers("", &toml::Value::try_from(parameters).unwrap(), &mut written);
        let mut known: Vec<_> =
            SETTINGS.iter().map(|setting| (setting.name.to_owned(), f64::from(setting.value(&parameters)))).collect();
        written.sort_by(|a, b| a.0.cmp(&b.0));
        known.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(written, known);
    }

    #[test]
    fn a_file_of_settings_that_make_no_sense_is_refused_in_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let said = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read(&path).map_err(|error| error.to_string().replace(&path.display().to_string(), "mine.toml"))
        };
        assert_eq!(
            said("[stance]\nfloor = 10.0\nceiling = 1.0\n"),
            Err("parameter file mine.toml: stance.floor is 10, expected no more than stance.ceiling, which is 1".into())
        );
        assert_eq!(
            said("[stance]\nlookback_s = 1e30\n"),
            Err("parameter file mine.toml: stance.lookback_s is 1000000000000000000000000000000, expected 0.1 to 60 s"
                .into())
        );
        assert_eq!(said("[stance]\nfloor = 10.0\n").map(|parameters| parameters.stance.floor), Ok(10.0));
    }
}
