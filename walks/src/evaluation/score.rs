//! A track against its truth.

use super::matching::{Matching, TOLERANCE_US, stance_at};
use super::metrics::{Metric, Metrics};
use super::truth::{KnownStride, Reference, Surveyed, Truth};
use crate::alignment::{distance, end_error, path_length, rigid_rmse};
use crate::track::{Stance, Track};
use sohle_shared::time::Micros;

/// Judges `track` by everything its truth allows.
pub fn score(track: &Track, truth: &Truth) -> Metrics {
    let mut metrics = Metrics::default();
    let mut way = None;
    if let Some(reference) = &truth.track {
        way = against_reference(track, reference, &mut metrics);
    }
    if let Some(surveyed) = &truth.positions {
        way = against_survey(track, surveyed, &mut metrics);
    }
    if let Some(stances) = &truth.stances {
        found_stances(&Matching::of(&track.stances, stances, 0), &mut metrics);
    }
    if let Some(strides) = &truth.strides {
        stride_lengths(&track.stances, strides, &mut metrics);
    }
    if let Some(labels) = &truth.still {
        standing_time(&track.stances, labels, &mut metrics);
    }
    if let Some(counted) = truth.stride_count {
        metrics.count(Metric::StrideCountTrue, counted);
        metrics.count(Metric::StrideCountFound, track.strides());
        metrics.count(Metric::StrideCountError, counted.abs_diff(track.strides()));
    }
    metrics.set(Metric::TruthDistance, way);
    if let [first, .., last] = track.stances.as_slice() {
        let way = way.unwrap_or_else(|| track.distance());
        first_to_last(first, last, way, truth, &mut metrics);
    }
    metrics
}

/// The figures that ask only how the walk ends. A track without a stride has none: it would close every loop.
fn first_to_last(first: &Stance, last: &Stance, way: f64, truth: &Truth, metrics: &mut Metrics) {
    let [dx, dy, dz] = [0, 1, 2].map(|axis| last.position[axis] - first.position[axis]);
    if truth.closed_loop {
        metrics.set(Metric::ClosureHorizontal, libm::hypot(dx, dy));
        metrics.set(Metric::Closure3d, libm::hypot(libm::hypot(dx, dy), dz));
    }
    if truth.height_reported || truth.height_change.is_some() {
        metrics.set(Metric::HeightEnd, dz);
    }
    if let Some(height) = truth.height_change {
        let error = (dz - height).abs();
        metrics.set(Metric::HeightError, error);
        metrics.set(Metric::HeightPer50m, 50.0 * error / way);
    }
}

/// Surveyed stances; gives the length of the surveyed way.
fn against_survey(track: &Track, surveyed: &[Surveyed], metrics: &mut Metrics) -> Option<f64> {
    let instants: Vec<(Micros, Micros)> = surveyed.iter().map(|point| (point.time, point.time)).collect();
    let matching = Matching::of(&track.stances, &instants, TOLERANCE_US);
    found_stances(&matching, metrics);
    // A missed stance is judged by where the track has the foot at that moment.
    let estimated: Vec<[f64; 2]> = surveyed
        .iter()
        .zip(&matching.found)
        .map(|(point, found)| match found {
            Some(index) => horizontal(track.stances[*index].position),
            None => path_at(track, point.time),
        })
        .collect();
    let truth: Vec<[f64; 2]> = surveyed.iter().map(|point| point.position).collect();
    let times: Vec<Micros> = surveyed.iter().map(|point| point.time).collect();
    metrics.set(Metric::HeadingDrift, heading_drift(&times, &estimated, &truth));
    Some(positions(&estimated, &truth, metrics))
}

