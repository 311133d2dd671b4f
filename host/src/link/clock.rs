//! When something that the shoe tells of happened by the laptop's clock.
//!
//! Each question for the time brings four times: asked and heard by the laptop's clock, received and sent by the shoe's. The
//! middles of both pairs are the same moment, wrong by at most half of the round trip. Of each quarter of a minute the
//! quickest round trip is kept, and a straight line is laid through those, each trusted as its round trip was quick: a
//! delayed reply says little and does no harm. The line's slope is the drift of the two crystals.
//!
//! # Source
//! Offset and round trip: RFC 5905, section 8. Quickest of several: RFC 5905, section 10. The line: weighted least squares
//! with a normal prior of the slope.

use sohle_shared::time::Micros;
use sohle_shared::wire::message::TimeReply;
use std::collections::VecDeque;

/// Of so long the quickest round trip is kept. **Units:** microseconds.
const BLOCK_US: i64 = 15_000_000;
/// Round trips kept: 16 minutes of an unbroken connection.
const KEPT: usize = 64;
/// Two crystals drift apart no faster. **Units:** s/s.
const DRIFT_MAX: f64 = 200e-6;
/// What the drift usually is. **Units:** s/s, standard deviation.
const DRIFT_SIGMA: f64 = 50e-6;
/// How far the drift may wander with the temperature while round trips are kept. **Units:** s/s.
const WANDER: f64 = 5e-6;
/// No round trip is trusted further: stamps are taken by programs. **Units:** microseconds.
const SHORTEST_US: f64 = 50.0;

/// Both clocks at the same moment.
#[derive(Clone, Copy, Debug)]
struct Exchange {
    host: Micros,
    shoe: Micros,
    /// How wrong it may be: half of the round trip. **Units:** microseconds.
    half_us: f64,
}

impl Exchange {
    /// What the laptop's clock is ahead of the shoe's.
    fn offset(&self) -> i64 {
        self.host - self.shoe
    }
}

/// The laptop's time as a straight line over the shoe's.
#[derive(Clone, Copy, Debug)]
struct Relation {
    /// Where both are counted from.
    origin: Exchange,
    /// Beyond the origin's offset. **Units:** microseconds.
    ahead_us: f64,
    /// **Units:** s/s.
    drift: f64,
    /// How wrong the drift may be. **Units:** s/s.
    drift_error: f64,
}

impl Relation {
    /// What the laptop's clock is ahead of the shoe's at the shoe's time, beyond the origin's offset. **Units:**
    /// microseconds.
    fn ahead_us(&self, shoe: Micros) -> f64 {
        self.ahead_us + self.drift * (shoe - self.origin.shoe) as f64
    }

    /// How far an exchange lies from the line. **Units:** microseconds.
    fn residual_us(&self, exchange: &Exchange) -> f64 {
        exchange.offset().saturating_sub(self.origin.offset()) as f64 - self.ahead_us(exchange.shoe)
    }
}

/// The shoe's clock, seen from the laptop. One for each boot of the shoe.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    kept: VecDeque<Exchange>,
    relation: Option<Relation>,
    now: Micros,
}

impl Clock {
    /// Takes in an answered question. `asked` and `heard` are by the laptop's clock. What contradicts itself changes nothing.
    pub fn exchange(&mut self, asked: Micros, reply: &TimeReply, heard: Micros) {
        self.advance(heard);
        let held = reply.sent - reply.received;
        let half = (heard - asked).saturating_sub(held) / 2;
        if held < 0 || half < 0 {
            return;
        }
        let exchange = Exchange {
            host: asked + (heard - asked) / 2,
            shoe: reply.received + held / 2,
            half_us: (half as f64).max(SHORTEST_US),
        };
        let block = |exchange: &Exchange| exchange.host.0.div_euclid(BLOCK_US);
        match self.kept.back_mut() {
            Some(last) if block(last) == block(&exchange) => {
                if exchange.half_us < last.half_us {
                    *last = exchange;
                }
            }
            _ => self.kept.push_back(exchange),
        }
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
        self.relation = self.relate();
    }

    /// Tells how late it is by the laptop's clock, so that [`Clock::error_bound`] is that of now.
    pub fn advance(&mut self, now: Micros) {
        self.now = self.now.max(now);
    }

    /// The same moment by the laptop's clock; `None` before the first exchange.
    pub fn to_host(&self, shoe: Micros) -> Option<Micros> {
        let relation = self.relation?;
        Some(shoe + relation.origin.offset() + relation.ahead_us(shoe).round() as i64)
    }

