//! Walks of a phone through the rooms of a building, and all that the methods need of it.

use crate::building::route::{Manner, Piece, Planner};
use crate::building::{Building, ConnectorKind, Error, geometry};
use crate::graph::Graph;
use crate::graph::draw::{self, draw};
use crate::particle::Map;
use crate::simulation::phone::{Noise, PhoneWalk};
use crate::simulation::random::{Purpose, Random};
use rayon::prelude::*;
use std::sync::Arc;

/// How long walks take: from the shortest to the longest, spread evenly. **Units:** s.
const SECONDS: [f64; 2] = [180.0, 960.0];
/// A leg of a walk is given up after so many rooms to which nothing leads.
const TRIES: usize = 20;
/// About how fast the phone's person goes. **Units:** m/s.
const PACE_M_S: f64 = 1.2;
/// Of the ways to another floor this part is by elevator, where there is one.
const BY_ELEVATOR: f64 = 0.25;

/// A building with what the methods need of it.
#[derive(Clone, Debug)]
pub struct Site {
    /// Name for tables.
    pub name: &'static str,
    /// With its drawn graph.
    pub building: Building,
    /// The same, to walk on.
    pub graph: Graph,
    /// The same, for the particle filter.
    pub map: Arc<Map>,
}

impl Site {
    /// A building, whose graph is drawn.
    ///
    /// # Errors
    /// When the building is of no use.
    pub fn of(name: &'static str, mut building: Building) -> Result<Self, super::suite::Error> {
        building.graph = Some(draw(&building, &draw::Parameters::default()));
        Ok(Self { name, graph: Graph::of(&building)?, map: Arc::new(Map::of(&building)?), building })
    }
}

/// So many walks through a building; half of the ways change the floor.
///
/// # Errors
/// When the building has no rooms that one can walk between.
pub fn random_walks(site: &Site, count: usize, seed: u64, done: impl Fn() + Sync) -> Result<Vec<PhoneWalk>, Error> {
    let planner = Planner::with(&site.building, Manner::Middle);
    let walk = |index: usize| {
        let seed = seed.wrapping_mul(10_000).wrapping_add(index as u64);
        let part = (index as f64 + 0.5) / count as f64;
        let seconds = SECONDS[0] + part * (SECONDS[1] - SECONDS[0]);
        let pieces = pieces(&site.building, &planner, seconds, seed)?;
        let walk = PhoneWalk::along(&site.building, &pieces, &Noise::default(), seed)?;
        done();
        Ok(walk)
    };
    (0..count).into_par_iter().map(walk).collect()
}

/// A way from room to room that takes about so long. **Units:** s.
fn pieces(building: &Building, planner: &Planner<'_>, seconds: f64, seed: u64) -> Result<Vec<Piece>, Error> {
    let mut random = Random::new(seed, Purpose::Route);
    let mut pick = move |count: usize| ((random.unit() * count as f64) as usize).min(count.saturating_sub(1));
    let room = |floor: usize, number: usize| building.floors[floor].rooms.get(number).map(|room| room.name.clone());
    let mut floor = pick(building.floors.len());
    let mut here = room(floor, pick(building.floors[floor].rooms.len()));
    let (mut all, mut length_m, mut tried) = (Vec::new(), 0.0, 0);
    while length_m < seconds * PACE_M_S {
        let next_floor = if pick(2) == 0 { floor } else { pick(building.floors.len()) };
        let next = room(next_floor, pick(building.floors[next_floor].rooms.len()));
        let wanted =
            if (pick(1_000) as f64) < 1e3 * BY_ELEVATOR { ConnectorKind::Elevator } else { ConnectorKind::Stairs };
        let numbers = [floor, next_floor].map(|floor| building.floors[floor].number);
        let joins = |kind: Option<ConnectorKind>| -> Vec<&str> {
            let fitting = building.connectors.iter().filter(|connector| {
                kind.is_none_or(|kind| kind == connector.kind)
                    && numbers.iter().all(|number| connector.outlines.iter().any(|(floor, _)| floor == number))
            });
            fitting.map(|connector| connector.name.as_str()).collect()
        };
        let mut through = joins(Some(wanted));
        if through.is_empty() {
            through = joins(None);
        }
        let through = through.get(pick(through.len())).copied();
        let stops = match (&here, &next) {
            (Some(here), Some(next)) if floor != next_floor => {
                through.map(|through| vec![here.as_str(), through, next.as_str()])
            }
            (Some(here), Some(next)) if here != next => Some(vec![here.as_str(), next.as_str()]),
            _ => None,
        };
        match stops.map(|stops| planner.plan(&stops)) {
            Some(Ok(found)) => {
                length_m += found.iter().map(length).sum::<f64>();
                all.extend(found);
                (floor, here, tried) = (next_floor, next, 0);
            }
            // A shaft, or the room where one is.
            _ => {
                tried += 1;
                if tried > TRIES && all.is_empty() {
                    here = next;
                    floor = next_floor;
                }
                if tried > 10 * TRIES {
                    return Err(Error::Model(format!("the rooms of '{}' are not joined", building.name)));
                }
            }
        }
    }
    Ok(all)
}

fn length(piece: &Piece) -> f64 {
    match piece {
        Piece::Walk { points, .. } => points.windows(2).map(|pair| geometry::distance(pair[0], pair[1])).sum(),
        Piece::Climb { points, .. } => {
            points.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum()
        }
        Piece::Ride { .. } => 0.0,
    }
}
