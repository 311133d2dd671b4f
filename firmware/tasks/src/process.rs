//! Makes steps of what was read, and talks to the laptop.

use crate::queue::Sensed;
use crate::traffic::Traffic;
use crate::{instant, now};
use core::borrow::BorrowMut;
use embassy_futures::select::{Either4, select4};
use embassy_time::{Duration, Ticker, Timer};
use embedded_io_async::Read;
use sohle_shared::shoe::{Health, Shoe};
use sohle_shared::time::Micros;
use sohle_shared::wire::frame::FRAME_MAX;
use sohle_shared::wire::message::{Level, Refusal, ResetReason};
use sohle_shared::wire::outbox::Outbox;
use sohle_shared::wire::transfer::Value;

/// While the line is full, it is asked again so often. **Units:** microseconds.
const LINE_FULL_US: i64 = 2_000;

/// While the sensor sleeps, every so manieth second has a status.
const ASLEEP_S: u32 = 5;

/// What a board knows of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardHealth {
    /// Time the processor was busy since the last question. **Units:** 1/1000.
    pub load: u16,
    /// **Units:** V.
    pub battery: Option<f32>,
    /// Largest depth of the stack since the boot. **Units:** bytes.
    pub stack: u32,
    /// Why the processor started.
    pub reset: ResetReason,
}

/// What a board does for the loops.
pub trait Board {
    /// Keeps a value over a loss of power.
    fn keep(&mut self, value: &Value) -> impl Future<Output = Result<(), Refusal>>;
    /// How it is; asked once in a second, asleep every five seconds.
    fn health(&mut self) -> BoardHealth;
    /// All loops live: the watchdog may be fed. Called once in a second.
    fn alive(&mut self);
}

/// Makes steps, and talks to the laptop, for ever.
pub async fn process<const STEPS: usize, O: BorrowMut<Outbox<STEPS>>>(
    traffic: &Traffic,
    shoe: &mut Shoe<STEPS, O>,
    mut line: impl Read,
    mut board: impl Board,
) -> ! {
    let mut seconds = Ticker::every(Duration::from_secs(1));
    let mut bytes = [0; 128];
    let mut lateness = 0;
    let (mut rounds, mut lost) = (traffic.rounds(), traffic.lost());
    // Seconds since the last status, and what the sensor was asked since.
    let (mut quiet_s, mut asked) = (0, None);
    loop {
        let due = transmit(traffic, shoe);
        match select4(traffic.sensed(), line.read(&mut bytes), Timer::at(instant(due)), seconds.next()).await {
            Either4::First(Sensed::Batch(batch)) => {
                shoe.sensed(&batch);
                lateness = lateness.max(now() - batch.stamp);
            }
            Either4::First(Sensed::Asleep) => {
                shoe.fell_asleep();
                quiet_s = ASLEEP_S;
            }
            Either4::First(Sensed::Woken(time)) => {
                shoe.woke(time);
                quiet_s = ASLEEP_S;
            }
            Either4::Second(Ok(length)) => shoe.received(bytes.get(..length).unwrap_or_default(), now()),
            Either4::Second(Err(_)) => shoe.log(now(), Level::Warn, "serial line: bytes were lost"),
            Either4::Third(()) => {}
            Either4::Fourth(()) => {
                let time = now();
                (quiet_s, asked) = (quiet_s + 1, None);
                if traffic.lost() != lost {
                    lost = traffic.lost();
                    shoe.log(time, Level::Error, "the tracker was too late: samples were lost");
                }
                if traffic.rounds() != rounds {
                    rounds = traffic.rounds();
                    board.alive();
                }
            }
        }
        if quiet_s >= if shoe.asleep() { ASLEEP_S } else { 1 } {
            shoe.report(now(), &health(traffic, board.health(), lateness));
            (quiet_s, lateness) = (0, 0);
        }
        if let Some(value) = shoe.keep().copied() {
            let result = board.keep(&value).await;
            shoe.kept(result);
        }
        let drowsy = shoe.drowsy();
        if drowsy != shoe.asleep() && asked != Some(drowsy) {
            traffic.rest.signal(drowsy);
            asked = Some(drowsy);
        }
    }
}

/// Fills the line; when to ask again. Not inlined: its buffer is on the stack only while it is used.
#[inline(never)]
fn transmit<const STEPS: usize, O: BorrowMut<Outbox<STEPS>>>(traffic: &Traffic, shoe: &mut Shoe<STEPS, O>) -> Micros {
    let mut buffer = [0; FRAME_MAX];
    loop {
        let time = now();
        if traffic.bytes.free_capacity() < FRAME_MAX {
            return time + LINE_FULL_US;
        }
        let Some(mut frame) = shoe.transmit(time, &mut buffer) else { return shoe.deadline(time) };
        // There is room, since nobody else writes, but it may lie in two pieces.
        while let Ok(written @ 1..) = traffic.bytes.try_write(frame) {
            frame = frame.get(written..).unwrap_or_default();
        }
    }
}

fn health(traffic: &Traffic, board: BoardHealth, lateness_us: i64) -> Health {
    let [accel, gyro] = traffic.counters();
    let BoardHealth { load, battery, stack, reset } = board;
    let lateness_us = u32::try_from(lateness_us).unwrap_or(u32::MAX);
    Health { load, lateness_us, battery, stack, reset, accel, gyro }
}
