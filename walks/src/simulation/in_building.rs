//! A route of the simulation from a way through a building.

use super::path::heading;
use super::route::{Leg, Route};
use crate::building::route::Piece;
use crate::building::{Building, Error};

/// Height of a riser that stairs are divided by. **Units:** m.
const RISER_M: f64 = 0.18;
/// Standing before an elevator sets off and after it has arrived. **Units:** s.
const DOORS_S: f64 = 2.5;

impl Route {
    /// The route of somebody who goes the way of `pieces`.
    ///
    /// # Errors
    /// When the way does not begin on foot.
    pub fn through(building: &Building, pieces: &[Piece]) -> Result<Self, Error> {
        let mut pieces = pieces.iter();
        let Some(Piece::Walk { floor, points }) = pieces.next() else {
            return Err(Error::Model("a way through a building begins on foot".to_owned()));
        };
        let height = building.floor(*floor).map_or(0.0, |floor| floor.height_m);
        let Some(&[x, y]) = points.first() else {
            return Err(Error::Model("a way through a building begins somewhere".to_owned()));
        };
        let mut route = Self { building: Some(building.name.clone()), start: [x, y, height], ..Self::default() };
        let mut legs = Vec::new();
        let walk = |legs: &mut Vec<Leg>, points: &[[f64; 2]]| {
            if points.len() > 1 {
                legs.push(Leg::with_gait(super::Gait::Walk, points[1..].to_vec()));
            }
        };
        walk(&mut legs, points);
        for piece in pieces {
            match piece {
                Piece::Walk { points, .. } => walk(&mut legs, points),
                Piece::Ride { rise, .. } => {
                    legs.extend([Leg::Stand { seconds: DOORS_S }, Leg::ride(*rise), Leg::Stand { seconds: DOORS_S }]);
                }
                Piece::Climb { points, .. } => {
                    for pair in points.windows(2) {
                        let ([ax, ay, az], [bx, by, bz]) = (pair[0], pair[1]);
                        let (from, to) = ([ax, ay], [bx, by]);
                        if az == bz {
                            walk(&mut legs, &[from, to]);
                            continue;
                        }
                        let risers = ((bz - az).abs() / RISER_M).round().max(1.0);
                        legs.push(Leg::Stairs {
                            // Not beyond a tower of 100 km.
                            steps: if bz > az { risers as i32 } else { -(risers as i32) },
                            riser: (bz - az).abs() / risers,
                            tread: (bx - ax).hypot(by - ay) / risers,
                            heading: Some(heading(from, to)),
                            pace: 1.0,
                        });
                    }
                }
            }
        }
        // Faces where the way leads at first.
        if let Some(Leg::Walk { to, .. }) = legs.first()
            && let Some(&first) = to.first()
        {
            route.heading = heading([x, y], first);
        }
        route.legs = legs;
        Ok(route)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{generate, route};
    use crate::simulation::{Scenario, SensorModel, Simulation};

    #[test]
    fn the_walk_ends_where_the_way_does_and_meets_no_wall() {
        let building = generate::twin(2);
        for by in ["stairs-W", "elevator"] {
            let pieces = route::plan(&building, &["W01", by, "E12", by, "W03"]).unwrap();
            let route = Route::through(&building, &pieces).unwrap();
            let scenario = Scenario { route, sensor: SensorModel::ideal(), ..Scenario::default() };
            let map = crate::particle::Map::of(&building).unwrap();
            let (mut last, mut highest, mut blocked) = (None::<[f64; 3]>, 0.0_f64, 0);
            for moment in Simulation::new(&scenario).unwrap().filter_map(|moment| moment.stance) {
                let here = moment.position;
                if let Some(before) = last {
                    let floor = usize::from(before[2] > 1.9);
                    let plane = |point: [f64; 3]| [point[0] as f32, point[1] as f32];
                    blocked += u32::from(map.blocked(floor, plane(before), plane(here)));
                }
                highest = highest.max(here[2]);
                last = Some(here);
            }
            let Some(Piece::Walk { points, .. }) = pieces.last() else { panic!("it ends on foot") };
            let (end, wanted) = (last.unwrap(), points[points.len() - 1]);
            assert!((end[0] - wanted[0]).hypot(end[1] - wanted[1]) < 0.35 && end[2] < 0.3, "{by}: {end:?} {wanted:?}");
            assert!(highest > 3.6);
            assert_eq!(blocked, 0, "{by}");
        }
    }
}
