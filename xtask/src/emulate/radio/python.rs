//! The virtual radio's Python, with its packages in a folder of their own.

use super::super::file;
use crate::process::{self, Failure};
use crate::{in_root, tools};
use std::path::PathBuf;

/// What the virtual radio is written in, and with.
const REQUIREMENTS: &str = "xtask/ble/requirements.txt";
const ENVIRONMENT: &str = "target/ble/venv";

/// The interpreter, after the packages have been installed if they are not there yet.
pub fn prepared() -> Result<PathBuf, Failure> {
    tools::PYTHON.required()?;
    let (requirements, environment) = (in_root(REQUIREMENTS), in_root(ENVIRONMENT));
    let wanted = std::fs::read_to_string(&requirements).map_err(|source| file(&requirements, source))?;
    let (python, done) = (environment.join("bin/python"), environment.join("installed.txt"));
    if python.exists() && std::fs::read_to_string(&done).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    println!("installing the virtual radio's Python packages into {ENVIRONMENT}");
    let mut command = process::program("python3", ["-m", "venv", "--clear"]);
    // Debian's python3 has the module, but not what it needs.
    if process::read(command.arg(&environment)).is_err() || !environment.join("bin/pip").exists() {
        let how = "apt-get install python3-venv".into();
        return Err(Failure::Missing { what: "Python's venv with pip".into(), how });
    }
    let words = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement"];
    process::read(process::program(&python.display().to_string(), words).arg(&requirements))?;
    std::fs::write(&done, wanted).map_err(|source| file(&done, source))?;
    Ok(python)
}

#[cfg(test)]
mod tests {
    use crate::root;

    /// The UUIDs of the radio's laptop are those of the wire; neither can import the other's.
    #[test]
    fn python_and_rust_name_the_same_services() {
        let constants = |path: &str, line: fn(&str) -> Option<(String, String)>| {
            let text = std::fs::read_to_string(root().join(path)).unwrap();
            text.lines().filter_map(line).collect::<std::collections::BTreeMap<_, _>>()
        };
        let hexadecimal = |text: &str| text.chars().filter(char::is_ascii_hexdigit).collect::<String>();
        let python = constants("xtask/ble/laptop.py", |line| {
            let (name, value) = line.split_once(" = \"")?;
            (value.len() == 37).then(|| (name.into(), value.trim_end_matches('"').into()))
        });
        let rust = constants("shared/src/wire/bluetooth.rs", |line| {
            let (name, value) = line.strip_prefix("pub const ")?.split_once(": u128 = 0x")?;
            Some((name.into(), value.trim_end_matches(';').into()))
        });
        assert_eq!(rust.len(), 7, "{rust:?}");
        assert_eq!(python.keys().collect::<Vec<_>>(), rust.keys().collect::<Vec<_>>());
        for (name, value) in &rust {
            assert_eq!(hexadecimal(value), hexadecimal(&python[name]), "{name}");
        }
    }
}