/// A continuous reference; gives the length of its way.
fn against_reference(track: &Track, reference: &Reference, metrics: &mut Metrics) -> Option<f64> {
    let offset = reference.clock_search.map(|search| clock_offset(track, reference, search));
    metrics.set(Metric::ClockOffset, offset.map(|offset| offset as f64 * 1e-6));
    let reference = reference.shifted(offset.unwrap_or(0));
    let from = track.stances.first().map(|stance| stance.start)?;
    let until = track.stances.last().map(|stance| stance.end)?;
    let judged = reference.points.iter().filter(|point| (from..=until).contains(&point.0));
    let (estimated, truth): (Vec<_>, Vec<_>) = judged.map(|&(time, position)| (path_at(track, time), position)).unzip();
    let way = positions(&estimated, &truth, metrics);
    let mut at_stances = (Vec::new(), Vec::new(), Vec::new());
    for stance in &track.stances {
        let middle = stance.start + (stance.end - stance.start) / 2;
        if let Some(position) = reference.at(middle) {
            at_stances.0.push(middle);
            at_stances.1.push(horizontal(stance.position));
            at_stances.2.push(position);
        }
    }
    metrics.set(Metric::HeadingDrift, heading_drift(&at_stances.0, &at_stances.1, &at_stances.2));
    Some(way)
}

/// The figures that compare positions; gives the length of the true way.
fn positions(estimated: &[[f64; 2]], truth: &[[f64; 2]], metrics: &mut Metrics) -> f64 {
    let way = path_length(truth);
    let end = end_error(estimated, truth);
    metrics.set(Metric::RigidRmse, rigid_rmse(estimated, truth));
    metrics.set(Metric::EndError, end);
    metrics.set(Metric::EndErrorPercent, end.map(|error| 100.0 * error / way));
    way
}

fn found_stances(matching: &Matching, metrics: &mut Metrics) {
    let count = matching.found.len();
    metrics.count(Metric::StancesTrue, count);
    metrics.count(Metric::StancesMissed, matching.missed());
    metrics.count(Metric::StancesInvented, matching.invented);
    metrics.set(Metric::StancesFoundPercent, 100.0 * (count - matching.missed()) as f64 / count as f64);
}

/// Strides of known length against the distance of the stances at their ends.
fn stride_lengths(stances: &[Stance], strides: &[KnownStride], metrics: &mut Metrics) {
    // Error and turn of each.
    let found: Vec<(f64, f64)> = strides
        .iter()
        .filter_map(|stride| {
            let from = stance_at(stances, stride.start, TOLERANCE_US)?;
            let to = stance_at(stances, stride.end, TOLERANCE_US)?;
            let length = distance(horizontal(from.position), horizontal(to.position));
            (from.start < to.start).then(|| (length - stride.length, (to.heading - from.heading).abs()))
        })
        .collect();
    let errors: Vec<f64> = found.iter().map(|stride| stride.0).collect();
    let straight: Vec<f64> = found.iter().filter(|stride| stride.1 < STRAIGHT_RAD).map(|stride| stride.0).collect();
    let rms = |errors: &[f64]| libm::sqrt(errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64);
    metrics.count(Metric::StrideLengthsTrue, strides.len());
    metrics.count(Metric::StrideLengthsMissed, strides.len() - errors.len());
    metrics.set(Metric::StrideLengthMeanError, errors.iter().sum::<f64>() / errors.len() as f64);
    metrics.set(Metric::StrideLengthRms, rms(&errors));
    metrics.set(Metric::StrideLengthStraightRms, rms(&straight));
}

/// A stride that turns the foot by less counts as straight: the sensor and a marker a hand's breadth away then go the same
/// way within some centimetres, whereas a half turn moves one by twice their distance more than the other. **Units:** rad.
const STRAIGHT_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Labels of standing and moving against the detected stances.
fn standing_time(stances: &[Stance], labels: &[(Micros, bool)], metrics: &mut Metrics) {
    let (mut still, mut missed, mut moving, mut invented) = (0_u32, 0_u32, 0_u32, 0_u32);
    for &(time, stands) in labels {
        let next = stances.partition_point(|stance| stance.end < time);
        let detected = stances.get(next).is_some_and(|stance| stance.start <= time);
        if stands {
            still += 1;
            missed += u32::from(!detected);
        } else {
            moving += 1;
            invented += u32::from(detected);
        }
    }
    metrics.set(Metric::StillMissedPercent, 100.0 * f64::from(missed) / f64::from(still));
    metrics.set(Metric::StillInventedPercent, 100.0 * f64::from(invented) / f64::from(moving));
}

/// Chords shorter than this say too little about a direction to count. **Units:** m.
const SHORTEST_CHORD_M: f64 = 0.3;

