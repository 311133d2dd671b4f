//! A walk through a building as other programs take it: GeoJSON and GPX, with time, floor and uncertainty.
//!
//! Two paths: *live*, as it was said when it was said, and *corrected*, by all that was learned later.

use crate::building::georeference::Projection;
use crate::particle::State;
use sohle_shared::time::Micros;

/// A walk.
#[derive(Debug)]
pub struct Walk<'a> {
    /// For people.
    pub name: &'a str,
    /// From the frame of the building to the earth, if the building is somewhere on it.
    pub projection: Option<&'a Projection>,
    /// As it was said.
    pub live: Vec<Point>,
    /// As it is known now.
    pub corrected: Vec<Point>,
}

/// A place of the walk, at the end of a stance.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Index of the step.
    pub step: u32,
    /// By the clock of the shoe or of the recording.
    pub time: Micros,
    /// Since the beginning of 1970, UTC; nothing when the recording does not know its date. **Units:** microseconds.
    pub unix_us: Option<i64>,
    /// Number of the floor.
    pub floor: i32,
    /// **Units:** m; **Frame:** building.
    pub position: [f64; 3],
    /// Standard deviation of the place. **Units:** m.
    pub sigma_m: f64,
    /// What was known, and how likely this place was; only of the live path.
    pub said: Option<(State, f64)>,
}

impl Point {
    /// The time as RFC 3339 has it; that of the clock counted from 1970 when the date is not known.
    pub(super) fn stamp(&self) -> String {
        let time =
            time::UtcDateTime::from_unix_timestamp_nanos(i128::from(self.unix_us.unwrap_or(self.time.0)) * 1_000);
        let text = time.ok().and_then(|time| time.format(&time::format_description::well_known::Rfc3339).ok());
        // What lies before the year 0 or after 9999 is no date.
        text.unwrap_or_else(|| "1970-01-01T00:00:00Z".to_owned())
    }

    /// Whether a line may go through it: nobody draws a path through places that were only possible.
    pub(super) fn is_sure(&self) -> bool {
        self.said.is_none_or(|(state, _)| state == State::Located)
    }
}

/// Runs of points that a line may go through, broken where the place was not known.
pub(super) fn runs(points: &[Point]) -> impl Iterator<Item = &[Point]> {
    points.split(|point| !point.is_sure()).filter(|run| !run.is_empty())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::building::georeference::Georeference;

    pub fn projection() -> Projection {
        Georeference::Geographic { origin: [16.37, 48.2], rotation_deg: 0.0 }.projection().unwrap().unwrap()
    }

    /// East along a corridor, up some stairs; the third place is not known.
    pub fn walk(projection: Option<&Projection>) -> Walk<'_> {
        let point = |step: u32, said| Point {
            step,
            time: Micros(i64::from(step) * 1_100_000),
            unix_us: Some(1_700_000_000_000_000 + i64::from(step) * 1_100_000),
            floor: i32::from(step >= 4),
            position: [10.0 + f64::from(step), 5.0, if step >= 4 { 3.6 } else { 0.0 }],
            sigma_m: 0.25,
            said,
        };
        let state = |step| if step == 2 { State::SeveralPlaces } else { State::Located };
        let live = (0..6).map(|step| point(step, Some((state(step), 0.9)))).collect();
        let corrected = (0..6).map(|step| point(step, None)).collect();
        Walk { name: "A & <B>", projection, live, corrected }
    }

    #[test]
    fn a_time_is_written_as_the_standard_has_it() {
        let [known, unknown] = [Some(1_700_000_000_500_000), None]
            .map(|unix_us| Point { unix_us, time: Micros(61_000_000), ..walk(None).live[0].clone() }.stamp());
        assert_eq!(known, "2023-11-14T22:13:20.5Z");
        assert_eq!(unknown, "1970-01-01T00:01:01Z");
    }

    #[test]
    fn a_path_breaks_where_the_place_was_not_known() {
        let lengths: Vec<_> = runs(&walk(None).live).map(<[Point]>::len).collect();
        assert_eq!(lengths, [2, 3]);
    }
}
