//! `sohle live` with a shoe in the same process: its application behind a network port, the sensor played back.

use crate::command::program;
use sohle_shared::bmx055::{Batch, Config};
use sohle_shared::calibration::Calibration;
use sohle_shared::selftest::{Batches, STRIDES};
use sohle_shared::shoe::Shoe;
use sohle_shared::time::Micros;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::frame::{AnyDecoder, FRAME_MAX};
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::FromShoe;
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::port::Port;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::process::Output;
use std::time::{Duration, Instant};

/// The walk takes 33 s; here it goes so much faster.
const SPEED: i64 = 8;

/// Walks for the laptops that come to `listener`, one after the other, from when the counts of the sensor are asked for; the
/// line is cut once, in the middle of the walk.
fn walk(listener: &TcpListener) {
    let identity = Identity { boot: 5, firmware: "test", board: "test" };
    let outbox = Outbox::<256>::new(0, Pace::default());
    let mut shoe = Shoe::new(identity, &Config::default(), &Parameters::default(), &Calibration::default(), outbox);
    let mut line = accept(listener);
    let begun = Instant::now();
    let (mut start, mut cut, mut ended) = (None, false, None);
    let mut batches = Batches::new().peekable();
    let mut bytes = [0; 256];
    while ended.is_none_or(|ended: Instant| ended.elapsed() < Duration::from_secs(20)) {
        let now = Micros(begun.elapsed().as_micros() as i64 * SPEED);
        let walked = start.map_or(Micros(-1), |start| Micros(now - start));
        while let Some(batch) = batches.next_if(|batch| batch.stamp <= walked) {
            shoe.sensed(&batch);
            // A machine that is late must not make the shoe late, which has room for some batches only.
            speak(&mut shoe, &mut line, now);
            if !cut && batch.stamp > Micros(16_000_000) {
                cut = true;
                drop(line);
                line = accept(listener);
            }
        }
        if batches.peek().is_none() {
            ended.get_or_insert(Instant::now());
        }
        match line.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => shoe.received(Port::Serial, &bytes[..count], now),
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(Duration::from_micros(500)),
            Err(_) => return,
        }
        if speak(&mut shoe, &mut line, now) {
            start.get_or_insert(now);
        }
    }
}

/// Sends what the shoe has to say; whether counts of the sensor were among it. A line that is gone takes everything.
fn speak<const STEPS: usize>(shoe: &mut Shoe<STEPS>, line: &mut TcpStream, now: Micros) -> bool {
    let mut buffer = [0; FRAME_MAX];
    let mut raw = false;
    while let Some(mut frame) = shoe.transmit(Port::Serial, now, &mut buffer) {
        raw |= matches!(AnyDecoder::new().next(&mut { frame }), Some(Ok(FromShoe::Raw(_))));
        while !frame.is_empty() {
            match line.write(frame) {
                Ok(count) => frame = &frame[count..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(Duration::from_millis(1)),
                Err(_) => break,
            }
        }
    }
    raw
}

/// A shoe that has walked and stood for a minute since.
fn stand_later(listener: &TcpListener) {
    stand_since(listener, Batches::new(), 100_000_000);
}

/// A shoe that has walked, stands and answers, laptop after laptop, until the process ends.
fn stand(listener: &TcpListener, walked: impl Iterator<Item = Batch>) {
    stand_since(listener, walked, 0);
}

/// The same, whose clock is at `from_us`.
fn stand_since(listener: &TcpListener, walked: impl Iterator<Item = Batch>, from_us: i64) {
    let identity = Identity { boot: 6, firmware: "test", board: "test" };
    let outbox = Outbox::<64>::new(0, Pace::default());
    let mut shoe = Shoe::new(identity, &Config::default(), &Parameters::default(), &Calibration::default(), outbox);
    walked.for_each(|batch| shoe.sensed(&batch));
    let begun = Instant::now();
    loop {
        let mut line = accept(listener);
        let mut bytes = [0; 256];
        loop {
            let now = Micros(from_us + begun.elapsed().as_micros() as i64);
            match line.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => shoe.received(Port::Serial, &bytes[..count], now),
                Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(Duration::from_millis(1)),
                Err(_) => break,
            }
            if shoe.keep().is_some() {
                shoe.kept(Ok(()));
            }
            speak(&mut shoe, &mut line, now);
        }
    }
}

