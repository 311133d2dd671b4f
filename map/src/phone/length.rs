//! How long a step is, from what a phone feels of it.

/// Steps that cannot be. **Units:** m.
const BOUNDS_M: (f64, f64) = (0.2, 1.5);
/// Height of the person that the figures are for. **Units:** m.
const PERSON_M: f64 = 1.75;

/// A model of the step length.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Length {
    /// As the document has it (Graph, 4.2): from height and frequency.
    Documented {
        /// Metres for each metre of height.
        height: f64,
        /// Metres for each hertz.
        frequency: f64,
        /// Factor of the person.
        factor: f64,
    },
    /// From how much the body bounces, which tells long steps from short ones better than their frequency does. Below a
    /// usual frequency steps become shorter in proportion to it: somebody turns, looks around or begins to walk.
    Bounce {
        /// Length of a usual step. **Units:** m.
        usual_m: f64,
        /// Its bounce. **Units:** m/s².
        usual_bounce: f64,
        /// Power of the bounce: 1/4 for one person (Weinberg, Analog Devices AN-602, 2002); of different people with
        /// different phones the one who bounces more does not walk longer steps by as much.
        power: f64,
        /// **Units:** Hz.
        usual_hz: f64,
    },
}

impl Default for Length {
    /// Found on all six recorded walks together (`sohle evaluate --suite phone`), one set for all. The five in the mall alone
    /// ask for a `usual_m` of 0.70 m, the one in the university for 0.69 m, the document for 0.68 m; with each of them the
    /// walk in the university stays below 0.9 m in the particle filter, but not with a power of 0.
    fn default() -> Self {
        Self::Bounce { usual_m: 0.69, usual_bounce: 5.5, power: 0.125, usual_hz: 1.6 }
    }
}

impl Length {
    /// The document's.
    pub fn documented() -> Self {
        Self::Documented { height: 0.371, frequency: 0.227, factor: 1.0 }
    }

    /// Length of a step of a person so tall (metres) that follows the one before with this frequency (hertz) and rises by
    /// this bounce (m/s²). **Units:** m.
    pub fn of(&self, person_m: f64, frequency: f64, bounce: f64) -> f64 {
        let length = match *self {
            Self::Documented { height, frequency: slope, factor } => {
                let faster = frequency.clamp(1.2, 3.0) - 1.79;
                (0.7 + height * (person_m - PERSON_M) + slope * faster * person_m / PERSON_M) * factor
            }
            Self::Bounce { usual_m, usual_bounce, power, usual_hz } => {
                let slower = (frequency / usual_hz).clamp(0.3, 1.0);
                usual_m * person_m / PERSON_M * slower * (bounce / usual_bounce).clamp(0.1, 2.0).powf(power)
            }
        };
        length.clamp(BOUNDS_M.0, BOUNDS_M.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_are_the_steps_of_who_is_tall_quick_or_bounces() {
        for model in [Length::default(), Length::documented()] {
            let usual = model.of(1.75, 1.79, 5.5);
            assert!((0.68..=0.70).contains(&usual), "{usual}");
            assert!(model.of(1.90, 1.79, 5.5) > usual && model.of(1.75, 1.2, 5.5) < usual);
        }
        assert!(Length::default().of(1.75, 1.79, 9.0) > Length::default().of(1.75, 1.79, 3.0));
        assert_eq!(Length::documented().of(1.75, 1.79, 9.0), Length::documented().of(1.75, 1.79, 3.0));
    }

    #[test]
    fn no_step_is_beyond_what_people_walk() {
        for model in [Length::default(), Length::documented()] {
            for (frequency, bounce) in [(0.0, 0.0), (1e9, 1e9), (f64::INFINITY, 1.0)] {
                let length = model.of(1.75, frequency, bounce);
                assert!((0.2..=1.5).contains(&length), "{model:?} {length}");
            }
        }
    }
}
