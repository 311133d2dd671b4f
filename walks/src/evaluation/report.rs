//! An evaluation as a table for people, one JSON object for programs, or CSV for a spreadsheet.

use super::group::Statistic;
use super::metrics::{Kind, Metric, Metrics};
use super::perturbation::Perturbation;
use super::{Evaluation, GroupFigure, Outcome, Status};
use serde::Serialize;
use sohle_shared::tracker::Counters;
use std::fmt::Write;

/// An evaluation, perhaps with the same of perturbed recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Of the recordings as they are.
    pub evaluation: Evaluation,
    /// Of the recordings as changed.
    pub perturbed: Vec<(Perturbation, Evaluation)>,
}

#[derive(Serialize)]
struct Json<'a> {
    recordings: Vec<JsonRecording<'a>>,
    groups: Vec<JsonFigure<'a>>,
    summary: JsonSummary<'a>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    perturbed: Vec<JsonPerturbed<'a>>,
    outputs_hash: String,
}

#[derive(Serialize)]
struct JsonRecording<'a> {
    name: &'a str,
    status: &'static str,
    settings: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    distance_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    steps: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metrics: Option<&'a Metrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    counters: Option<&'a Counters>,
}

#[derive(Serialize)]
struct JsonFigure<'a> {
    name: &'a str,
    metric: Metric,
    statistic: Statistic,
    settings: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    must: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    aim: Option<f64>,
    recordings_used: usize,
    recordings_wanted: usize,
}

#[derive(Serialize)]
struct JsonSummary<'a> {
    recordings: usize,
    scored: usize,
    skipped: Vec<&'a str>,
    failed: Vec<&'a str>,
}

#[derive(Serialize)]
struct JsonPerturbed<'a> {
    perturbation: &'static str,
    recordings: Vec<JsonRecording<'a>>,
    groups: Vec<JsonFigure<'a>>,
}

impl Status {
    /// The word for it in every output.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Scored(_) => "scored",
            Self::Skipped(_) => "skipped",
            Self::Failed(_) => "failed",
        }
    }

    /// Why there is no score.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Self::Scored(_) => None,
            Self::Skipped(reason) | Self::Failed(reason) => Some(reason),
        }
    }
}

