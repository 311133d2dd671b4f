//! A recording as what a BMX055 on the same foot would have had in its registers, for the emulated shoe.
//!
//! The walk is sampled anew at 2 kHz, each die by a clock of its own, and rounded to counts at ±16 g and ±2000 °/s. What the
//! sensor of the recording did not see between its samples is not there either: it is interpolated by straight lines.

use super::Recording;
use nalgebra::Vector3;
use sohle_shared::bmx055::Config;
use sohle_shared::bmx055::counts::{Header, pair_to_bytes};
use sohle_shared::sample::ImuSample;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// The accelerometer is 0.2 % slow, the gyroscope 0.1 % fast: within the data sheet, and never together. **Units:** ns.
const PERIODS_NS: (u32, u32) = (501_000, 499_500);

/// Largest count of an accelerometer of 12 bits.
const ACCEL_END: f32 = 2_047.0;
/// Largest count of a gyroscope of 16 bits.
const GYRO_END: f32 = 32_767.0;

/// Writes the counts of both dies; returns how many pairs of frames, and how many bytes.
pub fn write(path: &Path, recording: &Recording) -> io::Result<(u32, u64)> {
    let pairs = u32::try_from(length_ns(recording) / i64::from(PERIODS_NS.0.max(PERIODS_NS.1)) + 1).unwrap_or(u32::MAX);
    let header = Header { accel_period_ns: PERIODS_NS.0, gyro_period_ns: PERIODS_NS.1, pairs };
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&header.to_bytes())?;
    for (accel, gyro) in frames(recording, &header) {
        file.write_all(&pair_to_bytes(accel, gyro))?;
    }
    let file = file.into_inner().map_err(|error| error.into_error())?;
    file.sync_all()?;
    Ok((pairs, file.metadata()?.len()))
}

fn length_ns(recording: &Recording) -> i64 {
    match (recording.samples.first(), recording.samples.last()) {
        (Some(first), Some(last)) => (last.time - first.time) * 1_000,
        _ => 0,
    }
}

fn frames(recording: &Recording, header: &Header) -> impl Iterator<Item = ([i16; 3], [i16; 3])> {
    let config = Config::default();
    let (accel_scale, gyro_scale) = (config.accel.scale(), config.gyro.scale());
    let mut accel = Line::new(&recording.samples, |sample| sample.accel.0);
    let mut gyro = Line::new(&recording.samples, |sample| sample.gyro.0);
    let (accel_period, gyro_period) = (i64::from(header.accel_period_ns), i64::from(header.gyro_period_ns));
    (0..i64::from(header.pairs)).map(move |pair| {
        let counts = |value: Vector3<f32>, scale: f32, end: f32| {
            let rounded = (value / scale).map(|value| value.round().clamp(-end - 1.0, end));
            // Within the range of the type by the clamp.
            [rounded.x as i16, rounded.y as i16, rounded.z as i16]
        };
        (
            counts(accel.at(pair * accel_period), accel_scale, ACCEL_END),
            counts(gyro.at(pair * gyro_period), gyro_scale, GYRO_END),
        )
    })
}

/// Straight lines between samples, asked for at times that only grow.
struct Line<'a, F> {
    samples: &'a [ImuSample],
    value: F,
    /// The sample before the time asked for.
    at: usize,
}

impl<'a, F: Fn(&ImuSample) -> Vector3<f32>> Line<'a, F> {
    fn new(samples: &'a [ImuSample], value: F) -> Self {
        Self { samples, value, at: 0 }
    }

    /// The value so long after the first sample. **Units:** ns.
    fn at(&mut self, since_ns: i64) -> Vector3<f32> {
        let Some(first) = self.samples.first() else { return Vector3::zeros() };
        let time_ns = |sample: &ImuSample| (sample.time - first.time) * 1_000;
        while self.samples.get(self.at + 1).is_some_and(|next| time_ns(next) <= since_ns) {
            self.at += 1;
        }
        let Some(before) = self.samples.get(self.at) else { return Vector3::zeros() };
        let from = (self.value)(before);
        let Some(after) = self.samples.get(self.at + 1) else { return from };
        let (begin, end) = (time_ns(before), time_ns(after));
        if end <= begin {
            return from;
        }
        let share = (since_ns - begin) as f64 / (end - begin) as f64;
        from + ((self.value)(after) - from) * share.clamp(0.0, 1.0) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::bmx055::counts::{HEADER_BYTES, PAIR_BYTES, pair_from_bytes};
    use sohle_shared::time::Micros;

    #[test]
    fn a_turning_sensor_is_read_at_the_times_of_its_dies() {
        // 1 m/s² and 2 rad/s more in each second, along x and z.
        let samples = (0..=100).map(|i| {
            let t = i as f32 * 0.01;
            ImuSample::new(Micros(5_000_000 + i * 10_000), [t, 0.0, 9.806_65], [0.0, -50.0, 2.0 * t])
        });
        let recording = Recording { samples: samples.collect(), ..Recording::default() };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.counts");
        let (pairs, size) = write(&path, &recording).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!((pairs, size), (1_997, bytes.len() as u64));
        let header = Header::from_bytes(bytes.first_chunk::<HEADER_BYTES>().unwrap()).unwrap();
        assert_eq!(header.pairs, pairs);
        for (pair, frame) in bytes[HEADER_BYTES..].chunks(PAIR_BYTES).enumerate() {
            let (accel, gyro) = pair_from_bytes(frame.try_into().unwrap());
            // 128 counts to 1 g; half a count of rounding, and that of f32.
            let expected = pair as f32 * 501e-6 / 9.806_65 * 128.0;
            assert!((f32::from(accel[0]) - expected).abs() < 0.51 && accel[2] == 128, "{pair}: {accel:?}");
            // 16.384 counts to 1 °/s; 50 rad/s are beyond the range.
            let expected = (pair as f32 * 2.0 * 499.5e-6).to_degrees() * 16.384;
            assert!((f32::from(gyro[2]) - expected).abs() < 0.51 && gyro[1] == i16::MIN, "{pair}: {gyro:?}");
        }
    }
}
