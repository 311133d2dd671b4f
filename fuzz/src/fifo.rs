//! The driver of the sensor and its twin, to which anything may happen: no frame is handed out that was not taken as the
//! driver has set the die up, none twice and none out of order, and in the end the driver always comes back to run.

use crate::script;
use crate::seeds::Seed;
use serde::{Deserialize, Serialize};
use sohle_shared::bmx055::blocking::{Blocking, block_on};
use sohle_shared::bmx055::config::AccelBandwidth;
use sohle_shared::bmx055::registers::{accel, both, gyro};
use sohle_shared::bmx055::twin::{Chip, SimulatedBmx055, SimulatedDelay, SimulatedDevice};
use sohle_shared::bmx055::{Batch, Bmx055, Config, Die, Merger, State};
use sohle_shared::time::Micros;
use std::cell::RefCell;
use std::rc::Rc;

mod wire;

use wire::{Truth, Wire};

/// Time that an input may take. **Units:** microseconds.
const MOST_US: i64 = 5_000_000;
/// When all faults are over, what was disturbed without a trace is found in this time: one of ten registers is checked each
/// 100 ms. **Units:** microseconds.
const FOUND_US: i64 = 1_200_000;
/// Then both dies run after this time: ten failures of a slow die, and a pause after a set-up that failed. **Units:**
/// microseconds.
const RECOVERY_US: i64 = 2_000_000;
/// **Units:** 0.5 K from 23 °C.
const TEMPERATURE: i8 = 10;

/// What happens.
#[derive(Clone, Copy, Serialize, Deserialize)]
enum Happening {
    /// Time passes. **Units:** 100 microseconds.
    Run(u16),
    /// Time passes, and nobody comes. **Units:** 100 microseconds.
    Absent(u8),
    /// Interrupts are served so late. **Units:** 10 microseconds.
    Latency(u8),
    Transfers(Die, u8),
    Interrupts(Die, u8),
    Frames(Die, u8),
    Stuck(Die, bool),
    ChipId(Die, Option<u8>),
    Register(Die, Option<(u8, u8)>),
    /// The supply drops after so many transfers.
    Reset(Die, u8),
    /// The supply drops after this time. **Units:** 100 microseconds.
    Drop(Die, u8),
    Sleep,
    Wake,
    SelfTest,
}

type Source = Box<dyn FnMut(Die, u64) -> [i16; 3]>;
type Bus<'a> = Blocking<Wire<'a, Source>>;

struct Rig<'a> {
    twin: &'a RefCell<SimulatedBmx055<Source>>,
    truth: Rc<RefCell<Truth>>,
    driver: Bmx055<Bus<'a>, Bus<'a>, Bus<'a>, Blocking<SimulatedDelay<'a, Source>>>,
    now: Micros,
    batches: Vec<Batch>,
    latency_us: i64,
}

impl<'a> Rig<'a> {
    fn new(twin: &'a RefCell<SimulatedBmx055<Source>>, truth: Rc<RefCell<Truth>>, config: &Config) -> Self {
        let wire = |chip| Blocking(Wire { device: SimulatedDevice::new(twin, chip), twin, truth: truth.clone(), chip });
        let [accel, gyro, mag] = [Chip::Die(Die::Accel), Chip::Die(Die::Gyro), Chip::Mag].map(wire);
        let driver = Bmx055::new(accel, gyro, mag, Blocking(SimulatedDelay(twin)), config);
        let now = Micros(50_000);
        twin.borrow_mut().advance_to(now);
        Self { twin, truth, driver, now, batches: Vec::new(), latency_us: 0 }
    }

    /// Lets time pass as a microcontroller would, until `end` or until `done`.
    fn run(&mut self, end: Micros, done: impl Fn(&Self) -> bool) {
        self.now = self.now.max(self.twin.borrow().now());
        while self.now < end && !done(self) {
            let interrupts = [Die::Accel, Die::Gyro].map(|die| self.twin.borrow().next_interrupt(die));
            let next = interrupts.into_iter().flatten().fold(self.driver.due(), Micros::min);
            self.now = next.clamp(self.now + 1, end.max(self.now + 1)).max(self.twin.borrow().now());
            self.twin.borrow_mut().advance_to(self.now);
            let batches = &mut self.batches;
            for die in [Die::Accel, Die::Gyro] {
                let edge = self.twin.borrow_mut().take_interrupt(die);
                if let Some(edge) = edge {
                    let stamp = edge + self.latency_us;
                    self.twin.borrow_mut().advance_to(stamp);
                    block_on(self.driver.on_watermark(die, stamp, |batch| batches.push(batch.clone())));
                }
            }
            if self.now >= self.driver.due() {
                self.now = self.now.max(self.twin.borrow().now());
                block_on(self.driver.poll(self.now, |batch| batches.push(batch.clone())));
            }
        }
    }

