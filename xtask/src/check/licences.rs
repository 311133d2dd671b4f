//! The licences of everything the project links or builds with must be ones it can pass on.

use super::MANIFESTS;
use crate::in_root;
use crate::process::{self, Failure};
use serde::Deserialize;
use spdx::{Expression, ParseMode};
use std::collections::BTreeSet;
use std::path::Path;

/// Licences that ask for no more than a notice, or (MPL) for the source of the library's own files.
const ALLOWED: [&str; 16] = [
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "CDLA-Permissive-2.0",
    "ISC",
    "MIT",
    "MIT-0",
    "MPL-2.0",
    "OFL-1.1",
    "Ubuntu-font-1.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Packages whose licence is allowed for them alone, as they name it.
///
/// libFuzzer is LLVM's, and was under its older licence: a notice, and no use of the authors' names. It is in the programs of
/// `fuzz/` only, which are not passed on.
const EXCEPTIONS: [(&str, &str); 1] = [("libfuzzer-sys", "(MIT OR Apache-2.0) AND NCSA")];

/// Packages that bring the source of something else, whose licence theirs does not tell: what that is, and the licence
/// that it is taken under. libdbus may be had under the Academic Free License, which asks for a notice, or the GPL; see
/// host/Cargo.toml for why its source is built along.
const BUNDLED: [(&str, &str, &str); 1] = [("libdbus-sys", "libdbus", "AFL-2.1 (of AFL-2.1 OR GPL-2.0-or-later)")];

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: String,
    license: Option<String>,
}

/// Checks every package of every lock file, for all targets and features.
pub fn run() -> Result<(), Failure> {
    let mut objections = Vec::new();
    let mut bundled = BTreeSet::new();
    let mut count = 0;
    for manifest in MANIFESTS {
        for package in packages(&in_root(manifest))? {
            count += 1;
            objections.extend(objection(&package));
            bundled.extend(BUNDLED.iter().filter(|(name, ..)| *name == package.name));
        }
    }
    objections.sort();
    objections.dedup();
    if objections.is_empty() {
        println!("{count} packages, all under licences that can be passed on");
        for (package, what, license) in bundled {
            println!("{package} brings {what}, taken under {license}");
        }
        return Ok(());
    }
    Err(Failure::Found(objections.join("; ")))
}

fn packages(manifest: &Path) -> Result<Vec<Package>, Failure> {
    let mut command = process::cargo();
    command.args(["metadata", "--locked", "--all-features", "--format-version", "1", "--manifest-path"]).arg(manifest);
    let said = process::read(&mut command)?;
    let metadata: Metadata =
        serde_json::from_str(&said.out).map_err(|error| Failure::Found(format!("cargo metadata: {error}")))?;
    Ok(metadata.packages)
}

fn objection(package: &Package) -> Option<String> {
    let Package { name, version, license } = package;
    let Some(text) = license else { return Some(format!("{name} {version} names no licence")) };
    if EXCEPTIONS.contains(&(name, text)) {
        return None;
    }
    // Older packages write `MIT/Apache-2.0`.
    let mode = ParseMode { allow_slash_as_or_operator: true, ..ParseMode::STRICT };
    let Ok(expression) = Expression::parse_mode(text, mode) else {
        return Some(format!("{name} {version}: `{text}` is not a licence expression"));
    };
    let allowed = expression.evaluate(|needed| needed.license.id().is_some_and(|id| ALLOWED.contains(&id.name)));
    if allowed { None } else { Some(format!("{name} {version} is under {text}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(license: Option<&str>) -> Option<String> {
        objection(&Package { name: "it".into(), version: "1.0.0".into(), license: license.map(str::to_owned) })
    }

    #[test]
    fn a_choice_needs_one_allowed_licence_and_a_sum_needs_all() {
        assert_eq!(judge(Some("MIT/Apache-2.0")), None);
        assert_eq!(judge(Some("MIT OR LGPL-2.1-or-later")), None);
        assert_eq!(judge(Some("(MIT OR Apache-2.0) AND OFL-1.1")), None);
        assert_eq!(judge(Some("MIT AND GPL-3.0-only")).as_deref(), Some("it 1.0.0 is under MIT AND GPL-3.0-only"));
    }

    #[test]
    fn an_exception_is_for_one_package_and_its_licence() {
        let (name, license) = EXCEPTIONS[0];
        let package = |name: &str, license: &str| Package {
            name: name.into(),
            version: "1.0.0".into(),
            license: Some(license.into()),
        };
        assert_eq!(objection(&package(name, license)), None);
        assert!(objection(&package("another", license)).is_some());
        assert!(objection(&package(name, "NCSA AND GPL-3.0-only")).is_some());
    }

    #[test]
    fn no_licence_and_no_expression_are_refused() {
        assert_eq!(judge(None).as_deref(), Some("it 1.0.0 names no licence"));
        assert!(judge(Some("do what you like")).is_some_and(|text| text.contains("not a licence expression")));
    }
}
