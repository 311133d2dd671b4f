//! What the parts of the shoe cost, each measured where it is used: on the self-test's walk at 2 kHz.

use crate::meter::{Cost, mark};
use core::cell::{Cell, RefCell};
use cortex_m_semihosting::hprintln;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use nalgebra::Vector3;
use sohle_shared::bmx055::blocking::{Blocking, block_on};
use sohle_shared::bmx055::twin::{Chip, SimulatedBmx055, SimulatedDelay, SimulatedDevice};
use sohle_shared::bmx055::{Batch, Bmx055, Config, Die, Merger};
use sohle_shared::calibration::Calibration;
use sohle_shared::filter::pivot::PivotFilter;
use sohle_shared::preintegration::Preintegrator;
use sohle_shared::sample::{ImuSample, STANDARD_GRAVITY_M_S2};
use sohle_shared::selftest::Walk;
use sohle_shared::shoe::Shoe;
use sohle_shared::stance::adaptive::Adaptive;
use sohle_shared::time::Micros;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::frame::{AnyDecoder, FRAME_MAX, encode};
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::{Ack, FromShoe, LaptopHello, ToShoe, text};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::port::Port;
use sohle_shared::wire::{PROTOCOL, SCHEMA};

/// The native rate. **Units:** microseconds.
const PERIOD_US: u32 = 500;
/// The self-test's walk stands still before and after. **Units:** microseconds.
const WALKING_US: core::ops::Range<i64> = 3_000_000..29_000_000;

/// Prints what the parts cost.
pub fn measure() {
    filter();
    shoe();
}

fn tell(name: &str, cost: &Cost) {
    hprintln!("part {} {} {} {}", name, cost.count, cost.instructions(), cost.most());
}

/// Integration, detector, and every step of the filter.
fn filter() {
    let parameters = Parameters::default();
    let mut integrator = Preintegrator::new(&parameters.preintegration);
    let mut detector = Adaptive::new(&parameters.stance);
    let mut filter = PivotFilter::new(&parameters.filter);
    filter.start(&Vector3::new(0.1, 0.2, STANDARD_GRAVITY_M_S2), Some((Vector3::zeros(), 1e-3)));
    let [mut integrate, mut detect, mut predict, mut velocity, mut height, mut rest, mut rebase] = [Cost::default(); 7];
    for sample in Walk::new(PERIOD_US) {
        let increment = integrate.of(|| integrator.push(&sample, filter.gyro_bias(), filter.accel_bias()));
        let Some(increment) = increment else { continue };
        detect.of(|| {
            let count = f32::from(increment.samples);
            let (sum, squares) = (&increment.accel_sum, (increment.accel_square_sum, increment.gyro_square_sum));
            let statistic = detector.statistic(count, sum, squares.0, squares.1, STANDARD_GRAVITY_M_S2);
            detector.judge(increment.end, statistic, Some(filter.speed()))
        });
        predict.of(|| filter.predict(&increment));
        // The updates of a stance, in every increment: what they cost does not depend on what they say.
        velocity.of(|| filter.update_zero_velocity(0.1, false));
        height.of(|| filter.update_height(0.0, 0.1));
        rest.of(|| filter.update_rest(&Vector3::zeros(), 0.1, &Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2)));
        rebase.of(|| filter.rebase());
    }
    for (name, cost) in [
        ("integration", integrate),
        ("detector", detect),
        ("predict", predict),
        ("zero-velocity-update", velocity),
        ("height-update", height),
        ("rest-update", rest),
        ("rebase", rebase),
    ] {
        tell(name, &cost);
    }
}

/// A bus that takes the time which the twin behind it needs: that is no part of a shoe.
struct Metered<'a, T> {
    device: T,
    spent: &'a Cell<u32>,
}

impl<T: ErrorType> ErrorType for Metered<'_, T> {
    type Error = T::Error;
}

impl<T: SpiDevice> SpiDevice for Metered<'_, T> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), T::Error> {
        let before = mark();
        let result = self.device.transaction(operations);
        self.spent.set(self.spent.get() + before.ticks());
        result
    }
}

/// The walk as counts, asked for in the order of time by both dies.
struct Source {
    config: Config,
    walk: [(Walk, Option<ImuSample>, u64); 2],
}

impl Source {
    fn new() -> Self {
        let walk = || (Walk::new(PERIOD_US), None, 0);
        Self { config: Config::default(), walk: [walk(), walk()] }
    }

    fn counts(&mut self, die: Die, time_ns: u64) -> [i16; 3] {
        let [accel, gyro] = &mut self.walk;
        let (walk, last, taken) = if die == Die::Accel { accel } else { gyro };
        while *taken <= time_ns / (u64::from(PERIOD_US) * 1_000) {
            *last = walk.next().or(*last);
            *taken += 1;
        }
        let Some(sample) = last else { return [0; 3] };
        let (value, scale) = match die {
            Die::Accel => (sample.accel.0, self.config.accel.scale()),
            Die::Gyro => (sample.gyro.0, self.config.gyro.scale()),
        };
        value.map(|value| (value / scale) as i16).into()
    }
}

