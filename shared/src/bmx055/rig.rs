//! Driver and twin wired together, and what the driver does then.

use super::blocking::{Blocking, block_on};
use super::driver::Bmx055;
use super::twin::{Chip, SimulatedBmx055, SimulatedDelay, SimulatedDevice};
use super::{Batch, Config, Die, State};
use crate::time::Micros;
use core::cell::RefCell;
use std::vec::Vec;

pub type Bus<'a, S> = Blocking<SimulatedDevice<'a, S>>;

pub struct Rig<'a, S> {
    pub twin: &'a RefCell<SimulatedBmx055<S>>,
    pub driver: Bmx055<Bus<'a, S>, Bus<'a, S>, Bus<'a, S>, Blocking<SimulatedDelay<'a, S>>>,
    pub now: Micros,
    pub batches: Vec<Batch>,
    /// Largest lateness of an interrupt. **Units:** microseconds.
    pub late_us: u32,
    random: u32,
}

impl<'a, S: FnMut(Die, u64) -> [i16; 3]> Rig<'a, S> {
    pub fn new(twin: &'a RefCell<SimulatedBmx055<S>>, config: &Config) -> Self {
        let device = |chip| Blocking(SimulatedDevice::new(twin, chip));
        let dies = [Chip::Die(Die::Accel), Chip::Die(Die::Gyro), Chip::Mag];
        let [accel, gyro, mag] = dies.map(device);
        let driver = Bmx055::new(accel, gyro, mag, Blocking(SimulatedDelay(twin)), config);
        // A while after power on, so that the first reset is heard.
        let now = Micros(50_000);
        twin.borrow_mut().advance_to(now);
        Self { twin, driver, now, batches: Vec::new(), late_us: 0, random: 1 }
    }

    fn lateness(&mut self) -> i64 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.random) * u64::from(self.late_us + 1)) >> 32) as i64
    }

    /// Lets time pass as a microcontroller would: interrupts are served when they come, the driver polled when it asks.
    pub fn run(&mut self, duration_us: i64) {
        self.now = self.now.max(self.twin.borrow().now());
        let end = self.now + duration_us;
        while self.now < end {
            let interrupts = [Die::Accel, Die::Gyro].map(|die| self.twin.borrow().next_interrupt(die));
            let next = interrupts.into_iter().flatten().fold(self.driver.due(), Micros::min);
            self.now = next.clamp(self.now + 1, end).max(self.twin.borrow().now());
            self.twin.borrow_mut().advance_to(self.now);
            for die in [Die::Accel, Die::Gyro] {
                let edge = self.twin.borrow_mut().take_interrupt(die);
                if let Some(edge) = edge {
                    let stamp = edge + self.lateness();
                    self.twin.borrow_mut().advance_to(stamp);
                    let batches = &mut self.batches;
                    block_on(self.driver.on_watermark(die, stamp, |batch| batches.push(batch.clone())));
                }
            }
            if self.now >= self.driver.due() {
                let batches = &mut self.batches;
                block_on(self.driver.poll(self.now, |batch| batches.push(batch.clone())));
            }
        }
    }

    pub fn frames(&self, die: Die) -> Vec<[i16; 3]> {
        self.batches.iter().filter(|batch| batch.die == die).flat_map(|batch| batch.frames.clone()).collect()
    }

    pub fn states(&self) -> [State; 2] {
        [Die::Accel, Die::Gyro].map(|die| self.driver.state(die))
    }
}

/// Counts that number the readings of each die from one on.
pub fn numbered() -> impl FnMut(Die, u64) -> [i16; 3] {
    let mut taken = [0_i64; 2];
    move |die, _| {
        let place = &mut taken[usize::from(die == Die::Gyro)];
        *place += 1;
        counts(*place)
    }
}

/// Counts that tell when a reading was taken. **Units:** microseconds.
pub fn timed(_: Die, time_ns: u64) -> [i16; 3] {
    counts((time_ns / 1_000) as i64)
}

