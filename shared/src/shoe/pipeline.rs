//! From the batches of the sensor to steps: one way, on the shoe and wherever its raw recording is computed again.

use crate::bmx055::{Batch, Config, Merger};
use crate::calibration::Calibration;
use crate::sample::ImuSample;
use crate::time::Micros;
use crate::tracker::{Order, Output, Parameters, Tracker};

/// Merger, calibration and tracker. What it tells is a function of what it was given alone.
#[derive(Clone, Debug)]
pub struct Pipeline {
    merger: Merger,
    calibration: Calibration,
    tracker: Tracker,
}

impl Pipeline {
    /// Nothing has come yet.
    pub fn new(sensor: &Config, parameters: &Parameters, calibration: &Calibration) -> Self {
        Self { merger: Merger::new(sensor), calibration: *calibration, tracker: Tracker::new(parameters) }
    }

    /// Takes in what one die read; tells each sample that this completes, corrected, and what the tracker made of it.
    pub fn push(&mut self, batch: &Batch, mut sink: impl FnMut(&ImuSample, &Output, &Tracker)) {
        let temperature = batch.temperature.map(celsius);
        let (calibration, tracker) = (&self.calibration, &mut self.tracker);
        self.merger.push(batch, |sample| {
            let sample = calibration.apply(sample, temperature);
            let output = tracker.push(&sample);
            sink(&sample, &output, tracker);
        });
    }

    /// As new: clocks, samples that wait for the other die, and the tracker.
    pub fn reset(&mut self) {
        self.merger.reset();
        self.tracker.reset();
    }

    /// As new, with other values.
    pub fn restart(&mut self, sensor: &Config, parameters: &Parameters, calibration: &Calibration) {
        self.merger.restart(sensor);
        self.calibration = *calibration;
        self.tracker.restart(parameters);
    }

    /// What corrects the samples.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Carries an order out; whether it could be.
    pub fn obey(&mut self, order: Order) -> bool {
        self.tracker.obey(order)
    }

    /// The sensor slept while the foot stood, until `time`.
    pub fn stood_until(&mut self, time: Micros) {
        self.tracker.stood_until(time);
    }

    /// The tracker as it is.
    pub fn tracker(&self) -> &Tracker {
        &self.tracker
    }
}

/// What the temperature register says. **Units:** °C, from steps of 0.5 K around 23 °C (BMX055 accelerometer, register
/// 0x08).
pub fn celsius(register: i8) -> f32 {
    23.0 + 0.5 * f32::from(register)
}
