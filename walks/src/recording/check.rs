//! Whether the values of a recording are in the units stated for them.
//!
//! A wrong unit makes every later number wrong without any sign of it. Three things are known of every foot: at rest the
//! accelerometer reads gravity, a walking foot turns at 1 to 45 rad/s, and it is sampled at tens to thousands of hertz.

use super::error::Problem;
use super::mapping::Mapping;
use super::table::{median, usual_period};
use super::unit::{AccelUnit, GyroUnit, TimeUnit};
use sohle_shared::sample::ImuSample;

/// Gravity that is expected at rest. **Units:** m/s².
const GRAVITY_M_S2: f64 = 9.81;
/// Part of it that a reading at rest may be off.
const GRAVITY_TOLERANCE: f64 = 0.05;
/// The same for a recording that is never at rest for a second. A stance of a run is off by up to a quarter, a wrong
/// unit by a factor of ten.
const MOVING_TOLERANCE: f64 = 0.4;
/// Spread of the magnitude, relative to it, below which the stillest second counts as rest.
const STILL_SPREAD: f64 = 0.03;
/// A foot that runs stands for so long. **Units:** s.
const STANCE_S: f64 = 0.1;
/// A foot stays below this for 99 % of the time, running and kicking included. **Units:** rad/s.
const FASTEST_RAD_S: f64 = 60.0;
/// A foot that moves gets beyond this for more than 1 % of the time. **Units:** rad/s.
const SLOWEST_RAD_S: f64 = 0.25;
/// Spread of the accelerometer's magnitude beyond which a foot surely moves. **Units:** m/s²; walks have 4 and more.
const MOVING_M_S2: f64 = 2.0;
/// Rates of the sensors that are worn on shoes, widely. **Units:** Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 5.0..=20_000.0;

/// The stillest time of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rest {
    /// Median magnitude of the accelerometer. **Units:** m/s².
    pub accel: f64,
    /// Median magnitude of the gyroscope. **Units:** rad/s.
    pub gyro: f64,
    /// Whether the foot was at rest for a whole second.
    pub still: bool,
}

/// The stillest second or, if the foot is at rest in none, the stillest stance.
pub(super) fn rest(samples: &[ImuSample]) -> Option<Rest> {
    let second = stillest(samples, 1.0)?;
    if second.still {
        return Some(second);
    }
    Some(Rest { still: false, ..stillest(samples, STANCE_S)? })
}

/// Finds the stillest time of a length: least turning and least change of acceleration, each relative to the whole
/// recording.
fn stillest(samples: &[ImuSample], seconds: f64) -> Option<Rest> {
    let length = usual_period(samples).map_or(samples.len(), |period| (seconds / period).round() as usize);
    let length = length.clamp(1, samples.len().max(1));
    let vector = |sample: &ImuSample| sample.accel.0.map(f64::from);
    let energy = |sample: &ImuSample| sample.gyro.0.map(f64::from).norm_squared();
    let count = samples.len() as f64;
    let mean = samples.iter().map(vector).sum::<nalgebra::Vector3<f64>>() / count;
    let accel_scale = samples.iter().map(|sample| (vector(sample) - mean).norm_squared()).sum::<f64>() / count;
    let gyro_scale = samples.iter().map(energy).sum::<f64>() / count;
    let relative = |value: f64, scale: f64| if scale > 0.0 { value / scale } else { 0.0 };

    // Sums over the window that ends at each sample, kept by adding the newest and taking the oldest out.
    let (mut sum, mut squares, mut turning) = (nalgebra::Vector3::zeros(), 0.0, 0.0);
    let mut best: Option<(f64, usize)> = None;
    for (index, sample) in samples.iter().enumerate() {
        let offset = vector(sample) - mean;
        sum += offset;
        squares += offset.norm_squared();
        turning += energy(sample);
        if let Some(oldest) = index.checked_sub(length).and_then(|index| samples.get(index)) {
            let offset = vector(oldest) - mean;
            sum -= offset;
            squares -= offset.norm_squared();
            turning -= energy(oldest);
        }
        let size = length as f64;
        let variance = squares / size - (sum / size).norm_squared();
        let score = relative(variance, accel_scale) + relative(turning / size, gyro_scale);
        if index + 1 >= length && best.is_none_or(|(least, _)| score < least) {
            best = Some((score, index + 1));
        }
    }
    let window = samples.get(best?.1 - length..best?.1)?;
    let mut accel: Vec<f64> = window.iter().map(|sample| vector(sample).norm()).collect();
    let mut gyro: Vec<f64> = window.iter().map(|sample| energy(sample).sqrt()).collect();
    let middle = median(&mut accel)?;
    let still = spread(&accel) <= STILL_SPREAD * middle;
    Some(Rest { accel: middle, gyro: median(&mut gyro)?, still })
}

