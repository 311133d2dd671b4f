//! How strong gravity is at a place: the measure that an accelerometer's scale is calibrated with.
//!
//! Between the equator and the poles it differs by 0.5 %, as much as a scale may be off.

use std::str::FromStr;

/// A place on Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// **Units:** degrees, north positive; **Frame:** WGS84.
    pub latitude: f64,
    /// Height above the ellipsoid; that above the sea is within 110 m of it, 0.004 % of gravity. **Units:** m.
    pub height: f64,
}

/// Why a text is no [`Place`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected LAT or LAT,HEIGHT_M, latitude within 90 degrees and height within -500 to 9000 m")]
pub struct NoPlace;

impl FromStr for Place {
    type Err = NoPlace;

    fn from_str(text: &str) -> Result<Self, NoPlace> {
        let (latitude, height) = text.split_once(',').unwrap_or((text, "0"));
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| NoPlace);
        let (latitude, height) = (number(latitude)?, number(height)?);
        let possible = latitude.abs() <= 90.0 && (-500.0..=9000.0).contains(&height);
        possible.then_some(Self { latitude, height }).ok_or(NoPlace)
    }
}

/// WGS84: normal gravity at the equator, Somigliana's constant, squared eccentricity, semi-major axis, flattening, and
/// the ratio of the centrifugal force to gravity at the equator. **Units:** m/s²; 1; 1; m; 1; 1.
const EQUATOR_M_S2: f64 = 9.780_325_335_9;
const SOMIGLIANA: f64 = 1.931_852_652_41e-3;
const ECCENTRICITY_2: f64 = 6.694_379_990_14e-3;
const RADIUS_M: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;
const CENTRIFUGAL: f64 = 3.449_786_506_84e-3;

impl Place {
    /// Normal gravity (NIMA TR8350.2, third edition, equations 4-1 and 4-3). What lies below the ground changes it by
    /// 0.02 % at most places. **Units:** m/s².
    pub fn gravity(&self) -> f64 {
        let sin_2 = libm::sin(self.latitude.to_radians()).powi(2);
        let ground = EQUATOR_M_S2 * (1.0 + SOMIGLIANA * sin_2) / libm::sqrt(1.0 - ECCENTRICITY_2 * sin_2);
        let height = self.height / RADIUS_M;
        ground
            * (1.0 - 2.0 * (1.0 + FLATTENING + CENTRIFUGAL - 2.0 * FLATTENING * sin_2) * height + 3.0 * height * height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_is_that_of_the_tables() {
        let at = |latitude, height| Place { latitude, height }.gravity();
        // The same report, table 3.4.
        assert!((at(90.0, 0.0) - 9.832_184_937_8).abs() < 1e-9, "{}", at(90.0, 0.0));
        assert_eq!(at(0.0, 0.0), EQUATOR_M_S2);
        assert_eq!(at(-40.0, 0.0), at(40.0, 0.0));
        // The free-air gradient at 45 degrees, 3.086e-6 /s², to its last digit.
        assert!(((at(45.0, 0.0) - at(45.0, 100.0)) * 1e-2 - 3.086e-6).abs() < 1e-9);
    }

    #[test]
    fn a_place_is_a_latitude_and_perhaps_a_height() {
        assert_eq!("48.2, 170".parse(), Ok(Place { latitude: 48.2, height: 170.0 }));
        assert_eq!("-33".parse(), Ok(Place { latitude: -33.0, height: 0.0 }));
        for text in ["", "91", "48,1,2", "north", "nan", "48,1e5"] {
            assert_eq!(text.parse::<Place>(), Err(NoPlace), "{text}");
        }
    }
}
