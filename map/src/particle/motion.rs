//! One step of every particle: move, walls, height, weight (Foot, 5.4).

use super::cloud::{BLOCK, Particle};
use super::map::Map;
use super::parameters::{Method, Parameters};
use super::random::{Purpose, Stream};
use nalgebra::{Matrix4, Vector4};
use rayon::prelude::*;
use sohle_shared::step::Step;
use std::f32::consts::{PI, TAU};

/// Heights beyond the lowest and highest floor of a connector that a particle may have in it. **Units:** m.
const BEYOND_M: f32 = 0.8;

/// What a move has done to the cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moved {
    /// Sum of the weights before.
    pub before: f64,
    /// Sum of the weights after.
    pub after: f64,
    /// Sum of their squares.
    pub squares: f64,
    /// Particles that have any weight left.
    pub alive: usize,
}

impl Moved {
    /// Together with another part of the cloud.
    pub fn with(self, other: Self) -> Self {
        Self {
            before: self.before + other.before,
            after: self.after + other.after,
            squares: self.squares + other.squares,
            alive: self.alive + other.alive,
        }
    }

    /// Mean likelihood of the step over the cloud.
    pub fn likelihood(&self) -> f64 {
        if self.before > 0.0 { self.after / self.before } else { 0.0 }
    }

    /// Effective number of particles (Kong, Liu and Wong 1994).
    pub fn effective(&self) -> f64 {
        if self.squares > 0.0 { self.after * self.after / self.squares } else { 0.0 }
    }
}

/// Moves all particles by a step and weighs them.
pub(super) fn advance(
    particles: &mut [Particle],
    map: &Map,
    step: &Step,
    parameters: &Parameters,
    seed: u64,
    number: u64,
) -> Moved {
    let block = |(index, block): (usize, &mut [Particle])| {
        let mut stream = Stream::new(seed, Purpose::Move, number, index);
        let before = block.iter().map(|particle| f64::from(particle.weight)).sum();
        match parameters.method {
            Method::Documented => Documented::new(step, parameters).advance(block, map, &mut stream),
            Method::Covariance => Covariance::new(step, parameters).advance(block, map, &mut stream),
        }
        let mut moved = Moved { before, ..Moved::default() };
        for particle in block.iter() {
            let weight = f64::from(particle.weight);
            moved.after += weight;
            moved.squares += weight * weight;
            moved.alive += usize::from(particle.weight > 0.0);
        }
        moved
    };
    // Collected in order and added in order: the sum does not depend on who was first.
    let parts: Vec<Moved> = particles.par_chunks_mut(BLOCK).enumerate().map(block).collect();
    parts.into_iter().fold(Moved::default(), Moved::with)
}

/// In [-pi, pi).
fn wrapped(angle: f32) -> f32 {
    if (-PI..PI).contains(&angle) { angle } else { (angle + PI).rem_euclid(TAU) - PI }
}

/// The move of the document.
struct Documented {
    /// x, y, z, turn.
    change: [f32; 4],
    /// Standard deviations (5.14 - 5.17).
    sigmas: [f32; 4],
    phi_z: f32,
}

impl Documented {
    fn new(step: &Step, parameters: &Parameters) -> Self {
        let [x, y, z] = step.displacement.into();
        let change = [x, y, z, step.turn];
        let [plane, height, turn] = parameters.phi;
        let [plane_0, height_0, turn_0] = parameters.psi;
        let (phi, psi) = ([plane, plane, height, turn], [plane_0, plane_0, height_0, turn_0]);
        let sigmas =
            std::array::from_fn(|i| ((1.0 - (-0.5 * change[i].abs()).exp()) * phi[i] + psi[i]).max(0.0).sqrt());
        Self { change, sigmas, phi_z: parameters.phi_z_m }
    }

