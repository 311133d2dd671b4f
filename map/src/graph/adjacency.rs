//! The document's extended adjacency list as a CSV file: a row for each directed edge.
//!
//! # Source
//! Graph, table 6.1. As everywhere in the document y points east and x north, and directions count clockwise from north: y
//! is the building's x, x its y. Two columns are the project's own, the heights of both ends; a list without them is of
//! nodes on the level of their floors.

use super::error::Error;
use super::model::Graph;
use crate::building::geometry::wrapped;
use crate::building::{Building, Node, WalkGraph};
use std::collections::BTreeMap;

/// The headings.
const HEADINGS: [&str; 12] = [
    "start_node",
    "start_y_m",
    "start_x_m",
    "start_floor",
    "end_node",
    "end_y_m",
    "end_x_m",
    "end_floor",
    "direction_deg",
    "length_m",
    "start_height_m",
    "end_height_m",
];
/// Those of the document.
const DOCUMENTED: usize = 10;

/// Lengths and directions may differ from those of the coordinates by rounding. **Units:** m, rad.
const LENGTH_OFF_M: f64 = 0.02;
const DIRECTION_OFF: f64 = 0.02;
/// Shorter edges have no direction that could be compared. **Units:** m.
const NO_DIRECTION_M: f64 = 0.1;
/// Factors that a wrong unit makes, and what they tell.
const UNITS: [(f64, &str); 4] =
    [(1e3, "millimetres"), (1e2, "centimetres"), (1.0 / 0.3048, "feet"), (1e-3, "kilometres")];

