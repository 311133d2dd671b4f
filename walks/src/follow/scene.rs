//! What viewers show of somebody who is followed.

use super::{Follower, Said};
use crate::building::{Building, ConnectorKind, geometry};
use crate::recording::scene::{Lines, Moment, Pose};
use sohle_shared::time::Micros;

/// More particles are not shown of one moment.
const MOST_SHOWN: usize = 1_000;

/// The plan of all floors as lines.
pub fn building(building: &Building) -> Vec<Lines> {
    let lift = |[x, y]: [f64; 2], z: f64| [x, y, z];
    let mut walls = Lines { name: "walls", colour: [0.13, 0.14, 0.16, 1.0], width: 0.1, segments: Vec::new() };
    let mut doors = Lines { name: "doors", colour: [0.23, 0.61, 0.34, 1.0], width: 0.06, segments: Vec::new() };
    let mut stairs = Lines { name: "stairs", colour: [0.71, 0.54, 0.17, 1.0], width: 0.05, segments: Vec::new() };
    let mut elevators = Lines { name: "elevators", colour: [0.2, 0.6, 0.6, 1.0], width: 0.05, segments: Vec::new() };
    for floor in &building.floors {
        let raised = |segment: &[[f64; 2]; 2]| segment.map(|point| lift(point, floor.height_m));
        walls.segments.extend(floor.walls.iter().map(raised));
        doors.segments.extend(floor.doors.iter().map(|door| raised(&door.line)));
        for connector in &building.connectors {
            let elevator = connector.kind == ConnectorKind::Elevator;
            let lines = if elevator { &mut elevators } else { &mut stairs };
            let here = connector.outlines.iter().filter(|(number, _)| *number == floor.number);
            lines.segments.extend(here.flat_map(|(_, outline)| geometry::sides(outline)).map(|side| raised(&side)));
        }
    }
    stairs.segments.extend(
        building.connectors.iter().flat_map(|connector| connector.way.windows(2).map(|pair| [pair[0], pair[1]])),
    );
    [walls, doors, stairs, elevators].into_iter().filter(|lines| !lines.segments.is_empty()).collect()
}

/// What was said after a step, with some of the particles. `line` is its JSON.
pub fn moment(follower: &Follower, said: &Said, line: String) -> Moment {
    let particles = follower.particles();
    let every = particles.len().div_ceil(MOST_SHOWN).max(1);
    Moment {
        time: said.estimate.time.unwrap_or(Micros(0)),
        place: said.estimate.place().map(|cluster| Pose {
            position: cluster.position.into(),
            covariance: cluster.covariance,
            heading: cluster.heading,
            // Of a normal distribution wrapped around the circle, whose mean direction has this length.
            heading_variance: -2.0 * cluster.heading_agreement.clamp(1e-9, 1.0).ln(),
        }),
        particles: particles.iter().step_by(every).map(|particle| [particle.x, particle.y, particle.z]).collect(),
        line,
    }
}
