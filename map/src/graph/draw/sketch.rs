//! The graph of one floor while it is drawn: nodes that move, merge and vanish.

use super::free::Free;
use crate::building::geometry::{self, Point};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// What may be done to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hold {
    /// Anything.
    Loose,
    /// It must not move, but is not needed where one goes straight on: the middle of a door.
    Place,
    /// It stays: a room, a landing.
    Fixed,
}

/// A node.
#[derive(Clone, Debug, PartialEq)]
pub struct Dot {
    /// **Units:** m; **Frame:** building.
    pub place: Point,
    /// What may be done to it.
    pub hold: Hold,
    /// The nodes it is joined with, in order of their numbers.
    pub beside: Vec<usize>,
    /// Whether an open area begins here.
    pub port: bool,
    /// Whether it has vanished.
    pub gone: bool,
}

/// The graph of a floor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sketch {
    /// Nodes keep their numbers.
    pub dots: Vec<Dot>,
}

/// The angle between two directions of edges. **Units:** rad, 0 to pi.
pub fn angle_between(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).abs()
}

impl Sketch {
    /// A new node.
    pub fn add(&mut self, place: Point, hold: Hold) -> usize {
        self.dots.push(Dot { place, hold, beside: Vec::new(), port: false, gone: false });
        self.dots.len() - 1
    }

    /// Joins two nodes.
    pub fn join(&mut self, a: usize, b: usize) {
        for (here, there) in [(a, b), (b, a)] {
            let beside = &mut self.dots[here].beside;
            if let Err(at) = beside.binary_search(&there)
                && a != b
            {
                beside.insert(at, there);
            }
        }
    }

    /// Takes the edge between two nodes away.
    pub fn part(&mut self, a: usize, b: usize) {
        self.dots[a].beside.retain(|&other| other != b);
        self.dots[b].beside.retain(|&other| other != a);
    }

    /// Takes a node away with its edges.
    pub fn remove(&mut self, dot: usize) {
        for other in std::mem::take(&mut self.dots[dot].beside) {
            self.dots[other].beside.retain(|&there| there != dot);
        }
        self.dots[dot].gone = true;
    }

