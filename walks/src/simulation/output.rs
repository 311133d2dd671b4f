//! Writes a simulated walk to a file, a moment at a time.

use super::scenario::Scenario;
use super::{Error, Moment, Simulation};
use crate::recording::mcap::Writer;
use crate::recording::{RecordingError, SensorRange};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Samples.
    pub samples: u64,
    /// Stances, the first and the last included.
    pub stances: u64,
    /// Length over the floor from stance to stance. **Units:** m.
    pub distance: f64,
    /// Samples with an axis of the accelerometer or the gyroscope at the end of its range.
    pub clipped: u64,
    /// Time of the last sample. **Units:** s.
    pub seconds: f64,
    last: Option<[f64; 3]>,
}

impl Summary {
    fn add(&mut self, moment: &Moment) {
        self.samples += 1;
        self.clipped += u64::from(moment.sample.clipped.accel || moment.sample.clipped.gyro);
        self.seconds = moment.truth.time.as_seconds();
        if let Some(stance) = &moment.stance {
            self.stances += 1;
            if let Some([x, y, _]) = self.last.replace(stance.position) {
                self.distance += libm::hypot(stance.position[0] - x, stance.position[1] - y);
            }
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { samples, stances, distance, clipped, seconds, .. } = self;
        let strides = stances.saturating_sub(1);
        write!(out, "{seconds:.1} s, {samples} samples ({clipped} clipped), {strides} strides, {distance:.1} m")
    }
}

/// Why a walk was not written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The scenario is refused.
    #[error(transparent)]
    Scenario(#[from] Error),
    /// The file's name says nothing of its format.
    #[error("{}: a name that ends in .mcap or .csv was expected", .0.display())]
    Format(PathBuf),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The table cannot be written.
    #[error("{}: {source}", path.display())]
    Table {
        /// Which.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// Simulates `scenario` and writes it to `path`, as a recording or a table by its extension, with the true pose of every
/// `thinning`th sample. A file that was there before is replaced when all is written. `progress` is told the seconds
/// simulated so far.
pub fn write(
    scenario: &Scenario,
    path: &Path,
    thinning: u32,
    progress: impl FnMut(u64),
) -> Result<Summary, WriteError> {
    let simulation = Simulation::new(scenario)?;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    match extension.to_ascii_lowercase().as_str() {
        "mcap" => {
            let range = SensorRange {
                accel: Some(scenario.sensor.accel.range as f32),
                gyro: Some(scenario.sensor.gyro.range as f32),
            };
            let mut about = BTreeMap::from([("origin".to_owned(), "simulated".to_owned())]);
            // A scenario that has been checked can be written.
            about.extend(toml::to_string(scenario).ok().map(|text| ("scenario".to_owned(), text)));
            about.extend(scenario.route.building.iter().map(|name| ("building".to_owned(), name.clone())));
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let mut writer = Writer::create(path, &name, range, &about)?;
            let summary = recording(simulation, &mut writer, thinning, progress)?;
            writer.finish()?;
            Ok(summary)
        }
        "csv" => replace(path, |file| table(simulation, file, thinning, progress))
            .map_err(|source| WriteError::Table { path: path.to_owned(), source }),
        _ => Err(WriteError::Format(path.to_owned())),
    }
}

/// Lets `write` fill a file beside `path` and puts it in its place.
fn replace<T>(path: &Path, write: impl FnOnce(BufWriter<File>) -> std::io::Result<T>) -> std::io::Result<T> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let written = File::create(&part).and_then(|file| write(BufWriter::new(file)));
    let done = written.and_then(|done| std::fs::rename(&part, path).map(|()| done));
    if done.is_err() {
        // What is half written is of no use; the first error is the one to tell.
        let _ = std::fs::remove_file(&part);
    }
    done
}

/// Hands every moment on, with its number, and tells the seconds.
fn each<E>(
    moments: impl Iterator<Item = Moment>,
    mut progress: impl FnMut(u64),
    mut take: impl FnMut(u64, &Moment) -> Result<(), E>,
) -> Result<Summary, E> {
    let mut summary = Summary::default();
    let mut second = 0;
    for moment in moments {
        take(summary.samples, &moment)?;
        summary.add(&moment);
        let now = summary.seconds as u64;
        if now > second {
            second = now;
            progress(second);
        }
    }
    Ok(summary)
}

fn recording(
    moments: impl Iterator<Item = Moment>,
    writer: &mut Writer,
    thinning: u32,
    progress: impl FnMut(u64),
) -> Result<Summary, RecordingError> {
    each(moments, progress, |index, moment| {
        writer.sample(&moment.sample)?;
        if index % u64::from(thinning.max(1)) == 0 {
            writer.pose(&moment.truth)?;
        }
        moment.stance.as_ref().map_or(Ok(()), |stance| writer.stance(stance))
    })
}

/// Columns of the table. The first seven are those by which a recording is recognised, in the sensor's frame; position,
/// velocity and attitude (w, x, y, z; sensor to world) are the truth.
const HEADER: &str = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,clipped,stance,step,\
                      true_x,true_y,true_z,true_vx,true_vy,true_vz,true_qw,true_qx,true_qy,true_qz";

fn table(
    moments: impl Iterator<Item = Moment>,
    mut out: impl Write,
    thinning: u32,
    progress: impl FnMut(u64),
) -> std::io::Result<Summary> {
    writeln!(out, "{HEADER}")?;
    let summary = each(moments, progress, |index, Moment { sample, truth, step, .. }| {
        let micros = sample.time.0;
        write!(out, "{}.{:06}", micros / 1_000_000, micros % 1_000_000)?;
        for value in sample.accel.0.iter().chain(sample.gyro.0.iter()) {
            write!(out, ",{value:.6}")?;
        }
        let clipped = sample.clipped.accel || sample.clipped.gyro;
        write!(out, ",{},{},{step}", u8::from(clipped), u8::from(truth.stance))?;
        if index % u64::from(thinning.max(1)) == 0 {
            for value in truth.position.iter().chain(&truth.velocity) {
                write!(out, ",{value:.6}")?;
            }
            for value in truth.attitude {
                write!(out, ",{value:.9}")?;
            }
            writeln!(out)
        } else {
            writeln!(out, ",,,,,,,,,,")
        }
    })?;
    out.flush()?;
    Ok(summary)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording;

    fn scenario() -> Scenario {
        Scenario { duration: Some(9.0), ..Scenario::endless(11) }
    }

    #[test]
    fn a_recording_comes_back_with_samples_and_truth() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.mcap");
        let mut seconds = Vec::new();
        let summary = write(&scenario(), &path, 1, |second| seconds.push(second)).unwrap();
        assert_eq!(seconds, (1..9).collect::<Vec<u64>>());
        let back = recording::open(&path, None).unwrap();
        let moments: Vec<Moment> = Simulation::new(&scenario()).unwrap().collect();
        assert_eq!(back.samples, moments.iter().map(|moment| moment.sample).collect::<Vec<_>>());
        let truth = back.truth.unwrap();
        assert_eq!(truth.poses, moments.iter().map(|moment| moment.truth).collect::<Vec<_>>());
        assert_eq!(truth.stances, moments.iter().filter_map(|moment| moment.stance).collect::<Vec<_>>());
        assert_eq!(truth.stances.len() as u64, summary.stances);
        assert_eq!(Scenario::from_toml(&back.metadata["scenario"]).unwrap(), scenario());
    }

    #[test]
    fn a_table_can_be_read_as_a_recording() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.CSV");
        let summary = write(&scenario(), &path, 10, |_| {}).unwrap();
        let back = recording::open(&path, None).unwrap();
        assert_eq!(back.samples.len() as u64, summary.samples);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.lines().all(|line| line.split(',').count() == 20));
    }

    #[test]
    fn nothing_is_left_of_what_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let told = |path: &Path| write(&scenario(), path, 1, |_| {}).unwrap_err().to_string();
        assert!(told(&folder.path().join("walk.txt")).contains("ends in .mcap or .csv"));
        assert!(told(&folder.path().join("none/walk.csv")).contains("walk.csv"));
        std::fs::create_dir(folder.path().join("taken.csv")).unwrap();
        told(&folder.path().join("taken.csv"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
