//! A detector for every pace: walking, running, stairs, with one set of settings.
//!
//! No fixed threshold on the SHOE statistic serves walk and run: the stance of a runner is as restless as the early swing
//! of a walker (about 3e4 against 8e3). What the stances of one person at one pace have in common is their restlessness,
//! so each is measured by the stillest moment of about the last stride:
//!
//! * The velocity of the standing foot is held to zero the less, the more restless the moment is compared with that
//!   ([`Verdict::velocity_sigma`]): there is no edge at which a wrong decision could do harm.
//! * The stance itself begins below a small multiple of it and ends above a larger one.
//! * When the pace rises, the stillest moment of the new pace is a local minimum of the statistic at which the filter says
//!   that the foot hardly moves. In a swing there are local minima too, but the foot moves at metres per second. The
//!   speed that the filter is certain of tells them apart.
//!
//! # Source
//! SHOE: Skog et al. 2010 (see [`super`]). The soft update and its cube: SPEC section 9. The use of the speed is the
//! project's own.

use super::shoe::{self, Shoe};
use super::{StanceDetector, Verdict};
use crate::sample::{AccelCorrected, GyroCorrected};
use crate::time::Micros;
use nalgebra::Vector3;

/// Settings of [`Adaptive`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Parameters {
    /// Noise of the accelerometer that weighs its part of the statistic. **Units:** m/s².
    pub accel_sigma: f32,
    /// Noise of the gyroscope that weighs its part. **Units:** rad/s.
    pub gyro_sigma: f32,
    /// How far back the stillest moment is looked for: about a stride. **Units:** s.
    pub lookback_s: f32,
    /// The stillest moment counts as at least this restless: someone who stands has nothing to compare with. **Units:** 1.
    pub floor: f32,
    /// And as at most this restless. **Units:** 1.
    pub ceiling: f32,
    /// A moment more restless than this is no stance at any pace. **Units:** 1.
    pub limit: f32,
    /// How far the velocity is from zero in the stillest moments (standard deviation). **Units:** m/s.
    pub velocity_sigma: f32,
    /// A stance begins below this multiple of the stillest moment. **Units:** 1.
    pub enter: f32,
    /// A stance ends above this multiple. **Units:** 1.
    pub leave: f32,
    /// Time below `enter` after which it is a stance. **Units:** s.
    pub confirm_s: f32,
    /// A foot whose speed certainly exceeds this is in its swing. **Units:** m/s.
    pub swing_speed: f32,
    /// A local minimum of the statistic at a speed below this is a stance of a quicker pace. **Units:** m/s.
    pub new_pace_speed: f32,
    /// It is one only this long after the last stance. **Units:** s.
    pub new_pace_after_s: f32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            accel_sigma: 0.02,
            gyro_sigma: 0.2_f32.to_radians(),
            lookback_s: 1.3,
            floor: 5e3,
            ceiling: 1e5,
            limit: 3e5,
            velocity_sigma: 0.01,
            enter: 3.0,
            leave: 6.0,
            confirm_s: 0.02,
            swing_speed: 0.4,
            new_pace_speed: 0.2,
            new_pace_after_s: 0.2,
        }
    }
}

/// What a filter knows of the speed of the foot. **Units:** m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// The most likely speed.
    pub likely: f32,
    /// The speed the foot has without doubt.
    pub certain: f32,
}

/// Parts that the time looked back over is cut into.
const PARTS: usize = 16;

/// The detector, for who knows the statistic of a moment and, if there is a filter, the speed: [`Adaptive::judge`].
#[derive(Clone, Debug)]
pub struct Adaptive {
    parameters: Parameters,
    /// Least statistic of each part of the time looked back over; the last is the running one.
    least: [f32; PARTS],
    part_start: Option<Micros>,
    last: Option<(Micros, f32)>,
    before: f32,
    standing: bool,
    /// The foot has certainly moved since it last stood.
    swung: bool,
    calm_since: Option<Micros>,
    stood_until: Option<Micros>,
}

