//! The moving foot: position, velocity, acceleration, attitude and angular rate of the sensor at any moment.
//!
//! All of it comes from one formula for position and attitude (see [`Jet`]): integrating the rates and accelerations gives
//! the positions back.
//!
//! The shoe's attitude is `Rz(heading) Ry(-pitch) Rx(roll)`; with `c` the point of the sole about which it turns (ball
//! or heel), `b` the way of the sole's reference point and `s` the sensor's place, the sensor is at
//! `b + Rz c + Rz Ry Rx (s - c)`. In a flat stance this is `b + Rz s`, whichever point `c` is.

use super::gait::{BALL_M, HEEL_M};
use super::jet::Jet;
use super::mounting::Mounting;
use super::plan::{Action, Foothold, Plan, Segment, Stride};
use super::profile::{knock, pulse, ramp, spline};
use super::random::Random;
use crate::recording::TruthStance;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use sohle_shared::time::Micros;
use std::collections::VecDeque;
use std::f64::consts::PI;

/// State of the sensor at one moment, without errors. **Frame:** world (z up) unless stated otherwise.
#[derive(Clone, Copy, Debug)]
pub struct Kinematics {
    /// **Units:** m.
    pub position: Vector3<f64>,
    /// **Units:** m/s.
    pub velocity: Vector3<f64>,
    /// Without gravity. **Units:** m/s².
    pub acceleration: Vector3<f64>,
    /// Turns sensor vectors into the world.
    pub attitude: UnitQuaternion<f64>,
    /// Angular rate. **Units:** rad/s; **Frame:** sensor.
    pub rate: Vector3<f64>,
}

impl Kinematics {
    /// What an accelerometer without errors measures: `Q^-1 (a + g up)`. **Units:** m/s²; **Frame:** sensor.
    pub fn specific_force(&self, gravity: f64) -> Vector3<f64> {
        self.attitude.inverse_transform_vector(&(self.acceleration + Vector3::new(0.0, 0.0, gravity)))
    }
}

/// How high a hand lifts the sensor to lay it down elsewhere. **Units:** m.
const CARRIED_M: f64 = 0.15;
/// Time in which the rocking of one segment goes over into that of the next. **Units:** s.
const SETTLING_S: f64 = 0.3;
/// Frequency of the vibration after a blow, and how long it lasts. **Units:** Hz, s.
const KNOCK_HZ: f64 = 40.0;
const KNOCK_S: f64 = 0.11;
/// How far the toes turn outwards while the foot swings. **Units:** degrees.
const WIGGLE_DEG: f64 = 9.0;
/// Frequencies of the rocking about pitch and about roll, and their share of its variance; the first of both together
/// make the foot roll around evenly. **Units:** Hz.
const ROCKING: [[(f64, f64); 3]; 2] =
    [[(1.9, 0.85), (5.3, 0.12), (13.0, 0.03)], [(1.9, 0.85), (6.1, 0.12), (17.0, 0.03)]];

/// A stance whose end may not be known yet. **Units:** s.
#[derive(Clone, Copy, Debug)]
struct Standing {
    index: u32,
    start: f64,
    end: f64,
    at: Foothold,
    /// Whether the floor has not moved.
    still: bool,
}

type Vector = [Jet; 3];

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Turns about z, counter-clockwise from above.
fn about_z([x, y, z]: Vector, (sin, cos): (Jet, Jet)) -> Vector {
    [x * cos - y * sin, x * sin + y * cos, z]
}

/// Turns the nose (x) up.
fn nose_up([x, y, z]: Vector, (sin, cos): (Jet, Jet)) -> Vector {
    [x * cos - z * sin, y, x * sin + z * cos]
}

/// Turns about x.
fn about_x([x, y, z]: Vector, (sin, cos): (Jet, Jet)) -> Vector {
    [x, y * cos - z * sin, y * sin + z * cos]
}

