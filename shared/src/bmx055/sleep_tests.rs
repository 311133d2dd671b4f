//! The sleep of driver and twin: what wakes it, and what the dies see of it.

use super::blocking::block_on;
use super::rig::{Rig, number, timed};
use super::twin::SimulatedBmx055;
use super::{Config, Die, DieCounters, State};
use crate::time::Micros;
use core::cell::RefCell;

/// When the sleep begins. **Units:** microseconds.
const BEDTIME_US: i64 = 1_000_000;

/// At rest with noise of a count, and something on one axis. **Units:** counts.
fn resting(die: Die, time_ns: u64, x: f32) -> [i16; 3] {
    let noise = (time_ns / 500_000 % 3) as i16 - 1;
    match die {
        Die::Accel => [x as i16 + noise, -noise, 128 + noise],
        Die::Gyro => [noise, 2, -noise],
    }
}

/// Puts the dies to sleep; what happens to them is seen on the axis x of the accelerometer.
fn asleep<S: FnMut(Die, u64) -> [i16; 3]>(twin: &RefCell<SimulatedBmx055<S>>) -> Rig<'_, S> {
    let mut rig = Rig::new(twin, &Config::default());
    rig.run(BEDTIME_US - rig.now.0);
    assert!(block_on(rig.driver.sleep(rig.now)));
    rig
}

/// When they wake, within `limit_us`. **Units:** microseconds since the power came.
fn wakes<S: FnMut(Die, u64) -> [i16; 3]>(rig: &mut Rig<'_, S>, limit_us: i64) -> Option<i64> {
    let end = rig.now + limit_us;
    while rig.driver.asleep() && rig.now < end {
        rig.run(1_000);
    }
    (!rig.driver.asleep()).then_some(rig.now.0)
}

#[test]
fn two_minutes_of_rest_cost_almost_nothing() {
    let twin = RefCell::new(SimulatedBmx055::new(499_000, 501_000, |die, time_ns| resting(die, time_ns, 0.0)));
    let mut rig = asleep(&twin);
    let before = [Die::Accel, Die::Gyro].map(|die| twin.borrow().observed(die));
    let batches = rig.batches.len();
    assert_eq!(wakes(&mut rig, 120_000_000), None);
    assert_eq!((rig.states(), rig.batches.len()), ([State::Asleep; 2], batches));
    let after = [Die::Accel, Die::Gyro].map(|die| twin.borrow().observed(die));
    // One each 18 ms instead of 0.5 ms, and none.
    assert!((6_650..6_700).contains(&(after[0].taken - before[0].taken)));
    assert_eq!(after[1].taken, before[1].taken);
    // A look a second: two registers and a reading of six bytes, each with its address.
    assert_eq!(
        after.map(|seen| seen.bytes).iter().sum::<u64>() - before.map(|seen| seen.bytes).iter().sum::<u64>(),
        120 * 11
    );
    assert_eq!(after.map(|seen| seen.ignored_writes), [0, 0]);
}

#[test]
fn motion_wakes_it_and_the_clocks_go_on_without_a_frame_that_was_not_taken() {
    // 60 mg within 20 ms, 5 s after falling asleep.
    let at_us = 6_000_000;
    let twin = RefCell::new(SimulatedBmx055::new(499_000, 501_000, move |die, time_ns| {
        let x = ((time_ns as i64 / 1_000 - at_us) as f32 / 20_000.0).clamp(0.0, 1.0) * 8.0;
        resting(die, time_ns, x)
    }));
    let mut rig = asleep(&twin);
    let asleep_at = rig.now;
    let woken = wakes(&mut rig, 10_000_000).unwrap();
    // Two readings of 18 ms may be needed to see the slope whole.
    assert!((at_us..at_us + 40_000).contains(&woken), "{woken}");
    rig.run(200_000);
    assert_eq!(rig.states(), [State::Run; 2]);
    for die in [Die::Accel, Die::Gyro] {
        let counters = *rig.driver.counters(die);
        assert_eq!(counters, DieCounters { frames: counters.frames, ..Default::default() }, "a sleep is no fault");
        let late = rig.batches.iter().filter(|batch| batch.die == die && batch.stamp > asleep_at);
        let first = late.clone().next().unwrap();
        assert!(first.lost && late.skip(1).all(|batch| !batch.lost));
        // The gyroscope starts for 30 ms; then a watermark of 8 ms.
        let most_us = if die == Die::Gyro { 42_000 } else { 14_000 };
        assert!((0..most_us).contains(&(first.stamp.0 - woken)), "{die:?} {}", first.stamp.0 - woken);
    }
}

