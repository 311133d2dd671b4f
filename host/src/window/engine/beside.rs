//! Other methods that follow beside the particles: on the walk graph, and by steps and positions without a plan.

use super::on_graph::OnGraph;
use super::walk::Anchor;
use crate::building::Building;
use crate::fixes::{Estimate, Fusion, Measured};
use crate::follow::Follower;
use crate::graph;
use crate::track::Track as Steps;
use crate::window::map::{Rgb, Role, Track};
use sohle_shared::time::Micros;

/// Another method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Beside {
    /// The graph document's tracker.
    Documented,
    /// Several hypotheses on the same graph.
    Matcher,
    /// Steps and positions, without the plan.
    Positions,
}

impl Beside {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Documented, Self::Matcher, Self::Positions];

    /// What it is called.
    pub fn word(self) -> &'static str {
        match self {
            Self::Documented => "On the graph, as documented",
            Self::Matcher => "On the graph, several hypotheses",
            Self::Positions => "Steps and positions",
        }
    }

    /// What it does.
    pub fn told(self) -> &'static str {
        match self {
            Self::Documented => "Follows on the walk graph of the building too, as the graph document does it",
            Self::Matcher => "Follows on the walk graph of the building too, with several places that are possible",
            Self::Positions => "Puts steps and positions of other sources together, without the plan",
        }
    }

    /// Whether it needs a walk graph.
    pub fn on_graph(self) -> bool {
        self != Self::Positions
    }

    /// Its own colour, if it has not that of all others.
    fn colour(self) -> Option<Rgb> {
        match self {
            Self::Documented => None,
            Self::Matcher => Some([0x0d, 0x94, 0x88]),
            Self::Positions => Some([0xc0, 0x26, 0x8d]),
        }
    }
}

/// Of positions so many are drawn, the latest.
const DRAWN: usize = 60;
/// Half the size of the cross that stands for a position. **Units:** m.
const CROSS_M: f64 = 0.35;

/// Those that run, and what they say.
#[derive(Debug, Default)]
pub struct Others {
    running: Vec<(Beside, String)>,
    /// Steps and positions are shown unless somebody does not want it.
    without_positions: bool,
    graph: Option<OnGraph>,
}

/// Somebody who is followed: all that other methods begin with.
#[derive(Clone, Copy)]
pub struct Followed<'a> {
    /// By the steps alone.
    pub steps: &'a Steps,
    /// Who follows in the building.
    pub follower: Option<&'a Follower>,
    /// How the steps lie there.
    pub anchor: Option<&'a Anchor>,
    /// Positions of other sources.
    pub fusion: Option<&'a Fusion>,
}

impl Followed<'_> {
    /// A place of the track as it lies in the building; where nobody is followed there, as it is. **Units:** m.
    pub fn laid(&self, point: [f64; 3]) -> [f64; 3] {
        self.anchor.map_or(point, |anchor| anchor.apply(point))
    }

    /// Where the foot stood by the steps alone. In a building they are nowhere until it is known where they began.
    pub fn stances(&self) -> impl DoubleEndedIterator<Item = [f64; 3]> {
        let known = self.follower.is_none() || self.anchor.is_some();
        self.steps.stances.iter().filter(move |_| known).map(|stance| self.laid(stance.position))
    }
}

impl Others {
    /// Begins with one, or ends it. `measured`: lengths of steps are measured, not guessed.
    ///
    /// # Errors
    /// As [`OnGraph::of`]. Nothing changes then.
    pub fn run(
        &mut self,
        which: Beside,
        on: bool,
        building: Option<&Building>,
        measured: bool,
    ) -> Result<(), graph::Error> {
        if on && which.on_graph() && self.graph.is_none() {
            self.graph = building.map(|building| OnGraph::of(building, measured)).transpose()?;
        }
        self.running.retain(|(running, _)| *running != which);
        if which == Beside::Positions {
            self.without_positions = !on;
        } else if on && self.graph.is_some() {
            self.running.push((which, String::new()));
            self.running.sort_by_key(|(running, _)| Beside::ALL.iter().position(|other| other == running));
        }
        Ok(())
    }

    /// Those that run, and what was decided at the last step.
    pub fn running(&self) -> Vec<(Beside, String)> {
        self.running.clone()
    }

    /// What they make of a walk. `epoch` is another number whenever it is another walk.
    pub fn tracks(&mut self, of: &Followed<'_>, epoch: usize) -> Vec<Track> {
        self.running.retain(|(which, _)| which.on_graph());
        if of.fusion.is_some() && !self.without_positions {
            self.running.push((Beside::Positions, String::new()));
        }
        let mut tracks = Vec::new();
        for (which, said) in &mut self.running {
            let (way, told) = match (*which, &mut self.graph, of.anchor) {
                (Beside::Positions, ..) => {
                    let Some(fusion) = of.fusion else { continue };
                    tracks.push(track("positions", *which, crosses(of, fusion)));
                    (by_positions(of, fusion), told(fusion))
                }
                (_, _, None) => (Vec::new(), "waits until place and direction are known".to_owned()),
                (Beside::Documented, Some(graph), Some(anchor)) => {
                    let way = graph.documented(of.steps, anchor, epoch);
                    (way.places, way.last.map_or_else(|| "waits for a step".into(), |last| last.to_string()))
                }
                (Beside::Matcher, Some(graph), Some(anchor)) => graph.matched(of, anchor, epoch),
                (_, None, _) => continue,
            };
            *said = told;
            if !way.is_empty() {
                tracks.push(track(&which.word().to_lowercase(), *which, vec![way]));
            }
        }
        tracks
    }
}

/// The height at which a place of this time is drawn: that of who is followed. **Units:** m.
fn height(of: &Followed<'_>, time: Micros) -> f64 {
    let path = of.follower.map_or(&[][..], Follower::path);
    let until = &path[..path.partition_point(|followed| followed.time <= time)];
    let place = until.iter().rev().find_map(|followed| followed.place.as_ref());
    place.map_or(0.0, |place| place.position.z)
}

fn by_positions(of: &Followed<'_>, fusion: &Fusion) -> Vec<[f64; 3]> {
    let place = |said: &Estimate| {
        let [x, y] = said.place;
        [x, y, height(of, said.time)]
    };
    fusion.said().iter().map(place).collect()
}

fn crosses(of: &Followed<'_>, fusion: &Fusion) -> Vec<Vec<[f64; 3]>> {
    let counted = fusion.counted();
    let mut pieces = Vec::new();
    for (_, observation) in &counted[counted.len().saturating_sub(DRAWN)..] {
        let Measured::Position { place: [x, y], .. } = observation.measured else { continue };
        let z = height(of, observation.time);
        let stroke = |dx: f64, dy: f64| vec![[x - dx, y - dy, z], [x + dx, y + dy, z]];
        pieces.extend([stroke(CROSS_M, CROSS_M), stroke(CROSS_M, -CROSS_M)]);
    }
    pieces
}

fn told(fusion: &Fusion) -> String {
    let heard = fusion.counted().len();
    match fusion.estimate() {
        Some(estimate) => {
            let [x, y] = estimate.place;
            format!("({x:.1}, {y:.1}) m, +- {:.1} m by {heard} positions", estimate.sigma_m())
        }
        None => format!("{heard} positions have come; the place is not known well enough"),
    }
}

fn track(name: &str, which: Beside, pieces: Vec<Vec<[f64; 3]>>) -> Track {
    Track { name: name.into(), role: Role::Other, colour: which.colour(), pieces: pieces.into() }
}
