//! The emulated shoe's time. It is that of the room only as long as this machine keeps up, so who waits for the shoe waits by
//! the shoe's clock.

use crate::process::Failure;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A shoe that has told no second for so long hangs.
const PATIENCE: Duration = Duration::from_secs(60);
/// Between two looks.
const LOOK: Duration = Duration::from_millis(50);

/// The line on which the shoe tells its seconds (`firmware/emulator/src/shoe/pace.rs`).
pub struct Pace {
    listener: TcpListener,
    line: Option<TcpStream>,
    seconds: u64,
}

impl Pace {
    /// A port for the emulator to connect to.
    pub fn listen() -> Result<Self, Failure> {
        let listener = TcpListener::bind("127.0.0.1:0").and_then(|it| it.set_nonblocking(true).map(|()| it));
        Ok(Self { listener: listener.map_err(|error| broken(&error))?, line: None, seconds: 0 })
    }

    /// The port.
    pub fn port(&self) -> Result<u16, Failure> {
        self.listener.local_addr().map(|address| address.port()).map_err(|error| broken(&error))
    }

    /// How far the shoe's clock is since its power came. **Units:** s.
    pub fn seconds(&mut self) -> Result<u64, Failure> {
        self.look()?;
        Ok(self.seconds)
    }

    /// Waits until it is so far. **Units:** s.
    pub fn wait_until(&mut self, seconds: u64) -> Result<(), Failure> {
        let mut heard = Instant::now();
        loop {
            if self.look()? {
                heard = Instant::now();
            }
            if self.seconds >= seconds {
                return Ok(());
            }
            if heard.elapsed() > PATIENCE {
                return Err(Failure::Found(format!("the emulated shoe hangs after {} s of its time", self.seconds)));
            }
            sleep(LOOK);
        }
    }

    /// Lets the shoe's time pass as fast as this machine can for ten times as many seconds, and waits for their end.
    pub fn hurry(&mut self, tens: u8) -> Result<(), Failure> {
        let until = self.seconds()? + 10 * u64::from(tens);
        let line =
            self.line.as_mut().ok_or_else(|| Failure::Found("the emulated shoe does not tell its time".into()))?;
        line.write_all(&[tens]).map_err(|error| broken(&error))?;
        self.wait_until(until)
    }

    /// Takes what was told; whether there was anything.
    fn look(&mut self) -> Result<bool, Failure> {
        let line = match &mut self.line {
            Some(line) => line,
            empty => match self.listener.accept().and_then(|(line, _)| line.set_nonblocking(true).map(|()| line)) {
                Ok(line) => empty.insert(line),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
                Err(error) => return Err(broken(&error)),
            },
        };
        let mut bytes = [0; 256];
        match line.read(&mut bytes) {
            Ok(0) => Err(Failure::Found(format!("the emulator has ended after {} s of the shoe's time", self.seconds))),
            Ok(count) => {
                self.seconds = bytes.iter().take(count).fold(self.seconds, |seconds, &told| later(seconds, told));
                Ok(true)
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(false),
            Err(error) => Err(broken(&error)),
        }
    }
}

/// The next time after this one that ends in `told`. **Units:** s, modulo 256.
fn later(seconds: u64, told: u8) -> u64 {
    seconds + u64::from(told.wrapping_sub((seconds % 256) as u8))
}

fn broken(error: &std::io::Error) -> Failure {
    Failure::Found(format!("the line on which the emulated shoe tells its time: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_counted_beyond_a_byte() {
        assert_eq!(later(0, 0), 0);
        assert_eq!(later(0, 3), 3);
        assert_eq!(later(254, 1), 257);
        assert_eq!(later(257, 255), 511);
    }
}
