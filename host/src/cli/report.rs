//! What `demo` and `replay` share: a recording is tracked with one or two sets of settings, judged, shown and written.

use super::located::Following;
use super::table::Table;
use super::{Error, print, progress};
use crate::alignment::{ALIGNED_START_M, Rigid, path_length};
use crate::evaluation::matching::Matching;
use crate::evaluation::score::score;
use crate::evaluation::truth::Truth;
use crate::evaluation::{Metric, Metrics};
use crate::export::geojson::Origin;
use crate::export::picture::{Dot, Line, Picture, Placement, Role};
use crate::export::{self, Named, file};
use crate::follow::Orders;
use crate::recording::{Recording, SimulatedTruth, mcap};
use crate::track::{Steer, Track};
use indicatif::ProgressIterator;
use sohle_shared::calibration::Calibration;
use sohle_shared::sample::ImuSample;
use sohle_shared::step::{FloorMode, Step};
use sohle_shared::tracker::{Order, Parameters};
use std::path::Path;
use std::time::{Duration, Instant};

/// The recording as it is written beside the pictures.
pub const RECORDING: &str = "recording.mcap";

/// The calibration that the samples were corrected by.
const CALIBRATION: &str = "calibration.toml";

/// One set of settings to track with.
pub struct Settings {
    /// Whether they are the document's.
    pub role: Role,
    /// Their name for people.
    pub label: String,
    /// Themselves.
    pub parameters: Parameters,
}

impl Default for Settings {
    /// The settings that measured best.
    fn default() -> Self {
        Self { role: Role::Chosen, label: "default".into(), parameters: Parameters::default() }
    }
}

impl Settings {
    /// The settings of the source document.
    pub fn documented() -> Self {
        Self { role: Role::Documented, label: "documented".into(), parameters: Parameters::documented() }
    }
}

/// What to do with a recording.
pub struct Report<'a> {
    /// Over the table and the picture.
    pub title: String,
    /// The walk.
    pub recording: Recording,
    /// What is known of the sensor. The samples are corrected by it before they are tracked, and written as they were.
    pub calibration: Option<Calibration>,
    /// What to track it with; the first is the one that matters.
    pub settings: Vec<Settings>,
    /// Where the outputs go.
    pub folder: &'a Path,
    /// Where on Earth the walk began.
    pub origin: Option<Origin>,
    /// Follows the steps of the first settings through a building while they are made, and tells the tracker its floor mode.
    pub following: Option<&'a mut Following>,
    /// Whether nothing but errors is to be said.
    pub quiet: bool,
}

/// A set of settings and what came of it.
struct Outcome {
    settings: Settings,
    track: Track,
    taken: Duration,
    metrics: Option<Metrics>,
    placement: Placement,
}

impl Report<'_> {
    /// Does it all; returns the recording as it was written, with the steps of the first settings.
    pub fn run(self) -> Result<Recording, Error> {
        file::folder(self.folder)?;
        let Self { title, mut recording, calibration, settings, folder, origin, mut following, quiet } = self;
        let mut outcomes = Vec::new();
        for settings in settings {
            outcomes.push({
                let first = outcomes.is_empty();
                outcome(&recording, calibration.as_ref(), settings, following.as_deref_mut().filter(|_| first), quiet)
            });
        }
        let table = table(&recording, &outcomes);
        let picture = picture(title, note(&recording, calibration.as_ref(), &outcomes), &recording, &outcomes, &table);
        if !quiet {
            let timed = timed(table, &outcomes);
            print(&format!("{}\n{}\n\n{}\n{}", picture.title, picture.note, timed.text(), remarks(&outcomes)))?;
        }
        let texts: Vec<_> =
            outcomes.iter().map(|outcome| toml::to_string(&outcome.settings.parameters)).collect::<Result<_, _>>()?;
        let named: Vec<_> = outcomes.iter().zip(&texts).map(|(outcome, text)| outcome.named(text)).collect();
        let mut files = export::write_all(folder, &picture, &named, origin)?;
        if let Some(first) = outcomes.first() {
            recording.steps.clone_from(&first.track.steps);
        }
        // One that an earlier result brings along says nothing of this one.
        recording.metadata.remove("calibration");
        if let Some(calibration) = calibration {
            let text = toml::to_string(&calibration)?;
            file::write(&folder.join(CALIBRATION), text.as_bytes())?;
            files.push(CALIBRATION.to_owned());
            recording.metadata.insert("calibration".into(), text);
        }
        let (building, moments) = following.as_ref().map(|following| following.shown()).unwrap_or_default();
        mcap::write_shown(&folder.join(RECORDING), &recording, &building, moments)?;
        files.push(RECORDING.to_owned());
        if !quiet {
            print(&format!("Written to {}: {}\n", folder.display(), files.join(", ")))?;
        }
        Ok(recording)
    }
}

