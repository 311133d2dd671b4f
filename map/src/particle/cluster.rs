//! Groups of particles that belong together: the places where the person may be (Foot, 5.6).
//!
//! The document grows each group from a random particle by the distance to its mean, which takes the square of their number.
//! The default looks at the cells of the map that hold particles: cells that touch belong together, on stairs and in
//! elevators across floors too. That takes one pass over the particles, whatever their number.

use super::cloud::{BLOCK, Particle};
use super::map::Map;
use super::random::Stream;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Where the person may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// The share of the weight.
    pub probability: f64,
    /// Mean. **Units:** m; **Frame:** building.
    pub position: Vector3<f64>,
    /// Covariance of the position. **Units:** m²; **Frame:** building.
    pub covariance: Matrix3<f64>,
    /// Mean heading of the foot. **Units:** rad; **Frame:** building.
    pub heading: f64,
    /// Length of the mean of all directions: 1 when all are the same, near 0 when the heading is unknown.
    pub heading_agreement: f64,
    /// Number of the floor that has most of the weight.
    pub floor: i32,
    /// Index of that floor.
    pub floor_index: usize,
    /// Particles.
    pub count: usize,
}

impl Cluster {
    /// Standard deviation of the place: root of the sum over the axes. **Units:** m.
    pub fn sigma_m(&self) -> f64 {
        self.covariance.trace().max(0.0).sqrt()
    }
}

/// Sums over the particles of a group.
#[derive(Clone, Debug)]
struct Sums {
    weight: f64,
    count: usize,
    /// Of the offset from the first particle, so that little is lost of the squares.
    origin: [f64; 3],
    first: [f64; 3],
    /// Upper triangle, row by row.
    second: [f64; 6],
    direction: [f64; 2],
    floors: Vec<f64>,
}

impl Sums {
    fn new(floors: usize, origin: Vector3<f64>) -> Self {
        Self {
            weight: 0.0,
            count: 0,
            origin: origin.into(),
            first: [0.0; 3],
            second: [0.0; 6],
            direction: [0.0; 2],
            floors: vec![0.0; floors],
        }
    }

    fn add(&mut self, particle: &Particle) {
        let weight = f64::from(particle.weight);
        let at = [particle.x, particle.y, particle.z];
        let [x, y, z] = std::array::from_fn(|axis| f64::from(at[axis]) - self.origin[axis]);
        let weighed = [x * weight, y * weight, z * weight];
        self.weight += weight;
        self.count += 1;
        add_all(&mut self.first, &weighed);
        let [wx, wy, wz] = weighed;
        add_all(&mut self.second, &[wx * x, wx * y, wx * z, wy * y, wy * z, wz * z]);
        let (sin, cos) = particle.heading.sin_cos();
        add_all(&mut self.direction, &[weight * f64::from(cos), weight * f64::from(sin)]);
        self.floors[usize::from(particle.floor)] += weight;
    }

    /// Others of the same group, and with the same origin.
    fn join(&mut self, other: &Self) {
        self.weight += other.weight;
        self.count += other.count;
        add_all(&mut self.first, &other.first);
        add_all(&mut self.second, &other.second);
        add_all(&mut self.direction, &other.direction);
        add_all(&mut self.floors, &other.floors);
    }

    /// (5.28 - 5.33), with weights.
    fn finish(self, total: f64, map: &Map) -> Cluster {
        let mean = Vector3::from(self.first) / self.weight;
        let [xx, xy, xz, yy, yz, zz] = self.second;
        let second = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let [cos, sin] = self.direction;
        let floor_index =
            (0..self.floors.len()).max_by(|&a, &b| self.floors[a].total_cmp(&self.floors[b])).unwrap_or_default();
        Cluster {
            probability: self.weight / total,
            position: Vector3::from(self.origin) + mean,
            covariance: second / self.weight - mean * mean.transpose(),
            heading: sin.atan2(cos),
            heading_agreement: cos.hypot(sin) / self.weight,
            floor: map.floors[floor_index].number,
            floor_index,
            count: self.count,
        }
    }
}

/// Adds to each sum what belongs to it.
pub(super) fn add_all(sums: &mut [f64], more: &[f64]) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

fn place(particle: &Particle) -> Vector3<f64> {
    Vector3::new(particle.x, particle.y, particle.z).map(f64::from)
}

/// Heights in a connector are told apart by so much. **Units:** m.
const LAYER_M: f32 = 1.0;
/// Highest layer above the lowest floor of a connector; more lie in it.
const LAYERS: usize = 1_024;

