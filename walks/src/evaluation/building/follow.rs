//! The particle filter on one walk, compared with the truth.

use super::walk::Walk;
use crate::particle::{Error, Map, Parameters, ParticleFilter, Start, State};
use nalgebra::Vector3;
use sohle_shared::step::Step;
use std::sync::Arc;

/// What the filter said after one step, compared with the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// Seconds since the first step.
    pub seconds: f64,
    /// What it knew.
    pub state: State,
    /// Distance of the likeliest place to the truth in the plane. **Units:** m.
    pub error_m: f64,
    /// Whether its floor is that of the truth; between floors, both are.
    pub floor_right: bool,
    /// What it gave to the likeliest room, and whether the truth is there.
    pub room: (f64, bool),
    /// Number of places that it thought possible.
    pub clusters: usize,
    /// Number of particles.
    pub particles: usize,
}

/// A walk that was followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// One for each step.
    pub said: Vec<Said>,
    /// Distance of the corrected past to the truth in the plane, for the steps that are remembered. **Units:** m.
    pub corrected_m: Vec<f64>,
}

/// Heights within this of a floor belong to it alone. **Units:** m.
const ON_FLOOR_M: f64 = 0.6;

/// Follows steps whose true ends are known.
///
/// # Errors
/// As [`ParticleFilter::new`].
pub fn follow(
    map: &Arc<Map>,
    parameters: &Parameters,
    start: &Start,
    (steps, truth): (&[Step], &[Vector3<f64>]),
    seed: u64,
) -> Result<Followed, Error> {
    let mut filter = ParticleFilter::new(map.clone(), parameters, start, seed)?;
    let first = steps.first().map_or(0, |step| step.stance_end.0);
    let mut said = Vec::with_capacity(steps.len());
    for (step, truth) in steps.iter().zip(truth) {
        let estimate = filter.step(step);
        let place = estimate.place();
        let error_m = place.map_or(f64::INFINITY, |place| (place.position - truth).xy().norm());
        let heights = map.floors();
        let near: Vec<i32> = heights
            .filter(|(_, height)| (truth.z - f64::from(*height)).abs() < ON_FLOOR_M)
            .map(|(floor, _)| floor)
            .collect();
        let floor_right = place.is_some_and(|place| near.is_empty() || near.contains(&place.floor));
        let room = estimate.rooms.first().map_or((0.0, false), |first| {
            let floor = map.floor(first.floor).unwrap_or_default();
            let there = map.room(floor, [truth.x as f32, truth.y as f32]);
            (first.probability, there == first.room && (near.is_empty() || near.contains(&first.floor)))
        });
        said.push(Said {
            seconds: (step.stance_end.0 - first) as f64 * 1e-6,
            state: estimate.state,
            error_m,
            floor_right,
            room,
            clusters: estimate.clusters.len(),
            particles: estimate.particles,
        });
    }
    let place_of = |index: u32| steps.iter().position(|step| step.index == index).map(|at| truth[at]);
    let corrected_m = filter
        .past()
        .iter()
        .filter_map(|past| Some((Vector3::from(past.position) - place_of(past.step)?).xy().norm()))
        .collect();
    Ok(Followed { said, corrected_m })
}

/// Way that shows the heading of the start. **Units:** m.
const FIRST_LEG_M: f64 = 4.0;

/// The same by the steps alone, with start and heading given (Foot, 7.3): distances to the truth in the plane. The heading is
/// that of the first few metres, since how the sensor sits on the foot is not known. **Units:** m.
pub fn dead_reckoned(walk: &Walk) -> Vec<f64> {
    let Some(&start) = walk.truth.first() else { return Vec::new() };
    let mut places = vec![Vector3::zeros()];
    let (mut place, mut heading) = (Vector3::zeros(), 0.0_f64);
    for step in walk.steps.iter().skip(1) {
        let (sin, cos) = heading.sin_cos();
        let moved = step.displacement.map(f64::from);
        place += Vector3::new(cos * moved.x - sin * moved.y, sin * moved.x + cos * moved.y, moved.z);
        heading += f64::from(step.turn);
        places.push(place);
    }
    let far = places.iter().position(|place| place.xy().norm() > FIRST_LEG_M).unwrap_or_default();
    let direction = |to: Vector3<f64>| to.y.atan2(to.x);
    let (sin, cos) = (direction(walk.truth[far] - start) - direction(places[far])).sin_cos();
    let turned =
        |place: &Vector3<f64>| Vector3::new(cos * place.x - sin * place.y, sin * place.x + cos * place.y, place.z);
    places.iter().zip(&walk.truth).map(|(place, truth)| (start + turned(place) - truth).xy().norm()).collect()
}

impl Followed {
    /// When it first said that it knew, in seconds.
    pub fn located_s(&self) -> Option<f64> {
        self.said.iter().find(|said| said.state == State::Located).map(|said| said.seconds)
    }

    /// Errors of all moments at which it said that it knew. **Units:** m.
    pub fn located_errors(&self) -> Vec<f64> {
        self.said.iter().filter(|said| said.state == State::Located).map(|said| said.error_m).collect()
    }
}