    fn advance(&self, block: &mut [Particle], map: &Map, stream: &mut Stream) {
        for particle in block {
            let [dx, dy, dz, turn] = std::array::from_fn(|i| self.change[i] + self.sigmas[i] * stream.bell());
            let (sin, cos) = particle.heading.sin_cos();
            let from = [particle.x, particle.y];
            let to = [particle.x + cos * dx - sin * dy, particle.y + sin * dx + cos * dy];
            let floor = &map.floors[usize::from(particle.floor)];
            [particle.x, particle.y] = to;
            particle.heading = wrapped(particle.heading + turn);
            if floor.grid.blocked(from, to) {
                particle.weight = 0.0;
                continue;
            }
            let before = particle.z;
            particle.z += dz;
            let cell = floor.grid.cell(to);
            match cell.and_then(|cell| floor.connectors.at(cell, to)) {
                Some(connector) => {
                    particle.connector = connector;
                    let joint = &map.connectors[usize::from(connector)];
                    particle.floor = joint.floor_at(particle.z, particle.floor);
                    // A floor that is not modelled counts as a wall (Foot, 7.7).
                    if !within(&joint.floors, particle.z, 1.8) {
                        particle.weight = 0.0;
                    }
                }
                None => {
                    particle.connector = Particle::ON_FLOOR;
                    particle.z = floor.height;
                }
            }
            // (5.21 - 5.23)
            let difference = (self.change[2] - (particle.z - before)) / self.phi_z;
            particle.weight *= (-0.5 * difference * difference).exp();
        }
    }
}

/// Whether a height is at most `beyond` outside of those of the floors.
fn within(floors: &[(u16, f32)], z: f32, beyond: f32) -> bool {
    match (floors.first(), floors.last()) {
        (Some(&(_, low)), Some(&(_, high))) => z > low - beyond && z < high + beyond,
        _ => false,
    }
}

/// The move of the default.
struct Covariance {
    /// x, y, z, turn.
    change: [f32; 4],
    /// Lower triangle, row by row: its product with four independent numbers has the covariance of the step.
    root: [[f32; 4]; 4],
    scale_noise: f32,
    leak: f32,
    /// 1 / sigma of what a height may be off: on the level, and where a connector is left.
    level: f32,
    exit: f32,
}

impl Covariance {
    fn new(step: &Step, parameters: &Parameters) -> Self {
        let [x, y, z] = step.displacement.into();
        let place = parameters.place_sigma_m * parameters.place_sigma_m;
        let turn = parameters.turn_sigma * parameters.turn_sigma;
        let extra = Matrix4::from_diagonal(&Vector4::new(place, place, 0.0, turn));
        let mut covariance = step.covariance;
        for i in 0..4 {
            covariance[(i, 3)] *= parameters.turn_share;
            covariance[(3, i)] *= parameters.turn_share;
        }
        let covariance = covariance + extra;
        // A covariance that is none (a step made by hand) leaves what its diagonal says.
        let root = covariance.cholesky().map_or_else(
            || Matrix4::from_diagonal(&covariance.diagonal().map(|value| value.max(0.0).sqrt())),
            |cholesky| cholesky.l(),
        );
        let root = std::array::from_fn(|row| std::array::from_fn(|column| root[(row, column)]));
        let height = step.covariance[(2, 2)].max(0.0);
        let level = (parameters.level_sigma_m * parameters.level_sigma_m + height).sqrt();
        Self {
            change: [x, y, z, step.turn],
            root,
            scale_noise: parameters.scale_noise,
            leak: parameters.leak,
            level: 1.0 / level,
            exit: 1.0 / parameters.exit_sigma_m,
        }
    }

    /// Numbers with the covariance of the step.
    fn correlated(&self, independent: [f32; 4]) -> [f32; 4] {
        let [a, b, c, d] = independent;
        let [[aa, ..], [ba, bb, ..], [ca, cb, cc, _], [da, db, dc, dd]] = self.root;
        [aa * a, ba * a + bb * b, ca * a + cb * b + cc * c, da * a + db * b + dc * c + dd * d]
    }

