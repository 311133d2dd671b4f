//! The bytes of a serial port, a network port or a shoe on Bluetooth, opened anew whenever they stop.
//!
//! A thread opens the port, stamps and hands over what it reads, and when the port is gone tries again, at first soon and
//! then every [`LONGEST_PAUSE`]. The end that writes is handed over with [`Signal::Opened`]; dropping it makes the thread
//! open the port anew.

use super::address::Address;
use super::bluetooth;
use sohle_shared::time::Micros;
use std::collections::BTreeSet;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Pause before the second try; it doubles from try to try.
const SHORTEST_PAUSE: Duration = Duration::from_millis(200);
/// It grows no longer.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// A thread that reads looks so often whether it is still wanted.
const LOOK: Duration = Duration::from_millis(50);
/// A host that does not answer for so long is not there; a port that takes no byte for so long is gone.
const PATIENCE: Duration = Duration::from_secs(2);
/// Signals that may wait for whoever takes them: some seconds of everything a shoe sends. When there are more, the thread
/// stops reading and the system's buffers fill.
const WAITING: usize = 4_096;

/// The laptop's monotone clock, as [`Micros`] since it was made.
#[derive(Clone, Copy, Debug)]
pub struct HostClock(Instant);

impl HostClock {
    /// Begins at 0 now.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// The time now. **Units:** microseconds since the start.
    pub fn now(&self) -> Micros {
        Micros(i64::try_from(self.0.elapsed().as_micros()).unwrap_or(i64::MAX))
    }
}

/// What happens at the port.
#[derive(Debug)]
pub enum Signal {
    /// It is open; here is where to write.
    Opened(Outlet),
    /// Bytes came, at this time of the [`HostClock`].
    Bytes(Vec<u8>, Micros),
    /// It was open and is no longer, for this reason.
    Closed(String),
    /// It cannot be opened, for this reason; each kind of reason is told once until it is open again.
    Unreachable(String),
}

/// The end of an open port that writes. When it is dropped, the port is opened anew.
pub struct Outlet {
    port: Box<dyn Write + Send>,
    wanted: Arc<AtomicBool>,
}

impl Outlet {
    /// Writes all of `bytes`, or tells why the port is to be opened anew.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }
}

impl std::fmt::Debug for Outlet {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str("Outlet")
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        self.wanted.store(false, Ordering::Relaxed);
    }
}

/// A port that is kept open. The thread behind it ends within [`LONGEST_PAUSE`] after it was dropped.
#[derive(Debug)]
pub struct Transport {
    signals: Receiver<Signal>,
    wanted: Arc<AtomicBool>,
}

impl Transport {
    /// Begins to open the port at `address`.
    pub fn open(address: Address, clock: HostClock) -> Self {
        Self::keeping(move || open(&address), clock)
    }

    /// Begins to open the port that `open` opens.
    pub(super) fn keeping(open: impl FnMut() -> io::Result<Port> + Send + 'static, clock: HostClock) -> Self {
        let (sender, signals) = sync_channel(WAITING);
        let wanted = Arc::new(AtomicBool::new(true));
        let asked = wanted.clone();
        thread::spawn(move || keep_open(open, clock, &sender, &asked));
        Self { signals, wanted }
    }

    /// The next signal, if one comes within `patience`.
    pub fn next(&self, patience: Duration) -> Option<Signal> {
        match self.signals.recv_timeout(patience) {
            Ok(signal) => Some(signal),
            Err(RecvTimeoutError::Timeout) => None,
            // The thread ends before its owner only by a panic; no busy loop then.
            Err(RecvTimeoutError::Disconnected) => {
                thread::sleep(patience);
                None
            }
        }
    }
}

impl Drop for Transport {
    fn drop(&mut self) {
        self.wanted.store(false, Ordering::Relaxed);
    }
}

/// Both ends of an open port. Reading returns within [`LOOK`].
pub(super) struct Port {
    reader: Box<dyn Read + Send>,
    writer: Box<dyn Write + Send>,
}

impl From<(bluetooth::pipe::Reader, bluetooth::pipe::Writer)> for Port {
    fn from((reader, writer): (bluetooth::pipe::Reader, bluetooth::pipe::Writer)) -> Self {
        Self { reader: Box::new(reader), writer: Box::new(writer) }
    }
}

fn open(address: &Address) -> io::Result<Port> {
    match address {
        Address::Serial { path, baud } => {
            let writer = serialport::new(path, *baud).timeout(PATIENCE).open()?;
            let mut reader = writer.try_clone()?;
            reader.set_timeout(LOOK)?;
            Ok(Port { reader: Box::new(reader), writer: Box::new(writer) })
        }
        Address::Tcp { host, port } => {
            let mut refusal = io::Error::new(ErrorKind::NotFound, "the host has no address");
            for place in (host.as_str(), *port).to_socket_addrs()? {
                match TcpStream::connect_timeout(&place, PATIENCE) {
                    Ok(stream) => return over(stream),
                    Err(error) => refusal = error,
                }
            }
            Err(refusal)
        }
        Address::Bluetooth(wanted) => Ok(bluetooth::open(wanted)?.into()),
    }
}

fn over(stream: TcpStream) -> io::Result<Port> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    Ok(Port { reader: Box::new(stream.try_clone()?), writer: Box::new(stream) })
}

/// Nobody takes the signals any more.
struct Abandoned;

