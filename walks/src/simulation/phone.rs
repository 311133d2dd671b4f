//! Steps of a phone in the hand along a way through a building, without the samples in between.
//!
//! To judge what follows steps on a plan hundreds of long walks are needed, and nothing of how the steps were found. A person
//! walks a way from [`Planner`](crate::building::route::Planner) and rounds its corners; the phone tells each step as the
//! graph document's does, with the errors of [`Noise`]. The way knows nothing of any walk graph.
//!
//! # Source
//! Graph, 4.1, 6.3, 6.4 and 6.11.

use super::random::{Purpose, Random};
use crate::building::geometry::wrapped;
use crate::building::route::Piece;
use crate::building::{Building, Error};
use crate::phone::{self, Measured};
use nalgebra::Vector3;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;

/// The length that the phone takes every step on the level for (Graph, 6.6), and on stairs, of which the barometer tells
/// (Graph, 6.11). **Units:** m.
const STEP_M: f64 = 0.68;
const STAIRS_STEP_M: f64 = 0.30;
/// Time of a step: 1.8 Hz. **Units:** s.
const STEP_S: f64 = 0.55;
/// Doors of an elevator open or close; it rides so fast. **Units:** s, m/s.
const DOORS_S: f64 = 2.5;
const RIDE_M_S: f64 = 1.0;
/// Corners are rounded by the mean over so much of the way before and behind. **Units:** m.
const ROUND_M: f64 = 0.35;
/// Who moves less in a step turns on the spot. **Units:** m.
const ON_THE_SPOT_M: f64 = 0.15;
/// Heights this near to a floor are on it. **Units:** m.
const ON_FLOOR_M: f64 = 0.05;

/// What is wrong with the steps of a phone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The person's steps are longer or shorter than the phone believes, by this part (standard deviation over walks). Of
    /// one person to the next; the document's author set the length for himself.
    pub scale: f64,
    /// And each step by this (standard deviation; Graph, table 6.3). **Units:** m.
    pub length_m: f64,
    /// Heading, sum over the steps (standard deviation of each; Graph, table 6.3). **Units:** rad.
    pub heading: f64,
    /// What a calibration at rest leaves of the gyroscope's bias (standard deviation over walks): a quarter of what the
    /// document calls typical before it, ten times the rotation of the Earth (Graph, 6.2.4). **Units:** rad/s.
    pub bias: f64,
    /// The hand at each step, no sum (standard deviation). With it all deviations on the straight are below 10 degrees, as
    /// the document saw them (Graph, 6.5 and figure 6.13). **Units:** rad.
    pub hand: f64,
    /// Steps that are not found, as a part of all. The document saw none once somebody walks (Graph, 6.3).
    pub missed: f64,
    /// The barometer's height (standard deviation; Graph, 6.11), which stays alike for `height_s`. **Units:** m, s.
    pub height_m: f64,
    /// **Units:** s.
    pub height_s: f64,
    /// And its drift with the weather (standard deviation over walks). **Units:** m/s.
    pub weather: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            scale: 0.03,
            length_m: 0.05,
            heading: 0.5_f64.to_radians(),
            bias: 0.01_f64.to_radians(),
            hand: 2.0_f64.to_radians(),
            missed: 0.002,
            height_m: 0.2,
            height_s: 5.0,
            weather: 1.0 / 3600.0,
        }
    }
}

/// Who walks so many steps on a floor has changed to it; who passes it on the stairs has not.
const STAYS: usize = 8;

/// The floor was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The first step that ends on the new floor.
    pub step: usize,
    /// Number of the new floor.
    pub to: i32,
}

/// A walk with a phone, and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct PhoneWalk {
    /// The steps; the first marks the start.
    pub steps: Vec<Step>,
    /// Where the person was at the end of each. **Units:** m; **Frame:** building.
    pub truth: Vec<Vector3<f64>>,
    /// The floor then; on stairs the last one.
    pub floors: Vec<i32>,
    /// When the floor was changed.
    pub changes: Vec<Change>,
    /// Heading at the start. **Units:** rad; **Frame:** building.
    pub heading: f64,
}

