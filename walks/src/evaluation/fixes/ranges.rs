//! Ranges of UWB as they were recorded at surveyed points: how far they are off, and what places come of them.
//!
//! The offset and the scale are a median and a median deviation, which a heavy tail does not move. Ranges of one anchor at one
//! point are all off by nearly the same: their own scale is far smaller than that from pair to pair, so that many of them are
//! hardly better than one.

use crate::evaluation::building::suite::Errors;
use crate::fixes::{Measured, Method, Observation, Outliers, Smoother, Start, smoother};
use crate::recording::recordings_dir;
use sohle_shared::time::Micros;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where they are in the folder of recordings.
const FOLDER: &str = "ranging_hymn";
/// From a median deviation to a standard deviation, of what is normal.
const NORMAL: f64 = 1.4826;
/// What is farther off than so many scales is the tail.
const TAIL: f64 = 3.0;
/// Rounds of ranges at each point that are made to a place, the first ones.
const ROUNDS: usize = 5;
/// Why there are none.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The folder is not there.
    #[error("the recorded ranges are not there: set SOHLE_RECORDINGS to the folder that holds {FOLDER}")]
    Absent,
    /// A file cannot be read.
    #[error("{}: {what}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        what: String,
    },
}

/// A range, and what is known of it. **Units:** m.
#[derive(Clone, Debug, PartialEq)]
struct Range {
    anchor: String,
    metres: f64,
    /// The true one.
    truth: f64,
    /// From the point to the anchor.
    way: [f64; 3],
}

/// Ranges of one moment to several anchors.
#[derive(Clone, Debug, PartialEq)]
struct Round {
    point: String,
    ranges: Vec<Range>,
}

/// How far ranges are off. **Units:** m, unless the name says otherwise.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// Of which.
    pub of: String,
    /// How many.
    pub count: usize,
    /// Median.
    pub offset_m: f64,
    /// Standard deviation of what is normal of them.
    pub scale_m: f64,
    /// Share that is more than three of those from the median. **Units:** %.
    pub tail_percent: f64,
    /// Half of the tail is farther from the median than this.
    pub tail_m: f64,
}

impl Row {
    fn of(of: impl Into<String>, mut off: Vec<f64>) -> Self {
        let count = off.len();
        let offset_m = median(&mut off);
        let mut deviations: Vec<_> = off.iter().map(|off| (off - offset_m).abs()).collect();
        let scale_m = NORMAL * median(&mut deviations);
        let mut tail: Vec<_> = deviations.into_iter().filter(|&deviation| deviation > TAIL * scale_m).collect();
        let tail_percent = 100.0 * tail.len() as f64 / count.max(1) as f64;
        Self { of: of.into(), count, offset_m, scale_m, tail_percent, tail_m: median(&mut tail) }
    }
}

/// Places that come of ranges.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Placed {
    /// How the ranges were believed.
    pub ranges: &'static str,
    /// How far the places are off.
    pub errors: Errors,
}

/// Median; 0 of nothing.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// The recorded ranges.
#[derive(Debug)]
pub struct Recorded {
    rounds: Vec<Round>,
}

impl Recorded {
    /// Reads them.
    ///
    /// # Errors
    /// When they are not there or are something else.
    pub fn read() -> Result<Self, Error> {
        let folder = recordings_dir().map(|home| home.join(FOLDER)).filter(|folder| folder.is_dir());
        Self::read_from(&folder.ok_or(Error::Absent)?)
    }