/// Room for the work of [`Clusters::find`], kept from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Clusters {
    /// First cell of each floor.
    offsets: Vec<usize>,
    /// Of each cell of each floor: the number of its node, or [`NONE`].
    nodes: Vec<u32>,
    /// The cell of each node.
    cells: Vec<usize>,
    /// The first particle in it.
    firsts: Vec<u32>,
    /// Union-find over nodes.
    parents: Vec<u32>,
    /// Node of each particle.
    members: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Clusters {
    /// Groups the particles; the likeliest first. `total` is the sum of their weights.
    pub fn find(&mut self, particles: &[Particle], total: f64, map: &Map) -> Vec<Cluster> {
        self.mark(particles, map);
        self.join_neighbours(map);
        self.join_layers(particles, map);
        let roots: Vec<u32> = (0..self.cells.len()).map(|node| find(&mut self.parents, node as u32)).collect();
        let (all, firsts) = (particles, &self.firsts);
        let block = |(particles, members): (&[Particle], &[u32])| {
            let mut groups: Vec<(u32, Sums)> = Vec::new();
            let mut places: HashMap<u32, usize> = HashMap::new();
            // Neighbours in the cloud are in the same group nearly always.
            let mut last = 0;
            for (particle, &node) in particles.iter().zip(members).filter(|(_, node)| **node != NONE) {
                let root = roots[node as usize];
                if groups.get(last).is_none_or(|(known, _)| *known != root) {
                    last = *places.entry(root).or_insert(groups.len());
                    if last == groups.len() {
                        groups.push((root, Sums::new(map.floors.len(), place(&all[firsts[root as usize] as usize]))));
                    }
                }
                groups[last].1.add(particle);
            }
            groups
        };
        // Collected in order and added in order: the sums do not depend on who was first.
        let blocks = particles.par_chunks(BLOCK).zip(self.members.par_chunks(BLOCK));
        let blocks: Vec<Vec<(u32, Sums)>> = blocks.map(block).collect();
        let mut sums: Vec<Option<Sums>> = vec![None; self.cells.len()];
        for (root, part) in blocks.into_iter().flatten() {
            match &mut sums[root as usize] {
                Some(sum) => sum.join(&part),
                none => *none = Some(part),
            }
        }
        ranked(sums.into_iter().flatten().map(|sums| sums.finish(total, map)).collect())
    }

    /// Numbers the cells that hold particles.
    fn mark(&mut self, particles: &[Particle], map: &Map) {
        self.offsets.clear();
        let mut cells = 0;
        for floor in &map.floors {
            self.offsets.push(cells);
            cells += floor.grid.len();
        }
        self.nodes.clear();
        self.nodes.resize(cells, NONE);
        self.cells.clear();
        self.firsts.clear();
        self.members.clear();
        for (index, particle) in particles.iter().enumerate() {
            let floor = usize::from(particle.floor);
            let cell = map.floors[floor].grid.cell([particle.x, particle.y]);
            let node = match cell {
                Some(cell) if particle.weight > 0.0 => {
                    let node = &mut self.nodes[self.offsets[floor] + cell];
                    if *node == NONE {
                        *node = self.cells.len() as u32;
                        self.cells.push(self.offsets[floor] + cell);
                        self.firsts.push(index as u32);
                    }
                    *node
                }
                _ => NONE,
            };
            self.members.push(node);
        }
        self.parents.clear();
        self.parents.extend(0..self.cells.len() as u32);
    }

    /// Joins cells of a floor that touch.
    fn join_neighbours(&mut self, map: &Map) {
        for node in 0..self.cells.len() {
            let cell = self.cells[node];
            let floor = self.offsets.partition_point(|&offset| offset <= cell) - 1;
            let (columns, rows) = map.floors[floor].grid.size();
            let within = cell - self.offsets[floor];
            let (column, row) = (within % columns, within / columns);
            // The other four neighbours see it from their side.
            for (right, up) in [(1, 0), (-1, 1), (0, 1), (1, 1)] {
                let Some(column) = column.checked_add_signed(right).filter(|&column| column < columns) else {
                    continue;
                };
                let row = row + up;
                if row < rows {
                    let other = self.nodes[self.offsets[floor] + row * columns + column];
                    if other != NONE {
                        join(&mut self.parents, node as u32, other);
                    }
                }
            }
        }
    }

    /// Joins what stands at about the same height in the same connector, whatever its floor.
    fn join_layers(&mut self, particles: &[Particle], map: &Map) {
        let mut layers: Vec<Vec<u32>> = vec![Vec::new(); map.connectors.len()];
        for (particle, &node) in particles.iter().zip(&self.members) {
            let Some(layers) = layers.get_mut(usize::from(particle.connector)) else { continue };
            let low = map.connectors[usize::from(particle.connector)].floors.first().map_or(0.0, |&(_, height)| height);
            let layer = (((particle.z - low) / LAYER_M + 1.0).max(0.0) as usize).min(LAYERS);
            if node == NONE {
                continue;
            }
            if layers.len() <= layer {
                layers.resize(layer + 1, NONE);
            }
            if layers[layer] == NONE {
                layers[layer] = node;
            } else {
                join(&mut self.parents, layers[layer], node);
            }
        }
        for layers in &layers {
            for pair in layers.windows(2) {
                if pair[0] != NONE && pair[1] != NONE {
                    join(&mut self.parents, pair[0], pair[1]);
                }
            }
        }
    }
}

