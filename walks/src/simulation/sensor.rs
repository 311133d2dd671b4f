//! The inertial sensor: two dies with errors and clocks of their own.
//!
//! Figures of the BMX055 after the data sheets of its parts: accelerometer BMA255 class (noise 150 µg/√Hz, offset
//! ±70 mg, ±1 mg/K, 12 bits), gyroscope BMG160 (0.014 °/s/√Hz, offset ±1 °/s, ±0.015 °/s/K, sensitivity ±1 %, cross
//! axis ±1 %, 0.1 °/s/g, sample rate ±0.3 %, 16 bits). Limits are taken as three standard deviations, except for the
//! accelerometer's offset, 15 mg: a unit at the limit would not pass for a recording in m/s², whose gravity is checked to
//! 5 %. Unfiltered, at 2 kHz, the noise of a sample is the density times the square root of half the sample rate; the dies' own low-pass
//! filters are not modelled.

use super::random::{Purpose, Random};
use nalgebra::{Matrix3, Vector3};
use sohle_shared::sample::Counts;

/// Degrees to radians.
const DEG: f64 = std::f64::consts::PI / 180.0;
/// Standard gravity. **Units:** m/s².
pub const G_M_S2: f64 = 9.806_65;

/// One die. Units are those of what it measures: m/s² or rad/s.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DieModel {
    /// Nominal sample rate. **Units:** Hz.
    pub rate: f64,
    /// Largest relative error of its clock; each unit's is drawn evenly from within.
    pub clock_error: f64,
    /// End of its range.
    pub range: f64,
    /// Width of a reading, two's complement. **Units:** bits, 2 to 16.
    pub bits: u32,
    /// White noise. **Units:** per √Hz.
    pub noise: f64,
    /// Standard deviation of an axis' offset from unit to unit.
    pub offset: f64,
    /// Standard deviation of an axis' change of offset with the temperature. **Units:** per K.
    pub offset_per_kelvin: f64,
    /// Random walk of the offset. **Units:** per √s.
    pub wander: f64,
    /// Standard deviation of an axis' relative scale error.
    pub scale: f64,
    /// Standard deviation of the share of one axis that another axis measures.
    pub cross_axis: f64,
}

impl DieModel {
    /// Weight of one bit.
    pub fn per_bit(&self) -> f64 {
        self.range / f64::from(1_u32 << (self.bits - 1))
    }
}

/// The whole sensor.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorModel {
    /// The accelerometer. **Units:** m/s².
    pub accel: DieModel,
    /// The gyroscope. **Units:** rad/s.
    pub gyro: DieModel,
    /// Standard deviation of an angular rate's dependence on an acceleration. **Units:** rad/s per m/s².
    pub gyro_per_accel: f64,
    /// Temperature at the start and after a long time, in between an exponential approach. **Units:** °C.
    pub temperature: [f64; 2],
    /// Time constant of that approach. **Units:** s.
    pub warming: f64,
}

impl Default for SensorModel {
    fn default() -> Self {
        Self::bmx055()
    }
}

impl SensorModel {
    /// A BMX055 at ±16 g and ±2000 °/s as it comes from the factory, warming up on a shoe.
    pub fn bmx055() -> Self {
        Self {
            accel: DieModel {
                rate: 2000.0,
                clock_error: 0.003,
                range: 16.0 * G_M_S2,
                bits: 12,
                noise: 150e-6 * G_M_S2,
                offset: 15e-3 * G_M_S2,
                offset_per_kelvin: 1e-3 / 3.0 * G_M_S2,
                wander: 2e-5,
                scale: 0.01 / 3.0,
                cross_axis: 0.01 / 3.0,
            },
            gyro: DieModel {
                rate: 2000.0,
                clock_error: 0.003,
                range: 2000.0 * DEG,
                bits: 16,
                noise: 0.014 * DEG,
                offset: 1.0 / 3.0 * DEG,
                offset_per_kelvin: 0.015 / 3.0 * DEG,
                wander: 5e-6,
                scale: 0.01 / 3.0,
                cross_axis: 0.01 / 3.0,
            },
            gyro_per_accel: 0.1 / 3.0 * DEG / G_M_S2,
            temperature: [22.0, 30.0],
            warming: 600.0,
        }
    }

    /// The same after a calibration on a bench has found offsets, scales and axes of the unit, which are then taken out of
    /// its readings: what is left is the change with temperature and time, noise, and a tenth of the rest.
    pub fn bmx055_calibrated() -> Self {
        let mut model = Self::bmx055();
        for die in [&mut model.accel, &mut model.gyro] {
            die.offset *= 0.1;
            die.scale *= 0.1;
            die.cross_axis *= 0.1;
        }
        model.gyro_per_accel *= 0.1;
        model
    }

