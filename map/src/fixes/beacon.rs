//! The start of a walk by a beacon above an entrance: whoever hears it loudly enough walks in there.
//!
//! Cell of origin, and no more: a reading is the signal strength of a beacon, and the first that is loud enough tells
//! the entrance, the moment and, since people walk in, the direction. What is heard of beacons that no entrance has is passed
//! over.
//!
//! # Source
//! Graph, 6.2.3 and figures 6.9 and 6.10.

use super::line::{Clock, LineError, moment};
use crate::building::geometry::{self, Point};
use crate::building::{Building, Entrance};
use sohle_shared::time::Micros;

/// Who hears a beacon louder than this is at it (Graph, 6.2.3). **Units:** dBm.
pub const LOUD_DBM: f64 = -60.0;
/// Beacons are heard about once a second (Graph, 3.2): what is heard so soon after the first loud one may be louder.
/// **Units:** us.
const TOGETHER_US: i64 = 1_000_000;
/// Two beacons that are heard so alike cannot be told apart: the strength of one changes by as much at the same place
/// (Graph, figure 6.9). **Units:** dB.
const ALIKE_DB: f64 = 3.0;
/// A door so near to an entrance is its own. **Units:** m.
const DOOR_M: f64 = 3.0;

/// What was heard of a beacon.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// When, by the clock of the steps.
    pub time: Micros,
    /// Which.
    pub beacon: String,
    /// How loud. **Units:** dBm.
    pub rssi_dbm: f64,
}

/// The members of a line.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    time_us: Option<i64>,
    unix_us: Option<i64>,
    beacon: String,
    rssi_dbm: f64,
}

/// Reads a line of JSON: `{"time_us":12300000,"beacon":"40","rssi_dbm":-57}`, or with `unix_us` as of positions.
///
/// # Errors
/// For what is no JSON, members that are not known or missing, and a strength that no receiver tells.
pub fn parse(text: &str, clock: Clock) -> Result<Reading, LineError> {
    let line: Line = serde_json::from_str(text)?;
    let time = moment(line.time_us, line.unix_us, clock)?;
    if !(-200.0..=50.0).contains(&line.rssi_dbm) {
        return Err(LineError::Members("rssi_dbm is no signal strength in dBm: expected -200 to 50"));
    }
    Ok(Reading { time: Micros(time), beacon: line.beacon.trim().to_owned(), rssi_dbm: line.rssi_dbm })
}

/// Where and when somebody has come in.
#[derive(Clone, Debug, PartialEq)]
pub struct Entered<'a> {
    /// Through which entrance.
    pub entrance: &'a Entrance,
    /// The reading that tells it.
    pub reading: Reading,
    /// The direction from its door into the building, if the plan has a door there. **Units:** rad; **Frame:** building.
    pub heading: Option<f64>,
}

/// Why no entrance is known.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unheard {
    /// No entrance has a beacon.
    #[error(
        "no entrance of the building has a beacon: give one the property 'beacon', the beacon's id (docs/building.md)"
    )]
    NoBeacons,
    /// Two entrances have the same.
    #[error("the beacon '{0}' is that of two entrances, '{1}' and '{2}': each needs its own")]
    Shared(String, String, String),
    /// None of those heard belongs to an entrance.
    #[error("no reading is of a beacon of the building: heard {heard}, and the entrances have {known}")]
    Unknown {
        /// Those that were heard.
        heard: String,
        /// Those of the entrances.
        known: String,
    },
    /// None was loud enough.
    #[error(
        "no beacon of an entrance was louder than {limit_dbm} dBm: the loudest was '{beacon}' with {rssi_dbm} dBm at \
         {time_s:.1} s; lower the threshold (--beacon-dbm), or name the entrance (--start NAME)"
    )]
    Quiet {
        /// The threshold. **Units:** dBm.
        limit_dbm: f64,
        /// The loudest.
        beacon: String,
        /// How loud. **Units:** dBm.
        rssi_dbm: f64,
        /// When. **Units:** s.
        time_s: f64,
    },
    /// Two were.
    #[error(
        "the beacons of the entrances '{0}' and '{1}' were equally loud at {2:.1} s: name the entrance (--start NAME)"
    )]
    Both(String, String, f64),
}

