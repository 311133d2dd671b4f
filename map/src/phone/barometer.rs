//! Height from the air pressure.

/// Settings of [`Barometer`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How fast the height follows the pressure (Graph, 6.17). **Units:** s.
    pub follow_s: f64,
    /// Noise of the followed height from step to step (standard deviation). **Units:** m.
    pub sigma_m: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self { follow_s: 0.7, sigma_m: 0.15 }
    }
}

/// Follows the height with an alpha-beta filter (Graph, 6.17).
#[derive(Clone, Debug)]
pub struct Barometer {
    parameters: Parameters,
    height: Option<f64>,
    climb: f64,
}

/// The international height formula (Graph, 3.6). **Units:** m from hPa.
pub fn height(pressure: f64) -> f64 {
    44_330.0 * (1.0 - (pressure / 1_013.25).powf(1.0 / 5.255))
}

impl Barometer {
    /// Nothing is known yet.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, height: None, climb: 0.0 }
    }

    /// Takes in a pressure, `dt` seconds after the last. **Units:** hPa.
    pub fn push(&mut self, pressure: f64, dt: f64) {
        if !(300.0..1_200.0).contains(&pressure) {
            return;
        }
        let measured = height(pressure);
        let Some(before) = self.height else {
            self.height = Some(measured);
            return;
        };
        // Critically damped: both poles at exp(-dt / T).
        let pole = (-dt / self.parameters.follow_s).exp();
        let (alpha, beta) = (1.0 - pole * pole, (1.0 - pole) * (1.0 - pole));
        let predicted = before + self.climb * dt;
        let off = measured - predicted;
        self.height = Some(predicted + alpha * off);
        if dt > 0.0 {
            self.climb += beta / dt * off;
        }
    }

    /// **Units:** m above the level of 1013.25 hPa.
    pub fn height(&self) -> Option<f64> {
        self.height
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_formula_is_the_international_one() {
        // 8.43 m for each hPa at the ground.
        assert!((height(1_012.25) - height(1_013.25) - 8.33).abs() < 0.05);
        assert!((height(898.75) - 1_000.0).abs() < 1.0, "{}", height(898.75));
    }

    #[test]
    fn a_flight_of_stairs_is_followed_and_nonsense_is_not() {
        let mut barometer = Barometer::new(&Parameters::default());
        let pressure = |height: f64| 1_013.25 * (1.0 - height / 44_330.0).powf(5.255);
        for i in 0..200 {
            barometer.push(pressure(0.05 * f64::from(i.min(72))), 0.1);
        }
        assert!((barometer.height().unwrap() - 3.6).abs() < 0.01);
        barometer.push(f64::NAN, 0.1);
        barometer.push(0.0, 0.1);
        assert!((barometer.height().unwrap() - 3.6).abs() < 0.01);
    }
}