impl Outcome {
    fn named<'a>(&'a self, parameters: &'a str) -> Named<'a> {
        let Self { settings, track, placement, .. } = self;
        Named { role: settings.role, label: &settings.label, track, parameters, placement: *placement }
    }
}

/// Tracks a recording and compares the track with what is known.
fn outcome(
    recording: &Recording,
    calibration: Option<&Calibration>,
    settings: Settings,
    following: Option<&mut Following>,
    quiet: bool,
) -> Outcome {
    let bar = progress(recording.samples.len() as u64, &format!("tracking ({})", settings.label), quiet);
    let begun = Instant::now();
    let correct = |sample: &ImuSample| calibration.map_or(*sample, |calibration| calibration.apply(sample, None));
    let began_us = recording.began_us();
    let mut steering = Steering { recorded: &recording.orders, orders: Orders::default(), following, began_us };
    let track = if recording.samples.is_empty() {
        recording.steps.iter().for_each(|step| _ = steering.after(step));
        Track::of_steps(&recording.steps)
    } else {
        let samples = recording.samples.iter().map(correct).progress_with(bar);
        Track::steered(samples, &settings.parameters, &mut steering)
    };
    let taken = begun.elapsed();
    let metrics = recording.truth.as_ref().map(|truth| score(&track, &Truth::from(truth)));
    let placement = recording.truth.as_ref().map_or_else(Placement::default, |truth| placement(&track, truth));
    Outcome { settings, track, taken, metrics, placement }
}

/// Gives the tracker of a recording its orders.
struct Steering<'a> {
    recorded: &'a [(usize, Order)],
    orders: Orders,
    following: Option<&'a mut Following>,
    /// When the time of the recording was zero, if it knows its date. **Units:** microseconds since the beginning of 1970.
    began_us: Option<i64>,
}

impl Steer for Steering<'_> {
    fn before(&mut self, sample: usize) -> Vec<Order> {
        self.orders.before(self.recorded, sample).collect()
    }

    fn after(&mut self, step: &Step) -> Option<Order> {
        let mode = self.following.as_mut()?.step(step, self.began_us.map(|began| began + step.stance_end.0)).0.mode;
        self.orders.after(self.recorded, mode)
    }
}

/// Lays a track on the truth at the first stance that both have and along the first metres, as the end error does.
fn placement(track: &Track, truth: &SimulatedTruth) -> Placement {
    let intervals: Vec<_> = truth.stances.iter().map(|stance| (stance.start, stance.end)).collect();
    let found = Matching::of(&track.stances, &intervals, 0).found;
    let pairs: Vec<_> = truth
        .stances
        .iter()
        .zip(found)
        .filter_map(|(stance, index)| index.map(|index| (track.stances[index].position, stance.position)))
        .collect();
    let Some(&(from, to)) = pairs.first() else { return Placement::default() };
    let plane = |[x, y, _]: [f64; 3]| [x, y];
    let (mut estimated, mut true_way) = (Vec::new(), Vec::new());
    for &(from, to) in &pairs {
        estimated.push(plane(from));
        true_way.push(plane(to));
        if path_length(&true_way) >= ALIGNED_START_M {
            break;
        }
    }
    let rigid = Rigid::fit_from_start(&estimated, &true_way);
    let (origin, ahead) = (rigid.apply([0.0; 2]), rigid.apply([1.0, 0.0]));
    Placement {
        turn: (ahead[1] - origin[1]).atan2(ahead[0] - origin[0]),
        shift: [origin[0], origin[1], to[2] - from[2]],
    }
}