/// A number as counts that fit into the accelerometer.
fn counts(number: i64) -> [i16; 3] {
    [(number % 2_000) as i16, (number / 2_000 % 2_000) as i16, (number / 4_000_000) as i16]
}

/// The number in counts.
pub fn number([x, y, z]: &[i16; 3]) -> i64 {
    i64::from(*x) + 2_000 * i64::from(*y) + 4_000_000 * i64::from(*z)
}

mod tests {
    use super::*;
    use crate::bmx055::config::{AccelBandwidth, AccelConfig, AccelRange, GyroBandwidth, GyroConfig, GyroRange};
    use crate::bmx055::driver::MagCounts;
    use crate::bmx055::registers::both;
    use crate::bmx055::{DieCounters, Error, Merger};
    use crate::sample::ImuSample;
    use crate::selftest::Walk;
    use crate::step::Step;
    use crate::tracker::Tracker;

    /// Everything of a die was read, in its order, and the numbers of the batches are those of the readings.
    fn assert_seamless(rig: &Rig<impl FnMut(Die, u64) -> [i16; 3]>, die: Die) {
        let frames = rig.frames(die);
        let first = number(&frames[0]);
        for (index, frame) in frames.iter().enumerate() {
            assert_eq!(number(frame), first + index as i64, "{die:?}");
        }
        let mut sequence = 0;
        for batch in rig.batches.iter().filter(|batch| batch.die == die) {
            assert_eq!((batch.sequence, batch.lost), (sequence, false));
            sequence += batch.frames.len() as u32;
        }
    }

    #[test]
    fn starts_cold_and_loses_nothing() {
        let twin = RefCell::new(SimulatedBmx055::new(498_000, 502_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.late_us = 100;
        twin.borrow_mut().set_temperature(10);
        rig.run(2_000_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        for (die, period_us) in [(Die::Accel, 498), (Die::Gyro, 502)] {
            assert_seamless(&rig, die);
            let counters = *rig.driver.counters(die);
            assert_eq!(counters, DieCounters { frames: counters.frames, ..Default::default() });
            assert_eq!(twin.borrow().observed(die).ignored_writes, 0);
            assert_eq!(u64::from(counters.frames), twin.borrow().observed(die).read);
            // All but the start-up and what has not reached the watermark.
            assert!(i64::from(counters.frames) > (2_000_000 - 32_000) / period_us - 20);
        }
        assert!(rig.batches.iter().all(|batch| batch.frames.len() == 16));
        assert_eq!(rig.batches.last().unwrap().temperature, Some(10));
    }

    #[test]
    fn the_stamp_of_an_interrupt_belongs_to_the_last_frame_however_late_it_is_read() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, timed));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.late_us = 3_000;
        rig.run(300_000);
        for batch in &rig.batches {
            let taken = Micros(number(batch.frames.last().unwrap()));
            assert!((0..=3_001).contains(&(batch.stamp - taken)), "{batch:?}");
        }
    }

    #[test]
    fn every_range_and_bandwidth_can_be_set() {
        let accels = [
            (AccelRange::G2, AccelBandwidth::Hz8),
            (AccelRange::G4, AccelBandwidth::Hz63),
            (AccelRange::G8, AccelBandwidth::Hz250),
            (AccelRange::G16, AccelBandwidth::Hz1000),
        ];
        let gyros = [
            (GyroRange::Dps125, GyroBandwidth::Hz12),
            (GyroRange::Dps250, GyroBandwidth::Hz64),
            (GyroRange::Dps500, GyroBandwidth::Hz47),
            (GyroRange::Dps1000, GyroBandwidth::Hz116),
        ];
        for ((range, bandwidth), gyro) in accels.into_iter().zip(gyros) {
            let accel = AccelConfig { range, bandwidth, watermark: 4 };
            let gyro = GyroConfig { range: gyro.0, bandwidth: gyro.1, watermark: 4 };
            let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
            let mut rig = Rig::new(&twin, &Config { accel, gyro });
            rig.run(1_000_000);
            for (die, period_us) in [(Die::Accel, accel.period_us()), (Die::Gyro, gyro.period_us())] {
                assert_seamless(&rig, die);
                let frames = (1_000_000 - 32_000) / period_us;
                assert!((frames - 5..=frames + 64).contains(&(rig.frames(die).len() as u32)), "{accel:?} {gyro:?}");
            }
        }
    }

