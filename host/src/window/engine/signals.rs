//! Everything that can be plotted over time, and what of it has been so far.
//!
//! What the engine gathers in a [`History`] it hands on as [`Signals`]: pieces that never change again are shared, so that
//! handing on an hour costs no more than handing on a second, and a window that is slow misses nothing.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Something that changes over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Signal {
    /// Specific force along x.
    AccelX,
    /// Along y.
    AccelY,
    /// Along z.
    AccelZ,
    /// Its length.
    AccelNorm,
    /// Angular rate about x.
    GyroX,
    /// About y.
    GyroY,
    /// About z.
    GyroZ,
    /// Its length.
    GyroNorm,
    /// How restless the foot is, as the detector of stances measures it.
    Statistic,
    /// Below it the foot stands.
    Bound,
    /// Whether the foot stands.
    Stance,
    /// How long it has stood.
    StillTime,
    /// Speed of the foot.
    Speed,
    /// Its part upwards.
    Climb,
    /// Height above the start, by the steps alone.
    Height,
    /// Standard deviation of the way since the last stance.
    WaySigma,
    /// Standard deviation of the velocity.
    VelocitySigma,
    /// What a zero-velocity update takes away of the velocity: with the foot at rest, nearly all of its innovation.
    Innovation,
    /// Length of the last step.
    StepLength,
    /// Standard deviation of the likeliest place.
    PlaceSigma,
    /// Share of the weight of the likeliest place.
    Probability,
    /// Number of particles.
    Particles,
    /// Effective number of particles.
    Effective,
    /// How well the last step fits the building.
    Fit,
    /// Frames that came damaged.
    FramesBad,
    /// Steps that wait on the shoe for their acknowledgement.
    Waiting,
    /// From the end of a stance to the arrival of its step.
    Delay,
    /// Time that the processor of the shoe was busy.
    Load,
}

/// Of all signals at one moment; what is not known is not a number.
pub type Row = [f32; Signal::COUNT];

impl Signal {
    /// How many there are.
    pub const COUNT: usize = Self::ALL.len();

    /// All, in their order.
    pub const ALL: [Self; 28] = [
        Self::AccelX,
        Self::AccelY,
        Self::AccelZ,
        Self::AccelNorm,
        Self::GyroX,
        Self::GyroY,
        Self::GyroZ,
        Self::GyroNorm,
        Self::Statistic,
        Self::Bound,
        Self::Stance,
        Self::StillTime,
        Self::Speed,
        Self::Climb,
        Self::Height,
        Self::WaySigma,
        Self::VelocitySigma,
        Self::Innovation,
        Self::StepLength,
        Self::PlaceSigma,
        Self::Probability,
        Self::Particles,
        Self::Effective,
        Self::Fit,
        Self::FramesBad,
        Self::Waiting,
        Self::Delay,
        Self::Load,
    ];

    /// Name and unit; `1` for a number without.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::AccelX => ("acceleration x", "m/s²"),
            Self::AccelY => ("acceleration y", "m/s²"),
            Self::AccelZ => ("acceleration z", "m/s²"),
            Self::AccelNorm => ("acceleration, norm", "m/s²"),
            Self::GyroX => ("rate x", "rad/s"),
            Self::GyroY => ("rate y", "rad/s"),
            Self::GyroZ => ("rate z", "rad/s"),
            Self::GyroNorm => ("rate, norm", "rad/s"),
            Self::Statistic => ("restlessness", "1"),
            Self::Bound => ("bound of a stance", "1"),
            Self::Stance => ("foot stands", "1"),
            Self::StillTime => ("still time", "s"),
            Self::Speed => ("speed", "m/s"),
            Self::Climb => ("speed upwards", "m/s"),
            Self::Height => ("height above start", "m"),
            Self::WaySigma => ("sigma of the way", "m"),
            Self::VelocitySigma => ("sigma of the velocity", "m/s"),
            Self::Innovation => ("velocity corrected", "m/s"),
            Self::StepLength => ("step length", "m"),
            Self::PlaceSigma => ("sigma of the place", "m"),
            Self::Probability => ("probability of the place", "1"),
            Self::Particles => ("particles", "1"),
            Self::Effective => ("effective particles", "1"),
            Self::Fit => ("fit of the step", "1"),
            Self::FramesBad => ("damaged frames", "1"),
            Self::Waiting => ("steps waiting", "1"),
            Self::Delay => ("delay of a step", "ms"),
            Self::Load => ("load of the shoe", "1/1000"),
        }
    }

    /// Whether it is known with each sample, and never without them.
    pub fn is_of_samples(self) -> bool {
        self.index() <= Self::Bound.index() || matches!(self, Self::WaySigma | Self::VelocitySigma | Self::Innovation)
    }

    /// Where it stands in a [`Row`].
    pub fn index(self) -> usize {
        self as usize
    }
}

