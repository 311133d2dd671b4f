//! The project's own way from samples to steps: increments, the adaptive detector, the pivot filter.
//!
//! The stance statistic of an increment is that of the three increments around it, so everything runs one increment (10 ms)
//! behind the samples.

use super::ground::{Finding, Ground, Sight};
use super::stride::{Event, StepBuilder};
use super::{Counters, Insight, Output, Parameters, State};
use crate::filter::pivot::PivotFilter;
use crate::filter::state::{POSITION, VELOCITY, sigma};
use crate::preintegration::{Increment, Preintegrator};
use crate::rest::RestDetector;
use crate::sample::{AccelBias, GyroBias, ImuSample, STANDARD_GRAVITY_M_S2};
use crate::stance::adaptive::Adaptive;
use crate::step::{FloorMode, Step};
use crate::time::Micros;
use nalgebra::Vector3;

/// A zero-velocity update weaker than this says nothing. **Units:** m/s.
const WEAKEST_UPDATE: f32 = 5.0;
/// A foot more restless than this swings, or is struck. **Units:** 1, the SHOE statistic.
const SWING_STATISTIC: f32 = 1e6;
/// A foot that seems faster has been lost; the tracker starts anew. **Units:** m/s.
const LOST_SPEED: f32 = 30.0;
/// What a rest that starts the tracker may vary more than one later on: nothing better may come.
const START_SPREAD: f32 = 3.0;
/// How far the repeated height updates of a stance reach in which they say all they know. **Units:** s.
const HEIGHT_TIME_S: f32 = 0.1;
/// How well the velocity is known that an elevator has when it is recognised. **Units:** m/s.
const RIDE_SPEED_SIGMA: f32 = 0.05;
/// How well an elevator stands still when it has stopped. **Units:** m/s.
const STOP_SIGMA: f32 = 0.01;

/// From samples to steps.
#[derive(Clone, Debug)]
pub(super) struct Own {
    start_after_s: f32,
    swing_speed: f32,
    preintegrator: Preintegrator,
    /// The two increments before the newest.
    ring: [Option<Increment>; 2],
    detector: Adaptive,
    rest: RestDetector,
    filter: PivotFilter,
    ground: Ground,
    steps: StepBuilder,
    state: State,
    waiting_since: Option<Micros>,
    /// Told not to wait for a rest.
    impatient: bool,
    repaired: u32,
    stance: bool,
}

impl Own {
    pub(super) fn new(p: &Parameters) -> Self {
        Self {
            start_after_s: p.start_after_s,
            swing_speed: p.stance.swing_speed,
            preintegrator: Preintegrator::new(&p.preintegration),
            ring: [None; 2],
            detector: Adaptive::new(&p.stance),
            rest: RestDetector::new(&p.rest),
            filter: PivotFilter::new(&p.filter),
            ground: Ground::new(&p.ground),
            steps: StepBuilder::new(&p.steps),
            state: State::Reset,
            waiting_since: None,
            impatient: false,
            repaired: 0,
            stance: false,
        }
    }

    /// As new. Part by part: a new one at once would take 5 kB of the stack, twice.
    pub(super) fn reset(&mut self, p: &Parameters) {
        let Self {
            start_after_s,
            swing_speed,
            preintegrator,
            ring,
            detector,
            rest,
            filter,
            ground,
            steps,
            state,
            waiting_since,
            impatient,
            repaired,
            stance,
        } = self;
        (*start_after_s, *swing_speed) = (p.start_after_s, p.stance.swing_speed);
        *preintegrator = Preintegrator::new(&p.preintegration);
        *ring = [None; 2];
        *detector = Adaptive::new(&p.stance);
        rest.restart(&p.rest);
        filter.restart(&p.filter);
        *ground = Ground::new(&p.ground);
        *steps = StepBuilder::new(&p.steps);
        *state = State::Reset;
        *waiting_since = None;
        *impatient = false;
        *repaired = 0;
        *stance = false;
    }

    pub(super) fn command(&mut self, mode: Option<FloorMode>) {
        self.ground.command(mode);
    }