    fn advance(&self, block: &mut [Particle], map: &Map, stream: &mut Stream) {
        for particle in block {
            let independent: [f32; 4] = std::array::from_fn(|_| stream.bell());
            let noise = self.correlated(independent);
            particle.scale = (particle.scale + self.scale_noise * stream.bell()).clamp(0.5, 2.0);
            let dx = self.change[0] * particle.scale + noise[0];
            let dy = self.change[1] * particle.scale + noise[1];
            let dz = self.change[2] + noise[2];
            let (sin, cos) = particle.heading.sin_cos();
            let from = [particle.x, particle.y];
            let to = [particle.x + cos * dx - sin * dy, particle.y + sin * dx + cos * dy];
            particle.heading = wrapped(particle.heading + self.change[3] + noise[3]);
            let floor = &map.floors[usize::from(particle.floor)];
            if floor.grid.blocked(from, to) {
                // It may have been a gap in the plan; but nobody gets far through walls, not even off the plan.
                particle.weight *= self.leak;
                if floor.grid.cell(to).is_none() {
                    continue;
                }
            } else if !floor.inside.at(to) {
                // Nor is anybody outside: in the open nothing is in the way, and what got there would outlive the others.
                particle.weight *= self.leak;
            }
            [particle.x, particle.y] = to;
            let was_in = particle.is_in_connector();
            let connector = floor.grid.cell(to).and_then(|cell| floor.connectors.at(cell, to));
            let height_error = match connector {
                Some(connector) => {
                    particle.z += dz;
                    particle.connector = connector;
                    let joint = &map.connectors[usize::from(connector)];
                    particle.floor = joint.floor_at(particle.z, particle.floor);
                    if within(&joint.floors, particle.z, BEYOND_M) { 0.0 } else { f32::INFINITY }
                }
                None if was_in => {
                    let error = (particle.z + dz - floor.height) * self.exit;
                    particle.z = floor.height;
                    particle.connector = Particle::ON_FLOOR;
                    error
                }
                None => {
                    particle.z = floor.height;
                    self.change[2] * self.level
                }
            };
            if height_error != 0.0 {
                particle.weight *= (-0.5 * height_error * height_error).exp().max(self.leak);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::map::tests::small;
    use super::*;
    use nalgebra::Vector3;

    /// A step straight ahead, all but exactly known.
    pub fn ahead(length: f32, rise: f32) -> Step {
        let mut step = step();
        step.displacement = Vector3::new(length, 0.0, rise);
        step
    }

    fn step() -> Step {
        Step {
            index: 1,
            stance_start: sohle_shared::time::Micros(0),
            stance_end: sohle_shared::time::Micros(1_000_000),
            displacement: Vector3::zeros(),
            turn: 0.0,
            covariance: Matrix4::identity() * 1e-8,
            mode: Default::default(),
            quality: Default::default(),
            clipped: Default::default(),
        }
    }

    fn at(x: f32, y: f32, heading: f32) -> Particle {
        Particle { x, y, heading, scale: 1.0, weight: 1.0, connector: Particle::ON_FLOOR, ..Particle::default() }
    }

    fn exact() -> Parameters {
        Parameters { place_sigma_m: 0.0, turn_sigma: 0.0, turn_share: 1.0, scale_noise: 0.0, ..Parameters::default() }
    }

    #[test]
    fn a_step_is_turned_by_the_heading_of_the_particle() {
        let mut particles = [at(3.0, 4.0, PI / 2.0)];
        let mut turned = ahead(1.0, 0.0);
        turned.displacement.y = 0.5;
        turned.turn = 0.3;
        let moved = advance(&mut particles, &small(), &turned, &exact(), 1, 1);
        let [particle] = particles;
        assert!((particle.x - 2.5).abs() < 1e-3 && (particle.y - 5.0).abs() < 1e-3);
        assert!((particle.heading - (PI / 2.0 + 0.3)).abs() < 1e-3);
        assert_eq!((moved.alive, moved.likelihood()), (1, 1.0));
    }

    #[test]
    fn a_wall_costs_dearly_and_in_the_document_everything() {
        for (parameters, weight) in
            [(exact(), 1e-3), (Parameters { psi: [0.0; 3], phi: [0.0; 3], ..Parameters::documented() }, 0.0)]
        {
            let mut particles = [at(7.5, 2.0, 0.0), at(7.5, 4.5, 0.0)];
            advance(&mut particles, &small(), &ahead(1.0, 0.0), &parameters, 1, 1);
            assert_eq!(particles.map(|particle| particle.weight), [weight, 1.0]);
        }
    }

    #[test]
    fn outside_every_step_costs_as_much_as_a_wall() {
        let mut particles = [at(19.0, 2.0, 0.0), at(13.0, 2.0, 0.0)];
        for number in 0..2 {
            advance(&mut particles, &small(), &ahead(1.5, 0.0), &exact(), 1, number);
        }
        let [outside, inside] = particles.map(|particle| particle.weight);
        assert!((outside - 1e-6).abs() < 1e-9 && inside == 1.0, "{outside} {inside}");
    }

    #[test]
    fn stairs_lead_to_the_other_floor() {
        let map = small();
        let documented = Parameters { psi: [0.0; 3], phi: [0.0; 3], ..Parameters::documented() };
        for parameters in [exact(), documented] {
            let mut particles = [at(16.5, 8.0, 0.0), at(3.0, 3.0, 0.0)];
            particles[0].connector = 0;
            for i in 0..6 {
                let mut step = ahead(0.6, 0.6);
                step.displacement.x *= if i < 3 { 1.0 } else { -1.0 };
                advance(&mut particles, &map, &step, &parameters, 1, i);
            }
            let [climbed, level] = particles;
            assert_eq!((climbed.floor, level.floor), (1, 0), "{parameters:?}");
            assert!((climbed.z - 3.6).abs() < 2e-3 && climbed.weight > 0.99, "{climbed:?}");
            assert!(level.z == 0.0 && level.weight < 1e-15, "{level:?}");
            // It leaves the stairs onto the upper floor.
            for i in 6..8 {
                advance(&mut particles[..1], &map, &ahead(-0.6, 0.0), &parameters, 1, i);
            }
            assert!((particles[0].z, particles[0].connector, particles[0].floor) == (3.6, Particle::ON_FLOOR, 1));
            assert!(particles[0].weight > 0.99);
        }
    }

    #[test]
    fn stairs_end_where_the_floors_end() {
        let mut particles = [at(18.0, 8.0, 0.0)];
        particles[0].connector = 0;
        advance(&mut particles, &small(), &ahead(0.0, -1.0), &exact(), 1, 1);
        assert_eq!(particles[0].weight, 1e-3);
    }

    #[test]
    fn noise_has_the_covariance_of_the_step() {
        let mut step = ahead(1.0, 0.0);
        let root = Matrix4::new(0.1, 0.0, 0.0, 0.0, 0.03, 0.05, 0.0, 0.0, 0.0, 0.01, 0.02, 0.0, 0.02, -0.03, 0.0, 0.04);
        step.covariance = root * root.transpose();
        let mut particles = vec![at(10.0, 5.0, 0.0); 50_000];
        particles.iter_mut().for_each(|particle| particle.connector = 0);
        advance(&mut particles, &small(), &step, &exact(), 3, 1);
        let difference = |p: &Particle| Vector4::new(p.x - 11.0, p.y - 5.0, 0.0, p.heading);
        let seen = particles.iter().map(|p| difference(p) * difference(p).transpose()).sum::<Matrix4<f32>>() / 5e4;
        for (i, j) in [(0, 0), (0, 1), (1, 1), (3, 0), (3, 1), (3, 3)] {
            let scale = (step.covariance[(i, i)] * step.covariance[(j, j)]).sqrt();
            // Five standard errors of 50 000 pairs.
            assert!((seen[(i, j)] - step.covariance[(i, j)]).abs() < 0.032 * scale, "{i} {j}: {seen}");
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same() {
        let particles: Vec<_> = (0..20_000).map(|i| at(5.0 + i as f32 * 5e-4, 5.0, i as f32 * 1e-4)).collect();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut particles = particles.clone();
            let moved =
                pool.install(|| advance(&mut particles, &small(), &ahead(1.2, 0.0), &Parameters::default(), 5, 9));
            (particles, moved)
        };
        assert_eq!(with(1), with(3));
    }
}
