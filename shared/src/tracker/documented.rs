//! The document's way from samples to steps (Foot, chapter 4): the unscented filter on each sample, and a detector by
//! threshold. The other classical detectors can stand in for the document's, as baselines.

use super::ground::{Ground, Sight};
use super::stride::{Event, StepBuilder};
use super::{Counters, Detector, Output, State};
use crate::filter::state::{self, POSITION};
use crate::filter::unscented::{self, UnscentedFilter};
use crate::sample::{AccelCorrected, ClippedSamples, GyroCorrected, ImuSample, STANDARD_GRAVITY_M_S2};
use crate::so3;
use crate::stance::{self, StanceDetector, Verdict};
use crate::step::{FloorMode, Step};
use crate::time::Micros;
use nalgebra::Vector3;

/// Settings of the document's way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Which detector tells the stances.
    pub detector: Detector,
    /// Samples that gravity is taken from (4.73).
    pub gravity_samples: u16,
    /// How long INIT goes on after that, if the foot stays still. **Units:** s.
    pub init_s: f32,
    /// The filter.
    pub filter: unscented::Parameters,
    /// Detector `documented`; its thresholds for standing also tell whether the foot is still in INIT.
    pub documented: stance::documented::Parameters,
    /// Detector `shoe`.
    pub shoe: stance::shoe::Parameters,
    /// Detector `ared`.
    pub ared: stance::ared::Parameters,
    /// Detector `amv`.
    pub amv: stance::amv::Parameters,
    /// Detector `mag`.
    pub mag: stance::mag::Parameters,
}

impl Default for Parameters {
    /// The document's values (table 4.1, 4.66 - 4.80).
    fn default() -> Self {
        Self {
            detector: Detector::Documented,
            gravity_samples: 100,
            init_s: 0.5,
            filter: Default::default(),
            documented: Default::default(),
            shoe: Default::default(),
            ared: Default::default(),
            amv: Default::default(),
            mag: Default::default(),
        }
    }
}

#[derive(Clone, Debug)]
enum AnyDetector {
    Documented(stance::documented::Documented),
    Shoe(stance::shoe::Shoe),
    Ared(stance::ared::Ared),
    Amv(stance::amv::Amv),
    Mag(stance::mag::Mag),
    Adaptive(stance::adaptive::FromSamples),
}

impl AnyDetector {
    fn new(p: &super::Parameters) -> Self {
        let d = &p.document;
        match d.detector {
            Detector::Documented => Self::Documented(stance::documented::Documented::new(&d.documented)),
            Detector::Shoe => Self::Shoe(stance::shoe::Shoe::new(&d.shoe)),
            Detector::Ared => Self::Ared(stance::ared::Ared::new(&d.ared)),
            Detector::Amv => Self::Amv(stance::amv::Amv::new(&d.amv)),
            Detector::Mag => Self::Mag(stance::mag::Mag::new(&d.mag)),
            Detector::Adaptive => Self::Adaptive(stance::adaptive::FromSamples::new(&p.stance)),
        }
    }

    fn any(&mut self) -> &mut dyn StanceDetector {
        match self {
            Self::Documented(detector) => detector,
            Self::Shoe(detector) => detector,
            Self::Ared(detector) => detector,
            Self::Amv(detector) => detector,
            Self::Mag(detector) => detector,
            Self::Adaptive(detector) => detector,
        }
    }
}

/// What has been gathered in INIT.
#[derive(Clone, Copy, Debug)]
struct Calibration {
    samples: u16,
    accel: Vector3<f32>,
    norm: f32,
    /// When gravity was known and the filter began.
    begun: Option<Micros>,
}

impl Calibration {
    fn new() -> Self {
        Self { samples: 0, accel: Vector3::zeros(), norm: 0.0, begun: None }
    }
}

/// A hole in the samples that the step after it is warned of. **Units:** s.
const GAP_S: f32 = 0.1;

/// From samples to steps.
#[derive(Clone, Debug)]
pub(super) struct Documented {
    parameters: Parameters,
    detector: AnyDetector,
    filter: UnscentedFilter,
    ground: Ground,
    steps: StepBuilder,
    phase: State,
    gravity: f32,
    calibration: Calibration,
    last: Option<Micros>,
    standing_since: Option<Micros>,
    repaired: u32,
}

impl Documented {
    pub(super) fn new(p: &super::Parameters) -> Self {
        Self {
            parameters: p.document,
            detector: AnyDetector::new(p),
            filter: UnscentedFilter::new(&p.document.filter),
            ground: Ground::new(&p.ground),
            steps: StepBuilder::new(&p.steps),
            phase: State::Reset,
            gravity: STANDARD_GRAVITY_M_S2,
            calibration: Calibration::new(),
            last: None,
            standing_since: None,
            repaired: 0,
        }
    }

    pub(super) fn command(&mut self, mode: Option<FloorMode>) {
        self.ground.command(mode);
    }