impl PhoneWalk {
    /// Somebody goes the way of `pieces`; all that is random follows from the seed.
    ///
    /// # Errors
    /// When the way does not begin on foot.
    pub fn along(building: &Building, pieces: &[Piece], noise: &Noise, seed: u64) -> Result<Self, Error> {
        let runs = runs(building, pieces)?;
        let first = runs.first().and_then(|run| run.at(0.0)).unwrap_or_default();
        let Some(floor) = floor_at(building, first.z) else {
            return Err(Error::Model("a way through a building begins on one of its floors".to_owned()));
        };
        let mut walker = Walker::new(building, noise, first, floor, seed);
        for run in &runs {
            walker.ride(run.ride_m);
            walker.walk(run);
        }
        let mut walk = walker.walk;
        let truth = &walk.truth;
        walk.changes.retain(|change| {
            let stays = &truth[change.step..(change.step + STAYS).min(truth.len())];
            stays.iter().all(|place| (place.z - stays[0].z).abs() < ON_FLOOR_M)
        });
        Ok(walk)
    }

    /// From the first step to the last. **Units:** s.
    pub fn seconds(&self) -> f64 {
        match (self.steps.first(), self.steps.last()) {
            (Some(first), Some(last)) => (last.stance_end - first.stance_end) as f64 * 1e-6,
            _ => 0.0,
        }
    }
}

/// A part of the way on foot.
#[derive(Clone, Debug, Default)]
struct Run {
    /// With an elevator before it. **Units:** m.
    ride_m: f64,
    points: Vec<[f64; 3]>,
    /// Length in the plan to each point. **Units:** m.
    upto: Vec<f64>,
}

fn runs(building: &Building, pieces: &[Piece]) -> Result<Vec<Run>, Error> {
    let mut runs = vec![Run::default()];
    for piece in pieces {
        let ride = match piece {
            Piece::Ride { rise, .. } => Some(*rise),
            _ => None,
        };
        if let Some(ride_m) = ride {
            runs.push(Run { ride_m, ..Run::default() });
        }
        let Some(run) = runs.last_mut() else { continue };
        match piece {
            Piece::Walk { floor, points } => {
                let height = building.floor(*floor).map_or(0.0, |floor| floor.height_m);
                points.iter().for_each(|&[x, y]| run.push([x, y, height]));
            }
            Piece::Climb { points, .. } => points.iter().for_each(|&point| run.push(point)),
            Piece::Ride { .. } => {}
        }
    }
    match runs.first() {
        Some(run) if !run.points.is_empty() => Ok(runs),
        _ => Err(Error::Model("a way through a building begins on foot".to_owned())),
    }
}

impl Run {
    fn push(&mut self, point: [f64; 3]) {
        let far = self.points.last().map_or(0.0, |last| (point[0] - last[0]).hypot(point[1] - last[1]));
        if far > 1e-6 || self.points.is_empty() {
            self.upto.push(self.length() + far);
            self.points.push(point);
        }
    }

    fn length(&self) -> f64 {
        self.upto.last().copied().unwrap_or(0.0)
    }