    /// All edges, each once.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let each = self.dots.iter().enumerate();
        each.flat_map(|(a, dot)| dot.beside.iter().filter(move |&&b| a < b).map(move |&b| [a, b]))
    }

    /// From a node to another. **Units:** m.
    pub fn along(&self, from: usize, to: usize) -> [f64; 2] {
        let (a, b) = (self.dots[from].place, self.dots[to].place);
        [b[0] - a[0], b[1] - a[1]]
    }

    /// **Units:** m.
    pub fn length(&self, a: usize, b: usize) -> f64 {
        geometry::distance(self.dots[a].place, self.dots[b].place)
    }

    /// Whether an edge from a node to a place would leave it nearly along another. **Units:** rad.
    pub fn forks(&self, from: usize, to: Point, least: f64) -> bool {
        let here = self.dots[from].place;
        let new = [to[0] - here[0], to[1] - here[1]];
        self.dots[from].beside.iter().any(|&other| angle_between(new, self.along(from, other)) < least)
    }

    /// Merges nodes that are joined by less than `shortest`, the shortest edge first.
    pub fn contract(&mut self, free: &Free, shortest: f64) {
        let mut kept = BTreeSet::new();
        loop {
            let short =
                self.edges().filter(|edge| !kept.contains(edge)).map(|edge| (self.length(edge[0], edge[1]), edge));
            let short = short.filter(|(length, _)| *length < shortest);
            let Some((_, edge)) = short.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else { return };
            if !self.merge(free, edge) {
                kept.insert(edge);
            }
        }
    }

    fn merge(&mut self, free: &Free, [a, b]: [usize; 2]) -> bool {
        let (first, second) = (&self.dots[a], &self.dots[b]);
        let middle = geometry::between(first.place, second.place, 0.5);
        // One that is fixed, or where ways meet, stays where it is; the other comes to it.
        let weight = |dot: &Dot| match dot.hold {
            Hold::Fixed => 3,
            Hold::Loose if dot.port || dot.beside.len() > 2 => 2,
            Hold::Place => 1,
            Hold::Loose => 0,
        };
        let (stays, goes) = if weight(first) >= weight(second) { (a, b) } else { (b, a) };
        let (hold, other) = (self.dots[stays].hold, self.dots[goes].hold);
        if hold == Hold::Fixed && other == Hold::Fixed {
            return false;
        }
        let alike = weight(first) == weight(second);
        let (here, there) = (self.dots[stays].place, self.dots[goes].place);
        let places = match hold {
            Hold::Loose if alike => vec![middle, here, there],
            Hold::Loose => vec![here, middle, there],
            _ => vec![here],
        };
        let mut others: Vec<usize> = first.beside.iter().chain(&second.beside).copied().collect();
        others.retain(|&other| other != a && other != b);
        let sees = |place: &Point| others.iter().all(|&other| free.sees(*place, self.dots[other].place));
        let Some(place) = places.into_iter().find(sees) else { return false };
        let port = self.dots[goes].port;
        self.remove(goes);
        self.dots[stays].place = place;
        self.dots[stays].port |= port;
        others.into_iter().for_each(|other| self.join(stays, other));
        true
    }

    /// Takes nodes away where one goes straight on: where the next two see each other and the node lies within `off` of the
    /// line between them. Those that are held more than `most` stay.
    pub fn straighten(&mut self, free: &Free, off: f64, most: Hold) {
        for dot in 0..self.dots.len() {
            let [a, b] = self.dots[dot].beside[..] else { continue };
            let (from, to) = (self.dots[a].place, self.dots[b].place);
            let here = self.dots[dot].place;
            let far = geometry::distance(geometry::nearest(&[from, to], here), here);
            let fits = self.dots[dot].hold <= most && !self.dots[dot].port && far <= off;
            if fits && !self.dots[a].beside.contains(&b) && free.sees(from, to) {
                self.remove(dot);
                self.join(a, b);
            }
        }
    }

    /// Straightens until nothing changes: a way between two places that are held, or where ways meet, is pulled as a string.
    pub fn pull(&mut self, free: &Free, off: f64) {
        loop {
            let before = self.dots.iter().filter(|dot| dot.gone).count();
            self.straighten(free, off, Hold::Loose);
            if self.dots.iter().filter(|dot| dot.gone).count() == before {
                return;
            }
        }
    }

    /// Takes dead ends away that are shorter than `shortest`, unless they end at a place that is held or at a port.
    pub fn prune(&mut self, shortest: f64) {
        let is_end = |dot: &Dot| dot.hold == Hold::Loose && !dot.port && dot.beside.len() == 1;
        for end in 0..self.dots.len() {
            if !is_end(&self.dots[end]) {
                continue;
            }
            let (mut line, mut length) = (vec![end], 0.0);
            let mut next = self.dots[end].beside[0];
            loop {
                length += self.length(line[line.len() - 1], next);
                let dot = &self.dots[next];
                if dot.hold != Hold::Loose || dot.port || dot.beside.len() != 2 || length >= shortest {
                    break;
                }
                let on = dot.beside.iter().copied().find(|other| !line.contains(other));
                line.push(next);
                let Some(on) = on else { break };
                next = on;
            }
            if length < shortest {
                line.into_iter().for_each(|dot| self.remove(dot));
            }
        }
    }

    /// Cuts edges that are longer than `longest` into equal ones of about `wanted`.
    pub fn split(&mut self, wanted: f64, longest: f64) {
        for [a, b] in self.edges().collect::<Vec<_>>() {
            self.split_edge(a, b, wanted, longest);
        }
    }

    /// Cuts an edge if it is longer than `longest` into equal ones of about `wanted`.
    pub fn split_edge(&mut self, a: usize, b: usize, wanted: f64, longest: f64) {
        let length = self.length(a, b);
        if length <= longest {
            return;
        }
        let count = (length / wanted).round().max(2.0) as usize;
        let (from, to) = (self.dots[a].place, self.dots[b].place);
        self.part(a, b);
        let mut last = a;
        for part in 1..count {
            let dot = self.add(geometry::between(from, to, part as f64 / count as f64), Hold::Loose);
            self.join(last, dot);
            last = dot;
        }
        self.join(last, b);
    }

    /// Lays nodes that are joined nearly along the cells on one line: what is straight in the building becomes straight.
    pub fn align(&mut self, free: &Free, off: f64) {
        for axis in [0, 1] {
            let place = |sketch: &Self, dot: usize| free.to_cells(sketch.dots[dot].place);
            let mut group: Vec<usize> = (0..self.dots.len()).collect();
            fn root(group: &[usize], mut dot: usize) -> usize {
                while group[dot] != dot {
                    dot = group[dot];
                }
                dot
            }
            for [a, b] in self.edges() {
                let (from, to) = (place(self, a), place(self, b));
                let [along, aside] = [1 - axis, axis].map(|axis| (to[axis] - from[axis]).abs());
                if aside <= off && along >= 4.0 * aside {
                    let (a, b) = (root(&group, a), root(&group, b));
                    group[a.max(b)] = a.min(b);
                }
            }
            let mut members = std::collections::BTreeMap::<usize, Vec<usize>>::new();
            for dot in (0..self.dots.len()).filter(|&dot| !self.dots[dot].gone) {
                members.entry(root(&group, dot)).or_default().push(dot);
            }
            for members in members.into_values().filter(|members| members.len() > 1) {
                self.lay(free, &members, axis, off);
            }
        }
    }

    /// Gives nodes the same coordinate along an axis of the cells, if all of their edges stay free.
    fn lay(&mut self, free: &Free, members: &[usize], axis: usize, off: f64) {
        let at = |sketch: &Self, dot: usize| free.to_cells(sketch.dots[dot].place);
        let held: Vec<f64> =
            members.iter().filter(|&&dot| self.dots[dot].hold != Hold::Loose).map(|&dot| at(self, dot)[axis]).collect();
        let all: Vec<f64> = members.iter().map(|&dot| at(self, dot)[axis]).collect();
        let spread = |values: &[f64]| {
            values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b))
                - values.iter().fold(f64::INFINITY, |a, &b| a.min(b))
        };
        let from = if held.is_empty() { &all } else { &held };
        if spread(&all) > 2.0 * off || spread(from) > 1e-6 && !held.is_empty() {
            return;
        }
        let common = from.iter().sum::<f64>() / from.len() as f64;
        let before: Vec<Point> = members.iter().map(|&dot| self.dots[dot].place).collect();
        for &dot in members {
            if self.dots[dot].hold != Hold::Loose {
                continue;
            }
            let mut place = at(self, dot);
            place[axis] = common;
            self.dots[dot].place = free.to_building(place);
        }
        let sees = |&dot: &usize| {
            let here = self.dots[dot].place;
            self.dots[dot].beside.iter().all(|&other| free.sees(here, self.dots[other].place))
        };
        if !members.iter().all(sees) {
            for (&dot, place) in members.iter().zip(before) {
                self.dots[dot].place = place;
            }
        }
    }

    /// Models crossings for those who cut the corner (Graph, 7.1 and figure 7.1): joins the ways that leave a node at about a
    /// right angle, so far from it that the way between them is free. Those of a net have theirs.
    pub fn diagonals(&mut self, free: &Free, least_fork: f64, [nearest, farthest]: [f64; 2], nets: &BTreeSet<usize>) {
        for corner in (0..self.dots.len()).filter(|corner| !nets.contains(corner)) {
            let beside = self.dots[corner].beside.clone();
            for (first, second) in
                beside.iter().enumerate().flat_map(|(i, &a)| beside[i + 1..].iter().map(move |&b| (a, b)))
            {
                // A diagonal before may have cut one of them.
                let arms = [first, second].map(|to| self.arm(corner, to));
                let angle = angle_between(self.along(corner, arms[0]), self.along(corner, arms[1]));
                let in_net = arms.iter().any(|arm| nets.contains(arm));
                if in_net || (angle - 0.5 * PI).abs() > PI / 6.0 || self.dots[arms[0]].beside.contains(&arms[1]) {
                    continue;
                }
                let lengths = arms.map(|arm| self.length(corner, arm));
                if lengths.iter().any(|&length| length < nearest) {
                    continue;
                }
                let place = |arm: usize, length: f64| {
                    let here = self.dots[corner].place;
                    let part = if length > farthest + nearest { farthest / length } else { 1.0 };
                    (part, geometry::between(here, self.dots[arm].place, part))
                };
                let [(part_a, a), (part_b, b)] = [place(arms[0], lengths[0]), place(arms[1], lengths[1])];
                let forks = [(arms[0], part_a, b), (arms[1], part_b, a)];
                let forks = forks.into_iter().any(|(arm, part, to)| part == 1.0 && self.forks(arm, to, least_fork));
                if free.sees(a, b) && !forks {
                    let a = self.cut(corner, arms[0], part_a);
                    let b = self.cut(corner, arms[1], part_b);
                    self.join(a, b);
                }
            }
        }
    }

    /// The node beside `corner` in the direction of `to`, which was beside it.
    fn arm(&self, corner: usize, to: usize) -> usize {
        let beside = &self.dots[corner].beside;
        if beside.contains(&to) {
            return to;
        }
        let along = self.along(corner, to);
        let off = |&other: &usize| angle_between(along, self.along(corner, other));
        beside.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(to)
    }

    /// The node at a part of an edge, made if it is not there.
    pub fn cut(&mut self, from: usize, to: usize, part: f64) -> usize {
        if part >= 1.0 {
            return to;
        }
        let dot = self.add(geometry::between(self.dots[from].place, self.dots[to].place, part), Hold::Loose);
        self.part(from, to);
        self.join(from, dot);
        self.join(dot, to);
        dot
    }
}
