//! Tables as text: CSV and its relatives, read line by line.

use super::Recording;
use super::error::Problem;
use super::mapping::{Mapping, Separator};
use super::profile::{Preset, known};
use super::table::{Collector, Places, listed};
use std::io::{BufRead, Read};

/// A longer line is no line of a recording. **Units:** bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// A line of a file.
struct Line<'a> {
    /// Without its end.
    text: &'a [u8],
    /// Whether it had an end.
    ended: bool,
    /// Counted from 1.
    number: u64,
}

/// Reads lines and counts them.
struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    /// The next line.
    fn next(&mut self) -> Result<Option<Line<'_>>, Problem> {
        self.buffer.clear();
        let length = (&mut self.source).take(LONGEST_LINE).read_until(b'\n', &mut self.buffer)?;
        if length == 0 {
            return Ok(None);
        }
        self.number += 1;
        let ended = self.buffer.last() == Some(&b'\n');
        if !ended && length as u64 == LONGEST_LINE {
            return Err(Problem::Malformed(format!("line {} is longer than {LONGEST_LINE} bytes", self.number)));
        }
        let start = if self.number == 1 && self.buffer.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Ok(Some(Line { text: self.buffer[start..].trim_ascii_end(), ended, number: self.number }))
    }
}

/// Whether a line is to be passed over.
fn is_void(line: &[u8], mapping: &Mapping) -> bool {
    line.trim_ascii_start().is_empty()
        || mapping.comment.as_ref().is_some_and(|mark| line.trim_ascii_start().starts_with(mark.as_bytes()))
}

/// Cuts a line into fields; blanks and quotes around them are taken off.
fn fields(line: &[u8], separator: Separator) -> impl Iterator<Item = &[u8]> {
    let by_blanks = separator == Separator::Whitespace;
    let is_end = move |byte: &u8| match separator {
        Separator::Whitespace => byte.is_ascii_whitespace(),
        Separator::Character(character) => *byte == character,
    };
    line.split(is_end)
        .map(|field| field.trim_ascii())
        .filter(move |field| !(by_blanks && field.is_empty()))
        .map(|field| field.strip_prefix(b"\"").and_then(|inner| inner.strip_suffix(b"\"")).unwrap_or(field))
}

fn number(field: &[u8]) -> Option<f64> {
    std::str::from_utf8(field).ok()?.trim_ascii().parse().ok()
}

/// The separator that a line of names or numbers uses.
fn guess_separator(line: &[u8]) -> Separator {
    let count = |character: u8| line.iter().filter(|&&byte| byte == character).count();
    // A comma may be part of a number, so the others go first.
    match [b'\t', b';', b','].into_iter().find(|&character| count(character) >= 3) {
        Some(character) => Separator::Character(character),
        None => Separator::Whitespace,
    }
}

/// Whether a line holds data: at least half of its fields are numbers.
fn is_data(line: &[u8], separator: Separator) -> bool {
    let (mut all, mut numbers) = (0, 0);
    for field in fields(line, separator).filter(|field| !field.is_empty()) {
        all += 1;
        numbers += usize::from(number(field).is_some());
    }
    2 * numbers >= all
}

/// The names in a header line, where a quoted name may hold the separator.
fn header(line: &[u8], separator: Separator) -> Vec<String> {
    let text = |field: &[u8]| String::from_utf8_lossy(field).trim().to_owned();
    let Separator::Character(delimiter) = separator else { return fields(line, separator).map(text).collect() };
    let mut reader = csv::ReaderBuilder::new().has_headers(false).delimiter(delimiter).from_reader(line);
    let mut record = csv::ByteRecord::new();
    match reader.read_byte_record(&mut record) {
        Ok(_) => record.iter().map(text).collect(),
        Err(_) => Vec::new(),
    }
}

/// Names the columns after one or two header lines, or by their numbers when there is none.
fn join(headers: &[Vec<String>], width: usize) -> Vec<String> {
    match headers {
        [] => (1..=width).map(|number| number.to_string()).collect(),
        [names] => names.clone(),
        [above, below, ..] => {
            let both = |index: usize| match (above.get(index), below.get(index)) {
                (Some(above), Some(below)) if !above.is_empty() && !below.is_empty() => format!("{above}.{below}"),
                (Some(one), _) if !one.is_empty() => one.clone(),
                (_, one) => one.cloned().unwrap_or_default(),
            };
            (0..above.len().max(below.len())).map(both).collect()
        }
    }
}

/// Reads a table whose layout `mapping` describes.
pub(super) fn read(source: impl BufRead, mapping: &Mapping) -> Result<Recording, Problem> {
    let mut lines = Lines { source, buffer: Vec::new(), number: 0 };
    let mut reader = TableReader { mapping, separator: mapping.separator, headers: Vec::new(), width: 0, table: None };
    let mut to_skip = mapping.skip_lines.unwrap_or(0);
    while let Some(line) = lines.next()? {
        if to_skip > 0 {
            to_skip -= 1;
        } else if !is_void(line.text, mapping) {
            reader.line(&line)?;
        }
    }
    match reader.table {
        Some((_, collector)) => collector.finish(),
        None => Err(Problem::NoSamples(match &mapping.line_start {
            Some(start) => format!("no line of {} starts with '{start}'", lines.number),
            None => format!("no line of numbers among {}", lines.number),
        })),
    }
}

