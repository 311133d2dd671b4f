//! The guide through a calibration: samples in, what to do next and what has been done out.
//!
//! It asks for nothing that it cannot see: a rest of some seconds in an attitude that it does not know yet is taken,
//! whichever was asked for. The holder of the sensor may stop at any time; [`Guide::outcome`] says what is known by then.

use super::ellipsoid::Fit;
use super::noise::Noise;
use super::pose::{Direction, Pose, Refusal, SixPose};
use super::verdict::{Property, Verdict};
use super::{Calibration, Quality};
use crate::preintegration::{self, Preintegrator};
use crate::rest::{self, Rest, RestDetector};
use crate::sample::{AccelBias, GyroBias, ImuSample};
use crate::time::Micros;
use nalgebra::Vector3;

/// Settings of [`Guide`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Parameters {
    /// How long each pose is held. **Units:** s.
    pub hold_s: f32,
    /// What a rest is.
    pub rest: rest::Parameters,
}

impl Default for Parameters {
    fn default() -> Self {
        // 3 s less the first rest show the force to 0.7e-3 m/s² and the rate to 0.006 deg/s (white noise of the data
        // sheet), below what the temperature does. The rate may be what the data sheet allows an uncorrected bias, 1 deg/s, five times.
        let rest = rest::Parameters { gyro_mean: 5.0_f32.to_radians(), ..Default::default() };
        Self { hold_s: 3.0, rest }
    }
}

/// What the holder of the sensor should do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Prompt {
    /// Lay it down so that this direction of the sensor points up, and let go of it.
    Turn(Direction),
    /// Leave it lying; this direction points up.
    Hold(Direction),
    /// Nothing more; further poses do no harm.
    Done,
}

impl core::fmt::Display for Prompt {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Turn(up) => write!(out, "lay the sensor down with {up} up and let go of it"),
            Self::Hold(up) => write!(out, "leave it lying with {up} up"),
            Self::Done => out.write_str("all poses are taken"),
        }
    }
}

/// What a sample led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Event {
    /// A pose was taken.
    Accepted {
        /// Which way was up.
        up: Direction,
        /// How many were taken so far.
        poses: u8,
        /// How many are still wanted.
        missing: u8,
    },
    /// A rest was not taken.
    Refused {
        /// Which way was up.
        up: Direction,
        /// Why.
        reason: Refusal,
    },
}

/// What a calibration came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// What was found; what was not found changes nothing.
    pub calibration: Calibration,
    /// How good the sensor and the calibration are.
    pub verdict: Verdict,
}

/// Rests that follow each other, as long as the sensor lies still.
///
/// The first is the earliest half second that passes for a rest, so the hand's last trembling is in it: it says where
/// the sensor lies, but is neither part of the sums nor of the noise.
#[derive(Clone, Copy, Debug)]
struct Hold {
    since: Micros,
    last: Micros,
    first: Vector3<f32>,
    accel: Vector3<f32>,
    gyro: Vector3<f32>,
    rests: u16,
    clipped: bool,
    /// Whether it was taken or refused.
    told: bool,
}

impl Hold {
    fn new(time: Micros, first: &Rest) -> Self {
        let sum = Vector3::zeros();
        Self {
            since: time,
            last: time,
            first: first.accel,
            accel: sum,
            gyro: sum,
            rests: 1,
            clipped: false,
            told: false,
        }
    }

    /// Mean of one of the sums, once there was more than the first rest.
    fn mean(&self, sum: &Vector3<f32>) -> Vector3<f32> {
        sum / f32::from(self.rests.saturating_sub(1).max(1))
    }

    fn up(&self) -> Direction {
        Direction::nearest(&self.first)
    }

    /// Refuses what was too short, once it was long enough to be meant.
    fn broken(self) -> Option<Event> {
        (!self.told && self.rests >= MEANT_RESTS).then(|| Event::Refused { up: self.up(), reason: Refusal::Moved })
    }
}

