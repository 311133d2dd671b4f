//! A table of figures for the terminal.

/// A line of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// What it is about.
    pub name: String,
    /// One for each heading; those missing at the end are empty.
    pub cells: Vec<String>,
}

/// Rows of cells below headings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    corner: String,
    headings: Vec<String>,
    rows: Vec<Row>,
}

impl Table {
    /// An empty table; `corner` says what the names of the rows are.
    pub fn new(corner: impl Into<String>, headings: &[&str]) -> Self {
        Self {
            corner: corner.into(),
            headings: headings.iter().map(|&heading| heading.to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Appends a row.
    pub fn row(&mut self, name: impl Into<String>, cells: Vec<String>) {
        self.rows.push(Row { name: name.into(), cells });
    }

    /// Appends a column; rows beyond `cells` stay empty in it.
    pub fn column(&mut self, heading: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        for (row, cell) in self.rows.iter_mut().zip(cells) {
            row.cells.resize(self.headings.len(), String::new());
            row.cells.push(cell);
        }
        self.headings.push(heading.into());
    }

    /// The headings.
    pub fn headings(&self) -> &[String] {
        &self.headings
    }

    /// The rows.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// In columns, names to the left and figures to the right, two spaces between them.
    pub fn text(&self) -> String {
        let cell = |row: &Row, column: usize| row.cells.get(column).cloned().unwrap_or_default();
        let wide = |text: &str| text.chars().count();
        let first = self.rows.iter().map(|row| wide(&row.name)).chain([wide(&self.corner)]).max().unwrap_or(0);
        let widths: Vec<_> = (0..self.headings.len())
            .map(|column| {
                self.rows.iter().map(|row| wide(&cell(row, column))).fold(wide(&self.headings[column]), usize::max)
            })
            .collect();
        let line = |name: &str, cells: &mut dyn Iterator<Item = String>| {
            let cells: String =
                cells.zip(&widths).map(|(cell, width)| format!("  {cell:>width$}", width = *width)).collect();
            format!("{}\n", format!("{name:<first$}{cells}").trim_end())
        };
        let mut text = line(&self.corner, &mut self.headings.iter().cloned());
        for row in &self.rows {
            text.push_str(&line(&row.name, &mut (0..self.headings.len()).map(|column| cell(row, column))));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_below_each_other_and_short_rows_stay_short() {
        let mut table = Table::new("settings", &["strides", "m"]);
        table.row("default", vec!["7".into(), "10.25".into()]);
        table.row("truth", vec!["7".into()]);
        table.column("s", ["0.1".into()]);
        let expected = "settings  strides      m    s\ndefault         7  10.25  0.1\ntruth           7\n";
        assert_eq!(table.text(), expected);
    }
}