/// Rows of a piece.
const PIECE: usize = 256;

/// Some rows one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
struct Piece {
    /// **Units:** s.
    times: Vec<f64>,
    rows: Vec<Row>,
}

/// What has been so far, and grows.
#[derive(Clone, Debug, Default)]
pub struct History {
    whole: Vec<Arc<Piece>>,
    tail: Piece,
}

impl History {
    /// Appends a row; one that lies before the last is left out. **Units:** s.
    pub fn push(&mut self, time: f64, row: &Row) {
        if self.end().is_some_and(|end| time <= end) {
            return;
        }
        self.tail.times.push(time);
        self.tail.rows.push(*row);
        if self.tail.times.len() == PIECE {
            self.whole.push(Arc::new(std::mem::take(&mut self.tail)));
        }
    }

    /// Forgets what comes after a time. **Units:** s.
    pub fn cut(&mut self, time: f64) {
        let whole = self.whole.partition_point(|piece| piece.times.last().is_some_and(|last| *last <= time));
        if let Some(piece) = self.whole.get(whole) {
            self.tail = Piece::clone(piece);
        }
        self.whole.truncate(whole);
        let rows = self.tail.times.partition_point(|at| *at <= time);
        self.tail.times.truncate(rows);
        self.tail.rows.truncate(rows);
    }

    /// The time of the last row. **Units:** s.
    pub fn end(&self) -> Option<f64> {
        self.tail.times.last().or_else(|| self.whole.last()?.times.last()).copied()
    }

    /// All of it, as it is now.
    pub fn share(&self) -> Signals {
        let tail = (!self.tail.times.is_empty()).then(|| Arc::new(self.tail.clone()));
        Signals { pieces: self.whole.iter().cloned().chain(tail).collect() }
    }
}

/// What had been at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signals {
    pieces: Arc<[Arc<Piece>]>,
}

impl Signals {
    /// From the first row to the last, if there are any. **Units:** s.
    pub fn span(&self) -> Option<[f64; 2]> {
        Some([*self.pieces.first()?.times.first()?, *self.pieces.last()?.times.last()?])
    }

    /// Whether anything is known of a signal.
    pub fn knows(&self, signal: Signal) -> bool {
        self.rows(f64::NEG_INFINITY, f64::INFINITY).any(|(_, row)| row[signal.index()].is_finite())
    }

    /// The value that held at a time, if one did. **Units:** s.
    pub fn at(&self, signal: Signal, time: f64) -> Option<f32> {
        let piece = self.pieces.partition_point(|piece| piece.times[0] <= time).checked_sub(1)?;
        let piece = &self.pieces[piece];
        let row = piece.times.partition_point(|at| *at <= time).checked_sub(1)?;
        Some(piece.rows[row][signal.index()]).filter(|value| value.is_finite())
    }

    /// The curve of a signal from one time to another as points for so many columns of pixels: where there are more values
    /// than that, the least and the largest of each column. **Units:** s.
    pub fn curve(&self, signal: Signal, [from, to]: [f64; 2], columns: usize) -> Vec<[f64; 2]> {
        let values = move || {
            let all = self.rows(from, to).map(move |(time, row)| [time, f64::from(row[signal.index()])]);
            all.filter(|[_, value]| value.is_finite())
        };
        let count = values().count();
        let columns = columns.max(1);
        if count <= 2 * columns {
            return values().collect();
        }
        let width = count.div_ceil(columns);
        let mut curve = Vec::with_capacity(2 * columns + 2);
        let mut extremes: Option<[[f64; 2]; 2]> = None;
        for (index, point) in values().enumerate() {
            let [mut least, mut largest] = extremes.unwrap_or([point; 2]);
            if point[1] < least[1] {
                least = point;
            }
            if point[1] > largest[1] {
                largest = point;
            }
            extremes = Some([least, largest]);
            if (index + 1) % width == 0 || index + 1 == count {
                let [first, second] = if least[0] <= largest[0] { [least, largest] } else { [largest, least] };
                curve.push(first);
                if second != first {
                    curve.push(second);
                }
                extremes = None;
            }
        }
        curve
    }