    /// A sensor with the ranges, resolution and rates of the BMX055 but no other error: for finding out what a tracker
    /// owes to itself.
    pub fn ideal() -> Self {
        let mut model = Self::bmx055();
        for die in [&mut model.accel, &mut model.gyro] {
            *die = DieModel {
                clock_error: 0.0,
                noise: 0.0,
                offset: 0.0,
                offset_per_kelvin: 0.0,
                wander: 0.0,
                scale: 0.0,
                cross_axis: 0.0,
                ..*die
            };
        }
        model.gyro_per_accel = 0.0;
        model
    }

    /// Temperature of the dies at `time`. **Units:** s; °C.
    pub fn temperature_at(&self, time: f64) -> f64 {
        let [first, last] = self.temperature;
        last + (first - last) * libm::exp(-time / self.warming)
    }

    /// The number that makes no sense, and of which die.
    pub fn fault(&self) -> Option<(&'static str, &'static str, f64)> {
        for (name, die) in [("accelerometer", &self.accel), ("gyroscope", &self.gyro)] {
            if !(2..=16).contains(&die.bits) {
                return Some((name, "bits", f64::from(die.bits)));
            }
            for (what, value) in [("rate", die.rate), ("range", die.range)] {
                if !(value > 0.0 && value < 1e6) {
                    return Some((name, what, value));
                }
            }
            let not_negative = [
                ("noise", die.noise),
                ("offset", die.offset),
                ("offset_per_kelvin", die.offset_per_kelvin),
                ("wander", die.wander),
                ("scale", die.scale),
                ("cross_axis", die.cross_axis),
                ("clock_error", die.clock_error),
            ];
            for (what, value) in not_negative {
                if !(0.0..1e6).contains(&value) {
                    return Some((name, what, value));
                }
            }
            if die.clock_error > 0.5 {
                return Some((name, "clock_error", die.clock_error));
            }
        }
        let [first, last] = self.temperature;
        let finite = [("gyro_per_accel", self.gyro_per_accel), ("temperature", first), ("temperature", last)];
        if let Some((what, value)) = finite.into_iter().find(|(_, value)| !value.is_finite()) {
            return Some(("sensor", what, value));
        }
        (self.warming.is_nan() || self.warming <= 0.0).then_some(("sensor", "warming", self.warming))
    }
}

/// One die of one unit: its errors have been drawn.
#[derive(Clone, Debug)]
pub struct Die {
    model: DieModel,
    /// Time between two samples and of the first. **Units:** s.
    period: f64,
    first: f64,
    index: u64,
    response: Matrix3<f64>,
    offset: Vector3<f64>,
    per_kelvin: Vector3<f64>,
    wandered: Vector3<f64>,
    random: Random,
}

/// Temperature at which the offsets were drawn. **Units:** °C.
const REFERENCE_C: f64 = 25.0;

impl Die {
    /// Draws a unit of `model` by `unit`; its noise comes from `random`.
    pub fn new(model: DieModel, unit: &mut Random, random: Random) -> Self {
        let period = 1.0 / (model.rate * (1.0 + model.clock_error * unit.symmetric()));
        let first = if model.clock_error > 0.0 { period * unit.unit() } else { 0.0 };
        // No unit outside its data sheet is sold.
        let mut normals = || Vector3::from(unit.normals().map(|value| value.clamp(-2.5, 2.5)));
        let offset = normals() * model.offset;
        let per_kelvin = normals() * model.offset_per_kelvin;
        let mut response = Matrix3::identity();
        for row in 0..3 {
            for column in 0..3 {
                let sigma = if row == column { model.scale } else { model.cross_axis };
                response[(row, column)] += sigma * unit.normal();
            }
        }
        let wandered = Vector3::zeros();
        Self { model, period, first, index: 0, response, offset, per_kelvin, wandered, random }
    }

    /// When the next sample is due. **Units:** s.
    pub fn due(&self) -> f64 {
        self.first + self.index as f64 * self.period
    }

    /// Time between two samples by the die's own clock. **Units:** s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Weight of one bit. **Units:** m/s² or rad/s.
    pub fn per_bit(&self) -> f64 {
        self.model.per_bit()
    }

    /// Width of a reading. **Units:** bits.
    pub fn bits(&self) -> u32 {
        self.model.bits
    }

    /// What the die makes of the true value: scale and misalignment of the axes. **Units:** 1.
    pub fn response(&self) -> &Matrix3<f64> {
        &self.response
    }

