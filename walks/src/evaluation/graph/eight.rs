//! The same comparison on a recorded walk with surveyed way-points.

use super::follow::{Method, START_SIGMA_M, Settings};
use super::suite::Error;
use crate::building::Building;
use crate::evaluation::phone::path::Path;
use crate::evaluation::phone::walk::PhoneWalk;
use crate::graph::draw::{self, draw};
use crate::graph::matcher::{self, Matcher};
use crate::graph::tracker::{self, SearchBy, Tracker};
use crate::graph::{self, Graph};
use crate::particle::{self, ParticleFilter};
use crate::phone;
use sohle_shared::step::Step;

/// How well the direction of the first leg tells that of the first step. **Units:** rad.
const START_HEADING_SIGMA: f64 = 0.2;

/// A line of the table.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// The method.
    pub method: &'static str,
    /// How long steps were: the document's length or the measured one.
    pub steps: &'static str,
    /// Root mean square distance to the way-points. **Units:** m.
    pub rmse_m: f64,
    /// The largest. **Units:** m.
    pub worst_m: f64,
}

/// The walk with its graph.
#[derive(Clone, Debug)]
pub struct Comparison<'a> {
    walk: &'a PhoneWalk,
    building: Building,
    graph: Graph,
    /// Of the document's length, and of the measured one.
    steps: [Vec<Step>; 2],
}

/// The document's length of the steps.
pub const DOCUMENTED: usize = 0;
/// The measured one.
pub const MEASURED: usize = 1;
/// Their names.
const LENGTHS: [&str; 2] = ["documented", "measured"];

impl<'a> Comparison<'a> {
    /// Draws the graph and finds the steps.
    ///
    /// # Errors
    /// When the graph is of no use.
    pub fn of(walk: &'a PhoneWalk) -> Result<Self, Error> {
        let mut building = walk.building.clone();
        building.graph = Some(draw(&building, &draw::Parameters::default()));
        let settings = [phone::Parameters::documented(), phone::Parameters::default()];
        Ok(Self {
            walk,
            graph: Graph::of(&building)?,
            building,
            steps: settings.map(|settings| phone::steps(&walk.samples, &settings)),
        })
    }

    /// All methods.
    ///
    /// # Errors
    /// When a method refuses.
    pub fn rows(&self, settings: &Settings) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::new();
        for (length, method) in [
            (DOCUMENTED, Method::DeadReckoning),
            (MEASURED, Method::DeadReckoning),
            (DOCUMENTED, Method::Documented),
            (DOCUMENTED, Method::DocumentedMatching),
            (DOCUMENTED, Method::Matcher),
            (MEASURED, Method::Matcher),
            (MEASURED, Method::Particles),
        ] {
            if let Some(path) = self.path(method, length, settings)? {
                rows.push(self.row(method, LENGTHS[length], &path));
            }
        }
        Ok(rows)
    }

    fn row(&self, method: Method, steps: &'static str, path: &Path) -> Row {
        let errors = path.errors(&self.walk.way_points);
        Row {
            method: method.word(),
            steps,
            rmse_m: crate::evaluation::phone::path::rms(&errors).unwrap_or_default(),
            worst_m: errors.into_iter().fold(0.0, f64::max),
        }
    }

    /// The floor of the walk with its drawn graph.
    pub fn building(&self) -> &Building {
        &self.building
    }

    /// The path of a method with steps of a length, [`DOCUMENTED`] or [`MEASURED`]; nothing of a walk without a first leg.
    ///
    /// # Errors
    /// When the method refuses.
    pub fn path(&self, method: Method, length: usize, settings: &Settings) -> Result<Option<Path>, Error> {
        let steps = &self.steps[length];
        let reckoned = Path::of(steps);
        let Some((laid, heading)) = reckoned.on_first_leg(&self.walk.way_points) else { return Ok(None) };
        let place = self.walk.way_points[0].place;
        let floor = self.walk.floor;
        let mut path = Path::default();
        // What comes before the first way-point is not judged.
        match method {
            Method::DeadReckoning => return Ok(Some(laid)),
            Method::Documented | Method::DocumentedBarometer | Method::DocumentedMatching => {
                let (edge, along_m) =
                    tracker::start(&self.graph, floor, place, heading).ok_or(graph::Error::NoFloor(floor))?;
                let mut parameters = tracker::Parameters::documented();
                if method == Method::DocumentedMatching {
                    parameters.search = SearchBy::MapMatching;
                }
                let mut tracker = Tracker::new(&self.graph, &parameters, edge, along_m);
                for step in steps {
                    let decision = tracker.step(f64::from(step.turn), f64::from(step.length()), 0.0);
                    path.0.push((step.stance_end, decision.place));
                }
            }
            Method::Matcher | Method::MatcherBarometer => {
                let start = matcher::Place {
                    floor,
                    place,
                    sigma_m: START_SIGMA_M,
                    heading: Some((heading, START_HEADING_SIGMA)),
                };
                let mut matcher = Matcher::new(&self.graph, &settings.matcher, &matcher::Start::At(vec![start]))?;
                for step in steps {
                    let place = matcher.step(step).place().map(|place| place.position);
                    path.0.extend(place.map(|place| (step.stance_end, place)));
                }
            }
            Method::Particles => {
                let start = particle::StartPlace {
                    floor,
                    place: place.map(|value| value as f32),
                    sigma_m: START_SIGMA_M as f32,
                    heading: Some((heading as f32, START_HEADING_SIGMA as f32)),
                };
                let start = particle::Start::At(vec![start]);
                let mut filter = ParticleFilter::new(self.walk.map.clone(), &settings.particle, &start, settings.seed)?;
                for step in steps {
                    let place = filter.step(step).place().map(|place| [place.position.x, place.position.y]);
                    path.0.extend(place.map(|place| (step.stance_end, place)));
                }
            }
        }
        Ok(Some(path))
    }
}