    #[test]
    fn another_chip_is_refused_until_the_right_one_is_there() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        twin.borrow_mut().faults(Die::Gyro).chip_id = Some(0x1E);
        rig.run(1_000_000);
        assert_eq!(rig.states(), [State::Run, State::Fault]);
        // 100 ms of pause and 31 ms of start-up each.
        assert!((7..=8).contains(&rig.driver.counters(Die::Gyro).bad_ids));
        assert!(rig.frames(Die::Gyro).is_empty());
        twin.borrow_mut().faults(Die::Gyro).chip_id = None;
        rig.run(300_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        assert_seamless(&rig, Die::Accel);
    }

    #[test]
    fn a_register_that_does_not_take_is_a_fault() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        twin.borrow_mut().faults(Die::Accel).register = Some((both::RANGE, 0x03));
        rig.run(80_000);
        assert_eq!(rig.states(), [State::Fault, State::Run]);
        assert_eq!(rig.driver.counters(Die::Accel).readback_errors, 1);
        twin.borrow_mut().faults(Die::Accel).register = None;
        rig.run(200_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        assert_eq!(rig.driver.counters(Die::Accel).restarts, 1);
    }

    #[test]
    fn a_fifo_that_never_empties_does_not_hold_the_driver_up() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.run(500_000);
        twin.borrow_mut().faults(Die::Accel).register = Some((both::FIFO_STATUS, 0x7F));
        rig.run(200_000);
        assert!(rig.driver.counters(Die::Accel).restarts > 0);
        twin.borrow_mut().faults(Die::Accel).register = None;
        rig.run(200_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        assert_eq!(rig.driver.counters(Die::Gyro).restarts, 0);
    }

    #[test]
    fn a_fifo_that_always_says_it_ran_over_is_set_up_anew() {
        for die in [Die::Accel, Die::Gyro] {
            let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
            let mut rig = Rig::new(&twin, &Config::default());
            rig.run(500_000);
            twin.borrow_mut().faults(die).register = Some((both::FIFO_STATUS, both::FIFO_OVERRUN | 20));
            rig.run(1_000_000);
            let counters = *rig.driver.counters(die);
            // Each after ten watermarks of 8 ms and 3 or 31 ms to start up.
            assert!((8..=12).contains(&counters.restarts), "{counters:?}");
            twin.borrow_mut().faults(die).register = None;
            rig.run(300_000);
            assert_eq!(rig.states(), [State::Run; 2]);
            assert!(rig.now - rig.batches.iter().rfind(|batch| batch.die == die).unwrap().stamp < 9_000);
            assert_seamless(&rig, if die == Die::Accel { Die::Gyro } else { Die::Accel });
        }
    }

    #[test]
    fn a_die_that_forgot_its_registers_is_set_up_anew() {
        for die in [Die::Accel, Die::Gyro] {
            let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
            let mut rig = Rig::new(&twin, &Config::default());
            rig.run(500_000);
            twin.borrow_mut().interrupt_supply(die);
            rig.run(500_000);
            let counters = rig.driver.counters(die);
            assert_eq!((rig.states(), counters.restarts), ([State::Run; 2], 1), "{counters:?}");
            assert_eq!(rig.batches.iter().filter(|batch| batch.lost).count(), 1);
            // Found within 100 ms, by then at least 31 ms to start up.
            assert!(rig.frames(die).len() > 2 * (1_000 - 32 - 150 - 32));
            assert_seamless(&rig, if die == Die::Accel { Die::Gyro } else { Die::Accel });
        }
    }

