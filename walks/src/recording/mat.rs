//! MATLAB v5 files: numeric variables as tables.
//!
//! A recording's variables have one row for each sample. A variable of one column is a column of the table under its own
//! name; those of several are called `NAME.1`, `NAME.2`, and so on.

use super::error::Problem;
use super::mapping::Mapping;
use super::profile::{Preset, known};
use super::table::{Collector, Places, listed};
use super::{Recording, RecordingError, complete, named};
use flate2::read::ZlibDecoder;
use matfile::{MatFile, NumericData};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// The first bytes of such a file.
pub(super) const MAGIC: &[u8] = b"MATLAB 5.0 MAT-file";
/// Those of the version after it, which is HDF5 inside.
pub(super) const MAGIC_OF_LATER: &[u8] = b"MATLAB 7.3 MAT-file";
/// Length of the text and the version at the start. **Units:** bytes.
const HEADER: usize = 128;
/// More columns in one variable are no table of a sensor.
const MOST_COLUMNS: usize = 64;
/// Length of an element's kind and length. **Units:** bytes.
const TAG: usize = 8;
/// No variable of a recording is larger. **Units:** bytes.
const MOST_INFLATED: u64 = 1 << 30;
/// Kinds of element that hold a variable: as it is, and compressed.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// A numeric variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Column after column.
    pub values: Vec<f64>,
}

impl Matrix {
    /// The value in a row and a column, both counted from 0.
    pub fn get(&self, row: usize, column: usize) -> Option<f64> {
        let inside = row < self.rows && column < self.columns;
        inside.then(|| self.values.get(column * self.rows + row).copied()).flatten()
    }
}

/// All numeric variables of two dimensions in the file at `path`, by name. A single row is given as a column.
pub fn variables(path: &Path) -> Result<BTreeMap<String, Matrix>, RecordingError> {
    let source = super::open_file(path)?;
    parse(source).map_err(|problem| RecordingError { path: path.into(), problem })
}

fn parse(mut source: impl Read) -> Result<BTreeMap<String, Matrix>, Problem> {
    let mut bytes = Vec::new();
    source.read_to_end(&mut bytes)?;
    if bytes.is_empty() {
        return Err(Problem::Empty);
    }
    if !bytes.starts_with(MAGIC) {
        return Err(Problem::Malformed("not a MATLAB v5 file".into()));
    }
    let bytes = inflated(&bytes)?;
    let file = MatFile::parse(bytes.as_slice())
        .map_err(|_| Problem::Malformed("damaged MATLAB file: a variable does not hold together".into()))?;
    Ok(file.arrays().iter().filter_map(|array| Some((array.name().to_owned(), matrix(array)?))).collect())
}

/// The same file with no variable compressed. The library is given nothing else, because it takes the first damaged
/// element for the end of the file and prints what is wrong with a compressed one.
fn inflated(bytes: &[u8]) -> Result<Vec<u8>, Problem> {
    let (header, mut rest) = bytes
        .split_at_checked(HEADER)
        .ok_or_else(|| Problem::Truncated("the MATLAB file ends in its header".into()))?;
    let word: fn([u8; 4]) -> u32 = match header {
        [.., b'I', b'M'] => u32::from_le_bytes,
        [.., b'M', b'I'] => u32::from_be_bytes,
        _ => return Err(Problem::Malformed("damaged MATLAB file: no byte order in its header".into())),
    };
    let mut out = header.to_vec();
    let mut number = 0;
    while !rest.is_empty() {
        number += 1;
        let cut = || Problem::Truncated(format!("the MATLAB file ends in the middle of variable {number}"));
        let strange = |kind| Problem::Malformed(format!("damaged MATLAB file: variable {number} is of kind {kind}"));
        let (kind, length) = tag(rest, word).ok_or_else(cut)?;
        let element = rest.get(..TAG + length).ok_or_else(cut)?;
        match kind {
            MATRIX => out.extend(element),
            COMPRESSED => {
                let start = out.len();
                let mut decoder = ZlibDecoder::new(&element[TAG..]).take(MOST_INFLATED);
                decoder.read_to_end(&mut out).map_err(|error| {
                    Problem::Malformed(format!(
                        "damaged MATLAB file: variable {number} cannot be decompressed ({error})"
                    ))
                })?;
                match tag(&out[start..], word) {
                    Some((MATRIX, length)) if out.len() - start >= TAG + length => {}
                    Some((kind, _)) => return Err(strange(kind)),
                    None => return Err(strange(0)),
                }
            }
            other => return Err(strange(other)),
        }
        rest = &rest[TAG + length..];
    }
    Ok(out)
}