/// After so many rests the sensor was laid down on purpose.
const MEANT_RESTS: u16 = 2;
/// Rests follow each other within half a second; after this the sensor has moved. **Units:** s.
const LOST_S: f32 = 0.75;
/// Rests whose forces differ by more are not the same: 1 degree of tilt. **Units:** m/s².
const SAME_M_S2: f32 = 0.17;
/// The temperature that stands for an unknown one. **Units:** °C.
const UNKNOWN_C: f32 = 25.0;
/// What a pose shows of the gyroscope's bias. **Units:** rad/s.
const POSE_SIGMA: f32 = 0.01 * core::f32::consts::PI / 180.0;

/// Leads through a calibration.
#[derive(Clone, Debug)]
pub struct Guide {
    hold_s: f32,
    integrator: Preintegrator,
    detector: RestDetector,
    noise: Noise,
    poses: SixPose,
    hold: Option<Hold>,
    samples: u32,
    clipped: u32,
    now: Micros,
    temperature: Option<f32>,
}

impl Guide {
    /// A guide that has seen nothing; `gravity` is that of the place. **Units:** m/s².
    pub fn new(parameters: &Parameters, gravity: f32) -> Self {
        Self {
            hold_s: parameters.hold_s,
            integrator: Preintegrator::new(&preintegration::Parameters::default()),
            detector: RestDetector::new(&parameters.rest),
            noise: Noise::default(),
            poses: SixPose::new(gravity),
            hold: None,
            samples: 0,
            clipped: 0,
            now: Micros(0),
            temperature: None,
        }
    }

    /// Takes in a sample as measured, and the temperature of the dies if it is known. **Units:** °C.
    pub fn push(&mut self, sample: &ImuSample, temperature: Option<f32>) -> Option<Event> {
        self.now = sample.time;
        self.temperature = temperature.filter(|value| value.is_finite());
        self.samples = self.samples.saturating_add(1);
        if sample.clipped.accel || sample.clipped.gyro {
            self.clipped = self.clipped.saturating_add(1);
            if let Some(hold) = &mut self.hold {
                hold.clipped = true;
            }
        }
        let increment = self.integrator.push(sample, GyroBias::zero(), AccelBias::zero())?;
        if increment.gap {
            self.detector.reset();
            return self.hold.take().and_then(Hold::broken);
        }
        match self.detector.push(increment.end, &increment.accel_mean(), &increment.gyro_mean(), 1.0) {
            Some(rest) => self.rested(increment.end, &rest, increment.duration()),
            None => {
                let lost = self.hold.is_some_and(|hold| increment.end.since(hold.last) > LOST_S);
                if lost { self.hold.take().and_then(Hold::broken) } else { None }
            }
        }
    }

    /// Goes on with the hold, or begins a new one. **Units:** period of the increments in s.
    fn rested(&mut self, time: Micros, rest: &Rest, period: f32) -> Option<Event> {
        let same = |hold: &Hold| (hold.first - rest.accel).norm_squared() <= SAME_M_S2 * SAME_M_S2;
        let Some(mut hold) = self.hold.filter(same) else {
            return self.hold.replace(Hold::new(time, rest)).and_then(Hold::broken);
        };
        self.noise.push(time, rest, period);
        hold.last = time;
        hold.accel += rest.accel;
        hold.gyro += rest.gyro;
        hold.rests = hold.rests.saturating_add(1);
        let event = if hold.told { None } else { self.judge(&hold) };
        hold.told |= event.is_some();
        // A pose that was told stays as it was: the sums need not grow without end.
        if !hold.told {
            self.hold = Some(hold);
        } else if let Some(kept) = &mut self.hold {
            (kept.last, kept.told) = (time, true);
        }
        event
    }

