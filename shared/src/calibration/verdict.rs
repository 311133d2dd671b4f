//! Is the sensor good enough? Each property with its number, the limit and what that means.
//!
//! Limits are those of the data sheets of the BMX055's dies (accelerometer: BMA255 class; gyroscope: BMI088 data sheet
//! BST-BMI088-DS000-19, table 5, the same die). What lies within is good; what lies a little outside is corrected by the
//! calibration and acceptable; what lies far outside is another sensor, or a broken one.

use super::DEG;
use super::ellipsoid::FitError;

/// How good something is; the worst is the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum Grade {
    /// As it should be.
    #[default]
    Good,
    /// Not as it should be, but the tracker can live with it.
    Acceptable,
    /// Results cannot be trusted.
    Bad,
}

impl core::fmt::Display for Grade {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        out.pad(match self {
            Self::Good => "good",
            Self::Acceptable => "acceptable",
            Self::Bad => "bad",
        })
    }
}

/// A property that is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Property {
    /// Noise density of the gyroscope. **Units:** rad/s/sqrt(Hz).
    GyroNoise,
    /// The same over half seconds.
    GyroDrift,
    /// Noise density of the accelerometer. **Units:** m/s²/sqrt(Hz).
    AccelNoise,
    /// The same over half seconds.
    AccelDrift,
    /// Largest gyroscope bias of an axis. **Units:** rad/s.
    GyroBias,
    /// Largest change of it with the temperature. **Units:** rad/s/K.
    GyroPerKelvin,
    /// Largest rate read for a force. **Units:** rad/s per m/s².
    GyroPerAccel,
    /// Largest accelerometer bias of an axis. **Units:** m/s².
    AccelBias,
    /// Largest relative error of scale. **Units:** 1.
    AccelScale,
    /// Largest misalignment of two axes. **Units:** 1.
    AccelCross,
    /// Share of the samples with an axis at the end of its range. **Units:** 1.
    Clipped,
    /// How far the corrected readings at rest are off gravity. **Units:** m/s².
    Residual,
    /// How well the accelerometer's bias is known now. **Units:** m/s².
    BiasSigma,
    /// How well its scale is known now. **Units:** 1.
    ScaleSigma,
    /// How well its misalignment is known now. **Units:** 1.
    CrossSigma,
    /// Poses left over to check the others by. **Units:** 1.
    Redundancy,
}

/// How a property is told: name, unit, factor from SI, limits of good and of acceptable in SI.
struct Manner {
    name: &'static str,
    unit: &'static str,
    factor: f32,
    good: f32,
    acceptable: f32,
    /// What it means when it is not good.
    advice: &'static str,
}

const MILLI_G: f32 = 1e-3 * crate::sample::STANDARD_GRAVITY_M_S2;

impl Property {
    fn manner(self) -> Manner {
        let manner = |name, unit, si: f32, good, acceptable, advice| Manner {
            name,
            unit,
            factor: 1.0 / si,
            good: good * si,
            acceptable: acceptable * si,
            advice,
        };
        let shaken = "the table shakes, the supply is noisy or the sensor is another one";
        let drifts = "it warms up or the table shakes: let it run for some minutes and repeat";
        let repeat = "repeat the calibration on a firm table, letting go of the sensor in each pose";
        match self {
            // 0.014 deg/s/sqrt(Hz) and 150 ug/sqrt(Hz) are typical values: half as much again is still one of them.
            Self::GyroNoise => manner("gyroscope noise", "deg/s/sqrt(Hz)", DEG, 0.021, 0.042, shaken),
            Self::AccelNoise => manner("accelerometer noise", "ug/sqrt(Hz)", 1e-3 * MILLI_G, 225.0, 450.0, shaken),
            Self::GyroDrift => manner("gyroscope noise over 0.5 s", "deg/s/sqrt(Hz)", DEG, 0.028, 0.07, drifts),
            Self::AccelDrift => {
                manner("accelerometer noise over 0.5 s", "ug/sqrt(Hz)", 1e-3 * MILLI_G, 300.0, 750.0, drifts)
            }
            Self::GyroBias => manner("gyroscope bias", "deg/s", DEG, 1.0, 3.0, "outside the data sheet's +-1 deg/s"),
            Self::GyroPerKelvin => {
                manner("gyroscope bias per kelvin", "deg/s/K", DEG, 0.015, 0.03, "outside the data sheet's +-0.015")
            }
            Self::GyroPerAccel => manner(
                "gyroscope bias per g",
                "deg/s/g",
                DEG / (1e3 * MILLI_G),
                0.1,
                0.2,
                "outside the data sheet's 0.1; did the sensor turn while it lay?",
            ),
            Self::AccelBias => {
                manner("accelerometer bias", "mg", MILLI_G, 80.0, 150.0, "outside the data sheet's +-80 mg")
            }
            Self::AccelScale => {
                manner("accelerometer scale error", "%", 0.01, 3.0, 5.0, "is the range or the unit another one?")
            }
            Self::AccelCross => {
                manner("accelerometer misalignment", "%", 0.01, 1.0, 2.0, "outside the data sheet's cross axis of 1 %")
            }
            Self::Clipped => manner(
                "samples at the end of the range",
                "%",
                0.01,
                0.01,
                0.5,
                "a range is too narrow, or a die is stuck",
            ),
            // A kelvin moves the offset by 1 mg, and a pose that is off hides nine parts of ten in the unknowns.
            Self::Residual => manner("gravity after correction off by", "mg", MILLI_G, 2.0, 6.0, repeat),
            Self::BiasSigma => manner("accelerometer bias known to", "mg", MILLI_G, 2.0, 8.0, repeat),
            Self::ScaleSigma => manner("accelerometer scale known to", "%", 0.01, 0.2, 0.8, repeat),
            Self::CrossSigma => manner("misalignment known to", "%", 0.01, 0.4, 2.1, "lay the sensor on its edges too"),
            Self::Redundancy => {
                manner("poses to check by", "", 1.0, 2.0, 0.0, "no pose is left over to check by: add the edges")
            }
        }
    }

