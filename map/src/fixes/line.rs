//! A fix as a line of JSON. `docs/fixes.md` has its members.

use super::fix::{Fix, Frame, Measured};
use nalgebra::Matrix2;
use sohle_shared::time::Micros;

/// The clock of the steps, as far as it is known to whoever reads a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// The date of its moment zero since the beginning of 1970; without it only `time_us` is understood. **Units:** us.
    pub epoch_us: Option<i64>,
    /// What it says now, where lines are heard while somebody walks: they arrive now, and one that does not tell when it was
    /// measured was measured now.
    pub now: Option<Micros>,
}

impl Clock {
    /// Of a walk that is over.
    pub fn of_past(epoch_us: Option<i64>) -> Self {
        Self { epoch_us, now: None }
    }
}

/// Why a line is no fix.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LineError {
    /// It is no JSON, or its members are others.
    #[error("{what} (column {column})")]
    Json {
        /// In the words of the reader of JSON.
        what: String,
        /// Counted from 1; 0 where nothing can be pointed at.
        column: usize,
    },
    /// Something is missing, or too much.
    #[error("{0}")]
    Members(&'static str),
    /// A frame that has no name here.
    #[error("the frame '{0}' is not known: expected 'building' or 'EPSG:' and a number")]
    Frame(String),
}

impl From<serde_json::Error> for LineError {
    fn from(error: serde_json::Error) -> Self {
        let (told, column) = (error.to_string(), error.column());
        // Every line of ours is the first to the reader of JSON; whoever reads many knows its number.
        let what = told.rsplit_once(" at line ").map_or(told.as_str(), |(what, _)| what).to_owned();
        Self::Json { what, column }
    }
}

/// The members.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    time_us: Option<i64>,
    unix_us: Option<i64>,
    arrived_us: Option<i64>,
    source: Option<String>,
    frame: Option<String>,
    position: Option<[f64; 2]>,
    sigma_m: Option<f64>,
    covariance_m2: Option<[[f64; 2]; 2]>,
    anchor: Option<[f64; 2]>,
    above_m: Option<f64>,
    range_m: Option<f64>,
    floor: Option<i32>,
}

/// When something was measured, by the clock of the steps. **Units:** us.
pub(super) fn moment(time_us: Option<i64>, unix_us: Option<i64>, clock: Clock) -> Result<i64, LineError> {
    match (time_us, unix_us, clock.epoch_us, clock.now) {
        (Some(time), None, ..) => Ok(time),
        (None, Some(date), Some(epoch), _) => Ok(date.saturating_sub(epoch)),
        (None, Some(_), None, _) => {
            Err(LineError::Members("unix_us, but the date of the steps is not known: expected time_us"))
        }
        (None, None, _, Some(now)) => Ok(now.0),
        _ => Err(LineError::Members("expected one of time_us and unix_us")),
    }
}