    fn judge(&mut self, hold: &Hold) -> Option<Event> {
        let accel = hold.mean(&hold.accel);
        let refused = |reason| Some(Event::Refused { up: hold.up(), reason });
        if let Err(reason) = self.poses.examine(&accel) {
            return if hold.rests >= MEANT_RESTS { refused(reason) } else { None };
        }
        if hold.last.since(hold.since) + FIRST_REST_S < self.hold_s {
            return None;
        }
        if hold.clipped {
            return refused(Refusal::Clipped);
        }
        let gyro = hold.mean(&hold.gyro);
        match self.poses.push(Pose { accel, gyro, temperature: self.temperature }) {
            Ok(up) => {
                // Both at most 24.
                let (poses, missing) = (self.poses.poses().len() as u8, self.poses.missing().count() as u8);
                Some(Event::Accepted { up, poses, missing })
            }
            Err(reason) => refused(reason),
        }
    }

    /// What to do now.
    pub fn prompt(&self) -> Prompt {
        match (self.hold.filter(|hold| !hold.told), self.poses.missing().next()) {
            (Some(hold), _) => Prompt::Hold(hold.up()),
            (None, Some(up)) => Prompt::Turn(up),
            (None, None) => Prompt::Done,
        }
    }

    /// Whether every pose that is wanted was taken.
    pub fn is_complete(&self) -> bool {
        self.poses.missing().next().is_none()
    }

    /// How far the whole is, from 0 to 1.
    pub fn progress(&self) -> f32 {
        let wanted = Direction::WANTED.len() as f32;
        let held = self.hold.filter(|hold| !hold.told).map_or(0.0, |hold| {
            let seconds = self.now.since(hold.since) + FIRST_REST_S;
            (seconds / self.hold_s).clamp(0.0, 1.0)
        });
        let taken = wanted - self.poses.missing().count() as f32;
        ((taken + held) / wanted).min(1.0)
    }

    /// The poses taken so far.
    pub fn poses(&self) -> &SixPose {
        &self.poses
    }

    /// What is known now.
    pub fn outcome(&self) -> Outcome {
        let mut verdict = Verdict::default();
        let mut calibration = Calibration { temperature: self.poses.temperature(), ..Calibration::default() };
        let short = self.noise.short();
        let long = self.noise.long();
        for (density, gyro, accel) in
            [(short, Property::GyroNoise, Property::AccelNoise), (long, Property::GyroDrift, Property::AccelDrift)]
        {
            if let Some(density) = density {
                verdict.add(gyro, density.gyro);
                verdict.add(accel, density.accel);
            }
        }
        if self.samples > 0 {
            verdict.add(Property::Clipped, self.clipped as f32 / self.samples as f32);
        }
        match self.poses.fit_accel() {
            Ok(fit) => {
                calibration.accel = fit.correction;
                report(&fit, &mut verdict);
                calibration.quality = Quality {
                    grade: verdict.grade(),
                    poses: self.poses.poses().len() as u8,
                    residual: fit.residual,
                    bias_sigma: fit.bias_sigma,
                    scale_sigma: fit.scale_sigma,
                };
            }
            Err(error) => verdict.unfit = Some(error),
        }
        if let Some(fit) = self.poses.fit_gyro() {
            calibration.gyro_per_accel = [0, 1, 2].map(|row| fit.per_accel.row(row).transpose().into());
            verdict.add(Property::GyroPerAccel, fit.per_accel.amax());
        }
        for pose in self.poses.poses() {
            calibration.learn(pose.temperature.unwrap_or(UNKNOWN_C), &pose.accel, &pose.gyro, POSE_SIGMA);
        }
        if let Some(bias) = calibration.gyro.bias(calibration.temperature) {
            verdict.add(Property::GyroBias, bias.amax());
        }
        if let Some(slope) = calibration.gyro.slope() {
            verdict.add(Property::GyroPerKelvin, slope.amax());
        }
        calibration.quality.grade = verdict.grade();
        Outcome { calibration, verdict }
    }
}

/// The time that the first rest of a hold took before it ended. **Units:** s.
const FIRST_REST_S: f32 = 0.5;

