//! Reads phone walks of the indoor-location competition 2020 (xyz10): text lines of time, kind and values.

use super::sample::{PhoneRecording, PhoneSample, ReadError, WayPoint, milliseconds, number, text_of};
use nalgebra::Vector3;
use std::path::Path;

/// Reads a file.
///
/// # Errors
/// When it cannot be read, when a line is none, or when it has no samples.
pub fn read(path: &Path) -> Result<PhoneRecording, ReadError> {
    parse(&text_of(path)?, &path.display().to_string())
}

/// Reads the text of a file called `name`.
///
/// A sample is made of each acceleration with the last angular rate; way-points are in metres on the image of the floor.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, name: &str) -> Result<PhoneRecording, ReadError> {
    let mut recording = PhoneRecording::default();
    let (mut gyro, mut magnetic) = (None, None);
    for (index, line) in text.lines().enumerate() {
        if line.starts_with('#') || line.trim().is_empty() {
            continue;
        }
        let wrong = |what: String| ReadError::Line { file: name.to_owned(), line: index + 1, what };
        let mut words = line.split('\t');
        let time = milliseconds(words.next().unwrap_or_default()).map_err(wrong)?;
        let kind = words.next().unwrap_or_default();
        let values = |count: usize| {
            let values: Vec<f64> = words.clone().take(count).map(number).collect::<Result<_, _>>().map_err(wrong)?;
            if values.len() == count { Ok(values) } else { Err(wrong(format!("{kind} needs {count} values"))) }
        };
        let vector = || values(3).map(|values| Vector3::new(values[0], values[1], values[2]));
        match kind {
            "TYPE_ACCELEROMETER" => {
                let accel = vector()?;
                if let Some(gyro) = gyro {
                    recording.samples.push(PhoneSample { time, accel, gyro, magnetic, pressure: None });
                }
            }
            "TYPE_GYROSCOPE" => gyro = Some(vector()?),
            "TYPE_MAGNETIC_FIELD" => magnetic = Some(vector()?),
            "TYPE_WAYPOINT" => {
                let values = values(2)?;
                recording.way_points.push(WayPoint { time, place: [values[0], values[1]] });
            }
            // Radio, rotation vectors and uncalibrated values are not used.
            kind if kind.starts_with("TYPE_") => {}
            other => return Err(wrong(format!("'{other}' is no kind of measurement"))),
        }
    }
    if recording.samples.is_empty() {
        return Err(ReadError::Empty { file: name.to_owned(), what: "accelerometer and gyroscope" });
    }
    Ok(recording)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sohle_shared::time::Micros;

    #[test]
    fn lines_become_samples_and_way_points() {
        let text = "#\tstartTime:1\n1000\tTYPE_WAYPOINT\t188.5\t56.25\n1001\tTYPE_ACCELEROMETER\t9\t9\t9\t2\n\
                    1002\tTYPE_GYROSCOPE\t0.1\t0.2\t0.3\t3\n1020\tTYPE_ACCELEROMETER\t1\t2\t3\t2\n1021\tTYPE_WIFI\tx\n";
        let recording = parse(text, "walk.txt").unwrap();
        assert_eq!(recording.way_points, [WayPoint { time: Micros(1_000_000), place: [188.5, 56.25] }]);
        assert_eq!(recording.samples.len(), 1);
        assert_eq!(recording.samples[0].time, Micros(1_020_000));
        assert_eq!(recording.samples[0].gyro, Vector3::new(0.1, 0.2, 0.3));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let message = |text: &str| parse(text, "walk.txt").unwrap_err().to_string();
        assert_eq!(message("1\tTYPE_GYROSCOPE\t1\t2\n"), "walk.txt, line 1: TYPE_GYROSCOPE needs 3 values");
        assert_eq!(message("\n1\tTYPE_GYROSCOPE\t1\tNaN\t2\n"), "walk.txt, line 2: 'NaN' is no number");
        assert_eq!(message("1\thello\n"), "walk.txt, line 1: 'hello' is no kind of measurement");
        assert_eq!(message(""), "walk.txt has no samples of accelerometer and gyroscope");
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "(([0-9]{1,5}|x)\t(TYPE_[A-Z]{3,6}|TYPE_GYROSCOPE|TYPE_WAYPOINT)(\t[0-9.e-]{0,4}){0,4}\n){0,6}") {
            let _ = parse(&text, "walk.txt");
        }
    }
}
