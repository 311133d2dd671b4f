//! Laying an estimated track over its truth: turn and shift in the plane, never scale, never mirror.
//!
//! A dead-reckoned track has its own origin and heading; these three numbers must be taken out before it can be compared
//! with surveyed positions. Its scale and its handedness are the tracker's own doing and stay in the error. Where tracks are
//! compared by their shape alone [`Helmert`] takes out the scale, too.

/// A turn about the vertical and a shift. **Units:** 1, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    cos: f64,
    sin: f64,
    offset: [f64; 2],
}

impl Rigid {
    /// The turn and the shift that lay `from` over `to` with the least sum of squared distances.
    ///
    /// # Source
    /// Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32 (1976), in two
    /// dimensions, where the rotation has a closed form: the angle of the sum of `conj(from) * to` about the centroids.
    pub fn fit(from: &[[f64; 2]], to: &[[f64; 2]]) -> Self {
        Self::turn_about(from, to, centroid(from), centroid(to))
    }

    /// The shift that lays the first point of `from` on the first of `to`, and the turn about it that fits the rest best.
    pub fn fit_from_start(from: &[[f64; 2]], to: &[[f64; 2]]) -> Self {
        let start = |points: &[[f64; 2]]| points.first().copied().unwrap_or_default();
        Self::turn_about(from, to, start(from), start(to))
    }

    fn turn_about(from: &[[f64; 2]], to: &[[f64; 2]], pivot: [f64; 2], target: [f64; 2]) -> Self {
        let [dot, cross] = products(from, to, pivot, target);
        let norm = libm::hypot(dot, cross);
        let (cos, sin) = if norm > 0.0 { (dot / norm, cross / norm) } else { (1.0, 0.0) };
        let offset = [target[0] - cos * pivot[0] + sin * pivot[1], target[1] - sin * pivot[0] - cos * pivot[1]];
        Self { cos, sin, offset }
    }

    /// The turn, counter-clockwise. **Units:** rad, in (-pi, pi].
    pub fn angle(&self) -> f64 {
        libm::atan2(self.sin, self.cos)
    }

    /// Where `point` comes to lie. **Units:** m.
    pub fn apply(&self, point: [f64; 2]) -> [f64; 2] {
        [
            self.cos * point[0] - self.sin * point[1] + self.offset[0],
            self.sin * point[0] + self.cos * point[1] + self.offset[1],
        ]
    }
}

/// A turn, a scale and a shift: `X = a + c x - d y`, `Y = b + d x + c y`. **Units:** m and 1.
///
/// # Source
/// Graph, equations 6.12 and 6.13.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Helmert {
    /// Shift (`a` and `b`). **Units:** m.
    pub offset: [f64; 2],
    /// Scale times cosine and sine of the turn (`c` and `d`).
    pub turn: [f64; 2],
}

impl Helmert {
    /// What lays `from` over `to` with the least sum of squared distances (Graph, equations 6.14 to 6.16, whose normal
    /// equations have a closed form about the centroids). Points that all coincide are only shifted.
    pub fn fit(from: &[[f64; 2]], to: &[[f64; 2]]) -> Self {
        let (pivot, target) = (centroid(from), centroid(to));
        let [dot, cross] = products(from, to, pivot, target);
        let [spread, _] = products(from, from, pivot, pivot);
        let [c, d] = if spread > 0.0 { [dot / spread, cross / spread] } else { [1.0, 0.0] };
        let offset = [target[0] - c * pivot[0] + d * pivot[1], target[1] - d * pivot[0] - c * pivot[1]];
        Self { offset, turn: [c, d] }
    }

    /// Where a point comes to lie. **Units:** m.
    pub fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, d] = self.turn;
        [self.offset[0] + c * x - d * y, self.offset[1] + d * x + c * y]
    }

    /// Sum of the squared distances that remain (`v^T v`, Graph, equation 6.16). **Units:** m².
    pub fn residual(&self, from: &[[f64; 2]], to: &[[f64; 2]]) -> f64 {
        let squared = |(&p, &q): (&[f64; 2], &[f64; 2])| {
            let off = distance(self.apply(p), q);
            off * off
        };
        from.iter().zip(to).map(squared).sum()
    }
}

