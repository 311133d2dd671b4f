//! A calibration as it goes on and as it ends, in words; and its file.
//!
//! A [`Session`] is fed with samples and tells what a person wants to know; where the samples come from (a recording, a
//! live shoe) and where the words go is the business of whoever feeds it.

use crate::toml_file::{self, TomlFileError};
use sohle_shared::calibration::ellipsoid::FEWEST;
use sohle_shared::calibration::{
    Calibration, Direction, Event, FitError, Grade, Guide, Outcome, Parameters, Prompt, Verdict,
};
use sohle_shared::sample::ImuSample;
use sohle_shared::time::Micros;
use std::fmt;
use std::path::{Path, PathBuf};

/// Something to be told to the holder of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// What to do now. Who calibrates from a recording has no use for it.
    Prompt(Prompt),
    /// What became of a rest.
    Event {
        /// When, since the first sample. **Units:** s.
        seconds: f64,
        /// What.
        event: Event,
    },
}

impl fmt::Display for Line {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Prompt(prompt) => prompt.fmt(out),
            Self::Event { seconds, event: Event::Accepted { up, poses, missing } } => {
                write!(out, "{seconds:7.1} s  {up} up: taken as pose {poses}, {missing} missing")
            }
            Self::Event { seconds, event: Event::Refused { up, reason } } => {
                write!(out, "{seconds:7.1} s  {up} up: refused, {reason}")
            }
        }
    }
}

/// A calibration under way.
#[derive(Clone, Debug)]
pub struct Session {
    guide: Guide,
    began: Option<Micros>,
    prompt: Option<Prompt>,
}

impl Session {
    /// A session that has seen nothing; `gravity` is that of the place. **Units:** m/s².
    pub fn new(parameters: &Parameters, gravity: f64) -> Self {
        Self { guide: Guide::new(parameters, gravity as f32), began: None, prompt: None }
    }

    /// Takes in a sample as measured, and the temperature of the dies if it is known; returns what is new.
    /// **Units:** °C.
    pub fn push(&mut self, sample: &ImuSample, temperature: Option<f32>) -> Vec<Line> {
        let began = *self.began.get_or_insert(sample.time);
        let seconds = (sample.time - began) as f64 * 1e-6;
        let mut lines: Vec<_> =
            self.guide.push(sample, temperature).map(|event| Line::Event { seconds, event }).into_iter().collect();
        let prompt = self.guide.prompt();
        if self.prompt.replace(prompt) != Some(prompt) {
            lines.push(Line::Prompt(prompt));
        }
        lines
    }

    /// Whether every attitude that is wanted was shown.
    pub fn is_complete(&self) -> bool {
        self.guide.is_complete()
    }

    /// What is known by now.
    pub fn conclusion(&self) -> Conclusion {
        let Outcome { calibration, verdict } = self.guide.outcome();
        let poses = self.guide.poses();
        Conclusion { calibration, verdict, taken: poses.poses().len(), missing: poses.missing().collect() }
    }
}

/// What a session came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Conclusion {
    /// What was found; of use only if there is no [`Verdict::unfit`].
    pub calibration: Calibration,
    /// How good sensor and calibration are.
    pub verdict: Verdict,
    /// Number of poses that were taken.
    pub taken: usize,
    /// Attitudes that were wanted and not shown.
    pub missing: Vec<Direction>,
}

impl Conclusion {
    /// Whether a calibration could be computed, good or bad.
    pub fn is_computed(&self) -> bool {
        self.verdict.unfit.is_none()
    }

    /// The attitudes that were not shown, if there are any.
    pub fn unseen(&self) -> Option<String> {
        let names: Vec<_> = self.missing.iter().map(Direction::to_string).collect();
        (!names.is_empty()).then(|| format!("not shown with this side up: {}", names.join(", ")))
    }

    /// Why the result is not good enough to be used, in one line; `None` if it is.
    pub fn fault(&self) -> Option<String> {
        let unseen = self.unseen().map(|unseen| format!("; {unseen}")).unwrap_or_default();
        match self.verdict.unfit {
            Some(FitError::TooFew) => {
                let (taken, wanted) = (self.taken, Direction::WANTED.len());
                Some(format!("{taken} of {wanted} poses were taken, at least {FEWEST} are needed{unseen}"))
            }
            Some(error) => Some(format!("{error}{unseen}")),
            None if self.verdict.grade() == Grade::Bad => {
                let bad: Vec<_> = self
                    .verdict
                    .findings()
                    .filter(|finding| finding.grade == Grade::Bad)
                    .map(|finding| format!("{} {:.3} {}", finding.name(), finding.shown(), finding.unit()))
                    .collect();
                Some(format!("not good enough: {}{unseen}", bad.join(", ")))
            }
            None => None,
        }
    }
}

/// Why a calibration is refused.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationFileError {
    /// The file cannot be read, or something else stands in it.
    #[error(transparent)]
    File(#[from] TomlFileError),
    /// A value is infinite or not a number.
    #[error("calibration file {}: a value is not finite", .0.display())]
    NotFinite(PathBuf),
}

