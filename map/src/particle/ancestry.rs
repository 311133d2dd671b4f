//! Where the particles came from: the past, corrected by all that was learned since.
//!
//! Each particle remembers its forebears. Whatever hypothesis dies takes its past with it, so that what is left tells where
//! the person has been, as far as it is known now: a room that was doubtful when it was entered is sure when it is left.
//!
//! Most particles share most of their past. It is kept as a tree; a branch without living particles is cut off. That takes
//! room for the steps and for some times the number of particles, however long the walk.
//!
//! # Source
//! Jacob, Murray and Rubenthaler, "Path storage in the particle filter", Statistics and Computing 25, 2015.

use super::cloud::Particle;

/// No node.
const NONE: u32 = u32::MAX;

/// A place of a particle after a step.
#[derive(Clone, Copy, Debug)]
struct Node {
    place: [f32; 3],
    floor: u16,
    /// Number of the step.
    step: u32,
    parent: u32,
    /// Nodes that follow it, and 1 if it is a particle's present.
    children: u32,
}

/// The corrected past at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PastPlace {
    /// Index of the step, as it was given to [`Ancestry::grow`].
    pub step: u32,
    /// Mean. **Units:** m; **Frame:** building.
    pub position: [f64; 3],
    /// Standard deviation in the plane. **Units:** m.
    pub sigma_m: f64,
    /// Index of the floor that has most of the weight.
    pub floor: usize,
}

/// Where a particle was between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// **Units:** m; **Frame:** building.
    pub place: [f32; 2],
    /// Indices of the floors at both steps.
    pub floors: [u16; 2],
}

/// The tree of forebears.
#[derive(Clone, Debug, Default)]
pub(super) struct Ancestry {
    nodes: Vec<Node>,
    free: Vec<u32>,
    /// The node of each particle.
    leaves: Vec<u32>,
}