/// The list of a graph: coordinates to a tenth of a millimetre, directions to 0.0001 degrees.
pub fn write(graph: &Graph) -> String {
    let mut text = format!("{}\n", HEADINGS.join(","));
    for edge in graph.edges() {
        let [from, to] = [edge.from, edge.to].map(|id| graph.node(id));
        let bearing = (90.0 - edge.direction.to_degrees()).rem_euclid(360.0);
        let cells = [
            edge.from.0.to_string(),
            format!("{:.4}", from.place[0]),
            format!("{:.4}", from.place[1]),
            from.floor.to_string(),
            edge.to.0.to_string(),
            format!("{:.4}", to.place[0]),
            format!("{:.4}", to.place[1]),
            to.floor.to_string(),
            format!("{bearing:.4}"),
            format!("{:.4}", edge.length_m),
            format!("{:.4}", from.height_m),
            format!("{:.4}", to.height_m),
        ];
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// An end of a row.
#[derive(Clone, Copy, Debug)]
struct End {
    id: u64,
    node: Node,
}

/// A row of the list.
#[derive(Debug)]
struct Row {
    line: u64,
    ends: [End; 2],
    /// **Units:** rad, clockwise from north.
    bearing: f64,
    /// As it stands in the file.
    degrees: f64,
    length_m: f64,
}

impl Row {
    /// From the first to the second end. **Units:** m, east and north.
    fn along(&self) -> [f64; 2] {
        let [from, to] = self.ends.map(|end| end.node.place);
        [to[0] - from[0], to[1] - from[1]]
    }

    fn distance(&self) -> f64 {
        self.along()[0].hypot(self.along()[1])
    }
}

/// Reads a list; heights that it does not tell are those of the floors of `building`. `file` is its name in errors. Commas or
/// semicolons part the cells.
///
/// # Errors
/// When a row cannot be read, names a floor that is not there, has no length, or its way back is missing; when a node is at
/// two places; when lengths and directions do not belong to the coordinates, with what is probably wrong.
pub fn read(text: &str, file: &str, building: &Building) -> Result<WalkGraph, Error> {
    let rows = rows(text, file, building)?;
    let list = |what: String| Error::List { file: file.to_owned(), what };
    check_units(&rows).map_err(list)?;
    for row in &rows {
        check(row).map_err(|what| Error::Row { file: file.to_owned(), line: row.line, what })?;
    }
    let mut graph = WalkGraph::default();
    let mut known: BTreeMap<u64, (usize, u64)> = BTreeMap::new();
    let mut ways: BTreeMap<[usize; 2], u64> = BTreeMap::new();
    for row in &rows {
        let wrong = |what: String| Error::Row { file: file.to_owned(), line: row.line, what };
        let mut ends = [0; 2];
        for (index, end) in ends.iter_mut().zip(&row.ends) {
            let (number, line) = *known.entry(end.id).or_insert_with(|| {
                graph.nodes.push(end.node);
                (graph.nodes.len() - 1, row.line)
            });
            let before = &graph.nodes[number];
            if *before != end.node {
                return Err(wrong(format!(
                    "node {} is at y {}, x {} on floor {} here, and at y {}, x {} on floor {} on line {line}; a node has \
                     one place",
                    end.id,
                    end.node.place[0],
                    end.node.place[1],
                    end.node.floor,
                    before.place[0],
                    before.place[1],
                    before.floor
                )));
            }
            *index = number;
        }
        if let Some(line) = ways.insert(ends, row.line) {
            return Err(wrong(format!("this edge stands on line {line} already; remove one")));
        }
        if ends[0] < ends[1] {
            graph.edges.push(ends);
        }
    }
    for (&[from, to], &line) in &ways {
        if !ways.contains_key(&[to, from]) {
            let id = |number: usize| known.iter().find(|(_, known)| known.0 == number).map_or(0, |(id, _)| *id);
            let what = format!(
                "no row leads back from node {} to node {}; every way needs one row for each direction",
                id(to),
                id(from)
            );
            return Err(Error::Row { file: file.to_owned(), line, what });
        }
    }
    Ok(graph)
}

fn rows(text: &str, file: &str, building: &Building) -> Result<Vec<Row>, Error> {
    let text = text.trim_start_matches('\u{feff}');
    let line = text.lines().next().unwrap_or_default();
    let delimiter = if line.contains(';') { b';' } else { b',' };
    let mut reader = csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(text.as_bytes());
    let wrong = |line: u64, what: String| Error::Row { file: file.to_owned(), line, what };
    let unreadable = |error: &csv::Error| {
        wrong(
            error.position().map_or(1, csv::Position::line),
            "the row has more or fewer cells than the headings".into(),
        )
    };
    let headings = reader.headers().map_err(|error| unreadable(&error))?.clone();
    let mut columns = [None; HEADINGS.len()];
    for (column, heading) in columns.iter_mut().zip(HEADINGS) {
        *column = headings.iter().position(|cell| cell == heading);
    }
    if let Some(missing) = (0..DOCUMENTED).find(|&column| columns[column].is_none()) {
        return Err(wrong(
            1,
            format!("there is no column '{}'; expected {}", HEADINGS[missing], HEADINGS[..DOCUMENTED].join(", ")),
        ));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| unreadable(&error))?;
        let line = record.position().map_or(1, csv::Position::line);
        rows.push(row(&record, &columns, line, building).map_err(|what| wrong(line, what))?);
    }
    if rows.is_empty() {
        return Err(Error::List { file: file.to_owned(), what: "no row follows the headings".to_owned() });
    }
    Ok(rows)
}

fn row(
    record: &csv::StringRecord,
    columns: &[Option<usize>; HEADINGS.len()],
    line: u64,
    building: &Building,
) -> Result<Row, String> {
    let cell = |column: usize| columns[column].and_then(|at| record.get(at)).unwrap_or_default();
    let number = |column: usize| match cell(column).parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("'{}' is no {}; expected a number", cell(column), HEADINGS[column])),
    };
    let end = |first: usize, height: usize| {
        let id = cell(first);
        let id =
            id.parse().map_err(|_| format!("'{id}' is no {}; expected a whole number from 0 on", HEADINGS[first]))?;
        let floor = cell(first + 3);
        let floor: i32 = floor.parse().map_err(|_| format!("'{floor}' is no number of a floor"))?;
        let place = [number(first + 1)?, number(first + 2)?];
        let own = building.floor(floor).ok_or_else(|| {
            let present: Vec<_> = building.floors.iter().map(|floor| floor.number.to_string()).collect();
            format!("floor {floor} is not there; the building has {}", present.join(", "))
        })?;
        let height_m = if columns[height].is_some() { number(height)? } else { own.height_m };
        Ok::<End, String>(End { id, node: Node { floor, place, height_m } })
    };
    let degrees = number(8)?;
    Ok(Row { line, ends: [end(0, 10)?, end(4, 11)?], bearing: degrees.to_radians(), degrees, length_m: number(9)? })
}

