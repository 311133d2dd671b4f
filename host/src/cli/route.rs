//! `sohle route`: the way from room to room in words.

use super::{Error, print};
use crate::building::open::{Options, open};
use crate::building::{Building, geometry::Point};
use crate::export::plan::{self, Trace};
use crate::export::{file, png};
use crate::graph::draw::{self, draw};
use crate::graph::route::{Preferences, Route, route};
use crate::graph::{EdgeKind, Graph};
use std::path::{Path, PathBuf};

/// Tells the way from one room to another: where to turn, which stairs to take
///
/// On the walk graph of the building's file; one is drawn if it has none.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle route W01 E14 --building buildings/twin.geojson\n  \
                        sohle route F0/101 F2/210 --building buildings/institute.geojson --avoid stairs --out way")]
pub struct Args {
    /// Where it begins: a room (101, or F1/101 with the floor's name) or an entrance
    from: String,
    /// Where it ends
    to: String,
    /// The file or folder of the building
    #[arg(long, value_name = "FILE")]
    building: PathBuf,
    /// What is not to be used
    #[arg(long, value_enum)]
    avoid: Option<Avoid>,
    /// Draw the way on the floors (SVG and PNG) in this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// How floors are not to be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Avoid {
    /// For wheels
    Stairs,
    /// In a fire
    Elevators,
}

/// Finds the way and tells it.
pub fn run(args: Args) -> Result<(), Error> {
    let mut building = open(&args.building, &Options::default())?;
    if building.graph.is_none() {
        building.graph = Some(draw(&building, &draw::Parameters::default()));
    }
    let graph = Graph::of(&building)?;
    let mut preferences = Preferences::default();
    match args.avoid {
        Some(Avoid::Stairs) => preferences.stairs = None,
        Some(Avoid::Elevators) => preferences.elevator_m = None,
        None => {}
    }
    let found = route(&building, &graph, [&args.from, &args.to], &preferences)?;
    let mut text = String::new();
    for (number, instruction) in (1..).zip(&found.instructions) {
        text.push_str(&format!("{number:>3}. {}\n", instruction.text()));
    }
    print(&format!("{text}{:.0} m on foot\n", found.length_m))?;
    if let Some(folder) = &args.out {
        pictures(&building, &graph, &found, folder)?;
        print(&format!("pictures in {}\n", folder.display()))?;
    }
    Ok(())
}

/// The floors of the way, with it on them.
fn pictures(building: &Building, graph: &Graph, route: &Route, folder: &Path) -> Result<(), Error> {
    file::folder(folder)?;
    let mut plain = building.clone();
    plain.graph = None;
    for floor in &building.floors {
        let mut pieces: Vec<Vec<Point>> = Vec::new();
        let mut joined = false;
        for edge in route.path.edges.iter().map(|&id| graph.edge(id)) {
            let [from, to] = [edge.from, edge.to].map(|id| graph.node(id));
            let here = edge.kind != EdgeKind::Elevator && (from.floor == floor.number || to.floor == floor.number);
            match pieces.last_mut() {
                Some(piece) if here && joined => piece.push(to.place),
                _ if here => pieces.push(vec![from.place, to.place]),
                _ => {}
            }
            joined = here;
        }
        if pieces.is_empty() {
            continue;
        }
        let trace = Trace { label: "way", colour: "#2456b4", width: 3.0, pieces };
        let drawing = plan::draw_with(&plain, floor, &[], &[], &[trace]);
        file::write(&folder.join(format!("floor{}.svg", floor.number)), drawing.as_bytes())?;
        file::write(&folder.join(format!("floor{}.png", floor.number)), &png::render(&drawing)?)?;
    }
    Ok(())
}
