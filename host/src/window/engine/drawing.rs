//! What is drawn of somebody who is followed.

use super::beside::{Beside, Followed, Others};
use super::walk::{Anchor, Moment};
use crate::building::Building;
use crate::follow::{Follower, runs};
use crate::graph;
use crate::particle::{Particle, State};
use crate::recording::Recording;
use crate::window::map::{Cloud, Foot, Overlay, Person, Role, Track};
use std::sync::Arc;

/// Of the true way, poses so far from one another are enough: a line is as wide on a map of a building. **Units:** m.
const THINNING_M: f64 = 0.25;
/// The corrected past is drawn as the mean of so many particles: a seventeenth of their scatter is less than a line is wide.
const PAST_BY: usize = 300;

/// Steps, stances, how they lie in the building, and which walk it is: while they are the same, so is the drawing but for the foot.
type Stepped = (usize, usize, Option<Anchor>, usize);

/// Draws moments of one walk; what has not changed is not made anew.
#[derive(Debug, Default)]
pub struct Drawing {
    truth: Option<Track>,
    /// Who else follows.
    others: Others,
    /// What was drawn after the last step, and what it was drawn of.
    stepped: Option<(Stepped, Overlay)>,
}

impl Drawing {
    /// Of a recording, which may know the truth in the building that it is followed in.
    pub fn of(recording: &Recording, building: Option<&str>) -> Self {
        let truth = building.and_then(|name| recording.truth_in(name)).map(|truth| {
            let way = thinned(truth.poses.iter().map(|pose| pose.position));
            track("truth", Role::Truth, vec![way])
        });
        Self { truth, ..Self::default() }
    }

    /// Follows by another method too, or no longer. `measured`: lengths of steps are measured, not guessed.
    ///
    /// # Errors
    /// As [`Others::run`]. Nothing changes then.
    pub fn beside(
        &mut self,
        which: Beside,
        on: bool,
        building: Option<&Building>,
        measured: bool,
    ) -> Result<(), graph::Error> {
        self.others.run(which, on, building, measured)?;
        self.stepped = None;
        Ok(())
    }

    /// Other methods that follow too, and what each decided at the last step.
    pub fn others(&self) -> Vec<(Beside, String)> {
        self.others.running()
    }

    /// Draws a moment of a walk. `epoch` is another number whenever it is another walk.
    pub fn moment(&mut self, moment: &Moment, epoch: usize) -> Overlay {
        let followed = Followed {
            steps: &moment.track,
            follower: moment.follower.as_ref(),
            anchor: moment.anchor.as_ref(),
            fusion: moment.fusion.as_ref(),
        };
        self.draw(&followed, moment.foot(), epoch)
    }

    /// Draws somebody by steps, with the foot where it is since the last one.
    pub fn draw(&mut self, followed: &Followed<'_>, foot: [f64; 3], epoch: usize) -> Overlay {
        let state = (followed.steps.steps.len(), followed.steps.stances.len(), followed.anchor.copied(), epoch);
        let overlay = match &self.stepped {
            Some((known, overlay)) if *known == state => overlay.clone(),
            _ => {
                let mut overlay = self.after_step(followed.follower);
                overlay.tracks.extend(self.others.tracks(followed, epoch));
                let way: Vec<_> = followed.stances().collect();
                if !way.is_empty() {
                    overlay.tracks.push(track("steps alone", Role::Free, vec![way]));
                }
                self.stepped = Some((state, overlay.clone()));
                overlay
            }
        };
        with_foot(overlay, followed, foot)
    }

    fn after_step(&self, follower: Option<&Follower>) -> Overlay {
        let Some(follower) = follower else { return Overlay::default() };
        let estimate = follower.estimate();
        let located = estimate.state == State::Located;
        let said = runs(follower.path().iter().map(|followed| {
            let place = followed.place.as_ref().filter(|_| followed.state == State::Located)?;
            Some(place.position.into())
        }));
        let past = follower.past_of_some(PAST_BY).into_iter().map(|place| place.position).collect();
        let person = estimate.place().filter(|_| located).map(|place| Person {
            name: "shoe".into(),
            position: place.position.into(),
            floor: place.floor,
            heading: Some(place.heading),
            sigma_m: place.sigma_m(),
            colour: None,
            selected: true,
        });
        let particles: Arc<[Particle]> = follower.particles().into();
        let tracks = [track("corrected", Role::Corrected, vec![past]), track("as it was said", Role::Estimate, said)];
        Overlay {
            clouds: vec![Cloud { particles, colour: None }],
            tracks: self.truth.iter().cloned().chain(tracks).collect(),
            people: person.into_iter().collect(),
            clusters: estimate.clusters.clone().into(),
            feet: Vec::new(),
        }
    }
}