/// The entrance whose beacon is the first to be louder than a threshold; of several within a second the loudest.
/// **Units:** dBm.
///
/// # Errors
/// When no beacon of an entrance was, or two were alike.
pub fn entered<'a>(building: &'a Building, readings: &[Reading], limit_dbm: f64) -> Result<Entered<'a>, Unheard> {
    let with: Vec<(&Entrance, &str)> =
        building.entrances.iter().filter_map(|entrance| Some((entrance, entrance.beacon.as_deref()?))).collect();
    if with.is_empty() {
        return Err(Unheard::NoBeacons);
    }
    for (number, (first, id)) in with.iter().enumerate() {
        if let Some((second, _)) = with[number + 1..].iter().find(|(_, other)| other == id) {
            return Err(Unheard::Shared((*id).to_owned(), first.name.clone(), second.name.clone()));
        }
    }
    let entrance = |reading: &Reading| with.iter().find(|(_, id)| *id == reading.beacon).map(|(entrance, _)| *entrance);
    let mut known: Vec<(&Entrance, &Reading)> =
        readings.iter().filter_map(|reading| Some((entrance(reading)?, reading))).collect();
    known.sort_by_key(|(_, reading)| reading.time);
    let loudest = |among: &[(&'a Entrance, &Reading)]| {
        among
            .iter()
            .copied()
            .map(|(at, reading)| (at, reading.clone()))
            .max_by(|a, b| a.1.rssi_dbm.total_cmp(&b.1.rssi_dbm))
    };
    let Some((_, most)) = loudest(&known) else {
        let mut heard: Vec<&str> = readings.iter().map(|reading| &*reading.beacon).collect();
        heard.sort_unstable();
        heard.dedup();
        let known = with.iter().map(|(_, id)| *id).collect();
        return Err(Unheard::Unknown { heard: listed(heard), known: listed(known) });
    };
    let Some(begin) = known.iter().position(|(_, reading)| reading.rssi_dbm > limit_dbm) else {
        let time_s = most.time.as_seconds();
        return Err(Unheard::Quiet { limit_dbm, beacon: most.beacon, rssi_dbm: most.rssi_dbm, time_s });
    };
    let until = known[begin].1.time.0.saturating_add(TOGETHER_US);
    let together: Vec<(&Entrance, &Reading)> =
        known[begin..].iter().copied().take_while(|(_, reading)| reading.time.0 <= until).collect();
    let Some((entrance, reading)) = loudest(&together) else {
        // The one that began it is among them.
        return Err(Unheard::NoBeacons);
    };
    let alike = |(other, heard): &&(&Entrance, &Reading)| {
        heard.beacon != reading.beacon && reading.rssi_dbm - heard.rssi_dbm < ALIKE_DB && other.name != entrance.name
    };
    if let Some((other, _)) = together.iter().find(alike) {
        return Err(Unheard::Both(entrance.name.clone(), other.name.clone(), reading.time.as_seconds()));
    }
    Ok(Entered { entrance, reading, heading: inwards(building, entrance) })
}

/// Some words.
fn listed(words: Vec<&str>) -> String {
    const MOST: usize = 5;
    let more = if words.len() > MOST { " and others" } else { "" };
    let quoted: Vec<String> = words.iter().take(MOST).map(|word| format!("'{word}'")).collect();
    if quoted.is_empty() { "nothing".to_owned() } else { format!("{}{more}", quoted.join(", ")) }
}

