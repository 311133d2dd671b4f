//! `sohle graph`: a recorded walk on the walk graph of a building, with several hypotheses or as the graph document does it.

use super::beacons;
use super::fixes::{self, Source};
use super::table::Table;
use super::{Error, print};
use crate::building::open::{Options, open};
use crate::building::{Building, geometry::Point};
use crate::export::plan::{self, Trace};
use crate::export::{file, png};
use crate::fixes::line::Clock;
use crate::fixes::{Outliers, smoother};
use crate::follow::sight;
use crate::graph::Graph;
use crate::graph::draw::{self, draw};
use crate::graph::matcher::{self, Estimate, Matcher};
use crate::graph::tracker::{Case, Decision, Floors, Parameters, SearchBy, Tracker, start};
use crate::particle::Start;
use crate::recording::Recording;
use crate::track::Track;
use crate::{particle, phone, recording, toml_file};
use std::path::{Path, PathBuf};

/// Follows a recorded walk on the walk graph of a building
///
/// On the walk graph of the building's file; one is drawn if it has none. With several hypotheses, each with its
/// probability, or case by case as the graph document does. Floors change where the edges of stairs lead, or by the heights
/// of the steps.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    sohle graph eight_walk/ --building 4OG.geojson --start 4,76.7,33.4,-164\n  \
    sohle graph eight_walk/ --building 4OG.geojson --start anywhere --explain\n  \
    sohle graph eight_walk/ --building 4OG.geojson --start 4,76.7,33.4,-164 --method documented --explain\n  \
    sohle graph eight_walk/ --building 4OG.geojson --start 4,76.7,33.4,-164 --method documented --search map-matching\n  \
    sohle graph walk.mcap --building house.geojson --start beacon --beacons heard.jsonl --barometer\n  \
    sohle graph walk.mcap --building buildings/twin.geojson --start 0,26,0.3,90 --barometer --out way\n  \
    sohle graph walk.mcap --building buildings/twin.geojson --start anywhere --barometer --fixes positions.jsonl")]
pub struct Args {
    /// The recording, of a phone or of a shoe
    file: PathBuf,
    /// The file or folder of the building
    #[arg(long, value_name = "FILE")]
    building: PathBuf,
    /// Where the walk begins, and into which direction: FLOOR,X,Y,HEADING_DEG. The matcher takes 'anywhere', 'entrances', the
    /// name of a room and FLOOR,X,Y too. 'beacon': at the entrance whose beacon is loud enough first, from then on, into the building
    #[arg(long, value_name = "WHERE", allow_hyphen_values = true)]
    start: String,
    #[command(flatten)]
    beacons: beacons::Beacons,
    /// Who follows
    #[arg(long, value_enum, default_value_t = Method::Matcher)]
    method: Method,
    /// Settings of the method in place of its own
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// By what the documented method searches an edge when five steps have fitted none, in place of what its settings say
    #[arg(long, value_enum, value_name = "BY")]
    search: Option<SearchBy>,
    /// Change floors by the heights that the steps tell (a phone's barometer, a shoe) too; as the document does, by nothing else
    #[arg(long)]
    barometer: bool,
    /// Positions and ranges of other sources, a JSON object to a line (docs/fixes.md); '-' is the standard input. They come in place
    /// of those that the recording brings along; the matcher alone hears of them
    #[arg(long, value_name = "FILE|-")]
    fixes: Option<Source>,
    /// Print for each step what was decided, and why
    #[arg(long)]
    explain: bool,
    /// Draw the way on the floors (SVG and PNG) in this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Who follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// Several hypotheses with probabilities; finds itself again, needs no known start
    Matcher,
    /// One hypothesis, forced onto the graph case by case (Graph, chapter 6)
    Documented,
}

/// Reads, follows, tells.
pub fn run(args: Args) -> Result<(), Error> {
    let mut building = open(&args.building, &Options::default())?;
    if building.graph.is_none() {
        building.graph = Some(draw(&building, &draw::Parameters::default()));
    }
    let graph = Graph::of(&building)?;
    let places = match args.method {
        Method::Matcher => matched(&args, &building, &graph)?,
        Method::Documented => documented(&args, &building, &graph)?,
    };
    if let Some(folder) = &args.out {
        pictures(&building, &places, folder)?;
        print(&format!("pictures in {}\n", folder.display()))?;
    }
    Ok(())
}