impl Adaptive {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            parameters: *parameters,
            // Nothing seen yet: someone may have stood still.
            least: [0.0; PARTS],
            part_start: None,
            last: None,
            before: f32::INFINITY,
            standing: false,
            swung: true,
            calm_since: None,
            stood_until: None,
        }
    }

    /// Forgets everything seen.
    pub fn reset(&mut self) {
        *self = Self::new(&self.parameters);
    }

    /// The SHOE statistic of some samples from their sums. **Units:** `count` samples, m/s², m²/s⁴, rad²/s², m/s².
    pub fn statistic(
        &self,
        count: f32,
        accel_sum: &Vector3<f32>,
        accel_square_sum: f32,
        gyro_square_sum: f32,
        gravity: f32,
    ) -> f32 {
        let Parameters { accel_sigma, gyro_sigma, .. } = self.parameters;
        let mean = libm::sqrtf(accel_sum.norm_squared()) / count;
        let spread = (accel_square_sum / count - mean * mean).max(0.0);
        let off = mean - gravity;
        (spread + off * off) / (accel_sigma * accel_sigma) + gyro_square_sum / count / (gyro_sigma * gyro_sigma)
    }

    /// The stillest moment of about the last stride, within its bounds. **Units:** 1.
    pub fn stillest(&self) -> f32 {
        let least = self.least.iter().fold(f32::INFINITY, |least, &part| if part < least { part } else { least });
        // Not `clamp`, which panics when settings put the floor above the ceiling.
        least.max(self.parameters.floor).min(self.parameters.ceiling)
    }

    /// Judges the moment `time` from its statistic and, if there is a filter that knows it, from the speed of the foot.
    pub fn judge(&mut self, time: Micros, statistic: f32, speed: Option<Speed>) -> Verdict {
        let p = self.parameters;
        if !statistic.is_finite() {
            self.reset();
            return Verdict::unknown();
        }
        self.look_for_a_new_pace(statistic, speed);
        self.remember(time, statistic);
        let stillest = self.stillest();

        let swings = speed.is_some_and(|speed| speed.certain > p.swing_speed);
        if self.standing {
            if statistic > p.leave * stillest {
                self.standing = false;
                self.calm_since = None;
            }
        } else if statistic < p.leave * stillest && speed.is_some() && !self.swung {
            // The foot has not gone anywhere: it was a restless moment of the same stance.
            self.calm_since = Some(time);
            self.standing = true;
        } else {
            // Once it has begun, a stance may be as restless as one that goes on.
            let bound = if self.calm_since.is_some() { p.leave } else { p.enter };
            if statistic < (bound * stillest).min(p.limit) && !swings {
                let since = *self.calm_since.get_or_insert(time);
                self.standing = time - since >= (p.confirm_s * 1e6) as i64;
            } else {
                self.calm_since = None;
            }
        }
        if self.standing {
            self.stood_until = Some(time);
        }
        self.swung = swings || (self.swung && !self.standing);
        self.before = self.last.map_or(f32::INFINITY, |(_, statistic)| statistic);
        self.last = Some((time, statistic));

        let velocity_sigma = (statistic < p.limit && !swings).then(|| {
            let restless = (statistic / stillest).max(1.0);
            p.velocity_sigma * restless * restless * restless
        });
        Verdict { stance: self.standing, statistic, velocity_sigma }
    }

    /// The statistic of the last moment that was judged. **Units:** 1.
    pub fn latest(&self) -> Option<f32> {
        self.last.map(|(_, statistic)| statistic)
    }

    /// The statistic below which the foot stands now, if it does not move too fast. **Units:** 1.
    pub fn bound(&self) -> f32 {
        let p = self.parameters;
        if self.standing { p.leave * self.stillest() } else { (p.enter * self.stillest()).min(p.limit) }
    }

    /// When the stance that is on began.
    pub fn standing_since(&self) -> Option<Micros> {
        self.calm_since.filter(|_| self.standing)
    }

    /// The last moment was a local minimum, the foot hardly moved, and a stance is due: the person goes at a quicker pace.
    fn look_for_a_new_pace(&mut self, statistic: f32, speed: Option<Speed>) {
        let p = &self.parameters;
        let (Some((time, least)), Some(speed)) = (self.last, speed) else { return };
        let due = !self.standing && self.stood_until.is_none_or(|until| time.since(until) > p.new_pace_after_s);
        let minimum = least <= self.before && least <= statistic;
        if due && minimum && least < p.limit && least > 2.0 * self.stillest() && speed.likely < p.new_pace_speed {
            self.least = [f32::INFINITY; PARTS];
            self.least[PARTS - 1] = least;
            self.calm_since = Some(time);
            // The speed confirms it; a runner's stance is too short to wait for more.
            self.standing = true;
        }
    }

    fn remember(&mut self, time: Micros, statistic: f32) {
        let part = ((self.parameters.lookback_s * 1e6) as i64 / PARTS as i64).max(1);
        let start = *self.part_start.get_or_insert(time);
        let passed = time - start;
        if passed < 0 || passed >= part.saturating_mul(PARTS as i64 + 1) {
            self.least = [0.0; PARTS];
            self.part_start = Some(time);
        } else {
            for _ in 0..passed / part {
                self.least.rotate_left(1);
                self.least[PARTS - 1] = f32::INFINITY;
            }
            self.part_start = Some(start + passed / part * part);
        }
        let newest = &mut self.least[PARTS - 1];
        *newest = newest.min(statistic);
    }
}

/// The detector on samples alone, with the window that it takes the statistic from.
#[derive(Clone, Debug)]
pub struct FromSamples {
    shoe: Shoe,
    adaptive: Adaptive,
}

impl FromSamples {
    /// A detector that has seen nothing.
    pub fn new(parameters: &Parameters) -> Self {
        let &Parameters { accel_sigma, gyro_sigma, .. } = parameters;
        let statistic = shoe::Parameters { accel_sigma, gyro_sigma, ..Default::default() };
        Self { shoe: Shoe::new(&statistic), adaptive: Adaptive::new(parameters) }
    }
}

