//! From a route to the strides of one foot: where each stands, how long it takes, how large it is.
//!
//! Strides are planned one at a time, so that a route without end needs no memory.

use super::gait::{DOWN, Gait, SIDE, Shape, UP};
use super::path::{Path, heading, wrapped};
use super::person::Person;
use super::profile::Ride;
use super::random::Random;
use super::route::{Leg, Route};
use std::collections::VecDeque;
use std::f64::consts::PI;

/// Where the sole stands: the point below the instep. **Units:** m, rad; **Frame:** world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foothold {
    /// Where.
    pub position: [f64; 3],
    /// Heading of the shoe, not wrapped.
    pub heading: f64,
}

/// How large one stride is compared with its gait's table.
#[derive(Clone, Copy, Debug)]
pub struct Stride {
    /// The gait's tables.
    pub shape: &'static Shape,
    /// Factor on the pitch.
    pub pitch: f64,
    /// Factor on the lift.
    pub lift: f64,
    /// Factor on the impact.
    pub impact: f64,
    /// Factor on the progress of the phase, 1 or more: the rest of the time the foot stands.
    pub haste: f64,
    /// Which way the foot swings out: +1 to the left.
    pub side: f64,
}

/// What the foot does between two moments at which it stands.
#[derive(Clone, Copy, Debug)]
pub enum Action {
    /// It stands.
    Rest,
    /// It stands on a floor that moves, after a pause.
    Ride {
        /// The floor's motion.
        ride: Ride,
        /// Time before it starts. **Units:** s.
        pause: f64,
    },
    /// It makes a stride.
    Stride(Stride),
    /// The sensor alone moves: a hand lays it down with this direction up. **Frame:** sensor.
    Carry([f64; 3]),
}

/// A stretch of time with one action.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Start. **Units:** s.
    pub start: f64,
    /// **Units:** s.
    pub duration: f64,
    /// Where the foot stands at the start.
    pub from: Foothold,
    /// Where it stands at the end.
    pub to: Foothold,
    /// What it does.
    pub action: Action,
    /// How much the foot rocks while it stands. **Units:** rad/s.
    pub rocking: f64,
}

/// Rocking of a foot whose owner stands. **Units:** rad/s.
const STANDING_RAD_S: f64 = 0.012;
/// Turns beyond this are made on the spot before a walk goes on. **Units:** rad.
const SHARP_RAD: f64 = 1.9;
/// The largest turn of one stride on the spot. **Units:** rad.
const SPOT_RAD: f64 = 1.2;
/// Time an elevator waits before and after its ride. **Units:** s.
const DOOR_S: f64 = 1.5;
/// Time a hand takes to lay the sensor down, and how much longer it may take. **Units:** s.
const CARRY_S: [f64; 2] = [1.4, 0.6];
/// Trembling of that hand. **Units:** rad/s.
const HAND_RAD_S: f64 = 0.15;
/// How far off the sensor comes to lie, about each axis (standard deviation). **Units:** rad.
const ASKEW_RAD: f64 = 0.04;

/// What is left to do of a leg.
#[derive(Debug)]
enum Task {
    Walk { path: Path, covered: f64, gait: Gait, pace: f64 },
    Stairs { left: u32, rise: f64, tread: f64, pace: f64 },
    Side { left: f64 },
    Turn { heading: f64 },
    Rest { seconds: f64 },
    Ride { ride: Ride, rise: f64 },
    Carry { up: [f64; 3] },
}

/// Plans segment after segment.
#[derive(Debug)]
pub struct Plan {
    person: Person,
    route: Route,
    random: Random,
    next_leg: usize,
    tasks: VecDeque<Task>,
    /// Position of the body above the floor and where it faces.
    body: [f64; 3],
    facing: f64,
    foothold: Foothold,
    time: f64,
    moving: bool,
    /// Whether the sensor lies on something firm instead of being worn.
    laid: bool,
    strides: u32,
    limit: Option<u32>,
    rest: f64,
    until: Option<f64>,
    ended: bool,
    /// Correlated deviations of stride length and stride time from the usual, in standard deviations.
    mood: [f64; 2],
}

