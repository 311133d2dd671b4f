//! The tracker: inertial samples in, one [`Step`] per stance out.
//!
//! RESET, INIT, TRACKING as in Foot, 4.4.2: at rest the vertical and the biases are taken, then every sample is integrated
//! and every stance corrects the integration. Two ways lead from samples to steps, chosen by [`Method`]: the source
//! document's, and the project's own, which is the default because it measures better.
//!
//! Whatever comes in, a tracker does not panic and does not stop: a sample it cannot use is counted and passed over, and a
//! filter that has lost itself starts anew at the next rest or stance.

mod documented;
pub mod ground;
mod own;
pub mod settings;
pub mod stride;
#[cfg(feature = "documented")]
mod way;

use crate::filter::pivot;
use crate::preintegration;
use crate::rest;
use crate::sample::ImuSample;
use crate::stance::adaptive;
use crate::step::{FloorMode, Step};
use crate::time::Micros;
use nalgebra::{UnitQuaternion, Vector3};
#[cfg(not(feature = "documented"))]
use own::Own as Way;
#[cfg(feature = "documented")]
use way::Way;

/// The way from samples to steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum Method {
    /// The project's own: increments, adaptive detector, pivot filter.
    #[default]
    Pivot,
    /// The document's: an unscented filter on each sample, and one of the detectors by threshold. Of the feature
    /// `documented`.
    Unscented,
}

impl Method {
    /// Whether this program has it. A tracker that is told to use one that it does not have uses its own.
    pub fn available(self) -> bool {
        self == Self::Pivot || cfg!(feature = "documented")
    }
}

/// The detector of [`Method::Unscented`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum Detector {
    /// The document's (Foot, 4.5).
    #[default]
    Documented,
    /// Stance hypothesis optimal estimation.
    Shoe,
    /// Angular rate energy.
    Ared,
    /// Acceleration moving variance.
    Amv,
    /// Acceleration magnitude.
    Mag,
    /// The project's own, from the samples alone.
    Adaptive,
}

/// All settings of a tracker. Those of the method that is not chosen have no effect. [`settings`] has the bounds of each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// The way from samples to steps.
    pub method: Method,
    /// When no rest comes, the tracker starts in motion after this time. **Units:** s. Method `pivot`.
    pub start_after_s: f32,
    /// A sensor that can sleep does so when the foot has stood so long; 0 is never. **Units:** s. The tracker itself makes
    /// nothing of it.
    pub sleep_after_s: f32,
    /// How samples are gathered. Method `pivot`.
    pub preintegration: preintegration::Parameters,
    /// When the foot stands. Method `pivot`, and detector `adaptive`.
    pub stance: adaptive::Parameters,
    /// When it is at rest. Method `pivot`.
    pub rest: rest::Parameters,
    /// The filter. Method `pivot`.
    pub filter: pivot::Parameters,
    /// What the ground does. Both methods.
    pub ground: ground::Parameters,
    /// What a step is. Both methods.
    pub steps: stride::Parameters,
    /// Method `unscented`.
    pub document: documented::Parameters,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::Pivot,
            start_after_s: 3.0,
            sleep_after_s: 60.0,
            preintegration: Default::default(),
            stance: Default::default(),
            rest: Default::default(),
            filter: Default::default(),
            ground: Default::default(),
            steps: Default::default(),
            document: Default::default(),
        }
    }
}

impl Parameters {
    /// The settings of the source document (Foot, chapter 4).
    pub fn documented() -> Self {
        Self { method: Method::Unscented, ..Self::default() }
    }
}

pub use documented::Parameters as DocumentParameters;

/// What the tracker is doing (Foot, 4.4.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum State {
    /// Nothing seen yet.
    #[default]
    Reset,
    /// Waiting for the foot to rest.
    Init,
    /// Following the foot.
    Tracking,
}

/// A command to the tracker (Foot, 4.4.2): what a map or a person knows better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub enum Order {
    /// [`Tracker::reset`].
    Reset,
    /// [`Tracker::initialise`].
    Init,
    /// [`Tracker::start_moving`].
    Track,
    /// [`Tracker::command_floor_mode`].
    FloorMode(Option<FloorMode>),
}

