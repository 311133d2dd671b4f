//! `sohle building`: buildings are generated, converted, shown and checked, and their walk graphs drawn.

mod check;
mod graph;

use super::table::Table;
use super::{Error, print};
use crate::building::dxf::Layers;
use crate::building::open::{self, Format, Options};
use crate::building::{Building, ConnectorKind, generate, geojson, geometry};
use crate::export::plan;
use crate::export::{file, png};
use std::path::{Path, PathBuf};

/// Generates, converts, shows and checks buildings
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle building show buildings/twin.geojson\n  \
                        sohle building check buildings/twin.geojson\n  \
                        sohle building convert floorplans/ house.geojson\n  \
                        sohle building generate large --seed 7 large.geojson")]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    Generate(GenerateArgs),
    Convert(ConvertArgs),
    Show(ShowArgs),
    Check(check::CheckArgs),
    Graph(graph::GraphArgs),
}

/// Which building is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Made {
    /// Two floors of 805 m², two wings that mirror each other, two staircases, an elevator, a hall
    Twin,
    /// Three floors of 860 m² that differ: foyer and lecture hall, offices, laboratories
    Institute,
    /// Six floors of 10 000 m² with some sixteen hundred rooms, from a seed
    Large,
}

/// Makes a building of the project's own
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle building generate twin twin.geojson\n  \
                        sohle building generate large --seed 7 large.geojson")]
struct GenerateArgs {
    /// Which
    made: Made,
    /// The file to write
    #[arg(value_name = "OUT.geojson")]
    output: PathBuf,
    /// Another seed, other rooms; of 'large' only [default: 1]
    #[arg(long)]
    seed: Option<u64>,
    /// Overwrite the file if it is there
    #[arg(long)]
    force: bool,
}

/// How a building is read.
#[derive(Debug, clap::Args)]
pub struct Input {
    /// The file or folder
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Its format; recognised from the content when left out
    #[arg(long)]
    format: Option<Format>,
    /// From floor to floor in metres, where the format has no heights
    #[arg(long, value_name = "M", default_value_t = Options::default().storey_m)]
    storey: f64,
    /// What is on which layer of a DXF file (docs/building.md); the layers of the graph document when left out
    #[arg(long, value_name = "FILE.toml")]
    layers: Option<PathBuf>,
}

impl Input {
    /// Reads it.
    pub fn read(&self) -> Result<Building, Error> {
        if !(1.0..=100.0).contains(&self.storey) {
            return Err(Error::new(format!("--storey {}: expected 1 to 100 metres", self.storey)));
        }
        let layers = match &self.layers {
            Some(path) => open::layers(path)?,
            None => Layers::default(),
        };
        let options = Options { format: self.format, storey_m: self.storey, layers };
        Ok(open::open(&self.input, &options)?)
    }
}

/// Converts a building to the project's own GeoJSON
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle building convert floorplans/ house.geojson --storey 4.2\n  \
                        sohle building convert site1/F4 mall.geojson\n  \
                        sohle building convert plans/ house.geojson --layers layers.toml")]
struct ConvertArgs {
    #[command(flatten)]
    input: Input,
    /// The file to write
    #[arg(value_name = "OUT.geojson")]
    output: PathBuf,
    /// Overwrite the file if it is there
    #[arg(long)]
    force: bool,
}

/// Draws the floors of a building (SVG and PNG) and lists what is on them
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle building show buildings/twin.geojson\n  \
                        sohle building show buildings/large.geojson --floor 2 --out pictures")]