impl Plan {
    /// A plan for `route`, with a rest before and after it. **Units:** rest and until in s.
    pub fn new(
        person: Person,
        route: Route,
        random: Random,
        limit: Option<u32>,
        rest: f64,
        until: Option<f64>,
    ) -> Self {
        let (body, facing) = (route.start, route.heading);
        let mut plan = Self {
            person,
            route,
            random,
            next_leg: 0,
            tasks: VecDeque::new(),
            body,
            facing,
            foothold: Foothold { position: body, heading: facing },
            time: 0.0,
            moving: false,
            laid: false,
            strides: 0,
            limit,
            rest,
            until,
            ended: false,
            mood: [0.0; 2],
        };
        plan.foothold = plan.foothold_beside(0.0);
        plan
    }

    /// The rest before the route, to be asked for first.
    pub fn first(&mut self) -> Segment {
        self.standing(self.rest)
    }

    /// Where the foot stands beside the body, with a heading near the present one; `scatter` is a factor on the random
    /// part.
    fn foothold_beside(&mut self, scatter: f64) -> Foothold {
        let side = self.person.foot.side();
        let (sin, cos) = libm::sincos(self.facing);
        let across = 0.5 * side * self.person.step_width + 0.012 * scatter * self.random.normal();
        let heading = self.facing + side * self.person.toe_out + 0.03 * scatter * self.random.normal();
        let heading = self.foothold.heading + wrapped(heading - self.foothold.heading);
        let [x, y, z] = self.body;
        Foothold { position: [x - sin * across, y + cos * across, z], heading }
    }

    /// A stride of `shape` to beside the body, which has been moved before. `ratio` is its size compared with a full one.
    fn stride(&mut self, shape: &'static Shape, ratio: f64, pace: f64) -> Segment {
        let from = self.foothold;
        let to = self.foothold_beside(1.0);
        let person = self.person;
        let size = ratio.clamp(0.2, 1.3);
        let mut around = |sigma: f64| 1.0 + sigma * self.random.normal().clamp(-2.5, 2.5);
        let stride = Stride {
            shape,
            pitch: person.pitch * (0.35 + 0.65 * size) * around(0.04),
            lift: person.clearance * (0.5 + 0.5 * size) * around(0.06),
            impact: person.impact * size * pace * around(0.15),
            haste: 1.0 + person.linger,
            side: person.foot.side(),
        };
        let usual = shape.time / (person.cadence * libm::sqrt(pace)) * (0.72 + 0.28 * size);
        let duration = usual * (1.0 + person.variability * self.mood[1].clamp(-2.5, 2.5));
        self.strides += 1;
        self.moving = true;
        self.laid = false;
        self.segment(duration, from, to, Action::Stride(stride), shape.rocking * person.rocking)
    }

    fn segment(&mut self, duration: f64, from: Foothold, to: Foothold, action: Action, rocking: f64) -> Segment {
        let segment = Segment { start: self.time, duration, from, to, action, rocking };
        self.time += duration;
        self.foothold = to;
        segment
    }

    fn standing(&mut self, duration: f64) -> Segment {
        self.moving = false;
        let rocking = if self.laid { 0.0 } else { STANDING_RAD_S * self.person.rocking };
        self.segment(duration, self.foothold, self.foothold, Action::Rest, rocking)
    }

    /// Whether the stride to come is the last one allowed.
    fn finishing(&self) -> bool {
        self.limit.is_some_and(|limit| self.strides + 1 >= limit)
    }

