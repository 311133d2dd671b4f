//! A walk on the walk graph, beside the one that is followed by particles: as the graph document's tracker has it, and as the
//! matcher has it.

use super::beside::Followed;
use super::walk::Anchor;
use crate::building::Building;
use crate::building::geometry::wrapped;
use crate::fixes::Outliers;
use crate::follow::sight;
use crate::graph::draw::{self, draw};
use crate::graph::matcher::{self, Matcher};
use crate::graph::tracker::{Decision, Floors, Parameters, Tracker, start};
use crate::graph::{Error, Graph};
use crate::track::Track;
use std::sync::Arc;

/// A shorter step has no direction. **Units:** m.
const SHORTEST_M: f64 = 0.1;
/// How well the place and the direction are known with which the matcher begins. **Units:** m, rad.
const START_SIGMA: (f64, f64) = (0.5, 0.2);

/// The walk graph of a building.
#[derive(Debug)]
pub struct OnGraph {
    graph: Arc<Graph>,
    building: Arc<Building>,
    /// Lengths of steps are measured, not guessed.
    measured: bool,
    documented: Option<Documented>,
    matched: Option<Matched>,
}

/// What became of a walk on it.
#[derive(Clone, Debug, Default)]
pub struct Way {
    /// Where it led. **Units:** m; **Frame:** building.
    pub places: Vec<[f64; 3]>,
    /// What was decided at the last step.
    pub last: Option<Decision>,
}

/// The document's tracker in the middle of a walk, which goes on with the next step.
#[derive(Debug)]
struct Documented {
    anchor: Anchor,
    epoch: usize,
    /// Strides that were taken in, and the direction of the last that had one. **Units:** rad.
    strides: usize,
    heading: f64,
    tracker: Tracker<Arc<Graph>>,
    way: Way,
}

/// The matcher in the middle of a walk, which goes on with the next step.
#[derive(Debug)]
struct Matched {
    anchor: Anchor,
    epoch: usize,
    /// Steps and positions that were taken in.
    steps: usize,
    positions: usize,
    matcher: Matcher<Arc<Graph>>,
    places: Vec<[f64; 3]>,
}

impl OnGraph {
    /// The graph of the building's file; it is drawn if there is none, which takes its time in a large building.
    ///
    /// # Errors
    /// As [`Graph::of`].
    pub fn of(building: &Building, measured: bool) -> Result<Self, Error> {
        let mut building = building.clone();
        if building.graph.is_none() {
            building.graph = Some(draw(&building, &draw::Parameters::default()));
        }
        let (graph, building) = (Arc::new(Graph::of(&building)?), Arc::new(building));
        Ok(Self { graph, building, measured, documented: None, matched: None })
    }

    /// Follows a track as the document does, from where its place and direction became known. Of a walk that has only become
    /// longer the new steps alone are looked at. `epoch` is another number whenever it is another walk.
    pub fn documented(&mut self, track: &Track, anchor: &Anchor, epoch: usize) -> Way {
        let goes_on = |run: &Documented| {
            run.anchor == *anchor && run.epoch == epoch && anchor.since + run.strides < track.stances.len()
        };
        let run = self.documented.take().filter(goes_on).or_else(|| self.documented_anew(track, anchor, epoch));
        let Some(mut run) = run else { return Way::default() };
        for stride in strides(track, anchor, run.strides) {
            run.strides += 1;
            let (length, direction) = along(&stride);
            if length <= SHORTEST_M {
                continue;
            }
            let decision = run.tracker.step(wrapped(direction - run.heading), length, stride.1[2] - stride.0[2]);
            run.heading = direction;
            let [x, y] = decision.place;
            run.way.places.push([x, y, self.height(&decision)]);
            run.way.last = Some(decision);
        }
        let way = run.way.clone();
        self.documented = Some(run);
        way
    }

    fn documented_anew(&self, track: &Track, anchor: &Anchor, epoch: usize) -> Option<Documented> {
        let (place, heading) = first(track, anchor)?;
        let (edge, along_m) = start(&self.graph, anchor.floor, [place[0], place[1]], heading)?;
        let documented = Parameters::documented();
        let parameters = if self.measured { Parameters { step_m: 0.0, ..documented } } else { documented };
        let mut tracker = Tracker::new(self.graph.clone(), &parameters, edge, along_m);
        if let Some(floors) = Floors::new(&self.building, anchor.floor) {
            tracker = tracker.with_barometer(floors);
        }
        Some(Documented { anchor: *anchor, epoch, strides: 0, heading, tracker, way: Way::default() })
    }

