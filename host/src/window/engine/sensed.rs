//! What the sensor of a shoe reads, for the plots, where the shoe tells its frames.

use super::signals::{Row, Signal};
use crate::link::raw::Samples;
use sohle_shared::sample::ImuSample;
use sohle_shared::time::Micros;
use sohle_shared::wire::message::RawItem;

/// An older sample says nothing of now. **Units:** s.
const FRESH_S: f32 = 0.2;

/// The last sample.
#[derive(Debug, Default)]
pub struct Sensed {
    samples: Samples,
    last: Option<ImuSample>,
}

impl Sensed {
    /// Takes in what went into the tracker of the shoe.
    pub fn take(&mut self, item: &RawItem) {
        self.samples.take(item, |sample, _| self.last = Some(*sample));
    }

    /// Writes what was read about this time into a row.
    pub fn write(&self, time: Micros, row: &mut Row) {
        if let Some(sample) = self.last.filter(|sample| time.since(sample.time).abs() < FRESH_S) {
            write(&sample, row);
        }
    }
}

/// Writes a sample into a row.
pub fn write(sample: &ImuSample, row: &mut Row) {
    let (accel, gyro) = (sample.accel.0, sample.gyro.0);
    let signals = [Signal::AccelX, Signal::AccelY, Signal::AccelZ, Signal::GyroX, Signal::GyroY, Signal::GyroZ];
    signals.into_iter().zip(accel.iter().chain(&gyro)).for_each(|(signal, value)| row[signal.index()] = *value);
    row[Signal::AccelNorm.index()] = accel.norm();
    row[Signal::GyroNorm.index()] = gyro.norm();
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::bmx055::Config;
    use sohle_shared::selftest::Batches;

    #[test]
    fn frames_are_plotted_once_the_shoe_has_said_how_its_sensor_is_set_and_not_when_they_are_old() {
        let batches: Vec<_> = Batches::new().take(60).map(RawItem::Batch).collect();
        let mut sensed = Sensed::default();
        let row = |sensed: &Sensed, time: Micros| {
            let mut row = [f32::NAN; Signal::COUNT];
            sensed.write(time, &mut row);
            row[Signal::AccelNorm.index()]
        };
        batches.iter().for_each(|item| sensed.take(item));
        assert!(sensed.last.is_none());
        sensed.take(&RawItem::Start(Config::default()));
        batches.iter().for_each(|item| sensed.take(item));
        let last = sensed.last.unwrap();
        // The simulated foot stands at first.
        let force = row(&sensed, last.time);
        assert!((force - 9.81).abs() < 0.5, "{force}");
        assert!(row(&sensed, last.time + 1_000_000).is_nan());
    }
}
