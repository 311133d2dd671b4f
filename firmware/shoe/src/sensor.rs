//! Reading the sensor, above everything else: the program may be late, samples are not lost.
//!
//! Runs on the executor of [`board::urgent`](crate::board::urgent). Each interrupt line has a task that only stamps its
//! edges, so that the stamp is right while the other die is being read. The batches wait in a queue for a program that is
//! late.

use crate::board::Sensor;
use core::cell::Cell;
use embassy_embedded_hal::shared_bus::asynch::spi::SpiDevice;
use embassy_executor::SendSpawner;
use embassy_futures::select::{Either3, select3};
use embassy_stm32::exti::ExtiInput;
use embassy_stm32::mode::Async;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, NoopRawMutex};
use embassy_sync::channel::Channel;
use embassy_sync::mutex::Mutex;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Instant, Timer};
use portable_atomic::{AtomicBool, AtomicU32, Ordering};
use sohle_shared::bmx055::{Batch, Bmx055, Config, Die, DieCounters};
use sohle_shared::time::Micros;

/// Batches that may wait: two dies with a batch every 8 ms each make 25 in 100 ms.
const WAITING: usize = 28;

/// The batches, in the order they were read.
pub static BATCHES: Channel<CriticalSectionRawMutex, Batch, WAITING> = Channel::new();

/// Batches that found the queue full.
static LOST: AtomicU32 = AtomicU32::new(0);

/// The sensor's task has run since this was last taken.
static ALIVE: AtomicBool = AtomicBool::new(false);

static COUNTERS: CriticalSectionMutex<Cell<[DieCounters; 2]>> = CriticalSectionMutex::new(Cell::new([NONE; 2]));

const NONE: DieCounters = DieCounters {
    frames: 0,
    overruns: 0,
    invalid_frames: 0,
    missed_interrupts: 0,
    bus_errors: 0,
    bad_ids: 0,
    readback_errors: 0,
    restarts: 0,
};

/// When the interrupt of a die came last.
type Edge = Signal<CriticalSectionRawMutex, Instant>;
static ACCEL_EDGE: Edge = Signal::new();
static GYRO_EDGE: Edge = Signal::new();

/// This moment on the clock of all stamps.
pub fn now() -> Micros {
    micros(Instant::now())
}

fn micros(instant: Instant) -> Micros {
    // 2^63 microseconds are 292 000 years.
    Micros(instant.as_micros() as i64)
}

/// What happened to accelerometer and gyroscope since the boot.
pub fn counters() -> [DieCounters; 2] {
    COUNTERS.lock(Cell::get)
}

/// Batches lost since the boot, because nobody took them for 100 ms.
pub fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}

/// Whether the sensor's task has run since this was asked last. It does so ten times in a second, sensor or none.
pub fn alive() -> bool {
    ALIVE.swap(false, Ordering::Relaxed)
}

/// Starts to read the sensor. Panics when it is called twice.
pub fn start(urgent: SendSpawner, sensor: Sensor) {
    let Sensor { bus, accel, gyro, mag, accel_ready, gyro_ready } = sensor;
    urgent.spawn(stamp(accel_ready, &ACCEL_EDGE).expect("one for each line"));
    urgent.spawn(stamp(gyro_ready, &GYRO_EDGE).expect("one for each line"));
    urgent.spawn(sense(bus, [accel, gyro, mag]).expect("one sensor"));
}

#[embassy_executor::task(pool_size = 2)]
async fn stamp(mut line: ExtiInput<'static, Async>, edge: &'static Edge) {
    loop {
        line.wait_for_rising_edge().await;
        edge.signal(Instant::now());
    }
}

#[embassy_executor::task]
async fn sense(bus: crate::board::Bus, select: [embassy_stm32::gpio::Output<'static>; 3]) {
    let bus = Mutex::<NoopRawMutex, _>::new(bus);
    let [accel, gyro, mag] = select.map(|select| SpiDevice::new(&bus, select));
    let mut driver = Bmx055::new(accel, gyro, mag, Delay, &Config::default());
    let keep = |batch: &Batch| {
        if BATCHES.try_send(batch.clone()).is_err() {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    };
    loop {
        let due = Instant::from_micros(driver.due().0.max(0) as u64);
        match select3(ACCEL_EDGE.wait(), GYRO_EDGE.wait(), Timer::at(due)).await {
            Either3::First(stamp) => driver.on_watermark(Die::Accel, micros(stamp), keep).await,
            Either3::Second(stamp) => driver.on_watermark(Die::Gyro, micros(stamp), keep).await,
            Either3::Third(()) => driver.poll(now(), keep).await,
        }
        ALIVE.store(true, Ordering::Relaxed);
        let counters = [Die::Accel, Die::Gyro].map(|die| *driver.counters(die));
        COUNTERS.lock(|kept| kept.set(counters));
    }
}
