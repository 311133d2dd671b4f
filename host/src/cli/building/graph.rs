//! `sohle building graph`: the walk graph of a building is drawn, imported, exported and judged.

use super::check::{counts, marks, refused, shortened, text};
use super::{Input, folder, write, write_drawing};
use crate::building::Building;
use crate::cli::table::Table;
use crate::cli::{Error, print};
use crate::export::file;
use crate::export::plan;
use crate::graph::draw::{self, draw};
use crate::graph::lint::{self, lint};
use crate::graph::{EdgeKind, Graph, adjacency};
use crate::toml_file;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Draws the walk graph of a building and judges it, as it was drawn, read from a list, or is there already
///
/// Without a graph in the file or a list one is drawn. Ends with exit code 1 if there is an error among the findings.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle building graph buildings/twin.geojson\n  \
                        sohle building graph house.geojson --write house-graph.geojson --list graph.csv\n  \
                        sohle building graph house.geojson --import graph.csv --write house-graph.geojson")]
pub struct GraphArgs {
    #[command(flatten)]
    input: Input,
    /// Take the graph from an extended adjacency list (docs/building.md)
    #[arg(long, value_name = "LIST.csv", conflicts_with_all = ["redraw", "parameters"])]
    import: Option<PathBuf>,
    /// Draw it anew even if the file has one
    #[arg(long)]
    redraw: bool,
    /// How it is drawn; other settings keep their default
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Write the building with its graph
    #[arg(long, value_name = "OUT.geojson")]
    write: Option<PathBuf>,
    /// Write the graph as an extended adjacency list
    #[arg(long, value_name = "OUT.csv")]
    list: Option<PathBuf>,
    /// Overwrite files that are there
    #[arg(long)]
    force: bool,
    /// Folder of the pictures [default: sohle-out/ and the building's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Every finding; without it the first 20 of a kind on a floor
    #[arg(long)]
    all: bool,
}

/// Draws or reads, judges, writes.
pub fn run(args: &GraphArgs) -> Result<(), Error> {
    let mut building = args.input.read()?;
    let parameters = match &args.parameters {
        Some(path) => toml_file::read("settings of a walk graph", path)?,
        None => draw::Parameters::default(),
    };
    let from = if let Some(path) = &args.import {
        let name = path.display().to_string();
        let read = std::fs::read_to_string(path);
        let list = read.map_err(|error| Error::new(format!("{name} cannot be read: {error}")))?;
        building.graph = Some(adjacency::read(&list, &name, &building)?);
        building = building.assembled()?;
        "read from a list"
    } else if building.graph.is_none() || args.redraw {
        parameters.check().map_err(Error::new)?;
        building.graph = Some(draw(&building, &parameters));
        "drawn"
    } else {
        "of the file"
    };
    let graph = Graph::of(&building)?;
    let found = lint(&building, &lint::Parameters::default())?;
    let counted @ [errors, _] = counts(&found);
    let (listed, left_out) = if args.all { (found, BTreeMap::new()) } else { shortened(found) };
    let folder = folder(args.out.as_deref(), &args.input.input);
    file::folder(&folder)?;
    for floor in &building.floors {
        let drawing = plan::draw(&building, floor, &marks(&listed, floor.number));
        write_drawing(&folder, floor.number, &drawing)?;
    }
    print(&format!("walk graph, {from}\n\n{}\n", summary(&building, &graph)))?;
    print(&text(&building, &listed, &left_out, counted))?;
    print(&format!("pictures in {}\n", folder.display()))?;
    if let Some(path) = &args.list {
        if path.exists() && !args.force {
            return Err(Error::new(format!("{}: is there already; --force overwrites it", path.display())));
        }
        file::write(path, adjacency::write(&graph).as_bytes())?;
        print(&format!("adjacency list of {} edges in {}\n", graph.edges().len(), path.display()))?;
    }
    if let Some(path) = &args.write {
        write(&building, path, args.force)?;
    }
    refused(&args.input.input, errors)
}

/// What the document tells of its graphs (Graph, table 7.1), floor by floor.
fn summary(building: &Building, graph: &Graph) -> String {
    let headings = ["nodes", "edges", "nodes / edges", "mean m", "shortest m", "longest m", "stairs", "elevators"];
    let mut table = Table::new("floor", &headings);
    let mut row = |name: String, number: Option<i32>| {
        let on = |floor: i32| number.is_none_or(|number| number == floor);
        let nodes = graph.nodes().iter().filter(|node| on(node.floor)).count();
        let edges = || graph.edges().iter().filter(|edge| on(graph.node(edge.from).floor));
        let lengths: Vec<f64> = edges().filter(|edge| edge.kind == EdgeKind::Level).map(|edge| edge.length_m).collect();
        let kind = |kind: EdgeKind| edges().filter(|edge| edge.kind == kind).count().to_string();
        let length = |value: f64| if lengths.is_empty() { "-".to_owned() } else { format!("{value:.2}") };
        let count = edges().count();
        table.row(
            name,
            vec![
                nodes.to_string(),
                count.to_string(),
                if count == 0 { "-".to_owned() } else { format!("{:.2}", nodes as f64 / count as f64) },
                length(lengths.iter().sum::<f64>() / lengths.len() as f64),
                length(lengths.iter().copied().fold(f64::INFINITY, f64::min)),
                length(lengths.iter().copied().fold(0.0, f64::max)),
                kind(EdgeKind::Stairs),
                kind(EdgeKind::Elevator),
            ],
        );
    };
    for floor in &building.floors {
        row(floor.number.to_string(), Some(floor.number));
    }
    row("all".to_owned(), None);
    table.text()
}