    #[test]
    fn no_frame_of_a_die_that_was_reset_is_handed_out() {
        for die in [Die::Accel, Die::Gyro] {
            let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, timed));
            let mut config = Config::default();
            // What is read after a reset is one frame, as long as the FIFO is off.
            (config.accel.watermark, config.gyro.watermark) = (1, 1);
            let mut rig = Rig::new(&twin, &config);
            twin.borrow_mut().set_temperature(10);
            for _ in 0..8 {
                rig.run(201_300);
                let reset = rig.now.max(twin.borrow().now());
                twin.borrow_mut().interrupt_supply(die);
                while rig.driver.state(die) == State::Run {
                    rig.run(500);
                }
                while rig.driver.state(die) != State::Run {
                    rig.run(500);
                }
                let between = |frame: &[i16; 3]| (reset.0..rig.now.0 - 500).contains(&number(frame));
                assert_eq!(rig.frames(die).into_iter().find(between), None, "{die:?}, reset at {reset:?}");
            }
            assert!(rig.batches.iter().all(|batch| batch.temperature.is_none_or(|read| read == 10)));
        }
    }

    #[test]
    fn a_bus_error_costs_a_batch_at_most_and_never_the_other_die() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.run(500_000);
        for _ in 0..5 {
            twin.borrow_mut().faults(Die::Accel).transfers = 3;
            rig.run(100_000);
        }
        let counters = *rig.driver.counters(Die::Accel);
        assert_eq!((counters.bus_errors, counters.restarts, counters.missed_interrupts), (15, 0, 0));
        assert_eq!(rig.states(), [State::Run; 2]);
        // The twin's frames survive a transfer that fails at its start: three retries 2 ms apart fit into the FIFO.
        let frames = rig.frames(Die::Accel);
        assert_eq!(number(frames.last().unwrap()) - number(&frames[0]), frames.len() as i64 - 1);
        assert_seamless(&rig, Die::Gyro);
    }

    #[test]
    fn ten_failures_in_a_row_and_the_die_is_set_up_anew() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.run(500_000);
        twin.borrow_mut().faults(Die::Gyro).transfers = 10;
        rig.run(200_000);
        let counters = *rig.driver.counters(Die::Gyro);
        assert_eq!((counters.bus_errors, counters.restarts), (10, 1));
        assert_eq!((rig.states(), twin.borrow().observed(Die::Gyro).resets), ([State::Run; 2], 2));
        assert_seamless(&rig, Die::Accel);
        // A dead bus is no end either.
        twin.borrow_mut().faults(Die::Gyro).transfers = 40;
        rig.run(5_000_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        assert_eq!(rig.driver.counters(Die::Gyro).bus_errors, 50);
    }

    #[test]
    fn a_die_that_stands_is_set_up_anew() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.run(500_000);
        twin.borrow_mut().faults(Die::Accel).stuck = true;
        rig.run(100_000);
        assert!(rig.driver.counters(Die::Accel).restarts >= 1);
        twin.borrow_mut().faults(Die::Accel).stuck = false;
        rig.run(100_000);
        assert_eq!(rig.states(), [State::Run; 2]);
        assert!(rig.now - rig.batches.last().unwrap().stamp < 9_000, "batches come every 8 ms");
    }

    #[test]
    fn frames_without_a_reading_are_taken_out_and_their_number_is_known() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        for offset_us in [0, 2_300, 5_100] {
            rig.run(100_000 + offset_us);
            twin.borrow_mut().faults(Die::Gyro).frames = 3;
        }
        rig.run(100_000);
        let first = number(&rig.frames(Die::Gyro)[0]);
        let first_stamp = rig.batches.iter().find(|batch| batch.die == Die::Gyro).unwrap().stamp;
        for batch in rig.batches.iter().filter(|batch| batch.die == Die::Gyro) {
            assert!(!batch.lost);
            for (index, frame) in batch.frames.iter().enumerate() {
                assert_eq!(number(frame), first + i64::from(batch.sequence) + index as i64);
            }
            // No interrupt is late here, so the first stamp tells the clock.
            let number = i64::from(batch.sequence) + batch.frames.len() as i64 - 1;
            let taken = first_stamp + (number - 15) * 500;
            // The stamp of a part of a batch is estimated on the late side, by 1 % of 16 frames at most.
            assert!((0..=80).contains(&(batch.stamp - taken)), "{batch:?}");
        }
        assert_eq!(rig.driver.counters(Die::Gyro).invalid_frames, 9);
    }

    #[test]
    fn an_interrupt_that_does_not_come_costs_nothing() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.late_us = 100;
        for die in [Die::Accel, Die::Gyro, Die::Accel] {
            rig.run(200_000);
            twin.borrow_mut().faults(die).interrupts = 1;
        }
        rig.run(200_000);
        assert_eq!(rig.driver.counters(Die::Accel).missed_interrupts, 2);
        assert_eq!(rig.driver.counters(Die::Gyro).missed_interrupts, 1);
        assert_seamless(&rig, Die::Accel);
        assert_seamless(&rig, Die::Gyro);
    }

    #[test]
    fn an_overrun_is_marked_and_over_at_once() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, timed));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.run(200_000);
        let before = number(rig.frames(Die::Accel).last().unwrap());
        // Nobody comes for 40 ms.
        rig.now = rig.now + 40_000;
        rig.run(200_000);
        let counters = *rig.driver.counters(Die::Accel);
        assert_eq!((counters.overruns, counters.restarts), (1, 0));
        assert_eq!(rig.driver.counters(Die::Gyro).overruns, 0);
        let lost: Vec<_> = rig.batches.iter().filter(|batch| batch.lost).collect();
        // The first after the FIFO was emptied.
        assert_eq!(lost.iter().map(|batch| batch.frames.len()).collect::<Vec<_>>(), [16]);
        assert!(number(&lost[0].frames[0]) > before + 40_000);
        let taken = Micros(number(lost[0].frames.last().unwrap()));
        assert!((0..=1).contains(&(lost[0].stamp - taken)), "{lost:?}");
    }

    #[test]
    fn a_fifo_that_runs_over_while_it_is_read_gives_no_torn_frame() {
        // Room for 32 frames lasts for 16 ms. Torn is what comes while the first frame is read, which takes 6 us.
        for late_us in (15_000..16_600).step_by(3) {
            let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, timed));
            let mut rig = Rig::new(&twin, &Config::default());
            rig.run(100_000);
            rig.now = rig.now + late_us;
            rig.run(100_000);
            let mut last = 0;
            for frame in rig.frames(Die::Accel) {
                let number = number(&frame);
                assert!(number > last && number < rig.now.0, "{frame:?} after {last}, {late_us} us late");
                last = number;
            }
            assert_eq!(rig.states(), [State::Run; 2]);
        }
    }

    #[test]
    fn self_tests_tell_good_from_bad() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, |_, _| [3, -4, 500]));
        let mut rig = Rig::new(&twin, &Config::default());
        rig.run(100_000);
        let test = block_on(rig.driver.self_test(rig.now));
        assert!(test.passed(), "{test:?}");
        // Twice 0.48 g, rounded to counts of 1.95e-3 g towards zero.
        assert!(test.accel.unwrap().deflection_milli_g.iter().all(|moved| (956..=960).contains(moved)));
        rig.run(100_000);
        assert_eq!(rig.states(), [State::Run; 2], "they run again");
        twin.borrow_mut().faults(Die::Gyro).self_test = true;
        let test = block_on(rig.driver.self_test(rig.now));
        assert!(test.accel.unwrap().passed() && !test.gyro.unwrap().intact && !test.passed());
        twin.borrow_mut().faults(Die::Gyro).self_test = false;
        twin.borrow_mut().faults(Die::Accel).self_test = true;
        let test = block_on(rig.driver.self_test(rig.now));
        assert!(!test.accel.unwrap().passed() && test.gyro.unwrap().intact && !test.passed());
        twin.borrow_mut().faults(Die::Accel).transfers = 1;
        let test = block_on(rig.driver.self_test(rig.now));
        assert!(test.accel.is_err() && test.gyro.is_ok() && !test.passed());
    }

    #[test]
    fn the_magnetometer_is_read_when_asked() {
        let twin = RefCell::new(SimulatedBmx055::new(500_000, 500_000, numbered()));
        let mut rig = Rig::new(&twin, &Config::default());
        twin.borrow_mut().set_field([-200, 311, -9_000, 6_500]);
        let reading = block_on(rig.driver.magnetometer());
        assert_eq!(reading, Ok(MagCounts { field: [-200, 311, -9_000], hall: 6_500 }));
        twin.borrow_mut().set_mag_faults(Some(0x31), 0);
        let expected = Error::Identification { expected: 0x32, read: 0x31 };
        assert_eq!(block_on(rig.driver.magnetometer()), Err(expected));
        twin.borrow_mut().set_mag_faults(None, 1);
        assert!(matches!(block_on(rig.driver.magnetometer()), Err(Error::Bus(_))));
    }

    /// The walk of the self-test as both dies see it; it begins when they are set up.
    fn walking() -> impl FnMut(Die, u64) -> [i16; 3] {
        let samples: Vec<_> = Walk::new(500).collect();
        let config = Config::default();
        move |die, time_ns| {
            let place = time_ns.saturating_sub(100_000_000) as f32 / 500_000.0;
            let index = (place as usize).min(samples.len() - 2);
            let part = (place - index as f32).min(1.0);
            let vector = |sample: &ImuSample| match die {
                Die::Accel => sample.accel.0 / config.accel.scale(),
                Die::Gyro => sample.gyro.0 / config.gyro.scale(),
            };
            let counts = vector(&samples[index]).lerp(&vector(&samples[index + 1]), part);
            counts.map(|count| libm::roundf(count) as i16).into()
        }
    }

    fn steps(samples: impl IntoIterator<Item = ImuSample>) -> Vec<Step> {
        let mut tracker = Tracker::new(&Default::default());
        let mut steps: Vec<_> = samples.into_iter().filter_map(|sample| tracker.push(&sample).step).collect();
        steps.extend(tracker.finish());
        steps
    }

    #[test]
    fn a_walk_through_registers_and_clocks_is_the_same_walk() {
        let direct = steps(Walk::new(500));
        for (accel_ns, gyro_ns) in [(500_000, 500_000), (498_000, 502_000), (502_500, 497_500)] {
            let twin = RefCell::new(SimulatedBmx055::new(accel_ns, gyro_ns, walking()));
            let mut rig = Rig::new(&twin, &Config::default());
            rig.late_us = 100;
            rig.run(Walk::new(500).count() as i64 * 500 + 100_000);
            let mut merger = Merger::new(&Config::default());
            let mut samples = Vec::new();
            for batch in &rig.batches {
                merger.push(batch, |sample| samples.push(*sample));
            }
            let through = steps(samples);
            assert_eq!(through.len(), direct.len());
            for (through, direct) in through.iter().zip(&direct) {
                // Rounding to counts is noise of 0.022 m/s^2, and interpolation takes off as much of the walk's own: each
                // makes 2e-4 m in a swing of 0.7 s, and the attitude 5e-5 rad. Five of both together.
                let error = (through.displacement - direct.displacement).norm();
                assert!(error < 1.5e-3, "step {}: {error} m", direct.index);
                assert!((through.turn - direct.turn).abs() < 5e-4, "step {}", direct.index);
            }
        }
    }
}