/// What one sample led to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// State after the sample.
    pub state: State,
    /// Whether the foot stands.
    pub stance: bool,
    /// Whether the foot stands where the last step ended: its stance goes on though it has been told of.
    pub reported: bool,
    /// The step that the sample completed. The step with index 0 marks the stance the walk starts from; its
    /// displacement and turn are zero.
    pub step: Option<Step>,
}

/// What went wrong or was unusual since the reset. Nothing of it stops the tracker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Counters {
    /// Samples taken in.
    pub samples: u64,
    /// Samples refused because a value was not finite.
    pub not_finite: u32,
    /// Samples refused because their time was that of the one before.
    pub repeated: u32,
    /// Samples refused because their time lay before that of the one before.
    pub backwards: u32,
    /// Holes in the time line too long to be bridged without loss.
    pub gaps: u32,
    /// Samples with an accelerometer axis at the end of its range.
    pub accel_clipped: u32,
    /// Samples with a gyroscope axis at the end of its range.
    pub gyro_clipped: u32,
    /// Covariances that had lost positive definiteness and were repaired.
    pub repaired: u32,
    /// Times the tracker lost itself and started anew.
    pub restarts: u32,
}

/// What goes on inside, for those who watch. What the chosen method does not know is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Insight {
    /// How restless the foot is, as the detector of stances measures it. **Units:** 1.
    pub statistic: f32,
    /// Below it the foot stands. **Units:** 1.
    pub bound: f32,
    /// Standard deviation of [`Tracker::displacement`], root of the sum over the axes. **Units:** m.
    pub displacement_sigma: f32,
    /// Standard deviation of [`Tracker::velocity`], the same. **Units:** m/s.
    pub velocity_sigma: f32,
}

/// From samples to steps.
#[derive(Clone, Debug)]
pub struct Tracker {
    parameters: Parameters,
    way: Way,
    counters: Counters,
    last: Option<Micros>,
}

impl Tracker {
    /// A tracker in state RESET.
    pub fn new(parameters: &Parameters) -> Self {
        Self { parameters: *parameters, way: Way::new(parameters), counters: Counters::default(), last: None }
    }

    /// Back to RESET, as new. What a map commanded is forgotten too.
    pub fn reset(&mut self) {
        self.way.reset(&self.parameters);
        self.counters = Counters::default();
        self.last = None;
    }

    /// As new, with other settings.
    pub fn restart(&mut self, parameters: &Parameters) {
        self.parameters = *parameters;
        self.reset();
    }

    /// Takes one sample in. Never panics; a sample that cannot be used is counted and changes nothing.
    pub fn push(&mut self, sample: &ImuSample) -> Output {
        self.counters.samples += 1;
        if !self.usable(sample) {
            return Output { state: self.state(), stance: false, reported: false, step: None };
        }
        self.last = Some(sample.time);
        self.counters.accel_clipped += u32::from(sample.clipped.accel);
        self.counters.gyro_clipped += u32::from(sample.clipped.gyro);
        self.way.push(sample, &mut self.counters)
    }

    fn usable(&mut self, sample: &ImuSample) -> bool {
        if !sample.is_finite() {
            self.counters.not_finite += 1;
            return false;
        }
        match self.last.map(|last| sample.time - last) {
            Some(0) => self.counters.repeated += 1,
            Some(passed) if passed < 0 => self.counters.backwards += 1,
            _ => return true,
        }
        false
    }

    /// Ends the recording: the step of a stance that has not ended yet.
    pub fn finish(&mut self) -> Option<Step> {
        self.way.finish(&mut self.counters)
    }

    /// Tells what the ground does, as a map knows it (H4, H5); `None` leaves it to the tracker again.
    pub fn command_floor_mode(&mut self, mode: Option<FloorMode>) {
        self.way.command(mode);
    }

    /// Back to INIT: attitude, velocity and biases are found anew at the next rest. The steps go on counting, the next one
    /// carries the mark of a gap, and what a map commanded still holds.
    pub fn initialise(&mut self) {
        self.way.initialise(self.last);
    }

    /// Starts from the next stance, without waiting for a rest. Whether it could: not in state TRACKING, and not with
    /// [`Method::Unscented`], whose filter needs a rest.
    pub fn start_moving(&mut self) -> bool {
        self.way.start_moving()
    }