/// Reads a line.
///
/// # Errors
/// For what is no JSON, members that are not known, missing or contradict each other, and frames without a name.
pub fn parse(text: &str, clock: Clock) -> Result<Fix, LineError> {
    let line: Line = serde_json::from_str(text)?;
    let time = moment(line.time_us, line.unix_us, clock)?;
    let arrived = match (clock.now, line.arrived_us, line.unix_us, clock.epoch_us) {
        (Some(now), ..) => now.0,
        (None, Some(arrived), None, _) => arrived,
        (None, Some(arrived), Some(_), Some(epoch)) => arrived.saturating_sub(epoch),
        // It arrives when it is measured, where nobody says anything else.
        _ => time,
    };
    let measured = match (line.position, line.anchor, line.range_m) {
        (Some(place), None, None) => {
            if line.above_m.is_some() {
                return Err(LineError::Members("above_m is for a range, not for a position"));
            }
            let covariance = match (line.sigma_m, line.covariance_m2) {
                (Some(sigma), None) => Matrix2::identity() * (sigma * sigma.abs()),
                (None, Some([[xx, xy], [yx, yy]])) => Matrix2::new(xx, xy, yx, yy),
                _ => return Err(LineError::Members("a position needs one of sigma_m and covariance_m2")),
            };
            Measured::Position { place, covariance }
        }
        (None, Some(anchor), Some(metres)) => {
            let above_m = line.above_m.unwrap_or(0.0);
            match (line.sigma_m, line.covariance_m2) {
                (Some(sigma_m), None) => Measured::Range { anchor, above_m, metres, sigma_m },
                (None, None) => Measured::usual_range(anchor, above_m, metres),
                (_, Some(_)) => return Err(LineError::Members("a range has a sigma_m, and no covariance_m2")),
            }
        }
        _ => return Err(LineError::Members("expected a position, or an anchor and range_m")),
    };
    let frame = line.frame.as_deref().unwrap_or("building");
    let code = frame.split_once(':').filter(|(authority, _)| authority.eq_ignore_ascii_case("EPSG"));
    let frame = match code.and_then(|(_, number)| number.trim().parse().ok()) {
        _ if frame == "building" => Frame::Building,
        Some(4_326) => Frame::Geographic,
        Some(epsg) => Frame::Utm(epsg),
        None => return Err(LineError::Frame(frame.to_owned())),
    };
    let source = line.source.as_deref().unwrap_or("position").into();
    Ok(Fix { time: Micros(time), arrived: Micros(arrived), source, frame, measured, floor: line.floor })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_and_ranges_are_read() {
        let fix = parse(
            r#"{"time_us":5000000,"source":"uwb","position":[3.5,-2],"sigma_m":0.5,"floor":1}"#,
            Clock::default(),
        )
        .unwrap();
        assert_eq!((fix.time, fix.arrived, fix.floor, &*fix.source), (Micros(5_000_000), fix.time, Some(1), "uwb"));
        assert_eq!(fix.measured, Measured::Position { place: [3.5, -2.0], covariance: Matrix2::identity() * 0.25 });
        let fix = parse(
            r#"{"unix_us":1700000005000000,"arrived_us":1700000007000000,"frame":"epsg:32632","anchor":[566500,5932800],
                "above_m":2.1,"range_m":7.25,"sigma_m":0.2}"#,
            Clock::of_past(Some(1_700_000_000_000_000)),
        )
        .unwrap();
        assert_eq!((fix.time, fix.arrived, fix.frame), (Micros(5_000_000), Micros(7_000_000), Frame::Utm(32_632)));
        let expected = Measured::Range { anchor: [566_500.0, 5_932_800.0], above_m: 2.1, metres: 7.25, sigma_m: 0.2 };
        assert_eq!(fix.measured, expected);
        let earth = r#"{"time_us":1,"frame":"EPSG:4326","position":[10,53.5],"covariance_m2":[[4,1],[1,2]]}"#;
        assert_eq!(parse(earth, Clock::default()).unwrap().frame, Frame::Geographic);
    }

    #[test]
    fn what_is_heard_now_arrives_now() {
        let clock = Clock { epoch_us: Some(1_000_000), now: Some(Micros(7_000_000)) };
        let times = |line: &str| {
            let fix = parse(line, clock).unwrap();
            (fix.time.0, fix.arrived.0)
        };
        assert_eq!(times(r#"{"position":[1,2],"sigma_m":1}"#), (7_000_000, 7_000_000));
        assert_eq!(times(r#"{"unix_us":6000000,"position":[1,2],"sigma_m":1}"#), (5_000_000, 7_000_000));
        assert_eq!(times(r#"{"time_us":9000000,"arrived_us":3,"position":[1,2],"sigma_m":1}"#), (9_000_000, 7_000_000));
    }

    #[test]
    fn what_is_none_is_told() {
        for (line, expected) in [
            ("", "EOF"),
            ("[]", "invalid"),
            (r#"{"time_us":1,"position":[1,2],"sigma_m":1,"colour":2}"#, "unknown field"),
            (r#"{"position":[1,2],"sigma_m":1}"#, "expected one of time_us"),
            (r#"{"unix_us":1,"position":[1,2],"sigma_m":1}"#, "the date of the steps is not known"),
            (r#"{"time_us":1,"position":[1,2]}"#, "needs one of sigma_m"),
            (r#"{"time_us":1,"position":[1,2,3],"sigma_m":1}"#, "trailing"),
            (r#"{"time_us":1,"range_m":3,"sigma_m":1}"#, "an anchor and range_m"),
            (r#"{"time_us":1,"anchor":[1,2],"range_m":3,"covariance_m2":[[1,0],[0,1]]}"#, "a range has a sigma_m"),
            (r#"{"time_us":1,"position":[1,2],"sigma_m":1,"frame":"moon"}"#, "the frame 'moon'"),
        ] {
            let told = parse(line, Clock::default()).unwrap_err().to_string();
            assert!(told.contains(expected) && !told.contains("line"), "{line}: {told}");
        }
    }
}
