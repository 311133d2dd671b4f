//! A path in time, compared with way-points.

use crate::alignment::{Rigid, distance, rigid_rmse};
use crate::phone::sample::WayPoint;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// A way-point nearer to the start than this shows no direction: those of the mall were marked to about a metre.
/// **Units:** m.
const FIRST_LEG_M: f64 = 8.0;

/// Where somebody was when, in order of time. **Units:** m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path(pub Vec<(Micros, [f64; 2])>);

impl Path {
    /// The steps put end to end; origin and heading are those of the first step.
    pub fn of(steps: &[Step]) -> Self {
        let (mut place, mut heading) = ([0.0; 2], 0.0_f64);
        let moved = |step: &Step| {
            let (sin, cos) = heading.sin_cos();
            let [x, y] = [step.displacement.x, step.displacement.y].map(f64::from);
            place = [place[0] + cos * x - sin * y, place[1] + sin * x + cos * y];
            heading += f64::from(step.turn);
            (step.stance_end, place)
        };
        let start = steps.first().map(|step| (Micros(step.stance_end.0 - 1), [0.0; 2]));
        Self(start.into_iter().chain(steps.iter().map(moved)).collect())
    }

    /// Where it was at a moment: on the straight way between two points, at the ends outside of them.
    pub fn at(&self, time: Micros) -> Option<[f64; 2]> {
        let after = self.0.partition_point(|point| point.0 < time);
        let Some(&(late, to)) = self.0.get(after) else { return self.0.last().map(|point| point.1) };
        let Some(&(early, from)) = after.checked_sub(1).and_then(|before| self.0.get(before)) else { return Some(to) };
        let part = (time - early) as f64 / (late - early) as f64;
        Some([0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis])))
    }

    /// It was here at this time, which is not before the last; a later word on the same time replaces the first.
    pub fn note(&mut self, time: Micros, place: [f64; 2]) {
        match self.0.last_mut() {
            Some(last) if last.0 >= time => last.1 = place,
            _ => self.0.push((time, place)),
        }
    }

    /// Where it was at all way-points; nothing without a path.
    fn at_all(&self, points: &[WayPoint]) -> Vec<[f64; 2]> {
        points.iter().filter_map(|point| self.at(point.time)).collect()
    }

    /// Distances to the way-points. **Units:** m.
    pub fn errors(&self, points: &[WayPoint]) -> Vec<f64> {
        self.at_all(points).iter().zip(points).map(|(&at, point)| distance(at, point.place)).collect()
    }

    /// Root mean square distance to the way-points. **Units:** m.
    pub fn rmse(&self, points: &[WayPoint]) -> Option<f64> {
        rms(&self.errors(points))
    }

    /// The same after the turn and the shift that fit best. **Units:** m.
    pub fn fitted_rmse(&self, points: &[WayPoint]) -> Option<f64> {
        rigid_rmse(&self.at_all(points), &places(points))
    }

    /// The path laid on its start and along the first leg, and the heading that its beginning has then. **Units:** rad.
    pub fn on_first_leg(&self, points: &[WayPoint]) -> Option<(Self, f64)> {
        let first = points.first()?;
        let far = points.iter().position(|point| distance(point.place, first.place) >= FIRST_LEG_M)?;
        let ends = [*first, points[far]];
        let rigid = Rigid::fit_from_start(&self.at_all(&ends), &places(&ends));
        let [origin, ahead] = [rigid.apply([0.0; 2]), rigid.apply([1.0, 0.0])];
        let heading = (ahead[1] - origin[1]).atan2(ahead[0] - origin[0]);
        Some((Self(self.0.iter().map(|&(time, place)| (time, rigid.apply(place))).collect()), heading))
    }
}

fn places(points: &[WayPoint]) -> Vec<[f64; 2]> {
    points.iter().map(|point| point.place).collect()
}

/// Root mean square; nothing of nothing.
pub fn rms(values: &[f64]) -> Option<f64> {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    (!values.is_empty()).then(|| (sum / values.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn points(places: &[(i64, [f64; 2])]) -> Vec<WayPoint> {
        places.iter().map(|&(time, place)| WayPoint { time: Micros(time), place }).collect()
    }

    #[test]
    fn a_path_is_read_between_its_points_and_stays_at_its_ends() {
        let path = Path(vec![(Micros(10), [0.0, 0.0]), (Micros(20), [1.0, -2.0])]);
        let at = |time| path.at(Micros(time)).unwrap();
        assert_eq!([at(0), at(15), at(20), at(99)], [[0.0, 0.0], [0.5, -1.0], [1.0, -2.0], [1.0, -2.0]]);
        assert_eq!(Path::default().at(Micros(1)), None);
        assert_eq!(path.rmse(&points(&[(10, [3.0, 0.0]), (20, [1.0, 2.0])])), Some(12.5_f64.sqrt()));
        assert_eq!(path.rmse(&[]), None);
    }

    #[test]
    fn the_first_leg_gives_start_and_heading_and_nothing_else() {
        let path = Path(vec![(Micros(0), [0.0, 0.0]), (Micros(10), [9.0, 0.0]), (Micros(20), [9.0, 6.0])]);
        // Northwards from (7, 7), the first leg a metre longer than the path knows; then to the left.
        let truth = points(&[(0, [7.0, 7.0]), (1, [8.0, 7.0]), (10, [7.0, 17.0]), (20, [1.0, 17.0])]);
        let (laid, heading) = path.on_first_leg(&truth).unwrap();
        assert!((heading - PI / 2.0).abs() < 1e-12);
        let errors = laid.errors(&truth);
        assert!(errors[0] < 1e-12 && (errors[2] - 1.0).abs() < 1e-12 && (errors[3] - 1.0).abs() < 1e-12, "{errors:?}");
        assert!(path.on_first_leg(&truth[..2]).is_none());
    }
}
