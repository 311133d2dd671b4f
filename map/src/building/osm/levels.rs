//! The levels of OSM (`0`, `0;1`, `-1-2`, `0.5`) and the floors they become.

use super::data::Tags;
use crate::building::open::floor_number;
use std::collections::{BTreeMap, BTreeSet};

/// A level in hundredths: half levels are levels, too.
pub type Level = i32;

/// A list of levels is no longer. **Units:** bytes.
const LONGEST: usize = 2_000;
/// The highest and, below the ground, the lowest level that is believed.
const FARTHEST: f64 = 200.0;

/// The levels of an element: those of `level` and those on which it is repeated. None where it names none.
///
/// # Errors
/// When a value is no list of levels.
pub fn of(tags: &Tags) -> Result<BTreeSet<Level>, String> {
    let mut levels = BTreeSet::new();
    for key in ["level", "repeat_on"] {
        let text = tags.get(key).unwrap_or_default();
        if text.len() > LONGEST {
            return Err(format!("'{key}' has {} characters, more than {LONGEST}", text.len()));
        }
        for part in text.split([';', ',']).map(str::trim).filter(|part| !part.is_empty()) {
            let range =
                range(part).ok_or_else(|| format!("'{key}={part}' is no level: expected such as 0, 0;1 or 0-2"))?;
            levels.extend(range);
        }
    }
    Ok(levels)
}

/// One level, or all whole steps from one to another.
fn range(text: &str) -> Option<Vec<Level>> {
    if let Some(level) = one(text) {
        return Some(vec![level]);
    }
    // The first character may be a sign.
    let dash = text.char_indices().skip(1).find(|(_, character)| *character == '-')?.0;
    let (from, to) = (one(text[..dash].trim())?, one(text[dash + 1..].trim())?);
    Some((from.min(to)..=from.max(to)).step_by(100).collect())
}

fn one(text: &str) -> Option<Level> {
    let by_name = || floor_number(text).filter(|_| text.contains(char::is_alphabetic)).map(f64::from);
    let level = text.parse::<f64>().ok().or_else(by_name)?;
    (level.abs() <= FARTHEST).then(|| (level * 100.0).round() as Level)
}

/// Numbers, names and heights of floors by their level.
///
/// Whole levels are the numbers of the floors. Where there are half levels, floors are numbered in order from level 0, or the
/// first above it, on. The height is the level times that of a storey.
pub fn floors(levels: &BTreeSet<Level>, storey_m: f64) -> BTreeMap<Level, (i32, String, f64)> {
    let is_whole = levels.iter().all(|level| level % 100 == 0);
    let below = levels.iter().filter(|level| **level < 0).count() as i32;
    let floor = |(index, level): (i32, &Level)| {
        let number = if is_whole { level / 100 } else { index - below };
        let value = f64::from(*level) / 100.0;
        (*level, (number, format!("{value}"), value * storey_m))
    };
    (0..).zip(levels).map(floor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_lists_and_ranges() {
        let known: [(&str, &[Level]); 9] = [
            ("0", &[0]),
            ("0;1", &[0, 100]),
            ("0-2", &[0, 100, 200]),
            ("-2--1", &[-200, -100]),
            ("-1-1", &[-100, 0, 100]),
            ("1-0", &[0, 100]),
            ("0.5", &[50]),
            ("1, 3 ;", &[100, 300]),
            ("EG", &[0]),
        ];
        for (text, levels) in known {
            let read: BTreeSet<Level> = text
                .split([';', ','])
                .map(str::trim)
                .filter(|part| !part.is_empty())
                .flat_map(|part| range(part).unwrap())
                .collect();
            assert_eq!(read.into_iter().collect::<Vec<_>>(), levels, "{text}");
        }
        for text in ["roof", "-", "1-", "1-x", "1e9", "nan", "0-1e300", "--"] {
            assert_eq!(range(text), None, "{text}");
        }
    }

    #[test]
    fn half_levels_are_counted_through() {
        let numbers = |levels: &[Level]| {
            floors(&levels.iter().copied().collect(), 4.0)
                .into_values()
                .map(|floor| (floor.0, floor.2))
                .collect::<Vec<_>>()
        };
        assert_eq!(numbers(&[-100, 0, 300]), [(-1, -4.0), (0, 0.0), (3, 12.0)]);
        assert_eq!(numbers(&[-50, 0, 50, 100]), [(-1, -2.0), (0, 0.0), (1, 2.0), (2, 4.0)]);
    }
}
