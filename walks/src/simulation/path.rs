//! A way over the floor: straight lines through points, with the corners rounded as a person rounds them.

/// Half the length over which a corner is rounded. **Units:** m.
const ROUNDING_M: f64 = 0.6;

/// Points between which the rounding averages.
const AVERAGED: i32 = 8;

/// A way through points. **Units:** m; **Frame:** world.
#[derive(Clone, Debug)]
pub struct Path {
    points: Vec<[f64; 2]>,
    /// Way covered at each point.
    covered: Vec<f64>,
}

impl Path {
    /// The way through `points`; points that repeat their predecessor are left out.
    pub fn new(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let (mut kept, mut covered): (Vec<[f64; 2]>, Vec<f64>) = (Vec::new(), Vec::new());
        for point in points {
            match (kept.last(), covered.last()) {
                (Some(last), Some(so_far)) => {
                    let length = distance(*last, point);
                    if length > 1e-6 {
                        covered.push(so_far + length);
                        kept.push(point);
                    }
                }
                _ => {
                    covered.push(0.0);
                    kept.push(point);
                }
            }
        }
        Self { points: kept, covered }
    }

    /// Length along the straight lines. **Units:** m.
    pub fn length(&self) -> f64 {
        self.covered.last().copied().unwrap_or(0.0)
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The point on the straight lines after a way of `s`.
    fn sharp(&self, s: f64) -> [f64; 2] {
        let after = self.covered.partition_point(|&covered| covered < s).clamp(1, self.points.len().max(2) - 1);
        let (Some(&a), Some(&b)) = (self.points.get(after - 1), self.points.get(after)) else {
            return self.points.first().copied().unwrap_or_default();
        };
        let (from, to) = (self.covered[after - 1], self.covered[after]);
        let share = ((s - from) / (to - from)).clamp(0.0, 1.0);
        [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
    }

    /// Position and heading after a way of `s`. **Units:** m, rad; **Frame:** world.
    pub fn at(&self, s: f64) -> ([f64; 2], f64) {
        let s = s.clamp(0.0, self.length());
        let window = ROUNDING_M.min(s).min(self.length() - s);
        let mut mean = [0.0; 2];
        for i in -AVERAGED..=AVERAGED {
            let point = self.sharp(s + window * f64::from(i) / f64::from(AVERAGED));
            mean[0] += point[0];
            mean[1] += point[1];
        }
        let share = 1.0 / f64::from(2 * AVERAGED + 1);
        let (behind, ahead) = (self.sharp(s - ROUNDING_M), self.sharp(s + ROUNDING_M));
        ([mean[0] * share, mean[1] * share], heading(behind, ahead))
    }
}

/// Direction from `a` to `b`. **Units:** rad; **Frame:** world, counter-clockwise from x.
pub fn heading(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::atan2(b[1] - a[1], b[0] - a[0])
}

/// Distance from `a` to `b`.
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(b[0] - a[0], b[1] - a[1])
}

/// The angle that differs from `angle` by whole turns and lies in -pi..pi. **Units:** rad.
pub fn wrapped(angle: f64) -> f64 {
    libm::remainder(angle, 2.0 * std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_keeps_its_ends_and_rounds_its_corner() {
        let path = Path::new([[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [4.0, 3.0]]);
        assert_eq!(path.length(), 7.0);
        assert_eq!(path.at(0.0).0, [0.0, 0.0]);
        assert_eq!(path.at(7.0).0, [4.0, 3.0]);
        let (corner, heading) = path.at(4.0);
        assert!(corner[0] < 3.9 && corner[1] > 0.1, "{corner:?}");
        assert!((heading - std::f64::consts::FRAC_PI_4).abs() < 1e-9);
    }

    #[test]
    fn a_path_of_one_point_stays_there() {
        let path = Path::new([[1.0, 2.0]]);
        assert_eq!(path.length(), 0.0);
        assert_eq!(path.at(3.0).0, [1.0, 2.0]);
    }
}
