//! A truth file as named columns.

use super::source::Layout;
use crate::recording::mapping::{Column, Separator};
use crate::recording::{RecordingError, mat};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A truth file cannot be used: which one, and why, in one line.
#[derive(Debug, Error)]
#[error("truth {}: {problem}", path.display())]
pub struct TableError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong and what was expected.
    pub problem: String,
}

/// A value as it stands in the file.
#[derive(Clone, Debug, PartialEq)]
enum Cell {
    Number(f64),
    Text(String),
}

/// A named column; columns of a MATLAB file may differ in length.
#[derive(Clone, Debug, PartialEq)]
struct Named {
    name: String,
    cells: Vec<Cell>,
}

/// The content of a truth file.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    path: PathBuf,
    columns: Vec<Named>,
    /// Number of the first line of data; the first line of a file is 1.
    first_line: usize,
}

impl Table {
    /// Reads text laid out as `layout` says, or a MATLAB file if the name ends in `.mat`.
    pub fn read(path: &Path, layout: &Layout) -> Result<Self, TableError> {
        let refused = |problem: String| TableError { path: path.to_owned(), problem };
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mat")) {
            let columns = matlab(path).map_err(|error| refused(error.problem.to_string()))?;
            return Ok(Self { path: path.to_owned(), columns, first_line: 1 });
        }
        let text = std::fs::read_to_string(path).map_err(|error| refused(error.to_string()))?;
        let (columns, first_line) = parse(&text, layout).map_err(refused)?;
        Ok(Self { path: path.to_owned(), columns, first_line })
    }

    /// An error about this file.
    pub fn error(&self, problem: impl Into<String>) -> TableError {
        TableError { path: self.path.clone(), problem: problem.into() }
    }

    /// The numbers of a column, each finite.
    pub fn numbers(&self, column: &Column) -> Result<Vec<f64>, TableError> {
        let named = self.find(column)?;
        let number = |(row, cell): (usize, &Cell)| {
            let value = match cell {
                Cell::Number(value) => Some(*value),
                Cell::Text(text) => text.trim().parse().ok(),
            };
            value.filter(|value: &f64| value.is_finite()).ok_or_else(|| {
                let what = match cell {
                    Cell::Number(value) => value.to_string(),
                    Cell::Text(text) => format!("'{}'", text.trim()),
                };
                self.error(format!(
                    "line {}, column '{}': {what} is no finite number",
                    self.first_line + row,
                    named.name
                ))
            })
        };
        named.cells.iter().enumerate().map(number).collect()
    }

    /// The values of a column as text.
    pub fn texts(&self, column: &Column) -> Result<Vec<String>, TableError> {
        let text = |cell: &Cell| match cell {
            Cell::Number(value) => value.to_string(),
            Cell::Text(text) => text.trim().to_owned(),
        };
        Ok(self.find(column)?.cells.iter().map(text).collect())
    }

    fn find(&self, column: &Column) -> Result<&Named, TableError> {
        let mut fitting = self.columns.iter().enumerate().filter(|(index, named)| column.fits(&named.name, *index));
        fitting.next().map(|(_, named)| named).ok_or_else(|| {
            let names: Vec<&str> = self.columns.iter().map(|named| named.name.as_str()).collect();
            self.error(format!("no column {column}; the file has: {}", names.join(", ")))
        })
    }
}

/// Columns and the number of the first line of data, or what is wrong.
fn parse(text: &str, layout: &Layout) -> Result<(Vec<Named>, usize), String> {
    let kept = text.trim_start_matches('\u{feff}').lines().enumerate().skip(layout.skip_lines).filter(|(_, line)| {
        let comment = layout.comment.as_ref().is_some_and(|comment| line.starts_with(comment.as_str()));
        !comment && !line.trim().is_empty()
    });
    let mut rows = kept.map(|(index, line)| (index + 1, split(line, layout.separator)));
    let header: Vec<Vec<String>> =
        rows.by_ref().take(layout.header_lines.unwrap_or(1)).map(|(_, cells)| cells).collect();
    let mut rows = rows.peekable();
    let Some((first_line, first)) = rows.peek() else { return Err("no lines of data".into()) };
    let (first_line, width) = (*first_line, first.len());
    let name = |index: usize| {
        let parts: Vec<&str> = header
            .iter()
            .filter_map(|line| line.get(index).map(String::as_str))
            .filter(|part| !part.is_empty())
            .collect();
        parts.join(".")
    };
    let mut columns: Vec<Named> = (0..width).map(|index| Named { name: name(index), cells: Vec::new() }).collect();
    for (line, cells) in rows {
        if cells.len() != width {
            return Err(format!("line {line} has {} values, the first line of data {width}", cells.len()));
        }
        for (column, cell) in columns.iter_mut().zip(cells) {
            column.cells.push(Cell::Text(cell));
        }
    }
    Ok((columns, first_line))
}

fn split(line: &str, separator: Option<Separator>) -> Vec<String> {
    let clean = |cell: &str| cell.trim().trim_matches('"').to_owned();
    match separator.unwrap_or(Separator::Character(b',')) {
        Separator::Whitespace => line.split_whitespace().map(clean).collect(),
        Separator::Character(character) => line.split(char::from(character)).map(clean).collect(),
    }
}

/// The numeric variables of a MATLAB file. A vector is a column; the columns of a matrix are named `variable.1`,
/// `variable.2`, ...
fn matlab(path: &Path) -> Result<Vec<Named>, RecordingError> {
    let mut columns = Vec::new();
    for (name, matrix) in mat::variables(path)? {
        let chunks = matrix.values.chunks(matrix.rows.max(1));
        columns.extend(chunks.enumerate().map(|(index, values)| Named {
            name: if matrix.columns == 1 { name.clone() } else { format!("{name}.{}", index + 1) },
            cells: values.iter().copied().map(Cell::Number).collect(),
        }));
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str, layout: Layout) -> Table {
        let (columns, first_line) = parse(text, &layout).unwrap();
        Table { path: PathBuf::from("truth.csv"), columns, first_line }
    }

    #[test]
    fn columns_are_found_by_name_and_by_number() {
        let table = table(
            "# walked on Monday\nt;x\n0.5;1\n1.5;-2e0\n",
            Layout { separator: Some(Separator::Character(b';')), comment: Some("#".into()), ..Layout::default() },
        );
        assert_eq!(table.numbers(&Column::Name("x".into())).unwrap(), [1.0, -2.0]);
        assert_eq!(table.numbers(&Column::Number(1)).unwrap(), [0.5, 1.5]);
    }

    #[test]
    fn two_header_lines_are_joined_by_a_point() {
        let table = table(",heel,heel\n,x,y\n0,1,2\n", Layout { header_lines: Some(2), ..Layout::default() });
        assert_eq!(table.numbers(&Column::Name("heel.y".into())).unwrap(), [2.0]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let read = table("t,x\n0,1\n1,nan\n2,left\n", Layout::default());
        let message = |column: &str| read.numbers(&Column::Name(column.into())).unwrap_err().to_string();
        assert_eq!(message("x"), "truth truth.csv: line 3, column 'x': 'nan' is no finite number");
        assert_eq!(message("y"), "truth truth.csv: no column 'y'; the file has: t, x");
        assert_eq!(
            parse("t,x\n0,1\n1\n", &Layout::default()).unwrap_err(),
            "line 3 has 1 values, the first line of data 2"
        );
        assert_eq!(parse("t,x\n", &Layout::default()).unwrap_err(), "no lines of data");
    }
}