    /// The two points of the way around a length, and the part of the way between them.
    fn around(&self, s: f64) -> Option<([f64; 3], [f64; 3], f64)> {
        let next = self.upto.partition_point(|&upto| upto < s).clamp(1, self.points.len().max(1));
        let (from, to) = (*self.points.get(next - 1)?, *self.points.get(next).or(self.points.last())?);
        let [low, high] = [next - 1, next].map(|at| self.upto[at.min(self.upto.len() - 1)]);
        Some((from, to, if high > low { ((s - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }))
    }

    fn on_line(&self, s: f64) -> Option<Vector3<f64>> {
        let (from, to, part) = self.around(s)?;
        Some(Vector3::from(from).lerp(&Vector3::from(to), part))
    }

    /// Where somebody is after a length of the way, who rounds corners.
    fn at(&self, s: f64) -> Option<Vector3<f64>> {
        const SAMPLES: i32 = 4;
        // Nobody rounds the ends of a way.
        let reach = ROUND_M.min(s).min((self.length() - s).max(0.0));
        let mut sum = Vector3::zeros();
        for sample in -SAMPLES..=SAMPLES {
            sum += self.on_line(s + reach * f64::from(sample) / f64::from(SAMPLES))?;
        }
        let here = self.on_line(s)?;
        let mean = sum / f64::from(2 * SAMPLES + 1);
        Some(Vector3::new(mean.x, mean.y, here.z))
    }

    /// Depth of a tread where the way climbs, for risers of about 0.18 m. **Units:** m.
    fn tread(&self, s: f64) -> Option<f64> {
        let (from, to, _) = self.around(s + 1e-3)?;
        let rise = (to[2] - from[2]).abs();
        let risers = (rise / 0.18).round().max(1.0);
        (rise > ON_FLOOR_M).then(|| (to[0] - from[0]).hypot(to[1] - from[1]) / risers)
    }
}

fn floor_at(building: &Building, z: f64) -> Option<i32> {
    building.floors.iter().find(|floor| (floor.height_m - z).abs() < ON_FLOOR_M).map(|floor| floor.number)
}

/// Somebody with a phone, under way.
struct Walker<'a> {
    building: &'a Building,
    noise: Noise,
    random: Random,
    settings: phone::Parameters,
    /// Of the person's steps to those that the phone believes in.
    scale: f64,
    bias: f64,
    weather: f64,
    place: Vector3<f64>,
    /// Direction of the last step. **Units:** rad.
    direction: Option<f64>,
    /// Sum of the errors of the heading, and the heading that the phone told last. **Units:** rad.
    drift: f64,
    told: f64,
    /// Error of the height, and the height that the phone told last. **Units:** m.
    off_m: f64,
    told_m: f64,
    seconds: f64,
    walk: PhoneWalk,
}

impl<'a> Walker<'a> {
    fn new(building: &'a Building, noise: &Noise, place: Vector3<f64>, floor: i32, seed: u64) -> Self {
        let mut random = Random::new(seed, Purpose::PhoneSteps);
        let [scale, bias, weather] = random.normals();
        let walk =
            PhoneWalk { steps: Vec::new(), truth: vec![place], floors: vec![floor], changes: Vec::new(), heading: 0.0 };
        Self {
            building,
            noise: *noise,
            random,
            settings: phone::Parameters::documented(),
            scale: 1.0 + noise.scale * scale,
            bias: noise.bias * bias,
            weather: noise.weather * weather,
            place,
            direction: None,
            drift: 0.0,
            told: 0.0,
            off_m: 0.0,
            told_m: place.z,
            seconds: 0.0,
            walk,
        }
    }

    fn ride(&mut self, rise_m: f64) {
        if rise_m != 0.0 {
            self.pass(2.0 * DOORS_S + rise_m.abs() / RIDE_M_S);
            self.place.z += rise_m;
        }
    }

    /// Time goes by.
    fn pass(&mut self, seconds: f64) {
        self.seconds += seconds;
        self.drift += self.bias * seconds;
        let stays = (-seconds / self.noise.height_s).exp();
        self.off_m = stays * self.off_m + self.noise.height_m * (1.0 - stays * stays).sqrt() * self.random.normal();
    }

    fn walk(&mut self, run: &Run) {
        let mut s = 0.0;
        while s < run.length() - 1e-6 {
            let tread = run.tread(s);
            let length = tread
                .unwrap_or_else(|| (STEP_M * self.scale + self.noise.length_m * self.random.normal()).clamp(0.3, 1.2));
            s = (s + length).min(run.length());
            self.pass(STEP_S);
            if let Some(place) = run.at(s) {
                self.step(place, tread.is_some());
            }
        }
    }

    /// A step to a place.
    fn step(&mut self, place: Vector3<f64>, on_stairs: bool) {
        let moved = place - self.place;
        self.place = place;
        let fallback = self.direction.unwrap_or_else(|| moved.y.atan2(moved.x));
        let direction = if moved.xy().norm() < ON_THE_SPOT_M { fallback } else { moved.y.atan2(moved.x) };
        if self.direction.replace(direction).is_none() {
            self.walk.heading = direction;
            self.told = direction;
            let first = self.walk.truth[0];
            self.tell((0.0, 0.0, 0.0), self.seconds - STEP_S);
            self.told_m = first.z;
        }
        self.drift += self.noise.heading * self.random.normal();
        if self.random.unit() < self.noise.missed {
            return;
        }
        let heading = direction + self.drift + self.noise.hand * self.random.normal();
        let turn = wrapped(heading - self.told);
        self.told = heading;
        let height_m = place.z + self.off_m + self.weather * self.seconds;
        let rise_m = height_m - self.told_m;
        self.told_m = height_m;
        self.tell((if on_stairs { STAIRS_STEP_M } else { STEP_M }, turn, rise_m), self.seconds);
        let before = self.walk.floors.last().copied().unwrap_or_default();
        let floor = floor_at(self.building, place.z).unwrap_or(before);
        if floor != before {
            self.walk.changes.push(Change { step: self.walk.steps.len() - 1, to: floor });
        }
        self.walk.truth.push(place);
        self.walk.floors.push(floor);
    }

