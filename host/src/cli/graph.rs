//! `sohle graph`: a recorded walk, forced onto the walk graph of a building as the graph document does it.

use super::table::Table;
use super::{Error, print};
use crate::building::open::{Options, open};
use crate::building::picture::{self, Trace};
use crate::building::{Building, geometry::Point};
use crate::export::{file, png};
use crate::graph::draw::{self, draw};
use crate::graph::tracker::{Case, Decision, Floors, Parameters, Tracker, start};
use crate::graph::{Graph, NodeId};
use crate::track::Track;
use crate::{follow, particle, phone, recording, toml_file};
use sohle_shared::step::Step;
use std::path::{Path, PathBuf};

/// Follows a recorded walk on the walk graph of a building, case by case as the graph document does
///
/// On the walk graph of the building's file; one is drawn if it has none. Floors change where the edges of stairs lead, or
/// by the heights of the steps.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    sohle graph eight_walk/ --building 4OG.geojson --start 4,76.7,33.4,-164 --explain\n  \
    sohle graph walk.mcap --building buildings/twin.geojson --start 0,26,0.3,90 --out way")]
pub struct Args {
    /// The recording, of a phone or of a shoe
    file: PathBuf,
    /// The file or folder of the building
    #[arg(long, value_name = "FILE")]
    building: PathBuf,
    /// Where the walk begins, and into which direction: FLOOR,X,Y,HEADING_DEG
    #[arg(long, value_name = "WHERE", allow_hyphen_values = true)]
    start: String,
    /// The thresholds of the tracker; others are those of the document
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Change floors by the heights that the steps tell (a phone's barometer, a shoe), by nothing else
    #[arg(long)]
    barometer: bool,
    /// Print for each step what was decided, and why
    #[arg(long)]
    explain: bool,
    /// Draw the way on the floors (SVG and PNG) in this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Reads, follows, tells.
pub fn run(args: Args) -> Result<(), Error> {
    let mut building = open(&args.building, &Options::default())?;
    if building.graph.is_none() {
        building.graph = Some(draw(&building, &draw::Parameters::default()));
    }
    let graph = Graph::of(&building)?;
    let (steps, usual) = steps(&args.file)?;
    let parameters = match &args.parameters {
        Some(path) => toml_file::read("settings of the tracker on a graph", path)?,
        None => usual,
    };
    let place = match follow::start::parse(&building, &args.start)? {
        particle::Start::At(places) => places.into_iter().next().and_then(|place| Some((place, place.heading?))),
        particle::Start::Anywhere => None,
    };
    let Some((place, (heading, _))) = place else {
        return Err(Error::new(format!("--start {}: expected FLOOR,X,Y,HEADING_DEG", args.start)));
    };
    let begin = start(&graph, place.floor, place.place.map(f64::from), f64::from(heading));
    let Some((edge, along_m)) = begin else {
        return Err(Error::new(format!("--start {}: the walk graph has no edge on floor {}", args.start, place.floor)));
    };
    let mut tracker = Tracker::new(&graph, &parameters, edge, along_m);
    if args.barometer {
        // The start was found on this floor.
        let floors =
            Floors::new(&building, place.floor).ok_or_else(|| Error::new(format!("no floor {}", place.floor)))?;
        tracker = tracker.with_barometer(floors);
    }
    let mut decisions = Vec::new();
    for step in &steps {
        let rise = f64::from(step.displacement.z);
        let decision = tracker.step(f64::from(step.turn), f64::from(step.length()), rise);
        if args.explain {
            print(&format!("step {}: {decision}\n", step.index))?;
        }
        decisions.push(decision);
    }
    print(&summary(&graph, &decisions))?;
    if let Some(folder) = &args.out {
        pictures(&building, &graph, &decisions, folder)?;
        print(&format!("pictures in {}\n", folder.display()))?;
    }
    Ok(())
}

/// The steps of a recording, and the settings for their source: the foot of a shoe makes every other step, which is measured.
fn steps(file: &Path) -> Result<(Vec<Step>, Parameters), Error> {
    let documented = Parameters::documented();
    if phone::open::is_phone(file) {
        let samples = phone::open::open(file)?.samples;
        return Ok((phone::steps(&samples, &phone::Parameters::documented()), documented));
    }
    let recording = recording::open(file, None)?;
    let settings = sohle_shared::tracker::Parameters::default();
    let track = Track::of(recording.samples.iter().copied(), &settings);
    Ok((track.steps, Parameters { step_m: 0.0, ..documented }))
}

/// How often each case was decided, and where the walk ends.
fn summary(graph: &Graph, decisions: &[Decision]) -> String {
    let cases = [
        ("1 straight on", Case::Straight),
        ("2 half turn", Case::HalfTurn),
        ("2 half turn begun", Case::HalfTurnBegun),
        ("3 turn", Case::Turn),
        ("3 rest of a half turn", Case::RestOfHalfTurn),
        ("4 beyond the node", Case::Beyond),
        ("4 turn behind the end", Case::TurnBehindEnd),
        ("5 local search", Case::LocalSearch),
        ("5 global search", Case::GlobalSearch),
        ("waiting", Case::Waiting),
    ];
    let mut table = Table::new("case", &["steps", "%"]);
    for (name, case) in cases {
        let count = decisions.iter().filter(|decision| decision.case == case).count();
        let share = 100.0 * count as f64 / decisions.len().max(1) as f64;
        table.row(name, vec![count.to_string(), format!("{share:.1}")]);
    }
    let count = |cases: &[Case]| decisions.iter().filter(|decision| cases.contains(&decision.case)).count();
    let searched = count(&[Case::LocalSearch, Case::GlobalSearch]);
    let chosen = count(&[Case::HalfTurn, Case::Turn, Case::Beyond, Case::TurnBehindEnd]) + searched;
    let mut text = format!("{}\n", table.text());
    if chosen > 0 {
        let share = 100.0 * (chosen - searched) as f64 / chosen as f64;
        text.push_str(&format!("{share:.1} % of {chosen} edges chosen without a search\n"));
    }
    if let Some(last) = decisions.last() {
        let [x, y] = last.place;
        let floor = graph.node(graph.edge(last.edge).from).floor;
        text.push_str(&format!("ends at ({x:.2}, {y:.2}) on floor {floor}, +- {:.1} m\n", last.sigma_m));
    }
    text
}

/// The floors of the walk, with its positions on them.
fn pictures(building: &Building, graph: &Graph, decisions: &[Decision], folder: &Path) -> Result<(), Error> {
    file::folder(folder)?;
    let floor_of = |node: NodeId| graph.node(node).floor;
    for floor in &building.floors {
        let here = decisions.iter().filter(|decision| floor_of(graph.edge(decision.edge).from) == floor.number);
        let places: Vec<Point> = here.map(|decision| decision.place).collect();
        if places.is_empty() {
            continue;
        }
        let trace = Trace { label: "on the graph", colour: "#c8322d", width: 2.5, pieces: vec![places] };
        let drawing = picture::draw_with(building, floor, &[], &[], &[trace]);
        file::write(&folder.join(format!("floor{}.svg", floor.number)), drawing.as_bytes())?;
        file::write(&folder.join(format!("floor{}.png", floor.number)), &png::render(&drawing)?)?;
    }
    Ok(())
}