    pub(super) fn initialise_anew(&mut self) {
        self.phase = State::Init;
        self.calibration = Calibration::new();
        self.standing_since = None;
        self.steps.warn().gap = true;
    }

    pub(super) fn phase(&self) -> State {
        self.phase
    }

    pub(super) fn foot(&self) -> &state::State {
        self.filter.state()
    }

    pub(super) fn push(&mut self, sample: &ImuSample, counters: &mut Counters) -> Output {
        let dt = self.last.replace(sample.time).map_or(0.0, |last| sample.time.since(last));
        let gyro = GyroCorrected(sample.gyro.0);
        let accel = AccelCorrected(sample.accel.0);
        if self.phase == State::Reset {
            self.phase = State::Init;
        }
        if self.phase == State::Init {
            self.initialise(sample.time, gyro, accel, dt);
            return Output { state: self.phase, stance: false, reported: false, step: None };
        }
        if dt > GAP_S {
            counters.gaps += 1;
            self.steps.warn().gap = true;
        }
        let mut clipped = ClippedSamples::default();
        clipped.count(sample.clipped);
        self.steps.count(clipped);

        let verdict = self.detector.any().push(sample.time, accel, gyro, self.gravity);
        self.filter.predict(gyro, accel, dt);
        self.standing_since = verdict.stance.then(|| self.standing_since.unwrap_or(sample.time));
        let step = self.stand(sample.time, gyro, accel, dt, &verdict, counters);
        Output { state: self.phase, stance: verdict.stance, reported: verdict.stance && self.steps.reported(), step }
    }

    /// INIT (4.4.2.1): gravity from some samples of a still foot, then H1, H2 and H3.
    fn initialise(&mut self, time: Micros, gyro: GyroCorrected, accel: AccelCorrected, dt: f32) {
        let p = &self.parameters;
        let rate = libm::sqrtf(gyro.0.norm_squared());
        let norm = libm::sqrtf(accel.0.norm_squared());
        let still =
            rate <= p.documented.max_gyro_norm && libm::fabsf(norm - self.gravity) <= p.documented.max_accel_norm;
        if let Some(begun) = self.calibration.begun {
            self.filter.predict(gyro, accel, dt);
            if still && time.since(begun) < p.init_s {
                self.filter.initialise(accel);
            } else {
                self.phase = State::Tracking;
            }
            return;
        }
        if !still {
            self.calibration = Calibration::new();
            return;
        }
        self.calibration.samples += 1;
        self.calibration.accel += accel.0;
        self.calibration.norm += norm;
        if self.calibration.samples >= p.gravity_samples.max(1) {
            self.gravity = self.calibration.norm / f32::from(self.calibration.samples);
            self.filter.start(so3::level(&self.calibration.accel), self.gravity);
            self.calibration.begun = Some(time);
        }
    }

    fn stand(
        &mut self,
        time: Micros,
        gyro: GyroCorrected,
        accel: AccelCorrected,
        dt: f32,
        verdict: &Verdict,
        counters: &mut Counters,
    ) -> Option<Step> {
        let state = self.filter.state();
        let height = POSITION + 2;
        let stood_on = self.ground.mode();
        let finding = self.ground.observe(&Sight {
            dt,
            standing: self.standing_since.map(|since| time.since(since)),
            acceleration: (state.attitude * accel.0).z - self.gravity,
            rate: libm::sqrtf(gyro.0.norm_squared()),
            velocity: state.velocity.z,
            height: state.position.z,
            height_sigma: libm::sqrtf(self.filter.covariance()[(height, height)].max(0.0)),
        });
        if verdict.stance {
            // Until it is seen whether the stride was level, the height is left alone as on stairs.
            let mode = match finding.mode {
                FloorMode::Level if !finding.hold_height => FloorMode::Stairs,
                mode => mode,
            };
            self.filter.stand(accel, mode, 0.0);
        }
        if finding.ride_ends && verdict.stance {
            self.steps.reopen();
        }
        let event = self.steps.observe(time, self.standing_since, verdict.statistic, !verdict.stance);
        if event == Event::Complete && !finding.riding {
            let mode = if self.standing_since.is_some() { finding.mode } else { stood_on };
            self.complete(mode, counters)
        } else {
            None
        }
    }

    /// The step of a stance on ground of this kind.
    fn complete(&mut self, mode: FloorMode, counters: &mut Counters) -> Option<Step> {
        let change = self.filter.rebase();
        self.ground.rebased();
        counters.repaired = self.filter.repaired();
        if self.filter.repaired() != self.repaired {
            self.repaired = self.filter.repaired();
            self.steps.warn().repaired = true;
        }
        self.steps.take(change, mode, self.standing_since.is_some())
    }

    pub(super) fn finish(&mut self, counters: &mut Counters) -> Option<Step> {
        match self.steps.finish() {
            Event::Complete => self.complete(self.ground.mode(), counters),
            Event::None => None,
        }
    }
}
