//! The way itself.

use super::Parameters;
use crate::filter::state::{self, POSITION, VELOCITY};
use crate::filter::unscented::UnscentedFilter;
use crate::sample::{AccelCorrected, ClippedSamples, GyroCorrected, ImuSample, STANDARD_GRAVITY_M_S2};
use crate::so3;
use crate::stance::{self, StanceDetector, Verdict};
use crate::step::{FloorMode, Step};
use crate::time::Micros;
use crate::tracker::ground::{Ground, Sight};
use crate::tracker::stride::{Event, StepBuilder};
use crate::tracker::{self, Counters, Detector, Insight, Output, State};
use nalgebra::Vector3;

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
    fn new(p: &tracker::Parameters) -> Self {
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
pub(in crate::tracker) struct Documented {
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
    pub(in crate::tracker) fn new(p: &tracker::Parameters) -> Self {
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

    pub(in crate::tracker) fn command(&mut self, mode: Option<FloorMode>) {
        self.ground.command(mode);
    }

    pub(in crate::tracker) fn initialise(&mut self, _: Option<Micros>) {
        self.phase = State::Init;
        self.calibration = Calibration::new();
        self.standing_since = None;
        self.steps.warn().gap = true;
    }

    /// This filter needs a rest to start from.
    pub(in crate::tracker) fn start_moving(&mut self) -> bool {
        false
    }

    /// The sensor slept until `time`, and the foot stood.
    pub(in crate::tracker) fn stood_until(&mut self, time: Micros, _: f32) {
        self.last = self.last.map(|last| last.max(time));
        self.steps.stood_until(time);
    }

    /// The foot stands on something that moves.
    pub(in crate::tracker) fn rides(&self) -> bool {
        self.ground.rides()
    }

    pub(in crate::tracker) fn phase(&self) -> State {
        self.phase
    }

    /// The detectors that can be chosen have nothing in common that could be watched.
    pub(in crate::tracker) fn insight(&self) -> Insight {
        let covariance = self.filter.covariance();
        Insight {
            statistic: f32::NAN,
            bound: f32::NAN,
            displacement_sigma: state::sigma(covariance, POSITION),
            velocity_sigma: state::sigma(covariance, VELOCITY),
        }
    }

    pub(in crate::tracker) fn foot(&self) -> &state::State {
        self.filter.state()
    }

    pub(in crate::tracker) fn push(&mut self, sample: &ImuSample, counters: &mut Counters) -> Output {
        let dt = self.last.replace(sample.time).map_or(0.0, |last| sample.time.since(last));
        let gyro = GyroCorrected(sample.gyro.0);
        let accel = AccelCorrected(sample.accel.0);
        if self.phase == State::Reset {
            self.phase = State::Init;
        }
        if self.phase == State::Init {
            self.calibrate(sample.time, gyro, accel, dt);
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
    fn calibrate(&mut self, time: Micros, gyro: GyroCorrected, accel: AccelCorrected, dt: f32) {
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

    pub(in crate::tracker) fn finish(&mut self, counters: &mut Counters) -> Option<Step> {
        match self.steps.finish() {
            Event::Complete => self.complete(self.ground.mode(), counters),
            Event::None => None,
        }
    }
}
