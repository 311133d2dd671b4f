//! Where lines of positions come from: a file, the standard input, or datagrams.

use crate::cli::Error;
use std::convert::Infallible;
use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

/// Lines that may wait to be heard. More than that of datagrams are lost, as on any busy network.
const WAITING: usize = 1_024;
/// Largest datagram.
const DATAGRAM: usize = 65_536;

/// Where lines come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The standard input.
    Input,
    /// A file.
    File(PathBuf),
    /// Datagrams to this place, which is HOST:PORT.
    Udp(String),
}

impl FromStr for Source {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text.strip_prefix("udp:") {
            Some(place) => Self::Udp(place.to_owned()),
            None if text == "-" => Self::Input,
            None => Self::File(text.into()),
        })
    }
}

impl fmt::Display for Source {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input => write!(out, "standard input"),
            Self::File(path) => write!(out, "{}", path.display()),
            Self::Udp(place) => write!(out, "udp:{place}"),
        }
    }
}

/// What [`Source::stream`] reads.
pub const FIXES: &str = "fixes";

impl Source {
    fn refused(&self, what: &str, error: &io::Error) -> Error {
        Error::new(format!("{what} {self}: {error}"))
    }

    /// All there is of `what` is read from it.
    pub fn text(&self, what: &str) -> Result<String, Error> {
        let mut text = String::new();
        match self {
            Self::Input => io::stdin().read_to_string(&mut text).map(|_| text),
            Self::File(path) => std::fs::read_to_string(path),
            Self::Udp(_) => Err(io::Error::other("a walk that is over hears no datagrams; expected a file or '-'")),
        }
        .map_err(|error| self.refused(what, &error))
    }

    /// Begins to read, beside the program.
    pub fn stream(&self) -> Result<Stream, Error> {
        let (lines, heard) = sync_channel(WAITING);
        let refused = |error| self.refused(FIXES, &error);
        match self {
            Self::Input => beside(move || read(io::stdin().lock(), &lines)),
            Self::File(path) => {
                let file = std::fs::File::open(path).map_err(refused)?;
                beside(move || read(BufReader::new(file), &lines));
            }
            Self::Udp(place) => {
                let socket = UdpSocket::bind(place.as_str()).map_err(refused)?;
                beside(move || receive(&socket, &lines));
            }
        }
        Ok(Stream { heard, timed: matches!(self, Self::File(_)) })
    }
}

/// Lines as they come.
#[derive(Debug)]
pub struct Stream {
    heard: Receiver<String>,
    /// The lines say themselves when they are to be heard; others are heard when they come.
    pub timed: bool,
}

impl Stream {
    /// The next line, if there is one now.
    pub fn next(&self) -> Option<String> {
        self.heard.try_recv().ok()
    }
}

/// The thread ends with what it reads, or with the program.
fn beside(work: impl FnOnce() + Send + 'static) {
    std::thread::spawn(work);
}

fn read(source: impl BufRead, lines: &SyncSender<String>) {
    for line in source.lines() {
        let line = match line {
            Ok(line) => line,
            // It is told like any other line that is no fix.
            Err(error) if error.kind() == io::ErrorKind::InvalidData => error.to_string(),
            Err(error) => return eprintln!("no more positions come: {error}"),
        };
        if lines.send(line).is_err() {
            return;
        }
    }
}

fn receive(socket: &UdpSocket, lines: &SyncSender<String>) {
    let mut bytes = vec![0; DATAGRAM];
    loop {
        let Ok((count, _)) = socket.recv_from(&mut bytes) else {
            // A network that goes away may come back.
            std::thread::sleep(Duration::from_millis(100));
            continue;
        };
        for line in String::from_utf8_lossy(&bytes[..count]).lines() {
            if let Err(TrySendError::Disconnected(_)) = lines.try_send(line.to_owned()) {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    fn first(stream: &Stream, count: usize) -> Vec<String> {
        let until = Instant::now() + Duration::from_secs(10);
        let mut lines = Vec::new();
        while lines.len() < count && Instant::now() < until {
            lines.extend(stream.next());
            std::thread::sleep(Duration::from_millis(1));
        }
        lines
    }

    #[test]
    fn lines_come_from_a_file_and_from_datagrams() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fixes.jsonl");
        std::fs::write(&path, "one\ntwo\n").unwrap();
        let source: Source = path.to_str().unwrap().parse().unwrap();
        assert_eq!(source.text(FIXES).unwrap(), "one\ntwo\n");
        assert_eq!(first(&source.stream().unwrap(), 2), ["one", "two"]);
        // A free port, which nobody takes in the next moment.
        let place = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let source: Source = format!("udp:{place}").parse().unwrap();
        let stream = source.stream().unwrap();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        sender.send_to(b"three\nfour", &place).unwrap();
        sender.send_to(b"five\xff\n", &place).unwrap();
        assert_eq!(first(&stream, 3), ["three", "four", "five\u{fffd}"]);
    }

    #[test]
    fn what_cannot_be_read_is_told() {
        let told = |text: &str| text.parse::<Source>().unwrap().text(FIXES).unwrap_err().to_string();
        assert!(told("/nowhere/fixes.jsonl").starts_with("fixes /nowhere/fixes.jsonl: "));
        assert!(told("udp:127.0.0.1:9").contains("expected a file or '-'"));
        let told = "udp:nowhere".parse::<Source>().unwrap().stream().unwrap_err().to_string();
        assert!(told.starts_with("fixes udp:nowhere: "), "{told}");
    }
}
