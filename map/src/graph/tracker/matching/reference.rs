//! The steps since the last turns, put end to end without the graph.

use super::Thresholds;
use crate::building::geometry::{Point, between, distance};
use crate::graph::NodeId;

/// A shorter step has no direction, and adds nothing to a track. **Units:** m.
const SHORTEST_M: f64 = 1e-3;

/// A turn onto a new edge, from which the steps can be put end to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Where the new edge begins.
    pub node: NodeId,
    /// Where that is. **Units:** m; **Frame:** building.
    pub place: Point,
    /// Where somebody was once the turn was carried out. **Units:** m; **Frame:** building.
    pub entry: Point,
    /// The direction of the edge then. **Units:** rad; **Frame:** building.
    pub heading: f64,
}

/// A measured step.
#[derive(Clone, Copy, Debug)]
struct Measured {
    /// How the heading has changed. **Units:** rad.
    turn: f64,
    length_m: f64,
}

/// What is remembered for a search by map matching: the last turns, and the steps since.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// The turns, the oldest first, and how many steps were made before each.
    turns: Vec<(Turn, usize)>,
    steps: Vec<Measured>,
}

/// The track to which routes are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Where it begins.
    pub node: NodeId,
    /// From there on a point after each step. **Units:** m; **Frame:** building.
    pub points: Vec<Point>,
    /// **Units:** m.
    pub length_m: f64,
    /// Between the leftmost and the rightmost of its directions. **Units:** rad.
    pub bend: f64,
}

impl History {
    /// Begins at a turn: what was before leads nowhere.
    pub fn begin(turn: Turn) -> Self {
        Self { turns: vec![(turn, 0)], steps: Vec::new() }
    }

    /// A step. **Units:** rad, m.
    pub fn step(&mut self, turn: f64, length_m: f64) {
        self.steps.push(Measured { turn, length_m });
    }

    /// A turn was carried out with the last step. One at the node of the last corrects it.
    pub fn turned(&mut self, turn: Turn, thresholds: &Thresholds) {
        if self.turns.len() > 1 && self.turns.last().is_some_and(|(last, _)| last.node == turn.node) {
            self.turns.pop();
        }
        self.turns.push((turn, self.steps.len()));
        // Older turns than the last that is far enough back are never asked for.
        while self.turns.len() > 1 && self.reference(1).is_some_and(|reference| reference.is_enough(thresholds)) {
            self.turns.remove(0);
            let before = self.turns[0].1;
            self.steps.drain(..before);
            for (_, count) in &mut self.turns {
                *count -= before;
            }
        }
    }

    /// The track from the last turn that is far enough back and has a turn after it; else from the first.
    pub fn track(&self, thresholds: &Thresholds) -> Option<Reference> {
        let enough = (1..self.turns.len()).rev().filter_map(|number| self.reference(number));
        enough.into_iter().find(|reference| reference.is_enough(thresholds)).or_else(|| self.reference(0))
    }

    fn reference(&self, number: usize) -> Option<Reference> {
        let &(Turn { node, place, entry, heading }, before) = self.turns.get(number)?;
        let steps = self.steps.get(before..).unwrap_or_default();
        let mut points = vec![place];
        // The way onto the new edge was made with several steps.
        let way = distance(place, entry);
        let step = steps.iter().map(|step| step.length_m).fold(0.0, f64::max);
        if way >= SHORTEST_M {
            let count = if step >= SHORTEST_M { (way / step).round().max(1.0) as usize } else { 1 };
            points.extend((1..=count).map(|k| between(place, entry, k as f64 / count as f64)));
        }
        let ([mut x, mut y], mut turned) = (entry, 0.0);
        let (mut length_m, mut least, mut greatest) = (way, 0.0_f64, 0.0_f64);
        for step in steps {
            turned += step.turn;
            if step.length_m < SHORTEST_M {
                continue;
            }
            (least, greatest) = (least.min(turned), greatest.max(turned));
            let (sin, cos) = (heading + turned).sin_cos();
            (x, y) = (x + step.length_m * cos, y + step.length_m * sin);
            length_m += step.length_m;
            points.push([x, y]);
        }
        Some(Reference { node, points, length_m, bend: greatest - least })
    }
}

impl Reference {
    /// Whether it is long enough and holds a turn.
    fn is_enough(&self, thresholds: &Thresholds) -> bool {
        self.is_long(thresholds) && self.is_bent(thresholds)
    }

    pub(super) fn is_long(&self, thresholds: &Thresholds) -> bool {
        self.length_m > thresholds.shortest_m
    }

    pub(super) fn is_bent(&self, thresholds: &Thresholds) -> bool {
        self.bend >= thresholds.turn_deg.to_radians()
    }
}
