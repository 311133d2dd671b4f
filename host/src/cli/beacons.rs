//! `--start beacon`: where and when a recorded walk begins, by what was heard of the beacons above the entrances.

use super::fixes::Source;
use super::{Error, print};
use crate::building::Building;
use crate::fixes::beacon::{self, LOUD_DBM, Reading};
use crate::fixes::line::Clock;
use crate::follow;
use crate::particle::{Start, StartPlace};
use sohle_shared::time::Micros;

/// The word for it.
const BEACON: &str = "beacon";
/// How well the entrance is known (standard deviation). **Units:** m.
const SIGMA_M: f32 = 1.0;
/// And the direction through its door: nobody comes in exactly across it. **Units:** rad.
const HEADING_SIGMA: f32 = 0.35;

/// What was heard of beacons.
#[derive(Debug, clap::Args)]
pub struct Beacons {
    /// What was heard of beacons, for --start beacon: a JSON object to a line (docs/fixes.md); '-' is the standard input
    #[arg(long, value_name = "FILE|-")]
    beacons: Option<Source>,
    /// Whose beacon is heard louder than this is at it
    #[arg(long, value_name = "DBM", default_value_t = LOUD_DBM, allow_hyphen_values = true)]
    beacon_dbm: f64,
}

/// Where a walk begins, and after which moment: at a start in words, or by a beacon.
pub fn start(args: &Beacons, text: &str, building: &Building, clock: Clock) -> Result<(Start, Micros), Error> {
    let by_beacon = text.trim() == BEACON;
    let source = match (&args.beacons, by_beacon) {
        (Some(source), true) => source,
        (None, true) => return Err(Error::new("--start beacon: expected --beacons FILE, what was heard of them")),
        (Some(_), false) => return Err(Error::new(format!("--beacons is for --start beacon, not for --start {text}"))),
        (None, false) => return Ok((follow::start::parse(building, text)?, Micros(i64::MIN))),
    };
    let mut readings: Vec<Reading> = Vec::new();
    for (index, line) in source.text("beacons")?.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let wrong = |why| Error::new(format!("{source}, line {}: {why}", index + 1));
        readings.push(beacon::parse(line, clock).map_err(wrong)?);
    }
    let entered = beacon::entered(building, &readings, args.beacon_dbm)?;
    let (entrance, reading) = (entered.entrance, entered.reading);
    print(&format!(
        "begins at entrance '{}' of floor {} after {:.1} s: beacon '{}' with {} dBm\n",
        entrance.name,
        entrance.floor,
        reading.time.as_seconds(),
        reading.beacon,
        reading.rssi_dbm
    ))?;
    let place = StartPlace {
        sigma_m: SIGMA_M,
        heading: entered.heading.map(|heading| (heading as f32, HEADING_SIGMA)),
        ..StartPlace::exactly(entrance.floor, entrance.place.map(|value| value as f32))
    };
    Ok((Start::At(vec![place]), reading.time))
}
