//! Bluetooth on the boards: a module at the second serial line, and the button that lets others pair.

use crate::board;
use embassy_executor::Spawner;
use embassy_stm32::exti::ExtiInput;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::RNG;
use embassy_stm32::rng::Rng;
use embassy_stm32::uid::uid;
use embassy_stm32::usart::{RingBufferedUartRx, UartTx};
use embassy_time::Timer;
use sohle_ble::{Device, Radio, Resources, run};
use sohle_shared::bonds::Bonds;
use sohle_shared::checksum::CRC32;
use sohle_tasks::Air;
use static_cell::StaticCell;

/// What passes between the tracker and the radio.
pub static RADIO: Radio = Radio::new();

/// Bytes of the module that may wait: 22 ms of the line, and 3 of its longest packets while the processor pairs.
const RING: usize = 2_048;

/// Others may pair for so long after the button was pressed. **Units:** s.
const WINDOW_S: u16 = 60;
/// So long the button has to be pressed, which a spike on its wire is not. **Units:** ms.
const PRESSED_MS: u64 = 50;

/// Starts it where everything else goes before it: pairing takes the processor for a tenth of a second and more. Panics when
/// it is called twice.
pub fn start(spawner: Spawner, parts: board::Radio, bonds: Bonds) {
    static BUFFER: StaticCell<[u8; RING]> = StaticCell::new();
    let board::Radio { tx, rx, button, random } = parts;
    let line = (rx.into_ring_buffered(BUFFER.init([0; RING])), tx);
    spawner.spawn(radio(line, random, bonds).expect("one radio"));
    spawner.spawn(watch(button).expect("one button"));
}

#[embassy_executor::task]
async fn radio(
    line: (RingBufferedUartRx<'static>, UartTx<'static, Async>),
    mut random: Rng<'static, RNG>,
    bonds: Bonds,
) {
    static RESOURCES: StaticCell<Resources> = StaticCell::new();
    let entropy = || {
        let mut bytes = [0; 32];
        random.fill_bytes(&mut bytes);
        bytes
    };
    run(&RADIO, line, Device::new(address(), false), bonds, entropy, RESOURCES.init(Resources::new())).await
}

#[embassy_executor::task]
async fn watch(mut button: ExtiInput<'static, Async>) {
    loop {
        button.wait_for_low().await;
        Timer::after_millis(PRESSED_MS).await;
        if button.is_low() {
            RADIO.let_pair(WINDOW_S);
            button.wait_for_high().await;
        }
    }
}

/// An address that is this chip's own, made of its serial number.
fn address() -> [u8; 6] {
    let uid = uid();
    let mut digest = CRC32.digest();
    digest.update(&uid);
    let [a, b, c, d] = digest.finalize().to_le_bytes();
    let mut digest = CRC32.digest();
    digest.update(b"address");
    digest.update(&uid);
    let [e, f, ..] = digest.finalize().to_le_bytes();
    [a, b, c, d, e, f]
}
