//! Lines of text to any number of WebSocket clients, as they come.
//!
//! Whoever serves never waits: each client has a thread and a bounded queue of its own, and one that reads too slowly loses the
//! oldest lines. A client that comes later gets the last line at once. A page of another site than this machine's own is
//! refused: where somebody is, is nobody's business but theirs.

use std::collections::VecDeque;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::StatusCode;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error as WsError, Message, WebSocket};

/// Lines that wait for a client: some minutes of walking.
const WAITING: usize = 256;
/// More clients are turned away.
const MOST_CLIENTS: usize = 64;
/// A client that takes nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(10);
/// Between two looks at what a client says, and at whether to end.
const LOOK: Duration = Duration::from_millis(100);
/// How long clients get for what still waits, at the end.
const FAREWELL: Duration = Duration::from_secs(2);
/// Nobody has to say more than this. **Units:** bytes.
const MOST_SAID: usize = 4_096;

/// Why nothing is served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The text is no place to listen at.
    #[error("--serve {0}: expected PORT, which is on this machine only, or HOST:PORT")]
    Address(String),
    /// The system refuses the port.
    #[error("cannot serve at {0}: {1}")]
    Listen(String, std::io::Error),
}

/// Serves until it is finished.
#[derive(Debug)]
pub struct Server {
    shared: Arc<Shared>,
    address: SocketAddr,
}

#[derive(Debug, Default)]
struct Shared {
    clients: Mutex<Vec<Arc<Client>>>,
    last: Mutex<Option<Arc<str>>>,
    ending: AtomicBool,
    dropped: AtomicU64,
}

/// What waits for a client.
#[derive(Debug, Default)]
struct Client {
    lines: Mutex<VecDeque<Arc<str>>>,
    ready: Condvar,
}

