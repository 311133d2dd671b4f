//! What people write: settings, calibrations, scenarios, profiles. What is accepted must work, and be read again as it is
//! written.

use crate::seeds::Seed;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sohle::particle;
use sohle::recording::mapping::Mapping;
use sohle::recording::{Profile, read};
use sohle::simulation::{Scenario, Simulation};
use sohle::toml_file;
use sohle_shared::calibration::Calibration;
use sohle_shared::sample::ImuSample;
use sohle_shared::selftest::Walk;
use sohle_shared::tracker::{Parameters, Tracker};
use std::fmt::Debug;
use std::path::Path;

/// Samples of a walk that settings are tried with: a stride and a half, at 200 Hz.
const SAMPLES: usize = 600;
/// Moments of a scenario that are made.
const MOMENTS: usize = 200;

/// The first byte says what it is to be, the rest is the text.
pub fn run(data: &[u8]) {
    let Some((&kind, text)) = data.split_first() else { return };
    let Ok(text) = std::str::from_utf8(text) else { return };
    match kind % 5 {
        0 => settings(text),
        1 => calibration(text),
        2 => {
            if let Some(settings) = parse::<particle::Parameters>(text)
                && let Err(error) = settings.check()
            {
                in_a_line(&error.to_string());
            }
        }
        3 => scenario(text),
        _ => mapping(text),
    }
}

fn in_a_line(message: &str) {
    assert!(!message.contains(['\n', '\r']), "{message:?}");
}

fn parse<T: DeserializeOwned>(text: &str) -> Option<T> {
    match toml_file::parse(text) {
        Ok(value) => Some(value),
        Err((line, message)) => {
            assert!((1..=text.bytes().filter(|&byte| byte == b'\n').count() + 1).contains(&line));
            in_a_line(&message);
            None
        }
    }
}

/// Written and read again it is the same.
fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let text = toml::to_string(value).expect("what was read can be written");
    assert_eq!(toml_file::parse::<T>(&text).as_ref(), Ok(value), "{text}");
}

/// Follows a walk: nothing may come of it that is no number.
fn follow(parameters: &Parameters, calibration: &Calibration) {
    let mut tracker = Tracker::new(parameters);
    for sample in Walk::new(5_000).take(SAMPLES) {
        let output = tracker.push(&calibration.apply(&sample, Some(25.0)));
        if let Some(step) = output.step {
            let numbers = step.displacement.iter().chain(step.covariance.iter()).chain([&step.turn]);
            assert!(numbers.into_iter().all(|number| number.is_finite()), "{step:?}");
        }
        let numbers = [tracker.displacement(), tracker.velocity()];
        assert!(numbers.iter().flatten().all(|number| number.is_finite()), "{numbers:?}");
        assert!(tracker.attitude().coords.iter().all(|number| number.is_finite()));
    }
}

fn settings(text: &str) {
    let Some(settings) = parse::<Parameters>(text) else { return };
    match settings.check() {
        Ok(()) => {
            comes_back(&settings);
            follow(&settings, &Calibration::default());
        }
        Err(unfit) => in_a_line(&unfit.to_string()),
    }
}

fn calibration(text: &str) {
    let Some(calibration) = parse::<Calibration>(text).filter(Calibration::is_finite) else { return };
    comes_back(&calibration);
    follow(&Parameters::default(), &calibration);
}

fn scenario(text: &str) {
    let scenario = match Scenario::from_toml(text) {
        Ok(scenario) => scenario,
        Err(error) => return in_a_line(&error.to_string()),
    };
    match Simulation::new(&scenario) {
        Ok(simulation) => {
            assert!(simulation.take(MOMENTS).all(|moment| ImuSample::is_finite(&moment.sample)));
        }
        Err(error) => in_a_line(&error.to_string()),
    }
}

fn mapping(text: &str) {
    let Some(mapping) = parse::<Mapping>(text) else { return };
    let table = "time,a,b,c,d,e,f\n0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n2,-1e9,2,3,4,5,6\n";
    match read(Path::new("walk"), table.as_bytes(), Some(&Profile { mapping })) {
        Ok(recording) => assert!(recording.samples.iter().all(ImuSample::is_finite)),
        Err(error) => in_a_line(&error.to_string()),
    }
}

/// Each kind as the project writes it.
pub fn seeds() -> Vec<Seed> {
    fn seed<T: Serialize>(kind: u8, value: &T) -> Vec<u8> {
        let text = toml::to_string(value).expect("what the project has can be written");
        [&[kind], text.as_bytes()].concat()
    }
    let mapping = "time = 'time'\ntime_unit = 'ms'\naccel = ['a', 'b', '*c']\naccel_unit = 'g'\ngyro = [5, 6, 7]\n\
                   gyro_unit = 'deg/s'\naxes = ['-y', 'x', 'z']\naccel_range_g = 16.0\n";
    vec![
        ("settings", seed(0, &Parameters::default())),
        ("documented", seed(0, &Parameters::documented())),
        ("calibration", seed(1, &Calibration::default())),
        ("particles", seed(2, &particle::Parameters::default())),
        ("scenario", seed(3, &Scenario::demo())),
        ("mapping", [&[4], mapping.as_bytes()].concat()),
    ]
}
