//! The driver for those who wait: blocking buses and delays as asynchronous ones that are ready at once.
//!
//! A bare loop, a test or a bring-up program wraps its bus and its delay in [`Blocking`] and runs the driver's futures
//! with [`block_on`]; the driver itself is written once.

use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embedded_hal::spi::{ErrorType, Operation};

/// A blocking [`SpiDevice`](embedded_hal::spi::SpiDevice) or [`DelayNs`](embedded_hal::delay::DelayNs) whose futures are
/// ready when they are asked for the first time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Blocking<T>(pub T);

impl<T: ErrorType> ErrorType for Blocking<T> {
    type Error = T::Error;
}

impl<T: embedded_hal::spi::SpiDevice> embedded_hal_async::spi::SpiDevice for Blocking<T> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), T::Error> {
        self.0.transaction(operations)
    }
}

impl<T: embedded_hal::delay::DelayNs> embedded_hal_async::delay::DelayNs for Blocking<T> {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.delay_ns(ns);
    }
}

/// Runs a future to its end, asking it again and again. With nothing but [`Blocking`] inside it is asked once.
pub fn block_on<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
        core::hint::spin_loop();
    }
}