fn accept(listener: &TcpListener) -> TcpStream {
    let line = listener.accept().expect("the laptop connects").0;
    line.set_nonblocking(true).expect("a socket can be");
    line
}

fn sohle(arguments: &[&str]) -> Output {
    program().args(arguments).output().expect("it was built")
}

#[test]
fn a_live_walk_arrives_whole_is_recorded_and_leads_to_the_same_bits() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let shoe = std::thread::spawn(move || walk(&listener));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    let (path, steps) = (path.to_str().unwrap(), STRIDES.to_string());
    let address = format!("tcp:127.0.0.1:{port}");
    let live = sohle(&["live", &address, "--out", path, "--raw", "--steps", &steps, "--for", "60", "--format", "json"]);
    let (out, err) = (String::from_utf8_lossy(&live.stdout), String::from_utf8_lossy(&live.stderr));
    assert!(live.status.success(), "{out}{err}");
    let events: Vec<serde_json::Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (summary, told) = events.split_last().unwrap();
    assert_eq!((summary["steps"].as_u64(), summary["lost"].as_u64()), (Some(STRIDES as u64), Some(0)), "{err}");
    assert!(told.iter().zip(0..).all(|(step, id)| step["id"] == id), "{out}");
    assert!(err.contains("the port is closed"), "it was cut once: {err}");

    let again = sohle(&["replay", path, "--out", folder.path().join("again").to_str().unwrap()]);
    let (out, err) = (String::from_utf8_lossy(&again.stdout), String::from_utf8_lossy(&again.stderr));
    assert!(again.status.success(), "{out}{err}");
    // What went while the line was cut is missing among the counts, so the steps are computed up to there.
    let line = out.lines().find(|line| line.contains("bit for bit")).unwrap();
    let steps: Vec<usize> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert!(steps[0] == steps[1] && steps[0] >= 5 && steps[2] == steps[3] && steps[2] > 50, "{line}");
    drop(shoe);
}

/// Where steps that were told as JSON lead when the first begins at (30, 10) m to the north: the end of each stance, and the
/// place.
fn way(events: &[serde_json::Value]) -> Vec<(i64, [f64; 2])> {
    let (mut place, mut heading) = ([30.0, 10.0], std::f64::consts::FRAC_PI_2);
    let steps = events.iter().filter(|event| event["event"] == "step");
    steps
        .map(|step| {
            let [x, y] = [0, 1].map(|axis| step["displacement_m"][axis].as_f64().expect("a number"));
            let (sin, cos) = f64::sin_cos(heading);
            place = [place[0] + cos * x - sin * y, place[1] + sin * x + cos * y];
            heading += step["turn_rad"].as_f64().expect("a number");
            (step["stance_end_us"].as_i64().expect("a number"), place)
        })
        .collect()
}

/// A position at the end of each step, as a line.
fn positions(way: &[(i64, [f64; 2])]) -> Vec<String> {
    let line = |(time, [x, y]): &(i64, [f64; 2])| {
        format!("{{\"time_us\":{time},\"source\":\"uwb\",\"position\":[{x},{y}],\"sigma_m\":0.3}}")
    };
    way.iter().map(line).collect()
}