/// Driver, merger and the whole application, from the interrupt to the bytes on the line.
fn shoe() {
    let mut source = Source::new();
    let twin = RefCell::new(SimulatedBmx055::new(500_100, 499_900, move |die, time| source.counts(die, time)));
    let spent = Cell::new(0);
    let device = |chip| Blocking(Metered { device: SimulatedDevice::new(&twin, chip), spent: &spent });
    let (accel, gyro) = (device(Chip::Die(Die::Accel)), device(Chip::Die(Die::Gyro)));
    let config = Config::default();
    let delay = Blocking(SimulatedDelay(&twin));
    let mut driver = Bmx055::new(accel, gyro, device(Chip::Mag), delay, &config);
    let mut merger = Merger::new(&config);
    let mut shoe = connected(&config);
    let [mut read, mut merge, mut process, mut transmit] = [Cost::default(); 4];
    let (mut frames, mut merged) = (0, 0);
    let mut now = Micros(0);
    while now.0 < WALKING_US.end {
        let interrupts = [Die::Accel, Die::Gyro].map(|die| twin.borrow().next_interrupt(die));
        now = interrupts.into_iter().flatten().fold(driver.due(), Micros::min).max(now + 1);
        twin.borrow_mut().advance_to(now);
        let walking = WALKING_US.contains(&now.0);
        let mut batches: heapless::Vec<Batch, 8> = heapless::Vec::new();
        let mut sink = |batch: &Batch| _ = batches.push(batch.clone());
        spent.set(0);
        let before = mark();
        for die in [Die::Accel, Die::Gyro] {
            let edge = twin.borrow_mut().take_interrupt(die);
            if let Some(stamp) = edge {
                block_on(driver.on_watermark(die, stamp, &mut sink));
            }
        }
        if now >= driver.due() {
            block_on(driver.poll(now, &mut sink));
        }
        let ticks = before.ticks().saturating_sub(spent.get());
        for batch in &batches {
            let mut samples = 0;
            let ticks = {
                let before = mark();
                merger.push(batch, |_| samples += 1);
                before.ticks()
            };
            let before = mark();
            shoe.sensed(batch);
            let sensed = before.ticks();
            if walking {
                merge.add(ticks);
                process.add(sensed);
                merged += samples;
                frames += batch.frames.len() as u64;
            }
        }
        let sent = speak(&mut shoe, now);
        if walking {
            read.add(ticks);
            transmit.add(sent);
        }
    }
    let seconds = (WALKING_US.end - WALKING_US.start) / 1_000_000;
    for (name, count, cost) in [("driver", frames, read), ("merger", merged, merge)] {
        hprintln!("part {} {} {} {}", name, count, cost.instructions(), cost.most());
    }
    for (name, cost) in [("second-driver", read), ("second-steps", process), ("second-wire", transmit)] {
        hprintln!("part {} {} {} {}", name, seconds, cost.instructions(), cost.most());
    }
}

const BOOT: u32 = 1;

/// A shoe that a laptop listens to.
fn connected(config: &Config) -> Shoe<64> {
    let identity = Identity { boot: BOOT, firmware: "0", board: "emulator" };
    let mut shoe =
        Shoe::new(identity, config, &Parameters::default(), &Calibration::default(), Outbox::new(BOOT, Pace::SERIAL));
    let hello = LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session: 1, software: text("0") };
    hear(&mut shoe, &ToShoe::Hello(hello), Micros(0));
    shoe
}

fn hear(shoe: &mut Shoe<64>, message: &ToShoe, now: Micros) {
    let mut buffer = [0; FRAME_MAX];
    if let Ok(frame) = encode(message, &mut buffer) {
        shoe.received(Port::Serial, frame, now);
    }
}

/// Sends what waits, and hears that each step has come. Ticks.
fn speak(shoe: &mut Shoe<64>, now: Micros) -> u32 {
    let mut buffer = [0; FRAME_MAX];
    let mut ticks = 0;
    loop {
        let before = mark();
        let frame = shoe.transmit(Port::Serial, now, &mut buffer);
        ticks += before.ticks();
        let Some(mut frame) = frame else { return ticks };
        if let Some(Ok(FromShoe::Step(sent))) = AnyDecoder::new().next(&mut frame) {
            let before = mark();
            hear(shoe, &ToShoe::Ack(Ack { boot: BOOT, next: sent.id + 1, later: 0 }), now);
            ticks += before.ticks();
        }
    }
}
