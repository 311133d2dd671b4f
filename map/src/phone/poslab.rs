//! Reads phone walks as poslab (HafenCity University Hamburg) keeps them: a folder with a file for each sensor, columns
//! parted by spaces, one sample in each line of all files.

use super::sample::{PhoneRecording, PhoneSample, ReadError, WayPoint, milliseconds, number, text_of};
use nalgebra::Vector3;
use sohle_shared::time::Micros;
use std::path::Path;

/// Reads the walk `name` of a folder: `name_accel.csv`, `name_gyro.csv` and, where they are, `name_magnet.csv`,
/// `name_baro.csv`, `name_waypoints.csv` and `name_trajectory.csv`: positions as 5G would tell them. What the last says of
/// their error means nothing and is not read.
///
/// # Errors
/// When a file cannot be read, when a line is none, or when it has no samples.
pub fn read(folder: &Path, name: &str) -> Result<PhoneRecording, ReadError> {
    let path = |kind: &str| folder.join(format!("{name}_{kind}.csv"));
    let table = |kind: &str, columns: usize| rows(&text_of(&path(kind))?, &path(kind).display().to_string(), columns);
    let optional = |kind: &str, columns: usize| if path(kind).exists() { table(kind, columns) } else { Ok(Vec::new()) };
    let (accel, gyro) = (table("accel", 3)?, table("gyro", 3)?);
    let (magnet, pressure) = (optional("magnet", 3)?, optional("baro", 1)?);
    let places = |kind: &str| -> Result<Vec<WayPoint>, ReadError> {
        let place = |(time, row): &(Micros, Vec<f64>)| WayPoint { time: *time, place: [row[0], row[1]] };
        Ok(optional(kind, 2)?.iter().map(place).collect())
    };
    let vector = |row: &(Micros, Vec<f64>)| Vector3::new(row.1[0], row.1[1], row.1[2]);
    let mut rates = Latest::new(&gyro);
    let mut fields = Latest::new(&magnet);
    let mut pressures = Latest::new(&pressure);
    let samples: Vec<_> = accel
        .iter()
        .filter_map(|row| {
            let time = row.0;
            Some(PhoneSample {
                time,
                accel: vector(row),
                gyro: vector(rates.until(time)?),
                magnetic: fields.until(time).map(vector),
                pressure: pressures.until(time).map(|row| row.1[0]),
            })
        })
        .collect();
    if samples.is_empty() {
        let file = path("accel").display().to_string();
        return Err(ReadError::Empty { file, what: "accelerometer and gyroscope" });
    }
    Ok(PhoneRecording { samples, way_points: places("waypoints")?, positions: places("trajectory")? })
}

/// The last row that is not later than a moment; moments have to come in order.
struct Latest<'a> {
    rows: &'a [(Micros, Vec<f64>)],
    next: usize,
}

impl<'a> Latest<'a> {
    fn new(rows: &'a [(Micros, Vec<f64>)]) -> Self {
        Self { rows, next: 0 }
    }

    fn until(&mut self, time: Micros) -> Option<&'a (Micros, Vec<f64>)> {
        while self.rows.get(self.next).is_some_and(|row| row.0 <= time) {
            self.next += 1;
        }
        self.next.checked_sub(1).map(|index| &self.rows[index])
    }
}

/// The rows of a file after its heading: time in milliseconds and `columns` numbers; more are left out.
fn rows(text: &str, name: &str, columns: usize) -> Result<Vec<(Micros, Vec<f64>)>, ReadError> {
    let mut rows = Vec::new();
    for (index, line) in text.lines().enumerate().skip(1) {
        if line.trim().is_empty() {
            continue;
        }
        let wrong = |what: String| ReadError::Line { file: name.to_owned(), line: index + 1, what };
        let mut words = line.split_whitespace();
        let time = milliseconds(words.next().unwrap_or_default()).map_err(wrong)?;
        let values: Vec<f64> = words.take(columns).map(number).collect::<Result<_, _>>().map_err(wrong)?;
        if values.len() < columns {
            return Err(wrong(format!("needs {} columns", columns + 1)));
        }
        rows.push((time, values));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_become_one_recording() {
        let folder = tempfile::tempdir().unwrap();
        let write = |kind: &str, text: &str| std::fs::write(folder.path().join(format!("a_{kind}.csv")), text).unwrap();
        write("accel", "timestamp x y z\n1.0e+3 1 2 3\n1.01e+3 4 5 6\n");
        write("gyro", "timestamp x y z\n1000 0.1 0.2 0.3\n");
        write("baro", "timestamp bar\n1005 1013\n");
        write("trajectory", "timestamp x y error\n1500.0 566575.8 5932828.5 5.5\n");
        write("waypoints", "timestamps x y height\n1000 566578.7 5932830.4 19.6\n");
        let recording = read(folder.path(), "a").unwrap();
        assert_eq!(recording.samples.len(), 2);
        assert_eq!(recording.samples.iter().map(|sample| sample.pressure).collect::<Vec<_>>(), [None, Some(1_013.0)]);
        assert_eq!(recording.samples[1].gyro, Vector3::new(0.1, 0.2, 0.3));
        assert_eq!(recording.way_points, [WayPoint { time: Micros(1_000_000), place: [566_578.7, 5_932_830.4] }]);
        assert_eq!(recording.positions, [WayPoint { time: Micros(1_500_000), place: [566_575.8, 5_932_828.5] }]);
        write("gyro", "timestamp x y z\n1000 0.1 0.2\n");
        assert!(read(folder.path(), "a").unwrap_err().to_string().ends_with("a_gyro.csv, line 2: needs 4 columns"));
        assert!(read(folder.path(), "b").unwrap_err().to_string().ends_with("b_accel.csv cannot be read"));
    }
}