/// Sums of the scalar and the cross products of two lists of points about a place of each.
fn products(from: &[[f64; 2]], to: &[[f64; 2]], pivot: [f64; 2], target: [f64; 2]) -> [f64; 2] {
    let (mut dot, mut cross) = (0.0, 0.0);
    for (p, q) in from.iter().zip(to) {
        let (p, q) = ([p[0] - pivot[0], p[1] - pivot[1]], [q[0] - target[0], q[1] - target[1]]);
        dot += p[0] * q[0] + p[1] * q[1];
        cross += p[0] * q[1] - p[1] * q[0];
    }
    [dot, cross]
}

/// Horizontal distance of two points. **Units:** m.
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Length of the way over `points`. **Units:** m.
pub fn path_length(points: &[[f64; 2]]) -> f64 {
    points.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// Root mean square distance after the best turn and shift; `None` without points. **Units:** m.
pub fn rigid_rmse(estimated: &[[f64; 2]], truth: &[[f64; 2]]) -> Option<f64> {
    let count = estimated.len().min(truth.len());
    if count == 0 {
        return None;
    }
    let rigid = Rigid::fit(&estimated[..count], &truth[..count]);
    let sum: f64 = estimated
        .iter()
        .zip(truth)
        .map(|(&point, &target)| {
            let error = distance(rigid.apply(point), target);
            error * error
        })
        .sum();
    Some(libm::sqrt(sum / count as f64))
}

/// The part of the way on which the heading is aligned for [`end_error`]. **Units:** m.
pub const ALIGNED_START_M: f64 = 10.0;

/// Horizontal error at the end once origin and heading are aligned on the first [`ALIGNED_START_M`] of the true way;
/// `None` when the truth has fewer than two points or never leaves the start. **Units:** m.
pub fn end_error(estimated: &[[f64; 2]], truth: &[[f64; 2]]) -> Option<f64> {
    let (last_estimated, last_true) = (estimated.last()?, truth.last()?);
    if path_length(truth) <= 0.0 {
        return None;
    }
    let mut walked = 0.0;
    let mut count = 1;
    while count < truth.len() && walked < ALIGNED_START_M {
        walked += distance(truth[count - 1], truth[count]);
        count += 1;
    }
    let rigid = Rigid::fit_from_start(&estimated[..count], &truth[..count]);
    Some(distance(rigid.apply(*last_estimated), *last_true))
}

fn centroid(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len().max(1) as f64;
    let sum = points.iter().fold([0.0; 2], |sum, point| [sum[0] + point[0], sum[1] + point[1]]);
    [sum[0] / count, sum[1] / count]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_turned_and_shifted_copy_has_no_error() {
        let truth = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]];
        let turned = truth.map(|[x, y]| [5.0 - y, -3.0 + x]);
        assert!(rigid_rmse(&turned, &truth).unwrap() < 1e-12);
        assert!(end_error(&turned, &truth).unwrap() < 1e-12);
    }

    #[test]
    fn a_mirrored_copy_keeps_its_error() {
        let truth = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let mirrored = truth.map(|[x, y]| [x, -y]);
        assert!(rigid_rmse(&mirrored, &truth).unwrap() > 0.3);
    }

    #[test]
    fn a_scaled_copy_keeps_its_error() {
        // Centred points at -1, 0, 1 against -1.1, 0, 1.1: errors 0.1, 0, 0.1.
        let truth = [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]];
        let long = truth.map(|[x, y]| [1.1 * x, y]);
        assert!((rigid_rmse(&long, &truth).unwrap() - libm::sqrt(0.02 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn the_end_error_aligns_on_the_first_ten_metres_only() {
        // Straight for 20 m, estimated with a bend to the left of a right angle after 10 m.
        let truth: Vec<[f64; 2]> = (0..=20).map(|k| [f64::from(k), 0.0]).collect();
        let bent: Vec<[f64; 2]> =
            (0..=20).map(|k| if k <= 10 { [0.0, f64::from(k)] } else { [f64::from(10 - k), 10.0] }).collect();
        let error = end_error(&bent, &truth).unwrap();
        assert!((error - 200.0_f64.sqrt()).abs() < 1e-9, "{error}");
    }

    #[test]
    fn helmert_takes_out_turn_scale_and_shift() {
        let truth = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]];
        let moved = truth.map(|[x, y]| [5.0 - 1.5 * y, -3.0 + 1.5 * x]);
        let helmert = Helmert::fit(&truth, &moved);
        assert!((helmert.turn[0].abs() < 1e-12) && (helmert.turn[1] - 1.5).abs() < 1e-12, "{helmert:?}");
        assert!(helmert.residual(&truth, &moved) < 1e-12);
        let one = [[1.0, 1.0]; 3];
        assert_eq!(Helmert::fit(&one, &[[2.0, 4.0]; 3]).apply([1.0, 1.0]), [2.0, 4.0]);
    }

    #[test]
    fn nothing_to_compare_is_no_figure() {
        assert_eq!(rigid_rmse(&[], &[]), None);
        assert_eq!(end_error(&[[0.0; 2]], &[[1.0; 2]]), None);
    }

    fn points() -> impl Strategy<Value = Vec<([f64; 2], [f64; 2])>> {
        let coordinate = || -50.0..50.0_f64;
        let point = || [coordinate(), coordinate()];
        proptest::collection::vec((point(), point()), 3..40)
    }

    proptest! {
        /// Law: origin and heading of the estimate are arbitrary and must not count.
        #[test]
        fn the_error_does_not_depend_on_frame(
            pairs in points(), angle in -3.1..3.1_f64, shift in [-100.0..100.0_f64, -100.0..100.0],
        ) {
            let (estimated, truth): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
            let (sin, cos) = angle.sin_cos();
            let moved: Vec<[f64; 2]> = estimated
                .iter()
                .map(|p| [cos * p[0] - sin * p[1] + shift[0], sin * p[0] + cos * p[1] + shift[1]])
                .collect();
            // 1e-6 m: rounding of coordinates of 100 m, made worse by nearly undetermined turns.
            let (before, after) = (rigid_rmse(&estimated, &truth), rigid_rmse(&moved, &truth));
            prop_assert!((before.unwrap() - after.unwrap()).abs() < 1e-6);
        }

        /// Law: the solution of the normal equations is a minimum.
        #[test]
        fn no_other_helmert_transformation_is_better(pairs in points(), change in proptest::array::uniform4(-0.5..0.5_f64)) {
            let (from, to): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
            let best = Helmert::fit(&from, &to);
            let [a, b, c, d] = change;
            let other = Helmert {
                offset: [best.offset[0] + a, best.offset[1] + b],
                turn: [best.turn[0] + c, best.turn[1] + d],
            };
            prop_assert!(best.residual(&from, &to) <= other.residual(&from, &to) + 1e-9);
        }

        /// Law: the fit is a minimum; no nearby turn or shift is better.
        #[test]
        fn no_other_turn_or_shift_is_better(pairs in points(), turn in -0.2..0.2_f64, shift in [-1.0..1.0_f64, -1.0..1.0]) {
            let (estimated, truth): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
            let best = rigid_rmse(&estimated, &truth).unwrap();
            let rigid = Rigid::fit(&estimated, &truth);
            let (sin, cos) = turn.sin_cos();
            let sum: f64 = estimated.iter().zip(&truth).map(|(p, q)| {
                let p = rigid.apply(*p);
                let p = [cos * p[0] - sin * p[1] + shift[0], sin * p[0] + cos * p[1] + shift[1]];
                distance(p, *q).powi(2)
            }).sum();
            prop_assert!(best <= (sum / truth.len() as f64).sqrt() + 1e-9);
        }
    }
}
