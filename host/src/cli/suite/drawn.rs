//! Pictures of the suites.

use crate::cli::Error;
use crate::evaluation::fixes::eight::Comparison;
use crate::evaluation::graph::eight;
use crate::evaluation::graph::follow::{Method, Settings};
use crate::evaluation::phone::walk::PhoneWalk;
use crate::export::plan::{Dots, Trace, draw_with};
use crate::export::{file, png};
use std::path::Path;

/// Rates of positions that are drawn, and the names of the pictures. **Units:** Hz.
const RATES: [(f64, &str); 2] = [(1.0, "fixes-1-hz"), (0.1, "fixes-0.1-hz")];

/// The recorded walk on its floor, as each method has it (Fix, 3.4).
pub fn fixes(walk: &PhoneWalk, comparison: &Comparison<'_>, folder: &Path) -> Result<(), Error> {
    let Some(floor) = walk.building.floor(walk.floor) else { return Ok(()) };
    file::folder(folder)?;
    for (rate_hz, name) in RATES {
        let (mut dots, mut traces) = (Vec::new(), Vec::new());
        for (label, path) in comparison.paths(rate_hz) {
            let places: Vec<_> = path.0.iter().map(|&(_, place)| place).collect();
            let (colour, width) = look(label);
            match label {
                "positions" => dots.push(Dots { label, colour, places }),
                _ => traces.push(Trace { label, colour, width, pieces: vec![places] }),
            }
        }
        let drawing = draw_with(&walk.building, floor, &[], &dots, &traces);
        file::write(&folder.join(format!("{name}.svg")), drawing.as_bytes())?;
        file::write(&folder.join(format!("{name}.png")), &png::render(&drawing)?)?;
    }
    Ok(())
}

/// The recorded walk on its floor and its graph, as each method has it (Graph, 7.5).
pub fn graph(
    walk: &PhoneWalk,
    comparison: &eight::Comparison<'_>,
    settings: &Settings,
    folder: &Path,
) -> Result<(), Error> {
    let building = comparison.building();
    let Some(floor) = building.floor(walk.floor) else { return Ok(()) };
    let lines = [
        (Method::DeadReckoning, eight::DOCUMENTED, "#b07f3f", 1.2),
        (Method::Documented, eight::DOCUMENTED, "#c8322d", 1.6),
        (Method::Particles, eight::MEASURED, "#8a3fb0", 1.6),
        (Method::Matcher, eight::MEASURED, "#2456b4", 2.4),
    ];
    let mut traces = Vec::new();
    for (method, length, colour, width) in lines {
        let path = comparison.path(method, length, settings)?.unwrap_or_default();
        let places: Vec<_> = path.0.iter().map(|&(_, place)| place).collect();
        traces.push(Trace { label: method.word(), colour, width, pieces: vec![places] });
    }
    let surveyed = walk.way_points.iter().map(|point| point.place).collect();
    let dots = Dots { label: "way-points", colour: "#20242a", places: surveyed };
    let drawing = draw_with(building, floor, &[], &[dots], &traces);
    file::folder(folder)?;
    file::write(&folder.join("graph-eight.svg"), drawing.as_bytes())?;
    file::write(&folder.join("graph-eight.png"), &png::render(&drawing)?)?;
    Ok(())
}

/// Colour and width of a line.
fn look(label: &str) -> (&'static str, f64) {
    match label {
        "positions" => ("#8c8c8c", 0.0),
        "steps alone" => ("#b07f3f", 1.0),
        "Kalman" => ("#3a9b57", 1.2),
        "extended Kalman" => ("#1c8f9c", 1.2),
        "least squares" => ("#c8322d", 1.2),
        "smoother" => ("#2456b4", 2.4),
        _ => ("#8a3fb0", 1.6),
    }
}