    fn tell(&mut self, (length, turn, rise): (f64, f64, f64), seconds: f64) {
        let index = self.walk.steps.len() as u32;
        let time = Micros((seconds * 1e6).round() as i64);
        let measured = Measured { index, time, length, part: self.settings.length_part, turn, rise: Some(rise) };
        self.walk.steps.push(measured.step(&self.settings));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{generate, route};

    fn walk(noise: &Noise, seed: u64) -> PhoneWalk {
        let building = generate::twin(2);
        let pieces = route::plan(&building, &["W01", "stairs-W", "E12", "elevator", "W03"]).unwrap();
        PhoneWalk::along(&building, &pieces, noise, seed).unwrap()
    }

    const NONE: Noise = Noise {
        scale: 0.0,
        length_m: 0.0,
        heading: 0.0,
        bias: 0.0,
        hand: 0.0,
        missed: 0.0,
        height_m: 0.0,
        height_s: 5.0,
        weather: 0.0,
    };

    /// Where the steps lead when they are put end to end.
    fn reckoned(walk: &PhoneWalk) -> Vec<Vector3<f64>> {
        let (mut place, mut heading) = (walk.truth[0], walk.heading);
        let next = |step: &Step| {
            let (sin, cos) = heading.sin_cos();
            let [x, y, z] = step.displacement.map(f64::from).into();
            place += Vector3::new(cos * x - sin * y, sin * x + cos * y, z);
            heading += f64::from(step.turn);
            place
        };
        walk.steps.iter().map(next).collect()
    }

    #[test]
    fn without_errors_the_steps_lead_along_the_way() {
        let walk = walk(&NONE, 1);
        assert_eq!(walk.steps.len(), walk.truth.len());
        assert_eq!(walk.changes.iter().map(|change| change.to).collect::<Vec<_>>(), [1, 0]);
        // Rounded corners are shorter than the steps say, and treads of 0.28 m than those of 0.30 m.
        let off = |at: usize| (reckoned(&walk)[at] - walk.truth[at]).xy().norm();
        assert!(off(10) < 0.4 && off(walk.steps.len() - 1) < 6.0, "{} {}", off(10), off(walk.steps.len() - 1));
        for (reckoned, truth) in reckoned(&walk).iter().zip(&walk.truth) {
            assert!((reckoned.z - truth.z).abs() < 1e-3);
        }
    }

    #[test]
    fn errors_grow_as_they_are_set() {
        let ends: Vec<f64> = (0..40)
            .map(|seed| {
                let walk = walk(&Noise { heading: Noise::default().heading, ..NONE }, seed);
                let turned: f64 = walk.steps.iter().map(|step| f64::from(step.turn)).sum();
                let truth = walk.truth[walk.truth.len() - 1] - walk.truth[walk.truth.len() - 2];
                wrapped(walk.heading + turned - truth.y.atan2(truth.x))
                    / (Noise::default().heading * (walk.steps.len() as f64).sqrt())
            })
            .collect();
        let spread = (ends.iter().map(|end| end * end).sum::<f64>() / 40.0).sqrt();
        // Four standard errors of a standard deviation of 40.
        assert!((spread - 1.0).abs() < 4.0 / 80.0_f64.sqrt(), "{spread}");
        let fewer = walk(&Noise { missed: 0.5, ..NONE }, 3).steps.len() as f64 / walk(&NONE, 3).steps.len() as f64;
        assert!((fewer - 0.5).abs() < 0.15, "{fewer}");
    }
}
