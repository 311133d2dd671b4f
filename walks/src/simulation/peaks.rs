//! How violent a gait is: peaks, stance times and stillness of its strides, measured on samples.
//!
//! The same figures come out of a recording and out of a simulation, so that the two can be put side by side.

use sohle_shared::sample::ImuSample;
use std::fmt;

/// Accelerometer noise in the SHOE statistic (SPEC section 9). **Units:** m/s².
const SIGMA_ACCEL_M_S2: f64 = 0.02;
/// Gyroscope noise in the SHOE statistic. **Units:** rad/s.
const SIGMA_GYRO_RAD_S: f64 = 0.2 * std::f64::consts::PI / 180.0;
/// Length of its window. **Units:** s.
const WINDOW_S: f64 = 0.03;
/// Below this value of the statistic the foot counts as nearly still.
const NEARLY_STILL: f64 = 3e5;
/// Gravity to which the accelerometer at rest is scaled. **Units:** m/s².
const G_M_S2: f64 = 9.806_65;

/// A median with the range that holds the middle 80 %.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// 10 % are below.
    pub low: f64,
    /// Median.
    pub median: f64,
    /// 10 % are above.
    pub high: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share| percentile(&values, share);
        Self { low: at(0.1), median: at(0.5), high: at(0.9) }
    }
}

fn percentile(sorted: &[f64], share: f64) -> f64 {
    let index = (share * sorted.len().saturating_sub(1) as f64 + 0.5) as usize;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

/// Figures of the strides in a series of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Strides found.
    pub strides: usize,
    /// Time from the stillest moment of one stance to that of the next. **Units:** s.
    pub stride: Spread,
    /// Largest angular rate of a stride. **Units:** rad/s.
    pub rate: Spread,
    /// Angular rate that 5 % of the samples exceed. **Units:** rad/s.
    pub rate_95: f64,
    /// Largest specific force of a stride. **Units:** m/s².
    pub force: Spread,
    /// Specific force that 5 % of the samples exceed. **Units:** m/s².
    pub force_95: f64,
    /// Smallest value of the SHOE statistic in a stance.
    pub stillest: Spread,
    /// Time in a stride during which the statistic is below 3e5. **Units:** s.
    pub nearly_still: Spread,
}