/// The foot over time. Time may only go forward.
#[derive(Debug)]
pub struct Motion {
    plan: Plan,
    segment: Segment,
    ended: bool,
    rocking_before: f64,
    phases: [[f64; 3]; 2],
    place: Vector3<f64>,
    orientation: UnitQuaternion<f64>,
    /// Axis and angle by which a hand turns the sensor in the present segment. **Frame:** sensor.
    handling: Vector3<f64>,
    /// The stance that has not been closed yet.
    open: Standing,
    closed: VecDeque<Standing>,
}

impl Motion {
    /// The foot that follows `plan`.
    pub fn new(mut plan: Plan, mounting: &Mounting, random: &mut Random) -> Self {
        let segment = plan.first();
        let mut phases: [[f64; 3]; 2] = std::array::from_fn(|_| std::array::from_fn(|_| 2.0 * PI * random.unit()));
        phases[1][0] = phases[0][0] + 0.5 * PI;
        let open = Standing { index: 0, start: 0.0, end: f64::INFINITY, at: segment.from, still: true };
        Self {
            plan,
            segment,
            ended: false,
            rocking_before: segment.rocking,
            phases,
            place: Vector3::from(mounting.place),
            orientation: mounting.orientation.rotation(),
            handling: Vector3::zeros(),
            open,
            closed: VecDeque::new(),
        }
    }

    /// Where the sensor of a foot that stands flat is.
    fn resting_place(&self, foothold: &Foothold) -> [f64; 3] {
        let (sin, cos) = libm::sincos(foothold.heading);
        let [x, y, z] = foothold.position;
        let place = self.place;
        [x + cos * place.x - sin * place.y, y + sin * place.x + cos * place.y, z + place.z]
    }

    /// Notes what the present segment means for the stances.
    fn account(&mut self) {
        let Segment { start, duration, from, to, action, .. } = self.segment;
        match action {
            Action::Rest => {}
            Action::Ride { .. } => {
                self.open.at = to;
                self.open.still = false;
            }
            Action::Stride(Stride { shape, haste, .. }) => {
                let time = |phase: f64| start + duration * (0.5 + (phase - 0.5) / haste);
                self.open.at = from;
                self.close(time(shape.stance_until));
                self.begin(time(shape.stance_from), to);
            }
            Action::Carry(up) => {
                self.handling = self.turn_to(Vector3::from(up));
                self.open.at = from;
                self.close(start);
                self.begin(start + duration, to);
            }
        }
    }

    /// The shortest turn after which `up` points upwards. **Frame:** sensor.
    fn turn_to(&self, up: Vector3<f64>) -> Vector3<f64> {
        let now = self.orientation.inverse_transform_vector(&Vector3::z());
        let up = up.normalize();
        let axis = up.cross(&now);
        let (sin, cos) = (axis.norm(), up.dot(&now));
        // Half a turn may go about any axis that lies level.
        let axis = if sin > 1e-6 { axis / sin } else { now.cross(&Vector3::ith(now.iamin(), 1.0)).normalize() };
        axis * libm::atan2(sin, cos)
    }

    fn begin(&mut self, start: f64, at: Foothold) {
        let index = self.open.index + 1;
        self.open = Standing { index, start, end: f64::INFINITY, at, still: true };
    }

    fn close(&mut self, end: f64) {
        self.closed.push_back(Standing { end, ..self.open });
    }

    /// Goes on to `time`; false once the plan is over. **Units:** s.
    pub fn advance(&mut self, time: f64) -> bool {
        while !self.ended && time >= self.segment.start + self.segment.duration {
            match self.plan.next() {
                Some(next) => {
                    self.rocking_before = self.segment.rocking;
                    if let Action::Carry(_) = self.segment.action {
                        self.orientation *= UnitQuaternion::from_scaled_axis(self.handling);
                    }
                    self.segment = next;
                    self.account();
                }
                None => {
                    self.ended = true;
                    self.close(self.segment.start + self.segment.duration);
                }
            }
        }
        !self.ended
    }

