//! Everything that is known at a moment of a walk.

use super::sensed;
use super::signals::{Row, Signal};
use super::walk::Settings;
use crate::building::Building;
use crate::fixes::Fusion;
use crate::follow::{self, Follower, Orders, Said};
use crate::particle::{Estimate, State};
use crate::track::Track;
use nalgebra::{UnitQuaternion, Vector3};
use sohle_shared::sample::ImuSample;
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Order, Tracker};

/// A heading that is known better than this can turn a track. **Units:** 1, length of the mean direction.
const KNOWN_HEADING: f64 = 0.7;

/// Lays a track of steps alone into the building.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// **Units:** rad.
    pub yaw: f64,
    /// **Units:** m; **Frame:** building.
    pub shift: Vector3<f64>,
    /// Number of the floor on which it became known.
    pub floor: i32,
    /// The stance of the track at which it became known.
    pub since: usize,
}

impl Anchor {
    /// How a track lies in the building, by what is known at its last stance.
    pub fn found(track: &Track, estimate: &Estimate) -> Option<Self> {
        let (stance, place) = (track.stances.last()?, estimate.place()?);
        let yaw = place.heading - stance.heading;
        let shift = place.position - turned(yaw, stance.position.into());
        let known = estimate.state == State::Located && place.heading_agreement > KNOWN_HEADING;
        let since = track.stances.len() - 1;
        known.then_some(Self { yaw, shift, floor: place.floor, since })
    }

    /// Where a point of the track is in the building. **Units:** m.
    pub fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        (turned(self.yaw, point.into()) + self.shift).into()
    }
}

fn turned(yaw: f64, point: Vector3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw) * point
}

/// Everything that is known at a moment.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Items of the walk that were taken in.
    pub index: usize,
    /// The tracker.
    pub tracker: Tracker,
    /// By the steps alone.
    pub track: Track,
    /// Who follows in the building, if there is one.
    pub follower: Option<Follower>,
    /// Positions of other sources, put together with the steps, if there are some.
    pub fusion: Option<Fusion>,
    /// What was said after the last step.
    pub said: Option<Said>,
    /// How the track lies in the building, once that is known.
    pub anchor: Option<Anchor>,
    /// Whether the foot stands.
    pub stance: bool,
    /// Items that had been taken in when each step was known.
    pub stepped: Vec<usize>,
    pub(super) sample: Option<ImuSample>,
    pub(super) stands_since: Option<Micros>,
    /// How much the last sample changed the velocity of a foot that stands: what the zero-velocity update took away.
    pub(super) corrected: Option<f32>,
    pub(super) orders: Orders,
}

impl Moment {
    pub(super) fn first(
        building: Option<&Building>,
        fusion: Option<&Fusion>,
        settings: &Settings,
    ) -> Result<Self, follow::Error> {
        Ok(Self {
            index: 0,
            tracker: Tracker::new(&settings.tracker),
            track: Track::default(),
            follower: building.map(|building| Follower::new(building.clone(), &settings.follow)).transpose()?,
            fusion: fusion.cloned(),
            said: None,
            anchor: None,
            stance: false,
            stepped: Vec::new(),
            sample: None,
            stands_since: None,
            corrected: None,
            orders: Orders::default(),
        })
    }

    /// How the sensor lies in the building, or in the frame of the track where that is not known.
    pub fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        self.sample?;
        let heading = self.track.stances.last().map_or(0.0, |stance| stance.heading);
        let yaw = heading + self.anchor.map_or(0.0, |anchor| anchor.yaw);
        let attitude: UnitQuaternion<f64> = self.tracker.attitude().cast();
        Some(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw) * attitude)
    }

    /// Where the foot is by the steps alone. **Units:** m; **Frame:** of the track.
    pub fn foot(&self) -> [f64; 3] {
        self.track.ahead(self.tracker.displacement())
    }

    /// Follows the step that the track ends with; the order to the tracker that comes of it.
    pub(super) fn follow(&mut self, recorded: &[(usize, Order)]) -> Option<Order> {
        self.stepped.push(self.index + 1);
        let step = self.track.steps.last()?;
        if let Some(fusion) = &mut self.fusion {
            while let Some(heard) = fusion.hear(step.stance_end + 1) {
                if let Some(follower) = self.follower.as_mut().filter(|_| heard.counts()) {
                    follower.observe(&heard.observation);
                }
            }
            fusion.step(step);
        }
        let said = self.follower.as_mut()?.step(step);
        let order = self.orders.after(recorded, said.mode);
        self.anchor = self.anchor.or_else(|| Anchor::found(&self.track, &said.estimate));
        self.said = Some(said);
        order
    }

    pub(super) fn row(&self, time: Micros) -> Row {
        let mut row = [f32::NAN; Signal::COUNT];
        if let Some(sample) = &self.sample {
            sensed::write(sample, &mut row);
        }
        let mut set = |signal: Signal, value: f32| row[signal.index()] = value;
        if self.sample.is_some() {
            let insight = self.tracker.insight();
            set(Signal::Statistic, insight.statistic);
            set(Signal::Bound, insight.bound);
            set(Signal::WaySigma, insight.displacement_sigma);
            set(Signal::VelocitySigma, insight.velocity_sigma);
            set(Signal::Stance, f32::from(u8::from(self.stance)));
            set(Signal::StillTime, self.stands_since.map_or(0.0, |since| time.since(since)));
            set(Signal::Speed, self.tracker.velocity().norm());
            set(Signal::Climb, self.tracker.velocity().z);
        }
        if let Some(corrected) = self.corrected {
            set(Signal::Innovation, corrected);
        }
        set(Signal::Height, self.foot()[2] as f32);
        if let Some(step) = self.track.steps.last() {
            set(Signal::StepLength, step.length());
        }
        if let Some(said) = &self.said {
            let estimate = &said.estimate;
            if let Some(place) = estimate.place() {
                set(Signal::PlaceSigma, place.sigma_m() as f32);
                set(Signal::Probability, place.probability as f32);
            }
            set(Signal::Particles, estimate.particles as f32);
            set(Signal::Effective, estimate.effective as f32);
            set(Signal::Fit, estimate.likelihood as f32);
        }
        row
    }
}