    fn height(&self, decision: &Decision) -> f64 {
        let edge = self.graph.edge(decision.edge);
        let share = if edge.length_m > 0.0 { (decision.along_m / edge.length_m).clamp(0.0, 1.0) } else { 0.0 };
        self.graph.node(edge.from).height_m + share * edge.rise_m
    }

    /// Follows with several hypotheses from there: where the likeliest led, and what is known of it. Of a walk that has only
    /// become longer the new steps alone are looked at.
    pub fn matched(&mut self, of: &Followed<'_>, anchor: &Anchor, epoch: usize) -> (Vec<[f64; 3]>, String) {
        let waits = || (Vec::new(), "waits for a step".to_owned());
        // The one that led to the place where it begins is made.
        let steps = of.steps.steps.get(anchor.since + 1..).unwrap_or_default();
        let goes_on = |run: &Matched| run.anchor == *anchor && run.epoch == epoch && run.steps <= steps.len();
        let mut run = match self.matched.take().filter(goes_on) {
            Some(run) => run,
            None => match self.begun(of.steps, anchor, epoch) {
                Some(run) => run,
                None => return waits(),
            },
        };
        let observed = of.fusion.map_or(&[][..], |fusion| fusion.counted());
        let begun = of.steps.steps.get(anchor.since).map(|step| step.index);
        for step in &steps[run.steps..] {
            run.steps += 1;
            while let Some((before, observation)) = observed.get(run.positions)
                && *before < Some(step.index)
            {
                run.positions += 1;
                // What was heard before is in where it begins.
                if *before > begun {
                    run.matcher.sight(&sight(observation, &Outliers::default()), observation.time);
                }
            }
            let place = run.matcher.step(step).place();
            run.places.extend(place.map(|place| [place.position[0], place.position[1], place.height_m]));
        }
        let said = (run.places.clone(), run.matcher.estimate().to_string());
        self.matched = Some(run);
        said
    }

    fn begun(&self, track: &Track, anchor: &Anchor, epoch: usize) -> Option<Matched> {
        let (place, heading) = first(track, anchor)?;
        let parameters = if self.measured { matcher::Parameters::default() } else { matcher::Parameters::phone() };
        let place = matcher::Place {
            floor: anchor.floor,
            place: [place[0], place[1]],
            sigma_m: START_SIGMA.0,
            heading: Some((heading, START_SIGMA.1)),
        };
        let matcher = Matcher::new(self.graph.clone(), &parameters, &matcher::Start::At(vec![place])).ok()?;
        Some(Matched {
            anchor: *anchor,
            epoch,
            steps: 0,
            positions: 0,
            matcher: matcher.with_heights(),
            places: Vec::new(),
        })
    }
}

/// From one stance to the next, in the building, after so many of them. **Units:** m.
fn strides<'a>(
    track: &'a Track,
    anchor: &Anchor,
    after: usize,
) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + use<'a> {
    let anchor = *anchor;
    let stances = track.stances.get(anchor.since + after..).unwrap_or_default();
    stances.windows(2).map(move |pair| (anchor.apply(pair[0].position), anchor.apply(pair[1].position)))
}

/// Length and direction. **Units:** m, rad.
fn along((from, to): &([f64; 3], [f64; 3])) -> (f64, f64) {
    let [x, y] = [0, 1].map(|axis| to[axis] - from[axis]);
    (x.hypot(y), y.atan2(x))
}