fn find(parents: &mut [u32], mut node: u32) -> u32 {
    while parents[node as usize] != node {
        let above = parents[parents[node as usize] as usize];
        parents[node as usize] = above;
        node = above;
    }
    node
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parents, a), find(parents, b));
    // The smaller number leads: the result does not depend on the order of joining.
    parents[a.max(b) as usize] = a.min(b);
}

fn ranked(mut clusters: Vec<Cluster>) -> Vec<Cluster> {
    clusters.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    clusters
}

/// The document's way: from a random particle, all within `plane` and `height` of the mean, until no more come; then again
/// with the rest.
pub(super) fn documented(
    particles: &[Particle],
    total: f64,
    map: &Map,
    [plane, height]: [f32; 2],
    stream: &mut Stream,
) -> Vec<Cluster> {
    let mut rest: Vec<&Particle> = particles.iter().filter(|particle| particle.weight > 0.0).collect();
    let mut clusters = Vec::new();
    while !rest.is_empty() {
        let start = ((stream.unit_f64() * rest.len() as f64) as usize).min(rest.len() - 1);
        let mut centre = place(rest[start]);
        let mut size = 0;
        loop {
            let near = |particle: &&&Particle| {
                let offset = place(particle) - centre;
                offset.xy().norm() <= f64::from(plane) && offset.z.abs() <= f64::from(height)
            };
            let mut sums = Sums::new(map.floors.len(), centre);
            rest.iter().filter(near).for_each(|particle| sums.add(particle));
            // A mean that has left all its particles behind keeps what it had: with none, nothing could be taken away.
            let grown = sums.count > size;
            if grown {
                size = sums.count;
                centre += Vector3::from(sums.first) / sums.weight;
                continue;
            }
            if sums.count == 0 {
                let nearest =
                    rest.iter().map(|particle| (place(particle) - centre).norm()).fold(f64::INFINITY, f64::min);
                rest.iter()
                    .filter(|particle| (place(particle) - centre).norm() <= nearest)
                    .for_each(|particle| sums.add(particle));
                rest.retain(|particle| (place(particle) - centre).norm() > nearest);
            } else {
                rest.retain(|particle| !near(&particle));
            }
            clusters.push(sums.finish(total, map));
            break;
        }
    }
    ranked(clusters)
}

#[cfg(test)]
mod tests {
    use super::super::map::tests::small;
    use super::super::random::Purpose;
    use super::*;
    use proptest::prelude::*;

    fn at(x: f32, y: f32, z: f32, floor: u16) -> Particle {
        let connector = if x > 16.0 && y > 6.0 { 0 } else { Particle::ON_FLOOR };
        Particle { x, y, z, floor, connector, weight: 1.0, scale: 1.0, heading: 3.0 }
    }

    fn found(particles: &[Particle]) -> Vec<Cluster> {
        Clusters::default().find(particles, particles.len() as f64, &small())
    }

    #[test]
    fn groups_are_found_with_their_means_and_shares() {
        let mut particles: Vec<_> = (0..30).map(|i| at(2.0 + 0.01 * i as f32, 3.0, 0.0, 0)).collect();
        particles.extend((0..10).map(|i| at(12.0, 2.0 + 0.01 * i as f32, 3.6, 1)));
        particles[0].heading = -3.0;
        let clusters = found(&particles);
        assert_eq!(clusters.len(), 2);
        assert_eq!((clusters[0].probability, clusters[0].floor, clusters[0].count), (0.75, 0, 30));
        assert!((clusters[0].position - Vector3::new(2.145, 3.0, 0.0)).norm() < 1e-5);
        // Even over 0.3 m.
        assert!((clusters[0].sigma_m() - 0.01 * ((30.0_f64 * 30.0 - 1.0) / 12.0).sqrt()).abs() < 1e-5);
        assert!((clusters[0].heading - 3.0).abs() < 0.02 && clusters[0].heading_agreement > 0.99);
        assert_eq!((clusters[1].floor, clusters[1].floor_index), (1, 1));
    }