    /// Whether more is better.
    fn wants_more(self) -> bool {
        self == Self::Redundancy
    }
}

/// A property of this sensor, judged.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Finding {
    /// Which.
    pub property: Property,
    /// Its value, in the property's unit.
    pub value: f32,
    /// The verdict.
    pub grade: Grade,
}

impl Finding {
    /// Judges `value`, in the property's unit. What is not a number is bad.
    pub fn new(property: Property, value: f32) -> Self {
        let manner = property.manner();
        let within = |limit: f32| if property.wants_more() { value >= limit } else { value.abs() <= limit };
        let grade = match () {
            () if !value.is_finite() => Grade::Bad,
            () if within(manner.good) => Grade::Good,
            () if within(manner.acceptable) || property.wants_more() => Grade::Acceptable,
            () => Grade::Bad,
        };
        Self { property, value, grade }
    }

    /// What was measured, as text.
    pub fn name(&self) -> &'static str {
        self.property.manner().name
    }

    /// Unit in which [`Finding::shown`] and [`Finding::limit`] are.
    pub fn unit(&self) -> &'static str {
        self.property.manner().unit
    }

    /// The value in a unit for people.
    pub fn shown(&self) -> f32 {
        self.value * self.property.manner().factor
    }

    /// Up to where it is good, in the same unit.
    pub fn limit(&self) -> f32 {
        let manner = self.property.manner();
        manner.good * manner.factor
    }

    /// What it means if it is not good.
    pub fn advice(&self) -> Option<&'static str> {
        (self.grade != Grade::Good).then(|| self.property.manner().advice)
    }
}

impl core::fmt::Display for Finding {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let bound = if self.property.wants_more() { "at least" } else { "at most" };
        let gap = if self.unit().is_empty() { "" } else { " " };
        write!(
            out,
            "{}: {} {:.3}{gap}{}, good {bound} {:.3}",
            self.grade,
            self.name(),
            self.shown(),
            self.unit(),
            self.limit()
        )?;
        self.advice().map_or(Ok(()), |advice| write!(out, "; {advice}"))
    }
}

/// Number of properties.
const MOST: usize = 16;

/// All findings about a sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdict {
    findings: [Option<Finding>; MOST],
    len: usize,
    /// Why there is no correction of the accelerometer.
    pub unfit: Option<FitError>,
}

impl Verdict {
    /// Adds a finding.
    pub fn add(&mut self, property: Property, value: f32) {
        if let Some(free) = self.findings.get_mut(self.len) {
            *free = Some(Finding::new(property, value));
            self.len += 1;
        }
    }

    /// The findings, in the order in which they were added.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().flatten()
    }

    /// The grade of the whole: that of its worst finding; bad if there is no correction.
    pub fn grade(&self) -> Grade {
        let unfit = if self.unfit.is_some() { Grade::Bad } else { Grade::Good };
        self.findings().map(|finding| finding.grade).fold(unfit, Grade::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    #[test]
    fn limits_separate_the_grades() {
        let grade = |property, value| Finding::new(property, value).grade;
        assert_eq!(grade(Property::GyroBias, -0.99 * DEG), Grade::Good);
        assert_eq!(grade(Property::GyroBias, 1.5 * DEG), Grade::Acceptable);
        assert_eq!(grade(Property::GyroBias, -3.1 * DEG), Grade::Bad);
        assert_eq!(grade(Property::AccelScale, 0.029), Grade::Good);
        assert_eq!(grade(Property::AccelBias, f32::NAN), Grade::Bad);
        assert_eq!(grade(Property::Redundancy, 3.0), Grade::Good);
        assert_eq!(grade(Property::Redundancy, 0.0), Grade::Acceptable);
    }

    #[test]
    fn a_finding_is_told_with_its_number_and_its_limit() {
        let bias = format!("{}", Finding::new(Property::AccelBias, 90.0 * MILLI_G));
        let told = "acceptable: accelerometer bias 90.000 mg, good at most 80.000; outside the data sheet's +-80 mg";
        assert_eq!(bias, told);
        let noise = format!("{}", Finding::new(Property::GyroNoise, 0.014 * DEG));
        assert_eq!(noise, "good: gyroscope noise 0.014 deg/s/sqrt(Hz), good at most 0.021");
    }

    #[test]
    fn the_whole_is_as_good_as_its_worst() {
        let mut verdict = Verdict::default();
        assert_eq!(verdict.grade(), Grade::Good);
        verdict.add(Property::GyroBias, 0.0);
        verdict.add(Property::AccelBias, 100.0 * MILLI_G);
        assert_eq!(verdict.grade(), Grade::Acceptable);
        verdict.unfit = Some(FitError::TooFew);
        assert_eq!(verdict.grade(), Grade::Bad);
    }
}
