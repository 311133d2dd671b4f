//! Shapes over time that start and end without a jolt: splines, smooth steps, a damped knock, a lift's ride.
//!
//! Everything a simulated foot does is composed of these four, all at least three times continuously differentiable,
//! so that the acceleration and its rate of change have no jumps.

use super::jet::Jet;

/// Number of intervals of a [`spline`] over its unit range.
pub const INTERVALS: usize = 40;

/// Control values of a [`spline`], one at each fortieth of the range.
pub type Controls = [f64; INTERVALS + 1];

/// Quintic uniform B-spline over `u` in 0..1 with its derivatives (four times continuously differentiable).
///
/// Beyond either end the last control value continues; with three equal control values at an end the spline arrives
/// there at rest. It stays inside the hull of its control values and does not pass through them.
pub fn spline(controls: &Controls, u: Jet) -> Jet {
    let last = INTERVALS as f64;
    let at = u.value.clamp(0.0, 1.0) * last;
    // Truncation is the floor of a value that is not negative.
    let cell = (at as usize).min(INTERVALS - 1);
    let x = at - cell as f64;
    let c: [f64; 6] = std::array::from_fn(|i| controls[(cell + i).saturating_sub(2).min(INTERVALS)]);
    let (x2, y) = (x * x, 1.0 - x);
    let (x3, y2) = (x2 * x, y * y);
    let (x4, y3) = (x2 * x2, y2 * y);
    let (x5, y4) = (x4 * x, y2 * y2);
    let weigh = |weights: [f64; 6]| c.iter().zip(weights).map(|(c, w)| c * w).sum::<f64>();
    let value = weigh([
        y4 * y,
        5.0 * x5 - 20.0 * x4 + 20.0 * x3 + 20.0 * x2 - 50.0 * x + 26.0,
        -10.0 * x5 + 30.0 * x4 - 60.0 * x2 + 66.0,
        10.0 * x5 - 20.0 * x4 - 20.0 * x3 + 20.0 * x2 + 50.0 * x + 26.0,
        -5.0 * x5 + 5.0 * x4 + 10.0 * x3 + 10.0 * x2 + 5.0 * x + 1.0,
        x5,
    ]);
    let first = weigh([
        -5.0 * y4,
        25.0 * x4 - 80.0 * x3 + 60.0 * x2 + 40.0 * x - 50.0,
        -50.0 * x4 + 120.0 * x3 - 120.0 * x,
        50.0 * x4 - 80.0 * x3 - 60.0 * x2 + 40.0 * x + 50.0,
        -25.0 * x4 + 20.0 * x3 + 30.0 * x2 + 20.0 * x + 5.0,
        5.0 * x4,
    ]);
    let second = weigh([
        20.0 * y3,
        100.0 * x3 - 240.0 * x2 + 120.0 * x + 40.0,
        -200.0 * x3 + 360.0 * x2 - 120.0,
        200.0 * x3 - 240.0 * x2 - 120.0 * x + 40.0,
        -100.0 * x3 + 60.0 * x2 + 60.0 * x + 20.0,
        20.0 * x3,
    ]);
    u.chain([value / 120.0, first / 120.0 * last, second / 120.0 * last * last])
}

/// From 0 at `u <= 0` to 1 at `u >= 1`: the polynomial of degree 7 whose first three derivatives vanish at both ends.
pub fn step(u: Jet) -> Jet {
    if u.value <= 0.0 {
        return Jet::default();
    }
    if u.value >= 1.0 {
        return Jet::constant(1.0);
    }
    let x = u.value;
    let (x2, y) = (x * x, 1.0 - x);
    u.chain([
        x2 * x2 * (35.0 - 84.0 * x + 70.0 * x2 - 20.0 * x2 * x),
        140.0 * x2 * x * y * y * y,
        420.0 * x2 * y * y * (1.0 - 2.0 * x),
    ])
}

/// [`step`] of a time, from 0 at `from` to 1 at `to`.
pub fn ramp(time: Jet, from: f64, to: f64) -> Jet {
    step((time + -from) * (1.0 / (to - from)))
}

/// From 0 up to 1 between `times[0]` and `times[1]`, back to 0 between `times[2]` and `times[3]`.
pub fn pulse(time: Jet, times: [f64; 4]) -> Jet {
    ramp(time, times[0], times[1]) - ramp(time, times[2], times[3])
}

/// A damped vibration after a blow at time 0, with an amplitude of about 1, that ends at `length`.
/// **Units:** time and length s, frequency Hz.
pub fn knock(time: Jet, frequency: f64, length: f64) -> Jet {
    if time.value <= 0.0 || time.value >= length {
        return Jet::default();
    }
    let (swing, _) = (time * (2.0 * std::f64::consts::PI * frequency)).sin_cos();
    let decay = Jet::constant(1.0) - ramp(time, 0.0, length);
    swing * ramp(time, 0.0, 0.7 / frequency) * decay * decay
}