/// The foot alone changes with each sample: all else is drawn as it was after the last step.
fn with_foot(mut overlay: Overlay, followed: &Followed<'_>, foot: [f64; 3]) -> Overlay {
    let (Some(from), Some(last)) = (followed.stances().next_back(), followed.steps.stances.last()) else {
        return overlay;
    };
    let to = followed.laid(foot);
    overlay.feet.push(Foot { from, to });
    if followed.follower.is_none() {
        overlay.people.push(Person {
            name: "shoe".into(),
            position: to,
            floor: 0,
            heading: Some(last.heading),
            sigma_m: 0.0,
            colour: None,
            selected: true,
        });
    }
    overlay
}

/// Places that are not close to the one before; and the first and the last.
fn thinned(way: impl Iterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
    let mut kept: Vec<[f64; 3]> = Vec::new();
    let mut last = None;
    for place in way {
        let far = |from: &[f64; 3]| nalgebra::distance(&(*from).into(), &place.into()) >= THINNING_M;
        let keep = kept.last().is_none_or(far);
        last = (!keep).then_some(place);
        if keep {
            kept.push(place);
        }
    }
    kept.extend(last);
    kept
}

fn track(name: &str, role: Role, pieces: Vec<Vec<[f64; 3]>>) -> Track {
    Track { name: name.into(), role, colour: None, pieces: pieces.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Track as Steps;
    use nalgebra::{Matrix4, Vector3};
    use sohle_shared::sample::ClippedSamples;
    use sohle_shared::step::{FloorMode, Step, StepQuality};
    use sohle_shared::time::Micros;

    fn step(index: u32) -> Step {
        Step {
            index,
            stance_start: Micros(i64::from(index) * 1_000_000),
            stance_end: Micros(i64::from(index) * 1_000_000 + 400_000),
            displacement: Vector3::new(1.2, 0.0, 0.0),
            turn: 0.0,
            covariance: Matrix4::identity() * 1e-4,
            mode: FloorMode::Level,
            quality: StepQuality::default(),
            clipped: ClippedSamples::default(),
        }
    }

    #[test]
    fn a_way_keeps_its_ends_and_where_it_goes() {
        let way: Vec<[f64; 3]> = (0..1_000).map(|index| [0.01 * f64::from(index), 0.0, 0.0]).collect();
        let kept = thinned(way.iter().copied());
        assert_eq!((kept.first(), kept.last()), (way.first(), way.last()));
        assert!((39..=42).contains(&kept.len()), "{}", kept.len());
        assert!(kept.windows(2).all(|pair| pair[1][0] - pair[0][0] < THINNING_M + 0.011), "{kept:?}");
        assert_eq!(thinned([[1.0; 3]; 5].into_iter()), [[1.0; 3]; 2]);
        assert!(thinned(std::iter::empty()).is_empty());
    }

    /// The map is drawn anew for another way, which takes its time where there is no graphics card.
    #[test]
    fn between_two_steps_nothing_is_another_way_but_the_foot_is_elsewhere() {
        let mut drawing = Drawing::default();
        let mut draw = |count: u32, foot: f64| {
            let steps: Vec<Step> = (0..count).map(step).collect();
            let track = Steps::of_steps(&steps);
            let followed = Followed { steps: &track, follower: None, anchor: None, fusion: None };
            drawing.draw(&followed, [foot, 0.0, 0.1], 0)
        };
        let same = |a: &Overlay, b: &Overlay| {
            assert_eq!(a.tracks.len(), 1);
            a.tracks.iter().zip(&b.tracks).all(|(a, b)| Arc::ptr_eq(&a.pieces, &b.pieces))
        };
        let (first, second, third) = (draw(3, 3.7), draw(3, 4.2), draw(4, 4.9));
        assert!(same(&first, &second) && !same(&second, &third));
        assert_eq!((first.feet[0].to[0], second.feet[0].to[0]), (3.7, 4.2));
        assert_eq!(second.feet[0].from, *second.tracks[0].pieces[0].last().unwrap());
        assert_eq!(second.people[0].position, second.feet[0].to);
    }
}