struct TableReader<'a> {
    mapping: &'a Mapping,
    separator: Option<Separator>,
    headers: Vec<Vec<String>>,
    /// Fields of the first line of data.
    width: usize,
    /// Known from the first line of data on.
    table: Option<(Table, Collector)>,
}

/// The columns of a file.
struct Table {
    names: Vec<String>,
    places: Places,
    separator: Separator,
}

impl TableReader<'_> {
    fn line(&mut self, line: &Line<'_>) -> Result<(), Problem> {
        if let Some(start) = &self.mapping.line_start
            && !line.text.trim_ascii_start().starts_with(start.as_bytes())
        {
            return Ok(());
        }
        let separator = *self.separator.get_or_insert_with(|| guess_separator(line.text));
        if self.table.is_none() {
            if self.is_header(line.text, separator) {
                self.headers.push(header(line.text, separator));
                return Ok(());
            }
            self.width = fields(line.text, separator).count();
            let names = join(&self.headers, self.width);
            let places = Places::find(self.mapping, &names)?;
            self.table = Some((Table { names, places, separator }, Collector::new(self.mapping)?));
        }
        match &mut self.table {
            Some((table, collector)) => table.row(line, self.width, collector),
            None => Ok(()),
        }
    }

    fn is_header(&self, line: &[u8], separator: Separator) -> bool {
        match (&self.mapping.line_start, self.mapping.header_lines) {
            (Some(_), _) => false,
            (None, Some(wanted)) => self.headers.len() < wanted,
            (None, None) => self.headers.len() < 2 && !is_data(line, separator),
        }
    }
}

impl Table {
    /// Reads one line of data; `width` is the number of fields of the first.
    fn row(&self, line: &Line<'_>, width: usize, collector: &mut Collector) -> Result<(), Problem> {
        let found: Vec<&[u8]> = fields(line.text, self.separator).collect();
        let wanted = self.places.iter().max().map_or(0, |place| place + 1);
        if !line.ended && found.len() < width {
            return Err(Problem::Truncated(format!(
                "the file ends in the middle of line {}, after {} samples",
                line.number,
                collector.len()
            )));
        }
        if found.len() < wanted {
            let (number, count) = (line.number, found.len());
            return Err(Problem::Malformed(format!("line {number} has {count} columns, expected {wanted} or more")));
        }
        let row = self.places.row(|place| {
            let field = found.get(place).copied().unwrap_or_default();
            let fail = |what: String| {
                let column = self.names.get(place).cloned().unwrap_or_else(|| (place + 1).to_string());
                Problem::Value { place: format!("line {}, column '{column}'", line.number), what }
            };
            match number(field) {
                Some(value) if value.is_finite() => Ok(value),
                _ if field.is_empty() => Err(fail("empty, expected a number".into())),
                _ => Err(fail(format!("'{}' is not a finite number", excerpt(field)))),
            }
        })?;
        collector.push(row, || format!("line {}", line.number))
    }
}

/// The beginning of a field, fit for a message.
fn excerpt(field: &[u8]) -> String {
    let text = String::from_utf8_lossy(field);
    let mut shown: String = text.chars().take(20).collect();
    if text.chars().nth(20).is_some() {
        shown.push('…');
    }
    shown
}

/// Which preset the beginning of a file fits. Whatever `mapping` says about lines is taken into account.
pub(super) fn recognise(head: &[u8], mapping: &Mapping) -> Result<Preset, Problem> {
    let lines = head.split(|&byte| byte == b'\n').map(|line| line.trim_ascii());
    let lines = lines.skip(mapping.skip_lines.unwrap_or(0)).filter(|line| !is_void(line, mapping));
    let first: Vec<&[u8]> = lines.take(20).collect();
    if first.iter().any(|line| line.starts_with(b"0x") && fields(line, Separator::Whitespace).count() >= 8) {
        return Ok(Preset::Openshoe250);
    }
    let separator =
        mapping.separator.unwrap_or_else(|| first.first().map_or(Separator::Whitespace, |line| guess_separator(line)));
    let headers: Vec<Vec<String>> =
        first.iter().take(2).take_while(|line| !is_data(line, separator)).map(|line| header(line, separator)).collect();
    if headers.is_empty() {
        let width = first.first().map_or(0, |line| fields(line, separator).count());
        return Err(Problem::Unrecognised(format!(
            "layout not recognised: {width} columns without names; name a profile ({}) or describe it in a FILE.toml",
            known()
        )));
    }
    let names = |lines: usize| join(&headers[..lines.min(headers.len())], 0);
    let fitting: Vec<Preset> = Preset::ALL
        .into_iter()
        .filter(|preset| preset.fits(&names(preset.mapping().header_lines.unwrap_or(1))))
        .collect();
    match fitting[..] {
        [preset] => Ok(preset),
        [] => Err(Problem::Unrecognised(format!(
            "layout not recognised from its columns ({}); name a profile ({}) or describe it in a FILE.toml",
            listed(&names(2)),
            known()
        ))),
        _ => Err(Problem::Unrecognised(format!(
            "fits more than one profile ({}); name one of them",
            fitting.iter().map(|preset| preset.name()).collect::<Vec<_>>().join(", ")
        ))),
    }
}