    /// Ends the recording at `time`, which lies in the present segment, before the plan is over. **Units:** s.
    pub fn end(&mut self, time: f64) {
        if std::mem::replace(&mut self.ended, true) {
            return;
        }
        if let Some(stance) = self.closed.iter_mut().find(|stance| stance.end > time) {
            stance.end = time;
        } else if time >= self.open.start {
            self.close(time);
        }
    }

    /// The next stance that has ended by `time`, each once. **Units:** s.
    pub fn stance_ended(&mut self, time: f64) -> Option<TruthStance> {
        let Standing { start, end, at, still, .. } = self.closed.pop_front_if(|stance| stance.end <= time)?;
        Some(TruthStance {
            start: Micros::from_seconds(start),
            end: Micros::from_seconds(end),
            position: self.resting_place(&at),
            heading: at.heading,
            still,
        })
    }

    /// Whether the foot stands at `time`, and the index of the last stance that has begun. **Units:** s.
    pub fn stance(&self, time: f64) -> (bool, u32) {
        match self.closed.iter().find(|stance| time < stance.end) {
            Some(stance) => (true, stance.index),
            None if time >= self.open.start => (true, self.open.index),
            None => (false, self.open.index.saturating_sub(1)),
        }
    }

    /// The stretch of time that the last call of [`Motion::advance`] led to.
    pub fn segment(&self) -> &Segment {
        &self.segment
    }

    /// Rocking of the foot about pitch and roll. **Units:** s; rad.
    fn rocking(&self, time: f64) -> [Jet; 2] {
        let settled = ramp(Jet::linear(time - self.segment.start, 1.0), 0.0, SETTLING_S);
        let level = settled * (self.segment.rocking - self.rocking_before) + self.rocking_before;
        std::array::from_fn(|axis| {
            let mut sum = Jet::default();
            for ((frequency, share), phase) in ROCKING[axis].iter().zip(self.phases[axis]) {
                let turns = 2.0 * PI * frequency;
                let (sin, _) = Jet::linear(turns * time + phase, turns).sin_cos();
                sum = sum + sin * (libm::sqrt(2.0 * share) / turns);
            }
            sum * level
        })
    }

