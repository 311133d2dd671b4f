//! Against a server on this machine that can be told to misbehave.

use super::super::manifest::Upstream;
use super::*;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::sync::{Arc, Mutex};
use std::thread;

/// What the server does to the requests, one after the other; the last holds for all that follow.
#[derive(Clone, Copy, Debug)]
enum Behaviour {
    /// Serves what is asked for.
    Good,
    /// Closes the connection after so many bytes.
    BreakOff(usize),
    /// Serves everything whatever range is asked for.
    NoRanges,
    /// Status 404.
    Absent,
}

/// Serves `content` under every path; returns its address and the ranges it was asked for.
fn serve(content: Vec<u8>, behaviours: &'static [Behaviour]) -> (String, Arc<Mutex<Vec<usize>>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    let asked = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&asked);
    // Ends with the test's process.
    thread::spawn(move || {
        for (count, stream) in listener.incoming().enumerate() {
            let mut stream = stream.unwrap();
            let mut from = 0;
            let mut reader = BufReader::new(stream.try_clone().unwrap());
            loop {
                let mut line = String::new();
                reader.read_line(&mut line).unwrap();
                if let Some(range) = line.to_ascii_lowercase().strip_prefix("range: bytes=") {
                    from = range.trim().trim_end_matches('-').parse().unwrap();
                }
                if line.trim().is_empty() {
                    break;
                }
            }
            log.lock().unwrap().push(from);
            let behaviour = behaviours[count.min(behaviours.len() - 1)];
            let whole = matches!(behaviour, Behaviour::NoRanges) || from == 0;
            let head = match behaviour {
                Behaviour::Absent => "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n".into(),
                _ if whole => format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\n", content.len()),
                _ if from >= content.len() => "HTTP/1.1 416 Range Not Satisfiable\r\nContent-Length: 0\r\n".into(),
                _ => format!(
                    "HTTP/1.1 206 Partial Content\r\nContent-Length: {}\r\nContent-Range: bytes {from}-{}/{}\r\n",
                    content.len() - from,
                    content.len() - 1,
                    content.len()
                ),
            };
            let rest = content.get(if whole { 0 } else { from }..).unwrap_or_default();
            let body = match behaviour {
                Behaviour::Absent => &[][..],
                Behaviour::BreakOff(bytes) => &rest[..bytes.min(rest.len())],
                _ => rest,
            };
            // A client that has seen enough may have gone.
            let _ = write!(stream, "{head}Connection: close\r\n\r\n").and_then(|()| stream.write_all(body));
        }
    });
    (address, asked)
}

fn content() -> Vec<u8> {
    (0..100_000_u32).map(|index| (index * 31 % 251) as u8).collect()
}

fn file(content: &[u8]) -> File {
    File {
        path: "walk/a b.csv".into(),
        sha256: sha256_of(content),
        licence: "MIT".into(),
        upstream: Upstream {
            repository: "https://github.com/owner/name".into(),
            commit: "1b".repeat(20),
            path: "data/a b.csv".into(),
        },
    }
}

/// Fetches from a server that behaves so; what came of it, the folder, and the ranges asked for.
fn fetch(
    behaviours: &'static [Behaviour],
    file: &File,
    part: Option<&[u8]>,
) -> (Result<Outcome, FetchError>, tempfile::TempDir, Vec<usize>) {
    let folder = tempfile::tempdir().unwrap();
    if let Some(part) = part {
        std::fs::create_dir(folder.path().join("walk")).unwrap();
        std::fs::write(folder.path().join("walk/a b.csv.part"), part).unwrap();
    }
    let (server, asked) = serve(content(), behaviours);
    let result = Fetcher::new(&server, folder.path()).fetch(file, |_| ());
    let asked = asked.lock().unwrap().clone();
    (result, folder, asked)
}

fn fetched(folder: &tempfile::TempDir) -> Option<Vec<u8>> {
    std::fs::read(folder.path().join("walk/a b.csv")).ok()
}

fn left(folder: &tempfile::TempDir) -> Option<Vec<u8>> {
    std::fs::read(folder.path().join("walk/a b.csv.part")).ok()
}