/// What is wrong with all rows alike is told as one.
fn check_units(rows: &[Row]) -> Result<(), String> {
    let long: Vec<&Row> = rows.iter().filter(|row| row.distance() > NO_DIRECTION_M).collect();
    // Half of the rows and more.
    let most =
        |fits: &dyn Fn(&Row) -> bool| !long.is_empty() && 2 * long.iter().filter(|row| fits(row)).count() > long.len();
    let alike = |length: f64, distance: f64| (length - distance).abs() <= LENGTH_OFF_M + 0.01 * distance;
    if !most(&|row| alike(row.length_m, row.distance())) {
        for (factor, unit) in UNITS {
            if most(&|row| alike(row.length_m * factor, row.distance())) {
                return Err(format!(
                    "the coordinates are {factor:.4} times the lengths: are they {unit}? Both must be metres"
                ));
            }
            if most(&|row| alike(row.length_m, row.distance() * factor)) {
                return Err(format!(
                    "the lengths are {factor:.4} times the coordinates: are they {unit}? Both must be metres"
                ));
            }
        }
    }
    let off = |bearing: f64, [east, north]: [f64; 2]| wrapped(bearing - east.atan2(north)).abs() <= DIRECTION_OFF;
    if !most(&|row| off(row.bearing, row.along())) {
        if most(&|row| off(row.bearing, [row.along()[1], row.along()[0]])) {
            return Err(
                "directions and coordinates contradict each other: y and x are in the wrong order; y points east and \
                 comes first, x north"
                    .to_owned(),
            );
        }
        if most(&|row| off(row.degrees, row.along())) {
            return Err("the directions are radians; expected degrees, clockwise from north".to_owned());
        }
    }
    Ok(())
}