/// The direction in which one comes in: across the nearest door, to the side on which the entrance is. **Units:** rad.
fn inwards(building: &Building, entrance: &Entrance) -> Option<f64> {
    let place = entrance.place;
    let far = |line: &geometry::Segment| geometry::distance(geometry::nearest(line, place), place);
    let doors = building.floor(entrance.floor)?.doors.iter().map(|door| door.line);
    let line = doors.filter(|line| far(line) <= DOOR_M).min_by(|a, b| far(a).total_cmp(&far(b)))?;
    let [a, b] = line;
    let across: Point = [a[1] - b[1], b[0] - a[0]];
    let side = across[0] * (place[0] - a[0]) + across[1] * (place[1] - a[1]);
    let sign = if side < 0.0 { -1.0 } else { 1.0 };
    Some((sign * across[1]).atan2(sign * across[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Door, Floor};

    /// Two entrances with beacons 39 (on floor -1, coming in northwards) and 40 (coming in westwards), and one without.
    fn building() -> Building {
        let entrance = |name: &str, floor: i32, place: Point, beacon: Option<&str>| Entrance {
            name: name.to_owned(),
            floor,
            place,
            beacon: beacon.map(str::to_owned),
        };
        let floor = |number: i32, line: geometry::Segment| Floor {
            number,
            doors: vec![Door { line, name: None }],
            ..Floor::default()
        };
        Building {
            floors: vec![floor(-1, [[4.0, 0.0], [5.0, 0.0]]), floor(0, [[20.0, 3.0], [20.0, 4.0]])],
            entrances: vec![
                entrance("cellar", -1, [4.5, 0.4], Some("39")),
                entrance("street", 0, [19.5, 3.5], Some("40")),
                entrance("garden", 0, [1.0, 1.0], None),
            ],
            ..Building::default()
        }
    }

    fn heard(list: &[(f64, &str, f64)]) -> Vec<Reading> {
        let reading = |&(seconds, beacon, rssi_dbm): &(f64, &str, f64)| Reading {
            time: Micros((seconds * 1e6) as i64),
            beacon: beacon.to_owned(),
            rssi_dbm,
        };
        list.iter().map(reading).collect()
    }

    #[test]
    fn figure_6_10_the_first_beacon_above_the_threshold_tells_the_entrance() {
        let building = building();
        // As it was walked: six steps to the entrance with beacon 40; that of another is heard, too.
        let readings = heard(&[
            (1.0, "40", -74.0),
            (1.2, "39", -80.0),
            (2.0, "40", -66.0),
            (3.0, "40", -52.0),
            (3.4, "39", -71.0),
            (9.0, "39", -40.0),
        ]);
        let entered = entered(&building, &readings, LOUD_DBM).unwrap();
        assert_eq!((&*entered.entrance.name, entered.reading.time), ("street", Micros(3_000_000)));
        // Through its door, to the west.
        assert!((entered.heading.unwrap().abs() - std::f64::consts::PI).abs() < 1e-12);
        let cellar = super::entered(&building, &heard(&[(1.0, "39", -59.9)]), LOUD_DBM).unwrap();
        assert!((cellar.heading.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn within_a_second_the_loudest_counts() {
        let building = building();
        let name = |readings: &[(f64, &str, f64)]| {
            entered(&building, &heard(readings), LOUD_DBM).map(|entered| entered.entrance.name.clone())
        };
        assert_eq!(name(&[(1.0, "39", -59.0), (1.8, "40", -50.0)]).unwrap(), "street");
        assert_eq!(name(&[(1.0, "39", -59.0), (2.1, "40", -50.0)]).unwrap(), "cellar");
        let both = name(&[(1.0, "39", -52.0), (1.8, "40", -50.0)]).unwrap_err();
        assert!(matches!(both, Unheard::Both(..)) && both.to_string().contains("--start NAME"), "{both}");
    }

    #[test]
    fn each_cause_of_no_start_is_told_in_a_line_with_its_cure() {
        let building = building();
        let told = |building: &Building, readings: &[(f64, &str, f64)]| {
            let told = entered(building, &heard(readings), LOUD_DBM).unwrap_err().to_string();
            assert_eq!(told.lines().count(), 1);
            told
        };
        let unknown = told(&building, &[(1.0, "7", -40.0), (2.0, "8", -40.0)]);
        assert!(unknown.contains("heard '7', '8', and the entrances have '39', '40'"), "{unknown}");
        assert!(told(&building, &[]).contains("heard nothing"));
        // Exactly the threshold is not above it.
        let quiet = told(&building, &[(1.0, "40", -60.0), (2.0, "39", -70.0)]);
        assert!(quiet.contains("louder than -60 dBm") && quiet.contains("'40' with -60 dBm at 1.0 s"), "{quiet}");
        assert!(quiet.contains("--beacon-dbm"));
        let mut same = building.clone();
        same.entrances[1].beacon = Some("39".to_owned());
        assert!(told(&same, &[]).contains("'39' is that of two entrances, 'cellar' and 'street'"));
        let mut none = building;
        none.entrances.iter_mut().for_each(|entrance| entrance.beacon = None);
        assert!(told(&none, &[]).contains("the property 'beacon'"));
    }

    #[test]
    fn readings_are_lines_of_json() {
        let reading = parse(r#"{"time_us":12300000,"beacon":"40","rssi_dbm":-57}"#, Clock::default()).unwrap();
        assert_eq!(reading, heard(&[(12.3, "40", -57.0)])[0]);
        let dated =
            parse(r#"{"unix_us":12300000,"beacon":"40","rssi_dbm":-57}"#, Clock::of_past(Some(300_000))).unwrap();
        assert_eq!(dated.time, Micros(12_000_000));
        for (line, expected) in [
            (r#"{"beacon":"40","rssi_dbm":-57}"#, "expected one of time_us and unix_us"),
            (r#"{"time_us":1,"rssi_dbm":-57}"#, "missing field `beacon`"),
            (r#"{"time_us":1,"beacon":"40","rssi":-57}"#, "unknown field"),
            (r#"{"time_us":1,"beacon":"40","rssi_dbm":-570}"#, "no signal strength"),
        ] {
            let told = parse(line, Clock::default()).unwrap_err().to_string();
            assert!(told.contains(expected), "{line}: {told}");
        }
    }
}
