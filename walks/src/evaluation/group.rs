//! Figures over several recordings: what a change of the tracker is judged by.

use super::metrics::Metric;
use serde::{Deserialize, Serialize};

/// Recordings that belong together.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Group {
    /// How it is called in every output.
    pub name: String,
    /// Names of recordings.
    pub recordings: Vec<String>,
    /// What is asked of them.
    pub figures: Vec<Figure>,
}

/// A figure over a group, and what is asked of it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Of each recording.
    pub metric: Metric,
    /// How those are drawn together.
    pub statistic: Statistic,
    /// What has to be reached.
    pub must: Option<f64>,
    /// What would be good.
    pub aim: Option<f64>,
}

/// How the figures of single recordings become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Statistic {
    /// The middle one; the mean of the two middle ones of an even number.
    Median,
    /// Their mean.
    Mean,
    /// The worst.
    Worst,
    /// Their sum.
    Sum,
}

impl Statistic {
    /// The name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Median => "median",
            Self::Mean => "mean",
            Self::Worst => "worst",
            Self::Sum => "sum",
        }
    }
}

impl Figure {
    /// The figure over `values`, which are finite; `None` without values.
    pub fn of(&self, values: &[f64]) -> Option<f64> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len();
        Some(match self.statistic {
            Statistic::Median => (sorted[(count - 1) / 2] + sorted[count / 2]) / 2.0,
            Statistic::Mean => sorted.iter().sum::<f64>() / count as f64,
            Statistic::Worst if self.metric.larger_is_better() => first,
            Statistic::Worst => last,
            Statistic::Sum => sorted.iter().sum(),
        })
    }

    /// Whether `value` is at least as good as `bound`.
    pub fn reaches(&self, value: f64, bound: f64) -> bool {
        if self.metric.larger_is_better() { value >= bound } else { value <= bound }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(metric: Metric, statistic: Statistic) -> Figure {
        Figure { metric, statistic, must: None, aim: None }
    }

    #[test]
    fn statistics_by_hand() {
        let values = [0.4, 0.1, 0.2, 0.9];
        let of = |statistic| figure(Metric::RigidRmse, statistic).of(&values).unwrap();
        // 1e-12: sums of four numbers below 1 in f64.
        assert!((of(Statistic::Median) - 0.3).abs() < 1e-12);
        assert!((of(Statistic::Mean) - 0.4).abs() < 1e-12);
        assert!((of(Statistic::Sum) - 1.6).abs() < 1e-12);
        assert_eq!(of(Statistic::Worst), 0.9);
        assert_eq!(figure(Metric::RigidRmse, Statistic::Median).of(&[7.0]), Some(7.0));
        assert_eq!(figure(Metric::RigidRmse, Statistic::Median).of(&[]), None);
    }

    #[test]
    fn the_worst_share_found_is_the_smallest() {
        let found = figure(Metric::StancesFoundPercent, Statistic::Worst);
        assert_eq!(found.of(&[100.0, 97.0]), Some(97.0));
        assert!(found.reaches(99.5, 99.5) && !found.reaches(99.0, 99.5));
        let error = figure(Metric::RigidRmse, Statistic::Worst);
        assert!(error.reaches(0.2, 0.25) && !error.reaches(0.3, 0.25));
    }
}
