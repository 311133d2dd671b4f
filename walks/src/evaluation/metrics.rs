//! The figures of an evaluation: their names, what they mean, and how they are kept.

use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;

/// A figure by which a track is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(try_from = "String")]
pub enum Metric {
    /// Root mean square distance to the true positions after the best turn and shift in the plane.
    RigidRmse,
    /// Horizontal distance to the truth at the end, origin and heading aligned on the first 10 m.
    EndError,
    /// The same in per cent of the true way.
    EndErrorPercent,
    /// Horizontal distance between the first and the last stance of a closed walk.
    ClosureHorizontal,
    /// The same in space.
    Closure3d,
    /// Height of the last stance above the first.
    HeightEnd,
    /// Height of the last stance against the true one, in size.
    HeightError,
    /// The same for each 50 m of way.
    HeightPer50m,
    /// Difference of the heights climbed by the two feet of one walk.
    FeetHeightDifference,
    /// Typical slope of the heading error over time, left positive.
    HeadingDrift,
    /// Surveyed or simulated stances.
    StancesTrue,
    /// Those that no detected stance covers.
    StancesMissed,
    /// Detected stances between them that nobody stood.
    StancesInvented,
    /// Share of the true stances that were found.
    StancesFoundPercent,
    /// Strides counted.
    StrideCountTrue,
    /// Strides in the track.
    StrideCountFound,
    /// The difference of both, in size.
    StrideCountError,
    /// Root mean square error of the lengths of single strides.
    StrideLengthRms,
    /// The same over the strides on which the foot hardly turned.
    StrideLengthStraightRms,
    /// Their mean error; positive: too long.
    StrideLengthMeanError,
    /// Strides of known length.
    StrideLengthsTrue,
    /// Those without a detected stance at both ends.
    StrideLengthsMissed,
    /// Share of the time labelled as standing that lies in no detected stance.
    StillMissedPercent,
    /// Share of the time labelled as moving that lies in a detected stance.
    StillInventedPercent,
    /// Horizontal length of the true way.
    TruthDistance,
    /// What was added to the times of the truth to meet those of the recording.
    ClockOffset,
}

/// How a figure is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number.
    Count,
    /// A quantity.
    Quantity,
}

impl Metric {
    /// All of them, in the order of output.
    pub const ALL: [Self; 26] = [
        Self::RigidRmse,
        Self::EndError,
        Self::EndErrorPercent,
        Self::ClosureHorizontal,
        Self::Closure3d,
        Self::HeightEnd,
        Self::HeightError,
        Self::HeightPer50m,
        Self::FeetHeightDifference,
        Self::HeadingDrift,
        Self::StancesTrue,
        Self::StancesMissed,
        Self::StancesInvented,
        Self::StancesFoundPercent,
        Self::StrideCountTrue,
        Self::StrideCountFound,
        Self::StrideCountError,
        Self::StrideLengthRms,
        Self::StrideLengthStraightRms,
        Self::StrideLengthMeanError,
        Self::StrideLengthsTrue,
        Self::StrideLengthsMissed,
        Self::StillMissedPercent,
        Self::StillInventedPercent,
        Self::TruthDistance,
        Self::ClockOffset,
    ];

    /// The name in files; it ends with the unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::RigidRmse => "rigid_rmse_m",
            Self::EndError => "end_error_m",
            Self::EndErrorPercent => "end_error_percent",
            Self::ClosureHorizontal => "closure_horizontal_m",
            Self::Closure3d => "closure_3d_m",
            Self::HeightEnd => "height_end_m",
            Self::HeightError => "height_error_m",
            Self::HeightPer50m => "height_per_50m_m",
            Self::FeetHeightDifference => "feet_height_difference_m",
            Self::HeadingDrift => "heading_drift_deg_per_min",
            Self::StancesTrue => "stances_true",
            Self::StancesMissed => "stances_missed",
            Self::StancesInvented => "stances_invented",
            Self::StancesFoundPercent => "stances_found_percent",
            Self::StrideCountTrue => "stride_count_true",
            Self::StrideCountFound => "stride_count_found",
            Self::StrideCountError => "stride_count_error",
            Self::StrideLengthRms => "stride_length_rms_m",
            Self::StrideLengthStraightRms => "stride_length_straight_rms_m",
            Self::StrideLengthMeanError => "stride_length_mean_error_m",
            Self::StrideLengthsTrue => "stride_lengths_true",
            Self::StrideLengthsMissed => "stride_lengths_missed",
            Self::StillMissedPercent => "still_missed_percent",
            Self::StillInventedPercent => "still_invented_percent",
            Self::TruthDistance => "truth_distance_m",
            Self::ClockOffset => "clock_offset_s",
        }
    }

    /// How it is written.
    pub fn kind(self) -> Kind {
        match self {
            Self::StancesTrue
            | Self::StancesMissed
            | Self::StancesInvented
            | Self::StrideCountTrue
            | Self::StrideCountFound
            | Self::StrideCountError
            | Self::StrideLengthsTrue
            | Self::StrideLengthsMissed => Kind::Count,
            _ => Kind::Quantity,
        }
    }

    /// Whether a larger value is the better one.
    pub fn larger_is_better(self) -> bool {
        self == Self::StancesFoundPercent
    }
}

impl TryFrom<String> for Metric {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|metric| metric.name() == name)
            .ok_or_else(|| format!("'{name}' is no metric; known: {}", Self::ALL.map(Self::name).join(", ")))
    }
}

impl Serialize for Metric {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// The figures of one track: only those that its truth allows. All are finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metrics(BTreeMap<Metric, f64>);

impl Metrics {
    /// Keeps a figure; one that is not finite, or absent, is left out.
    pub fn set(&mut self, metric: Metric, value: impl Into<Option<f64>>) {
        if let Some(value) = value.into().filter(|value| value.is_finite()) {
            self.0.insert(metric, value);
        }
    }

    /// Keeps a count.
    pub fn count(&mut self, metric: Metric, count: usize) {
        self.set(metric, count as f64);
    }

    /// A figure, if there is one.
    pub fn get(&self, metric: Metric) -> Option<f64> {
        self.0.get(&metric).copied()
    }

    /// All figures, in the order of [`Metric::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = (Metric, f64)> + '_ {
        self.0.iter().map(|(&metric, &value)| (metric, value))
    }
}

impl Serialize for Metrics {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (metric, value) in self.iter() {
            match metric.kind() {
                Kind::Count => map.serialize_entry(metric.name(), &(value as u64))?,
                Kind::Quantity => map.serialize_entry(metric.name(), &value)?,
            }
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_listed_once_and_in_order() {
        assert!(Metric::ALL.is_sorted());
        for metric in Metric::ALL {
            assert_eq!(Metric::try_from(metric.name().to_owned()), Ok(metric));
        }
    }

    #[test]
    fn an_unknown_name_is_told_the_known_ones() {
        let message = Metric::try_from("rmse".to_owned()).unwrap_err();
        assert!(message.starts_with("'rmse' is no metric; known: rigid_rmse_m, "), "{message}");
    }

    #[test]
    fn counts_are_whole_numbers_in_json_and_what_is_not_finite_is_left_out() {
        let mut metrics = Metrics::default();
        metrics.count(Metric::StancesTrue, 34);
        metrics.set(Metric::RigidRmse, 0.25);
        metrics.set(Metric::EndError, f64::NAN);
        metrics.set(Metric::HeightEnd, None);
        assert_eq!(serde_json::to_string(&metrics).unwrap(), r#"{"rigid_rmse_m":0.25,"stances_true":34}"#);
    }
}