/// Follows with several hypotheses. Returns floor and place after each step.
fn matched(args: &Args, building: &Building, graph: &Graph) -> Result<Vec<(i32, Point)>, Error> {
    if args.search.is_some() {
        return Err(Error::new("--search: the matcher searches no edges; expected --method documented"));
    }
    let walk = read(&args.file, &phone::Parameters::default())?;
    let parameters = match &args.parameters {
        Some(path) => toml_file::read("settings of the matcher", path)?,
        None if walk.is_of_phone() => matcher::Parameters::phone(),
        None => matcher::Parameters::default(),
    };
    let place = |place: particle::StartPlace| matcher::Place {
        floor: place.floor,
        place: place.place.map(f64::from),
        sigma_m: f64::from(place.sigma_m),
        heading: place.heading.map(|(heading, sigma)| (f64::from(heading), f64::from(sigma))),
    };
    let (begin, since) = beacons::start(&args.beacons, &args.start, building, Clock::of_past(walk.began_us()))?;
    let begin = match begin {
        Start::At(places) => matcher::Start::At(places.into_iter().map(place).collect()),
        Start::Anywhere => matcher::Start::Anywhere,
    };
    let mut matcher = Matcher::new(graph, &parameters, &begin)?;
    if args.barometer {
        matcher = matcher.with_heights();
    }
    let settings = if walk.is_of_phone() { smoother::Parameters::phone() } else { smoother::Parameters::default() };
    let said = (args.fixes.as_ref(), &walk.fixes[..]);
    let mut incoming = fixes::incoming(said, Some(building), Clock::of_past(walk.began_us()), &settings, false)?;
    let (mut places, mut located) = (Vec::new(), None);
    for step in walk.steps.iter().filter(|step| step.stance_end > since) {
        if let Some(incoming) = &mut incoming {
            incoming.step(step, |observation| {
                matcher.sight(&sight(observation, &Outliers::default()), observation.time);
            });
        }
        let estimate = matcher.step(step);
        if args.explain {
            print(&format!("step {}: {estimate}\n", step.index))?;
        }
        if estimate.is_located() && located.is_none() {
            located = Some(step.index);
        }
        places.extend(estimate.place().map(|place| (place.floor, place.position)));
    }
    print(&found(matcher.estimate(), located))?;
    if let Some(incoming) = incoming {
        print(&format!("\n{}", incoming.finish(None)?))?;
    }
    Ok(places)
}

/// What is known at the end.
fn found(estimate: &Estimate, located: Option<u32>) -> String {
    let mut table = Table::new("place at the end", &["%", "floor", "x m", "y m", "+- m", "edge"]);
    for (number, place) in estimate.places.iter().take(MOST_TOLD).enumerate() {
        let [x, y] = place.position;
        let figures = [100.0 * place.probability, x, y, place.sigma_m()].map(|value| format!("{value:.2}"));
        let [percent, x, y, sigma] = figures;
        let cells = vec![percent, place.floor.to_string(), x, y, sigma, place.edge.0.to_string()];
        table.row((number + 1).to_string(), cells);
    }
    let located = located.map_or("never located\n".to_owned(), |step| format!("located from step {step} on\n"));
    format!("{}{located}", table.text())
}

/// Places that are told at the end.
const MOST_TOLD: usize = 10;