impl Ancestry {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.free.clear();
        self.leaves.clear();
    }

    /// All particles have gone a step; particle `i` comes from the one that was `parents[i]` before, or from `i` itself
    /// when there are no `parents`.
    pub fn grow(&mut self, particles: &[Particle], parents: Option<&[usize]>, step: u32) {
        let before = std::mem::take(&mut self.leaves);
        for (i, particle) in particles.iter().enumerate() {
            let parent = parents.map_or(Some(i), |parents| parents.get(i).copied());
            let parent = parent.and_then(|parent| before.get(parent).copied()).unwrap_or(NONE);
            if let Some(node) = self.nodes.get_mut(parent as usize) {
                node.children += 1;
            }
            let place = [particle.x, particle.y, particle.z];
            let node = Node { place, floor: particle.floor, step, parent, children: 1 };
            let index = match self.free.pop() {
                Some(index) => {
                    self.nodes[index as usize] = node;
                    index
                }
                None => {
                    self.nodes.push(node);
                    (self.nodes.len() - 1) as u32
                }
            };
            self.leaves.push(index);
        }
        for leaf in before {
            self.release(leaf);
        }
    }

    /// Particles were drawn without a step: particle `i` is a copy of what `parents[i]` was before.
    pub fn redraw(&mut self, parents: &[usize]) {
        let before = std::mem::take(&mut self.leaves);
        if parents.iter().any(|&parent| parent >= before.len()) {
            // Nothing was remembered of them.
            self.clear();
            return;
        }
        self.leaves = parents.iter().map(|&parent| before[parent]).collect();
        for &leaf in &self.leaves {
            self.nodes[leaf as usize].children += 1;
        }
        for leaf in before {
            self.release(leaf);
        }
    }

    /// One that held the node does not any more.
    fn release(&mut self, mut index: u32) {
        while let Some(node) = self.nodes.get_mut(index as usize) {
            node.children -= 1;
            if node.children > 0 {
                return;
            }
            self.free.push(index);
            index = node.parent;
        }
    }

    /// Where each particle was between two steps in a row, so much of the way from the first to the second; nothing where that is
    /// not remembered of all.
    pub fn between(&self, from: u32, to: u32, part: f32) -> Option<Vec<Spot>> {
        let spot = |&leaf: &u32| {
            let mut node = self.nodes.get(leaf as usize)?;
            while node.step > to {
                node = self.nodes.get(node.parent as usize)?;
            }
            let before =
                self.nodes.get(node.parent as usize).filter(|before| before.step == from && node.step == to)?;
            let place = [0, 1].map(|axis| before.place[axis] + part * (node.place[axis] - before.place[axis]));
            Some(Spot { place, floors: [before.floor, node.floor] })
        };
        self.leaves.iter().map(spot).collect()
    }

    /// The past of the particles for which `belongs` holds, or of every so many of them, from the oldest step.
    pub fn past(&self, particles: &[Particle], every: usize, belongs: impl Fn(&Particle) -> bool) -> Vec<PastPlace> {
        let mut weights = vec![0.0; self.nodes.len()];
        let mut past = Vec::new();
        let add = |weights: &mut [f64], nodes: &mut Vec<u32>, index: u32, weight: f64| {
            if let Some(sum) = weights.get_mut(index as usize).filter(|_| weight > 0.0) {
                if *sum == 0.0 {
                    nodes.push(index);
                }
                *sum += weight;
            }
        };
        // All of one step, from the last to the first; parents gather the weights of their children.
        let mut nodes = Vec::new();
        let some = particles.iter().zip(&self.leaves).step_by(every.max(1));
        for (particle, &leaf) in some.filter(|(particle, _)| belongs(particle)) {
            add(&mut weights, &mut nodes, leaf, f64::from(particle.weight));
        }
        while !nodes.is_empty() {
            past.extend(self.mean(&nodes, &weights));
            let mut parents = Vec::new();
            for &index in &nodes {
                let weight = weights[index as usize];
                add(&mut weights, &mut parents, self.nodes[index as usize].parent, weight);
            }
            nodes = parents;
        }
        past.reverse();
        past
    }

    fn mean(&self, nodes: &[u32], weights: &[f64]) -> Option<PastPlace> {
        let (mut total, mut sum, mut squares) = (0.0, [0.0; 3], 0.0);
        let mut floors: Vec<f64> = Vec::new();
        let first = self.nodes[*nodes.first()? as usize];
        for &index in nodes {
            let (node, weight) = (&self.nodes[index as usize], weights[index as usize]);
            let offset: [f64; 3] = std::array::from_fn(|axis| f64::from(node.place[axis] - first.place[axis]));
            total += weight;
            for axis in 0..3 {
                sum[axis] += weight * offset[axis];
            }
            squares += weight * (offset[0] * offset[0] + offset[1] * offset[1]);
            let floor = usize::from(node.floor);
            if floors.len() <= floor {
                floors.resize(floor + 1, 0.0);
            }
            floors[floor] += weight;
        }
        if total <= 0.0 {
            return None;
        }
        let mean = sum.map(|value| value / total);
        let variance = squares / total - mean[0] * mean[0] - mean[1] * mean[1];
        Some(PastPlace {
            step: first.step,
            position: std::array::from_fn(|axis| f64::from(first.place[axis]) + mean[axis]),
            sigma_m: variance.max(0.0).sqrt(),
            floor: (0..floors.len()).max_by(|&a, &b| floors[a].total_cmp(&floors[b])).unwrap_or_default(),
        })
    }

    /// Nodes that are in use.
    #[cfg(test)]
    fn len(&self) -> usize {
        self.nodes.len() - self.free.len()
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Purpose, Stream};
    use super::*;

    #[test]
    fn copies_without_a_step_share_their_past() {
        let at = |x: f32| Particle { x, weight: 1.0, ..Particle::default() };
        let mut ancestry = Ancestry::default();
        ancestry.grow(&[at(1.0), at(5.0)], None, 1);
        ancestry.redraw(&[1, 1, 1]);
        let copies = [at(5.0), at(5.0), at(5.0)];
        assert_eq!(ancestry.past(&copies, 1, |_| true).iter().map(|past| past.position[0]).collect::<Vec<_>>(), [5.0]);
        ancestry.grow(&[at(6.0), at(7.0), at(8.0)], None, 2);
        let past = ancestry.past(&[at(6.0), at(7.0), at(8.0)], 1, |_| true);
        assert_eq!(past.iter().map(|past| past.position[0]).collect::<Vec<_>>(), [5.0, 7.0]);
        ancestry.redraw(&[9]);
        assert!(ancestry.past(&copies, 1, |_| true).is_empty());
    }

    #[test]
    fn where_each_was_between_two_steps_is_told_as_far_as_it_is_remembered() {
        let at = |x: f32, floor: u16| Particle { x, floor, weight: 1.0, ..Particle::default() };
        let mut ancestry = Ancestry::default();
        ancestry.grow(&[at(1.0, 0), at(5.0, 0)], None, 1);
        ancestry.grow(&[at(2.0, 0), at(7.0, 1)], None, 2);
        ancestry.grow(&[at(3.0, 0), at(8.0, 1), at(9.0, 1)], Some(&[0, 1, 1]), 3);
        let places = |from, to, part| -> Option<Vec<f32>> {
            Some(ancestry.between(from, to, part)?.iter().map(|spot| spot.place[0]).collect())
        };
        assert_eq!(places(1, 2, 0.25), Some(vec![1.25, 5.5, 5.5]));
        assert_eq!(places(2, 3, 1.0), Some(vec![3.0, 8.0, 9.0]));
        assert_eq!(ancestry.between(1, 2, 0.5).unwrap()[2].floors, [0, 1]);
        assert_eq!((places(0, 1, 0.5), places(1, 3, 0.5)), (None, None));
    }
    use proptest::prelude::*;

    fn at(x: f32) -> Particle {
        Particle { x, weight: 1.0, ..Particle::default() }
    }

    #[test]
    fn what_died_is_not_in_the_past() {
        let mut ancestry = Ancestry::default();
        ancestry.grow(&[at(0.0), at(10.0)], None, 1);
        ancestry.grow(&[at(1.0), at(11.0)], None, 2);
        let now = [at(2.0), at(2.5)];
        ancestry.grow(&now, Some(&[0, 0]), 3);
        let past = ancestry.past(&now, 1, |_| true);
        assert_eq!(past.iter().map(|place| place.position[0]).collect::<Vec<_>>(), [0.0, 1.0, 2.25]);
        assert_eq!(past.iter().map(|place| place.step).collect::<Vec<_>>(), [1, 2, 3]);
        assert!((past[2].sigma_m - 0.25).abs() < 1e-9);
        // The node of each step on the way, and two at its end.
        assert_eq!(ancestry.len(), 4);
        let one = ancestry.past(&now, 1, |particle| particle.x > 2.2);
        assert_eq!(one[2].position[0], 2.5);
    }

    #[test]
    fn an_hour_of_steps_stays_small() {
        let mut ancestry = Ancestry::default();
        let particles = vec![at(0.0); 1_000];
        let mut stream = Stream::new(1, Purpose::Draw, 0, 0);
        for step in 0..3_600 {
            let parents: Vec<usize> = (0..1_000).map(|_| (stream.unit() * 1_000.0) as usize).collect();
            ancestry.grow(&particles, Some(&parents), step);
        }
        // All have one forebear some 2 000 steps ago (Kingman's coalescent: twice their number); before that there is one
        // node for each step, after it about twice their number times its logarithm.
        assert!(ancestry.len() < 3_600 + 30 * 1_000, "{}", ancestry.len());
        assert_eq!(ancestry.past(&particles, 1, |_| true).len(), 3_600);
    }

    proptest! {
        #[test]
        fn the_tree_tells_what_whole_paths_would(
            draws in proptest::collection::vec(proptest::collection::vec((0_usize..6, -5.0_f32..5.0), 6), 1..30),
        ) {
            let mut ancestry = Ancestry::default();
            let mut paths: Vec<Vec<f32>> = vec![Vec::new(); 6];
            let mut particles = Vec::new();
            for (step, draw) in draws.iter().enumerate() {
                let parents: Vec<usize> = draw.iter().map(|&(parent, _)| parent).collect();
                particles = draw.iter().map(|&(_, x)| at(x)).collect();
                paths = draw.iter().map(|&(parent, x)| [&paths[parent][..], &[x]].concat()).collect();
                ancestry.grow(&particles, (step > 0).then_some(&parents[..]), step as u32);
            }
            if draws.len() == 1 {
                paths.iter_mut().zip(&particles).for_each(|(path, particle)| *path = vec![particle.x]);
            }
            let past = ancestry.past(&particles, 1, |_| true);
            prop_assert_eq!(past.len(), draws.len());
            for (step, place) in past.iter().enumerate() {
                let mean = paths.iter().map(|path| f64::from(path[step])).sum::<f64>() / 6.0;
                prop_assert!((place.position[0] - mean).abs() < 1e-5, "{} {}", place.position[0], mean);
            }
            let thirds = ancestry.past(&particles, 3, |_| true);
            prop_assert_eq!(thirds.len(), draws.len());
            for (step, place) in thirds.iter().enumerate() {
                let mean = f64::from(paths[0][step] + paths[3][step]) / 2.0;
                prop_assert!((place.position[0] - mean).abs() < 1e-5, "{} {}", place.position[0], mean);
            }
        }
    }
}
