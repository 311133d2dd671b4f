//! The second port, Bluetooth, as the loop that makes steps sees it.

use core::future::pending;
use sohle_shared::bonds::Bonds;
use sohle_shared::wire::message::{Level, Status};

/// What happens at the port.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening {
    /// So many bytes came from the laptop.
    Bytes(usize),
    /// A laptop listens from now on: what is sent begins with whole frames.
    Opened,
    /// It is gone.
    Closed,
    /// These devices have paired, which the board has to keep.
    Paired(Bonds),
    /// A line for the log.
    Said(Level, &'static str),
}

/// The port. None of this waits for the radio, so that the tracker never does.
pub trait Air {
    /// What happens next; bytes are put into `bytes`.
    fn happening(&self, bytes: &mut [u8]) -> impl Future<Output = Happening>;
    /// Whether a laptop listens.
    fn is_open(&self) -> bool;
    /// Bytes that can be sent now.
    fn room(&self) -> usize;
    /// Sends a frame for which there is room.
    fn send(&self, frame: &[u8]);
    /// How the shoe is, for who asks without a program of ours.
    fn tell(&self, status: &Status);
    /// Whether much is to be sent, or little power to be taken.
    fn hurry(&self, hurry: bool);
    /// Lets other devices pair for so long. **Units:** s.
    fn let_pair(&self, seconds: u16);
}

/// A shoe without Bluetooth.
#[derive(Clone, Copy, Debug)]
pub struct NoAir;

impl Air for NoAir {
    async fn happening(&self, _: &mut [u8]) -> Happening {
        pending().await
    }

    fn is_open(&self) -> bool {
        false
    }

    fn room(&self) -> usize {
        0
    }

    fn send(&self, _: &[u8]) {}

    fn tell(&self, _: &Status) {}

    fn hurry(&self, _: bool) {}

    fn let_pair(&self, _: u16) {}
}