/// What the fit says of the accelerometer and of itself.
fn report(fit: &Fit, verdict: &mut Verdict) {
    let largest = |values: [f32; 3]| Vector3::from(values).amax();
    verdict.add(Property::AccelBias, largest(fit.correction.bias));
    verdict.add(Property::AccelScale, largest(fit.correction.scale.map(|factor| factor - 1.0)));
    verdict.add(Property::AccelCross, largest(fit.correction.cross));
    verdict.add(Property::Residual, fit.residual);
    verdict.add(Property::BiasSigma, fit.bias_sigma);
    verdict.add(Property::ScaleSigma, fit.scale_sigma);
    verdict.add(Property::CrossSigma, fit.cross_sigma);
    verdict.add(Property::Redundancy, fit.redundancy);
}

#[cfg(test)]
mod tests {
    use super::super::DEG;
    use super::*;
    use crate::calibration::{Correction, Grade};
    use crate::sample::STANDARD_GRAVITY_M_S2;
    use proptest::prelude::*;
    use std::vec::Vec;

    const G: f32 = STANDARD_GRAVITY_M_S2;

    /// Hands a sensor with some errors from pose to pose, 100 samples a second.
    struct Hand {
        guide: Guide,
        time: Micros,
        events: Vec<Event>,
    }

    impl Hand {
        fn new() -> Self {
            Self { guide: Guide::new(&Parameters::default(), G), time: Micros(0), events: Vec::new() }
        }

        fn give(&mut self, seconds: f32, motion: impl Fn(f32) -> (Vector3<f32>, Vector3<f32>)) {
            for i in 0..(seconds * 100.0) as i32 {
                self.time = self.time + 10_000;
                let (force, rate) = motion(i as f32 * 0.01);
                // A little of both signs in turn keeps the noise from being nothing.
                let noise = if i % 2 == 0 { 0.01 } else { -0.01 };
                let sample =
                    ImuSample::new(self.time, force.add_scalar(noise).into(), rate.add_scalar(0.1 * noise).into());
                self.events.extend(self.guide.push(&sample, Some(24.0)));
            }
        }

        fn rest(&mut self, up: Direction, seconds: f32) {
            let force = reading(up);
            self.give(1.0, |t| (force + Vector3::repeat(3.0 * libm::sinf(20.0 * t)), Vector3::repeat(2.0)));
            self.give(seconds, |_| (force, BIAS));
        }
    }

    const BIAS: Vector3<f32> = Vector3::new(0.6 * DEG, -0.3 * DEG, 0.2 * DEG);
    const ERROR: Correction =
        Correction { bias: [0.4, -0.3, 0.2], scale: [1.01, 0.99, 1.005], cross: [2e-3, -3e-3, 1e-3] };

    fn reading(up: Direction) -> Vector3<f32> {
        let force = Vector3::from(up.0.map(f32::from)).normalize() * G;
        ERROR.matrix().try_inverse().unwrap() * force + Vector3::from(ERROR.bias)
    }

    #[test]
    fn it_leads_through_all_poses_and_finds_the_errors() {
        let mut hand = Hand::new();
        let mut progress = 0.0;
        while let Prompt::Turn(up) = hand.guide.prompt() {
            hand.rest(up, 4.0);
            assert_eq!(hand.events.len(), hand.guide.poses().poses().len(), "{:?}", hand.events);
            assert!(hand.guide.progress() > progress);
            progress = hand.guide.progress();
        }
        assert_eq!(hand.guide.prompt(), Prompt::Done);
        assert_eq!((hand.events.len(), progress), (12, 1.0));
        let Outcome { calibration, verdict } = hand.guide.outcome();
        assert_eq!(verdict.grade(), Grade::Good, "{verdict:?}");
        let off = Vector3::from(calibration.accel.bias) - Vector3::from(ERROR.bias);
        assert!(off.amax() < 1e-3, "{off}");
        let rest = ImuSample::new(Micros(0), reading(Direction([1, 1, 1])).into(), BIAS.into());
        let corrected = calibration.apply(&rest, Some(24.0));
        // The alternating noise is 1e-3 rad/s and not white; its mean over a rest of 51 samples is left.
        assert!((corrected.accel.0.norm() - G).abs() < 2e-3 && corrected.gyro.0.amax() < 0.02 * DEG, "{corrected:?}");
    }

