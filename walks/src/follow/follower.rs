//! The follower: a building, the particle filter on it, and what was said so far.

use super::modes::{FloorModes, Steering};
use super::reach::Reach;
use super::{Error, parse_start, sight};
use crate::building::Building;
use crate::fixes::{Observation, Outliers};
use crate::particle::{Estimate, Map, Parameters, Particle, ParticleFilter, PastPlace, Start, State};
use nalgebra::Vector3;
use sohle_shared::step::{FloorMode, Step};
use sohle_shared::time::Micros;
use std::sync::Arc;

/// The longest step that is one: nobody's foot goes farther between two stances, at a sprint neither. What is longer is a
/// mistake of the sensor or the tracker, and counts as a hole in the walk. **Units:** m.
pub const LONGEST_STEP_M: f32 = 6.0;

/// How to follow.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where the walk begins, as [`parse_start`] reads it.
    pub start: String,
    /// Of the particle filter.
    pub particle: Parameters,
    /// All that is random in it follows from this.
    pub seed: u64,
    /// What the shoe is told.
    pub steering: Steering,
}

impl Default for Settings {
    fn default() -> Self {
        Self { start: "anywhere".into(), particle: Parameters::default(), seed: 1, steering: Steering::default() }
    }
}

/// What was unusual about a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unusual {
    /// Longer than [`LONGEST_STEP_M`]; taken for a hole in the walk. **Units:** m.
    TooLong(f32),
    /// It has a value that is no number, and was passed over.
    NoNumber,
}

/// What is said after a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    /// What the filter says: state, places with probability, floor and covariance, rooms.
    pub estimate: Estimate,
    /// Name of the room of the likeliest place, where it has one.
    pub room: Option<String>,
    /// The floor mode that the shoe should have; `None` leaves it to the shoe.
    pub mode: Option<FloorMode>,
    /// The step was no usual one.
    pub unusual: Option<Unusual>,
}

/// What is kept of each step.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// End of the stance.
    pub time: Micros,
    /// Index of the step.
    pub step: u32,
    /// What was known.
    pub state: State,
    /// The likeliest place, as it was said at that time; nothing where none was.
    pub place: Option<Place>,
}

/// A place as it was said.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Number of the floor.
    pub floor: i32,
    /// **Units:** m; **Frame:** building.
    pub position: Vector3<f64>,
    /// Standard deviation: root of the sum over the axes. **Units:** m.
    pub sigma_m: f64,
    /// Share of the weight.
    pub probability: f64,
}

/// Follows somebody through a building.
#[derive(Clone, Debug)]
pub struct Follower {
    building: Arc<Building>,
    settings: Settings,
    filter: ParticleFilter,
    reach: Reach,
    modes: FloorModes,
    path: Vec<Followed>,
}

impl Follower {
    /// Begins at the start.
    ///
    /// # Errors
    /// A start that means nothing in the building or lies outside, an unknown start where no wall could ever tell anything,
    /// and settings out of bounds.
    pub fn new(building: Building, settings: &Settings) -> Result<Self, Error> {
        let start = begin(&building, &settings.start)?;
        let map = Arc::new(Map::of(&building)?);
        Ok(Self {
            filter: ParticleFilter::new(map, &settings.particle, &start, settings.seed)?,
            reach: Reach::of(&building),
            modes: FloorModes::new(settings.steering),
            path: Vec::new(),
            building: Arc::new(building),
            settings: settings.clone(),
        })
    }

    /// Another, who begins to follow at `start` in the same building.
    ///
    /// # Errors
    /// As [`Follower::new`].
    pub fn anew(&self, start: &str) -> Result<Self, Error> {
        let place = begin(&self.building, start)?;
        let settings = Settings { start: start.to_owned(), ..self.settings.clone() };
        Ok(Self {
            filter: ParticleFilter::new(self.filter.map().clone(), &settings.particle, &place, settings.seed)?,
            modes: FloorModes::new(settings.steering),
            path: Vec::new(),
            building: self.building.clone(),
            reach: self.reach.clone(),
            settings,
        })
    }

