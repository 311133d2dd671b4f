//! A bad serial line between the emulated shoe and the laptop.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// One byte in so many is damaged.
const DAMAGED: u32 = 400;
/// One piece in so many is lost. A piece is what comes at once: a frame, or some.
const LOST: u32 = 10;
/// The shoe's port may take a while to open.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the line did.
#[derive(Default)]
struct Faults {
    damaged: AtomicU64,
    lost: AtomicU64,
}

/// A line between two ports of this machine; it ends with the program.
pub struct Proxy(Arc<Faults>);

impl Proxy {
    /// Listens on one port and connects to the other for whoever comes.
    pub fn start(listen: u16, shoe: u16) -> io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", listen))?;
        let faults = Arc::new(Faults::default());
        let counted = faults.clone();
        thread::spawn(move || {
            for (laptop, seed) in listener.incoming().map_while(Result::ok).zip(1..) {
                let Some(shoe) = connected(shoe) else { return };
                let (Ok(from_laptop), Ok(from_shoe)) = (laptop.try_clone(), shoe.try_clone()) else { return };
                let (there, back) = (counted.clone(), counted.clone());
                thread::spawn(move || carry(from_laptop, shoe, &there, seed));
                thread::spawn(move || carry(from_shoe, laptop, &back, seed + 1_000_003));
            }
        });
        Ok(Self(faults))
    }

    /// Bytes damaged and pieces lost so far.
    pub fn faults(&self) -> (u64, u64) {
        (self.0.damaged.load(Ordering::Relaxed), self.0.lost.load(Ordering::Relaxed))
    }
}

fn connected(port: u16) -> Option<TcpStream> {
    let until = Instant::now() + PATIENCE;
    loop {
        match TcpStream::connect(("127.0.0.1", port)) {
            Ok(stream) => return Some(stream),
            Err(_) if Instant::now() < until => thread::sleep(Duration::from_millis(50)),
            Err(_) => return None,
        }
    }
}

/// Carries bytes until one end is gone.
fn carry(mut from: TcpStream, mut to: TcpStream, faults: &Faults, seed: u32) {
    // A delay of the line would be no fault of it.
    let _ = to.set_nodelay(true);
    let mut chance = seed;
    let mut one_in = |n: u32| {
        // Numerical Recipes, "quick and dirty"; the high bits are the better ones.
        chance = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (chance >> 8).is_multiple_of(n)
    };
    let mut buffer = [0; 512];
    while let Ok(count @ 1..) = from.read(&mut buffer) {
        if one_in(LOST) {
            faults.lost.fetch_add(1, Ordering::Relaxed);
            continue;
        }
        let piece = buffer.get_mut(..count).unwrap_or_default();
        for byte in piece.iter_mut() {
            if one_in(DAMAGED) {
                *byte ^= 1 << (*byte % 8);
                faults.damaged.fetch_add(1, Ordering::Relaxed);
            }
        }
        if to.write_all(piece).is_err() {
            return;
        }
    }
}
