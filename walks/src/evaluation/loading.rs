//! From an entry of a manifest to its samples and its [`Truth`] in the clock of the samples.

use super::manifest::{Entry, Manifest};
use super::source::{Instants, Layout, Mirrored, Paths, PointsSource, StillSource, StridesSource};
use super::table::{Table, TableError};
use super::truth::{KnownStride, Reference, Surveyed, Truth};
use crate::calibration::{self, CalibrationFileError};
use crate::recording::mapping::Column;
use crate::recording::unit::TimeUnit;
use crate::recording::{self, ProfileError, Recording, RecordingError, SimulatedTruth};
use crate::simulation::{self, Scenario, Simulation};
use sohle_shared::time::Micros;
use std::path::PathBuf;
use thiserror::Error;

/// Why an entry cannot be scored.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file with the samples is not there.
    #[error("{}: no such file", path.display())]
    Absent {
        /// As the manifest has it.
        path: PathBuf,
    },
    /// The samples cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The profile cannot be used.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// The file of the sensor's calibration is not there.
    #[error("calibration {}: no such file", path.display())]
    Uncalibrated {
        /// As the manifest has it.
        path: PathBuf,
    },
    /// The calibration cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationFileError),
    /// The walk cannot be simulated.
    #[error("simulate: {0}")]
    Simulation(String),
    /// The file is not there.
    #[error("truth {}: no such file", path.display())]
    Missing {
        /// As the manifest has it.
        path: PathBuf,
    },
    /// The file cannot be used.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The recording brings no truth of its own.
    #[error("truth.simulated: the recording carries no truth of its own; only simulated walks do")]
    NotSimulated,
}

/// Instants may lie so far beyond the samples before a truth is taken for that of another recording: rounding and the
/// last period of a slow reference. **Units:** microseconds.
const OVERHANG_US: i64 = 100_000;

/// One true pose of a simulated walk is kept for so many samples: a hundred in a second.
const THINNING: usize = 20;

/// Reads or simulates the samples of `entry`, and corrects them if the sensor was calibrated.
pub fn samples(manifest: &Manifest, entry: &Entry) -> Result<Recording, LoadError> {
    let mut recording = if let Some(source) = &entry.simulate {
        let scenario = manifest.scenario(source).map_err(LoadError::Simulation)?;
        simulated(&scenario).map_err(|error| LoadError::Simulation(error.to_string()))?
    } else {
        let named = entry.path.clone().unwrap_or_default();
        let path = manifest.locate(&named).ok_or(LoadError::Absent { path: named })?;
        recording::open(&path, Some(&manifest.profile(entry)?))?
    };
    if let Some(named) = &entry.calibration {
        let path = manifest.locate(named).ok_or_else(|| LoadError::Uncalibrated { path: named.clone() })?;
        let calibration = calibration::read(&path)?;
        for sample in &mut recording.samples {
            *sample = calibration.apply(sample, None);
        }
    }
    Ok(recording)
}

/// The walk of `scenario` as a recording with its truth.
fn simulated(scenario: &Scenario) -> Result<Recording, simulation::Error> {
    let mut recording = Recording::default();
    let mut truth = SimulatedTruth::default();
    for (index, moment) in Simulation::new(scenario)?.enumerate() {
        recording.samples.push(moment.sample);
        truth.stances.extend(moment.stance);
        if index % THINNING == 0 || moment.stance.is_some() {
            truth.poses.push(moment.truth);
        }
    }
    recording.truth = Some(truth);
    Ok(recording)
}