/// Mean of `values` over `width` samples around each.
fn smoothed(values: &[f64], width: usize) -> Vec<f64> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    sums.push(0.0);
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    (0..values.len())
        .map(|i| {
            let (from, to) = (i.saturating_sub(width / 2), (i + width.div_ceil(2)).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

fn norm(v: [f64; 3]) -> f64 {
    libm::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
}

impl Peaks {
    /// The figures of `samples`. Offset of the gyroscope and scale of the accelerometer are taken from the stillest second.
    pub fn of(samples: &[ImuSample]) -> Self {
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Self::default() };
        let period = (last.time - first.time) as f64 * 1e-6 / samples.len().saturating_sub(1).max(1) as f64;
        let second = if period > 0.0 { (1.0 / period) as usize } else { 0 };
        if second < 10 || samples.len() < 3 * second {
            return Self::default();
        }
        let axes = |of: fn(&ImuSample) -> [f32; 3]| -> [Vec<f64>; 3] {
            std::array::from_fn(|axis| samples.iter().map(|sample| f64::from(of(sample)[axis])).collect())
        };
        let mut gyro = axes(|sample| sample.gyro.0.into());
        let mut accel = axes(|sample| sample.accel.0.into());
        let row = |of: &[Vec<f64>; 3], i: usize| [of[0][i], of[1][i], of[2][i]];

        let turning: Vec<f64> = (0..samples.len()).map(|i| norm(row(&gyro, i))).collect();
        let turning = smoothed(&turning, second);
        let inner = second / 2..samples.len() - second / 2;
        let still = inner.min_by(|&a, &b| turning[a].total_cmp(&turning[b])).unwrap_or(0);
        let rest = |of: &[Vec<f64>; 3]| -> [f64; 3] { std::array::from_fn(|axis| smoothed(&of[axis], second)[still]) };
        let (offset, gravity) = (rest(&gyro), norm(rest(&accel)));
        for axis in 0..3 {
            gyro[axis].iter_mut().for_each(|value| *value -= offset[axis]);
            accel[axis].iter_mut().for_each(|value| *value *= G_M_S2 / gravity);
        }

        let rate: Vec<f64> = (0..samples.len()).map(|i| norm(row(&gyro, i))).collect();
        let force: Vec<f64> = (0..samples.len()).map(|i| norm(row(&accel, i))).collect();
        let window = ((WINDOW_S / period + 0.5) as usize).max(2);
        let statistic = shoe(&accel, &rate, &force, window);
        let stances = stances(&statistic, second);

        let mut strides: Vec<(usize, usize)> = stances.windows(2).map(|pair| (pair[0], pair[1])).collect();
        strides.retain(|&(from, to)| {
            let swing = rate[from..to].iter().fold(0.0, |most: f64, &rate| most.max(rate));
            ((to - from) as f64) * period < 2.2 && swing > 2.0
        });
        let spread = |of: &dyn Fn(usize, usize) -> f64| Spread::of(strides.iter().map(|&(a, b)| of(a, b)).collect());
        let most = |values: &[f64], a: usize, b: usize| values[a..b].iter().fold(0.0, |most: f64, &x| most.max(x));
        let share = |values: &[f64]| {
            let mut moving: Vec<f64> = strides.iter().flat_map(|&(a, b)| values[a..b].iter().copied()).collect();
            moving.sort_by(f64::total_cmp);
            percentile(&moving, 0.95)
        };
        let around = (0.1 / period) as usize;
        Self {
            strides: strides.len(),
            stride: spread(&|a, b| (b - a) as f64 * period),
            rate: spread(&|a, b| most(&rate, a, b)),
            rate_95: share(&rate),
            force: spread(&|a, b| most(&force, a, b)),
            force_95: share(&force),
            stillest: spread(&|a, _| {
                statistic[a.saturating_sub(around)..a + around].iter().copied().fold(f64::INFINITY, f64::min)
            }),
            nearly_still: spread(&|a, b| {
                statistic[a..b].iter().filter(|&&value| value < NEARLY_STILL).count() as f64 * period
            }),
        }
    }
}

/// The SHOE statistic of each sample (Skog, Händel, Nilsson, Rantakokko: Zero-velocity detection, 2010, eq. 16).
fn shoe(accel: &[Vec<f64>; 3], rate: &[f64], force: &[f64], window: usize) -> Vec<f64> {
    let squares = |values: &[f64]| smoothed(&values.iter().map(|x| x * x).collect::<Vec<_>>(), window);
    let (rate, force) = (squares(rate), squares(force));
    let mean: [Vec<f64>; 3] = std::array::from_fn(|axis| smoothed(&accel[axis], window));
    (0..rate.len())
        .map(|i| {
            // The mean of |a - g m/|m||^2 written out.
            let deviation = force[i] - 2.0 * G_M_S2 * norm([mean[0][i], mean[1][i], mean[2][i]]) + G_M_S2 * G_M_S2;
            deviation / (SIGMA_ACCEL_M_S2 * SIGMA_ACCEL_M_S2) + rate[i] / (SIGMA_GYRO_RAD_S * SIGMA_GYRO_RAD_S)
        })
        .collect()
}

/// The stillest sample of each stance: where the smoothed logarithm is lowest within 0.3 s, with a factor of ten and more
/// between one stance and the next.
fn stances(statistic: &[f64], second: usize) -> Vec<usize> {
    let logarithm: Vec<f64> = statistic.iter().map(|value| libm::log10(value.max(0.0) + 10.0)).collect();
    let level = smoothed(&logarithm, second * 8 / 100);
    let reach = second * 3 / 10;
    let mut found: Vec<usize> = Vec::new();
    for i in 0..level.len() {
        let (from, to) = (i.saturating_sub(reach), (i + reach + 1).min(level.len()));
        // The first of equal values counts.
        if level[from..i].iter().any(|&other| other <= level[i]) || level[i..to].iter().any(|&other| other < level[i]) {
            continue;
        }
        if let Some(&last) = found.last() {
            let peak = level[last..i].iter().fold(f64::NEG_INFINITY, |most, &x| most.max(x));
            if peak - level[last].max(level[i]) < 1.0 {
                if level[i] < level[last] {
                    found.pop();
                    found.push(i);
                }
                continue;
            }
        }
        found.push(i);
    }
    found
}

impl fmt::Display for Peaks {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { strides, stride, rate, rate_95, force, force_95, stillest, nearly_still } = self;
        write!(
            out,
            "{strides:>3} | {:.2} ({:.2}-{:.2}) | {:4.1} ({:.1}-{:.1}) | {rate_95:4.1} | {:3.0} ({:.0}-{:.0}) | \
             {force_95:3.0} | {:.1e} ({:.0e}-{:.0e}) | {:.2}",
            stride.median,
            stride.low,
            stride.high,
            rate.median,
            rate.low,
            rate.high,
            force.median,
            force.low,
            force.high,
            stillest.median,
            stillest.low,
            stillest.high,
            nearly_still.median,
        )
    }
}

impl Peaks {
    /// The names of the columns that [`Peaks`] is written in.
    pub const COLUMNS: &str = "strides | stride s | peak rate rad/s | 95 % | peak force m/s² | 95 % | \
                               stillest (SHOE) | below 3e5 s";
}