impl StanceDetector for FromSamples {
    fn push(&mut self, time: Micros, accel: AccelCorrected, gyro: GyroCorrected, gravity: f32) -> Verdict {
        let statistic = self.shoe.push(time, accel, gyro, gravity).statistic;
        self.adaptive.judge(time, statistic, None)
    }

    fn reset(&mut self) {
        self.shoe.reset();
        self.adaptive.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(speed: f32) -> Option<Speed> {
        Some(Speed { likely: speed, certain: speed })
    }

    /// Statistic and speed of strides of `stride` seconds whose stance, 0.3 of each, is as restless as `least`.
    fn stride(t: f32, stride: f32, least: f32) -> (f32, f32) {
        let phase = t / stride - libm::floorf(t / stride);
        if phase < 0.3 {
            let off = (phase - 0.15) / 0.15;
            return (least * (1.0 + 8.0 * off * off), 0.05);
        }
        let swing = libm::sinf(core::f32::consts::PI * (phase - 0.3) / 0.7);
        // In the middle of the swing the statistic is low again for a moment, as in real walks.
        let dip = if (phase - 0.6).abs() < 0.03 { 6e4 } else { 2e6 };
        (dip, 3.0 * swing)
    }

    fn stances(paces: &[(f32, f32, usize)]) -> usize {
        let mut detector = Adaptive::new(&Parameters::default());
        let (mut time, mut count, mut stood) = (0, 0, false);
        for &(length, least, strides) in paces {
            for i in 0..(length * 100.0 * strides as f32) as i64 {
                let (statistic, speed) = stride(i as f32 * 0.01, length, least);
                let verdict = detector.judge(Micros(time), statistic, at(speed));
                count += usize::from(verdict.stance && !stood);
                stood = verdict.stance;
                time += 10_000;
            }
        }
        count
    }

    #[test]
    fn walking_and_running_and_back_miss_no_stance_and_invent_none() {
        assert_eq!(stances(&[(1.2, 2e3, 20), (0.7, 5e4, 20), (1.2, 2e3, 20)]), 60);
    }

    #[test]
    fn standing_for_long_is_one_stance() {
        let mut detector = Adaptive::new(&Parameters::default());
        let stood = (0..2000).filter(|&i| detector.judge(Micros(i * 10_000), 5.0, at(0.01)).stance).count();
        // All but the two increments that confirm it.
        assert_eq!(stood, 1998);
    }

    #[test]
    fn a_restless_moment_holds_the_velocity_less() {
        let mut detector = Adaptive::new(&Parameters::default());
        let still = detector.judge(Micros(0), 4e3, at(0.0)).velocity_sigma.unwrap();
        let restless = detector.judge(Micros(10_000), 2e4, at(0.0)).velocity_sigma.unwrap();
        assert!((still - 0.01).abs() < 1e-6);
        assert!((restless - 0.64).abs() < 1e-4);
        assert_eq!(detector.judge(Micros(20_000), 4e5, at(0.0)).velocity_sigma, None);
        assert_eq!(detector.judge(Micros(30_000), 4e3, at(2.0)).velocity_sigma, None);
    }

    proptest! {
        #[test]
        fn a_calmer_moment_never_holds_less(a in 1.0_f32..2.9e5, b in 1.0_f32..2.9e5) {
            let sigma = |statistic| {
                let mut detector = Adaptive::new(&Parameters::default());
                detector.judge(Micros(0), 3e3, at(0.0));
                detector.judge(Micros(10_000), statistic, at(0.0)).velocity_sigma.unwrap()
            };
            let (calmer, other) = if a < b { (a, b) } else { (b, a) };
            prop_assert!(sigma(calmer) <= sigma(other));
        }

        #[test]
        fn no_settings_make_it_panic(
            [accel_sigma, gyro_sigma, lookback_s, floor, ceiling, limit, velocity_sigma] in [any::<f32>(); 7],
            [enter, leave, confirm_s, swing_speed, new_pace_speed, new_pace_after_s] in [any::<f32>(); 6],
            moments in prop::collection::vec((any::<i64>(), any::<f32>(), any::<f32>()), 1..40),
        ) {
            let parameters = Parameters {
                accel_sigma, gyro_sigma, lookback_s, floor, ceiling, limit, velocity_sigma,
                enter, leave, confirm_s, swing_speed, new_pace_speed, new_pace_after_s,
            };
            let mut detector = Adaptive::new(&parameters);
            for (time, statistic, speed) in moments {
                detector.judge(Micros(time), statistic, at(speed));
            }
        }

        #[test]
        fn the_stillest_moment_is_never_above_the_ceiling(floor in 0.0_f32..1e6, ceiling in 0.0_f32..1e6, least in 0.0_f32..1e6) {
            let mut detector = Adaptive::new(&Parameters { floor, ceiling, ..Parameters::default() });
            detector.judge(Micros(0), least, None);
            prop_assert!(detector.stillest() <= ceiling);
        }
    }
}
