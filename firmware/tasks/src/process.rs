//! Makes steps of what was read, and talks to the laptop.

use crate::air::{Air, Happening};
use crate::queue::Sensed;
use crate::traffic::Traffic;
use crate::{instant, now};
use core::borrow::BorrowMut;
use embassy_futures::select::{Either5, select5};
use embassy_time::{Duration, Ticker, Timer};
use embedded_io_async::Read;
use sohle_shared::bonds::Bonds;
use sohle_shared::shoe::{Health, Shoe};
use sohle_shared::time::Micros;
use sohle_shared::wire::frame::FRAME_MAX;
use sohle_shared::wire::message::{Level, Refusal, ResetReason};
use sohle_shared::wire::outbox::Outbox;
use sohle_shared::wire::port::Port;
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
    /// Keeps the devices that have paired over a loss of power.
    fn keep_bonds(&mut self, _: &Bonds) -> impl Future<Output = Result<(), Refusal>> {
        core::future::ready(Err(Refusal::Unsupported))
    }
    /// How it is; asked once in a second, asleep every five seconds.
    fn health(&mut self) -> BoardHealth;
    /// All loops live: the watchdog may be fed. Called once in a second.
    fn alive(&mut self);
}

/// Makes steps, and talks to the laptops: one at the serial line, another one by Bluetooth, for ever.
pub async fn process<const STEPS: usize, const PORTS: usize, O: BorrowMut<Outbox<STEPS, PORTS>>>(
    traffic: &Traffic,
    shoe: &mut Shoe<STEPS, O, PORTS>,
    mut line: impl Read,
    air: &impl Air,
    mut board: impl Board,
) -> ! {
    let mut seconds = Ticker::every(Duration::from_secs(1));
    let (mut bytes, mut air_bytes) = ([0; 128], [0; 128]);
    let mut lateness = 0;
    let (mut rounds, mut lost) = (traffic.rounds(), traffic.lost());
    // Seconds since the last status, and what the sensor was asked since.
    let (mut quiet_s, mut asked) = (0, None);
    loop {
        let due = Timer::at(instant(transmit(traffic, shoe, air)));
        let read = line.read(&mut bytes);
        match select5(traffic.sensed(), read, air.happening(&mut air_bytes), due, seconds.next()).await {
            Either5::First(Sensed::Batch(batch)) => {
                shoe.sensed(&batch);
                lateness = lateness.max(now() - batch.stamp);
            }
            Either5::First(Sensed::Asleep) => {
                shoe.fell_asleep();
                quiet_s = ASLEEP_S;
            }
            Either5::First(Sensed::Woken(time)) => {
                shoe.woke(time);
                quiet_s = ASLEEP_S;
            }
            Either5::Second(Ok(length)) => {
                shoe.received(Port::Serial, bytes.get(..length).unwrap_or_default(), now());
            }
            Either5::Second(Err(_)) => shoe.log(now(), Level::Warn, "serial line: bytes were lost"),
            Either5::Third(Happening::Bytes(length)) => {
                shoe.received(Port::Radio, air_bytes.get(..length).unwrap_or_default(), now());
            }
            Either5::Third(Happening::Opened | Happening::Closed) => shoe.parted(Port::Radio, now()),
            Either5::Third(Happening::Said(level, line)) => shoe.log(now(), level, line),
            Either5::Third(Happening::Paired(bonds)) => {
                if board.keep_bonds(&bonds).await.is_err() {
                    shoe.log(now(), Level::Error, "Bluetooth: the pairing is not kept over a loss of power");
                }
            }
            Either5::Fourth(()) => {}
            Either5::Fifth(()) => {
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
            tell(shoe, air);
        }
        if let Some(value) = shoe.keep().copied() {
            let result = board.keep(&value).await;
            shoe.kept(result);
        }
        if let Some(seconds) = shoe.take_pairing() {
            air.let_pair(seconds);
        }
        air.hurry(shoe.records(Port::Radio));
        let drowsy = shoe.drowsy();
        if drowsy != shoe.asleep() && asked != Some(drowsy) {
            traffic.rest.signal(drowsy);
            asked = Some(drowsy);
        }
    }
}

/// The last status for who reads it by Bluetooth. Not inlined, for the stack.
#[inline(never)]
fn tell<const STEPS: usize, const PORTS: usize, O: BorrowMut<Outbox<STEPS, PORTS>>>(
    shoe: &Shoe<STEPS, O, PORTS>,
    air: &impl Air,
) {
    if PORTS > 1
        && let Some(status) = shoe.status(Port::Radio)
    {
        air.tell(&status);
    }
}

/// Fills both lines; when to ask again. Not inlined: its buffer is on the stack only while it is used.
#[inline(never)]
fn transmit<const STEPS: usize, const PORTS: usize, O: BorrowMut<Outbox<STEPS, PORTS>>>(
    traffic: &Traffic,
    shoe: &mut Shoe<STEPS, O, PORTS>,
    air: &impl Air,
) -> Micros {
    let serial = fill(
        shoe,
        Port::Serial,
        || traffic.bytes.free_capacity(),
        |mut frame| {
            // There is room, since nobody else writes, but it may lie in two pieces.
            while let Ok(written @ 1..) = traffic.bytes.try_write(frame) {
                frame = frame.get(written..).unwrap_or_default();
            }
        },
    );
    if PORTS == 1 || !air.is_open() {
        return serial;
    }
    serial.min(fill(shoe, Port::Radio, || air.room(), |frame| air.send(frame)))
}

/// Fills one line.
fn fill<const STEPS: usize, const PORTS: usize, O: BorrowMut<Outbox<STEPS, PORTS>>>(
    shoe: &mut Shoe<STEPS, O, PORTS>,
    port: Port,
    room: impl Fn() -> usize,
    put: impl Fn(&[u8]),
) -> Micros {
    let mut buffer = [0; FRAME_MAX];
    loop {
        let time = now();
        if room() < FRAME_MAX {
            return time + LINE_FULL_US;
        }
        let Some(frame) = shoe.transmit(port, time, &mut buffer) else { return shoe.deadline(port, time) };
        put(frame);
    }
}

fn health(traffic: &Traffic, board: BoardHealth, lateness_us: i64) -> Health {
    let [accel, gyro] = traffic.counters();
    let BoardHealth { load, battery, stack, reset } = board;
    let lateness_us = u32::try_from(lateness_us).unwrap_or(u32::MAX);
    Health { load, lateness_us, battery, stack, reset, accel, gyro }
}
