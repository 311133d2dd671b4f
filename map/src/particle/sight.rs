//! How likely what somebody else says of the place makes each particle.

use super::ancestry::Spot;
use super::cloud::{BLOCK, Particle};
use super::motion::Moved;
use crate::sight::{Seen, Sight};
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

impl Sight {
    /// Weighs the particles by where they are, or by where they were if `spots` tells of each. `floor` is the index of the floor
    /// that the source names.
    pub(super) fn weigh(&self, particles: &mut [Particle], spots: Option<&[Spot]>, floor: Option<usize>) -> Moved {
        let outlier = self.odds();
        let inverse = match self.seen {
            Seen::Place(_, covariance) => covariance.try_inverse().unwrap_or_else(Matrix2::zeros),
            Seen::Range { sigma_m, .. } => Matrix2::identity() * (sigma_m * sigma_m).max(1e-6).recip(),
        };
        let squared = |[x, y]: [f32; 2]| {
            let at = Vector2::new(f64::from(x), f64::from(y));
            match self.seen {
                Seen::Place(place, _) => {
                    let off = at - Vector2::from(place);
                    off.dot(&(inverse * off))
                }
                Seen::Range { anchor, above_m, metres, .. } => {
                    let off = (at - Vector2::from(anchor)).norm().hypot(above_m) - metres;
                    off * off * inverse[(0, 0)]
                }
            }
        };
        let weigh = |(number, block): (usize, &mut [Particle])| {
            let mut moved = Moved::default();
            for (index, particle) in block.iter_mut().enumerate() {
                moved.before += f64::from(particle.weight);
                let spot = spots.and_then(|spots| spots.get(number * BLOCK + index));
                let (place, floors) =
                    spot.map_or(([particle.x, particle.y], [particle.floor; 2]), |spot| (spot.place, spot.floors));
                // Between two floors nobody is on the wrong one.
                let on = |floor: usize| particle.is_in_connector() || floors.map(usize::from).contains(&floor);
                let fits = if floor.is_none_or(on) { (-0.5 * squared(place)).exp() } else { 0.0 };
                particle.weight *= ((fits + outlier) / (1.0 + outlier)) as f32;
                let weight = f64::from(particle.weight);
                moved.after += weight;
                moved.squares += weight * weight;
                moved.alive += usize::from(particle.weight > 0.0);
            }
            moved
        };
        // Added in order: the sum does not depend on who was first.
        let parts: Vec<Moved> = particles.par_chunks_mut(BLOCK).enumerate().map(weigh).collect();
        parts.into_iter().fold(Moved::default(), Moved::with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> Vec<Particle> {
        let at = |x: f32| Particle { x, y: 5.0, weight: 1.0, connector: Particle::ON_FLOOR, ..Particle::default() };
        [5.0, 6.0, 15.0].map(at).to_vec()
    }

    #[test]
    fn a_place_weighs_by_its_covariance_and_an_outlier_costs_no_more_than_it_may() {
        let mut particles = cloud();
        let seen = Seen::Place([5.0, 5.0], Matrix2::new(4.0, 0.0, 0.0, 1.0));
        let moved = Sight { seen, floor: None, outlier: 0.01 }.weigh(&mut particles, None, None);
        let expected = [1.0, ((-0.125_f32).exp() + 0.01) / 1.01, ((-12.5_f32).exp() + 0.01) / 1.01];
        for (particle, expected) in particles.iter().zip(expected) {
            assert!((particle.weight - expected).abs() < 1e-6, "{particle:?} {expected}");
        }
        assert!(moved.before == 3.0 && (moved.after - f64::from(expected.iter().sum::<f32>())).abs() < 1e-6);
    }

    #[test]
    fn a_floor_and_a_range_weigh_too() {
        let mut particles = cloud();
        particles[1].floor = 1;
        let seen = Seen::Range { anchor: [9.0, 5.0], above_m: 3.0, metres: 5.0, sigma_m: 0.2 };
        Sight { seen, floor: Some(0), outlier: 1e-3 }.weigh(&mut particles, None, Some(0));
        assert!((particles[0].weight - 1.0).abs() < 1e-6, "{particles:?}");
        assert!(particles[1].weight < 2e-3 && particles[2].weight < 2e-3, "{particles:?}");
    }
}