    /// How it follows.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes in a step. Whatever it is, an answer follows.
    pub fn step(&mut self, step: &Step) -> Said {
        let numbers = step.displacement.iter().chain(step.covariance.iter()).chain([&step.turn]);
        let unusual = if !numbers.into_iter().all(|value| value.is_finite()) {
            Some(Unusual::NoNumber)
        } else if step.length() > LONGEST_STEP_M {
            Some(Unusual::TooLong(step.length()))
        } else {
            None
        };
        let estimate = match unusual {
            Some(Unusual::NoNumber) => self.filter.estimate().clone(),
            Some(Unusual::TooLong(_)) => {
                let mut hole = *step;
                hole.displacement = Vector3::zeros();
                hole.turn = 0.0;
                hole.quality.gap = true;
                self.filter.step(&hole).clone()
            }
            None => self.filter.step(step).clone(),
        };
        let known = estimate.state == State::Located;
        let mode = self.modes.take(known.then(|| self.reach.shares(self.filter.particles())));
        let place = estimate.place().map(|cluster| Place {
            floor: cluster.floor,
            position: cluster.position,
            sigma_m: cluster.sigma_m(),
            probability: cluster.probability,
        });
        let room = place.as_ref().and_then(|place| {
            let floor = self.building.floor(place.floor)?;
            Some(floor.room_at([place.position.x, place.position.y])?.name.clone())
        });
        self.path.push(Followed { time: step.stance_end, step: step.index, state: estimate.state, place });
        Said { estimate, room, mode, unusual }
    }

    /// Takes in what another source says of the place, which counts when it was measured; returns what is known with it.
    pub fn observe(&mut self, observation: &Observation) -> &Estimate {
        self.filter.sight(&sight(observation, &Outliers::default()), observation.time)
    }

    /// The building.
    pub fn building(&self) -> &Arc<Building> {
        &self.building
    }

    /// What was said at each step, in their order.
    pub fn path(&self) -> &[Followed] {
        &self.path
    }

    /// Where the person has been, corrected by all that was learned since, as far as it is remembered.
    pub fn past(&self) -> Vec<PastPlace> {
        self.filter.past()
    }

    /// The same by at most so many of the particles, for pictures of long walks.
    pub fn past_of_some(&self, most: usize) -> Vec<PastPlace> {
        self.filter.past_of_some(most)
    }

    /// The particles as they are.
    pub fn particles(&self) -> &[Particle] {
        self.filter.particles()
    }

    /// What is known now.
    pub fn estimate(&self) -> &Estimate {
        self.filter.estimate()
    }

    /// The floor mode that the shoe should have now; `None` leaves it to the shoe.
    pub fn mode(&self) -> Option<FloorMode> {
        self.modes.mode()
    }

    /// Whether the shoe is to be told its floor mode.
    pub fn steers(&self) -> bool {
        self.modes.steers()
    }

    /// What one should know before trusting the places: a building that tells little.
    pub fn warnings(&self) -> Vec<String> {
        let bare: Vec<_> = self.building.floors.iter().filter(|floor| floor.walls.is_empty()).collect();
        let mut warnings = Vec::new();
        if bare.len() == self.building.floors.len() {
            warnings
                .push("the building has no walls: the place is that of the steps alone, from the start on".to_owned());
        } else if !bare.is_empty() {
            let numbers: Vec<_> = bare.iter().map(|floor| floor.number.to_string()).collect();
            warnings
                .push(format!("floor {} has no walls: nothing there tells where a step cannot go", numbers.join(", ")));
        }
        if self.building.floors.len() > 1 && self.building.connectors.is_empty() {
            warnings.push("no stairs, ramp or elevator joins the floors: nobody changes the floor".to_owned());
        }
        warnings
    }
}

