//! The bytes of the line to the laptop: what the drivers call errors is for the wire's checksums to find.

use core::convert::Infallible;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{RingBufferedUartRx, UartRx, UartTx};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io_async::{ErrorType, Read};
use sohle_shared::wire::frame::FRAME_MAX;
use static_cell::StaticCell;

/// Frames on their way to the laptop, 11 ms of the line. **Units:** bytes.
static OUT: Pipe<CriticalSectionRawMutex, 1_024> = Pipe::new();

/// Whether any frame would fit.
pub fn room() -> bool {
    OUT.free_capacity() >= FRAME_MAX
}

/// Sends a frame as soon as those before it are sent; not a part of it when there is no room. Whether it is sent.
pub fn put(mut frame: &[u8]) -> bool {
    if OUT.free_capacity() < frame.len() {
        return false;
    }
    // Only one task puts anything in, so what is free stays free; where the ring comes around, a part is written first.
    while let Ok(written @ 1..) = OUT.try_write(frame) {
        frame = frame.get(written..).unwrap_or_default();
    }
    frame.is_empty()
}

/// Sends what was [`put`].
#[embassy_executor::task]
pub async fn send(mut tx: UartTx<'static, Async>) {
    let mut chunk = [0; 128];
    loop {
        let count = OUT.read(&mut chunk).await;
        // What does not arrive is sent again, or missed by nobody.
        let _ = tx.write(&chunk[..count]).await;
    }
}

/// As long as the line takes to fill it, 11 ms, nobody needs to look. **Units:** bytes.
const RING: usize = 1_024;

/// The receiving side. DMA writes all the time; whoever reads too late finds a gap.
pub struct Receiver(RingBufferedUartRx<'static>);

impl Receiver {
    /// Begins to receive. Panics when it is called twice.
    pub fn new(rx: UartRx<'static, Async>) -> Self {
        static BUFFER: StaticCell<[u8; RING]> = StaticCell::new();
        Self(rx.into_ring_buffered(BUFFER.init([0; RING])))
    }
}

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        loop {
            // After an error the driver starts anew with the next call.
            if let Ok(count) = self.0.read(buffer).await {
                return Ok(count);
            }
        }
    }
}
