//! Each method on one simulated walk.

use super::suite::Error;
use super::walks::Site;
use crate::building::geometry::Point;
use crate::graph::matcher::{self, Matcher};
use crate::graph::tracker::{self, Case, Floors, SearchBy, Tracker};
use crate::particle::{self, ParticleFilter};
use crate::simulation::phone::PhoneWalk;
use std::time::{Duration, Instant};

/// What is known of the start (standard deviations): whoever starts knows the place and looks along the first leg.
/// **Units:** m, rad.
pub const START_SIGMA_M: f64 = 0.3;
/// **Units:** rad.
pub const START_HEADING_SIGMA: f64 = 0.1;

/// Who follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The steps put end to end; floors by the height.
    DeadReckoning,
    /// The document's tracker on the graph, floors where the stairs lead.
    Documented,
    /// The same, floors by barometer.
    DocumentedBarometer,
    /// The same, edges searched for by map matching.
    DocumentedMatching,
    /// Several hypotheses on the graph, without heights.
    Matcher,
    /// The same with heights.
    MatcherBarometer,
    /// The particle filter between the walls.
    Particles,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::DeadReckoning,
        Self::Documented,
        Self::DocumentedBarometer,
        Self::DocumentedMatching,
        Self::Matcher,
        Self::MatcherBarometer,
        Self::Particles,
    ];

    /// In tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::DeadReckoning => "dead reckoning",
            Self::Documented => "documented",
            Self::DocumentedBarometer => "documented, barometer",
            Self::DocumentedMatching => "documented, matching",
            Self::Matcher => "matcher",
            Self::MatcherBarometer => "matcher, barometer",
            Self::Particles => "particle filter",
        }
    }

    /// Whether it hears of heights.
    pub fn hears_heights(self) -> bool {
        !matches!(self, Self::Documented | Self::Matcher)
    }
}

/// What a method made of a walk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// Floor and place after each step. **Units:** m; **Frame:** building.
    pub places: Vec<(i32, Point)>,
    /// Edges that were chosen, and how many of them by a search.
    pub chosen: [usize; 2],
    /// For all steps.
    pub time: Duration,
}

/// Lets a method follow a walk whose start is known.
///
/// # Errors
/// When the method refuses the building or the start.
pub fn follow(site: &Site, walk: &PhoneWalk, method: Method, settings: &Settings) -> Result<Followed, Error> {
    let begun = Instant::now();
    let barometer = || Floors::new(&site.building, walk.floors[0]);
    let mut followed = match method {
        Method::DeadReckoning => reckoned(site, walk),
        Method::Documented => documented(site, walk, SearchBy::Distance, None)?,
        Method::DocumentedBarometer => documented(site, walk, SearchBy::Distance, barometer())?,
        Method::DocumentedMatching => documented(site, walk, SearchBy::MapMatching, barometer())?,
        Method::Matcher => matched(site, walk, &settings.matcher, false)?,
        Method::MatcherBarometer => matched(site, walk, &settings.matcher, true)?,
        Method::Particles => filtered(site, walk, settings)?,
    };
    followed.time = begun.elapsed();
    Ok(followed)
}

/// Settings of the methods that have any.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Of the matcher.
    pub matcher: matcher::Parameters,
    /// Of the particle filter.
    pub particle: particle::Parameters,
    /// All that is random in it follows from this.
    pub seed: u64,
}

fn begin(walk: &PhoneWalk) -> Point {
    walk.truth.first().map_or([0.0; 2], |truth| [truth.x, truth.y])
}

fn reckoned(site: &Site, walk: &PhoneWalk) -> Followed {
    let ([mut x, mut y], mut heading) = (begin(walk), walk.heading);
    let mut z = walk.truth.first().map_or(0.0, |truth| truth.z);
    let places = walk.steps.iter().map(|step| {
        let (sin, cos) = heading.sin_cos();
        let [ahead, left, up] = step.displacement.map(f64::from).into();
        (x, y, z) = (x + cos * ahead - sin * left, y + sin * ahead + cos * left, z + up);
        heading += f64::from(step.turn);
        let floors = site.building.floors.iter();
        let near = floors.min_by(|a, b| (a.height_m - z).abs().total_cmp(&(b.height_m - z).abs()));
        (near.map_or(0, |floor| floor.number), [x, y])
    });
    Followed { places: places.collect(), ..Followed::default() }
}

fn documented(site: &Site, walk: &PhoneWalk, search: SearchBy, floors: Option<Floors>) -> Result<Followed, Error> {
    let graph = &site.graph;
    let start = tracker::start(graph, walk.floors[0], begin(walk), walk.heading);
    let (edge, along_m) = start.ok_or(crate::graph::Error::NoFloor(walk.floors[0]))?;
    let parameters = tracker::Parameters { search, ..tracker::Parameters::documented() };
    let mut tracker = Tracker::new(graph, &parameters, edge, along_m);
    if let Some(floors) = floors {
        tracker = tracker.with_barometer(floors);
    }
    let mut followed = Followed::default();
    for (number, step) in walk.steps.iter().enumerate() {
        // The first marks the start.
        if number > 0 {
            let rise = f64::from(step.displacement.z);
            let decision = tracker.step(f64::from(step.turn), f64::from(step.length()), rise);
            let searched = decision.case.is_search();
            let chosen = matches!(decision.case, Case::HalfTurn | Case::Turn | Case::Beyond | Case::TurnBehindEnd);
            followed.chosen[0] += usize::from(searched || chosen);
            followed.chosen[1] += usize::from(searched);
        }
        let (edge, along_m) = tracker.position();
        let edge_of = graph.edge(edge);
        let [from, to] = [edge_of.from, edge_of.to].map(|node| graph.node(node));
        // On stairs the floor is that of the nearer end, and beyond the middle that of the end.
        let floor = if along_m > 0.5 * edge_of.length_m { to.floor } else { from.floor };
        followed.places.push((floor, graph.on(edge, along_m)));
    }
    Ok(followed)
}

fn matched(site: &Site, walk: &PhoneWalk, parameters: &matcher::Parameters, heights: bool) -> Result<Followed, Error> {
    let place = matcher::Place {
        floor: walk.floors[0],
        place: begin(walk),
        sigma_m: START_SIGMA_M,
        heading: Some((walk.heading, START_HEADING_SIGMA)),
    };
    let mut matcher = Matcher::new(&site.graph, parameters, &matcher::Start::At(vec![place]))?;
    if heights {
        matcher = matcher.with_heights();
    }
    let mut last = (walk.floors[0], begin(walk));
    let places = walk.steps.iter().map(|step| {
        if let Some(place) = matcher.step(step).place() {
            last = (place.floor, place.position);
        }
        last
    });
    Ok(Followed { places: places.collect(), ..Followed::default() })
}

fn filtered(site: &Site, walk: &PhoneWalk, settings: &Settings) -> Result<Followed, Error> {
    let [x, y] = begin(walk);
    let start = particle::StartPlace {
        floor: walk.floors[0],
        place: [x as f32, y as f32],
        sigma_m: START_SIGMA_M as f32,
        heading: Some((walk.heading as f32, START_HEADING_SIGMA as f32)),
    };
    let start = particle::Start::At(vec![start]);
    let mut filter = ParticleFilter::new(site.map.clone(), &settings.particle, &start, settings.seed)?;
    let mut last = (walk.floors[0], [x, y]);
    let places = walk.steps.iter().map(|step| {
        if let Some(place) = filter.step(step).place() {
            last = (place.floor, [place.position.x, place.position.y]);
        }
        last
    });
    Ok(Followed { places: places.collect(), ..Followed::default() })
}