    /// The same moment by the clock of the shoe; `None` before the first exchange.
    pub fn to_shoe(&self, host: Micros) -> Option<Micros> {
        let relation = self.relation?;
        let guess = host + relation.origin.offset().saturating_neg();
        // The clocks drift apart slowly: what is left after this is less than a microsecond.
        let ahead_us = relation.ahead_us(guess) / (1.0 + relation.drift);
        Some(guess + -ahead_us.round() as i64)
    }

    /// How much faster the laptop's clock runs. **Units:** s/s.
    pub fn drift(&self) -> Option<f64> {
        self.relation.map(|relation| relation.drift)
    }

    /// How wrong [`Clock::to_host`] may be for a moment of now: half of the best round trip and what the drift may have
    /// added since. It holds as long as the crystals keep to 200 ppm and their drift wanders by less than 5 ppm. **Units:** s.
    pub fn error_bound(&self) -> Option<f64> {
        let relation = self.relation?;
        let bound_us = |exchange: &Exchange| {
            let since = (self.now - exchange.host) as f64;
            exchange.half_us + relation.residual_us(exchange).abs() + relation.drift_error * since
        };
        self.kept.iter().map(bound_us).min_by(f64::total_cmp).map(|bound_us| bound_us * 1e-6)
    }

    fn relate(&self) -> Option<Relation> {
        let origin = *self.kept.back()?;
        let point = |exchange: &Exchange| {
            let x = (exchange.shoe - origin.shoe) as f64;
            (x, exchange.offset().saturating_sub(origin.offset()) as f64)
        };
        let (mut w, mut wx, mut wy, mut wxx, mut wxy) = (0.0, 0.0, 0.0, DRIFT_SIGMA.powi(-2), 0.0);
        for exchange in &self.kept {
            let (x, y) = point(exchange);
            let weight = (exchange.half_us + WANDER * x.abs()).powi(-2);
            w += weight;
            wx += weight * x;
            wy += weight * y;
            wxx += weight * x * x;
            wxy += weight * x * y;
        }
        let determinant = w * wxx - wx * wx;
        let drift = (w * wxy - wx * wy) / determinant;
        // Whatever the delays were, the slope between two exchanges is wrong by no more than both round trips allow.
        let by_pair = self.kept.iter().enumerate().flat_map(|(i, late)| {
            self.kept.iter().take(i).filter_map(move |early| {
                let ((x0, y0), (x1, y1)) = (point(early), point(late));
                let error = ((y1 - y0) / (x1 - x0) - drift).abs() + (early.half_us + late.half_us) / (x1 - x0);
                (x1 > x0).then_some(error)
            })
        });
        let drift_error = by_pair.fold(DRIFT_MAX + drift.abs(), f64::min) + WANDER;
        Some(Relation { origin, ahead_us: (wxx * wy - wx * wxy) / determinant, drift, drift_error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::random::{Purpose, Random};
    use proptest::prelude::*;

    /// Where the shoe's clock stands when the laptop's begins, and how much slower it runs.
    #[derive(Clone, Copy)]
    struct Truth {
        start_us: f64,
        drift: f64,
    }

    impl Truth {
        fn shoe(&self, host_us: f64) -> Micros {
            Micros((self.start_us + host_us / (1.0 + self.drift)).round() as i64)
        }
    }

    /// An exchange each two seconds with these delays there and back. **Units:** s.
    fn talk(clock: &mut Clock, truth: Truth, from_s: u32, to_s: u32, mut delays: impl FnMut() -> [f64; 2]) {
        for second in (from_s..to_s).step_by(2) {
            let asked = f64::from(second) * 1e6;
            let [there, back] = delays().map(|delay| delay * 1e6);
            let received = truth.shoe(asked + there);
            let sent = truth.shoe(asked + there + 300.0);
            let reply = TimeReply { number: 0, received, sent };
            clock.exchange(Micros(asked as i64), &reply, Micros((asked + there + 300.0 + back) as i64));
        }
    }

    fn error_s(clock: &Clock, truth: Truth, at_s: u32) -> f64 {
        let host = clock.to_host(truth.shoe(f64::from(at_s) * 1e6)).unwrap();
        (host.as_seconds() - f64::from(at_s)).abs()
    }

    const TRUTH: Truth = Truth { start_us: 7e6, drift: 50e-6 };

    /// A millisecond and a random part there and back, and now and then half a second.
    fn jitter(random: &mut Random) -> [f64; 2] {
        std::array::from_fn(|_| {
            let spike = if random.unit() < 0.1 { 0.5 * random.unit() } else { 0.0 };
            0.001 - 0.004 * libm::log(1.0 - random.unit()) + spike
        })
    }

    #[test]
    fn nothing_is_known_before_the_first_exchange() {
        let clock = Clock::default();
        assert_eq!((clock.to_host(Micros(5)), clock.error_bound(), clock.drift()), (None, None, None));
    }

    #[test]
    fn jitter_and_spikes_do_little_and_the_drift_is_found() {
        let mut random = Random::new(1, Purpose::FromShoe);
        let mut clock = Clock::default();
        talk(&mut clock, TRUTH, 0, 600, || jitter(&mut random));
        // Of seven round trips the quickest has some milliseconds, and forty of those are averaged.
        assert!(error_s(&clock, TRUTH, 600) < 1e-3, "{}", error_s(&clock, TRUTH, 600));
        assert!((clock.drift().unwrap() - 50e-6).abs() < 5e-6, "{:?}", clock.drift());
        assert!(clock.error_bound().unwrap() < 5e-3, "{:?}", clock.error_bound());
    }

    #[test]
    fn an_asymmetric_line_stays_within_the_bound() {
        let mut clock = Clock::default();
        talk(&mut clock, TRUTH, 0, 600, || [0.020, 0.002]);
        let (error, bound) = (error_s(&clock, TRUTH, 600), clock.error_bound().unwrap());
        // The difference of the delays cannot be seen; half of it is the error.
        assert!((error - 0.009).abs() < 1e-3 && error < bound && bound < 0.0125, "{error} {bound}");
    }

    #[test]
    fn ten_minutes_of_silence_cost_little_and_are_told() {
        let mut random = Random::new(2, Purpose::FromShoe);
        let mut clock = Clock::default();
        talk(&mut clock, TRUTH, 0, 600, || jitter(&mut random));
        let before = clock.error_bound().unwrap();
        clock.advance(Micros(1_200_000_000));
        let (error, bound) = (error_s(&clock, TRUTH, 1_200), clock.error_bound().unwrap());
        // 600 s at a drift that was measured to some ppm; without drift it would be 30 ms.
        assert!(error < 3e-3 && error < bound && bound > before && bound < 0.015, "{error} {before} {bound}");
        talk(&mut clock, TRUTH, 1_200, 1_230, || jitter(&mut random));
        assert!(clock.error_bound().unwrap() < 0.006, "{:?}", clock.error_bound());
    }

    #[test]
    fn replies_that_contradict_themselves_change_nothing() {
        let mut clock = Clock::default();
        let reply = |received, sent| TimeReply { number: 0, received: Micros(received), sent: Micros(sent) };
        clock.exchange(Micros(0), &reply(100, 50), Micros(1_000));
        clock.exchange(Micros(0), &reply(100, 5_000), Micros(1_000));
        clock.exchange(Micros(1_000), &reply(100, 100), Micros(0));
        assert_eq!(clock.error_bound(), None);
        clock.exchange(Micros(0), &reply(100, 200), Micros(1_000));
        assert_eq!(clock.to_host(Micros(150)), Some(Micros(500)));
    }

    proptest! {
        #[test]
        fn the_error_is_within_the_bound(
            seed in any::<u64>(),
            drift in -150e-6..150e-6_f64,
            start_us in -1e12..1e12_f64,
            minutes in 1_u32..20,
            silence in 0_u32..600,
        ) {
            let truth = Truth { start_us, drift };
            let mut random = Random::new(seed, Purpose::FromShoe);
            let mut clock = Clock::default();
            talk(&mut clock, truth, 0, minutes * 60, || jitter(&mut random));
            let now = minutes * 60 + silence;
            clock.advance(Micros(i64::from(now) * 1_000_000));
            // Two microseconds of rounding.
            prop_assert!(error_s(&clock, truth, now) < clock.error_bound().unwrap() + 2e-6);
        }

        #[test]
        fn no_times_panic(times in proptest::collection::vec(any::<[i64; 4]>(), 1..80)) {
            let mut clock = Clock::default();
            for [asked, received, sent, heard] in times {
                let reply = TimeReply { number: 0, received: Micros(received), sent: Micros(sent) };
                clock.exchange(Micros(asked), &reply, Micros(heard));
                clock.to_host(Micros(sent));
                clock.error_bound();
            }
        }
    }
}