    fn happen(&mut self, happening: Happening) {
        let twin = self.twin;
        match happening {
            Happening::Run(time) => self.run(self.now + i64::from(time) * 100, |_| false),
            Happening::Absent(time) => self.now = self.now + i64::from(time) * 100,
            Happening::Latency(time) => self.latency_us = i64::from(time) * 10,
            Happening::Transfers(die, number) => twin.borrow_mut().faults(die).transfers = number.into(),
            Happening::Interrupts(die, number) => twin.borrow_mut().faults(die).interrupts = number.into(),
            Happening::Frames(die, number) => twin.borrow_mut().faults(die).frames = number.into(),
            Happening::Stuck(die, stuck) => twin.borrow_mut().faults(die).stuck = stuck,
            Happening::ChipId(die, id) => twin.borrow_mut().faults(die).chip_id = id,
            Happening::Register(die, fault) => twin.borrow_mut().faults(die).register = fault.and_then(tellable),
            Happening::Reset(die, after) => self.truth.borrow_mut().reset_after(die, after),
            Happening::Drop(die, after) => {
                let time = self.now.max(twin.borrow().now()) + i64::from(after) * 100;
                twin.borrow_mut().faults(die).supply = Some(time);
                self.truth.borrow_mut().drop_at(die, time);
            }
            Happening::Sleep => _ = block_on(self.driver.sleep(self.now)),
            Happening::Wake => self.driver.wake(self.now),
            Happening::SelfTest => _ = block_on(self.driver.self_test(self.now)),
        }
    }

    fn running(&self) -> bool {
        [Die::Accel, Die::Gyro].iter().all(|&die| self.driver.state(die) == State::Run)
    }

    /// All faults are over: both dies run again, and every reading is handed out.
    fn recover(&mut self) {
        self.truth.borrow_mut().calm();
        for die in [Die::Accel, Die::Gyro] {
            *self.twin.borrow_mut().faults(die) = Default::default();
        }
        self.latency_us = 0;
        self.driver.wake(self.now);
        self.run(self.now + FOUND_US, |_| false);
        self.run(self.now + RECOVERY_US, Self::running);
        assert!(self.running(), "{:?}", [Die::Accel, Die::Gyro].map(|die| self.driver.state(die)));
        let begin = self.batches.len();
        self.run(self.now + 400_000, |_| false);
        assert!(self.running());
        for die in [Die::Accel, Die::Gyro] {
            let numbers: Vec<i64> = numbers(self.batches.iter().skip(begin), die).collect();
            let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else { panic!("{die:?} is silent") };
            let truth = self.truth.borrow();
            let taken: Vec<i64> = truth.good(die).range(first..=last).copied().collect();
            assert_eq!(numbers, taken, "nothing is missing of {die:?}");
            assert!(self.now.0 - last < 150_000, "{die:?} goes on");
        }
    }

    fn judge(&self, config: &Config) {
        for die in [Die::Accel, Die::Gyro] {
            let mut last = i64::MIN;
            for batch in self.batches.iter().filter(|batch| batch.die == die) {
                assert!(!batch.frames.is_empty());
                for number in batch.frames.iter().map(number) {
                    assert!(self.truth.borrow().good(die).contains(&number), "{number} was not taken: {batch:?}");
                    assert!(number > last, "{number} after {last}: {batch:?}");
                    last = number;
                }
                // As late as its interrupt, so that stamps may fall; the times of samples, below, may not.
                assert!(batch.stamp.0 >= last, "stamped {} before it was taken: {batch:?}", last - batch.stamp.0);
                assert!(batch.temperature.is_none_or(|read| read == TEMPERATURE), "{batch:?}");
            }
        }
        let mut merger = Merger::new(config);
        let mut last = Micros(i64::MIN);
        for batch in &self.batches {
            merger.push(batch, |sample| {
                assert!(sample.is_finite() && sample.time > last, "samples rise: {last:?}, {sample:?}");
                last = sample.time;
            });
        }
    }
}