    pub(super) fn initialise(&mut self, now: Option<Micros>) {
        self.state = State::Init;
        self.stance = false;
        self.waiting_since = now;
        self.impatient = false;
        self.rest.reset();
        self.detector.reset();
        self.steps.warn().gap = true;
    }

    /// The sensor slept until `time`, and the foot stood.
    pub(super) fn stood_until(&mut self, time: Micros, slept_s: f32) {
        self.preintegrator.stood_until(time);
        self.rest.reset();
        if self.state == State::Tracking {
            // The newest increment and the next one are no neighbours.
            self.ring = [None; 2];
            self.steps.stood_until(time);
            self.filter.stand(slept_s);
        } else {
            self.waiting_since = self.waiting_since.map(|since| since.max(time));
        }
    }

    /// The foot stands on something that moves.
    pub(super) fn rides(&self) -> bool {
        self.ground.rides()
    }

    pub(super) fn start_moving(&mut self) -> bool {
        self.impatient = self.state != State::Tracking;
        self.impatient
    }

    pub(super) fn push(&mut self, sample: &ImuSample, counters: &mut Counters) -> Output {
        if self.state == State::Reset {
            self.state = State::Init;
            self.waiting_since = Some(sample.time);
        }
        let (gyro_bias, accel_bias) = match self.state {
            State::Tracking => (self.filter.gyro_bias(), self.filter.accel_bias()),
            State::Reset | State::Init => (GyroBias::zero(), AccelBias::zero()),
        };
        let increment = self.preintegrator.push(sample, gyro_bias, accel_bias);
        let step = increment.and_then(|increment| {
            counters.gaps += u32::from(increment.gap);
            if self.state == State::Tracking {
                self.follow(increment, counters)
            } else {
                self.wait(&increment);
                None
            }
        });
        Output { state: self.state, stance: self.stance, reported: self.stance && self.steps.reported(), step }
    }

    /// INIT: waits for a rest, or, when none comes, for the first stance.
    fn wait(&mut self, increment: &Increment) {
        if increment.gap {
            self.rest.reset();
            self.detector.reset();
            return;
        }
        let (accel, gyro) = (increment.accel_mean(), increment.gyro_mean());
        if let Some(rest) = self.rest.push(increment.end, &accel, &gyro, START_SPREAD) {
            self.filter.start(&rest.accel, Some((rest.gyro, rest.bias_sigma)));
            self.track();
            return;
        }
        let statistic = self.statistic(&[Some(*increment)]);
        let verdict = self.detector.judge(increment.end, statistic, None);
        let waiting_since = *self.waiting_since.get_or_insert(increment.end);
        let waited = self.impatient || increment.end.since(waiting_since) > self.start_after_s;
        if waited && verdict.stance && verdict.velocity_sigma.is_some() {
            self.filter.start(&accel, None);
            self.track();
        }
    }

    fn track(&mut self) {
        self.state = State::Tracking;
        self.impatient = false;
        self.ring = [None; 2];
        self.detector.reset();
        self.rest.reset();
        self.ground.reset();
    }

