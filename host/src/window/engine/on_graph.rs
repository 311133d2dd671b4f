//! The walk as the graph document's tracker has it, beside the one that is followed by particles.

use super::walk::Anchor;
use crate::building::Building;
use crate::building::geometry::wrapped;
use crate::graph::draw::{self, draw};
use crate::graph::tracker::{Decision, Floors, Parameters, Tracker, start};
use crate::graph::{Error, Graph};
use crate::track::Track;
use std::sync::Arc;

/// A shorter step has no direction. **Units:** m.
const SHORTEST_M: f64 = 0.1;

/// The walk graph of a building.
#[derive(Clone, Debug)]
pub struct OnGraph {
    graph: Arc<Graph>,
    building: Arc<Building>,
}

/// What became of a walk on it.
#[derive(Clone, Debug, Default)]
pub struct Way {
    /// Where it led. **Units:** m; **Frame:** building.
    pub places: Vec<[f64; 3]>,
    /// What was decided at the last step.
    pub last: Option<Decision>,
}

impl OnGraph {
    /// The graph of the building's file; it is drawn if there is none, which takes its time in a large building.
    ///
    /// # Errors
    /// As [`Graph::of`].
    pub fn of(building: &Building) -> Result<Self, Error> {
        let mut building = building.clone();
        if building.graph.is_none() {
            building.graph = Some(draw(&building, &draw::Parameters::default()));
        }
        Ok(Self { graph: Arc::new(Graph::of(&building)?), building: Arc::new(building) })
    }

    /// Follows a track from where its place and direction became known. `measured`: lengths of steps are measured, not
    /// guessed.
    pub fn follow(&self, track: &Track, anchor: &Anchor, measured: bool) -> Way {
        let stances = track.stances.get(anchor.since..).unwrap_or_default();
        let strides: Vec<([f64; 3], [f64; 3])> =
            stances.windows(2).map(|pair| (anchor.apply(pair[0].position), anchor.apply(pair[1].position))).collect();
        let along = |(from, to): &([f64; 3], [f64; 3])| {
            let [x, y] = [0, 1].map(|axis| to[axis] - from[axis]);
            (x.hypot(y), y.atan2(x))
        };
        let first = strides.iter().find(|stride| along(stride).0 > SHORTEST_M);
        let begun = first.and_then(|stride| {
            let mut heading = along(stride).1;
            let (edge, along_m) = start(&self.graph, anchor.floor, [stride.0[0], stride.0[1]], heading)?;
            let documented = Parameters::documented();
            let parameters = if measured { Parameters { step_m: 0.0, ..documented } } else { documented };
            let mut tracker = Tracker::new(&self.graph, &parameters, edge, along_m);
            if let Some(floors) = Floors::new(&self.building, anchor.floor) {
                tracker = tracker.with_barometer(floors);
            }
            let mut way = Way::default();
            for stride in &strides {
                let (length, direction) = along(stride);
                if length <= SHORTEST_M {
                    continue;
                }
                let decision = tracker.step(wrapped(direction - heading), length, stride.1[2] - stride.0[2]);
                heading = direction;
                let [x, y] = decision.place;
                way.places.push([x, y, self.height(&decision)]);
                way.last = Some(decision);
            }
            Some(way)
        });
        begun.unwrap_or_default()
    }

    fn height(&self, decision: &Decision) -> f64 {
        let edge = self.graph.edge(decision.edge);
        let share = if edge.length_m > 0.0 { (decision.along_m / edge.length_m).clamp(0.0, 1.0) } else { 0.0 };
        self.graph.node(edge.from).height_m + share * edge.rise_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;
    use crate::track::Stance;
    use nalgebra::Vector3;
    use sohle_shared::time::Micros;

    #[test]
    fn a_walk_along_a_corridor_stays_on_its_edges() {
        let building = generate::twin(2);
        let on = OnGraph::of(&building).unwrap();
        // The corridor of the twin leads east at y = 7.5; the steps know nothing of that.
        let stance = |index: i32| Stance {
            start: Micros(0),
            end: Micros(0),
            position: [0.0, f64::from(index) * 1.2, 0.0],
            heading: 0.0,
        };
        let track = Track { stances: (0..10).map(stance).collect(), ..Track::default() };
        let anchor =
            Anchor { yaw: -std::f64::consts::FRAC_PI_2, shift: Vector3::new(3.0, 7.2, 0.0), floor: 0, since: 2 };
        let way = on.follow(&track, &anchor, true);
        assert_eq!(way.places.len(), 7);
        let [x, y, z] = way.places[6];
        // From the third stance, at 5.4 m, seven steps; the tracker puts somebody beside an edge onto it.
        assert!((x - 13.8).abs() < 1.5 && (y - 7.5).abs() < 1.0 && z == 0.0, "{x} {y} {z}");
        let last = way.last.unwrap();
        assert!(last.delta.abs() < 0.3 && matches!(last.case.number(), Some(1 | 4)), "{last}");
        assert!(on.follow(&Track::default(), &anchor, true).places.is_empty());
    }
}
