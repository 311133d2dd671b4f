//! What is drawn of somebody who is followed.

use super::beside::{Beside, Followed, Others};
use super::walk::Moment;
use crate::building::Building;
use crate::follow::{Follower, runs};
use crate::graph;
use crate::particle::{Particle, State};
use crate::recording::Recording;
use crate::window::map::{Cloud, Overlay, Person, Role, Track};
use std::sync::Arc;

/// Of the true way, every so many poses are enough.
const THINNING: usize = 10;

/// Draws moments of one walk; what has not changed is not made anew.
#[derive(Debug, Default)]
pub struct Drawing {
    truth: Option<Track>,
    /// Who else follows.
    others: Others,
    /// What was drawn after so many steps, and for which start.
    stepped: Option<(usize, usize, Overlay)>,
}

impl Drawing {
    /// Of a recording, which may know the truth in the building that it is followed in.
    pub fn of(recording: &Recording, building: Option<&str>) -> Self {
        let truth = building.and_then(|name| recording.truth_in(name)).map(|truth| {
            let way = truth.poses.iter().step_by(THINNING).map(|pose| pose.position).collect();
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
        let count = followed.steps.steps.len();
        let overlay = match &self.stepped {
            Some((at, known, overlay)) if *at == count && *known == epoch => overlay.clone(),
            _ => {
                let mut overlay = self.after_step(followed.follower);
                overlay.tracks.extend(self.others.tracks(followed, epoch));
                self.stepped = Some((count, epoch, overlay.clone()));
                overlay
            }
        };
        self.with_foot(overlay, followed, foot)
    }

    fn after_step(&self, follower: Option<&Follower>) -> Overlay {
        let Some(follower) = follower else { return Overlay::default() };
        let estimate = follower.estimate();
        let located = estimate.state == State::Located;
        let said = runs(follower.path().iter().map(|followed| {
            let place = followed.place.as_ref().filter(|_| followed.state == State::Located)?;
            Some(place.position.into())
        }));
        let past = follower.past().into_iter().map(|place| place.position).collect();
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
        }
    }

    fn with_foot(&self, mut overlay: Overlay, followed: &Followed<'_>, foot: [f64; 3]) -> Overlay {
        let Followed { steps, anchor, .. } = *followed;
        let followed = followed.follower.is_some();
        // In a building, the steps alone are nowhere until it is known where they began.
        if followed && anchor.is_none() {
            return overlay;
        }
        let laid = |point: [f64; 3]| anchor.map_or(point, |anchor| anchor.apply(point));
        let stances = steps.stances.iter().map(|stance| laid(stance.position));
        let way: Vec<_> = stances.chain([laid(foot)]).collect();
        if !followed && !steps.stances.is_empty() {
            overlay.people.push(Person {
                name: "shoe".into(),
                position: laid(foot),
                floor: 0,
                heading: steps.stances.last().map(|stance| stance.heading),
                sigma_m: 0.0,
                colour: None,
                selected: true,
            });
        }
        overlay.tracks.push(track("steps alone", Role::Free, vec![way]));
        overlay
    }
}

fn track(name: &str, role: Role, pieces: Vec<Vec<[f64; 3]>>) -> Track {
    Track { name: name.into(), role, colour: None, pieces: pieces.into() }
}
