//! The whole way from the sensor's FIFOs through interrupts and DMA to batches: counts them once a second, for both dies.
//!
//! `cargo xtask flash --board B --bin bringup_fifo`. What it prints when all is well is in `docs/bring-up.md`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, Ticker};
use sohle_shared::bmx055::{Batch, Config, Die, DieCounters};
use sohle_shoe::executor::{self, Load};
use sohle_shoe::{board, sensor, stack};
use sohle_tasks::{Traffic, now};

static TRAFFIC: Traffic = Traffic::new();

/// What came of one die since the line before.
#[derive(Default)]
struct Second {
    batches: u32,
    frames: u32,
    last: [i16; 3],
    temperature: Option<i8>,
    /// Longest time from the interrupt to the batch being here. **Units:** microseconds.
    late_us: i64,
}

impl Second {
    fn count(&mut self, batch: &Batch) {
        self.batches += 1;
        self.frames += batch.frames.len() as u32;
        self.last = batch.frames.last().copied().unwrap_or_default();
        self.temperature = batch.temperature;
        self.late_us = self.late_us.max(now() - batch.stamp);
    }

    fn print(&self, name: &str, milliseconds: u64, counters: &DieCounters) {
        let rate = |count: u32| u64::from(count) * 1_000 / milliseconds.max(1);
        defmt::info!(
            "{=str}: {=u64} frames/s in {=u64} batches/s, at most {=i64} us late; last {}",
            name,
            rate(self.frames),
            rate(self.batches),
            self.late_us,
            self.last
        );
        if let Some(half_kelvin) = self.temperature {
            defmt::info!("{=str}: {=i16} degrees Celsius", name, 23 + i16::from(half_kelvin) / 2);
        }
        let DieCounters { overruns, invalid_frames, missed_interrupts, bus_errors, .. } = *counters;
        let DieCounters { bad_ids, readback_errors, restarts, .. } = *counters;
        defmt::info!(
            "{=str}: since the boot {=u32} overruns, {=u32} invalid frames, {=u32} missed interrupts, {=u32} bus errors, \
             {=u32} wrong ids, {=u32} wrong registers, {=u32} restarts",
            name,
            overruns,
            invalid_frames,
            missed_interrupts,
            bus_errors,
            bad_ids,
            readback_errors,
            restarts
        );
    }
}

#[embassy_executor::task]
async fn count() {
    let (mut accel, mut gyro) = (Second::default(), Second::default());
    let mut second = Ticker::every(Duration::from_secs(1));
    let mut load = Load::start();
    let mut last = Instant::now();
    loop {
        match select(TRAFFIC.receive(), second.next()).await {
            Either::First(batch) => match batch.die {
                Die::Accel => accel.count(&batch),
                Die::Gyro => gyro.count(&batch),
            },
            Either::Second(()) => {
                let milliseconds = last.elapsed().as_millis();
                last = Instant::now();
                let counters = TRAFFIC.counters();
                core::mem::take(&mut accel).print("accelerometer", milliseconds, &counters[0]);
                core::mem::take(&mut gyro).print("gyroscope", milliseconds, &counters[1]);
                let (load, lost, stack) = (load.take(), TRAFFIC.lost(), stack::used());
                defmt::info!("load {=u16}/1000, {=u32} batches lost, {=u32} bytes of stack", load, lost, stack);
            }
        }
    }
}

#[entry]
fn main() -> ! {
    let board = board::start();
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("bringup_fifo on {=str}", board::NAME);
    sensor::start(board.sensor, Config::default(), &TRAFFIC);
    executor::run(core.SCB, |spawner: Spawner| spawner.spawn(count().expect("one task")))
}
