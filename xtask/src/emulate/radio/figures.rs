//! Figures of the check, and how they are told.

use crate::emulate::live::{Told, Walk};
use serde_json::Value;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

/// Times of many steps. **Units:** ms.
pub struct Spread {
    /// Half are no longer.
    pub median: f64,
    /// 99 % are no longer.
    pub almost_all: f64,
    /// None is longer.
    pub longest: f64,
}

impl Spread {
    /// Of these.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (values.len() as f64 * share) as usize;
            values.get(index.min(values.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
        };
        Self { median: at(0.5), almost_all: at(0.99), longest: at(1.0) }
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { median, almost_all, longest } = self;
        write!(out, "{median:.1} ms (median), {almost_all:.1} ms (99 %), {longest:.1} ms (longest)")
    }
}

/// How late steps come. The clock of the shoe is known well over the cable only: what Bluetooth takes longer is the time
/// between the lines of the two programs.
pub struct Latencies {
    /// From the end of the stance to the laptop, on the cable.
    pub wired: Spread,
    /// On Bluetooth.
    pub wireless: Spread,
    /// What Bluetooth takes longer.
    pub more: Spread,
}

impl Latencies {
    /// Of the steps that came on both.
    pub fn of(wired: &Walk, wireless: &Walk) -> Self {
        let pairs = || wired.steps.iter().filter_map(|(key, told)| Some((told, wireless.steps.get(key)?)));
        let more = |(wired, wireless): (&Told, &Told)| {
            let later = wireless.at.saturating_duration_since(wired.at).as_secs_f64();
            (later - wired.at.saturating_duration_since(wireless.at).as_secs_f64()) * 1e3
        };
        Self {
            wired: Spread::of(wired.steps.values().filter_map(|told| told.delay_ms)),
            wireless: Spread::of(pairs().filter_map(|pair| Some(pair.0.delay_ms? + more(pair)))),
            more: Spread::of(pairs().map(more)),
        }
    }
}

/// How long this machine lets a thread wait that wants to run: a busy one is no place to measure delays.
pub struct Lateness {
    stop: Arc<AtomicBool>,
    longest: JoinHandle<Duration>,
}

impl Lateness {
    /// Between two looks.
    const LOOK: Duration = Duration::from_millis(2);

    /// From now on.
    pub fn measure() -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let longest = spawn(move || {
            let mut longest = Duration::ZERO;
            while !stopped.load(Ordering::Relaxed) {
                let begun = Instant::now();
                sleep(Self::LOOK);
                longest = longest.max(begun.elapsed().saturating_sub(Self::LOOK));
            }
            longest
        });
        Self { stop, longest }
    }

    /// The longest so far. **Units:** ms.
    pub fn longest_ms(self) -> f64 {
        self.stop.store(true, Ordering::Relaxed);
        // The thread does nothing that can panic.
        self.longest.join().unwrap_or_default().as_secs_f64() * 1e3
    }
}

/// A number that the radio told.
pub fn number(value: &Value, name: &str) -> f64 {
    value.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// How a connection is.
pub fn facts_in_words(facts: &Value) -> String {
    let phy = facts.get("phy").and_then(Value::as_str).unwrap_or("?");
    format!(
        "interval {} ms, latency {}, MTU {}, {} bytes to a packet, {phy}",
        number(facts, "interval_ms"),
        number(facts, "latency"),
        number(facts, "mtu"),
        number(facts, "octets")
    )
}

/// What the radio carried.
pub fn carried(figures: &Value) -> String {
    format!(
        "{:.1} kB/s from the shoe; a packet waited {:.1} ms (median), {:.1} ms (99 %), {:.1} ms (longest) for its turn ({})",
        number(figures, "from_shoe") / number(figures, "seconds") * 1e-3,
        number(figures, "wait_median_ms"),
        number(figures, "wait_99_ms"),
        number(figures, "wait_longest_ms"),
        facts_in_words(figures)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_of_sorted_values() {
        let spread = Spread::of((0..200).rev().map(f64::from));
        assert_eq!((spread.median, spread.almost_all, spread.longest), (100.0, 198.0, 199.0));
        assert!(Spread::of(std::iter::empty()).median.is_nan());
    }
}
