//! The serial port: with a wire from TX to RX, counts how many of the largest frames arrive whole in a second.
//!
//! `cargo xtask flash --board B --bin bringup_uart`. What it prints when all is well is in `docs/bring-up.md`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{RingBufferedUartRx, UartRx, UartTx};
use embassy_time::{Duration, Instant, Ticker};
use portable_atomic::{AtomicU32, Ordering};
use sohle_shared::wire::frame::{AnyDecoder, FRAME_MAX, encode};
use sohle_shoe::board;
use sohle_shoe::executor::{self, Load};
use static_cell::StaticCell;

/// Bytes inside a frame: nearly the largest that the wire has.
type Payload = (u32, heapless::Vec<u8, 300>);

static SENT: AtomicU32 = AtomicU32::new(0);
static ARRIVED: AtomicU32 = AtomicU32::new(0);
/// Frames that came damaged, or not in the order they were sent.
static WRONG: AtomicU32 = AtomicU32::new(0);
/// Errors of the peripheral: overruns, framing, noise.
static LINE: AtomicU32 = AtomicU32::new(0);

#[embassy_executor::task]
async fn send(mut tx: UartTx<'static, Async>) {
    let mut buffer = [0; FRAME_MAX];
    for number in 0_u32.. {
        let bytes = (0..300).map(|index| (number as u8).wrapping_mul(31) ^ index as u8).collect();
        let payload: Payload = (number, bytes);
        if let Ok(frame) = encode(&payload, &mut buffer) {
            match tx.write(frame).await {
                Ok(()) => SENT.fetch_add(1, Ordering::Relaxed),
                Err(_) => LINE.fetch_add(1, Ordering::Relaxed),
            };
        }
    }
}

#[embassy_executor::task]
async fn receive(mut rx: RingBufferedUartRx<'static>) {
    let mut decoder = AnyDecoder::new();
    let mut chunk = [0; 256];
    let mut expected = None;
    loop {
        let Ok(count) = rx.read(&mut chunk).await else {
            LINE.fetch_add(1, Ordering::Relaxed);
            continue;
        };
        let mut bytes = &chunk[..count];
        while let Some(frame) = decoder.next::<Payload>(&mut bytes) {
            match frame {
                Ok((number, _)) if expected.is_none_or(|expected| expected == number) => {
                    ARRIVED.fetch_add(1, Ordering::Relaxed);
                    expected = Some(number.wrapping_add(1));
                }
                Ok((number, _)) => {
                    WRONG.fetch_add(1, Ordering::Relaxed);
                    expected = Some(number.wrapping_add(1));
                }
                Err(_) => {
                    WRONG.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
    }
}

#[embassy_executor::task]
async fn report() {
    let mut second = Ticker::every(Duration::from_secs(1));
    let mut load = Load::start();
    let mut last = Instant::now();
    loop {
        second.next().await;
        let take = |counter: &AtomicU32| counter.swap(0, Ordering::Relaxed);
        let (sent, arrived, wrong, line) = (take(&SENT), take(&ARRIVED), take(&WRONG), take(&LINE));
        let milliseconds = last.elapsed().as_millis();
        last = Instant::now();
        defmt::info!(
            "{=u64} ms: {=u32} frames sent, {=u32} arrived, {=u32} wrong, {=u32} errors of the line, load {=u16}/1000",
            milliseconds,
            sent,
            arrived,
            wrong,
            line,
            load.take()
        );
        if arrived == 0 {
            defmt::error!("nothing arrives: is there a wire from TX to RX?");
        }
    }
}

fn ring(rx: UartRx<'static, Async>) -> RingBufferedUartRx<'static> {
    static BUFFER: StaticCell<[u8; 2048]> = StaticCell::new();
    rx.into_ring_buffered(BUFFER.init([0; 2048]))
}

#[entry]
fn main() -> ! {
    let board = board::start();
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("bringup_uart on {=str}", board::NAME);
    executor::run(core.SCB, |spawner: Spawner| {
        spawner.spawn(send(board.tx).expect("one task"));
        spawner.spawn(receive(ring(board.rx)).expect("one task"));
        spawner.spawn(report().expect("one task"));
    })
}