/// Kind and length of the element that begins here.
fn tag(bytes: &[u8], word: fn([u8; 4]) -> u32) -> Option<(u32, usize)> {
    let (kind, behind) = bytes.split_first_chunk()?;
    Some((word(*kind), word(*behind.first_chunk()?) as usize))
}

fn matrix(array: &matfile::Array) -> Option<Matrix> {
    let &[rows, columns] = array.size().as_slice() else { return None };
    let values = match array.data() {
        NumericData::Int8 { real, .. } => wide(real),
        NumericData::UInt8 { real, .. } => wide(real),
        NumericData::Int16 { real, .. } => wide(real),
        NumericData::UInt16 { real, .. } => wide(real),
        NumericData::Int32 { real, .. } => wide(real),
        NumericData::UInt32 { real, .. } => wide(real),
        NumericData::Single { real, .. } => wide(real),
        NumericData::Double { real, .. } => real.clone(),
        // Counts beyond 2^53 are no measurement.
        NumericData::Int64 { real, .. } => real.iter().map(|&value| value as f64).collect(),
        NumericData::UInt64 { real, .. } => real.iter().map(|&value| value as f64).collect(),
    };
    let (rows, columns) = if rows == 1 { (columns, 1) } else { (rows, columns) };
    (rows.checked_mul(columns) == Some(values.len())).then_some(Matrix { rows, columns, values })
}

fn wide<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
    values.iter().map(|&value| value.into()).collect()
}

