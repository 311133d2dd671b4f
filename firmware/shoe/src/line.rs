//! The bytes of the line to the laptop: what the drivers call errors is for the wire's checksums to find.

use core::convert::Infallible;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{RingBufferedUartRx, UartRx};
use embedded_io_async::{ErrorType, Read};
use static_cell::StaticCell;

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