/// Runs `sohle live` at a shoe that has walked and stands since; all it says.
fn heard(more: &[&str]) -> Vec<serde_json::Value> {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = format!("tcp:127.0.0.1:{}", listener.local_addr().expect("it has one").port());
    std::thread::spawn(move || stand_later(&listener));
    let live = sohle(&[&["live", &address, "--format", "json"], more].concat());
    let (out, err) = (String::from_utf8_lossy(&live.stdout), String::from_utf8_lossy(&live.stderr));
    assert!(live.status.success(), "{out}{err}");
    out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn positions_of_datagrams_are_put_together_with_the_steps_of_a_shoe_late_and_in_any_order() {
    let steps = STRIDES.to_string();
    let way = way(&heard(&["--no-record", "--steps", &steps, "--for", "20"]));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    // A free port, which nobody takes in the next moment.
    let place = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let mut lines = positions(&way);
    // The last come first, and all come a minute late; one says nothing of its time, which is now; one is no fix at all.
    lines.reverse();
    let [x, y] = way[way.len() - 1].1;
    lines.push(format!("{{\"source\":\"code\",\"position\":[{x},{y}],\"sigma_m\":0.1}}"));
    lines.push("nonsense".into());
    let sender = std::thread::spawn(move || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(place).unwrap();
        let until = Instant::now() + Duration::from_secs(15);
        // An empty line is none; it is refused as long as nobody listens.
        while Instant::now() < until {
            let told = socket.send(b"\n").is_ok();
            std::thread::sleep(Duration::from_millis(20));
            if told && socket.send(b"\n").is_ok() {
                break;
            }
        }
        for line in lines {
            socket.send(line.as_bytes()).unwrap();
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let udp = format!("udp:{place}");
    let events = heard(&["--fixes", &udp, "--out", path.to_str().unwrap(), "--for", "6"]);
    sender.join().unwrap();
    let summary = &events.last().unwrap()["positions"];
    let all = STRIDES as u64;
    assert_eq!((&summary["no_fixes"], &summary["sources"]["uwb"]["taken"]), (&1.into(), &all.into()), "{summary}");
    assert_eq!(summary["sources"]["code"]["taken"], 1, "{summary}");
    let off = |place: &serde_json::Value| {
        let [px, py] = [0, 1].map(|axis| place["position_m"][axis].as_f64().unwrap());
        (px - x).hypot(py - y)
    };
    assert!(off(&summary["at_end"]) < 0.3, "{summary}");

    // The recording has them, and a replay finds the same.
    let recording = sohle::recording::open(&path, None).unwrap();
    assert_eq!(recording.fixes.len(), STRIDES + 1);
    let late = |fix: &sohle::fixes::Fix| fix.arrived - fix.time > 30_000_000;
    assert_eq!(recording.fixes.iter().filter(|fix| late(fix)).count(), STRIDES);
    let again = folder.path().join("again");
    let replay = sohle(&["replay", path.to_str().unwrap(), "--out", again.to_str().unwrap()]);
    let told = String::from_utf8_lossy(&replay.stdout);
    assert!(replay.status.success() && told.contains("positions of"), "{told}");
}

#[test]
fn a_shoe_is_followed_in_a_building_with_the_positions_of_a_file() {
    let steps = STRIDES.to_string();
    let way = way(&heard(&["--no-record", "--steps", &steps, "--for", "20"]));
    let folder = tempfile::tempdir().unwrap();
    let fixes = folder.path().join("fixes.jsonl");
    std::fs::write(&fixes, positions(&way).join("\n")).unwrap();
    let twin = twin();
    let fixes = ["--fixes", fixes.to_str().unwrap(), "--steps", &steps, "--for", "20", "--no-record"];
    let alone = heard(&fixes);
    let told: Vec<_> = alone.iter().filter(|event| event["event"] == "position").collect();
    assert!(told.len() > STRIDES / 2, "{}", told.len());
    let inside = heard(&[&fixes[..], &["--building", &twin]].concat());
    let places: Vec<_> = inside.iter().filter(|event| event["event"] == "place").collect();
    assert_eq!(places.len(), STRIDES);
    let (_, [x, y]) = way[way.len() - 1];
    for positions in [&told[told.len() - 1]["positions"], &places[STRIDES - 1]["positions"]] {
        let [px, py] = [0, 1].map(|axis| positions["position_m"][axis].as_f64().unwrap());
        assert!((px - x).hypot(py - y) < 1.0, "{positions}");
    }
    let summary = &inside.last().unwrap()["places"]["positions"]["sources"]["uwb"];
    assert!(summary["taken"].as_u64().unwrap() > STRIDES as u64 / 2, "{summary}");
}

#[test]
fn a_source_that_cannot_be_had_is_told_before_a_shoe_is_looked_for() {
    let live = sohle(&["live", "tcp:127.0.0.1:1", "--no-record", "--for", "0.1", "--fixes", "udp:nowhere"]);
    let err = String::from_utf8_lossy(&live.stderr);
    assert!(!live.status.success() && err.starts_with("error: fixes udp:nowhere: "), "{err}");
}

#[test]
fn where_no_shoe_is_it_says_so() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let live = sohle(&["live", &format!("tcp:127.0.0.1:{port}"), "--no-record", "--for", "0.6"]);
    let err = String::from_utf8_lossy(&live.stderr);
    assert!(!live.status.success() && err.ends_with("error: no shoe was found\n"), "{err}");
    let wrong = sohle(&["live", "uart:/dev/ttyS0"]);
    let err = String::from_utf8_lossy(&wrong.stderr);
    assert!(!wrong.status.success() && err.contains("expected serial:/dev/ttyACM0"), "{err}");
}

#[test]
fn a_shoe_does_what_it_is_asked_for() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:127.0.0.1:{}", listener.local_addr().unwrap().port());
    std::thread::spawn(move || stand(&listener, std::iter::empty()));
    let said = |arguments: &[&str]| {
        let output = sohle(&[&["command", address.as_str()], arguments].concat());
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {err}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let defaults = String::from_utf8_lossy(&sohle(&["parameters"]).stdout).into_owned();
    let value = |text: &str| toml::from_str::<toml::Table>(text).unwrap();
    assert_eq!(value(&said(&["parameters", "get"])), value(&defaults));
    for order in [&["reset"][..], &["init"], &["floor-mode", "stairs"], &["floor-mode", "auto"], &["resend"]] {
        assert_eq!(said(order), "done\n");
    }
    let folder = tempfile::tempdir().unwrap();
    let mine = folder.path().join("mine.toml");
    std::fs::write(&mine, "start_after_s = 7.5\n").unwrap();
    assert_eq!(said(&["parameters", "set", mine.to_str().unwrap()]), "done\n");
    assert_eq!(value(&said(&["parameters", "get"]))["start_after_s"].as_float(), Some(7.5));
    std::fs::write(&mine, "shoe_size = 43\n").unwrap();
    let refused = sohle(&["command", &address, "calibration", "set", mine.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("shoe_size"), "{refused:?}");
}

#[test]
fn a_command_leaves_the_steps_for_who_records_them() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:127.0.0.1:{}", listener.local_addr().unwrap().port());
    std::thread::spawn(move || stand(&listener, Batches::new()));
    for _ in 0..2 {
        assert!(sohle(&["command", &address, "parameters", "get"]).status.success());
    }
    let steps = STRIDES.to_string();
    let live = sohle(&["live", &address, "--no-record", "--steps", &steps, "--for", "20", "--format", "json"]);
    let out = String::from_utf8_lossy(&live.stdout);
    let told = out.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let ids: Vec<_> = told.filter_map(|event| event["id"].as_u64()).collect();
    assert_eq!(ids, (0..STRIDES as u64).collect::<Vec<_>>(), "{}", String::from_utf8_lossy(&live.stderr));
}

#[test]
fn a_recording_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.mcap");
    std::fs::write(&path, "an earlier walk").unwrap();
    let live = sohle(&["live", "tcp:127.0.0.1:1", "--for", "0.1", "--out", path.to_str().unwrap()]);
    let err = String::from_utf8_lossy(&live.stderr);
    assert!(!live.status.success() && err.contains("walk.mcap is there already"), "{err}");
    assert_eq!(std::fs::read(&path).unwrap(), b"an earlier walk");
}

/// The twin of the document's building.
fn twin() -> String {
    format!("{}/../buildings/twin.geojson", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_live_walk_is_followed_in_a_building_served_and_the_shoe_told_its_floor_mode() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:127.0.0.1:{}", listener.local_addr().unwrap().port());
    std::thread::spawn(move || walk(&listener));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    // A free port, which nobody takes in the next moment.
    let serve = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let url = format!("ws://{serve}");
    let client = std::thread::spawn(move || {
        let until = Instant::now() + Duration::from_secs(30);
        let mut socket = loop {
            match tungstenite::connect(&url) {
                Ok((socket, _)) => break socket,
                Err(error) if Instant::now() > until => panic!("{error}"),
                Err(_) => std::thread::sleep(Duration::from_millis(20)),
            }
        };
        let mut lines = Vec::new();
        while let Ok(message) = socket.read() {
            lines.extend(message.to_text().ok().filter(|text| text.starts_with('{')).map(str::to_owned));
        }
        lines
    });
    let (twin, steps) = (twin(), STRIDES.to_string());
    let pictures = folder.path().join("pictures");
    let live = sohle(
        &[
            &["live", &address, "--raw", "--out", path.to_str().unwrap(), "--steps", &steps, "--for", "60"][..],
            &["--building", &twin, "--serve", &serve, "--format", "json", "--pictures", pictures.to_str().unwrap()],
        ]
        .concat(),
    );
    let (out, err) = (String::from_utf8_lossy(&live.stdout), String::from_utf8_lossy(&live.stderr));
    assert!(live.status.success(), "{out}{err}");
    assert!(err.contains("the shoe takes the ground for: auto"), "{err}");
    let events: Vec<serde_json::Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let said = |event: &str| events.iter().filter(|other| other["event"] == event).cloned().collect::<Vec<_>>();
    let (steps, places) = (said("step"), said("place"));
    // The stand before the first stride is a step too, which may come while the program takes its leave.
    assert!(steps.len() == places.len() && (STRIDES..=STRIDES + 1).contains(&steps.len()), "{out}");
    assert!(places.iter().zip(&steps).all(|(place, step)| place["time_us"] == step["stance_end_us"]));
    // This century.
    assert!(places.last().unwrap()["unix_us"].as_i64().unwrap() > 1_000_000_000_000_000);
    let summary = &said("summary")[0]["places"];
    assert_eq!((&summary["followed"], &summary["before_start"]), (&places.len().into(), &0.into()));
    assert!(summary["floor_modes_told"].as_u64().unwrap() >= 1, "{summary}");
    let served = client.join().unwrap();
    assert!(served.len() >= STRIDES - 2, "{} of {STRIDES} lines: {err}", served.len());
    assert_eq!(serde_json::from_str::<serde_json::Value>(served.last().unwrap()).unwrap(), *places.last().unwrap());
    assert!(pictures.join("floor0.png").exists() && pictures.join("floor1.svg").exists());

    // The orders are in the recording, so that the steps are made again with them.
    let recording = sohle::recording::open(&path, None).unwrap();
    assert!(!recording.orders.is_empty() && recording.again.unwrap().is_whole(), "{:?}", recording.again);
    assert!(recording.metadata.contains_key("began_unix_us"));
    let again = folder.path().join("again");
    let replay = sohle(&["replay", path.to_str().unwrap(), "--building", &twin, "--out", again.to_str().unwrap()]);
    assert!(replay.status.success(), "{}", String::from_utf8_lossy(&replay.stderr));
    let replayed = sohle::recording::open(&again.join("recording.mcap"), None).unwrap();
    // The line was cut in the middle: the counts lead as far as there, where the last stance has not ended.
    let equal = recording.steps.iter().zip(&replayed.steps);
    let equal = equal.take_while(|(live, replayed)| PackedStep::pack(live) == PackedStep::pack(replayed)).count();
    assert!(equal >= 5 && equal + 1 >= replayed.steps.len(), "{equal} of {}", replayed.steps.len());
}

#[test]
fn steps_from_before_the_start_are_told_and_not_followed() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:127.0.0.1:{}", listener.local_addr().unwrap().port());
    // They were made before anybody connects, by a clock that has gone on since.
    std::thread::spawn(move || stand_later(&listener));
    let steps = STRIDES.to_string();
    let twin = twin();
    let live = |start: &str| {
        let live = sohle(
            &[
                &["live", &address, "--no-record", "--steps", &steps, "--for", "20", "--format", "json"][..],
                &["--building", &twin, "--start", start],
            ]
            .concat(),
        );
        let (out, err) = (String::from_utf8_lossy(&live.stdout), String::from_utf8_lossy(&live.stderr));
        assert!(live.status.success(), "{out}{err}");
        let events: Vec<serde_json::Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        events.last().unwrap().clone()
    };
    let summary = live("W02");
    assert_eq!(summary["steps"], STRIDES);
    assert_eq!((&summary["places"]["before_start"], &summary["places"]["followed"]), (&STRIDES.into(), &0.into()));
}