    /// Turns the next leg into tasks.
    fn enter(&mut self, leg: &Leg) {
        match leg {
            Leg::Walk { to, gait, pace } => {
                let start = [self.body[0], self.body[1]];
                let whole = Path::new(std::iter::once(start).chain(to.iter().copied()));
                let points = whole.points();
                let mut facing = self.facing;
                let mut from = 0;
                for i in 1..points.len() {
                    let ahead = heading(points[i - 1], points[i]);
                    let sharp = wrapped(ahead - facing).abs() > SHARP_RAD;
                    if sharp {
                        self.walk(&points[from..i], *gait, *pace);
                        self.tasks.push_back(Task::Turn { heading: ahead });
                        from = i - 1;
                    }
                    facing = ahead;
                }
                self.walk(&points[from..], *gait, *pace);
            }
            Leg::Stairs { steps, riser, tread, heading, pace } => {
                if let Some(heading) = *heading {
                    if wrapped(heading - self.facing).abs() > 0.3 {
                        self.tasks.push_back(Task::Turn { heading });
                    } else {
                        self.facing += wrapped(heading - self.facing);
                    }
                }
                let rise = if *steps < 0 { -riser } else { *riser };
                self.tasks.push_back(Task::Stairs { left: steps.unsigned_abs(), rise, tread: *tread, pace: *pace });
            }
            Leg::Ride { rise, acceleration, speed } => {
                self.tasks.push_back(Task::Ride { ride: Ride::new(*rise, *acceleration, *speed), rise: *rise });
            }
            Leg::Stand { seconds } => self.tasks.push_back(Task::Rest { seconds: *seconds }),
            Leg::SideStep { left } => self.tasks.push_back(Task::Side { left: *left }),
            Leg::Turn { heading } => self.tasks.push_back(Task::Turn { heading: *heading }),
            Leg::Lay { up, seconds } => {
                self.tasks.extend([Task::Carry { up: *up }, Task::Rest { seconds: *seconds }]);
            }
        }
    }

    fn walk(&mut self, points: &[[f64; 2]], gait: Gait, pace: f64) {
        let path = Path::new(points.iter().copied());
        if path.length() > 0.0 {
            self.tasks.push_back(Task::Walk { path, covered: 0.0, gait, pace });
        }
    }