impl Server {
    /// Listens at `PORT` of this machine, or at `HOST:PORT`; port 0 is any free one.
    ///
    /// # Errors
    /// For a text that is no such thing, and when the port cannot be had.
    pub fn start(text: &str) -> Result<Self, ServeError> {
        let wrong = || ServeError::Address(text.to_owned());
        let failed = |error| ServeError::Listen(text.to_owned(), error);
        let addresses: Vec<SocketAddr> = match text.parse::<u16>() {
            Ok(port) => vec![SocketAddr::from(([127, 0, 0, 1], port))],
            Err(_) if !text.contains(':') => return Err(wrong()),
            Err(_) => text.to_socket_addrs().map_err(failed)?.collect(),
        };
        if addresses.is_empty() {
            return Err(wrong());
        }
        let listener = TcpListener::bind(&addresses[..]).map_err(failed)?;
        // So that it can be ended.
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let shared = Arc::new(Shared::default());
        let known = shared.clone();
        std::thread::spawn(move || known.welcome(&listener));
        Ok(Self { shared, address })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Gives a line to everybody. Never waits.
    pub fn tell(&self, line: &str) {
        let line: Arc<str> = line.into();
        // The last line and the list of clients change together: nobody gets a line twice, or not at all.
        let mut last = locked(&self.shared.last);
        *last = Some(line.clone());
        for client in locked(&self.shared.clients).iter() {
            self.shared.dropped.fetch_add(client.push(line.clone()), Ordering::Relaxed);
        }
    }

    /// Lines that slow clients did not get, over all clients.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Sends what still waits, for two seconds at most, and says farewell.
    pub fn finish(self) {
        self.shared.ending.store(true, Ordering::Relaxed);
        let until = Instant::now() + FAREWELL;
        while Instant::now() < until && !locked(&self.shared.clients).is_empty() {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Nothing that is done under these locks can leave them in disorder.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Takes clients until the end.
    fn welcome(self: &Arc<Self>, listener: &TcpListener) {
        while !self.ending.load(Ordering::Relaxed) {
            match listener.accept() {
                Ok((stream, _)) if locked(&self.clients).len() < MOST_CLIENTS => {
                    let shared = self.clone();
                    std::thread::spawn(move || shared.attend(stream));
                }
                // One too many: its connection closes.
                Ok(_) => {}
                Err(_) => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }

    fn attend(&self, stream: TcpStream) {
        let ready = stream.set_nonblocking(false).and_then(|()| stream.set_read_timeout(Some(PATIENCE)));
        if ready.and_then(|()| stream.set_write_timeout(Some(PATIENCE))).is_err() {
            return;
        }
        let config = WebSocketConfig::default().max_message_size(Some(MOST_SAID)).max_frame_size(Some(MOST_SAID));
        let Ok(socket) = tungstenite::accept_hdr_with_config(stream, judge, Some(config)) else { return };
        let client = Arc::new(Client::default());
        {
            let last = locked(&self.last);
            locked(&client.lines).extend(last.clone());
            locked(&self.clients).push(client.clone());
        }
        // Whoever is gone is no reason for anything.
        let _ = self.speak(socket, &client);
        locked(&self.clients).retain(|other| !Arc::ptr_eq(other, &client));
    }

    fn speak(&self, mut socket: WebSocket<TcpStream>, client: &Client) -> Result<(), WsError> {
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(1)))?;
        loop {
            // Looked at first: what was told before the end is sent still.
            let ending = self.ending.load(Ordering::Relaxed);
            let lines = client.take();
            let idle = lines.is_empty();
            for line in lines {
                socket.send(Message::text(&*line))?;
            }
            match socket.read() {
                // Nobody has anything to say here; pings and farewells are answered by the library.
                Ok(_) => {}
                Err(WsError::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(error) => return Err(error),
            }
            if ending && idle {
                socket.close(None)?;
                return socket.flush();
            }
        }
    }
}

impl Client {
    /// How many old lines gave way to it.
    fn push(&self, line: Arc<str>) -> u64 {
        let mut lines = locked(&self.lines);
        let dropped = if lines.len() >= WAITING { lines.pop_front() } else { None };
        lines.push_back(line);
        self.ready.notify_one();
        u64::from(dropped.is_some())
    }

    /// All that waits, or nothing after a while.
    fn take(&self) -> VecDeque<Arc<str>> {
        let lines = locked(&self.lines);
        let waited = self.ready.wait_timeout_while(lines, LOOK, |lines| lines.is_empty());
        let (mut lines, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *lines)
    }
}

/// Lets programs in, and pages that this machine or the server's own host gave out.
#[expect(clippy::result_large_err, reason = "the library's own type")]
fn judge(request: &Request, response: Response) -> Result<Response, ErrorResponse> {
    let header = |name: &str| request.headers().get(name).map(|value| value.to_str().unwrap_or_default());
    let Some(origin) = header("Origin") else { return Ok(response) };
    let authority = origin.split_once("://").map_or("", |(_, rest)| rest);
    if is_here(authority) || header("Host").is_some_and(|host| !host.is_empty() && host == authority) {
        return Ok(response);
    }
    let mut refusal = ErrorResponse::new(Some(format!("pages of {origin} may not see this\n")));
    *refusal.status_mut() = StatusCode::FORBIDDEN;
    Err(refusal)
}

/// Whether a host, with or without a port, is this machine.
fn is_here(authority: &str) -> bool {
    let host = match authority.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => authority.split(':').next().unwrap_or_default(),
    };
    host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tungstenite::client::IntoClientRequest;
    use tungstenite::stream::MaybeTlsStream;

    fn connect(server: &Server) -> WebSocket<MaybeTlsStream<TcpStream>> {
        tungstenite::connect(format!("ws://{}", server.address())).unwrap().0
    }

    fn heard(client: &mut WebSocket<MaybeTlsStream<TcpStream>>) -> String {
        client.read().unwrap().into_text().unwrap().to_string()
    }

    #[test]
    fn several_clients_get_all_lines_and_a_late_one_the_last() {
        let server = Server::start("0").unwrap();
        assert!(server.address().ip().is_loopback());
        server.tell("first");
        let mut clients = [connect(&server), connect(&server)];
        // Whoever has got the last line is in the list.
        clients.iter_mut().for_each(|client| assert_eq!(heard(client), "first"));
        (0..20).for_each(|number| server.tell(&number.to_string()));
        for client in &mut clients {
            (0..20).for_each(|number| assert_eq!(heard(client), number.to_string()));
        }
        let mut late = connect(&server);
        assert_eq!(heard(&mut late), "19");
        server.finish();
        assert!(matches!(late.read(), Ok(Message::Close(_))));
    }

    #[test]
    fn a_client_that_does_not_read_delays_nobody_and_loses_the_oldest() {
        let server = Server::start("0").unwrap();
        server.tell("begin");
        let (slow, mut quick) = (connect(&server), connect(&server));
        assert_eq!(heard(&mut quick), "begin");
        // More than the system's buffers hold for the slow one; the quick one is waited for.
        let line = "x".repeat(100_000);
        let mut longest = Duration::ZERO;
        for _ in 0..2 * WAITING {
            let begun = Instant::now();
            server.tell(&line);
            longest = longest.max(begun.elapsed());
            assert_eq!(heard(&mut quick).len(), line.len());
        }
        assert!(server.dropped() > 0, "nothing was dropped for who does not read");
        assert!(longest < Duration::from_secs(1), "{longest:?}");
        drop(slow);
    }

    #[test]
    fn a_page_of_another_site_is_refused() {
        let server = Server::start("127.0.0.1:0").unwrap();
        let from = |origin: &str| {
            let mut request = format!("ws://{}", server.address()).into_client_request().unwrap();
            request.headers_mut().insert("Origin", origin.parse().unwrap());
            tungstenite::connect(request)
        };
        for mine in ["http://localhost:3000", "http://127.0.0.1", "http://[::1]:8080"] {
            assert!(from(mine).is_ok(), "{mine}");
        }
        for other in ["https://example.org", "null", "http://localhost.example.org", "http://127.0.0.1.example.org"] {
            let refused = from(other);
            assert!(matches!(&refused, Err(WsError::Http(answer)) if answer.status() == 403), "{other}: {refused:?}");
        }
    }

    #[test]
    fn what_is_no_address_is_told() {
        for wrong in ["", "localhost", "70000", "here"] {
            assert!(Server::start(wrong).unwrap_err().to_string().contains("expected PORT"), "{wrong}");
        }
        let taken = Server::start("0").unwrap();
        let again = Server::start(&taken.address().to_string()).unwrap_err();
        assert!(again.to_string().starts_with("cannot serve at 127.0.0.1:"), "{again}");
    }
}