/// More chords than this are thinned: the slopes of all pairs are looked at.
const MOST_CHORDS: usize = 500;

/// Slope of the heading error: the median of the slopes between all pairs of chords, of the angle from each true chord to
/// its estimate over time. Surveys have wrong points, and in a curve the chords of two points of one foot differ; neither
/// moves the median. **Units:** degrees a minute; left is positive.
///
/// # Source
/// Sen, "Estimates of the regression coefficient based on Kendall's tau", J. Am. Stat. Assoc. 63 (1968).
fn heading_drift(times: &[Micros], estimated: &[[f64; 2]], truth: &[[f64; 2]]) -> Option<f64> {
    let mut errors: Vec<(f64, f64)> = Vec::new();
    for index in 1..times.len() {
        let chord = |points: &[[f64; 2]]| [0, 1].map(|axis| points[index][axis] - points[index - 1][axis]);
        let (from, to) = (chord(truth), chord(estimated));
        if libm::hypot(from[0], from[1]).min(libm::hypot(to[0], to[1])) < SHORTEST_CHORD_M {
            continue;
        }
        let mut angle = libm::atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]).to_degrees();
        // The error wanders slowly: the branch next to the one before is meant.
        if let Some((_, previous)) = errors.last() {
            angle += 360.0 * libm::round((previous - angle) / 360.0);
        }
        errors.push(((times[index] - times[0]) as f64 / 60e6, angle));
    }
    let errors: Vec<(f64, f64)> = errors.iter().step_by(errors.len().div_ceil(MOST_CHORDS).max(1)).copied().collect();
    let later = |index: usize| errors[index + 1..].iter().map(move |other| (index, other));
    let mut slopes: Vec<f64> = (0..errors.len())
        .flat_map(later)
        .filter(|&(index, other)| other.0 > errors[index].0)
        .map(|(index, other)| (other.1 - errors[index].1) / (other.0 - errors[index].0))
        .collect();
    slopes.sort_by(f64::total_cmp);
    slopes.get(slopes.len() / 2).copied()
}

/// Step of the search for a clock offset. **Units:** microseconds.
const CLOCK_STEP_US: i64 = 10_000;

/// The offset, within `search` seconds either way, at which the horizontal speeds of track and reference correlate best.
/// **Units:** microseconds to be added to the times of the reference.
fn clock_offset(track: &Track, reference: &Reference, search: f64) -> i64 {
    let speed = |at: &dyn Fn(Micros) -> Option<[f64; 2]>, time: Micros| {
        Some(distance(at(time + CLOCK_STEP_US)?, at(time + -CLOCK_STEP_US)?))
    };
    let Some((from, until)) = track.span else { return 0 };
    let estimated = |time: Micros| Some(path_at(track, time));
    let times: Vec<Micros> = (0..).map(|k| from + k * CLOCK_STEP_US).take_while(|&time| time <= until).collect();
    let speeds: Vec<f64> = times.iter().map(|&time| speed(&estimated, time).unwrap_or(0.0)).collect();
    let steps = (search * 1e6 / CLOCK_STEP_US as f64) as i64;
    let mut best = (f64::NEG_INFINITY, 0);
    for lag in -steps..=steps {
        let offset = lag * CLOCK_STEP_US;
        let pairs = times
            .iter()
            .zip(&speeds)
            .filter_map(|(&time, &estimated)| Some((estimated, speed(&|time| reference.at(time), time + -offset)?)));
        let correlation = correlation(pairs);
        if correlation > best.0 {
            best = (correlation, offset);
        }
    }
    best.1
}

/// Pearson's coefficient; 0 if one side does not vary.
fn correlation(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut n, mut x, mut y, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (a, b) in pairs {
        n += 1.0;
        x += a;
        y += b;
        xx += a * a;
        yy += b * b;
        xy += a * b;
    }
    let scale = libm::sqrt((n * xx - x * x) * (n * yy - y * y));
    if scale > 0.0 { (n * xy - x * y) / scale } else { 0.0 }
}

fn horizontal(position: [f64; 3]) -> [f64; 2] {
    [position[0], position[1]]
}