/// Reads what is known of `entry`, whose samples are `recording`.
pub fn truth(manifest: &Manifest, entry: &Entry, recording: &Recording) -> Result<Truth, LoadError> {
    let source = &entry.truth;
    let open = |paths: &Paths, layout: &Layout| open(manifest, paths, layout);
    let mut truth = Truth {
        closed_loop: source.closed_loop,
        stride_count: source.stride_count,
        height_change: source.height_change_m,
        height_reported: source.same_height_as.is_some(),
        ..Truth::default()
    };
    if let Some(source) = &source.positions {
        truth.positions = Some(positions(&open(&source.path, &source.layout)?, source, recording)?);
    }
    if let Some(source) = &source.track {
        truth.track = Some(track(&open(&source.path, &source.layout)?, source, recording)?);
    }
    if let Some(source) = &source.strides {
        let table = open(&source.path, &source.layout)?;
        truth.strides = Some(strides(&table, source, recording, truth.track.as_ref())?);
    }
    if let Some(source) = &source.still {
        truth.still = Some(still(&open(&source.path, &source.layout)?, source, recording)?);
    }
    if source.simulated || entry.simulate.is_some() {
        let simulated = Truth::from(recording.truth.as_ref().ok_or(LoadError::NotSimulated)?);
        truth.stances = simulated.stances;
        truth.track = simulated.track;
        truth.height_change = truth.height_change.or(simulated.height_change);
    }
    Ok(truth)
}

fn open(manifest: &Manifest, paths: &Paths, layout: &Layout) -> Result<Table, LoadError> {
    let paths = match paths {
        Paths::One(path) => std::slice::from_ref(path),
        Paths::Any(paths) => paths.as_slice(),
    };
    let found = paths.iter().find_map(|path| manifest.locate(path));
    let path = found.ok_or_else(|| LoadError::Missing { path: paths.first().cloned().unwrap_or_default() })?;
    Ok(Table::read(&path, layout)?)
}

/// The instants of `lines` lines, in order of time.
fn instants(table: &Table, at: &Instants, lines: usize, recording: &Recording) -> Result<Vec<Micros>, TableError> {
    let samples = &recording.samples;
    let start = samples.first().map_or(Micros(0), |sample| sample.time);
    let offset = Micros::from_seconds(at.offset_s).0;
    let times: Vec<Micros> = if let Some(column) = &at.index {
        let time = |index: f64| {
            let place = index - at.first_index as f64;
            let sample = (place >= 0.0 && place.fract() == 0.0).then(|| samples.get(place as usize)).flatten();
            sample.map(|sample| sample.time).ok_or_else(|| {
                table.error(format!(
                    "column {column}: {index} is no sample of the recording, which has {} to {}",
                    at.first_index,
                    (at.first_index + samples.len()).saturating_sub(1)
                ))
            })
        };
        table.numbers(column)?.into_iter().map(time).collect::<Result<_, _>>()?
    } else if let Some(column) = &at.time {
        let factor = at.time_unit.unwrap_or(TimeUnit::Second).factor();
        table.numbers(column)?.into_iter().map(|time| Micros::from_seconds(time * factor)).collect()
    } else {
        let period = at.rate_hz.map_or(0.0, |rate| 1.0 / rate);
        (0..lines).map(|line| start + Micros::from_seconds(line as f64 * period).0).collect()
    };
    if let Some(pair) = times.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(table.error(format!(
            "time runs backwards from {:.3} s to {:.3} s",
            pair[0].as_seconds(),
            pair[1].as_seconds()
        )));
    }
    Ok(times.into_iter().map(|time| time + offset).collect())
}

/// Positions in metres and right-handed, with their times.
fn points(table: &Table, source: &PointsSource, recording: &Recording) -> Result<Vec<(Micros, [f64; 2])>, TableError> {
    let factor = |axis| if source.mirrored == axis { -source.unit.factor() } else { source.unit.factor() };
    let (xs, ys) = (table.numbers(&source.x)?, table.numbers(&source.y)?);
    let times = instants(table, &source.at, xs.len(), recording)?;
    if xs.len() != ys.len() || times.len() != xs.len() {
        return Err(table.error(format!("{} times, {} x and {} y", times.len(), xs.len(), ys.len())));
    }
    let (fx, fy) = (factor(Mirrored::X), factor(Mirrored::Y));
    Ok(times.into_iter().zip(xs.iter().zip(&ys)).map(|(time, (x, y))| (time, [fx * x, fy * y])).collect())
}

fn positions(table: &Table, source: &PointsSource, recording: &Recording) -> Result<Vec<Surveyed>, TableError> {
    let points = points(table, source, recording)?;
    within(table, points.iter().map(|point| point.0), recording)?;
    Ok(points.into_iter().map(|(time, position)| Surveyed { time, position }).collect())
}