    /// What it reads of nothing, now and at `temperature`. **Units:** °C; m/s² or rad/s; **Frame:** sensor.
    pub fn offset(&self, temperature: f64) -> Vector3<f64> {
        self.offset + self.per_kelvin * (temperature - REFERENCE_C) + self.wandered
    }

    /// Lets the offset wander for `seconds`.
    pub fn wander(&mut self, seconds: f64) {
        if self.model.wander > 0.0 {
            let step = self.model.wander * libm::sqrt(seconds);
            self.wandered += Vector3::from(self.random.normals()) * step;
        }
    }

    /// Reads the true value `truth` at `temperature` and goes on to the next sample. **Units:** m/s² or rad/s; °C.
    pub fn read(&mut self, truth: &Vector3<f64>, temperature: f64) -> Counts {
        let mut value = self.response * truth + self.offset(temperature);
        if self.model.noise > 0.0 {
            let sigma = self.model.noise * libm::sqrt(0.5 * self.model.rate);
            value += Vector3::from(self.random.normals()) * sigma;
        }
        self.index += 1;
        let end = f64::from(1_i32 << (self.model.bits - 1));
        let per_bit = self.model.per_bit();
        // In range by the clamp, whole by the rounding.
        Counts(std::array::from_fn(|axis| libm::round(value[axis] / per_bit).clamp(-end, end - 1.0) as i16))
    }
}

/// Both dies of one unit.
#[derive(Clone, Debug)]
pub struct Unit {
    /// The accelerometer.
    pub accel: Die,
    /// The gyroscope.
    pub gyro: Die,
    /// Angular rate measured for an acceleration. **Units:** rad/s per m/s².
    pub gyro_per_accel: Matrix3<f64>,
}

impl Unit {
    /// Draws a unit by `seed`.
    pub fn new(model: &SensorModel, seed: u64) -> Self {
        let mut unit = Random::new(seed, Purpose::Unit);
        let accel = Die::new(model.accel, &mut unit, Random::new(seed, Purpose::AccelNoise));
        let gyro = Die::new(model.gyro, &mut unit, Random::new(seed, Purpose::GyroNoise));
        let gyro_per_accel = Matrix3::from_fn(|_, _| model.gyro_per_accel * unit.normal());
        Self { accel, gyro, gyro_per_accel }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn die(model: DieModel) -> Die {
        Die::new(model, &mut Random::new(3, Purpose::Unit), Random::new(3, Purpose::AccelNoise))
    }

    #[test]
    fn one_bit_weighs_what_the_data_sheets_say() {
        let model = SensorModel::bmx055();
        assert!((model.accel.per_bit() * 128.0 - G_M_S2).abs() < 1e-9);
        assert!((model.gyro.per_bit() * 16.384 - DEG).abs() < 1e-9);
    }

    #[test]
    fn readings_end_with_the_range() {
        let mut accel = die(SensorModel::ideal().accel);
        let counts = accel.read(&Vector3::new(1e3, -1e3, G_M_S2), 25.0);
        assert_eq!(counts, Counts([2047, -2048, 128]));
        assert!(counts.saturated(12));
        let mut gyro = die(SensorModel::ideal().gyro);
        assert_eq!(gyro.read(&Vector3::new(40.0, -40.0, DEG), 25.0), Counts([32767, -32768, 16]));
    }

    #[test]
    fn noise_and_drift_are_as_large_as_the_model_says() {
        let model = DieModel { noise: 1e-2, rate: 2000.0, ..SensorModel::ideal().accel };
        let mut noisy = die(model);
        let n = 20_000;
        let squares: f64 = (0..n)
            .map(|_| f64::from(noisy.read(&Vector3::zeros(), 25.0).0[0]) * model.per_bit())
            .map(|value| value * value)
            .sum();
        let expected = 1e-4 * 1000.0 + model.per_bit() * model.per_bit() / 12.0;
        // Three standard errors of a variance from n samples.
        assert!((squares / f64::from(n) / expected - 1.0).abs() < 0.03);

        let mut drifting = die(DieModel { offset_per_kelvin: 0.1, ..SensorModel::ideal().gyro });
        let (cold, warm) = (drifting.read(&Vector3::zeros(), 25.0), drifting.read(&Vector3::zeros(), 26.0));
        assert_eq!(cold, Counts([0; 3]));
        assert_ne!(warm, cold);
    }

    #[test]
    fn the_temperature_approaches_its_end() {
        let model = SensorModel::bmx055();
        assert!((model.temperature_at(0.0) - 22.0).abs() < 1e-9);
        assert!((model.temperature_at(1e5) - 30.0).abs() < 1e-6);
    }
}
