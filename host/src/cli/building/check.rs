//! `sohle building check`: what in a building breaks tracking.

use super::{Input, folder, write_drawing};
use crate::building::Building;
use crate::building::check::{Finding, Kind, Level, check, sorted};
use crate::cli::{Error, print};
use crate::export::file;
use crate::export::plan::{self, Look, Mark};
use crate::graph::lint::{Parameters, lint};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Finds what breaks tracking: leaking walls, rooms and stairs without a way to them, swapped axes and more
///
/// Ends with exit code 1 if there is an error among the findings; warnings alone are none.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle building check buildings/twin.geojson\n  \
                        sohle building check floorplans/ --out findings\n  \
                        sohle building check house.geojson --json | jq .findings")]
pub struct CheckArgs {
    #[command(flatten)]
    input: Input,
    /// Print one JSON object instead of lines
    #[arg(long)]
    json: bool,
    /// Mark the findings in pictures of their floors (SVG and PNG) in this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Every finding; without it the first 20 of a kind on a floor
    #[arg(long)]
    all: bool,
}

/// So many of a kind on a floor are listed unless all are asked for.
const LISTED: usize = 20;

/// Checks a building.
pub fn run(args: &CheckArgs) -> Result<(), Error> {
    let building = args.input.read()?;
    let mut found = check(&building);
    if building.graph.is_some() {
        found.extend(lint(&building, &Parameters::default())?);
        found = sorted(found);
    }
    let counts @ [errors, _] = counts(&found);
    let (listed, left_out) = if args.all { (found, BTreeMap::new()) } else { shortened(found) };
    if args.json {
        print(&object(&building, &listed, &left_out, counts)?)?;
    } else {
        print(&text(&building, &listed, &left_out, counts))?;
    }
    if args.out.is_some() {
        let folder = folder(args.out.as_deref(), &args.input.input);
        file::folder(&folder)?;
        for floor in &building.floors {
            let marks = marks(&listed, floor.number);
            write_drawing(&folder, floor.number, &plan::draw(&building, floor, &marks))?;
        }
        if !args.json {
            print(&format!("marked in {}\n", folder.display()))?;
        }
    }
    refused(&args.input.input, errors)
}

/// How many errors and warnings there are.
pub fn counts(found: &[Finding]) -> [usize; 2] {
    let errors = found.iter().filter(|finding| finding.level == Level::Error).count();
    [errors, found.len() - errors]
}

/// An error if there are any among the findings.
pub fn refused(input: &Path, errors: usize) -> Result<(), Error> {
    match errors {
        0 => Ok(()),
        1 => Err(Error::new(format!("{}: 1 error", input.display()))),
        _ => Err(Error::new(format!("{}: {errors} errors", input.display()))),
    }
}

/// How many of a kind and floor are not listed.
pub type LeftOut = BTreeMap<(Kind, Option<i32>), usize>;

/// The first of each kind and floor, and how many more there are.
pub fn shortened(found: Vec<Finding>) -> (Vec<Finding>, LeftOut) {
    let mut counts: LeftOut = BTreeMap::new();
    let mut listed = Vec::new();
    for finding in found {
        let count = counts.entry((finding.kind, finding.floor)).or_default();
        *count += 1;
        if *count <= LISTED {
            listed.push(finding);
        }
    }
    let left_out = counts.into_iter().filter(|(_, count)| *count > LISTED);
    (listed, left_out.map(|(key, count)| (key, count - LISTED)).collect())
}

/// Findings with their numbers, as in the picture.
pub fn text(building: &Building, listed: &[Finding], left_out: &LeftOut, [errors, warnings]: [usize; 2]) -> String {
    let mut text = String::new();
    for (index, finding) in listed.iter().enumerate() {
        let level = match finding.level {
            Level::Error => "error",
            Level::Warning => "warning",
        };
        let mut place = String::new();
        // Writing to a string cannot fail.
        if let Some(floor) = finding.floor {
            let _ = write!(place, ", floor {floor}");
        }
        if let Some([x, y]) = finding.place {
            let _ = write!(place, " at ({x:.2}, {y:.2})");
        }
        if let Some(room) = &finding.room {
            let _ = write!(place, ", room '{room}'");
        }
        let kind = finding.kind.word();
        let _ = writeln!(text, "{:>3} {level}: {kind}{place}: {}\n    cure: {}", index + 1, finding.what, finding.cure);
    }
    for ((kind, floor), count) in left_out {
        let place = floor.map_or_else(String::new, |floor| format!(" on floor {floor}"));
        let _ = writeln!(text, "and {count} more of '{}'{place}; --all lists them", kind.word());
    }
    let count = |count: usize, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });
    let name = if building.name.is_empty() { "the building" } else { &building.name };
    let _ = writeln!(text, "{name}: {}, {}", count(errors, "error"), count(warnings, "warning"));
    text
}

fn object(
    building: &Building,
    listed: &[Finding],
    left_out: &LeftOut,
    [errors, warnings]: [usize; 2],
) -> Result<String, Error> {
    let projection = building.georeference.projection()?;
    let mut findings = Vec::new();
    for finding in listed {
        let mut value = json!(finding);
        if let (Some(projection), Some(place)) = (&projection, finding.place) {
            value["longitude_latitude"] = json!(projection.to_earth(place)?);
        }
        findings.push(value);
    }
    let more: Vec<Value> =
        left_out.iter().map(|((kind, floor), count)| json!({"kind": kind, "floor": floor, "count": count})).collect();
    let object = json!({
        "building": building.name,
        "errors": errors,
        "warnings": warnings,
        "findings": findings,
        "left_out": more,
    });
    Ok(format!("{object}\n"))
}

/// The findings of a floor, with the numbers they have in the list.
pub fn marks(listed: &[Finding], floor: i32) -> Vec<Mark> {
    let numbered = (1..).zip(listed).filter(|(_, finding)| finding.floor == Some(floor));
    let mark = |(number, finding): (usize, &Finding)| {
        let look = match finding.level {
            Level::Error => Look::Error,
            Level::Warning => Look::Warning,
        };
        Some(Mark { place: finding.place?, text: number.to_string(), look })
    };
    numbered.filter_map(mark).collect()
}