    #[test]
    fn stairs_join_floors_and_floors_alone_do_not() {
        let climbing: Vec<_> = (0..20).map(|i| at(18.0, 8.0, 0.18 * i as f32, u16::from(i > 10))).collect();
        assert_eq!(found(&climbing).len(), 1);
        let above: Vec<_> = (0..20).map(|i| at(4.0, 8.0, 3.6 * (i % 2) as f32, i % 2)).collect();
        assert_eq!(found(&above).len(), 2);
        let far_in_the_elevator = [at(18.0, 8.0, 0.0, 0), at(18.0, 8.0, 3.6, 1)];
        assert_eq!(found(&far_in_the_elevator).len(), 2);
    }

    /// More than a block of particles in two places that lie mixed in the cloud: against sums over one place at a time, and on
    /// several threads.
    #[test]
    fn a_cloud_of_many_blocks_is_summed_as_a_whole_on_any_number_of_threads() {
        let place = |i: usize| if (i / 7).is_multiple_of(3) { [3.0, 3.0] } else { [12.0, 4.0] };
        let particle = |i: usize| {
            let ([x, y], along) = (place(i), (i % 100) as f32 * 0.004);
            Particle { weight: 0.5 + (i % 5) as f32, ..at(x + along, y - 0.5 * along, 0.0, 0) }
        };
        let particles: Vec<_> = (0..3 * BLOCK + 100).map(particle).collect();
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| found(&particles))
        };
        let clusters = with(1);
        assert_eq!(clusters, with(3));
        assert_eq!(clusters.len(), 2);
        for (cluster, x) in clusters.iter().zip([12.0, 3.0]) {
            let own: Vec<&Particle> = particles.iter().filter(|particle| (particle.x - x).abs() < 1.0).collect();
            let sum = |value: &dyn Fn(&Particle) -> f64| -> f64 {
                own.iter().map(|particle| f64::from(particle.weight) * value(particle)).sum()
            };
            let weight = sum(&|_| 1.0);
            let mean = [sum(&|one| one.x.into()) / weight, sum(&|one| one.y.into()) / weight];
            let spread = sum(&|one| (f64::from(one.x) - mean[0]) * (f64::from(one.y) - mean[1])) / weight;
            assert_eq!(cluster.count, own.len());
            assert!((cluster.position.x - mean[0]).abs() < 1e-9 && (cluster.position.y - mean[1]).abs() < 1e-9);
            assert!((cluster.covariance[(0, 1)] - spread).abs() < 1e-9, "{} {spread}", cluster.covariance);
            assert_eq!(cluster.covariance, cluster.covariance.transpose());
        }
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_both_ways_agree_on_what_is_far_apart(
            places in proptest::collection::vec((0_usize..2, 0.0_f32..0.9, 0.0_f32..0.9, 0.1_f32..2.0), 1..60),
        ) {
            let centres = [[2.0, 2.0], [12.0, 2.0]];
            let particles: Vec<_> = places
                .iter()
                .map(|&(group, x, y, weight)| Particle { weight, ..at(centres[group][0] + x, centres[group][1] + y, 0.0, 0) })
                .collect();
            let total = particles.iter().map(|particle| f64::from(particle.weight)).sum();
            let map = small();
            let fast = Clusters::default().find(&particles, total, &map);
            let slow = documented(&particles, total, &map, [5.0, 1.0], &mut Stream::new(1, Purpose::Cluster, 0, 0));
            prop_assert!((fast.iter().map(|cluster| cluster.probability).sum::<f64>() - 1.0).abs() < 1e-9);
            prop_assert_eq!(fast.iter().map(|cluster| cluster.count).sum::<usize>(), particles.len());
            prop_assert_eq!(fast.len(), slow.len());
            for (fast, slow) in fast.iter().zip(&slow) {
                prop_assert!((fast.probability - slow.probability).abs() < 1e-6);
                prop_assert!((fast.position - slow.position).norm() < 1e-5);
            }
        }

        #[test]
        fn the_documents_way_ends_whatever_lies_there(
            places in proptest::collection::vec(proptest::array::uniform2(0.0_f32..20.0), 0..80),
        ) {
            let particles: Vec<_> = places.iter().map(|&[x, y]| at(x, y * 0.5, 0.0, 0)).collect();
            let clusters =
                documented(&particles, particles.len() as f64, &small(), [2.0, 1.0], &mut Stream::new(1, Purpose::Cluster, 0, 0));
            prop_assert_eq!(clusters.iter().map(|cluster| cluster.count).sum::<usize>(), particles.len());
        }
    }
}
