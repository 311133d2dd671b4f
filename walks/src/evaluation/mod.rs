//! Scores: every recording of a manifest tracked and compared with what is known of it.
//!
//! The default and the document's settings run on the same input; the [`report`] prints both. A manifest is all that is
//! needed to judge the tracker on other data, see `docs/manifest.md`.

pub mod building;
pub mod endurance;
pub mod fixes;
pub mod graph;
pub mod group;
pub mod loading;
pub mod manifest;
pub mod matching;
pub mod metrics;
pub mod perturbation;
pub mod phone;
pub mod report;
pub mod score;
pub mod source;
pub mod table;
pub mod truth;

pub use manifest::{Manifest, ManifestError};
pub use metrics::{Metric, Metrics};
pub use perturbation::Perturbation;
pub use report::Report;

use crate::track::Track;
use group::{Figure, Group};
use loading::LoadError;
use manifest::Entry;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use sohle_shared::sample::ImuSample;
use sohle_shared::tracker::{Counters, Parameters};
use truth::Truth;

/// The tracker with a name for its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How they are called in every output.
    pub name: &'static str,
    /// The settings.
    pub parameters: Parameters,
}

impl Settings {
    /// `parameters` as the default, and beside them the document's.
    pub fn both(parameters: Parameters) -> Vec<Self> {
        vec![Self { name: "default", parameters }, Self { name: "documented", parameters: Parameters::documented() }]
    }
}

/// What became of one recording under one set of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Of the recording.
    pub name: String,
    /// Name of the settings.
    pub settings: &'static str,
    /// What became of it.
    pub status: Status,
}

/// What became of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// It was tracked and judged.
    Scored(Box<Score>),
    /// It is not there.
    Skipped(String),
    /// It, or its truth, is there but cannot be used.
    Failed(String),
}

/// How well a recording was tracked.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Horizontal length of the track. **Units:** m.
    pub distance: f64,
    /// Strides: steps after the one that marks the start.
    pub steps: usize,
    /// The figures.
    pub metrics: Metrics,
    /// What was unusual.
    pub counters: Counters,
    /// SHA-256 over all steps and stances.
    pub fingerprint: [u8; 32],
}

impl Outcome {
    /// The score, if there is one.
    pub fn score(&self) -> Option<&Score> {
        match &self.status {
            Status::Scored(score) => Some(score),
            _ => None,
        }
    }
}

/// A figure of a group as it came out.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupFigure {
    /// Name of the group.
    pub group: String,
    /// What was asked.
    pub figure: Figure,
    /// Name of the settings.
    pub settings: &'static str,
    /// The value; `None` if no recording has the figure.
    pub value: Option<f64>,
    /// How many recordings it was drawn from.
    pub of: usize,
    /// How many of the group were tracked; more than `of` if the track of some did not yield the figure.
    pub scored: usize,
    /// How many the group has.
    pub wanted: usize,
}

/// Everything an evaluation found out.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// For each recording in the order of the manifest, for each of the settings.
    pub outcomes: Vec<Outcome>,
    /// The figures of the groups, settings within figures within groups.
    pub groups: Vec<GroupFigure>,
}

/// Tracks and judges every recording of `manifest` with all `settings`. Runs on the threads of the current rayon pool;
/// their number changes nothing in the result.
pub fn evaluate(manifest: &Manifest, settings: &[Settings], perturbation: Perturbation) -> Evaluation {
    let judge = |entry: &Entry| judge(manifest, entry, settings, perturbation);
    let mut outcomes: Vec<Outcome> = manifest.recordings.par_iter().map(judge).collect::<Vec<_>>().concat();
    compare_feet(manifest, &mut outcomes);
    let groups = manifest.groups.iter().flat_map(|group| figures(group, &outcomes, settings)).collect();
    Evaluation { outcomes, groups }
}

/// One recording with all settings.
fn judge(manifest: &Manifest, entry: &Entry, settings: &[Settings], perturbation: Perturbation) -> Vec<Outcome> {
    let outcome = |settings: &Settings, status| Outcome { name: entry.name.clone(), settings: settings.name, status };
    match load(manifest, entry) {
        Ok((samples, truth)) => {
            let samples = perturbation.apply(&samples);
            let run = |settings: &Settings| {
                let track = Track::of(samples.iter().copied(), &settings.parameters);
                outcome(settings, status(&track, &truth))
            };
            settings.par_iter().map(run).collect()
        }
        Err(status) => settings.iter().map(|settings| outcome(settings, status.clone())).collect(),
    }
}

/// The samples of `entry` and what is known of it.
fn load(manifest: &Manifest, entry: &Entry) -> Result<(Vec<ImuSample>, Truth), Status> {
    let failed = |error: LoadError| match error {
        LoadError::Absent { .. } => Status::Skipped(error.to_string()),
        other => Status::Failed(other.to_string().replace('\n', " ")),
    };
    let recording = loading::samples(manifest, entry).map_err(failed)?;
    let truth = loading::truth(manifest, entry, &recording).map_err(failed)?;
    Ok((recording.samples, truth))
}

fn status(track: &Track, truth: &Truth) -> Status {
    if track.stances.iter().any(|stance| !stance.position.iter().all(|value| value.is_finite())) {
        return Status::Failed("the track is not finite".into());
    }
    Status::Scored(Box::new(Score {
        // An empty sum is -0.
        distance: track.distance() + 0.0,
        steps: track.strides(),
        metrics: score::score(track, truth),
        counters: track.counters,
        fingerprint: fingerprint(track),
    }))
}