fn track(table: &Table, source: &PointsSource, recording: &Recording) -> Result<Reference, TableError> {
    let points = points(table, source, recording)?;
    let (from, until) = span(recording);
    let search = Micros::from_seconds(source.clock_search_s.unwrap_or(0.0)).0;
    if !points.iter().any(|point| point.0 + search >= from && point.0 + -search <= until) {
        return Err(table.error(format!(
            "no line lies within the recording, {:.3} s to {:.3} s",
            from.as_seconds(),
            until.as_seconds()
        )));
    }
    Ok(Reference { points, clock_search: source.clock_search_s })
}

fn strides(
    table: &Table,
    source: &StridesSource,
    recording: &Recording,
    track: Option<&Reference>,
) -> Result<Vec<KnownStride>, TableError> {
    let factor = source.time_unit.unwrap_or(TimeUnit::Second).factor();
    let times = |column: &Column| -> Result<Vec<Micros>, TableError> {
        Ok(table.numbers(column)?.into_iter().map(|time| Micros::from_seconds(time * factor)).collect())
    };
    let (starts, ends) = (times(&source.start)?, times(&source.end)?);
    let lengths = source.length.as_ref().map(|column| table.numbers(column)).transpose()?;
    let mut keep = vec![true; starts.len()];
    for (column, wanted) in &source.only {
        let values = table.texts(&Column::Name(column.clone()))?;
        for (keep, value) in keep.iter_mut().zip(values) {
            *keep &= value == *wanted;
        }
    }
    let mut strides = Vec::new();
    for (line, (&start, &end)) in starts.iter().zip(&ends).enumerate() {
        if !keep[line] {
            continue;
        }
        if end <= start {
            return Err(table.error(format!("a stride ends at {:.3} s, where it starts", end.as_seconds())));
        }
        let length = match (&lengths, track) {
            (Some(lengths), _) => lengths[line] * source.unit.factor(),
            (None, Some(track)) => {
                let at = |time: Micros| {
                    track
                        .at(time)
                        .ok_or_else(|| table.error(format!("the track has no position at {:.3} s", time.as_seconds())))
                };
                crate::alignment::distance(at(start)?, at(end)?)
            }
            (None, None) => return Err(table.error("no lengths")),
        };
        strides.push(KnownStride { start, end, length });
    }
    if strides.is_empty() {
        return Err(table.error("no line fits 'where'"));
    }
    within(table, strides.iter().flat_map(|stride| [stride.start, stride.end]), recording)?;
    Ok(strides)
}

fn still(table: &Table, source: &StillSource, recording: &Recording) -> Result<Vec<(Micros, bool)>, TableError> {
    let labels = table.numbers(&source.label)?;
    let times = instants(table, &source.at, labels.len(), recording)?;
    within(table, times.iter().copied(), recording)?;
    Ok(times.into_iter().zip(labels).map(|(time, label)| (time, label != 0.0)).collect())
}

/// First and last sample.
fn span(recording: &Recording) -> (Micros, Micros) {
    let time = |sample: Option<&sohle_shared::sample::ImuSample>| sample.map_or(Micros(0), |sample| sample.time);
    (time(recording.samples.first()), time(recording.samples.last()))
}