    /// The sensor slept, because the foot stood still, and woke at `time`, when it moved again: everything is as it was at the
    /// last sample, and the next one is a little later. A `time` before the last sample changes nothing.
    pub fn stood_until(&mut self, time: Micros) {
        let Some(last) = self.last.filter(|&last| last < time) else { return };
        self.last = Some(time);
        self.way.stood_until(time, time.since(last));
    }

    /// Whether the foot stands on something that moves, as in an elevator.
    pub fn rides(&self) -> bool {
        self.way.rides()
    }

    /// Carries an order out. Whether it could be in the present state; if not, nothing has changed.
    pub fn obey(&mut self, order: Order) -> bool {
        match order {
            Order::Reset => self.reset(),
            Order::Init => self.initialise(),
            Order::Track => return self.start_moving(),
            Order::FloorMode(mode) => self.command_floor_mode(mode),
        }
        true
    }

    /// Its settings.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// What the tracker is doing.
    pub fn state(&self) -> State {
        self.way.phase()
    }

    /// What was unusual since the reset.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    fn foot(&self) -> &crate::filter::state::State {
        self.way.foot()
    }

    /// Where the foot is now, since the stance of the last step. **Units:** m; **Frame:** heading frame of that stance, as
    /// the next step will be.
    pub fn displacement(&self) -> Vector3<f32> {
        self.foot().position
    }

    /// What goes on inside.
    pub fn insight(&self) -> Insight {
        self.way.insight()
    }

    /// Attitude of the sensor now. **Frame:** from the sensor to that of [`Tracker::displacement`].
    pub fn attitude(&self) -> UnitQuaternion<f32> {
        self.foot().attitude
    }

    /// Velocity of the sensor now. **Units:** m/s; **Frame:** that of [`Tracker::displacement`].
    pub fn velocity(&self) -> Vector3<f32> {
        self.foot().velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Clipped;
    use crate::selftest::{STRIDES, Walk};
    use crate::so3;
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn walk() -> Vec<ImuSample> {
        Walk::new(5_000).collect()
    }

    fn run(samples: &[ImuSample]) -> (Vec<Step>, Counters) {
        let mut tracker = Tracker::new(&Parameters::default());
        let mut steps: Vec<_> = samples.iter().filter_map(|sample| tracker.push(sample).step).collect();
        steps.extend(tracker.finish());
        (steps, *tracker.counters())
    }

    /// Largest difference of length (m), height (m) and turn (rad) between the steps of two runs.
    fn differences(a: &[Step], b: &[Step]) -> [f32; 3] {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).fold([0.0; 3], |[length, height, turn], (a, b)| {
            [
                length.max((a.length() - b.length()).abs()),
                height.max((a.displacement.z - b.displacement.z).abs()),
                turn.max((a.turn - b.turn).abs()),
            ]
        })
    }

    #[test]
    fn every_stride_of_every_gait_is_a_step_of_the_right_length() {
        let (steps, counters) = run(&walk());
        assert_eq!(steps.len(), STRIDES + 1);
        // The strides of the route: 1 and 8 walking, 5 upstairs, 4 about, 8 running, 1 more.
        for (step, (length, climb)) in steps[1..].iter().zip(
            core::iter::repeat_n((1.35, 0.0), 9)
                .chain(core::iter::repeat_n((0.58, 0.34), 5))
                .chain(core::iter::repeat_n((0.9, 0.0), 4))
                .chain(core::iter::repeat_n((2.2, 0.0), 8))
                .chain(core::iter::once((0.5, 0.0))),
        ) {
            // 200 Hz with 0.05 m/s² of noise: some millimetres; the impacts of this walk are mild.
            assert!((step.length() - length).abs() < 0.03, "step {}: {} m for {length} m", step.index, step.length());
            assert!((step.displacement.z - climb).abs() < 0.02, "step {}: {} m up", step.index, step.displacement.z);
            assert_eq!(step.mode == FloorMode::Stairs, climb > 0.0, "step {}", step.index);
        }
        assert_eq!((counters.repaired, counters.restarts), (0, 0));
    }

    #[test]
    fn how_the_sensor_sits_on_the_shoe_does_not_matter() {
        let (steps, _) = run(&walk());
        for mounting in [[core::f32::consts::PI, 0.0, 0.0], [0.0, 1.57, 0.0], [0.0, -1.57, 0.0], [2.0, -1.0, 0.7]] {
            let turned = so3::exp(&mounting.into());
            let samples: Vec<_> = walk()
                .into_iter()
                .map(|mut sample| {
                    sample.accel.0 = turned * sample.accel.0;
                    sample.gyro.0 = turned * sample.gyro.0;
                    sample
                })
                .collect();
            let [length, height, turn] = differences(&steps, &run(&samples).0);
            // The same samples in other axes: rounding, and the sigma points lie along other directions.
            assert!(length < 2e-3 && height < 2e-3 && turn < 2e-3, "{mounting:?}: {length} m, {height} m, {turn} rad");
        }
    }

    #[test]
    fn when_the_recording_began_does_not_matter() {
        let later: Vec<_> = walk()
            .into_iter()
            .map(|mut sample| {
                sample.time = sample.time + 86_400_000_000_000;
                sample
            })
            .collect();
        let (early, _) = run(&walk());
        let (late, _) = run(&later);
        for (a, b) in early.iter().zip(&late) {
            assert_eq!((a.displacement, a.turn, a.covariance), (b.displacement, b.turn, b.covariance));
        }
    }

    #[test]
    fn samples_that_cannot_be_used_change_nothing_and_are_counted() {
        let mut samples = Vec::new();
        for (i, sample) in walk().into_iter().enumerate() {
            samples.push(sample);
            match i % 50 {
                10 => samples.push(sample),
                20 => samples.push(ImuSample {
                    time: sample.time + 1_000,
                    ..ImuSample::new(Micros(0), [f32::NAN; 3], [0.0; 3])
                }),
                30 => samples.push(ImuSample { time: sample.time + -20_000, ..sample }),
                _ => {}
            }
        }
        let (steps, counters) = run(&samples);
        assert_eq!(steps, run(&walk()).0);
        assert!(counters.repeated > 50 && counters.not_finite > 50 && counters.backwards > 50);
    }

    #[test]
    fn a_hole_is_survived_and_told() {
        let mut samples = walk();
        let (whole, _) = run(&samples);
        samples.retain(|sample| !(9_500_000..9_900_000).contains(&sample.time.0));
        let (steps, counters) = run(&samples);
        assert_eq!(counters.gaps, 1);
        assert_eq!(steps.iter().filter(|step| step.quality.gap).count(), 1);
        // What comes long after the hole is as good as without it.
        let [length, _, turn] = differences(&whole[whole.len() - 5..], &steps[steps.len() - 5..]);
        assert!(length < 0.02 && turn < 0.01, "{length} m, {turn} rad");
    }

    #[test]
    fn told_to_wait_for_a_rest_it_finds_itself_anew_and_goes_on_counting() {
        let samples = walk();
        let mut tracker = Tracker::new(&Parameters::default());
        let (first, second) = samples.split_at(samples.len() / 2);
        let mut steps: Vec<_> = first.iter().filter_map(|sample| tracker.push(sample).step).collect();
        tracker.initialise();
        assert_eq!(tracker.state(), State::Init);
        let before = steps.len() as u32;
        steps.extend(second.iter().filter_map(|sample| tracker.push(sample).step));
        steps.extend(tracker.finish());
        assert!(steps.iter().zip(0..).all(|(step, index)| step.index == index));
        assert!(steps.len() as u32 > before, "found itself again");
        assert!(steps[before as usize].quality.gap && !steps[before as usize + 1].quality.gap);
    }

    #[test]
    fn told_not_to_wait_it_starts_from_the_first_stance() {
        let moving: Vec<_> = walk().into_iter().filter(|sample| sample.time.0 > 4_000_000).collect();
        let started = |told: bool| {
            let mut tracker = Tracker::new(&Parameters { start_after_s: 1e3, ..Parameters::default() });
            assert!(!told || tracker.start_moving());
            let at = moving.iter().position(|sample| tracker.push(sample).state == State::Tracking);
            assert!(at.is_none() || !tracker.start_moving(), "it is tracking already");
            at.map(|at| moving[at].time - moving[0].time)
        };
        // A stride of this walk takes a second.
        assert!(started(true).is_some_and(|after| after < 1_500_000), "{:?}", started(true));
        assert!(started(false).is_none_or(|after| after > 5_000_000), "{:?}", started(false));
    }

    #[test]
    fn a_tracker_that_starts_over_is_a_new_one() {
        let calm = Parameters {
            start_after_s: 1.0,
            rest: rest::Parameters { window_s: 0.3, ..Default::default() },
            ..Default::default()
        };
        for parameters in [Parameters::default(), calm, Parameters::documented()] {
            let (mut new, mut used) = (Tracker::new(&parameters), Tracker::new(&Parameters::default()));
            used.command_floor_mode(Some(FloorMode::Stairs));
            walk().iter().take(2_500).for_each(|sample| _ = used.push(sample));
            used.restart(&parameters);
            for sample in walk() {
                assert_eq!(used.push(&sample), new.push(&sample), "{parameters:?}");
                assert_eq!((used.displacement(), used.counters()), (new.displacement(), new.counters()));
            }
            assert_eq!(used.finish(), new.finish());
        }
    }

    #[test]
    fn a_recording_may_start_in_motion() {
        let samples: Vec<_> = walk().into_iter().filter(|sample| sample.time.0 > 4_000_000).collect();
        let (steps, _) = run(&samples);
        let (whole, _) = run(&walk());
        assert!(steps.len() >= whole.len() - 5, "{} of {}", steps.len(), whole.len());
        // The lengths of the run, long after the start; the tilt of the start has been found by then.
        let [length, height, _] = differences(&whole[whole.len() - 9..], &steps[steps.len() - 9..]);
        assert!(length < 0.03 && height < 0.02, "{length} m, {height} m");
    }

    #[test]
    fn what_the_map_says_of_the_ground_holds() {
        let mut tracker = Tracker::new(&Parameters::default());
        tracker.command_floor_mode(Some(FloorMode::Level));
        let mut steps: Vec<_> = walk().iter().filter_map(|sample| tracker.push(sample).step).collect();
        steps.extend(tracker.finish());
        assert!(steps.iter().all(|step| step.mode == FloorMode::Level && step.displacement.z.abs() < 0.05));
    }

    #[test]
    fn both_ways_tell_the_same_walk() {
        let mut tracker = Tracker::new(&Parameters::documented());
        let mut steps: Vec<_> = walk().iter().filter_map(|sample| tracker.push(sample).step).collect();
        steps.extend(tracker.finish());
        // The document's detector misses the stances of a run, as it says itself; it must find those of the walk.
        assert!((19..=STRIDES + 1).contains(&steps.len()), "{}", steps.len());
        assert!(steps[1..9].iter().all(|step| (step.length() - 1.35).abs() < 0.05));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn no_input_panics_or_makes_a_step_of_no_numbers(
            disturbances in proptest::collection::vec((0_usize..4_000, any::<[u32; 6]>(), -1_000_000_i64..5_000_000, any::<bool>()), 1..40),
            documented in any::<bool>(),
        ) {
            let mut samples = walk();
            for (at, bits, shift, clipped) in disturbances {
                let last = samples.len() - 1;
                let sample = &mut samples[at.min(last)];
                let values = bits.map(f32::from_bits);
                sample.accel.0 = Vector3::new(values[0], values[1], values[2]);
                sample.gyro.0 = Vector3::new(values[3], values[4], values[5]);
                sample.time = sample.time + shift;
                sample.clipped = Clipped { accel: clipped, gyro: clipped };
            }
            let parameters = if documented { Parameters::documented() } else { Parameters::default() };
            let mut tracker = Tracker::new(&parameters);
            let mut steps: Vec<_> = samples.iter().filter_map(|sample| tracker.push(sample).step).collect();
            steps.extend(tracker.finish());
            for step in steps {
                let numbers = step.displacement.iter().chain(step.covariance.iter());
                prop_assert!(step.turn.is_finite() && numbers.clone().all(|value| value.is_finite()));
                prop_assert!((0..4).all(|i| step.covariance[(i, i)] >= 0.0));
            }
        }
    }
}
