//! A thousand steps fit into the shoe's outbox, whoever walks and however.

use sohle_shared::sample::ImuSample;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::port::Port;
use sohle_walks::evaluation::loading::{self, LoadError};
use sohle_walks::evaluation::manifest::Manifest;
use sohle_walks::simulation::{Scenario, Simulation};
use sohle_walks::track::Track;
use std::path::Path;

/// As on the boards.
const STEPS: usize = 1_000;
/// A walk of fewer steps is mostly its beginning, which comes again and again here.
const FEWEST: usize = 12;

/// How many steps of a walk that begins anew each time it is over are kept before the first gives way.
fn kept(name: &str, samples: impl IntoIterator<Item = ImuSample>) -> Option<usize> {
    let steps = Track::of(samples, &Parameters::default()).steps;
    if steps.len() < FEWEST {
        println!("{name}: only {} steps, left out", steps.len());
        return None;
    }
    let mut outbox = Outbox::<STEPS>::new(0, Pace::default());
    for step in steps.iter().cycle() {
        outbox.push(PackedStep::pack(step));
        if outbox.dropped(Port::Serial) > 0 {
            break;
        }
    }
    println!("{name}: {} steps, {} kept", steps.len(), outbox.len());
    Some(outbox.len())
}

#[test]
fn a_thousand_simulated_steps_are_kept() {
    let mut scenarios = Scenario::detector_tests(3);
    scenarios.push(("endless".into(), Scenario { duration: Some(300.0), ..Scenario::endless(3) }));
    scenarios.push(("demo".into(), Scenario::demo()));
    for (name, scenario) in scenarios {
        let samples = Simulation::new(&scenario).unwrap().map(|moment| moment.sample);
        assert!(kept(&name, samples).unwrap() >= STEPS, "{name}");
    }
}

#[test]
fn a_thousand_recorded_steps_are_kept() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/recordings.toml");
    let manifest = Manifest::read(&path).unwrap();
    for entry in manifest.recordings.iter().filter(|entry| entry.simulate.is_none()) {
        match loading::samples(&manifest, entry) {
            Ok(recording) => {
                if let Some(kept) = kept(&entry.name, recording.samples) {
                    assert!(kept >= STEPS, "{}: {kept}", entry.name);
                }
            }
            Err(LoadError::Absent { path }) => println!("{} is not here and is skipped", path.display()),
            Err(error) => panic!("{}: {error}", entry.name),
        }
    }
}
