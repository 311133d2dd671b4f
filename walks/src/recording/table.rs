//! From rows of numbers to samples: what text files and MATLAB files have in common.

use super::error::{MOST_BACKWARDS_S, Problem};
use super::mapping::{Column, Mapping};
use super::unit::{AccelUnit, GyroUnit};
use super::{Irregularities, Recording, SensorRange};
use sohle_shared::sample::{Clipped, ImuSample, STANDARD_GRAVITY_M_S2};
use sohle_shared::time::Micros;

/// A reading counts as clipped from this part of the range on. Bias, scale and the sensor's own filter move readings at
/// the end of the range by about a percent: those of run 34 (range 8.727 rad/s) lie between 8.60 and 8.78.
const CLIPPED_FROM: f64 = 0.985;
/// A step of time longer than this many usual ones is a gap.
const GAP: f64 = 2.5;
/// Time stamps further from zero are taken for damage. **Units:** s; about 300 years.
const LATEST_S: f64 = 1e10;
/// So many columns are listed in an error.
const LISTED: usize = 40;

/// One row as it stands in the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// `None` when the samples come at a fixed rate.
    pub time: Option<f64>,
    /// In the unit of the file.
    pub accel: [f64; 3],
    /// In the unit of the file.
    pub gyro: [f64; 3],
}

/// Where the numbers of a [`Row`] stand among the columns of a file, counted from 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    pub time: Option<usize>,
    pub accel: [usize; 3],
    pub gyro: [usize; 3],
}

impl Places {
    /// Finds the columns of `mapping` among `names`.
    pub fn find(mapping: &Mapping, names: &[String]) -> Result<Self, Problem> {
        let all = |columns: &Option<[Column; 3]>, purpose, missing| -> Result<[usize; 3], Problem> {
            let [x, y, z] = columns.as_ref().ok_or(Problem::Incomplete(missing))?;
            Ok([place(x, names, purpose)?, place(y, names, purpose)?, place(z, names, purpose)?])
        };
        Ok(Self {
            accel: all(&mapping.accel, "the accelerometer", "which columns are the accelerometer (accel)")?,
            gyro: all(&mapping.gyro, "the gyroscope", "which columns are the gyroscope (gyro)")?,
            time: mapping.time.as_ref().map(|column| place(column, names, "the time")).transpose()?,
        })
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        self.time.into_iter().chain(self.accel).chain(self.gyro)
    }

    /// Puts a row together from the number at each place.
    pub fn row<E>(&self, mut number: impl FnMut(usize) -> Result<f64, E>) -> Result<Row, E> {
        let mut three = |[x, y, z]: [usize; 3]| Ok([number(x)?, number(y)?, number(z)?]);
        let (accel, gyro) = (three(self.accel)?, three(self.gyro)?);
        Ok(Row { time: self.time.map(number).transpose()?, accel, gyro })
    }
}

fn place(column: &Column, names: &[String], purpose: &'static str) -> Result<usize, Problem> {
    let mut fitting = names.iter().enumerate().filter(|(index, name)| column.fits(name, *index));
    match (fitting.next(), fitting.next()) {
        (Some((index, _)), None) => Ok(index),
        (Some((_, first)), Some((_, second))) => Err(Problem::Malformed(format!(
            "column {column} for {purpose} is there more than once ('{first}', '{second}'); give its number instead"
        ))),
        (None, _) => Err(Problem::MissingColumn { wanted: column.to_string(), purpose, present: listed(names) }),
    }
}

/// Column names for an error.
pub(super) fn listed(names: &[String]) -> String {
    let mut text = names.iter().take(LISTED).map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
    if names.len() > LISTED {
        text += &format!(" and {} more", names.len() - LISTED);
    }
    text
}

/// How the time of a row is found.
#[derive(Clone, Copy, Debug)]
enum Clock {
    /// Samples at a fixed rate. **Units:** Hz.
    Rate(f64),
    /// Stamps. **Units:** s for each tick.
    Stamps(f64),
    /// A counter that is set back now and then. **Units:** s for each tick.
    Counter(f64),
}