fn check(row: &Row) -> Result<(), String> {
    let [from, to] = row.ends;
    if from.id == to.id {
        return Err(format!("the edge joins node {} with itself; remove it", from.id));
    }
    let distance = row.distance();
    let level = from.node.floor == to.node.floor && from.node.height_m == to.node.height_m;
    if level && distance < 1e-3 {
        return Err(format!(
            "nodes {} and {} are at the same place, the edge has no length; make them one",
            from.id, to.id
        ));
    }
    if (row.length_m - distance).abs() > LENGTH_OFF_M + 0.01 * distance {
        return Err(format!("the length is {} m, but the nodes are {distance:.3} m apart", row.length_m));
    }
    let bearing = row.along()[0].atan2(row.along()[1]);
    if distance > NO_DIRECTION_M && wrapped(row.bearing - bearing).abs() > DIRECTION_OFF {
        return Err(format!(
            "the direction is {} degrees, but the end lies at {:.1} degrees, clockwise from north",
            row.degrees,
            bearing.to_degrees().rem_euclid(360.0)
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::Floor;
    use proptest::prelude::*;

    fn building() -> Building {
        let floor = |number, height_m| Floor { number, height_m, ..Floor::default() };
        Building { floors: vec![floor(0, 0.0), floor(1, 3.5)], ..Building::default() }
    }

    fn drawn() -> WalkGraph {
        let node = |floor, place, height_m| Node { floor, place, height_m };
        let nodes = vec![
            node(0, [0.0, 0.0], 0.0),
            node(0, [2.0, 0.0], 0.0),
            node(0, [2.0, 3.0], 1.75),
            node(1, [2.0, 3.0], 3.5),
        ];
        WalkGraph { nodes, edges: vec![[0, 1], [1, 2], [2, 3]] }
    }

    fn list() -> String {
        write(&Graph::new(&drawn(), &[]).unwrap())
    }

    fn told(text: &str) -> String {
        read(text, "list.csv", &building()).unwrap_err().to_string()
    }

    #[test]
    fn a_row_is_that_of_table_6_1() {
        // Node 0 to node 1, 2 m to the east: y grows, and east is 90 degrees clockwise from north.
        assert_eq!(list().lines().nth(1).unwrap(), "0,0.0000,0.0000,0,1,2.0000,0.0000,0,90.0000,2.0000,0.0000,0.0000");
    }

    #[test]
    fn what_is_written_is_read_again_with_and_without_heights_and_with_semicolons() {
        assert_eq!(read(&list(), "list.csv", &building()).unwrap(), drawn());
        assert_eq!(read(&list().replace(',', ";"), "list.csv", &building()).unwrap(), drawn());
        let ten = |line: &str| line.split(',').take(10).collect::<Vec<_>>().join(",");
        let plain: String = list().lines().map(|line| ten(line) + "\n").collect();
        let read = read(&plain, "list.csv", &building()).unwrap();
        assert_eq!(read.nodes[2].height_m, 0.0);
        assert_eq!(read.edges, drawn().edges);
    }

    #[test]
    fn coordinates_in_the_wrong_order_or_unit_are_named_with_their_cure() {
        let swapped =
            list().replace("start_y_m,start_x_m", "start_x_m,start_y_m").replace("end_y_m,end_x_m", "end_x_m,end_y_m");
        assert_eq!(
            told(&swapped),
            "list.csv: directions and coordinates contradict each other: y and x are in the wrong order; y points east and \
             comes first, x north"
        );
        let row = |cells: &str| format!("{}\n{cells}\n", HEADINGS[..10].join(","));
        assert_eq!(
            told(&row("0,0,0,0,1,0,2000,0,0,2")),
            "list.csv: the coordinates are 1000.0000 times the lengths: are they millimetres? Both must be metres"
        );
        assert_eq!(
            told(&row("0,0,0,0,1,2,0,0,1.5708,2")),
            "list.csv: the directions are radians; expected degrees, clockwise from north"
        );
    }

    #[test]
    fn what_makes_no_sense_is_told_with_its_line() {
        let rows = |rows: &[&str]| format!("{}\n{}\n", HEADINGS[..10].join(","), rows.join("\n"));
        for (text, expected) in [
            (
                "start_node,end_node\n".to_owned(),
                "list.csv, line 1: there is no column 'start_y_m'; expected start_node",
            ),
            (rows(&[]), "list.csv: no row follows the headings"),
            (rows(&["0,0,0,7,1,2,0,0,90,2"]), "list.csv, line 2: floor 7 is not there; the building has 0, 1"),
            (rows(&["0,a,0,0,1,2,0,0,90,2"]), "list.csv, line 2: 'a' is no start_y_m; expected a number"),
            (rows(&["0,0,0,0,1,2,0"]), "list.csv, line 2: the row has more or fewer cells than the headings"),
            (rows(&["4,0,0,0,4,0,0,0,90,0"]), "list.csv, line 2: the edge joins node 4 with itself; remove it"),
            (
                rows(&["0,0,0,0,1,0,0,0,90,0"]),
                "list.csv, line 2: nodes 0 and 1 are at the same place, the edge has no length; make them one",
            ),
            (
                rows(&["0,0,0,0,1,2,0,0,90,2"]),
                "list.csv, line 2: no row leads back from node 1 to node 0; every way needs one row for each direction",
            ),
            (
                rows(&["0,0,0,0,1,2,0,0,90,2", "1,2,1,0,0,0,0,0,243.4,2.24"]),
                "list.csv, line 3: node 1 is at y 2, x 1 on floor 0 here, and at y 2, x 0 on floor 0 on line 2; a node has one \
                 place",
            ),
            (
                rows(&["0,0,0,0,1,2,0,0,90,2", "1,2,0,0,0,0,0,0,270,2", "1,2,0,0,2,2,4,0,0,5"]),
                "list.csv, line 4: the length is 5 m, but the nodes are 4.000 m apart",
            ),
        ] {
            let message = told(&text);
            assert!(message.starts_with(expected), "{message}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_a_list_or_an_error(text in "[0-9a-z,;.\n\"-]{0,200}") {
            let _ = read(&text, "list.csv", &building());
            let _ = read(&format!("{}\n{text}", HEADINGS.join(",")), "list.csv", &building());
        }
    }
}