    fn read_from(folder: &Path) -> Result<Self, Error> {
        let path = folder.join("anchor_coordinates.csv");
        let mut anchors = BTreeMap::new();
        for_each(&path, ["point_id", "X_LOCAL", "Y_LOCAL", "Z_LOCAL"], |[name, place @ ..]| {
            anchors.insert(name.to_owned(), numbers(place)?);
            Some(())
        })?;
        let mut rounds = Vec::new();
        let path = folder.join("uwb.csv");
        let columns = ["point_id", "anchor_ids", "ranges", "X_LOCAL_UWB", "Y_LOCAL_UWB", "Z_LOCAL_UWB"];
        for_each(&path, columns, |[point, names, metres, place @ ..]| {
            let place = numbers(place)?;
            let mut ranges = Vec::new();
            for (name, metres) in list(names).zip(list(metres)) {
                let metres: f64 = metres.parse().ok()?;
                // Anchors that did not answer, and those whose place is not known.
                let Some(anchor) = anchors.get(name).filter(|_| metres.is_finite()) else { continue };
                let way: [f64; 3] = std::array::from_fn(|axis| anchor[axis] - place[axis]);
                let truth = way.iter().map(|value| value * value).sum::<f64>().sqrt();
                ranges.push(Range { anchor: name.to_owned(), metres, truth, way });
            }
            rounds.push(Round { point: point.to_owned(), ranges });
            Some(())
        })?;
        Ok(Self { rounds })
    }

    /// How far they are off: all together, for each anchor, from pair to pair of point and anchor, and within a pair.
    pub fn rows(&self) -> Vec<Row> {
        let mut anchors: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        let mut pairs: BTreeMap<(&str, &str), Vec<f64>> = BTreeMap::new();
        for round in &self.rounds {
            for range in &round.ranges {
                let off = range.metres - range.truth;
                anchors.entry(&range.anchor).or_default().push(off);
                pairs.entry((&round.point, &range.anchor)).or_default().push(off);
            }
        }
        let all = anchors.values().flatten().copied().collect();
        let medians: Vec<f64> = pairs.values_mut().map(|off| median(off)).collect();
        let within = pairs.values().zip(&medians).flat_map(|(off, median)| off.iter().map(move |off| off - median));
        let mut rows = vec![Row::of("all", all), Row::of("within a pair", within.collect())];
        rows.insert(1, Row::of("pairs of point and anchor", medians));
        rows.extend(anchors.into_iter().map(|(anchor, off)| Row::of(anchor, off)));
        rows
    }

    /// Places from the first rounds at each point, of ranges that are believed alike, and with the tail that ranges have.
    pub fn placed(&self) -> Vec<Placed> {
        let usual = smoother::Parameters::default();
        let blind = smoother::Parameters { outliers: Outliers { range_share: 0.0, ..usual.outliers }, ..usual };
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        let first = self.rounds.iter().filter(|round| {
            let count = seen.entry(&round.point).or_default();
            *count += 1;
            *count <= ROUNDS && round.ranges.len() >= 3
        });
        let first: Vec<&Round> = first.collect();
        let errors = |parameters: &smoother::Parameters| {
            Errors::of(first.iter().filter_map(|round| error(round, parameters)).collect())
        };
        vec![
            Placed { ranges: "all believed alike", errors: errors(&blind) },
            Placed { ranges: "with a tail", errors: errors(&usual) },
        ]
    }
}

/// How far the place that comes of a round is off.
fn error(round: &Round, parameters: &smoother::Parameters) -> Option<f64> {
    // What lies in the middle of the anchors is where nobody knows anything begins; the point must not be.
    let count = round.ranges.len() as f64;
    let middle = [0, 1].map(|axis| round.ranges.iter().map(|range| range.way[axis]).sum::<f64>() / count);
    let mut smoother = Smoother::new(parameters, &Start { place: None, direction: Some((0.0, 0.1)) });
    for range in &round.ranges {
        let [x, y, above_m] = range.way;
        let measured = Measured::usual_range([x - middle[0], y - middle[1]], above_m, range.metres);
        smoother.hear(&Observation { measured, ..Observation::position(Micros(0), [0.0; 2], 1.0) });
    }
    let place = smoother.estimate()?.place;
    Some((place[0] + middle[0]).hypot(place[1] + middle[1]))
}