/// Collects samples.
pub(super) struct Collector {
    clock: Clock,
    accel_factor: f64,
    gyro_factor: f64,
    mapping: Mapping,
    range: SensorRange,
    samples: Vec<ImuSample>,
    /// Readings of a counter, to be turned into times at the end.
    counts: Vec<f64>,
    latest: Option<Micros>,
}

impl Collector {
    /// For rows that follow `mapping`.
    pub fn new(mapping: &Mapping) -> Result<Self, Problem> {
        let clock = match (mapping.rate_hz, &mapping.time) {
            (Some(rate), _) => Clock::Rate(rate),
            (None, None) => return Err(Problem::Incomplete("when samples were taken (time or rate_hz)")),
            (None, Some(_)) => {
                let unit = mapping.time_unit.ok_or(Problem::Incomplete("the unit of the time (time_unit)"))?;
                match mapping.counter {
                    Some(true) => Clock::Counter(unit.factor()),
                    _ => Clock::Stamps(unit.factor()),
                }
            }
        };
        let accel = mapping.accel_unit.ok_or(Problem::Incomplete("the unit of the accelerometer (accel_unit)"))?;
        let gyro = mapping.gyro_unit.ok_or(Problem::Incomplete("the unit of the gyroscope (gyro_unit)"))?;
        Ok(Self {
            clock,
            accel_factor: AccelUnit::factor(accel),
            gyro_factor: GyroUnit::factor(gyro),
            range: range(mapping),
            mapping: mapping.clone(),
            samples: Vec::new(),
            counts: Vec::new(),
            latest: None,
        })
    }

    /// How many samples there are so far.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Takes a row in; `place` names it (line or row) if it is refused.
    pub fn push(&mut self, row: Row, place: impl Fn() -> String) -> Result<(), Problem> {
        let axes = self.mapping.axes.unwrap_or_default();
        let accel = axes.turn(row.accel).map(|value| value * self.accel_factor);
        let gyro = axes.turn(row.gyro).map(|value| value * self.gyro_factor);
        let time = match self.clock {
            Clock::Rate(rate) => Micros::from_seconds(self.samples.len() as f64 / rate),
            Clock::Counter(_) => {
                self.counts.push(row.time.unwrap_or_default());
                Micros(0)
            }
            Clock::Stamps(factor) => {
                let seconds = row.time.unwrap_or_default() * factor;
                if seconds.abs() > LATEST_S {
                    let what = format!("time {seconds:e} s is out of range");
                    return Err(Problem::Value { place: place(), what });
                }
                Micros::from_seconds(seconds)
            }
        };
        let mut sample = ImuSample::new(time, accel.map(|value| value as f32), gyro.map(|value| value as f32));
        if !sample.is_finite() {
            return Err(Problem::Value { place: place(), what: "a value is too large".into() });
        }
        let beyond = |values: [f64; 3], end: Option<f32>| {
            end.is_some_and(|end| values.iter().any(|value| value.abs() >= CLIPPED_FROM * f64::from(end)))
        };
        sample.clipped = Clipped { accel: beyond(accel, self.range.accel), gyro: beyond(gyro, self.range.gyro) };
        forwards(&mut self.latest, time, place)?;
        self.samples.push(sample);
        Ok(())
    }

    /// The recording, its values checked to be in the units stated.
    pub fn finish(mut self) -> Result<Recording, Problem> {
        if let Clock::Counter(factor) = self.clock {
            for (sample, seconds) in self.samples.iter_mut().zip(unrolled(&self.counts)) {
                sample.time = Micros::from_seconds(seconds * factor);
            }
        }
        let irregularities = irregularities(&self.samples);
        super::check::units(&self.samples, &self.mapping)?;
        Ok(Recording { samples: self.samples, range: self.range, irregularities, ..Recording::default() })
    }
}