impl Report {
    /// One JSON object, with a line end.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        let recordings = self.evaluation.outcomes.iter().map(json_recording).collect();
        let perturbed = self.perturbed.iter();
        let json = Json {
            recordings,
            groups: self.evaluation.groups.iter().map(json_figure).collect(),
            summary: JsonSummary {
                recordings: self.names(|_| true).len(),
                scored: self.names(|status| matches!(status, Status::Scored(_))).len(),
                skipped: self.skipped(),
                failed: self.failed(),
            },
            perturbed: perturbed
                .map(|(perturbation, evaluation)| JsonPerturbed {
                    perturbation: perturbation.name(),
                    recordings: evaluation.outcomes.iter().map(json_recording).collect(),
                    groups: evaluation.groups.iter().map(json_figure).collect(),
                })
                .collect(),
            outputs_hash: self.evaluation.outputs_hash(),
        };
        Ok(serde_json::to_string_pretty(&json)? + "\n")
    }

    /// A line for each recording and setting, with a header.
    pub fn csv(&self) -> String {
        let mut header = vec!["name", "settings", "status", "distance_m", "steps"];
        header.extend(Metric::ALL.map(Metric::name));
        header.push("reason");
        let mut text = header.join(",") + "\n";
        for outcome in &self.evaluation.outcomes {
            let mut cells = vec![quoted(&outcome.name), outcome.settings.into(), outcome.status.name().into()];
            let score = outcome.score();
            cells.push(score.map(|score| score.distance.to_string()).unwrap_or_default());
            cells.push(score.map(|score| score.steps.to_string()).unwrap_or_default());
            for metric in Metric::ALL {
                let value = score.and_then(|score| score.metrics.get(metric));
                cells.push(value.map(|value| value.to_string()).unwrap_or_default());
            }
            cells.push(quoted(outcome.status.reason().unwrap_or_default()));
            text += &(cells.join(",") + "\n");
        }
        text
    }

    /// Everything for people: recordings, groups, perturbations, summary.
    pub fn table(&self) -> String {
        let mut text = self.recordings_table();
        if !self.evaluation.groups.is_empty() {
            let _ = write!(text, "\n{}", self.groups_table());
        }
        if !self.perturbed.is_empty() {
            let _ = write!(text, "\n{}", self.perturbed_table());
        }
        let _ = write!(text, "\n{}", self.summary());
        text
    }

    /// How many ran, which did not and why.
    pub fn summary(&self) -> String {
        let all = self.names(|_| true).len();
        let scored = self.names(|status| matches!(status, Status::Scored(_))).len();
        let mut text = format!("{scored} of {all} recordings ran");
        for (word, names) in [("skipped", self.skipped()), ("failed", self.failed())] {
            if !names.is_empty() {
                let _ = write!(text, "; {word}: {}", names.join(", "));
            }
        }
        text.push('\n');
        let mut told: Vec<&str> = Vec::new();
        for outcome in &self.evaluation.outcomes {
            if let Some(reason) = outcome.status.reason()
                && !told.contains(&outcome.name.as_str())
            {
                told.push(&outcome.name);
                let _ = writeln!(text, "  {} {}: {reason}", outcome.name, outcome.status.name());
            }
        }
        let _ = writeln!(text, "outputs hash {}", self.evaluation.outputs_hash());
        text
    }

    /// Recordings that are not there.
    pub fn skipped(&self) -> Vec<&str> {
        self.names(|status| matches!(status, Status::Skipped(_)))
    }

    /// Recordings that are there and could not be scored with some of the settings.
    pub fn failed(&self) -> Vec<&str> {
        self.names(|status| matches!(status, Status::Failed(_)))
    }

    /// Names of the recordings with such an outcome, each once, in the order of the manifest.
    fn names(&self, wanted: impl Fn(&Status) -> bool) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for outcome in &self.evaluation.outcomes {
            if wanted(&outcome.status) && !names.contains(&outcome.name.as_str()) {
                names.push(&outcome.name);
            }
        }
        names
    }

    fn settings(&self) -> Vec<&'static str> {
        let mut settings = Vec::new();
        for outcome in &self.evaluation.outcomes {
            if !settings.contains(&outcome.settings) {
                settings.push(outcome.settings);
            }
        }
        settings
    }

    fn recordings_table(&self) -> String {
        let settings = self.settings();
        let titles: Vec<&str> = COLUMNS.iter().map(|column| column.0).collect();
        let mut rows = vec![["recording"].into_iter().chain(titles).map(String::from).collect::<Vec<_>>()];
        for name in self.names(|_| true) {
            let mut row = vec![name.to_owned()];
            for (_, cell) in COLUMNS {
                let of = |settings: &&str| {
                    let same = |outcome: &&Outcome| outcome.name == name && outcome.settings == *settings;
                    self.evaluation.outcomes.iter().find(same).map(cell).unwrap_or_default()
                };
                let cells: Vec<String> = settings.iter().map(of).collect();
                row.push(if cells.iter().all(String::is_empty) { String::new() } else { cells.join(" | ") });
            }
            rows.push(row);
        }
        format!("each cell: {}\n{}", settings.join(" | "), aligned(without_empty_columns(rows)))
    }

    fn groups_table(&self) -> String {
        let settings = self.settings();
        let mut header = vec!["group", "figure"];
        header.extend(&settings);
        header.extend(["must", "aim", "reached", "recordings"]);
        let mut rows = vec![header.into_iter().map(String::from).collect::<Vec<_>>()];
        for figures in self.evaluation.groups.chunks(settings.len().max(1)) {
            let [first, ..] = figures else { continue };
            let figure = first.figure;
            let mut row = vec![first.group.clone(), format!("{} {}", figure.statistic.name(), figure.metric.name())];
            row.extend(figures.iter().map(|figure| cell(figure.figure.metric, figure.value)));
            row.push(figure.must.map(|bound| bound.to_string()).unwrap_or_default());
            row.push(figure.aim.map(|bound| bound.to_string()).unwrap_or_default());
            row.push(verdict(first).into());
            row.push(if first.of == first.wanted {
                String::new()
            } else {
                format!("{} of {}", first.of, first.wanted)
            });
            rows.push(row);
        }
        aligned(without_empty_columns(rows))
    }

    /// The figures of the first settings for each perturbation.
    fn perturbed_table(&self) -> String {
        let settings = self.settings();
        let first = settings.first().copied().unwrap_or_default();
        let mut header = vec!["group".to_owned(), "figure".to_owned(), Perturbation::Recorded.name().to_owned()];
        header.extend(self.perturbed.iter().map(|(perturbation, _)| perturbation.name().to_owned()));
        let mut rows = vec![header];
        for (index, figure) in self.evaluation.groups.iter().enumerate() {
            if figure.settings != first {
                continue;
            }
            let mut row = vec![
                figure.group.clone(),
                format!("{} {}", figure.figure.statistic.name(), figure.figure.metric.name()),
                cell(figure.figure.metric, figure.value),
            ];
            let changed = self.perturbed.iter().map(|(_, evaluation)| evaluation.groups.get(index));
            row.extend(changed.map(|figure| figure.map(|f| cell(f.figure.metric, f.value)).unwrap_or_default()));
            rows.push(row);
        }
        format!("{first} settings on changed recordings\n{}", aligned(rows))
    }
}