    /// One segment of `task`, and what is left of it.
    fn perform(&mut self, task: Task) -> (Option<Segment>, Option<Task>) {
        match task {
            Task::Walk { path, covered, gait, pace } => {
                let shape = gait.shape();
                let full = self.person.height * self.person.stride * shape.length * libm::sqrt(pace);
                let left = path.length() - covered;
                if left < 1e-6 {
                    return (None, None);
                }
                let deviation = 1.0 + self.person.variability * self.mood[0].clamp(-2.5, 2.5);
                // Strides are shorter around corners.
                let bend = wrapped(path.at(covered + full).1 - path.at(covered).1).abs();
                let usual = full * deviation * (1.0 - 0.25 * (bend / (0.5 * PI)).min(1.0));
                let starting = if self.moving { usual } else { 0.55 * usual };
                // The last strides are made even; a first short one has been begun by the other foot.
                let spare = if self.moving { 3.5 } else { 0.5 };
                let advance = if self.finishing() {
                    left.min(0.5 * full)
                } else if left > starting + spare * usual {
                    starting
                } else {
                    // Even strides up to the end.
                    left / libm::round(left / usual).max(1.0)
                };
                let covered = if left - advance < 1e-6 { path.length() } else { covered + advance };
                let ([x, y], facing) = path.at(covered);
                self.body = [x, y, self.body[2]];
                self.facing += wrapped(facing - self.facing);
                let segment = self.stride(shape, advance / full, pace);
                (Some(segment), Some(Task::Walk { path, covered, gait, pace }))
            }
            Task::Stairs { left: 0, .. } => (None, None),
            Task::Stairs { left, rise, tread, pace } => {
                let count = if left == 1 || (!self.moving && self.random.unit() < 0.5) { 1 } else { 2 };
                let steps = f64::from(count);
                let (sin, cos) = libm::sincos(self.facing);
                let [x, y, z] = self.body;
                self.body = [x + cos * tread * steps, y + sin * tread * steps, z + rise * steps];
                let shape = if rise > 0.0 { &UP } else { &DOWN };
                let segment = self.stride(shape, 0.5 * steps, pace);
                (Some(segment), Some(Task::Stairs { left: left - count, rise, tread, pace }))
            }
            Task::Side { left } => {
                if left.abs() < 1e-6 {
                    return (None, None);
                }
                let full = self.person.height * self.person.stride * SIDE.length;
                let part = left / libm::ceil(left.abs() / full);
                let (sin, cos) = libm::sincos(self.facing);
                let [x, y, z] = self.body;
                self.body = [x - sin * part, y + cos * part, z];
                let segment = self.stride(&SIDE, part.abs() / full, 1.0);
                self.moving = false;
                (Some(segment), Some(Task::Side { left: left - part }))
            }
            Task::Turn { heading } => {
                let turn = wrapped(heading - self.facing);
                if turn.abs() < 1e-6 {
                    return (None, None);
                }
                self.facing += turn / libm::ceil(turn.abs() / SPOT_RAD);
                let segment = self.stride(&SIDE, 0.6, 1.0);
                self.moving = false;
                (Some(segment), Some(Task::Turn { heading }))
            }
            Task::Rest { seconds } => (Some(self.standing(seconds)), None),
            Task::Ride { ride, rise } => {
                let rocking = STANDING_RAD_S * self.person.rocking;
                let from = self.foothold;
                let mut to = from;
                to.position[2] += rise;
                self.body[2] += rise;
                self.moving = false;
                let action = Action::Ride { ride, pause: DOOR_S };
                (Some(self.segment(ride.duration() + 2.0 * DOOR_S, from, to, action, rocking)), None)
            }
            Task::Carry { up } => {
                let length = libm::hypot(libm::hypot(up[0], up[1]), up[2]);
                let up = up.map(|value| value / length + ASKEW_RAD * self.random.normal().clamp(-2.5, 2.5));
                let duration = CARRY_S[0] + CARRY_S[1] * self.random.unit();
                self.moving = false;
                self.laid = true;
                (Some(self.segment(duration, self.foothold, self.foothold, Action::Carry(up), HAND_RAD_S)), None)
            }
        }
    }

    /// The rest at the end, as long as it has to be.
    fn ending(&mut self) -> Option<Segment> {
        let missing = self.until.map_or(self.rest, |until| until - self.time);
        let first = !std::mem::replace(&mut self.ended, true);
        let due = if self.until.is_some() { missing > 0.0 } else { first && self.rest > 0.0 };
        due.then(|| self.standing(missing))
    }
}

impl Iterator for Plan {
    type Item = Segment;

    fn next(&mut self) -> Option<Segment> {
        // A lap of an endless route that takes no time would never end.
        let mut idle = 0;
        loop {
            if self.ended || self.limit.is_some_and(|limit| self.strides >= limit) {
                return self.ending();
            }
            if let Some(task) = self.tasks.pop_front() {
                for mood in &mut self.mood {
                    // Successive strides resemble each other; stationary variance 1.
                    *mood = 0.6 * *mood + 0.8 * self.random.normal();
                }
                let (segment, left) = self.perform(task);
                if let Some(left) = left {
                    self.tasks.push_front(left);
                }
                if segment.is_some() {
                    return segment;
                }
                continue;
            }
            if self.next_leg == self.route.legs.len() {
                idle += 1;
                if !self.route.endless || idle > 1 {
                    return self.ending();
                }
                self.next_leg = 0;
                continue;
            }
            let leg = self.route.legs[self.next_leg].clone();
            self.next_leg += 1;
            self.enter(&leg);
        }
    }
}