/// The figures of every set of settings; those that need a truth only if there is one.
fn table(recording: &Recording, outcomes: &[Outcome]) -> Table {
    let headings: &[_] = if recording.truth.is_some() {
        &["strides", "missed", "invented", "distance, m", "end error, m", "height error, m"]
    } else {
        &["strides", "distance, m", "end from start, m", "end above start, m"]
    };
    let mut table = Table::new("settings", headings);
    for Outcome { settings, track, metrics, .. } in outcomes {
        let mut cells = vec![track.strides().to_string()];
        let length = fixed(track.distance(), 1);
        if let Some(metrics) = metrics {
            let count = |metric| metrics.get(metric).map_or_else(String::new, |value| format!("{value:.0}"));
            // Whoever has not moved has no end that could be wrong.
            let moved = track.strides() > 0;
            let metres =
                |metric| metrics.get(metric).filter(|_| moved).map_or_else(|| "-".into(), |value| fixed(value, 2));
            cells.extend([count(Metric::StancesMissed), count(Metric::StancesInvented), length]);
            cells.extend([metres(Metric::EndError), metres(Metric::HeightError)]);
        } else {
            let [x, y, z] = track.stances.last().map_or([0.0; 3], |stance| stance.position);
            cells.extend([length, fixed(x.hypot(y), 2), fixed(z, 2)]);
        }
        table.row(settings.label.clone(), cells);
    }
    if let Some(truth) = &recording.truth {
        let way: Vec<_> = truth.stances.iter().map(|stance| [stance.position[0], stance.position[1]]).collect();
        let strides = truth.stances.len().saturating_sub(1).to_string();
        table.row("truth", vec![strides, String::new(), String::new(), fixed(path_length(&way), 1)]);
    }
    table
}

/// A number with so many digits behind the point, and zero without a sign.
fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|digit| matches!(digit, '0' | '.')) => size.to_owned(),
        _ => text,
    }
}

/// The table with the time that tracking took, which a picture must not depend on.
fn timed(mut table: Table, outcomes: &[Outcome]) -> Table {
    let times = outcomes.iter().map(|outcome| format!("{:.2}", outcome.taken.as_secs_f64()));
    table.column("time taken, s", times);
    table
}

/// The tracks, the truth, and their figures.
fn picture(title: String, note: String, recording: &Recording, outcomes: &[Outcome], table: &Table) -> Picture {
    let mut picture = Picture::new(title);
    picture.note = note;
    picture.columns = table.headings().to_vec();
    for (outcome, row) in outcomes.iter().zip(table.rows()) {
        picture.lines.push(Line::of(&outcome.named(""), row.cells.clone()));
    }
    if let (Some(truth), Some(row)) = (&recording.truth, table.rows().get(outcomes.len())) {
        // What the ground did is not part of the truth; the line is drawn without dots.
        let dots =
            truth.stances.iter().map(|stance| Dot { position: stance.position, mode: FloorMode::Level }).collect();
        let (label, cells) = (row.name.clone(), row.cells.clone());
        picture.lines.push(Line { role: Role::Truth, label, cells, dots, foot: Vec::new() });
    }
    picture
}

/// How long the recording is, how dense, by what it was corrected, and how the tracks were laid.
fn note(recording: &Recording, calibration: Option<&Calibration>, outcomes: &[Outcome]) -> String {
    let corrected = calibration.map(|known| format!("; calibration: {}", known.quality.grade)).unwrap_or_default();
    let laid = if recording.truth.is_some() {
        format!("; tracks laid on the truth by their first {ALIGNED_START_M} m")
    } else if outcomes.len() > 1 {
        "; tracks laid on each other at the start".into()
    } else {
        String::new()
    };
    let (seconds, rate, samples) = (recording.duration_s() as u64, recording.rate_hz(), recording.samples.len());
    format!("{} min {:02} s, {samples} samples at {rate:.0} Hz{corrected}{laid}", seconds / 60, seconds % 60)
}

/// What was unusual, one line for each set of settings that met something.
fn remarks(outcomes: &[Outcome]) -> String {
    let mut lines = String::new();
    for Outcome { settings, track, .. } in outcomes {
        let counters = track.counters;
        let mut met: Vec<_> = [
            (counters.not_finite, "samples without a number"),
            (counters.repeated, "repeated time stamps"),
            (counters.backwards, "time stamps in the past"),
            (counters.gaps, "gaps"),
            (counters.accel_clipped, "samples with a clipped accelerometer"),
            (counters.gyro_clipped, "samples with a clipped gyroscope"),
            (counters.repaired, "repaired covariances"),
        ]
        .into_iter()
        .filter(|&(count, _)| count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
        if track.steps.is_empty() {
            met.insert(0, "no stance was found: the foot never rested long enough to begin".into());
        }
        if !met.is_empty() {
            lines.push_str(&format!("{}: {}\n", settings.label, met.join(", ")));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(fixed(-0.004, 2), "0.00");
        assert_eq!(fixed(-0.0, 1), "0.0");
        assert_eq!(fixed(-0.006, 2), "-0.01");
    }
}
