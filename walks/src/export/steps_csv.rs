//! The steps as a table: one row for each, the units in the names of the columns.

use crate::track::Track;
use sohle_shared::step::FloorMode;
use sohle_shared::time::Micros;
use std::fmt::Write;

/// Names of the columns.
///
/// `forward`, `left`, `up` and `turn` are the step in the heading frame of the previous stance, `cov_*` the upper triangle
/// of their covariance; `x`, `y`, `z` and `heading` are the steps put end to end in the frame of the first stance.
pub const HEADER: &str = "index,stance_start_s,stance_end_s,forward_m,left_m,up_m,turn_rad,length_m,\
cov_forward_forward_m2,cov_forward_left_m2,cov_forward_up_m2,cov_forward_turn_m_rad,cov_left_left_m2,cov_left_up_m2,\
cov_left_turn_m_rad,cov_up_up_m2,cov_up_turn_m_rad,cov_turn_turn_rad2,mode,accel_clipped,gyro_clipped,gap,long_swing,\
weak_stance,repaired,accel_clipped_samples,gyro_clipped_samples,x_m,y_m,z_m,heading_rad";

/// What the ground did, in a word.
pub fn mode_name(mode: FloorMode) -> &'static str {
    match mode {
        FloorMode::Level => "level",
        FloorMode::Stairs => "stairs",
        FloorMode::Elevator => "elevator",
    }
}

/// The table of all steps of a track.
pub fn table(track: &Track) -> String {
    let mut rows = String::from(HEADER);
    rows.push('\n');
    for (step, stance) in track.steps.iter().zip(&track.stances) {
        let mut cells = vec![step.index.to_string(), seconds(step.stance_start), seconds(step.stance_end)];
        cells.extend(step.displacement.iter().map(|value| format!("{value}")));
        cells.extend([format!("{}", step.turn), format!("{}", step.length())]);
        for row in 0..4 {
            cells.extend((row..4).map(|column| format!("{:e}", step.covariance[(row, column)])));
        }
        cells.push(mode_name(step.mode).to_owned());
        let quality = step.quality;
        let flags = [
            quality.accel_clipped,
            quality.gyro_clipped,
            quality.gap,
            quality.long_swing,
            quality.weak_stance,
            quality.repaired,
        ];
        cells.extend(flags.map(|flag| u8::from(flag).to_string()));
        cells.extend([step.clipped.accel, step.clipped.gyro].map(|count| count.to_string()));
        cells.extend(stance.position.map(|value| format!("{value:.6}")));
        // Writing to a string cannot fail.
        let _ = writeln!(rows, "{},{:.6}", cells.join(","), stance.heading);
    }
    rows
}

/// Seconds with all six digits, from the integer: a float has not enough of them after some months.
fn seconds(time: Micros) -> String {
    let sign = if time.0 < 0 { "-" } else { "" };
    let whole = time.0.unsigned_abs();
    format!("{sign}{}.{:06}", whole / 1_000_000, whole % 1_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::synthetic;

    #[test]
    fn each_step_has_a_row_with_a_cell_for_each_column() {
        let track = synthetic::square_and_stairs(50);
        let text = table(&track);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        assert_eq!(reader.headers().unwrap().len(), HEADER.split(',').count());
        let rows: Vec<_> = reader.records().map(|row| row.unwrap()).collect();
        assert_eq!(rows.len(), 51);
        assert_eq!(&rows[3][2], "3.750000");
        assert_eq!(&rows[3][20], "1", "the gyroscope was clipped");
        assert_eq!(&rows[3][26], "7", "so often");
        assert_eq!(&rows[50][18], "stairs");
    }

    #[test]
    fn the_displacements_put_end_to_end_give_the_positions() {
        let text = table(&synthetic::square_and_stairs(8));
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let cell = |row: &csv::StringRecord, column: usize| row[column].parse::<f64>().unwrap();
        let mut x = 0.0;
        for row in reader.records().map(|row| row.unwrap()).take(6) {
            x += cell(&row, 3);
            // The table has micrometres.
            assert!((cell(&row, 27) - x).abs() < 1e-5);
        }
    }

    #[test]
    fn seconds_keep_microseconds_on_both_sides_of_zero() {
        assert_eq!(seconds(Micros(-1)), "-0.000001");
        assert_eq!(seconds(Micros(2_592_000_000_001)), "2592000.000001");
    }
}