/// Reads a calibration as `sohle calibrate` writes it. What the file leaves out changes nothing.
pub fn read(path: &Path) -> Result<Calibration, CalibrationFileError> {
    let calibration: Calibration = toml_file::read("calibration file", path)?;
    if calibration.is_finite() { Ok(calibration) } else { Err(CalibrationFileError::NotFinite(path.to_owned())) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::score::score;
    use crate::evaluation::truth::Truth;
    use crate::evaluation::{Metric, Metrics};
    use crate::recording::SimulatedTruth;
    use crate::simulation::{Gait, Leg, Route, Scenario, Simulation};
    use crate::track::Track;
    use nalgebra::{Matrix3, Vector3};
    use rayon::prelude::*;
    use sohle_shared::tracker;

    const G: f64 = 9.806_65;
    /// A degree for each second and g. **Units:** rad/s per m/s².
    const DEG_S_G: f64 = std::f64::consts::PI / 180.0 / G;

    fn calibrated(scenario: &Scenario) -> (Vec<Line>, Conclusion, Simulation) {
        let mut session = Session::new(&Parameters::default(), G);
        let mut simulation = Simulation::new(scenario).unwrap();
        let mut lines = Vec::new();
        for moment in simulation.by_ref() {
            lines.extend(session.push(&moment.sample, None));
        }
        (lines, session.conclusion(), simulation)
    }

    fn judged(scenario: &Scenario, calibration: &Calibration) -> Metrics {
        let mut truth = SimulatedTruth::default();
        let mut samples = Vec::new();
        for moment in Simulation::new(scenario).unwrap() {
            samples.push(calibration.apply(&moment.sample, None));
            truth.poses.push(moment.truth);
            truth.stances.extend(moment.stance);
        }
        score(&Track::of(samples, &tracker::Parameters::default()), &Truth::from(&truth))
    }

    fn fault(scenario: &Scenario) -> Option<String> {
        calibrated(scenario).1.fault()
    }

    #[test]
    fn the_constants_of_simulated_units_are_found() {
        for seed in 1..=4 {
            let (_, conclusion, simulation) = calibrated(&Scenario::calibration(seed));
            assert_eq!(conclusion.fault(), None);
            assert!(conclusion.missing.is_empty() && conclusion.taken == 12);
            let Calibration { accel, quality, gyro, .. } = conclusion.calibration;
            let unit = simulation.unit();
            // Mean temperature of the poses; a unit moves by 0.3 mg in the half kelvin around it.
            let (response, offset) = (unit.accel.response(), unit.accel.offset(22.5));
            let off = Vector3::from(accel.bias).map(f64::from) - offset;
            assert!(off.amax() < f64::from(quality.bias_sigma), "{seed}: {off}");
            // What turns the axes into right angles and even scales, up to a turn: (R R^T)^(-1/2).
            let eigen = (response * response.transpose()).symmetric_eigen();
            let scales = Matrix3::from_diagonal(&eigen.eigenvalues.map(|value| 1.0 / value.sqrt()));
            let truth = eigen.eigenvectors * scales * eigen.eigenvectors.transpose();
            let off = accel.matrix().map(f64::from) - truth;
            assert!(off.amax() < f64::from(quality.scale_sigma), "{seed}: {off}");
            // White noise of 2.5 s in each of twelve poses leaves 0.0063 deg/s, of which an axis takes its share in about
            // four: 0.003 deg/s/g, four times; the drift over half a kelvin is less.
            let per_accel = unit.gyro.response() * unit.gyro_per_accel;
            let off = (conclusion.calibration.per_accel().map(f64::from) - per_accel) / DEG_S_G;
            assert!(off.amax() < 0.012, "{seed}: {off}");
            let bias = gyro.bias(None).unwrap().map(f64::from);
            let off = (bias - unit.gyro.offset(22.5)).map(f64::to_degrees);
            // A pose is taken to show it to 0.01 deg/s.
            assert!(off.amax() < 0.01, "{seed}: {off}");
        }
    }

    #[test]
    fn walks_with_a_calibrated_unit_are_no_worse_and_heights_are_better() {
        let level = vec![Leg::with_gait(Gait::Walk, vec![[25.0, 0.0], [25.0, 15.0], [5.0, 15.0]])];
        let stairs =
            vec![Leg::walk(8.0, 0.0), Leg::stairs(40), Leg::walk(30.0, 0.0), Leg::stairs(20), Leg::walk(45.0, 0.0)];
        let errors: Vec<[[f64; 2]; 3]> = (1..=8_u64)
            .into_par_iter()
            .map(|seed| {
                let found = calibrated(&Scenario::calibration(seed)).1.calibration;
                let both = |legs: &[Leg]| {
                    let route = Route { legs: legs.to_vec(), ..Route::default() };
                    let scenario = Scenario { seed, route, ..Scenario::default() };
                    [Calibration::default(), found].map(|calibration| judged(&scenario, &calibration))
                };
                let (level, stairs) = (both(&level), both(&stairs));
                let square = |walks: &[Metrics; 2], metric| [0, 1].map(|with| walks[with].get(metric).unwrap().powi(2));
                let plane = [&level, &stairs].map(|walks| square(walks, Metric::RigidRmse));
                [plane[0], plane[1], square(&stairs, Metric::HeightError)]
            })
            .collect();
        let [level, stairs, height] =
            [0, 1, 2].map(|which| [0, 1].map(|with| errors.iter().map(|unit| unit[which][with]).sum::<f64>()));
        // The tracker finds most of a bias by itself, so on the level there may be nothing to gain.
        let rms = |squares: [f64; 2]| squares.map(|sum| (sum / errors.len() as f64).sqrt());
        println!("rms before and after: level {:.3?} m, stairs {:.3?} m,", rms(level), rms(stairs));
        println!("height after stairs {:.3?} m", rms(height));
        assert!(level[1] < level[0], "{level:?}");
        assert!(stairs[1] < stairs[0], "{stairs:?}");
        assert!(height[1] < height[0], "{height:?}");
    }

    #[test]
    fn the_holder_is_told_what_to_do_and_what_became_of_it() {
        let (lines, ..) = calibrated(&Scenario::calibration(1));
        let [first, up] = [Direction::WANTED[0], Direction::WANTED[1]];
        assert_eq!(lines[0], Line::Prompt(Prompt::Turn(first)));
        let taken = lines.iter().position(|line| matches!(line, Line::Event { .. })).unwrap();
        assert_eq!(lines[taken - 1], Line::Prompt(Prompt::Hold(first)));
        assert!(lines[taken].to_string().ends_with("s  +z up: taken as pose 1, 11 missing"), "{}", lines[taken]);
        assert_eq!(lines[taken + 1], Line::Prompt(Prompt::Turn(up)));
        assert_eq!(lines.last(), Some(&Line::Prompt(Prompt::Done)));
        assert_eq!(lines.iter().filter(|line| matches!(line, Line::Event { .. })).count(), 12);
    }

    #[test]
    fn a_poor_sensor_is_told_so() {
        let mut noisy = Scenario::calibration(1);
        noisy.sensor.gyro.noise *= 3.5;
        let told = fault(&noisy).unwrap();
        assert!(told.starts_with("not good enough: gyroscope noise 0.0"), "{told}");
        let mut skew = Scenario::calibration(1);
        skew.sensor.accel.cross_axis = 0.05;
        let told = fault(&skew).unwrap();
        assert!(told.contains("accelerometer misalignment") && !told.contains("noise"), "{told}");
    }

    #[test]
    fn what_was_not_shown_is_named() {
        let mut short = Scenario::calibration(1);
        short.route.legs.truncate(5);
        let told = fault(&short).unwrap();
        assert!(told.starts_with("5 of 12 poses were taken, at least 6 are needed"), "{told}");
        assert!(
            told.ends_with(
                "not shown with this side up: -y, -y and +z, +y and +z, +x and +y, +x and -y, \
                               +x and -z, +x and +z"
            ),
            "{told}"
        );
        // The six faces alone are enough, but the misalignment stays unknown.
        let mut faces = Scenario::calibration(1);
        faces.route.legs.truncate(6);
        let (_, conclusion, _) = calibrated(&faces);
        assert_eq!((conclusion.fault(), conclusion.verdict.grade()), (None, Grade::Acceptable));
        assert!(conclusion.unseen().unwrap().contains("+x and +z"));
        // One face and its opposite are not.
        let mut without = Scenario::calibration(1);
        without.route.legs.drain(4..8);
        let told = fault(&without).unwrap();
        assert!(told.starts_with("not good enough: ") && told.contains("side up: +y, -y, -y and +z"), "{told}");
    }

    #[test]
    fn a_walk_is_no_calibration() {
        let told = fault(&Scenario { duration: Some(40.0), ..Scenario::endless(1) }).unwrap();
        assert!(told.starts_with("1 of 12 poses were taken") && !told.contains('\n'), "{told}");
        let (_, conclusion, _) = calibrated(&Scenario { duration: Some(0.1), ..Scenario::endless(1) });
        assert!(!conclusion.is_computed());
    }

    #[test]
    fn a_calibration_comes_back_from_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("unit.toml");
        for calibration in [Calibration::default(), calibrated(&Scenario::calibration(2)).1.calibration] {
            std::fs::write(&path, toml::to_string(&calibration).unwrap()).unwrap();
            assert_eq!(read(&path).unwrap(), calibration);
        }
        std::fs::write(&path, "[accel]\nbias = [nan, 0.0, 0.0]\n").unwrap();
        assert!(read(&path).unwrap_err().to_string().ends_with("unit.toml: a value is not finite"));
        std::fs::write(&path, "[accel]\nbais = [0.0, 0.0, 0.0]\n").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("unit.toml, line 2: unknown field `bais`"));
    }
}