/// The range that a mapping states.
fn range(mapping: &Mapping) -> SensorRange {
    SensorRange {
        accel: mapping.accel_range_g.map(|end| (end * f64::from(STANDARD_GRAVITY_M_S2)) as f32),
        gyro: mapping.gyro_range_deg_s.map(|end| end.to_radians() as f32),
    }
}

/// Refuses a `time` far before the `latest` so far.
pub(super) fn forwards(latest: &mut Option<Micros>, time: Micros, place: impl Fn() -> String) -> Result<(), Problem> {
    let before = latest.map_or(0, |latest| latest - time) as f64 * 1e-6;
    if before > MOST_BACKWARDS_S {
        return Err(Problem::Backwards { place: place(), seconds: before });
    }
    *latest = Some(latest.map_or(time, |latest| latest.max(time)));
    Ok(())
}

/// Readings of a counter as ticks since the first, a fall taken as one usual step.
fn unrolled(counts: &[f64]) -> Vec<f64> {
    let mut steps: Vec<f64> =
        counts.windows(2).filter_map(|pair| pair.last().zip(pair.first())).map(|(b, a)| b - a).collect();
    let mut forward: Vec<f64> = steps.iter().copied().filter(|&step| step > 0.0).collect();
    let usual = median(&mut forward).unwrap_or(0.0);
    let mut ticks = 0.0;
    for step in &mut steps {
        ticks += if *step < 0.0 { usual } else { *step };
        *step = ticks;
    }
    std::iter::once(0.0).chain(steps).take(counts.len()).collect()
}

/// The middle value (the upper of two), in any order.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The usual step of time: the median of those that go forward. **Units:** s.
pub(super) fn usual_period(samples: &[ImuSample]) -> Option<f64> {
    let mut steps: Vec<f64> = samples
        .windows(2)
        .map(|pair| pair[1].time - pair[0].time)
        .filter(|&us| us > 0)
        .map(|us| us as f64 * 1e-6)
        .collect();
    median(&mut steps)
}

/// Counts what is irregular.
pub(super) fn irregularities(samples: &[ImuSample]) -> Irregularities {
    let mut counts = Irregularities::default();
    let gap_us = usual_period(samples).map_or(f64::INFINITY, |period| period * GAP * 1e6);
    for pair in samples.windows(2) {
        let step = pair[1].time - pair[0].time;
        counts.repeated += usize::from(step == 0);
        counts.backwards += usize::from(step < 0);
        counts.gaps += usize::from(step as f64 > gap_us);
        counts.longest_gap_us = counts.longest_gap_us.max(step);
    }
    counts.accel_clipped = samples.iter().filter(|sample| sample.clipped.accel).count();
    counts.gyro_clipped = samples.iter().filter(|sample| sample.clipped.gyro).count();
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_is_set_back_goes_on_by_its_usual_step() {
        assert_eq!(unrolled(&[100.0, 110.0, 120.0, 3.0, 13.0, 23.0]), [0.0, 10.0, 20.0, 30.0, 40.0, 50.0]);
        assert_eq!(unrolled(&[5.0]), [0.0]);
        assert!(unrolled(&[]).is_empty());
    }

    #[test]
    fn repeats_gaps_and_backward_steps_are_counted() {
        let times = [0, 10, 20, 20, 30, 80, 75, 90, 100];
        let samples = times.map(|ms| ImuSample::new(Micros(ms * 1000), [0.0; 3], [0.0; 3]));
        let expected =
            Irregularities { repeated: 1, backwards: 1, gaps: 1, longest_gap_us: 50_000, ..Default::default() };
        assert_eq!(irregularities(&samples), expected);
        assert_eq!(irregularities(&[]), Irregularities::default());
    }

    #[test]
    fn small_steps_back_may_not_add_up() {
        let mut latest = None;
        let place = || "line 9".to_owned();
        for ms in [5000, 4500, 4000] {
            forwards(&mut latest, Micros(ms * 1000), place).unwrap();
        }
        let message = forwards(&mut latest, Micros(3_900_000), place).unwrap_err().to_string();
        assert!(message.starts_with("line 9: time runs backwards by 1.100 s"), "{message}");
    }
}