    /// TRACKING: the newest increment completes the neighbourhood of the one before.
    fn follow(&mut self, newest: Increment, counters: &mut Counters) -> Option<Step> {
        let around = [self.ring[0], self.ring[1], Some(newest)];
        self.ring = [around[1], around[2]];
        let increment = around[1]?;
        let dt = increment.duration();

        self.steps.count(increment.clipped);
        self.steps.warn().gap |= increment.gap;

        self.filter.predict(&increment);
        let statistic = if around.iter().flatten().any(|increment| increment.gap) {
            f32::INFINITY
        } else {
            self.statistic(&around)
        };
        let speed = self.filter.speed();
        let verdict = self.detector.judge(increment.end, statistic, Some(speed));
        self.stance = verdict.stance;

        let since = self.detector.standing_since();
        let state = self.filter.state();
        let acceleration = (state.attitude * increment.accel_mean()).z - STANDARD_GRAVITY_M_S2;
        let height = POSITION + 2;
        let stood_on = self.ground.mode();
        let finding = self.ground.observe(&Sight {
            dt,
            standing: since.map(|since| increment.end.since(since)),
            acceleration,
            rate: libm::sqrtf(increment.gyro_mean().norm_squared()),
            velocity: state.velocity.z,
            height: state.position.z,
            height_sigma: libm::sqrtf(self.filter.covariance()[(height, height)].max(0.0)),
        });
        self.correct(&increment, verdict.velocity_sigma, &finding, dt);

        // Where the filter is in doubt, as after a hole, a swing shows by its restlessness.
        let swings = speed.certain > self.swing_speed
            || (speed.likely > self.swing_speed && statistic > SWING_STATISTIC && statistic.is_finite());
        let event = self.steps.observe(increment.end, since, statistic, swings);
        let complete = event == Event::Complete && !finding.riding;
        let mode = if since.is_some() { finding.mode } else { stood_on };
        let step = if complete { self.complete(mode, counters) } else { None };

        let numbers = self.filter.is_finite() && step.is_some() == complete;
        if !numbers {
            self.filter.start(&Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2), None);
        }
        if !numbers || self.filter.state().velocity.norm_squared() > LOST_SPEED * LOST_SPEED {
            counters.restarts += 1;
            self.initialise(Some(increment.end));
        }
        step
    }

    fn correct(&mut self, increment: &Increment, velocity_sigma: Option<f32>, finding: &Finding, dt: f32) {
        if let Some(velocity) = finding.ride_begins {
            self.filter.begin_ride(velocity, RIDE_SPEED_SIGMA);
        }
        if finding.ride_ends && self.stance {
            self.filter.update_zero_vertical_velocity(STOP_SIGMA);
            self.steps.reopen();
        }
        if let Some(sigma) = velocity_sigma.filter(|sigma| *sigma < WEAKEST_UPDATE) {
            self.filter.update_zero_velocity(sigma, finding.riding);
        }
        let (accel, gyro) = (increment.accel_mean(), increment.gyro_mean());
        if increment.gap || finding.riding {
            self.rest.reset();
        } else if let Some(rest) = self.rest.push(increment.end, &accel, &gyro, 1.0) {
            self.filter.update_rest(&rest.gyro, rest.bias_sigma, &rest.accel);
        }
        if finding.hold_height {
            self.filter.update_height(0.0, dt / HEIGHT_TIME_S);
        }
    }

    /// The step of a stance on ground of this kind; none when the filter no longer has numbers for it.
    fn complete(&mut self, mode: FloorMode, counters: &mut Counters) -> Option<Step> {
        let change = self.filter.rebase();
        self.ground.rebased();
        counters.repaired = self.filter.repaired();
        if self.filter.repaired() != self.repaired {
            self.repaired = self.filter.repaired();
            self.steps.warn().repaired = true;
        }
        if change.is_finite() { self.steps.take(change, mode, self.stance) } else { None }
    }

    pub(super) fn finish(&mut self, counters: &mut Counters) -> Option<Step> {
        match self.steps.finish() {
            Event::Complete => self.complete(self.ground.mode(), counters),
            Event::None => None,
        }
    }

    fn statistic(&self, around: &[Option<Increment>]) -> f32 {
        let mut count = 0.0;
        let (mut accel, mut accel_square, mut gyro_square) = (Vector3::zeros(), 0.0, 0.0);
        for increment in around.iter().flatten() {
            count += f32::from(increment.samples);
            accel += increment.accel_sum;
            accel_square += increment.accel_square_sum;
            gyro_square += increment.gyro_square_sum;
        }
        self.detector.statistic(count, &accel, accel_square, gyro_square, STANDARD_GRAVITY_M_S2)
    }

    pub(super) fn phase(&self) -> State {
        self.state
    }

    pub(super) fn insight(&self) -> Insight {
        let covariance = self.filter.covariance();
        Insight {
            statistic: self.detector.latest().unwrap_or(f32::NAN),
            bound: self.detector.bound(),
            displacement_sigma: sigma(covariance, POSITION),
            velocity_sigma: sigma(covariance, VELOCITY),
        }
    }

    pub(super) fn foot(&self) -> &crate::filter::state::State {
        self.filter.state()
    }
}