/// Where the first stride that has a direction begins, and that.
fn first(track: &Track, anchor: &Anchor) -> Option<([f64; 3], f64)> {
    strides(track, anchor, 0).find(|stride| along(stride).0 > SHORTEST_M).map(|stride| (stride.0, along(&stride).1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;
    use crate::evaluation::building::walk::{Walk, Walker};
    use crate::fixes::{Fusion, smoother};
    use crate::simulation::Person;
    use crate::track::Stance;
    use nalgebra::Vector3;
    use sohle_shared::time::Micros;

    #[test]
    fn a_walk_along_a_corridor_stays_on_its_edges() {
        let building = generate::twin(2);
        let mut on = OnGraph::of(&building, true).unwrap();
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
        let way = on.documented(&track, &anchor, 1);
        assert_eq!(way.places.len(), 7);
        let [x, y, z] = way.places[6];
        // From the third stance, at 5.4 m, seven steps; the tracker puts somebody beside an edge onto it.
        assert!((x - 13.8).abs() < 1.5 && (y - 7.5).abs() < 1.0 && z == 0.0, "{x} {y} {z}");
        let last = way.last.unwrap();
        assert!(last.delta.abs() < 0.3 && matches!(last.case.number(), Some(1 | 4)), "{last}");
        assert!(on.documented(&Track::default(), &anchor, 1).places.is_empty());
    }

    fn of<'a>(steps: &'a Track, fusion: Option<&'a Fusion>) -> Followed<'a> {
        Followed { steps, follower: None, anchor: None, fusion }
    }

    #[test]
    fn both_go_on_with_the_next_step_as_if_they_had_begun_anew() {
        let building = generate::twin(2);
        let walk =
            Walk::through(&building, &["W02", "hall", "E03"], &Walker { person: Person::default(), seed: 3 }).unwrap();
        let whole = Track::of_steps(&walk.steps);
        // The walk begins at its first true place, in the direction of its first true stride.
        let anchor = |track: &Track| {
            let [from, to] = [0, 1].map(|index| walk.truth[index]);
            let direction = |by: [f64; 2]| by[1].atan2(by[0]);
            let [first, second] = [0, 1].map(|index| track.stances[index].position);
            let stepped = direction([second[0] - first[0], second[1] - first[1]]);
            let yaw = direction([to.x - from.x, to.y - from.y]) - stepped;
            let laid = Anchor { yaw, shift: Vector3::zeros(), floor: 0, since: 0 }.apply(first);
            Anchor { yaw, shift: from - Vector3::from(laid), floor: 0, since: 0 }
        };
        let anchor = anchor(&whole);
        let mut fusion = Fusion::new(Some(&building), &smoother::Parameters::default()).unwrap();
        let mut piecewise = OnGraph::of(&building, true).unwrap();
        for count in [5, 6, 20, walk.steps.len()] {
            let part = Track::of_steps(&walk.steps[..count]);
            piecewise.matched(&of(&part, Some(&fusion)), &anchor, 1);
            piecewise.documented(&part, &anchor, 1);
        }
        let documented = |on: &mut OnGraph, epoch| {
            let way = on.documented(&whole, &anchor, epoch);
            (way.places, way.last.map(|last| last.to_string()))
        };
        let found = documented(&mut piecewise, 1);
        assert!(found.0.len() > 20 && found == documented(&mut OnGraph::of(&building, true).unwrap(), 7));
        let at_once = |epoch| {
            let mut on = OnGraph::of(&building, true).unwrap();
            on.matched(&of(&whole, None), &anchor, epoch)
        };
        let (places, said) = piecewise.matched(&of(&whole, Some(&fusion)), &anchor, 1);
        assert_eq!((&places, &said), (&at_once(7).0, &at_once(7).1));
        let (last, truth) = (Vector3::from(*places.last().unwrap()), walk.truth.last().unwrap());
        assert!((last - truth).xy().norm() < 1.5 && said.contains("hypotheses"), "{last} {truth} {said}");
        // Another walk begins anew, and positions are heard.
        walk.steps[..5].iter().for_each(|step| fusion.step(step));
        let (time, truth) = (walk.steps[4].stance_end.0, walk.truth[4]);
        let line = format!(r#"{{"time_us":{time},"position":[{},{}],"sigma_m":0.2}}"#, truth.x + 0.5, truth.y);
        let fix = fusion.line(&line, crate::fixes::line::Clock::default()).unwrap();
        fusion.take(&fix).unwrap();
        assert!(fusion.hear(Micros::from_seconds(1e4)).is_some());
        assert_ne!(piecewise.matched(&of(&whole, Some(&fusion)), &anchor, 2).0, places);
    }
}