/// A register that reads as another value than it has, unless nobody could ever tell: what the FIFO holds, or that the
/// interrupt, which a reset switches off, is on.
fn tellable((register, value): (u8, u8)) -> Option<(u8, u8)> {
    match register & 0x7F {
        both::FIFO_DATA | accel::INT_EN_1 | gyro::INT_EN_0 | accel::TEMPERATURE => None,
        both::FIFO_STATUS => Some((both::FIFO_STATUS, value | both::FIFO_OVERRUN)),
        register => Some((register, value)),
    }
}

/// The time of a reading as counts. **Units:** microseconds.
fn counts(time_us: i64) -> [i16; 3] {
    [(time_us % 2_000) as i16, (time_us / 2_000 % 2_000) as i16, (time_us / 4_000_000) as i16]
}

fn number([x, y, z]: &[i16; 3]) -> i64 {
    i64::from(*x) + 2_000 * i64::from(*y) + 4_000_000 * i64::from(*z)
}

fn numbers<'a>(batches: impl Iterator<Item = &'a Batch>, die: Die) -> impl Iterator<Item = i64> {
    batches.filter(move |batch| batch.die == die).flat_map(|batch| batch.frames.iter().map(number))
}

/// The setting of the sensor: both watermarks, and both clocks by up to 2 % beside the data sheet; the rest is a script.
pub fn run(data: &[u8]) {
    let Some((&[accel, gyro, accel_clock, gyro_clock, slow], script)) = data.split_first_chunk::<5>() else { return };
    let mut config = Config::default();
    (config.accel.watermark, config.gyro.watermark) = (accel, gyro);
    if slow & 1 != 0 {
        config.accel.bandwidth = AccelBandwidth::Hz250;
    }
    let truth = Rc::new(RefCell::new(Truth::default()));
    let witness = truth.clone();
    let period_ns = |clock: u8| (500_000 + (i32::from(clock) - 128) * 39) as u32;
    let source: Source = Box::new(move |die, time_ns| {
        let time_us = (time_ns / 1_000) as i64;
        witness.borrow_mut().taken(die, time_us);
        counts(time_us)
    });
    let twin = RefCell::new(SimulatedBmx055::new(period_ns(accel_clock), period_ns(gyro_clock), source));
    twin.borrow_mut().set_temperature(TEMPERATURE);
    let mut rig = Rig::new(&twin, truth, &config);
    for happening in script::read(script).take(200) {
        rig.happen(happening);
        if rig.now.0 > MOST_US {
            break;
        }
    }
    rig.recover();
    rig.judge(&config);
}

/// A quiet run, each fault, overruns, and sleeps.
pub fn seeds() -> Vec<Seed> {
    use Happening::{
        Absent, ChipId, Drop, Frames, Interrupts, Latency, Register, Reset, Run, SelfTest, Sleep, Stuck, Transfers,
        Wake,
    };
    let seed = |script: &[Happening]| [vec![16, 16, 120, 140, 0], script::written(script)].concat();
    let (accel, gyro) = (Die::Accel, Die::Gyro);
    vec![
        ("quiet", seed(&[Run(2_000), Latency(30), Run(1_000)])),
        ("late", seed(&[Run(1_000), Absent(160), Run(500), Absent(200), Run(500), Latency(255), Run(500)])),
        ("bus", seed(&[Run(1_000), Transfers(accel, 3), Run(300), Transfers(gyro, 12), Run(1_000)])),
        (
            "lost",
            seed(&[Run(1_000), Interrupts(accel, 1), Run(300), Frames(gyro, 3), Run(300), Stuck(gyro, true), Run(900)]),
        ),
        ("reset", seed(&[Run(1_000), Reset(accel, 0), Run(900), Reset(gyro, 1), Run(900), Reset(accel, 2), Run(900)])),
        (
            "chip",
            seed(&[ChipId(gyro, Some(3)), Run(900), ChipId(gyro, None), Register(accel, Some((0x0F, 3))), Run(900)]),
        ),
        ("full", seed(&[Run(700), Register(accel, Some((0x0E, 0xA0))), Run(3_000), Register(accel, None), Run(900)])),
        ("asleep", seed(&[Run(1_000), Sleep, Run(300), Wake, Run(800), Sleep, Reset(gyro, 0), Run(12_000)])),
        ("disturbed", seed(&[Run(1_000), Drop(accel, 90), Sleep, Run(9_000), SelfTest, Run(900)])),
    ]
}