#[test]
fn samples_after_a_sleep_have_their_true_times() {
    let twin = RefCell::new(SimulatedBmx055::new(497_500, 502_500, timed));
    let mut rig = Rig::new(&twin, &Config::default());
    rig.late_us = 100;
    rig.run(3_000_000);
    // The counts tell the time, and so never rest: it wakes at once, but sleeps for a moment.
    assert!(block_on(rig.driver.sleep(rig.now)));
    let bedtime = rig.now;
    rig.now = twin.borrow().now();
    rig.run(1_000_000);
    let mut merger = super::Merger::new(&Config::default());
    let mut samples = std::vec::Vec::new();
    for batch in &rig.batches {
        merger.push(batch, |sample| samples.push(*sample));
    }
    let per_count = Config::default().gyro.scale();
    let gaps: std::vec::Vec<_> =
        samples.windows(2).map(|pair| pair[1].time - pair[0].time).filter(|&gap| gap > 600).collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    for sample in samples.iter().filter(|sample| sample.time > bedtime) {
        let counts: [f32; 3] = (sample.gyro.0 / per_count).into();
        let error = sample.time.0 - number(&counts.map(|count| libm::roundf(count) as i16));
        // The first stamp after the gap is as late as the interrupt, and the line goes down to the lowest.
        assert!((-30..=130).contains(&error), "{error}");
    }
}

#[test]
fn a_slow_shift_wakes_it_and_a_slower_one_stays_unseen_until_it_is_as_large() {
    // 8 counts (3.6 degrees) in 100 s: no slope shows it.
    let begin_us = 10_000_000;
    let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, move |die, time_ns| {
        let x = ((time_ns as i64 / 1_000 - begin_us) as f32 / 100_000_000.0).clamp(0.0, 1.0) * 8.9;
        resting(die, time_ns, x)
    }));
    let mut rig = asleep(&twin);
    let woken = wakes(&mut rig, 120_000_000).unwrap() - begin_us;
    // 7 counts or more are shown after 79 s, less a count of noise, at the next look.
    assert!((66_000_000..82_000_000).contains(&woken), "{woken}");
}

#[test]
fn a_tap_wakes_it_and_it_goes_back_to_sleep() {
    let tap_us = 20_000_000;
    let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, move |die, time_ns| {
        let hit = (tap_us..tap_us + 20_000).contains(&(time_ns as i64 / 1_000));
        resting(die, time_ns, if hit { 40.0 } else { 0.0 })
    }));
    let mut rig = asleep(&twin);
    assert!(wakes(&mut rig, 60_000_000).is_some_and(|woken| woken < tap_us + 40_000));
    assert!(!block_on(rig.driver.sleep(rig.now)), "not before it runs");
    rig.run(1_000_000);
    assert_eq!(rig.states(), [State::Run; 2]);
    assert!(block_on(rig.driver.sleep(rig.now)));
    assert_eq!(wakes(&mut rig, 60_000_000), None);
    assert_eq!(twin.borrow().observed(Die::Accel).ignored_writes, 0);
}

#[test]
fn what_goes_wrong_asleep_wakes_it() {
    for die in [Die::Accel, Die::Gyro] {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, |die, time_ns| resting(die, time_ns, 0.0)));
        let mut rig = asleep(&twin);
        // It has forgotten that it sleeps.
        twin.borrow_mut().interrupt_supply(die);
        assert!(wakes(&mut rig, 1_200_000).is_some());
        rig.run(200_000);
        assert_eq!((rig.states(), rig.driver.counters(die).readback_errors), ([State::Run; 2], 1));
        // A bus that fails while it falls asleep, and while it is looked at.
        twin.borrow_mut().faults(die).transfers = 1;
        assert!(!block_on(rig.driver.sleep(rig.now)));
        rig.run(200_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        assert!(block_on(rig.driver.sleep(rig.now)));
        twin.borrow_mut().faults(die).transfers = 1;
        assert!(wakes(&mut rig, 1_200_000).is_some());
        rig.run(200_000);
        assert_eq!((rig.states(), rig.driver.counters(die).bus_errors), ([State::Run; 2], 2));
    }
}

#[test]
fn a_die_that_was_reset_while_it_fell_asleep_does_not_sleep() {
    for die in [Die::Accel, Die::Gyro] {
        // Of the 53 ms that it takes, the supply drops in each.
        for after_us in (0..56_000).step_by(1_000) {
            let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, |die, time_ns| resting(die, time_ns, 0.0)));
            let mut rig = Rig::new(&twin, &Config::default());
            rig.run(BEDTIME_US - rig.now.0);
            twin.borrow_mut().faults(die).supply = Some(rig.now + after_us);
            if block_on(rig.driver.sleep(rig.now)) {
                // Too late to be seen at once, it is seen at the next look.
                assert!(after_us > 50_000 || die == Die::Gyro, "{die:?} after {after_us} us");
                assert!(wakes(&mut rig, 1_200_000).is_some());
            }
            rig.run(300_000);
            assert_eq!(rig.states(), [State::Run; 2], "{die:?} after {after_us} us");
        }
    }
}

#[test]
fn who_wants_it_wakes_it_and_waking_the_awake_does_nothing() {
    let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, |die, time_ns| resting(die, time_ns, 0.0)));
    let mut rig = asleep(&twin);
    rig.run(3_000_000);
    let now = rig.now;
    rig.driver.wake(now);
    rig.run(100_000);
    assert_eq!(rig.states(), [State::Run; 2]);
    rig.driver.wake(Micros(0));
    assert_eq!(rig.states(), [State::Run; 2]);
}