/// Standard deviation.
fn spread(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count).sqrt()
}

/// Refuses samples that contradict the units of `mapping`, with the unit that would fit.
pub(super) fn units(samples: &[ImuSample], mapping: &Mapping) -> Result<(), Problem> {
    rate(samples, mapping)?;
    if let Some(rest) = rest(samples) {
        gravity(rest, mapping.accel_unit)?;
        turning(samples, mapping.gyro_unit)?;
    }
    Ok(())
}

/// The hint at the end of an error.
fn hint(fitting: Option<String>) -> String {
    fitting.map_or_else(String::new, |unit| format!(": is this in {unit}?"))
}

fn near(value: f64, tolerance: f64) -> bool {
    (value / GRAVITY_M_S2 - 1.0).abs() <= tolerance
}

fn gravity(rest: Rest, unit: Option<AccelUnit>) -> Result<(), Problem> {
    if near(rest.accel, if rest.still { GRAVITY_TOLERANCE } else { MOVING_TOLERANCE }) {
        return Ok(());
    }
    let stated = unit.unwrap_or(AccelUnit::MetrePerSecond2);
    let raw = rest.accel / stated.factor();
    let fitting = AccelUnit::NAMED.into_iter().find(|other| near(raw * other.factor(), GRAVITY_TOLERANCE));
    let exchanged =
        fitting.is_none() && (near(rest.gyro, GRAVITY_TOLERANCE) || (rest.gyro - 1.0).abs() < GRAVITY_TOLERANCE);
    let advice = if exchanged {
        ": are accelerometer and gyroscope exchanged?".into()
    } else {
        hint(fitting.map(|unit| unit.to_string()))
    };
    Err(Problem::Unit(format!(
        "the accelerometer taken as {stated} reads {:.4} m/s² at rest, expected {GRAVITY_M_S2} within {:.0} %{advice}",
        rest.accel,
        GRAVITY_TOLERANCE * 100.0
    )))
}

fn turning(samples: &[ImuSample], unit: Option<GyroUnit>) -> Result<(), Problem> {
    let mut rates: Vec<f64> = samples.iter().map(|sample| f64::from(sample.gyro.0.norm())).collect();
    let place = rates.len() * 99 / 100;
    if place >= rates.len() {
        return Ok(());
    }
    let fast = *rates.select_nth_unstable_by(place, f64::total_cmp).1;
    let magnitudes: Vec<f64> = samples.iter().map(|sample| f64::from(sample.accel.0.norm())).collect();
    let moving = spread(&magnitudes) > MOVING_M_S2;
    let why = if fast > FASTEST_RAD_S {
        "more than a foot can"
    } else if moving && fast < SLOWEST_RAD_S {
        "less than a moving foot does"
    } else {
        return Ok(());
    };
    let stated = unit.unwrap_or(GyroUnit::RadianPerSecond);
    let raw = fast / stated.factor();
    let fitting = GyroUnit::NAMED.into_iter().find(|other| (1.0..=45.0).contains(&(raw * other.factor())));
    let hint = hint(fitting.map(|unit| unit.to_string()));
    Err(Problem::Unit(format!("the gyroscope taken as {stated} turns at up to {fast:.4} rad/s, {why}{hint}")))
}