/// First and second integral of [`step`], as a function of time.
fn step_integrals(time: f64, length: f64) -> (f64, f64) {
    let u = (time / length).clamp(0.0, 1.0);
    let u2 = u * u;
    let u5 = u2 * u2 * u;
    let once = u5 * (7.0 - 14.0 * u + 10.0 * u2 - 2.5 * u2 * u);
    let twice = u5 * u * (7.0 / 6.0 - 2.0 * u + 1.25 * u2 - 2.5 / 9.0 * u2 * u);
    let beyond = (time - length).max(0.0);
    (once * length + beyond, twice * length * length + beyond * (0.5 * length + 0.5 * beyond))
}

/// The ride of an elevator: acceleration, even speed, braking, with limited rates of change of the acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ride {
    rise: f64,
    acceleration: f64,
    onset: f64,
    held: f64,
    braking: f64,
}

/// Time in which an elevator's acceleration builds up. **Units:** s.
const ONSET_S: f64 = 0.6;

impl Ride {
    /// A ride over `rise` with at most `acceleration` and `speed`. **Units:** m, m/s², m/s; the last two above zero.
    pub fn new(rise: f64, acceleration: f64, speed: f64) -> Self {
        let distance = rise.abs();
        // The speed reached if braking follows at once: distance = v (v/a + onset).
        let reachable = 0.5 * acceleration * (libm::sqrt(ONSET_S * ONSET_S + 4.0 * distance / acceleration) - ONSET_S);
        let speed = speed.min(reachable);
        let held = speed / acceleration;
        let speeding = held + ONSET_S;
        let braking = if speed > 0.0 { distance / speed } else { 0.0 };
        Self { rise, acceleration, onset: ONSET_S, held, braking: braking.max(speeding) }
    }

    /// Time from standstill to standstill. **Units:** s.
    pub fn duration(&self) -> f64 {
        self.braking + self.held + self.onset
    }

    /// Height gained at `time` after the start. **Units:** s; m.
    pub fn height(&self, time: f64) -> Jet {
        let sign = if self.rise < 0.0 { -1.0 } else { 1.0 };
        let parts = [(0.0, 1.0), (self.held, -1.0), (self.braking, -1.0), (self.braking + self.held, 1.0)];
        let mut sum = Jet::default();
        for (start, weight) in parts {
            let since = time - start;
            if since > 0.0 {
                let (rate, value) = step_integrals(since, self.onset);
                let bend = ramp(Jet::linear(since, 1.0), 0.0, self.onset).value;
                sum = sum + Jet { value, rate, bend } * weight;
            }
        }
        sum * (self.acceleration * sign)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn consistent(f: impl Fn(f64) -> Jet, t: f64) -> bool {
        let h = 1e-5;
        let (before, here, after) = (f(t - h), f(t), f(t + h));
        let scale = 1.0 + here.bend.abs();
        ((after.value - before.value) / (2.0 * h) - here.rate).abs() < 1e-3 * scale
            && ((after.rate - before.rate) / (2.0 * h) - here.bend).abs() < 1e-3 * scale.max(1e2)
    }

    proptest! {
        #[test]
        fn every_shape_has_the_derivatives_it_claims(t in -0.2..1.2_f64, seed in 0_u64..1000) {
            let controls: Controls = std::array::from_fn(|i| ((i as u64 * 37 + seed) % 11) as f64 * 0.1);
            let controls: Controls = std::array::from_fn(|i| controls[i.clamp(2, INTERVALS - 2)]);
            let time = |t| Jet::linear(t, 1.0);
            prop_assert!(consistent(|t| spline(&controls, time(t)), t));
            prop_assert!(consistent(|t| pulse(time(t), [0.1, 0.4, 0.5, 0.9]), t));
            prop_assert!(consistent(|t| knock(time(t), 3.0, 0.8), t));
            let ride = Ride::new(-9.0, 0.8, 1.5);
            prop_assert!(consistent(|t| ride.height(t), (t + 0.2) * 7.0));
        }

        #[test]
        fn a_ride_arrives_and_keeps_its_limits(rise in -40.0..40.0_f64, a in 0.3..1.5_f64, v in 0.5..3.0_f64) {
            let ride = Ride::new(rise, a, v);
            let end = ride.height(ride.duration());
            prop_assert!((end.value - rise).abs() < 1e-9 && end.rate.abs() < 1e-9);
            for i in 0..=200 {
                let now = ride.height(ride.duration() * f64::from(i) / 200.0);
                prop_assert!(now.rate.abs() <= v + 1e-9 && now.bend.abs() <= a + 1e-9);
            }
        }
    }

    #[test]
    fn a_spline_with_three_equal_ends_rests_there() {
        let controls: Controls = std::array::from_fn(|i| if i < 3 { 0.0 } else { 1.0 });
        let end = spline(&controls, Jet::linear(1.0, 1.0));
        assert!((end.value - 1.0).abs() < 1e-12 && end.rate.abs() < 1e-9 && end.bend.abs() < 1e-9);
        let start = spline(&controls, Jet::linear(0.0, 1.0));
        assert!(start.value.abs() < 1e-12 && start.rate.abs() < 1e-9 && start.bend.abs() < 1e-9);
    }
}
