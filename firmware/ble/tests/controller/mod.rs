//! A controller that answers every command with success, and says what it is told to.

use embassy_time::{Duration, MockDriver};
use embedded_io_async::{ErrorType, Read, Write};
use sohle_ble::{Device, Radio, Resources, run};
use sohle_shared::bonds::Bonds;
use sohle_tasks::Air;
use std::cell::{RefCell, RefMut};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::poll_fn;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};

/// What the controller knows.
#[derive(Default)]
pub struct Fake {
    said: VecDeque<u8>,
    pub advertises: bool,
    pub connected: bool,
    pub resets: u32,
    /// Data packets that the host has sent.
    pub sent: Vec<Vec<u8>>,
}

impl Fake {
    pub const HANDLE: u16 = 0x0040;

    pub fn say(&mut self, bytes: &[u8]) {
        self.said.extend(bytes);
    }

    pub fn connect(&mut self) {
        let [low, high] = Self::HANDLE.to_le_bytes();
        let peer = [1, 0x11, 0x22, 0x33, 0x44, 0x55, 0xc6];
        let parameters = [24, 0, 0, 0, 42, 0, 0];
        self.say(&[&[0x04, 0x3e, 19, 1, 0, low, high, 1][..], &peer, &parameters].concat());
        (self.advertises, self.connected) = (false, true);
    }

    pub fn disconnect(&mut self) {
        let [low, high] = Self::HANDLE.to_le_bytes();
        self.say(&[0x04, 0x05, 4, 0, low, high, 0x13]);
        self.connected = false;
    }

    /// The host has written a whole packet.
    fn hear(&mut self, packet: &[u8]) {
        match packet {
            [0x01, low, high, _, parameters @ ..] => self.obey(u16::from_le_bytes([*low, *high]), parameters),
            [0x02, low, high, ..] => {
                self.sent.push(packet.to_vec());
                self.say(&[0x04, 0x13, 5, 1, *low, high & 0x0f, 1, 0]);
            }
            _ => panic!("{packet:02x?}"),
        }
    }

    fn obey(&mut self, opcode: u16, parameters: &[u8]) {
        let [low, high] = opcode.to_le_bytes();
        match opcode {
            // Disconnect, update of the connection, and set PHY have a status first.
            0x0406 | 0x2013 | 0x2032 => {
                self.say(&[0x04, 0x0f, 4, 0, 1, low, high]);
                if opcode == 0x0406 && self.connected {
                    self.disconnect();
                }
                return;
            }
            0x0c03 => {
                self.resets += 1;
                (self.advertises, self.connected) = (false, false);
            }
            0x200a => self.advertises = parameters == [1] && !self.connected,
            _ => {}
        }
        let results: &[u8] = match opcode {
            // Address, buffers, random number, features, size of the list, data length.
            0x1009 => &[1, 2, 3, 4, 5, 6],
            0x2002 => &[251, 0, 8],
            0x2018 => &[7; 8],
            0x2003 => &[0xff; 8],
            0x200f => &[4],
            0x2022 => &parameters[..2],
            _ => &[],
        };
        let head = [0x04, 0x0e, 4 + results.len() as u8, 1, low, high, 0];
        self.say(&[&head, results].concat());
    }
}

/// One end of the line.
struct End(Rc<RefCell<Fake>>);

impl ErrorType for End {
    type Error = Infallible;
}

impl Read for End {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|_| {
            let mut fake = self.0.borrow_mut();
            let length = fake.said.len().min(buffer.len());
            if length == 0 {
                return Poll::Pending;
            }
            buffer.iter_mut().zip(fake.said.drain(..length)).for_each(|(place, byte)| *place = byte);
            Poll::Ready(Ok(length))
        })
        .await
    }
}

impl Write for End {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().hear(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Simulated time is one for the whole process: the tests take turns.
static TURN: Mutex<()> = Mutex::new(());

/// A shoe's Bluetooth on the bench.
pub struct Bench {
    _turn: MutexGuard<'static, ()>,
    fake: Rc<RefCell<Fake>>,
    radio: &'static Radio,
    run: Pin<Box<dyn Future<Output = ()>>>,
}

impl Bench {
    pub fn new() -> Self {
        let fake = Rc::new(RefCell::new(Fake::default()));
        let radio: &'static Radio = Box::leak(Box::new(Radio::new()));
        let line = (End(fake.clone()), End(fake.clone()));
        let device = Device::new([1, 2, 3, 4, 5, 6], true);
        let run = Box::pin(async move {
            let mut resources = Resources::new();
            run(radio, line, device, Bonds::NONE, || [9; 32], &mut resources).await;
        });
        Self { _turn: TURN.lock().unwrap_or_else(PoisonError::into_inner), fake, radio, run }
    }

    pub fn fake(&self) -> RefMut<'_, Fake> {
        self.fake.borrow_mut()
    }

    pub fn let_pair(&self) {
        self.radio.let_pair(60);
    }

    pub fn is_open(&self) -> bool {
        self.radio.is_open()
    }

    /// Lets so many milliseconds pass.
    pub fn pass(&mut self, millis: u64) {
        self.until(millis, |_| false);
    }

    /// Lets time pass until this is so, but no longer; whether it is. The tracker takes what comes meanwhile.
    pub fn until(&mut self, millis: u64, reached: impl Fn(&Fake) -> bool) -> bool {
        let mut context = Context::from_waker(Waker::noop());
        for _ in 0..millis {
            if reached(&self.fake.borrow()) {
                return true;
            }
            for _ in 0..3 {
                assert!(self.run.as_mut().poll(&mut context).is_pending());
                let mut bytes = [0; 64];
                let happening = std::pin::pin!(self.radio.happening(&mut bytes));
                let _ = happening.poll(&mut context);
            }
            MockDriver::get().advance(Duration::from_millis(1));
        }
        reached(&self.fake.borrow())
    }
}