/// Adds the difference of the heights that the two feet of a walk climbed.
fn compare_feet(manifest: &Manifest, outcomes: &mut [Outcome]) {
    let height = |outcomes: &[Outcome], name: &str, settings: &str| {
        let same = |outcome: &&Outcome| outcome.name == name && outcome.settings == settings;
        outcomes.iter().find(same).and_then(Outcome::score).and_then(|score| score.metrics.get(Metric::HeightEnd))
    };
    let others =
        manifest.recordings.iter().filter_map(|entry| Some((&entry.name, entry.truth.same_height_as.as_ref()?)));
    for (name, other) in others {
        for index in 0..outcomes.len() {
            let settings = outcomes[index].settings;
            if outcomes[index].name != *name {
                continue;
            }
            let difference = height(outcomes, name, settings)
                .zip(height(outcomes, other, settings))
                .map(|(one, other)| (one - other).abs());
            if let Status::Scored(score) = &mut outcomes[index].status {
                score.metrics.set(Metric::FeetHeightDifference, difference);
            }
        }
    }
}

/// The figures of `group` for each of the settings.
fn figures(group: &Group, outcomes: &[Outcome], settings: &[Settings]) -> Vec<GroupFigure> {
    let scored = |name: &str, settings: &str| {
        outcomes.iter().find(|outcome| outcome.name == name && outcome.settings == settings)?.score()
    };
    let mut figures = Vec::new();
    for figure in &group.figures {
        for settings in settings {
            let names = group.recordings.iter();
            let values: Vec<f64> = names
                .filter_map(|name| scored(name, settings.name)?.metrics.get(figure.metric).map(f64::abs))
                .collect();
            figures.push(GroupFigure {
                group: group.name.clone(),
                figure: *figure,
                settings: settings.name,
                value: figure.of(&values),
                of: values.len(),
                scored: group.recordings.iter().filter(|name| scored(name, settings.name).is_some()).count(),
                wanted: group.recordings.len(),
            });
        }
    }
    figures
}

/// SHA-256 over every bit of the steps and stances.
fn fingerprint(track: &Track) -> [u8; 32] {
    let mut hash = Sha256::new();
    for step in &track.steps {
        hash.update(step.index.to_le_bytes());
        hash.update(step.stance_start.0.to_le_bytes());
        hash.update(step.stance_end.0.to_le_bytes());
        let numbers = step.displacement.iter().chain([&step.turn]).chain(step.covariance.iter());
        for number in numbers {
            hash.update(number.to_bits().to_le_bytes());
        }
        hash.update(format!("{:?} {:?}", step.mode, step.quality));
    }
    for stance in &track.stances {
        for number in stance.position.iter().chain([&stance.heading]) {
            hash.update(number.to_bits().to_le_bytes());
        }
    }
    hash.update(format!("{:?}", track.counters));
    hash.finalize().into()
}

impl Evaluation {
    /// SHA-256 over all outputs in the order of the manifest, hexadecimal: the same in every build and on any number of
    /// threads.
    pub fn outputs_hash(&self) -> String {
        let mut hash = Sha256::new();
        for outcome in &self.outcomes {
            hash.update(format!("{}\0{}\0", outcome.name, outcome.settings));
            let Some(score) = outcome.score() else { continue };
            hash.update(score.fingerprint);
            for (metric, value) in score.metrics.iter() {
                hash.update(metric.name());
                hash.update(value.to_bits().to_le_bytes());
            }
        }
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn project() -> Manifest {
        Manifest::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/recordings.toml")).unwrap()
    }

    #[test]
    fn every_recording_of_the_project_that_is_here_is_scored_alike_on_any_number_of_threads() {
        let entries = project().recordings;
        let recorded: Vec<String> =
            entries.iter().filter(|entry| entry.path.is_some()).map(|entry| entry.name.clone()).collect();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            // The simulated walks take longer than all others together and need no file.
            let manifest = project().only(&recorded).unwrap();
            pool.install(|| evaluate(&manifest, &Settings::both(Parameters::default()), Perturbation::Recorded))
        };
        let (one, two) = (run(1), run(2));
        for outcome in &one.outcomes {
            assert!(!matches!(outcome.status, Status::Failed(_)), "{outcome:?}");
        }
        assert_eq!(one, two);
        assert_eq!(one.outputs_hash(), two.outputs_hash());
    }

    #[test]
    fn the_hash_depends_on_every_figure() {
        let score = |rmse: f64| {
            let mut metrics = Metrics::default();
            metrics.set(Metric::RigidRmse, rmse);
            Score { distance: 0.0, steps: 0, metrics, counters: Counters::default(), fingerprint: [0; 32] }
        };
        let evaluation = |rmse| Evaluation {
            outcomes: vec![Outcome {
                name: "walk".into(),
                settings: "default",
                status: Status::Scored(Box::new(score(rmse))),
            }],
            groups: Vec::new(),
        };
        assert_eq!(evaluation(0.25).outputs_hash(), evaluation(0.25).outputs_hash());
        assert_ne!(evaluation(0.25).outputs_hash(), evaluation(0.25 + f64::EPSILON).outputs_hash());
    }
}