/// Reads these columns of a table.
fn for_each<const N: usize>(
    path: &Path,
    columns: [&str; N],
    mut row: impl FnMut([&str; N]) -> Option<()>,
) -> Result<(), Error> {
    let failed = |what: String| Error::File { path: path.into(), what };
    let mut reader = csv::Reader::from_path(path).map_err(|error| failed(error.to_string()))?;
    let headers = reader.headers().map_err(|error| failed(error.to_string()))?.clone();
    let place = |name: &str| headers.iter().position(|header| header == name);
    let mut places = [0; N];
    for (at, name) in places.iter_mut().zip(columns) {
        *at = place(name).ok_or_else(|| failed(format!("there is no column {name}")))?;
    }
    for (index, record) in reader.records().enumerate() {
        let record = record.map_err(|error| failed(error.to_string()))?;
        let cells = places.map(|at| record.get(at).unwrap_or_default());
        row(cells).ok_or_else(|| failed(format!("row {}: expected numbers", index + 1)))?;
    }
    Ok(())
}

fn numbers(cells: [&str; 3]) -> Option<[f64; 3]> {
    let [x, y, z] = cells.map(|cell| cell.trim().parse().ok());
    Some([x?, y?, z?])
}

/// The entries of a list as Python writes it: in brackets, texts in quotes.
fn list(text: &str) -> impl Iterator<Item = &str> {
    let inside = text.trim().trim_start_matches('[').trim_end_matches(']');
    inside.split(',').map(|entry| entry.trim().trim_matches('\'')).filter(|entry| !entry.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tail_moves_neither_offset_nor_scale() {
        let mut off: Vec<f64> = (-50..=50).map(|i| 0.1 + 0.01 * f64::from(i)).collect();
        let clean = Row::of("clean", off.clone());
        assert!((clean.offset_m - 0.1).abs() < 1e-12 && (clean.scale_m - NORMAL * 0.25).abs() < 1e-9, "{clean:?}");
        off.extend([9.0; 5]);
        let tailed = Row::of("tailed", off);
        assert!((tailed.offset_m - 0.1).abs() < 0.04 && (tailed.scale_m - clean.scale_m).abs() < 0.05, "{tailed:?}");
        assert!((tailed.tail_percent - 100.0 * 5.0 / 106.0).abs() < 1e-9 && tailed.tail_m > 8.0, "{tailed:?}");
    }

    #[test]
    fn rounds_are_read_and_a_wild_range_does_not_move_the_place() {
        let folder = tempfile::tempdir().unwrap();
        let anchors =
            "point_id,E,X_LOCAL,Y_LOCAL,Z_LOCAL\nA,0,0,0,2\nB,0,20,0,2\nC,0,0,20,2\nD,0,20,20,2\nE,0,10,0,2\n";
        std::fs::write(folder.path().join("anchor_coordinates.csv"), anchors).unwrap();
        let range = |x: f64, y: f64| (x - 8.0_f64).hypot(y - 6.0).hypot(2.0);
        let metres = [range(0.0, 0.0), range(20.0, 0.0), range(0.0, 20.0), range(20.0, 20.0) + 15.0];
        let metres = metres.map(|metres| format!("{metres:.3}")).join(", ");
        let rounds = format!(
            "point_id,ts,anchor_ids,ranges,X_LOCAL_UWB,Y_LOCAL_UWB,Z_LOCAL_UWB\n\
             P,1,\"['A', 'B', 'C', 'D', 'E', 'X']\",\"[{metres}, nan, 3.0]\",8,6,0\n"
        );
        std::fs::write(folder.path().join("uwb.csv"), rounds).unwrap();
        let recorded = Recorded::read_from(folder.path()).unwrap();
        assert_eq!(recorded.rounds[0].ranges.len(), 4);
        assert_eq!((recorded.rows()[0].count, recorded.rows().len()), (4, 7));
        let [alike, tailed] = [0, 1].map(|index| recorded.placed()[index].errors.mean_m);
        assert!(tailed < 0.3 && alike > 2.0, "{tailed} {alike}");
        std::fs::write(folder.path().join("uwb.csv"), "point_id,ts\nP,1\n").unwrap();
        let told = Recorded::read_from(folder.path()).unwrap_err().to_string();
        assert!(told.ends_with("there is no column anchor_ids"), "{told}");
    }
}
