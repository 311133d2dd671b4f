//! Work of known size for timing the filter: a building as large as asked for, a cloud, a step.
//!
//! Beside the filter's own moves there is a plain reference, as a textbook has it, so that figures of different machines can
//! be compared as ratios of one run.

use super::cloud::Particle;
use super::cluster::{Cluster, Clusters};
use super::map::{Map, Plan};
use super::motion::{self, Moved};
use super::parameters::Parameters;
use super::random::{Purpose, Stream};
use super::resampling;
use super::start::{self, Start};
use super::{Error, Wall};
use nalgebra::{Matrix4, Vector3};
use sohle_shared::sample::ClippedSamples;
use sohle_shared::step::{FloorMode, Step, StepQuality};
use sohle_shared::time::Micros;
use std::f64::consts::TAU;

/// Side of a room. **Units:** m.
const ROOM_M: f32 = 5.0;
/// Width of a door. **Units:** m.
const DOOR_M: f32 = 1.0;
/// Floor to floor. **Units:** m.
const STOREY_M: f32 = 3.5;

/// A building of equal floors with `rooms` by `rooms` rooms of 5 m by 5 m each, with a door in every wall between them.
///
/// # Errors
/// More than can be numbered.
pub fn building(floors: u16, rooms: u16) -> Result<Map, Error> {
    let side = f32::from(rooms) * ROOM_M;
    let mut walls: Vec<Wall> = Vec::new();
    for line in 0..=rooms {
        let at = f32::from(line) * ROOM_M;
        if line == 0 || line == rooms {
            walls.extend([[[0.0, at], [side, at]], [[at, 0.0], [at, side]]]);
            continue;
        }
        for room in 0..rooms {
            let (from, to) = (f32::from(room) * ROOM_M, f32::from(room + 1) * ROOM_M);
            let (west, east) = ((from + to - DOOR_M) / 2.0, (from + to + DOOR_M) / 2.0);
            for [from, to] in [[from, west], [east, to]] {
                walls.extend([[[from, at], [to, at]], [[at, from], [at, to]]]);
            }
        }
    }
    let plan = |floor: u16| Plan {
        number: i32::from(floor),
        height: f32::from(floor) * STOREY_M,
        closed: walls.clone(),
        walls: walls.clone(),
        rooms: Vec::new(),
    };
    Map::new((0..floors).map(plan).collect(), Vec::new())
}

/// A cloud in a building, and a step for it.
#[derive(Clone, Debug)]
pub struct Work {
    map: Map,
    parameters: Parameters,
    sown: Vec<Particle>,
    particles: Vec<Particle>,
    drawn: Vec<Particle>,
    clusters: Clusters,
    step: Step,
    number: u64,
}

impl Work {
    /// `count` particles anywhere in the building.
    ///
    /// # Errors
    /// Settings out of bounds.
    pub fn new(map: Map, count: usize) -> Result<Self, Error> {
        let parameters = Parameters { most: count.max(2_000), ..Parameters::default() };
        parameters.check()?;
        let mut sown = start::sow(&map, &Start::Anywhere, &parameters, 1)?.particles;
        // Sowing keeps below the number; the rest are copies.
        let kinds = sown.len();
        sown.extend((kinds..count).map(|i| sown[i % kinds]).collect::<Vec<_>>());
        sown.truncate(count);
        let step = Step {
            index: 1,
            stance_start: Micros(0),
            stance_end: Micros(500_000),
            displacement: Vector3::new(1.2, 0.05, 0.0),
            turn: 0.05,
            covariance: Matrix4::from_diagonal(&[1e-4, 1e-4, 1e-4, 1e-5].into()),
            mode: FloorMode::Level,
            quality: StepQuality::default(),
            clipped: ClippedSamples::default(),
        };
        let mut work = Self {
            particles: sown.clone(),
            sown,
            map,
            parameters,
            drawn: Vec::new(),
            clusters: Clusters::default(),
            step,
            number: 0,
        };
        // Once, so that the weights are those of a cloud at work and all room is there.
        work.moves();
        work.draw(count);
        work.renew();
        Ok(work)
    }

    /// As at the start.
    pub fn renew(&mut self) {
        self.particles.copy_from_slice(&self.sown);
    }

    /// One move of each particle, with the test of walls. Returns how many had weight left.
    pub fn moves(&mut self) -> usize {
        self.number += 1;
        let Moved { alive, .. } =
            motion::advance(&mut self.particles, &self.map, &self.step, &self.parameters, 1, self.number);
        alive
    }

    /// Draws `count` particles.
    pub fn draw(&mut self, count: usize) -> usize {
        let mut stream = Stream::new(1, Purpose::Draw, self.number, 0);
        resampling::draw(&self.particles, count, &mut stream, &mut self.drawn, |_| {})
    }

    /// Finds the clusters.
    pub fn clusters(&mut self) -> Vec<Cluster> {
        let total = self.particles.iter().map(|particle| f64::from(particle.weight)).sum();
        self.clusters.find(&self.particles, total, &self.map)
    }

    /// The reference: one move of each particle in double precision, with exact normal numbers, one after the other, and
    /// no walls. Returns the sum of all coordinates.
    pub fn reference(&mut self) -> f64 {
        let mut stream = Stream::new(1, Purpose::Move, self.number, 0);
        let mut normals = || {
            let radius = (-2.0 * (1.0 - stream.unit_f64()).ln()).sqrt();
            let (sin, cos) = (TAU * stream.unit_f64()).sin_cos();
            [radius * cos, radius * sin]
        };
        let (step, mut sum) = (self.step.displacement.map(f64::from), 0.0);
        for particle in &mut self.particles {
            let ([a, b], [c, _]) = (normals(), normals());
            let (sin, cos) = f64::from(particle.heading).sin_cos();
            let (dx, dy) = (step.x + 0.02 * a, step.y + 0.02 * b);
            let x = f64::from(particle.x) + cos * dx - sin * dy;
            let y = f64::from(particle.y) + sin * dx + cos * dy;
            particle.heading = (f64::from(particle.heading + self.step.turn) + 0.005 * c).rem_euclid(TAU) as f32;
            (particle.x, particle.y) = (x as f32, y as f32);
            sum += x + y;
        }
        sum
    }

    /// Bytes that particles, their second half and the map take.
    pub fn bytes(&self) -> usize {
        (self.particles.capacity() + self.drawn.capacity()) * size_of::<Particle>() + self.map.bytes()
    }

    /// Walls of one floor.
    pub fn walls(&self) -> usize {
        self.map.floors.first().map_or(0, |floor| floor.grid.count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_building_has_its_rooms_and_doors() {
        let map = building(2, 3).unwrap();
        assert!(!map.blocked(0, [2.5, 2.5], [7.5, 2.5]) && map.blocked(1, [2.5, 1.0], [7.5, 1.0]));
        assert!(map.is_inside(1, [14.0, 14.0]) && map.blocked(0, [2.5, 2.5], [-0.5, 2.5]));
    }

    #[test]
    fn work_has_the_size_asked_for() {
        let mut work = Work::new(building(2, 4).unwrap(), 5_000).unwrap();
        assert!(work.moves() == 5_000 && work.draw(3_000) > 1_000);
        assert!(!work.clusters().is_empty() && work.reference().is_finite());
        assert!(work.bytes() > 8_000 * size_of::<Particle>());
    }
}
