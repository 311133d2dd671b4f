//! What of a building can be reached with the next stride: stairs, ramps and elevators near the particles.

use super::modes::Shares;
use crate::building::geometry::{self, Outline, Point};
use crate::building::{Building, ConnectorKind};
use crate::particle::Particle;
use rayon::prelude::*;

/// From one stance of a foot to its next, and what the cloud does not know: nobody's first tread is further away than
/// this. **Units:** m.
const STRIDE_M: f64 = 2.0;

/// Particles that a thread takes at a time.
const BLOCK: usize = 4_096;

/// Outline of a connector on a floor and its surroundings.
#[derive(Clone, Debug)]
struct Area {
    elevator: bool,
    outline: Outline,
    low: Point,
    high: Point,
}

/// The connectors of each floor of a building.
#[derive(Clone, Debug)]
pub(super) struct Reach(Vec<Vec<Area>>);

impl Reach {
    pub fn of(building: &Building) -> Self {
        let on = |number: i32| {
            let here = building.connectors.iter().flat_map(move |connector| {
                let elevator = connector.kind == ConnectorKind::Elevator;
                let outlines = connector.outlines.iter().filter(move |(floor, _)| *floor == number);
                outlines.filter_map(move |(_, outline)| {
                    let [low, high] = geometry::bounds(outline.iter().copied())?;
                    let (low, high) = (low.map(|value| value - STRIDE_M), high.map(|value| value + STRIDE_M));
                    Some(Area { elevator, outline: outline.clone(), low, high })
                })
            });
            here.collect()
        };
        Self(building.floors.iter().map(|floor| on(floor.number)).collect())
    }

    /// Where the weight of the particles is.
    pub fn shares(&self, particles: &[Particle]) -> Shares {
        let block = |particles: &[Particle]| {
            let (mut total, mut shares) = (0.0, Shares::default());
            for particle in particles {
                let weight = f64::from(particle.weight);
                total += weight;
                let Some(areas) = self.0.get(usize::from(particle.floor)) else { continue };
                let point = [particle.x, particle.y].map(f64::from);
                let inside = areas.iter().find(|area| area.holds(point));
                // On stairs the height is free, and the floor of the particle may have changed before its place does.
                match inside {
                    Some(area) if area.elevator => shares.elevator += weight,
                    Some(_) => shares.stairs += weight,
                    None => {}
                }
                let near =
                    inside.is_some() || particle.is_in_connector() || areas.iter().any(|area| area.is_near(point));
                shares.near += if near { weight } else { 0.0 };
            }
            (total, shares)
        };
        // Collected in order and added in order: the sums do not depend on who was first.
        let blocks: Vec<(f64, Shares)> = particles.par_chunks(BLOCK).map(block).collect();
        let (mut total, mut shares) = (0.0, Shares::default());
        for (weight, Shares { stairs, elevator, near }) in blocks {
            total += weight;
            shares.stairs += stairs;
            shares.elevator += elevator;
            shares.near += near;
        }
        if total > 0.0 {
            let Shares { stairs, elevator, near } = shares;
            Shares { stairs: stairs / total, elevator: elevator / total, near: near / total }
        } else {
            Shares { near: 1.0, ..Shares::default() }
        }
    }
}

impl Area {
    fn is_around(&self, point: Point) -> bool {
        (0..2).all(|axis| (self.low[axis]..=self.high[axis]).contains(&point[axis]))
    }

    fn holds(&self, point: Point) -> bool {
        self.is_around(point) && geometry::contains(&self.outline, point)
    }

    fn is_near(&self, point: Point) -> bool {
        self.is_around(point)
            && geometry::sides(&self.outline)
                .any(|side| geometry::distance(geometry::nearest(&side, point), point) <= STRIDE_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;

    #[test]
    fn shares_are_those_of_the_weight_and_a_stride_counts_as_near() {
        let building = generate::twin(2);
        let reach = Reach::of(&building);
        let stairs = building.connectors.iter().find(|connector| connector.name == "stairs-E").unwrap();
        let middle = geometry::centre(&stairs.outlines[0].1);
        let [low, _] = geometry::bounds(stairs.outlines[0].1.iter().copied()).unwrap();
        let at = |[x, y]: Point, weight: f32| Particle {
            x: x as f32,
            y: y as f32,
            weight,
            connector: Particle::ON_FLOOR,
            ..Particle::default()
        };
        let cloud = [at(middle, 3.0), at([middle[0], low[1] - 1.9], 2.0), at([middle[0], low[1] - 2.1], 5.0)];
        let shares = reach.shares(&cloud);
        assert!((shares.stairs - 0.3).abs() < 1e-9 && shares.elevator == 0.0, "{shares:?}");
        assert!((shares.near - 0.5).abs() < 1e-9, "{shares:?}");
        assert_eq!(reach.shares(&[]).near, 1.0, "nobody is nowhere that is known");
    }
}
