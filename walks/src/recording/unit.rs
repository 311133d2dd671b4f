//! Units a recording may be in, and how each becomes the project's own (s, m/s², rad/s).

use serde::{Deserialize, Serialize};
use sohle_shared::sample::STANDARD_GRAVITY_M_S2;

/// Unit of the accelerometer columns: `"m/s2"`, `"g"`, `"mg"`, or a number of m/s² for each bit of a raw reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Spelling", into = "Spelling")]
pub enum AccelUnit {
    /// m/s².
    MetrePerSecond2,
    /// Multiples of standard gravity.
    G,
    /// Thousandths of standard gravity.
    MilliG,
    /// Raw readings. **Units:** m/s² for each bit.
    PerBit(f64),
}

/// Unit of the gyroscope columns: `"rad/s"`, `"deg/s"`, `"mrad/s"`, `"mdeg/s"`, or a number of rad/s for each bit of a
/// raw reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Spelling", into = "Spelling")]
pub enum GyroUnit {
    /// rad/s.
    RadianPerSecond,
    /// deg/s.
    DegreePerSecond,
    /// Thousandths of rad/s.
    MilliradianPerSecond,
    /// Thousandths of deg/s.
    MillidegreePerSecond,
    /// Raw readings. **Units:** rad/s for each bit.
    PerBit(f64),
}

/// Unit of the time column: `"s"`, `"ms"`, `"us"`, `"ns"`, or a number of seconds for each tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Spelling", into = "Spelling")]
pub enum TimeUnit {
    /// Seconds.
    Second,
    /// Milliseconds.
    Millisecond,
    /// Microseconds.
    Microsecond,
    /// Nanoseconds.
    Nanosecond,
    /// Ticks of a clock. **Units:** s for each tick.
    PerTick(f64),
}

/// How a unit stands in a file: by name, or as the factor that leads to the project's own unit.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Spelling {
    Factor(f64),
    Name(String),
}

impl AccelUnit {
    /// The units that have a name.
    pub const NAMED: [Self; 3] = [Self::MetrePerSecond2, Self::G, Self::MilliG];

    /// What one unit is. **Units:** m/s².
    pub fn factor(self) -> f64 {
        match self {
            Self::MetrePerSecond2 => 1.0,
            Self::G => f64::from(STANDARD_GRAVITY_M_S2),
            Self::MilliG => f64::from(STANDARD_GRAVITY_M_S2) * 1e-3,
            Self::PerBit(factor) => factor,
        }
    }
}

impl GyroUnit {
    /// The units that have a name.
    pub const NAMED: [Self; 4] =
        [Self::RadianPerSecond, Self::DegreePerSecond, Self::MilliradianPerSecond, Self::MillidegreePerSecond];

    /// What one unit is. **Units:** rad/s.
    pub fn factor(self) -> f64 {
        match self {
            Self::RadianPerSecond => 1.0,
            Self::DegreePerSecond => 1_f64.to_radians(),
            Self::MilliradianPerSecond => 1e-3,
            Self::MillidegreePerSecond => 1e-3_f64.to_radians(),
            Self::PerBit(factor) => factor,
        }
    }
}

impl TimeUnit {
    /// The units that have a name.
    pub const NAMED: [Self; 4] = [Self::Second, Self::Millisecond, Self::Microsecond, Self::Nanosecond];

    /// What one unit is. **Units:** s.
    pub fn factor(self) -> f64 {
        match self {
            Self::Second => 1.0,
            Self::Millisecond => 1e-3,
            Self::Microsecond => 1e-6,
            Self::Nanosecond => 1e-9,
            Self::PerTick(factor) => factor,
        }
    }
}

/// Writes a unit as text and reads it back.
macro_rules! spelled {
    ($unit:ident, $raw:ident, $what:literal, $($variant:ident = $name:literal),+) => {
        impl std::fmt::Display for $unit {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Self::$variant => f.write_str($name),)+
                    Self::$raw(factor) => write!(f, "{factor}"),
                }
            }
        }

        impl TryFrom<Spelling> for $unit {
            type Error = String;
            fn try_from(spelling: Spelling) -> Result<Self, String> {
                match spelling {
                    $(Spelling::Name(name) if name == $name => Ok(Self::$variant),)+
                    Spelling::Factor(factor) if factor.is_finite() && factor > 0.0 => Ok(Self::$raw(factor)),
                    Spelling::Factor(factor) => Err(format!(concat!($what, " must be above 0, not {}"), factor)),
                    Spelling::Name(name) => Err(format!(
                        concat!("'{}' is no ", $what, "; known: ", $($name, ", ",)+ "or a factor"),
                        name
                    )),
                }
            }
        }

        impl From<$unit> for Spelling {
            fn from(unit: $unit) -> Self {
                match unit {
                    $unit::$raw(factor) => Self::Factor(factor),
                    named => Self::Name(named.to_string()),
                }
            }
        }
    };
}

spelled!(AccelUnit, PerBit, "accelerometer unit", MetrePerSecond2 = "m/s2", G = "g", MilliG = "mg");
spelled!(
    GyroUnit,
    PerBit,
    "gyroscope unit",
    RadianPerSecond = "rad/s",
    DegreePerSecond = "deg/s",
    MilliradianPerSecond = "mrad/s",
    MillidegreePerSecond = "mdeg/s"
);
spelled!(TimeUnit, PerTick, "time unit", Second = "s", Millisecond = "ms", Microsecond = "us", Nanosecond = "ns");

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Units {
        accel: AccelUnit,
        gyro: GyroUnit,
        time: TimeUnit,
    }

    #[test]
    fn units_are_read_by_name_and_by_factor_and_written_back() {
        for text in
            ["accel = \"mg\"\ngyro = \"deg/s\"\ntime = \"us\"\n", "accel = 0.00239\ngyro = 0.0001\ntime = 0.5\n"]
        {
            let units: Units = toml::from_str(text).unwrap();
            assert_eq!(toml::to_string(&units).unwrap(), text);
        }
    }

    #[test]
    fn an_unknown_unit_names_the_known_ones() {
        let error = toml::from_str::<Units>("accel = \"G\"\ngyro = \"rad/s\"\ntime = \"s\"").unwrap_err();
        assert!(error.message().contains("'G' is no accelerometer unit; known: m/s2, g, mg, or a factor"), "{error}");
        assert!(toml::from_str::<Units>("accel = -1.0\ngyro = \"rad/s\"\ntime = \"s\"").is_err());
        assert!(toml::from_str::<Units>("accel = nan\ngyro = \"rad/s\"\ntime = \"s\"").is_err());
    }
}