    /// The sensor at `time`, which must lie in the present segment. **Units:** s.
    pub fn at(&self, time: f64) -> Kinematics {
        let Segment { start, duration, from, to, action, .. } = self.segment;
        let since = Jet::linear(time - start, 1.0);
        let [rocking_pitch, rocking_roll] = self.rocking(time);
        let way: [f64; 3] = std::array::from_fn(|i| to.position[i] - from.position[i]);
        let mut base = from.position.map(Jet::constant);
        let mut heading = Jet::constant(from.heading);
        let (mut pitch, mut roll) = (rocking_pitch, rocking_roll);
        let mut turning_point = Jet::constant(BALL_M);
        let mut blow = Jet::default();
        let mut turned = None;
        match action {
            Action::Rest => {}
            Action::Ride { ride, pause } => base[2] = base[2] + ride.height(time - start - pause),
            Action::Stride(Stride { shape, pitch: pitch_factor, lift, impact, haste, side }) => {
                let phase = since * (haste / duration) + 0.5 * (1.0 - haste);
                let advance = spline(shape.advance, phase);
                let out = pulse(phase, [0.42, 0.62, 0.62, 0.78]) * (shape.sideways * side);
                let across = {
                    let length = libm::hypot(way[0], way[1]).max(1e-9);
                    [-way[1] / length, way[0] / length]
                };
                base[0] = base[0] + advance * way[0] + out * across[0];
                base[1] = base[1] + advance * way[1] + out * across[1];
                base[2] = base[2] + spline(shape.climb, phase) * way[2] + spline(shape.lift, phase) * lift;
                heading = heading + ramp(phase, shape.turning[0], shape.turning[1]) * (to.heading - from.heading)
                    - pulse(phase, [0.0, 0.2, 0.22, 0.42].map(|after| shape.toe_off - 0.1 + after))
                        * (WIGGLE_DEG.to_radians() * side);
                pitch = pitch + spline(shape.pitch, phase) * pitch_factor.to_radians();
                let push_off = pulse(phase, [0.26, 0.40, 0.42, 0.56]) * shape.roll[0].to_radians();
                let landing = pulse(phase, [0.58, 0.70, 0.72, 0.86]) * shape.roll[1].to_radians();
                roll = roll - (push_off + landing) * side;
                if let Some([leaves, arrives, returns, back]) = shape.heel_first {
                    turning_point = turning_point + pulse(phase, [leaves, arrives, returns, back]) * (HEEL_M - BALL_M);
                }
                let contact = duration * (0.5 + (shape.contact - 0.5) / haste);
                let length = KNOCK_S.min(start + duration - start - contact);
                let turns = 2.0 * PI * KNOCK_HZ;
                blow = knock(since + -contact, KNOCK_HZ, length) * (shape.impact * impact / (turns * turns));
            }
            Action::Carry(_) => {
                base[2] = base[2] + pulse(since, [0.0, 0.4 * duration, 0.6 * duration, duration]) * CARRIED_M;
                turned = Some(ramp(since, 0.1 * duration, 0.9 * duration));
            }
        }
        // The blow pushes the shoe up and back, and turns it about its contact.
        pitch = pitch - blow * 4.0;
        roll = roll + blow * 2.0;
        let (turn, tip, tilt) = (heading.sin_cos(), pitch.sin_cos(), roll.sin_cos());
        let pushed = [turning_point - blow * 0.6, blow * 0.25, blow];
        let arm =
            [Jet::constant(self.place.x) - turning_point, Jet::constant(self.place.y), Jet::constant(self.place.z)];
        let sensor = add(base, about_z(add(pushed, nose_up(about_x(arm, tilt), tip)), turn));

        let ((sin_p, cos_p), (sin_r, cos_r)) = ((tip.0.value, tip.1.value), (tilt.0.value, tilt.1.value));
        let shoe_rate = Vector3::new(
            roll.rate + heading.rate * sin_p,
            -pitch.rate * cos_r + heading.rate * cos_p * sin_r,
            pitch.rate * sin_r + heading.rate * cos_p * cos_r,
        );
        let half = |angle: f64| libm::sincos(0.5 * angle);
        let ((sh, ch), (sp, cp), (sr, cr)) = (half(heading.value), half(-pitch.value), half(roll.value));
        let shoe =
            Quaternion::new(ch, 0.0, 0.0, sh) * Quaternion::new(cp, 0.0, sp, 0.0) * Quaternion::new(cr, sr, 0.0, 0.0);
        let (orientation, spin) = turned.map_or((self.orientation, Vector3::zeros()), |part| {
            let turn = UnitQuaternion::from_scaled_axis(self.handling * part.value);
            (self.orientation * turn, self.handling * part.rate)
        });
        Kinematics {
            position: Vector3::from(sensor.map(|jet| jet.value)),
            velocity: Vector3::from(sensor.map(|jet| jet.rate)),
            acceleration: Vector3::from(sensor.map(|jet| jet.bend)),
            attitude: UnitQuaternion::new_unchecked(shoe) * orientation,
            rate: orientation.inverse_transform_vector(&shoe_rate) + spin,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::scenario::Scenario;
    use crate::simulation::{Leg, Orientation, Person, Route};

    /// A short walk with every motion in it, seen from a skew sensor.
    fn varied(person: Person) -> Scenario {
        let legs = vec![
            Leg::walk(7.0, 0.0),
            Leg::with_gait(super::super::Gait::Fast, vec![[7.0, 7.0]]),
            Leg::with_gait(super::super::Gait::Run, vec![[0.0, 9.0], [-12.0, 9.0]]),
            Leg::stairs(7),
            Leg::Stand { seconds: 2.0 },
            Leg::ride(5.0),
            Leg::stairs(-6),
            Leg::SideStep { left: 1.0 },
            Leg::Turn { heading: 0.0 },
            Leg::walk(-20.0, 12.0),
        ];
        let mounting = Mounting { orientation: Orientation::Skew, place: [-0.05, 0.02, 0.09] };
        Scenario { person, mounting, route: Route { legs, ..Route::default() }, rest: 1.0, ..Scenario::default() }
    }

    /// The sensor at 2 kHz, with the index of the stance in which each sample lies.
    fn states(scenario: &Scenario) -> Vec<(f64, Kinematics, bool, u32, Segment)> {
        let mut motion = scenario.motion().unwrap();
        let mut states = Vec::new();
        for k in 0.. {
            let time = f64::from(k) * 5e-4;
            if !motion.advance(time) {
                break;
            }
            while motion.stance_ended(time).is_some() {}
            let (stance, index) = motion.stance(time);
            states.push((time, motion.at(time), stance, index, *motion.segment()));
        }
        states
    }

    #[test]
    fn integrating_rates_and_accelerations_gives_each_stride_back() {
        const DT: f64 = 5e-4;
        for scenario in Person::all().map(varied).into_iter().chain([Scenario::calibration(3)]) {
            let states = states(&scenario);
            let (mut strides, mut worst) = (0, 0.0_f64);
            let mut i = 0;
            while i + 1 < states.len() {
                // One segment of the plan: a stride from the middle of one stance to that of the next, a rest, a ride.
                let start = states[i].4.start;
                let (mut attitude, mut velocity, mut position) =
                    (states[i].1.attitude, states[i].1.velocity, states[i].1.position);
                while i + 1 < states.len() && states[i].4.start == start {
                    let (now, next) = (&states[i].1, &states[i + 1].1);
                    let force = |state: &Kinematics, q: &UnitQuaternion<f64>| {
                        q * state.specific_force(scenario.gravity) - Vector3::new(0.0, 0.0, scenario.gravity)
                    };
                    let before = force(now, &attitude);
                    attitude *= UnitQuaternion::from_scaled_axis((now.rate + next.rate) * (0.5 * DT));
                    let mean = (before + force(next, &attitude)) * 0.5;
                    position += velocity * DT + mean * (0.5 * DT * DT);
                    velocity += mean * DT;
                    i += 1;
                }
                let truth = &states[i].1;
                worst = worst.max((position - truth.position).norm());
                assert!(attitude.angle_to(&truth.attitude) < 1e-4);
                strides += 1;
            }
            assert!(strides > 20, "{strides}");
            // The trapezoidal rule at 2 kHz is good for some tenths of a millimetre in a stride.
            assert!(worst < 1e-3, "{worst}");
        }
    }

    #[test]
    fn velocity_and_acceleration_are_continuous() {
        for person in Person::all() {
            let states = states(&varied(person));
            for pair in states.windows(2) {
                let (a, b) = (&pair[0].1, &pair[1].1);
                // Half a millisecond of the hardest vibration: 300 m/s² at 40 Hz change by up to 38 m/s².
                assert!((a.acceleration - b.acceleration).norm() < 45.0, "{}", pair[0].0);
                assert!((a.velocity - b.velocity).norm() < 0.15, "{}", pair[0].0);
                assert!((a.position - b.position).norm() < 0.006, "{}", pair[0].0);
                // Angular acceleration up to some 1500 rad/s².
                assert!((a.rate - b.rate).norm() < 1.0, "{}", pair[0].0);
            }
        }
    }

    #[test]
    fn a_standing_foot_is_flat_and_still() {
        for person in Person::all() {
            let scenario = varied(person);
            let orientation = scenario.mounting.orientation.rotation();
            for (time, state, stance, _, segment) in states(&scenario) {
                if !stance || matches!(segment.action, Action::Ride { .. }) {
                    continue;
                }
                let shoe = state.attitude * orientation.inverse();
                let tilt = libm::acos((shoe * Vector3::z()).z.clamp(-1.0, 1.0)).to_degrees();
                // The ends of a stance: the heel begins to rise, the sole is about to be flat.
                assert!(tilt < 8.0, "{time}: {tilt}");
                assert!(state.velocity.norm() < 0.5, "{time}: {}", state.velocity.norm());
            }
        }
    }

    #[test]
    fn what_is_laid_down_lies_still_with_the_right_side_up() {
        let scenario = Scenario::calibration(5);
        let wanted = scenario.route.legs.iter().map(|leg| match leg {
            Leg::Lay { up, .. } => Vector3::from(*up).normalize(),
            other => panic!("{other:?}"),
        });
        let states = states(&scenario);
        let mut rests = states.chunk_by(|a, b| a.4.start == b.4.start);
        // The attitude it comes in; then a hand's motion before each rest, and the rest at the end.
        rests.next().unwrap();
        for up in wanted {
            let carried = rests.next().unwrap();
            assert!(carried.iter().any(|(_, state, ..)| state.rate.norm() > 0.05));
            let rest = rests.next().unwrap();
            let settled = rest.iter().filter(|(time, .., segment)| time - segment.start > SETTLING_S);
            for (time, state, stance, ..) in settled {
                let found = state.attitude.inverse_transform_vector(&Vector3::z());
                // 2.5 of its standard deviations about two axes.
                assert!(found.angle(&up) < 2.5 * 0.04 * 1.5, "{time}: {found}");
                assert!(*stance && state.rate.norm() < 1e-12 && state.acceleration.norm() < 1e-12, "{time}");
            }
        }
    }

    #[test]
    fn no_part_of_the_sole_goes_through_the_floor() {
        for person in Person::all() {
            let legs = vec![Leg::walk(12.0, 0.0), Leg::with_gait(super::super::Gait::Run, vec![[26.0, 0.0]])];
            let mounting = Mounting { orientation: Orientation::Flat, place: [0.0; 3] };
            let scenario =
                Scenario { person, mounting, route: Route { legs, ..Route::default() }, ..Scenario::default() };
            let lowest = states(&scenario).iter().fold(0.0, |low: f64, (_, state, ..)| {
                let at = |x: f64| (state.position + state.attitude * Vector3::new(x, 0.0, 0.0)).z;
                low.min(at(HEEL_M)).min(at(BALL_M))
            });
            // Soles and floors give; the tables are not geometry to the millimetre.
            assert!(lowest > -0.02, "{lowest}");
        }
    }

    #[test]
    fn stances_and_route_are_where_the_plan_says() {
        let scenario = varied(Person::b());
        let mut motion = scenario.motion().unwrap();
        let mut end = 0.0;
        let mut stances: Vec<TruthStance> = Vec::new();
        while motion.advance(end) {
            end = motion.segment().start + motion.segment().duration;
            while let Some(stance) = motion.stance_ended(end) {
                stances.push(stance);
            }
        }
        stances.extend(std::iter::from_fn(|| motion.stance_ended(f64::INFINITY)));
        for pair in stances.windows(2) {
            assert!(pair[1].end.since(pair[1].start) > 0.08, "{pair:?}");
            assert!(pair[1].start.since(pair[0].end) > 0.2, "{pair:?}");
        }
        assert_eq!(stances.iter().filter(|stance| !stance.still).count(), 1, "only the elevator moves a standing foot");
        let last = stances.last().unwrap();
        // The body ends at (-20, 12), 5.17 m up after 7 risers, the ride and 6 risers down; the foot stands beside it.
        assert!((last.position[0] + 20.0).abs() < 0.25 && (last.position[1] - 12.0).abs() < 0.25, "{last:?}");
        assert!((last.position[2] - (0.09 + 5.17)).abs() < 1e-9, "{last:?}");
        assert_eq!(last.end, Micros::from_seconds(end));
    }
}