/// Refuses a truth that goes beyond the recording.
fn within(table: &Table, times: impl Iterator<Item = Micros>, recording: &Recording) -> Result<(), TableError> {
    let (from, until) = span(recording);
    for time in times {
        if time < from + -OVERHANG_US || time > until + OVERHANG_US {
            return Err(table.error(format!(
                "an instant at {:.3} s lies outside of the recording, {:.3} s to {:.3} s",
                time.as_seconds(),
                from.as_seconds(),
                until.as_seconds()
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alignment::path_length;
    use std::path::Path;

    /// The truth of a recording of the project's manifest; `None` where the recordings are absent.
    fn truth(name: &str) -> Option<(Truth, Recording)> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/recordings.toml");
        let manifest = Manifest::read(&path).unwrap();
        let entry = manifest.recordings.iter().find(|entry| entry.name == name).unwrap();
        manifest.locate(entry.path.as_ref()?)?;
        let recording = samples(&manifest, entry).unwrap();
        Some((super::truth(&manifest, entry, &recording).unwrap(), recording))
    }

    #[test]
    fn samples_of_a_calibrated_sensor_are_corrected() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        put("still.toml", "duration = 0.1\n");
        put("unit.toml", "[accel]\nbias = [0.5, 0.0, 0.0]\n");
        put("bad.toml", "[accel]\nbias = 0.5\n");
        let entry = |calibration: &str| {
            format!(
                "[[recording]]\nname = \"{calibration}\"\nsimulate = {{ scenario = \"still.toml\" }}\n{calibration}\n"
            )
        };
        let keys = ["", "calibration = 'unit.toml'", "calibration = 'none.toml'", "calibration = 'bad.toml'"];
        put("manifest.toml", &keys.map(entry).concat().replace("name = \"\"", "name = \"raw\""));
        let manifest = Manifest::read(&folder.path().join("manifest.toml")).unwrap();
        let [raw, corrected, missing, bad] = [0, 1, 2, 3].map(|index| samples(&manifest, &manifest.recordings[index]));
        let (raw, corrected) = (raw.unwrap().samples, corrected.unwrap().samples);
        assert_eq!(raw[0].accel.0 - corrected[0].accel.0, nalgebra::Vector3::new(0.5, 0.0, 0.0));
        assert_eq!(missing.unwrap_err().to_string(), "calibration none.toml: no such file");
        assert!(bad.unwrap_err().to_string().contains("bad.toml, line 2: "));
    }

    #[test]
    fn a_survey_in_a_matlab_file() {
        let Some((truth, recording)) = truth("surveyed-31") else { return };
        let positions = truth.positions.unwrap();
        let points: Vec<[f64; 2]> = positions.iter().map(|point| point.position).collect();
        assert_eq!(positions.len(), 34);
        // As in the table that comes with the recordings: sample 427, counted from 0, and the way of the survey.
        assert_eq!(positions[0].time, recording.samples[427].time);
        assert!((points[1][0] - 0.652).abs() < 1e-9 && (points[1][1] - 0.018).abs() < 1e-9);
        assert!((path_length(&points) - 47.855).abs() < 1e-3);
    }

    #[test]
    fn motion_capture_whose_y_axis_is_mirrored() {
        let Some((truth, recording)) = truth("ucr-left") else { return };
        let track = truth.track.unwrap();
        assert_eq!(track.points.len(), recording.samples.len());
        assert_eq!(track.points[0].1, [0.005_594_73, 0.305_050_598]);
        assert_eq!(truth.still.unwrap().len(), 7201);
    }

    /// The data set brings the way of the heel stride by stride in a file of its own, measured from the start of each
    /// stride: its last lines have to be the strides that we measure in the motion capture.
    #[test]
    fn strides_measured_in_the_motion_capture_are_those_of_the_data_set() {
        for (name, sensor, count) in [("gaitmap-left", "left_sensor", 28), ("gaitmap-right", "right_sensor", 29)] {
            let Some((truth, _)) = truth(name) else { return };
            let strides = truth.strides.unwrap();
            let file = recording::recordings_dir().unwrap().join("foot_gaitmap/position_sample.csv");
            let table = Table::read(&file, &Layout::default()).unwrap();
            let column = |name: &str| table.numbers(&Column::Name(name.into())).unwrap();
            let sensors = table.texts(&Column::Number(1)).unwrap();
            let (ids, xs, ys) = (column("s_id"), column("pos_x"), column("pos_y"));
            let last = |line: &usize| sensors[*line] == sensor && ids.get(line + 1) != Some(&ids[*line]);
            let lengths: Vec<f64> = (0..ids.len()).filter(last).map(|line| libm::hypot(xs[line], ys[line])).collect();
            assert_eq!((strides.len(), lengths.len()), (count, count));
            for (stride, length) in strides.iter().zip(lengths) {
                // The file is sampled at 100 Hz: its last line lies up to half a sample from the end of the stride.
                assert!((stride.length - length).abs() < 1e-3, "{} {length}", stride.length);
            }
        }
    }
}