fn keep_open(
    mut open: impl FnMut() -> io::Result<Port>,
    clock: HostClock,
    signals: &SyncSender<Signal>,
    asked: &AtomicBool,
) {
    let send = |signal| signals.send(signal).map_err(|_| Abandoned);
    let mut pause = SHORTEST_PAUSE;
    let mut told = BTreeSet::new();
    while asked.load(Ordering::Relaxed) {
        let outcome = match open() {
            Ok(Port { mut reader, writer }) => {
                told.clear();
                let wanted = Arc::new(AtomicBool::new(true));
                send(Signal::Opened(Outlet { port: writer, wanted: wanted.clone() })).and_then(|()| {
                    let (spoke, reason) = read(&mut *reader, &wanted, clock, send)?;
                    // A port that opens and never speaks is tried ever more rarely, too.
                    if spoke {
                        pause = SHORTEST_PAUSE;
                    }
                    send(Signal::Closed(reason))
                })
            }
            Err(error) if told.insert(format!("{:?}", error.kind())) => send(Signal::Unreachable(error.to_string())),
            Err(_) => Ok(()),
        };
        if outcome.is_err() {
            return;
        }
        thread::sleep(pause);
        pause = (pause * 2).min(LONGEST_PAUSE);
    }
}

/// Reads until the port is gone; whether anything came, and why it is gone.
fn read(
    port: &mut dyn Read,
    wanted: &AtomicBool,
    clock: HostClock,
    send: impl Fn(Signal) -> Result<(), Abandoned>,
) -> Result<(bool, String), Abandoned> {
    let mut buffer = [0; 4_096];
    let mut spoke = false;
    loop {
        if !wanted.load(Ordering::Relaxed) {
            return Ok((spoke, "opened anew".into()));
        }
        match port.read(&mut buffer) {
            Ok(0) => return Ok((spoke, "the other end has closed it".into())),
            Ok(count) => {
                spoke = true;
                send(Signal::Bytes(buffer.get(..count).unwrap_or_default().to_vec(), clock.now()))?;
            }
            Err(error)
                if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(error) => return Ok((spoke, error.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    /// The next signal of the kind that `wanted` takes; others are passed over.
    fn wait<T>(transport: &Transport, wanted: impl Fn(Signal) -> Option<T>) -> T {
        let until = Instant::now() + Duration::from_secs(10);
        while Instant::now() < until {
            if let Some(found) = transport.next(Duration::from_millis(20)).and_then(&wanted) {
                return found;
            }
        }
        panic!("nothing came within 10 s");
    }

    fn outlet(signal: Signal) -> Option<Outlet> {
        match signal {
            Signal::Opened(outlet) => Some(outlet),
            _ => None,
        }
    }

    fn bytes(transport: &Transport, count: usize) -> Vec<u8> {
        let mut all = Vec::new();
        while all.len() < count {
            all.extend(wait(transport, |signal| match signal {
                Signal::Bytes(bytes, _) => Some(bytes),
                _ => None,
            }));
        }
        all
    }

    fn closed(signal: Signal) -> Option<String> {
        match signal {
            Signal::Closed(reason) => Some(reason),
            _ => None,
        }
    }

    fn here(listener: &TcpListener) -> Address {
        Address::Tcp { host: "127.0.0.1".into(), port: listener.local_addr().unwrap().port() }
    }

    #[test]
    fn a_network_port_is_opened_anew_after_either_end_has_dropped_it() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let transport = Transport::open(here(&listener), HostClock::start());
        for round in 0_u8..3 {
            let mut peer = listener.accept().unwrap().0;
            let mut outlet = wait(&transport, outlet);
            outlet.write(&[round, 0, 7]).unwrap();
            let mut heard = [9; 3];
            peer.read_exact(&mut heard).unwrap();
            assert_eq!(heard, [round, 0, 7]);
            peer.write_all(&[1, round]).unwrap();
            assert_eq!(bytes(&transport, 2), [1, round]);
            match round {
                0 => drop(outlet),
                _ => drop(peer),
            }
            let reason = wait(&transport, closed);
            assert_eq!(reason, if round == 0 { "opened anew" } else { "the other end has closed it" });
        }
    }

    #[test]
    fn why_a_port_cannot_be_opened_is_told_once() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = here(&listener);
        drop(listener);
        let transport = Transport::open(address, HostClock::start());
        let unreachable = |signal| match signal {
            Signal::Unreachable(reason) => Some(reason),
            _ => None,
        };
        assert!(wait(&transport, unreachable).contains("refused"));
        // Two more tries follow in this time.
        assert!(transport.next(Duration::from_millis(700)).is_none());
    }

    #[test]
    fn the_thread_ends_when_nobody_wants_its_port() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let transport = Transport::open(here(&listener), HostClock::start());
        let mut peer = listener.accept().unwrap().0;
        drop(wait(&transport, outlet));
        drop(transport);
        // The end of the stream, not a second stream.
        assert_eq!(peer.read(&mut [0; 8]).unwrap(), 0);
        listener.set_nonblocking(true).unwrap();
        thread::sleep(SHORTEST_PAUSE * 2);
        assert!(listener.accept().is_err());
    }

    #[cfg(unix)]
    #[test]
    fn a_serial_port_carries_all_bytes_and_its_end_is_noticed() {
        use serialport::{SerialPort, TTYPort};
        let (mut master, slave) = TTYPort::pair().unwrap();
        let address = Address::Serial { path: slave.name().unwrap(), baud: 115_200 };
        let transport = Transport::open(address, HostClock::start());
        let mut outlet = wait(&transport, outlet);
        master.set_timeout(PATIENCE).unwrap();
        let every: Vec<u8> = (0..=255).collect();
        outlet.write(&every).unwrap();
        let mut heard = [0; 256];
        master.read_exact(&mut heard).unwrap();
        assert_eq!(heard[..], every);
        master.write_all(&every).unwrap();
        assert_eq!(bytes(&transport, 256), every);
        drop((master, slave));
        assert!(!wait(&transport, closed).is_empty());
    }
}