/// Where the track has the foot at `time`: between two points of the path in a straight line, before the first and after
/// the last at that point. **Units:** m.
fn path_at(track: &Track, time: Micros) -> [f64; 2] {
    let after = track.path.partition_point(|point| point.time < time);
    match (after.checked_sub(1).map(|before| track.path[before]), track.path.get(after)) {
        (Some(before), Some(next)) => {
            let part = (time - before.time) as f64 / (next.time - before.time).max(1) as f64;
            [0, 1].map(|axis| before.position[axis] + part * (next.position[axis] - before.position[axis]))
        }
        (Some(point), None) => horizontal(point.position),
        (None, Some(point)) => horizontal(point.position),
        (None, None) => [0.0; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::PathPoint;

    /// A walk along x, 1.4 m each second; stances of 0.4 s at the full seconds; the path keeps to them.
    fn walk(strides: u32) -> Track {
        let mut track = Track::default();
        for k in 0..=strides {
            let start = Micros(i64::from(k) * 1_000_000);
            let position = [1.4 * f64::from(k), 0.0, 0.01 * f64::from(k)];
            track.stances.push(Stance { start, end: start + 400_000, position, heading: 0.0 });
            track.path.push(PathPoint { time: start, position });
            track.path.push(PathPoint { time: start + 400_000, position });
        }
        track.span = Some((Micros(0), Micros(i64::from(strides) * 1_000_000 + 400_000)));
        track
    }

    fn surveyed(track: &Track) -> Vec<Surveyed> {
        let survey =
            |stance: &Stance| Surveyed { time: stance.end, position: [-stance.position[1], stance.position[0]] };
        track.stances.iter().map(survey).collect()
    }

    fn get(metrics: &Metrics, metric: Metric) -> f64 {
        metrics.get(metric).unwrap_or_else(|| panic!("no {}", metric.name()))
    }

    #[test]
    fn a_perfect_track_in_another_frame_has_no_error() {
        let track = walk(20);
        let truth = Truth { positions: Some(surveyed(&track)), ..Truth::default() };
        let metrics = score(&track, &truth);
        for metric in [Metric::RigidRmse, Metric::EndError, Metric::HeadingDrift] {
            assert!(get(&metrics, metric).abs() < 1e-9, "{}", metric.name());
        }
        assert_eq!((get(&metrics, Metric::StancesTrue), get(&metrics, Metric::StancesMissed)), (21.0, 0.0));
        assert!((get(&metrics, Metric::TruthDistance) - 28.0).abs() < 1e-9);
        assert_eq!(metrics.get(Metric::ClosureHorizontal), None);
        assert_eq!(metrics.get(Metric::HeightEnd), None);
    }

    #[test]
    fn a_missed_stance_is_told_and_judged_by_the_path() {
        let mut track = walk(20);
        let truth = Truth { positions: Some(surveyed(&track)), ..Truth::default() };
        track.stances.remove(7);
        let metrics = score(&track, &truth);
        assert_eq!((get(&metrics, Metric::StancesMissed), get(&metrics, Metric::StancesInvented)), (1.0, 0.0));
        assert!(get(&metrics, Metric::RigidRmse) < 1e-9);
    }

    #[test]
    fn a_steady_turn_shows_as_drift() {
        // The heading error grows by 12 degrees a minute: 0.2 degrees from one stride to the next.
        let mut track = walk(60);
        let truth = Truth { positions: Some(surveyed(&track)), ..Truth::default() };
        let mut at = [0.0_f64; 2];
        for (k, stance) in track.stances.iter_mut().enumerate() {
            if k > 0 {
                let (sin, cos) = (0.2 * k as f64).to_radians().sin_cos();
                at = [at[0] + 1.4 * cos, at[1] + 1.4 * sin];
            }
            (stance.position[0], stance.position[1]) = (at[0], at[1]);
        }
        let drift = get(&score(&track, &truth), Metric::HeadingDrift);
        assert!((drift - 12.0).abs() < 1e-6, "{drift}");
    }

    #[test]
    fn height_and_closure_by_hand() {
        let track = walk(20);
        let truth = Truth { closed_loop: true, height_change: Some(0.1), ..Truth::default() };
        let metrics = score(&track, &truth);
        assert!((get(&metrics, Metric::HeightEnd) - 0.2).abs() < 1e-12);
        assert!((get(&metrics, Metric::HeightError) - 0.1).abs() < 1e-12);
        assert!((get(&metrics, Metric::ClosureHorizontal) - 28.0).abs() < 1e-12);
        assert!((get(&metrics, Metric::Closure3d) - 28.0_f64.hypot(0.2)).abs() < 1e-12);
        // The track has no steps, so that its own length is 0 and no figure for each 50 m can be given.
        assert_eq!(metrics.get(Metric::HeightPer50m), None);
    }

    #[test]
    fn strides_are_compared_where_both_ends_stand() {
        let track = walk(3);
        let stride = |start: f64, end: f64, length| KnownStride {
            start: Micros::from_seconds(start),
            end: Micros::from_seconds(end),
            length,
        };
        // Errors 0.1 and -0.1 m; the third begins where nothing stands.
        let strides = vec![stride(0.2, 1.2, 1.3), stride(1.2, 2.2, 1.5), stride(2.7, 3.2, 1.4)];
        let metrics = score(&track, &Truth { strides: Some(strides), ..Truth::default() });
        assert!((get(&metrics, Metric::StrideLengthRms) - 0.1).abs() < 1e-9);
        assert!((get(&metrics, Metric::StrideLengthStraightRms) - 0.1).abs() < 1e-9);
        assert!(get(&metrics, Metric::StrideLengthMeanError).abs() < 1e-9);
        assert_eq!((get(&metrics, Metric::StrideLengthsTrue), get(&metrics, Metric::StrideLengthsMissed)), (3.0, 1.0));
    }

    #[test]
    fn labels_are_compared_in_time() {
        let track = walk(1);
        let labels = (0..14).map(|k| (Micros(k * 100_000), !(3..9).contains(&k))).collect();
        let metrics = score(&track, &Truth { still: Some(labels), ..Truth::default() });
        // Standing from 0 to 0.2 s and from 0.9 to 1.3 s; stances from 0 to 0.4 and from 1.0 to 1.4 s.
        assert!((get(&metrics, Metric::StillMissedPercent) - 100.0 / 8.0).abs() < 1e-9);
        assert!((get(&metrics, Metric::StillInventedPercent) - 200.0 / 6.0).abs() < 1e-9);
    }

    #[test]
    fn the_clock_of_a_reference_is_found() {
        let track = walk(20);
        let points = (0..2000)
            .map(|k| {
                let time = Micros(k * 10_000);
                (time + 370_000, path_at(&track, time))
            })
            .collect();
        let reference = Reference { points, clock_search: Some(0.45) };
        let metrics = score(&track, &Truth { track: Some(reference), ..Truth::default() });
        assert!((get(&metrics, Metric::ClockOffset) + 0.37).abs() < 1e-9);
        assert!(get(&metrics, Metric::RigidRmse) < 1e-6);
    }

    #[test]
    fn a_track_without_a_step_is_judged_too() {
        let track = Track::default();
        let positions = surveyed(&walk(10));
        let reference =
            Reference { points: vec![(Micros(0), [0.0; 2]), (Micros(9), [1.0; 2])], clock_search: Some(1.0) };
        let truth = Truth {
            positions: Some(positions),
            track: Some(reference),
            closed_loop: true,
            stride_count: Some(10),
            height_change: Some(0.0),
            ..Truth::default()
        };
        let metrics = score(&track, &truth);
        assert_eq!(get(&metrics, Metric::StancesMissed), 11.0);
        assert_eq!(get(&metrics, Metric::StrideCountError), 10.0);
        for metric in [Metric::ClosureHorizontal, Metric::HeightEnd, Metric::HeightPer50m, Metric::HeadingDrift] {
            assert_eq!(metrics.get(metric), None, "{} of a walk that was not seen", metric.name());
        }
        // Standing still all the time is wrong by the spread of the survey: 1.4 m times the root of 10.
        assert!((get(&metrics, Metric::RigidRmse) - 1.4 * 10.0_f64.sqrt()).abs() < 1e-9);
    }
}