/// Reads a recording whose variables `mapping` names.
pub(super) fn read(source: impl Read, mapping: Mapping) -> Result<Recording, Problem> {
    let variables = parse(source)?;
    let mut names = Vec::new();
    let mut columns = Vec::new();
    for (name, matrix) in variables.iter().filter(|(_, matrix)| matrix.columns <= MOST_COLUMNS) {
        for column in 0..matrix.columns {
            names.push(if matrix.columns == 1 { name.clone() } else { format!("{name}.{}", column + 1) });
            columns.push((matrix, column));
        }
    }
    let mapping = complete(mapping, |_| match Preset::KorogluMat.fits(&names) {
        true => Ok(Preset::KorogluMat),
        false => Err(Problem::Unrecognised(format!(
            "layout not recognised from its variables ({}); name a profile ({}) or describe it in a FILE.toml",
            listed(&names),
            known()
        ))),
    })?;
    let places = Places::find(&mapping, &names)?;
    let lengths: Vec<(usize, usize)> =
        places.iter().filter_map(|place| Some((place, columns.get(place)?.0.rows))).collect();
    let rows = lengths.first().map_or(0, |&(_, rows)| rows);
    if let Some(&(place, other)) = lengths.iter().find(|&&(_, other)| other != rows) {
        return Err(Problem::Malformed(format!("{} has {other} rows, other columns have {rows}", names[place])));
    }
    if rows == 0 {
        return Err(Problem::NoSamples("the variables are empty".into()));
    }
    let mut collector = Collector::new(&mapping)?;
    for index in 0..rows {
        let place_of = |column: usize| format!("row {}, {}", index + 1, names[column]);
        let row = places.row(|place| match columns[place].0.get(index, columns[place].1) {
            Some(value) if value.is_finite() => Ok(value),
            other => Err(Problem::Value {
                place: place_of(place),
                what: format!("{} is not a finite number", other.unwrap_or(f64::NAN)),
            }),
        })?;
        collector.push(row, || format!("row {}", index + 1))?;
    }
    collector.finish().map(|recording| named(recording, &mapping))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::recording;
    use std::io::Write;

    /// One uncompressed variable of doubles.
    fn variable(name: &str, rows: usize, values: &[f64]) -> Vec<u8> {
        let element = |kind: u32, data: &[u8]| {
            let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
            bytes.extend(data);
            bytes.resize(bytes.len().next_multiple_of(8), 0);
            bytes
        };
        let words = |words: [u32; 2]| words.map(u32::to_le_bytes).concat();
        let columns = values.len() / rows.max(1);
        let numbers: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let body = [
            element(6, &words([6, 0])),
            element(5, &words([rows as u32, columns as u32])),
            element(1, name.as_bytes()),
            element(9, &numbers),
        ];
        element(MATRIX, &body.concat())
    }

    fn file(variables: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.resize(HEADER - 4, b' ');
        bytes.extend(b"\x00\x01IM");
        bytes.extend(variables.concat());
        bytes
    }

    /// A foot at rest for `rows` samples.
    pub fn walk(rows: usize) -> Vec<u8> {
        let times: Vec<f64> = (0..rows).map(|row| row as f64 * 0.005).collect();
        let data: Vec<f64> = [0.0, 0.0, 9.81, 0.01, 0.0, 0.0].iter().flat_map(|&value| vec![value; rows]).collect();
        file(&[variable("timestamps", rows, &times), variable("imu_data", rows, &data)])
    }

    /// The same variable as MATLAB writes it by default.
    fn compressed(variable: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(variable).unwrap();
        let data = encoder.finish().unwrap();
        [&COMPRESSED.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), &data].concat()
    }

    fn read(bytes: &[u8]) -> Result<Recording, String> {
        recording::read("walk.mat".as_ref(), bytes, None).map_err(|error| error.to_string())
    }

    #[test]
    fn a_file_is_read() {
        let walk = read(&walk(30)).unwrap();
        assert_eq!(walk.samples.len(), 30);
        assert_eq!((walk.samples[7].time.0, walk.samples[7].accel.0.z, walk.samples[7].gyro.0.x), (35_000, 9.81, 0.01));
    }

    #[test]
    fn compressed_variables_are_read_and_their_damage_is_noticed() {
        let plain = walk(30);
        let split = HEADER + variable("timestamps", 30, &[0.0; 30]).len();
        let file = file(&[compressed(&plain[HEADER..split]), compressed(&plain[split..])]);
        assert!(file.len() < plain.len());
        assert_eq!(read(&file).unwrap().samples, read(&plain).unwrap().samples);
        // Behind the header and the first tag every byte is under zlib's checksum or is a length.
        for at in HEADER..file.len() {
            let mut damaged = file.clone();
            damaged[at] ^= 0x11;
            let message = read(&damaged).unwrap_err();
            assert!(["damaged", "truncated"].iter().any(|word| message.contains(word)), "{at}: {message}");
        }
        let nested = super::tests::file(&[compressed(&compressed(&plain[HEADER..split]))]);
        assert!(read(&nested).unwrap_err().ends_with("damaged MATLAB file: variable 1 is of kind 15"));
    }

    #[test]
    fn every_cut_is_noticed() {
        let whole = walk(10);
        let first = HEADER + variable("timestamps", 10, &[0.0; 10]).len();
        for length in MAGIC.len()..whole.len() {
            let message = read(&whole[..length]).unwrap_err();
            match length {
                // Exactly between two variables, or before the first, nothing is cut but something is missing.
                _ if length == HEADER || length == first => assert!(message.contains("not recognised"), "{message}"),
                _ => {
                    assert!(message.starts_with("walk.mat: truncated: the MATLAB file ends in "), "{length}: {message}")
                }
            }
        }
    }

    #[test]
    fn faults_are_told() {
        let times = variable("timestamps", 2, &[0.0, 0.005]);
        let data = |rows: usize, value: f64| variable("imu_data", rows, &vec![value; rows * 6]);
        let cases = [
            (file(&[times.clone(), data(2, f64::NAN)]), "row 1, imu_data.1: NaN is not a finite number"),
            (file(&[times.clone(), data(3, 1.0)]), "rows, other columns have "),
            (file(std::slice::from_ref(&times)), "not recognised from its variables ('timestamps')"),
            (file(&[]), "not recognised from its variables ()"),
            (file(&[variable("timestamps", 2, &[5.0, 1.0]), data(2, 1.0)]), "row 2: time runs backwards by 4.000 s"),
        ];
        for (bytes, expected) in cases {
            let message = read(&bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