fn json_recording(outcome: &Outcome) -> JsonRecording<'_> {
    let score = outcome.score();
    JsonRecording {
        name: &outcome.name,
        status: outcome.status.name(),
        settings: outcome.settings,
        reason: outcome.status.reason(),
        distance_m: score.map(|score| score.distance),
        steps: score.map(|score| score.steps),
        metrics: score.map(|score| &score.metrics),
        counters: score.map(|score| &score.counters),
    }
}

fn json_figure(figure: &GroupFigure) -> JsonFigure<'_> {
    JsonFigure {
        name: &figure.group,
        metric: figure.figure.metric,
        statistic: figure.figure.statistic,
        settings: figure.settings,
        value: figure.value,
        must: figure.figure.must,
        aim: figure.figure.aim,
        recordings_used: figure.of,
        recordings_wanted: figure.wanted,
    }
}

/// What is asked of a figure and reached. A recording that was tracked without yielding the figure falls short.
fn verdict(figure: &GroupFigure) -> &'static str {
    if figure.scored == 0 {
        return "";
    }
    let Some(value) = figure.value.filter(|_| figure.of == figure.scored) else { return "short" };
    let reaches = |bound: Option<f64>| bound.map(|bound| figure.figure.reaches(value, bound));
    match (reaches(figure.figure.must), reaches(figure.figure.aim)) {
        (_, Some(true)) => "aim",
        (Some(true), _) => "must",
        (Some(false), _) => "short",
        (None, _) => "",
    }
}

/// Makes the text of a cell.
type Cell = fn(&Outcome) -> String;

/// Title and content of the columns of the first table.
const COLUMNS: [(&str, Cell); 9] = [
    ("way m", |outcome| outcome.score().map(|score| format!("{:.1}", score.distance)).unwrap_or_default()),
    ("strides/true", strides),
    ("missed+invented/stances", found),
    ("RMSE m", |outcome| value(outcome, Metric::RigidRmse)),
    ("end %", |outcome| value(outcome, Metric::EndErrorPercent)),
    ("closure m", |outcome| value(outcome, Metric::ClosureHorizontal)),
    ("closure 3-D m", |outcome| value(outcome, Metric::Closure3d)),
    ("height m", |outcome| value(outcome, Metric::HeightEnd)),
    ("stride rms m", |outcome| value(outcome, Metric::StrideLengthRms)),
];

fn value(outcome: &Outcome, metric: Metric) -> String {
    cell(metric, outcome.score().and_then(|score| score.metrics.get(metric)))
}

fn strides(outcome: &Outcome) -> String {
    let Some(score) = outcome.score() else { return String::new() };
    match score.metrics.get(Metric::StrideCountTrue) {
        Some(counted) => format!("{}/{counted}", score.steps),
        None => score.steps.to_string(),
    }
}

fn found(outcome: &Outcome) -> String {
    let count = |metric| outcome.score().and_then(|score| score.metrics.get(metric));
    match (count(Metric::StancesMissed), count(Metric::StancesInvented), count(Metric::StancesTrue)) {
        (Some(missed), Some(invented), Some(of)) => format!("{missed}+{invented}/{of}"),
        _ => String::new(),
    }
}

fn cell(metric: Metric, value: Option<f64>) -> String {
    match (value, metric.kind()) {
        (None, _) => String::new(),
        (Some(value), Kind::Count) => value.to_string(),
        (Some(value), Kind::Quantity) if metric.name().ends_with("_m") => format!("{value:.3}"),
        (Some(value), Kind::Quantity) => format!("{value:.2}"),
    }
}

/// A CSV cell: quoted if it has to be.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

fn without_empty_columns(rows: Vec<Vec<String>>) -> Vec<Vec<String>> {
    let width = rows.first().map_or(0, Vec::len);
    let used: Vec<usize> =
        (0..width).filter(|&column| rows.iter().skip(1).any(|row| !row[column].is_empty())).collect();
    rows.iter().map(|row| used.iter().map(|&column| row[column].clone()).collect()).collect()
}

/// Rows as lines, the first column to the left, the others to the right, a rule below the first row.
fn aligned(rows: Vec<Vec<String>>) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for (index, row) in rows.iter().enumerate() {
        let mut line = String::new();
        for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
            // Padding counts characters; std's does too.
            if column == 0 {
                let _ = write!(line, "{cell:<width$}");
            } else {
                let _ = write!(line, "  {cell:>width$}");
            }
        }
        text += line.trim_end();
        text.push('\n');
        if index == 0 {
            text += &"-".repeat(widths.iter().sum::<usize>() + 2 * widths.len().saturating_sub(1));
            text.push('\n');
        }
    }
    text
}