/// Follows as the document does. Returns floor and place after each step.
fn documented(args: &Args, building: &Building, graph: &Graph) -> Result<Vec<(i32, Point)>, Error> {
    if args.fixes.is_some() {
        return Err(Error::new("--fixes: the document's tracker takes no positions; expected --method matcher"));
    }
    let walk = read(&args.file, &phone::Parameters::documented())?;
    let documented = Parameters::documented();
    let mut parameters = match &args.parameters {
        Some(path) => toml_file::read("settings of the tracker on a graph", path)?,
        None if walk.is_of_phone() => documented,
        // The foot of a shoe makes every other step, which is measured.
        None => Parameters { step_m: 0.0, ..documented },
    };
    if let Some(search) = args.search {
        parameters.search = search;
    }
    let (begin, since) = beacons::start(&args.beacons, &args.start, building, Clock::of_past(walk.began_us()))?;
    let place = match begin {
        Start::At(places) => places.into_iter().next().and_then(|place| Some((place, place.heading?))),
        Start::Anywhere => None,
    };
    let Some((place, (heading, _))) = place else {
        return Err(Error::new(format!(
            "--start {}: expected FLOOR,X,Y,HEADING_DEG, or a beacon at an entrance with a door (or --method matcher, which needs less)",
            args.start
        )));
    };
    let begin = start(graph, place.floor, place.place.map(f64::from), f64::from(heading));
    let Some((edge, along_m)) = begin else {
        return Err(Error::new(format!("--start {}: the walk graph has no edge on floor {}", args.start, place.floor)));
    };
    let mut tracker = Tracker::new(graph, &parameters, edge, along_m);
    if args.barometer {
        // The start was found on this floor.
        let floors =
            Floors::new(building, place.floor).ok_or_else(|| Error::new(format!("no floor {}", place.floor)))?;
        tracker = tracker.with_barometer(floors);
    }
    let mut decisions = Vec::new();
    for step in walk.steps.iter().filter(|step| step.stance_end > since) {
        let rise = f64::from(step.displacement.z);
        let decision = tracker.step(f64::from(step.turn), f64::from(step.length()), rise);
        if args.explain {
            print(&format!("step {}: {decision}\n", step.index))?;
        }
        decisions.push(decision);
    }
    print(&summary(graph, &decisions))?;
    let floor_of = |decision: &Decision| graph.node(graph.edge(decision.edge).from).floor;
    Ok(decisions.iter().map(|decision| (floor_of(decision), decision.place)).collect())
}

/// A recorded walk with its steps.
fn read(file: &Path, phone: &phone::Parameters) -> Result<Recording, Error> {
    if phone::open::is_phone(file) {
        return Ok(Recording::of_phone(file, phone)?);
    }
    let mut recording = recording::open(file, None)?;
    if !recording.samples.is_empty() {
        let samples = recording.samples.iter().copied();
        recording.steps = Track::of(samples, &sohle_shared::tracker::Parameters::default()).steps;
    }
    Ok(recording)
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
        ("5 map matching", Case::MapMatching),
        ("waiting", Case::Waiting),
    ];
    let mut table = Table::new("case", &["steps", "%"]);
    for (name, case) in cases {
        let count = decisions.iter().filter(|decision| decision.case == case).count();
        let share = 100.0 * count as f64 / decisions.len().max(1) as f64;
        table.row(name, vec![count.to_string(), format!("{share:.1}")]);
    }
    let count = |cases: &[Case]| decisions.iter().filter(|decision| cases.contains(&decision.case)).count();
    let searched = decisions.iter().filter(|decision| decision.case.is_search()).count();
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
fn pictures(building: &Building, places: &[(i32, Point)], folder: &Path) -> Result<(), Error> {
    file::folder(folder)?;
    for floor in &building.floors {
        let stays = places.chunk_by(|a, b| a.0 == b.0).filter(|stay| stay[0].0 == floor.number);
        let pieces: Vec<Vec<Point>> = stays.map(|stay| stay.iter().map(|(_, place)| *place).collect()).collect();
        if pieces.is_empty() {
            continue;
        }
        let trace = Trace { label: "on the graph", colour: "#c8322d", width: 2.5, pieces };
        let drawing = plan::draw_with(building, floor, &[], &[], &[trace]);
        file::write(&folder.join(format!("floor{}.svg", floor.number)), drawing.as_bytes())?;
        file::write(&folder.join(format!("floor{}.png", floor.number)), &png::render(&drawing)?)?;
    }
    Ok(())
}