fn rate(samples: &[ImuSample], mapping: &Mapping) -> Result<(), Problem> {
    if mapping.rate_hz.is_some() || samples.len() < 2 {
        return Ok(());
    }
    let Some(period) = usual_period(samples) else {
        return Err(Problem::Unit("the time column stands still".into()));
    };
    if RATES_HZ.contains(&(1.0 / period)) {
        return Ok(());
    }
    let stated = mapping.time_unit.unwrap_or(TimeUnit::Second);
    let raw = period / stated.factor();
    // Among the units that give a possible rate, the one that gives the likeliest.
    let distance = |unit: &TimeUnit| (raw * unit.factor() * 200.0).ln().abs();
    let fitting = TimeUnit::NAMED
        .into_iter()
        .filter(|unit| RATES_HZ.contains(&(1.0 / (raw * unit.factor()))))
        .min_by(|one, other| distance(one).total_cmp(&distance(other)));
    let hint = hint(fitting.map(|unit| unit.to_string()));
    Err(Problem::Unit(format!(
        "the time taken as {stated} gives a sample every {period:.6} s, expected {} to {} Hz{hint}",
        RATES_HZ.start(),
        RATES_HZ.end()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::time::Micros;

    /// Two seconds of rest, then strides: every second one swing that turns at 6 rad/s.
    fn walk(accel_factor: f32, gyro_factor: f32) -> Vec<ImuSample> {
        (0..1200)
            .map(|index| {
                let phase = (index % 200) as f32 / 200.0 * std::f32::consts::TAU;
                let swing = if index < 400 { 0.0 } else { phase.sin().max(0.0) };
                let accel = [20.0 * swing * phase.cos(), 0.3, 9.8 + 8.0 * swing].map(|value| value * accel_factor);
                let gyro = [0.01, 6.0 * swing, -0.01].map(|value| value * gyro_factor);
                ImuSample::new(Micros(index * 5000), accel, gyro)
            })
            .collect()
    }

    fn message(samples: &[ImuSample], mapping: &str) -> String {
        units(samples, &toml::from_str(mapping).unwrap()).unwrap_err().to_string()
    }

    #[test]
    fn right_units_pass() {
        units(&walk(1.0, 1.0), &Mapping::default()).unwrap();
        units(&[], &Mapping::default()).unwrap();
        units(&walk(1.0, 1.0)[..1], &Mapping::default()).unwrap();
    }

    #[test]
    fn the_unit_that_would_fit_is_named() {
        let g = 1.0 / 9.80665;
        assert!(message(&walk(g, 1.0), "accel_unit = 'm/s2'").ends_with("within 5 %: is this in g?"));
        assert!(message(&walk(1e3 * g, 1.0), "").ends_with("is this in mg?"));
        assert!(message(&walk(9.80665, 1.0), "accel_unit = 'g'").ends_with("is this in m/s2?"));
        assert!(message(&walk(1.07, 1.0), "").ends_with("within 5 %"));
        assert!(message(&walk(1.0, 57.3), "gyro_unit = 'rad/s'").ends_with("more than a foot can: is this in deg/s?"));
        assert!(message(&walk(1.0, 1.0 / 57.3), "gyro_unit = 'deg/s'").ends_with("is this in rad/s?"));
    }

    #[test]
    fn exchanged_sensors_are_noticed() {
        let mut samples = walk(1.0, 1.0);
        for sample in &mut samples {
            std::mem::swap(&mut sample.accel.0, &mut sample.gyro.0);
        }
        assert!(message(&samples, "").contains("exchanged"), "{}", message(&samples, ""));
    }

    #[test]
    fn a_wrong_time_unit_is_noticed() {
        let mut samples = walk(1.0, 1.0);
        for sample in &mut samples {
            sample.time.0 *= 1000;
        }
        assert!(message(&samples, "time_unit = 's'").ends_with("is this in ms?"), "{}", message(&samples, ""));
        for sample in &mut samples {
            sample.time.0 = 7;
        }
        assert!(message(&samples, "time_unit = 's'").contains("stands still"));
    }

    #[test]
    fn a_recording_that_is_never_at_rest_passes_unless_a_unit_is_wrong() {
        let moving = walk(1.0, 1.0).split_off(400);
        assert!(!rest(&moving).unwrap().still);
        units(&moving, &Mapping::default()).unwrap();
        let in_g: Vec<_> = moving
            .iter()
            .map(|sample| {
                let mut sample = *sample;
                sample.accel.0 /= 9.80665;
                sample
            })
            .collect();
        assert!(units(&in_g, &Mapping::default()).is_err());
    }

    #[test]
    fn every_part_of_a_real_run_passes_and_none_in_another_unit() {
        let Some(folder) = crate::recording::recordings_dir() else { return };
        let run = crate::recording::open(&folder.join("foot_koroglu_gcp/exp34_imu.csv"), None).unwrap();
        for part in run.samples.chunks(600) {
            units(part, &Mapping::default()).unwrap();
            for factor in [1.0 / 9.80665, 9.80665, 1000.0 / 9.80665] {
                let mut wrong = part.to_vec();
                wrong.iter_mut().for_each(|sample| sample.accel.0 *= factor);
                assert!(units(&wrong, &Mapping::default()).is_err());
            }
            for factor in [57.3, 1.0 / 57.3] {
                let mut wrong = part.to_vec();
                wrong.iter_mut().for_each(|sample| sample.gyro.0 *= factor);
                // A part in which the foot does not move tells nothing about the unit of its turning.
                let moves = part.iter().any(|sample| sample.gyro.0.norm() > 3.0);
                assert_eq!(units(&wrong, &Mapping::default()).is_err(), moves);
            }
        }
    }
}