struct ShowArgs {
    #[command(flatten)]
    input: Input,
    /// This floor only
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    floor: Option<i32>,
    /// Folder of the pictures [default: sohle-out/ and the building's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Does what is asked of a building.
pub fn run(args: Args) -> Result<(), Error> {
    match args.command {
        Command::Generate(args) => generate(&args),
        Command::Convert(args) => convert(&args),
        Command::Show(args) => show(&args),
        Command::Check(args) => check::run(&args),
        Command::Graph(args) => graph::run(&args),
    }
}

fn generate(args: &GenerateArgs) -> Result<(), Error> {
    let building = match (args.made, args.seed) {
        (Made::Twin, None) => generate::twin(2),
        (Made::Institute, None) => generate::institute(),
        (Made::Twin | Made::Institute, Some(_)) => {
            return Err(Error::new("--seed: of 'large' only; the others are always the same"));
        }
        (Made::Large, seed) => generate::large(seed.unwrap_or(1)),
    };
    write(&building, &args.output, args.force)
}

fn convert(args: &ConvertArgs) -> Result<(), Error> {
    write(&args.input.read()?, &args.output, args.force)
}

fn write(building: &Building, output: &Path, force: bool) -> Result<(), Error> {
    if !output.extension().is_some_and(|extension| extension == "geojson" || extension == "json") {
        return Err(Error::new(format!("{}: the file to write must end in .geojson", output.display())));
    }
    if output.exists() && !force {
        return Err(Error::new(format!("{}: is there already; --force overwrites it", output.display())));
    }
    let text = geojson::write(building)?;
    file::write(output, text.as_bytes())?;
    print(&format!("{}written to {} ({} kB)\n", summary(building), output.display(), text.len().div_ceil(1000)))
}

fn show(args: &ShowArgs) -> Result<(), Error> {
    let building = args.input.read()?;
    if let Some(number) = args.floor.filter(|&number| building.floor(number).is_none()) {
        let present: Vec<_> = building.floors.iter().map(|floor| floor.number.to_string()).collect();
        return Err(Error::new(format!("--floor {number}: the building has {}", present.join(", "))));
    }
    let folder = folder(args.out.as_deref(), &args.input.input);
    file::folder(&folder)?;
    for floor in building.floors.iter().filter(|floor| args.floor.is_none_or(|number| number == floor.number)) {
        let drawing = plan::draw(&building, floor, &[]);
        write_drawing(&folder, floor.number, &drawing)?;
    }
    print(&format!("{}pictures in {}\n", summary(&building), folder.display()))
}

/// Where pictures go.
fn folder(out: Option<&Path>, input: &Path) -> PathBuf {
    let name = input.file_stem().unwrap_or(std::ffi::OsStr::new("building"));
    out.map_or_else(|| Path::new("sohle-out").join(name), Path::to_owned)
}

fn write_drawing(folder: &Path, floor: i32, drawing: &str) -> Result<(), Error> {
    file::write(&folder.join(format!("floor{floor}.svg")), drawing.as_bytes())?;
    Ok(file::write(&folder.join(format!("floor{floor}.png")), &png::render(drawing)?)?)
}

/// What is on the floors, in a table.
fn summary(building: &Building) -> String {
    let headings = ["name", "height m", "size m", "rooms", "walls", "doors", "stairs", "elevators", "entrances"];
    let mut table = Table::new("floor", &headings);
    for floor in &building.floors {
        let size = geometry::bounds(floor.points())
            .map_or_else(String::new, |[low, high]| format!("{:.1} x {:.1}", high[0] - low[0], high[1] - low[1]));
        let connectors = |elevators: bool| {
            let of_kind =
                building.connectors.iter().filter(|connector| (connector.kind == ConnectorKind::Elevator) == elevators);
            of_kind.flat_map(|connector| &connector.outlines).filter(|(number, _)| *number == floor.number).count()
        };
        let entrances = building.entrances.iter().filter(|entrance| entrance.floor == floor.number).count();
        let counts =
            [floor.rooms.len(), floor.walls.len(), floor.doors.len(), connectors(false), connectors(true), entrances];
        let mut cells = vec![floor.name.clone(), format!("{:.2}", floor.height_m), size];
        cells.extend(counts.map(|count| count.to_string()));
        table.row(floor.number.to_string(), cells);
    }
    format!("{}\n\n{}\n", building.name, table.text())
}
