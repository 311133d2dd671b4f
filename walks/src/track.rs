//! A walk as it was tracked: the steps put end to end.
//!
//! This is the dead-reckoned track, before any building, graph or fix corrects it.

use nalgebra::Vector3;
use sohle_shared::sample::ImuSample;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Counters, Order, Output, Parameters, Tracker};

/// A stance and where it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// First moment the foot stood.
    pub start: Micros,
    /// Last moment.
    pub end: Micros,
    /// Where. **Units:** m; **Frame:** world, z up, origin and heading of the first stance.
    pub position: [f64; 3],
    /// Heading of the foot. **Units:** rad, not wrapped; **Frame:** as the position.
    pub heading: f64,
}

/// Where the foot was at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// When.
    pub time: Micros,
    /// Where. **Units:** m; **Frame:** as [`Stance::position`].
    pub position: [f64; 3],
}

/// A tracked walk.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// The steps, in order; the first has index 0 and marks the start.
    pub steps: Vec<Step>,
    /// One stance for each step.
    pub stances: Vec<Stance>,
    /// The foot between the stances too, thinned to [`PATH_PERIOD_US`].
    pub path: Vec<PathPoint>,
    /// What was unusual.
    pub counters: Counters,
    /// First and last sample.
    pub span: Option<(Micros, Micros)>,
}

/// Gives a tracker orders while it tracks, as a map does over the wire.
pub trait Steer {
    /// Orders that it gets before the sample of this number, counted from 0.
    fn before(&mut self, _sample: usize) -> Vec<Order> {
        Vec::new()
    }

    /// Sees each step as it is made; the order that follows from it.
    fn after(&mut self, step: &Step) -> Option<Order>;
}

/// Nobody gives orders.
struct Unsteered;

impl Steer for Unsteered {
    fn after(&mut self, _step: &Step) -> Option<Order> {
        None
    }
}

/// Spacing of [`Track::path`]. **Units:** microseconds.
pub const PATH_PERIOD_US: i64 = 10_000;

impl Track {
    /// Puts steps end to end that were made elsewhere.
    pub fn of_steps(steps: &[Step]) -> Self {
        let mut track = Self::default();
        for &step in steps {
            track.span = Some((track.span.map_or(step.stance_start, |(first, _)| first), step.stance_end));
            track.add(step);
        }
        track
    }

    /// Feeds `samples` through a tracker.
    pub fn of(samples: impl IntoIterator<Item = ImuSample>, parameters: &Parameters) -> Self {
        Self::steered(samples, parameters, &mut Unsteered)
    }

    /// The same, with somebody who gives the tracker orders.
    pub fn steered(
        samples: impl IntoIterator<Item = ImuSample>,
        parameters: &Parameters,
        steer: &mut impl Steer,
    ) -> Self {
        let mut tracker = Tracker::new(parameters);
        let mut track = Self::default();
        let mut due = None;
        for (index, sample) in samples.into_iter().enumerate() {
            for order in steer.before(index) {
                tracker.obey(order);
            }
            let output = tracker.push(&sample);
            track.take(sample.time, &output);
            if let Some(order) = output.step.and_then(|step| steer.after(&step)) {
                tracker.obey(order);
            }
            if due.is_none_or(|due| sample.time >= due) {
                track.path.push(PathPoint { time: sample.time, position: track.ahead(tracker.displacement()) });
                due = Some(sample.time + PATH_PERIOD_US);
            }
        }
        if let Some(step) = tracker.finish() {
            track.add(step);
            steer.after(&step);
        }
        track.counters = *tracker.counters();
        track
    }

    /// Takes in what the sample of a time led to. Does not add to [`Track::path`].
    pub fn take(&mut self, time: Micros, output: &Output) {
        self.span = Some((self.span.map_or(time, |(first, _)| first), time));
        if let Some(step) = output.step {
            self.add(step);
        }
        if let Some(stance) = self.stances.last_mut().filter(|_| output.reported) {
            stance.end = time;
        }
    }

    /// Appends a step to the end of the track.
    pub fn add(&mut self, step: Step) {
        let heading = self.stances.last().map_or(0.0, |stance| stance.heading);
        self.stances.push(Stance {
            start: step.stance_start,
            end: step.stance_end,
            position: self.ahead(step.displacement),
            heading: heading + f64::from(step.turn),
        });
        self.steps.push(step);
    }

    /// The place that lies at `displacement` in the heading frame of the last stance. **Units:** m.
    pub fn ahead(&self, displacement: Vector3<f32>) -> [f64; 3] {
        let last = self.stances.last();
        let origin = last.map_or([0.0; 3], |stance| stance.position);
        let (sin, cos) = libm::sincos(last.map_or(0.0, |stance| stance.heading));
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(displacement[axis]));
        [origin[0] + cos * x - sin * y, origin[1] + sin * x + cos * y, origin[2] + z]
    }

    /// Strides walked. The start is not one, nor is a ride in an elevator, which ends in the stance it began in.
    pub fn strides(&self) -> usize {
        self.steps.windows(2).filter(|pair| pair[1].stance_start != pair[0].stance_start).count()
    }

    /// Horizontal length of the track. **Units:** m.
    pub fn distance(&self) -> f64 {
        self.steps.iter().map(|step| f64::from(step.length())).sum()
    }
}
