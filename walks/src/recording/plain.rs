//! Plain CSV: the profile `csv`.
//!
//! Without a mapping the columns are expected under the project's own names, in its own units: `time_s`, `accel_x`,
//! `accel_y`, `accel_z` (m/s²), `gyro_x`, `gyro_y`, `gyro_z` (rad/s).

use super::mapping::{Column, Mapping, named};
use super::unit::{AccelUnit, GyroUnit, TimeUnit};

/// The columns of the profile.
pub(super) fn mapping() -> Mapping {
    Mapping {
        time: Some(Column::Name("time_s".into())),
        time_unit: Some(TimeUnit::Second),
        accel: named(["accel_x", "accel_y", "accel_z"]),
        accel_unit: Some(AccelUnit::MetrePerSecond2),
        gyro: named(["gyro_x", "gyro_y", "gyro_z"]),
        gyro_unit: Some(GyroUnit::RadianPerSecond),
        ..Mapping::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Profile, Recording, RecordingError, read};

    fn with(text: &str, mapping: &str) -> Result<Recording, RecordingError> {
        let profile = Profile { mapping: toml::from_str(mapping).unwrap() };
        read("walk.csv".as_ref(), text.as_bytes(), Some(&profile))
    }

    #[test]
    fn the_projects_own_columns_are_recognised() {
        let text = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z\n0.5,0,0,9.81,0,0.1,0\n0.51,0,0,9.81,0,0.1,0\n";
        let walk = read("walk.csv".as_ref(), text.as_bytes(), None).unwrap();
        assert_eq!(walk.samples[1].time.0, 510_000);
        assert_eq!(walk.samples[1].gyro.0.y, 0.1);
    }

    #[test]
    fn any_columns_are_read_by_a_mapping() {
        let mapping = "time = 't'\ntime_unit = 'ms'\naccel = ['ax', 'ay', 'az']\naccel_unit = 'mg'\n\
                       gyro = [6, 7, 8]\ngyro_unit = 'deg/s'\ncomment = '#'\nskip_lines = 1";
        let text = "\u{feff}log of today\n# comment\nn;t;ax;ay;az;\"gx; raw\";gy;gz\n\n1;10;0;0;\"1000\";0;180;0\n2;20;0;0;1000;0;0;0\n";
        let walk = with(text, mapping).unwrap();
        assert_eq!(walk.samples.len(), 2);
        assert_eq!(walk.samples[0].time.0, 10_000);
        assert_eq!(walk.samples[0].accel.0.z, 9.80665);
        assert_eq!(walk.samples[0].gyro.0.y, std::f32::consts::PI);
    }

    #[test]
    fn tables_without_names_and_with_blanks_are_read() {
        let mapping = "rate_hz = 100.0\naccel = [1, 2, 3]\naccel_unit = 'm/s2'\ngyro = [4, 5, 6]\ngyro_unit = 'rad/s'";
        let walk = with("  0.0   0.0  9.81 0 0 0\n\t0.0 \t 0.0  9.81 0 0 0", mapping).unwrap();
        assert_eq!(walk.samples[1].time.0, 10_000);
    }

    #[test]
    fn each_fault_is_one_line_that_says_where() {
        let head = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z\n";
        let cases = [
            ("", "", "the file is empty"),
            (head, "", "no samples: no line of numbers among 1"),
            ("0,0,0,9.81,0,0,nan\n", "", "line 2, column 'gyro_z': 'nan' is not a finite number"),
            ("0,0,inf,9.81,0,0,0\n", "", "line 2, column 'accel_y': 'inf' is not a finite number"),
            ("0,0,1e99,9.81,0,0,0\n", "", "line 2: a value is too large"),
            ("0,0,,9.81,0,0,0\n", "", "line 2, column 'accel_y': empty, expected a number"),
            ("0,0,walk,9.81,0,0,0\n", "", "line 2, column 'accel_y': 'walk' is not a finite number"),
            ("0,0,0,9.81,0,0,0\n1,0,0\n2,0,0,9.81,0,0,0\n", "", "line 3 has 3 columns, expected 7 or more"),
            ("0,0,0,9.81,0,0,0\n1,0,0", "", "truncated: the file ends in the middle of line 3, after 1 samples"),
            (
                "5,0,0,9.81,0,0,0\n3.5,0,0,9.81,0,0,0\n",
                "",
                "line 3: time runs backwards by 1.500 s, at most 1 s is taken for jitter",
            ),
            ("1e11,0,0,9.81,0,0,0\n", "", "line 2: time 1e11 s is out of range"),
            ("0,0,0,1,0,0,0\n0.01,0,0,1,0,0,0\n", "", "within 5 %: is this in g?"),
            (
                "0,0,0,9.81,0,0,0\n",
                "time = 'stamp'\ntime_unit = 's'\nbase = 'csv'",
                "no column 'stamp' for the time; the file has: 'time_s', 'accel_x', 'accel_y', 'accel_z', 'gyro_x', 'gyro_y', 'gyro_z'",
            ),
            ("0,0,0,9.81,0,0,0\n", "time = 'time_s'", "the mapping does not say the unit of the time (time_unit)"),
            ("0,0,0,9.81,0,0,0\n", "accel = [2, 3, 40]", "no column number 40 for the accelerometer; the file has: "),
        ];
        for (rows, mapping, expected) in cases {
            let text = if rows.is_empty() || rows == head { rows.to_owned() } else { format!("{head}{rows}") };
            let message = with(&text, mapping).unwrap_err().to_string();
            assert!(message.starts_with("walk.csv: ") && message.contains(expected), "{message}");
            assert!(!message.contains('\n'));
        }
    }

    #[test]
    fn an_unknown_layout_lists_its_columns() {
        let message =
            read("walk.csv".as_ref(), "t,a,b,c,d,e,f\n1,2,3,4,5,6,7\n".as_bytes(), None).unwrap_err().to_string();
        assert!(message.contains("not recognised from its columns ('t', 'a', 'b', 'c', 'd', 'e', 'f')"), "{message}");
    }

    #[test]
    fn a_name_that_is_there_twice_is_refused() {
        let text = "time_s,accel_x,accel_x,accel_z,gyro_x,gyro_y,gyro_z\n0,0,0,9.81,0,0,0\n";
        let message = with(text, "base = 'csv'").unwrap_err().to_string();
        assert!(message.contains("more than once"), "{message}");
    }
}