#[test]
fn a_file_comes_whole_and_is_not_fetched_twice() {
    let (result, folder, asked) = fetch(&[Behaviour::Good], &file(&content()), None);
    assert_eq!(result.unwrap(), Outcome::Fetched);
    assert_eq!((fetched(&folder), left(&folder), asked), (Some(content()), None, vec![0]));
    // Nobody listens there: what is complete needs no server.
    let again = Fetcher::new("http://127.0.0.1:1", folder.path()).fetch(&file(&content()), |_| ());
    assert_eq!(again.unwrap(), Outcome::Present);
}

#[test]
fn a_part_goes_on_where_it_ends() {
    let (result, folder, asked) = fetch(&[Behaviour::Good], &file(&content()), Some(&content()[..70_000]));
    assert_eq!(result.unwrap(), Outcome::Fetched);
    assert_eq!((fetched(&folder), left(&folder), asked), (Some(content()), None, vec![70_000]));
}

#[test]
fn a_complete_part_is_not_asked_for() {
    let (result, folder, asked) = fetch(&[Behaviour::Absent], &file(&content()), Some(&content()));
    assert_eq!(result.unwrap(), Outcome::Fetched);
    assert_eq!((fetched(&folder), asked), (Some(content()), vec![]));
}

#[test]
fn a_transfer_that_breaks_off_is_taken_up_again() {
    const SOMETIMES: &[Behaviour] = &[Behaviour::BreakOff(40_000), Behaviour::BreakOff(10_000), Behaviour::Good];
    let (result, folder, asked) = fetch(SOMETIMES, &file(&content()), None);
    assert_eq!(result.unwrap(), Outcome::Fetched);
    assert_eq!((fetched(&folder), asked), (Some(content()), vec![0, 40_000, 50_000]));
}

#[test]
fn what_came_of_a_broken_transfer_is_kept() {
    let (result, folder, asked) = fetch(&[Behaviour::BreakOff(100)], &file(&content()), None);
    assert!(matches!(result, Err(FetchError::BrokenOff { bytes: 400, .. })), "{result:?}");
    assert_eq!((fetched(&folder), left(&folder)), (None, Some(content()[..400].to_vec())));
    assert_eq!(asked, [0, 100, 200, 300]);
}

#[test]
fn another_file_is_told_and_not_kept() {
    let (result, folder, asked) = fetch(&[Behaviour::Good], &file(b"what the manifest means"), None);
    assert!(result.unwrap_err().to_string().contains("sha256 is"));
    assert_eq!((fetched(&folder), left(&folder), asked), (None, None, vec![0]));
}

#[test]
fn the_part_of_another_file_is_fetched_afresh() {
    for part in [vec![7; 500], vec![7; 200_000]] {
        let (result, folder, asked) = fetch(&[Behaviour::Good], &file(&content()), Some(&part));
        assert_eq!(result.unwrap(), Outcome::Fetched);
        assert_eq!((fetched(&folder), asked), (Some(content()), vec![part.len(), 0]));
    }
}

#[test]
fn a_server_without_ranges_is_asked_for_everything() {
    let (result, folder, asked) = fetch(&[Behaviour::NoRanges], &file(&content()), Some(&content()[..70_000]));
    assert_eq!(result.unwrap(), Outcome::Fetched);
    assert_eq!((fetched(&folder), asked), (Some(content()), vec![70_000, 0]));
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let (result, folder, _) = fetch(&[Behaviour::Absent], &file(&content()), None);
    let message = result.unwrap_err().to_string();
    assert!(message.contains("/data/a%20b.csv: ") && message.contains("404"), "{message}");
    assert_eq!((fetched(&folder), left(&folder)), (None, None));
}

#[test]
fn without_a_network_no_folder_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("recordings");
    let fetcher = Fetcher::new("http://127.0.0.1:1", &inner);
    let error = fetcher.fetch(&file(&content()), |_| ()).unwrap_err();
    assert!(matches!(&error, FetchError::Offline { .. }), "{error}");
    assert!(error.to_string().starts_with("cannot reach http://127.0.0.1:1: "), "{error}");
    fetcher.tidy();
    assert!(!inner.exists());
}