    #[test]
    fn it_refuses_what_is_too_short_or_was_there_and_goes_on() {
        let up = Direction([0, 0, 1]);
        let mut hand = Hand::new();
        hand.rest(up, 2.0);
        hand.rest(up, 4.0);
        hand.rest(up, 4.0);
        hand.give(2.0, |t| (reading(up), Vector3::repeat(2.0 * t)));
        let accepted = Event::Accepted { up, poses: 1, missing: 11 };
        let refused = |reason| Event::Refused { up, reason };
        assert_eq!(hand.events, [refused(Refusal::Moved), accepted, refused(Refusal::Duplicate)]);
        assert!(matches!(hand.guide.prompt(), Prompt::Turn(_)));
        assert_eq!(hand.guide.outcome().verdict.grade(), Grade::Bad);
        assert!(hand.guide.outcome().verdict.unfit.is_some());
    }

    #[test]
    fn what_a_hand_trembles_before_it_lets_go_is_no_noise_of_the_sensor() {
        let noise = |trembling: f32| {
            let mut hand = Hand::new();
            for &up in &Direction::WANTED[..6] {
                let force = reading(up);
                hand.give(1.0, |_| (force, Vector3::repeat(2.0)));
                // Dies away within a third of a second: the first rest begins in it.
                let rate = |t: f32| BIAS.add_scalar(trembling * libm::sinf(12.0 * t) * libm::expf(-10.0 * t));
                hand.give(4.0, |t| (force, rate(t)));
            }
            let Outcome { calibration, verdict } = hand.guide.outcome();
            assert_eq!(calibration.quality.poses, 6);
            let noise = |property| verdict.findings().find(|finding| finding.property == property).unwrap().value;
            (noise(Property::GyroNoise), noise(Property::GyroDrift))
        };
        let (quiet, trembling) = (noise(0.0), noise(0.15));
        // What is left 0.6 s after it began to die away: 0.15 rad/s times e^-6, a third of the noise.
        assert!(trembling.0 < 1.1 * quiet.0, "{trembling:?} {quiet:?}");
        // This noise changes its sign from sample to sample, so over half a second there is none but what trembles.
        assert!(trembling.1 < 0.1 * quiet.0, "{trembling:?} {quiet:?}");
    }

    #[test]
    fn a_clipped_rest_is_refused() {
        let mut hand = Hand::new();
        for i in 0..500 {
            let mut sample = ImuSample::new(Micros(i * 10_000), [0.0, 0.0, G], [0.0; 3]);
            sample.clipped.gyro = true;
            hand.events.extend(hand.guide.push(&sample, None));
        }
        assert_eq!(hand.events, [Event::Refused { up: Direction([0, 0, 1]), reason: Refusal::Clipped }]);
    }

    #[test]
    fn six_poses_are_acceptable() {
        let mut hand = Hand::new();
        Direction::WANTED[..6].iter().for_each(|&up| hand.rest(up, 4.0));
        let Outcome { calibration, verdict } = hand.guide.outcome();
        assert_eq!(verdict.grade(), Grade::Acceptable, "{verdict:?}");
        // The misalignment was not seen; 0.3 % of it costs up to its square in the scale.
        let off = Vector3::from(calibration.accel.scale) - Vector3::from(ERROR.scale);
        assert!(off.amax() < 1e-4, "{off}");
    }

    proptest! {
        #[test]
        fn nothing_makes_it_panic(
            samples in proptest::collection::vec(
                (any::<i64>(), proptest::array::uniform6(proptest::num::f32::ANY), proptest::num::f32::ANY), 0..200),
        ) {
            let mut guide = Guide::new(&Parameters::default(), G);
            for (time, [a, b, c, d, e, f], temperature) in samples {
                let sample = ImuSample::new(Micros(time), [a, b, c], [d, e, f]);
                guide.push(&sample, Some(temperature));
            }
            prop_assert!((0.0..=1.0).contains(&guide.progress()));
            prop_assert!(guide.outcome().calibration.is_finite());
        }
    }
}