    /// Rows from one time to another, and one more at either end.
    fn rows(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, &Row)> {
        let first = self.pieces.partition_point(|piece| piece.times[0] < from).saturating_sub(1);
        let pieces = self.pieces[first..].iter().take_while(move |piece| piece.times[0] <= to);
        pieces.flat_map(move |piece| {
            let begin = piece.times.partition_point(|time| *time < from).saturating_sub(1);
            let end = (piece.times.partition_point(|time| *time <= to) + 1).min(piece.times.len());
            piece.times[begin..end].iter().copied().zip(&piece.rows[begin..end])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(count: usize) -> History {
        let mut history = History::default();
        for index in 0..count {
            let mut row = [f32::NAN; Signal::COUNT];
            row[Signal::Speed.index()] = if index == count / 2 { 100.0 } else { (index % 7) as f32 };
            history.push(index as f64 * 0.01, &row);
        }
        history
    }

    #[test]
    fn every_signal_stands_at_its_place() {
        for (index, signal) in Signal::ALL.into_iter().enumerate() {
            assert_eq!(signal.index(), index, "{signal:?}");
        }
    }

    #[test]
    fn what_was_handed_on_does_not_change_and_shares_what_is_whole() {
        let mut history = history(1_000);
        let before = history.share();
        let copy = format!("{before:?}");
        history.push(1e3, &[0.0; Signal::COUNT]);
        history.push(5.0, &[9.0; Signal::COUNT]);
        let after = history.share();
        assert_eq!(format!("{before:?}"), copy);
        assert_eq!(after.span(), Some([0.0, 1e3]), "a row from before the last is left out");
        assert!(Arc::ptr_eq(&before.pieces[0], &after.pieces[0]));
    }

    #[test]
    fn what_is_cut_off_grows_again() {
        for rows in [0, 1, 255, 256, 300, 999] {
            let mut cut = history(1_000);
            let time = rows as f64 * 0.01;
            cut.cut(time);
            assert_eq!(cut.end(), Some(time), "{rows}");
            for (at, row) in history(1_000).share().rows(time + 0.005, f64::INFINITY) {
                cut.push(at, row);
            }
            assert_eq!(
                cut.share().curve(Signal::Speed, [0.0, 1e9], 10_000),
                history(1_000).share().curve(Signal::Speed, [0.0, 1e9], 10_000)
            );
        }
    }

    #[test]
    fn a_curve_of_few_points_keeps_the_extremes() {
        let signals = history(10_000).share();
        let curve = signals.curve(Signal::Speed, [0.0, 100.0], 50);
        assert!(curve.len() <= 100, "{}", curve.len());
        let largest = curve.iter().map(|point| point[1]).fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(largest, 100.0);
        assert!(curve.windows(2).all(|pair| pair[0][0] <= pair[1][0]), "in the order of time");
        // Where there is room for all, all are there: those of the range, and one more at either end.
        assert_eq!(signals.curve(Signal::Speed, [1.0, 2.0], 500).len(), 103);
        assert!(signals.curve(Signal::Load, [0.0, 100.0], 50).is_empty() && !signals.knows(Signal::Load));
    }

    #[test]
    fn a_value_holds_until_the_next() {
        let signals = history(100).share();
        assert_eq!(signals.at(Signal::Speed, 0.034), Some(3.0));
        assert_eq!((signals.at(Signal::Speed, -1.0), signals.at(Signal::Load, 0.5)), (None, None));
        assert_eq!(Signals::default().at(Signal::Speed, 0.0), None);
    }
}