/// Where the walk begins, if it can be followed from there.
fn begin(building: &Building, start: &str) -> Result<Start, Error> {
    let start = parse_start(building, start)?;
    if start == Start::Anywhere && building.floors.iter().all(|floor| floor.walls.is_empty()) {
        return Err(Error::NoWalls(building.name.clone()));
    }
    Ok(start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;
    use crate::evaluation::building::walk::{Walk, Walker};
    use crate::particle::Cluster;
    use crate::simulation::Person;

    fn from(start: &str) -> Follower {
        let settings = Settings { start: start.into(), ..Settings::default() };
        Follower::new(generate::twin(2), &settings).unwrap()
    }

    fn walk(stops: &[&str]) -> Walk {
        Walk::through(&generate::twin(2), stops, &Walker { person: Person::default(), seed: 3 }).unwrap()
    }

    #[test]
    fn the_shoe_is_told_of_stairs_and_of_level_floors() {
        let walk = walk(&["W02", "hall", "stairs-E", "E14"]);
        let mut follower = from("W02");
        let said: Vec<_> = walk.steps.iter().map(|step| follower.step(step)).collect();
        let mut modes: Vec<_> = said.iter().map(|said| said.mode).collect();
        modes.dedup();
        let stairs = modes.iter().filter(|mode| **mode == Some(FloorMode::Stairs)).count();
        assert!(stairs == 1 && modes.contains(&Some(FloorMode::Level)), "{modes:?}");
        // Nobody who climbs is held to the height of a floor.
        for (said, truth) in said.iter().zip(&walk.truth) {
            let between = truth.z > 0.4 && truth.z < 3.2;
            assert!(!(between && said.mode == Some(FloorMode::Level)), "{truth:?}");
        }
        assert_eq!(said.last().unwrap().room.as_deref(), Some("E14"));
        assert_eq!(follower.path().len(), walk.steps.len());
    }

    #[test]
    fn a_step_of_thirty_metres_is_a_hole_and_the_place_is_searched_anew() {
        let mut walk = walk(&["W01", "W04", "W08", "hall", "E03", "E07", "E05"]);
        let at = walk.steps.len() / 3;
        walk.steps[at].displacement.x = 30.0;
        let mut follower = from("W01");
        let said: Vec<_> = walk.steps.iter().map(|step| follower.step(step)).collect();
        assert_eq!(said[at].unusual, Some(Unusual::TooLong(walk.steps[at].length())));
        assert!(said[at].estimate.state != State::Located, "{:?}", said[at].estimate.state);
        let (last, truth) = (said.last().unwrap(), walk.truth.last().unwrap());
        let error = (last.estimate.place().unwrap().position - truth).xy().norm();
        // Where the long step led is not known: the rooms of the rest of the walk tell, as after an unknown start.
        assert!(last.estimate.state != State::Lost && error < 1.5, "{:?} {error}", last.estimate.state);
    }

    #[test]
    fn a_position_finds_who_starts_anywhere_and_an_outlier_does_not_carry_away() {
        let walk = walk(&["W02", "W05", "hall", "E03"]);
        let mut follower = from("anywhere");
        // The floors are alike: without a word of the floor both stay possible.
        let near = |time: Micros, truth: &Vector3<f64>, off: f64| Observation {
            floor: Some(0),
            ..Observation::position(time, [truth.x + off, truth.y], 2.0)
        };
        let mut alone = from("anywhere");
        for (index, (step, truth)) in walk.steps.iter().zip(&walk.truth).enumerate() {
            follower.step(step);
            alone.step(step);
            if index % 5 == 4 {
                follower.observe(&near(step.stance_end, truth, if index % 20 == 19 { 15.0 } else { 0.5 }));
            }
        }
        let first = |follower: &Follower| {
            follower.path().iter().position(|followed| followed.state == State::Located).unwrap_or(usize::MAX)
        };
        assert!(first(&follower) < first(&alone), "{} {}", first(&follower), first(&alone));
        let off = (follower.estimate().place().unwrap().position - walk.truth.last().unwrap()).xy().norm();
        assert!(off < 1.5, "{off}");
    }

    #[test]
    fn who_is_believed_to_be_elsewhere_is_looked_for_where_several_positions_say() {
        let walk = walk(&["W02", "W05", "hall", "E03"]);
        let end = |heard: bool| {
            // The same room a floor above: the floors are alike, and nothing in the building tells that this is wrong.
            let mut follower = from(&format!("1,{},{}", walk.truth[0].x, walk.truth[0].y));
            for (index, (step, truth)) in walk.steps.iter().zip(&walk.truth).enumerate() {
                follower.step(step);
                if heard && index % 3 == 2 {
                    let said = Observation::position(step.stance_end, [truth.x, truth.y], 0.5);
                    follower.observe(&Observation { floor: Some(0), ..said });
                }
            }
            let off = |place: &Cluster| (place.floor, (place.position - walk.truth.last().unwrap()).xy().norm() < 1.0);
            (follower.estimate().state, follower.estimate().place().map(off))
        };
        assert_eq!(end(true), (State::Located, Some((0, true))));
        assert_eq!(end(false), (State::Located, Some((1, true))));
    }

    #[test]
    fn a_position_that_comes_late_counts_where_it_was_measured() {
        let walk = walk(&["W02", "W05", "hall", "E03"]);
        let errors = |as_if_new: bool| -> f64 {
            let mut follower = from("anywhere");
            let mut squares = Vec::new();
            for (index, step) in walk.steps.iter().enumerate() {
                follower.step(step);
                // Exact, and three strides late.
                if let (0, Some(late)) = (index % 4, index.checked_sub(3)) {
                    let (truth, measured) = (walk.truth[late], walk.steps[late].stance_end);
                    let time = if as_if_new { step.stance_end } else { measured };
                    follower.observe(&Observation::position(time, [truth.x, truth.y], 0.3));
                }
                if let Some(place) = follower.estimate().place().filter(|_| index > 20) {
                    squares.push((place.position - walk.truth[index]).xy().norm_squared());
                }
            }
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let (late, new) = (errors(false), errors(true));
        assert!(late < 0.4 && late < 0.5 * new, "{late} {new}");
    }

    #[test]
    fn a_step_of_no_numbers_is_passed_over() {
        let walk = walk(&["W02", "hall"]);
        let mut follower = from("W02");
        follower.step(&walk.steps[0]);
        let before = follower.estimate().clone();
        let mut step = walk.steps[1];
        step.turn = f32::NAN;
        let said = follower.step(&step);
        assert_eq!((said.unusual, said.estimate), (Some(Unusual::NoNumber), before));
    }

    #[test]
    fn who_begins_anew_is_as_new() {
        let walk = walk(&["W02", "hall"]);
        let mut follower = from("anywhere");
        walk.steps.iter().take(3).for_each(|step| _ = follower.step(step));
        let (mut again, mut new) = (follower.anew("W02").unwrap(), from("W02"));
        for step in &walk.steps {
            assert_eq!(again.step(step), new.step(step));
        }
        assert!(follower.anew("nowhere").is_err());
    }

    #[test]
    fn a_building_without_walls_is_told_of_and_followed_from_a_known_start_only() {
        let mut building = generate::twin(2);
        building.floors.iter_mut().for_each(|floor| floor.walls.clear());
        let told = Follower::new(building.clone(), &Settings::default()).unwrap_err().to_string();
        assert!(told.contains("has no walls"), "{told}");
        let settings = Settings { start: "0,26,3,90".into(), ..Settings::default() };
        let follower = Follower::new(building, &settings).unwrap();
        assert!(follower.warnings()[0].contains("no walls"));
        assert!(from("anywhere").warnings().is_empty());
    }
}
