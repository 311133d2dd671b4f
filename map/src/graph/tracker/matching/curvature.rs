//! How a track bends, and how alike two tracks bend: independent of the directions, which drift.

use crate::building::geometry::{self, Point};

/// Curvature of a track at each of its points but the last: the derivative of the direction by the arc length, from a cubic
/// spline through the directions. **Units:** rad/m.
///
/// # Source
/// Graph, equation 6.11 and figures 6.38 and 6.39, after Czommer.
pub fn curvature(points: &[Point]) -> Vec<f64> {
    let mut directions: Vec<f64> = Vec::with_capacity(points.len());
    let (mut arc, mut at) = (0.0, Vec::with_capacity(points.len()));
    for pair in points.windows(2) {
        let direction = geometry::direction(pair[0], pair[1]);
        // Over the cut at half a turn the directions go on.
        let before = directions.last().copied().unwrap_or(direction);
        directions.push(before + geometry::wrapped(direction - before));
        at.push(arc);
        arc += geometry::distance(pair[0], pair[1]);
    }
    slopes(&at, &directions)
}

/// First derivatives at the knots of the natural cubic spline through `(x, y)`; the knots increase.
///
/// # Source
/// The tridiagonal equations that make the second derivative continuous and zero at both ends, solved by elimination
/// (de Boor, A Practical Guide to Splines, chapter IV).
pub(super) fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let count = x.len().min(y.len());
    if count < 2 {
        return vec![0.0; count];
    }
    let width = |k: usize| x[k + 1] - x[k];
    let chord = |k: usize| (y[k + 1] - y[k]) / width(k);
    let last = count - 1;
    // Above the diagonal and on the right, after elimination of what is below.
    let (mut above, mut right) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for k in 0..count {
        let before = if k > 0 { 1.0 / width(k - 1) } else { 0.0 };
        let after = if k < last { 1.0 / width(k) } else { 0.0 };
        let mut sum = 0.0;
        if k > 0 {
            sum += 3.0 * chord(k - 1) * before;
        }
        if k < last {
            sum += 3.0 * chord(k) * after;
        }
        let (above_before, right_before) = if k > 0 { (above[k - 1], right[k - 1]) } else { (0.0, 0.0) };
        let pivot = 2.0 * (before + after) - before * above_before;
        above.push(after / pivot);
        right.push((sum - before * right_before) / pivot);
    }
    for k in (0..last).rev() {
        right[k] -= above[k] * right[k + 1];
    }
    right
}

/// The greatest of the cross-correlations of two lists, and by how many places the second is shifted for it: positive when
/// its values come later. The sum is not normalised, and what is shifted beyond an end is left out. Shifts are tried up to
/// `most`, the smaller of two equally good ones counts.
///
/// # Source
/// Graph, equation 5.5 and figure 6.40.
pub fn correlation(first: &[f64], second: &[f64], most: usize) -> (f64, i64) {
    let most = i64::try_from(most).unwrap_or(i64::MAX).min(first.len() as i64);
    let at = |shift: i64| -> f64 {
        let skip = shift.unsigned_abs() as usize;
        let (first_from, second_from) = if shift < 0 { (skip, 0) } else { (0, skip) };
        first.iter().skip(first_from).zip(second.iter().skip(second_from)).map(|(a, b)| a * b).sum()
    };
    let mut best = (at(0), 0);
    for shift in (1..=most).flat_map(|size| [size, -size]) {
        let value = at(shift);
        if value > best.0 {
            best = (value, shift);
        }
    }
    best
}
