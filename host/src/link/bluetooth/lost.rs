//! A link that is lost and regained, over an adapter that is made up, with the shoe's own end of the wire behind it.

use super::fault::Fault;
use super::radio::{Line, Radio, Sighting, connect};
use super::wanted::Wanted;
use super::{PATIENCE, pipe};
use crate::link::connection::{Connection, Happening};
use crate::link::endurance::step;
use crate::link::event::Event;
use crate::link::transport::{HostClock, Port as Ends, Transport};
use crate::simulation::random::{Purpose, Random};
use sohle_shared::calibration::Calibration;
use sohle_shared::time::Micros;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::frame::FRAME_MAX;
use sohle_shared::wire::link::{Identity, Link};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::port::Port;
use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

const BOOT: u32 = 5;
/// From step to step, much faster than anybody walks.
const STRIDE_US: i64 = 25_000;
/// Steps in range, the laptop being connected, before each absence and after the last.
const NEAR: u32 = 10;
/// Steps out of range.
const ABSENCES: [u32; 3] = [20, 5, 40];
/// So many go on the air before the loss of the connection is noticed, as in the time of a supervision timeout.
const UNHEARD: u32 = 4;

/// The ends of a connection on the shoe's side: what it says goes in, what the laptop says comes out.
type Shore = (Sender<Vec<u8>>, Receiver<Vec<u8>>);

/// What adapter and shoe share.
#[derive(Default)]
struct Air {
    in_range: bool,
    connected: Option<Shore>,
    /// How often the shoe was found, and how often a connection failed to come about.
    found: u32,
    failed: u32,
}

/// An adapter that hears the shoe while it is in range. The first try after an absence fails, as it often does at the edge.
struct Fake {
    air: Arc<Mutex<Air>>,
    stumbles: bool,
}

impl Radio for Fake {
    fn search(&mut self, _: Duration, _: &dyn Fn(&Sighting) -> bool) -> Result<Vec<Sighting>, Fault> {
        let shoe =
            || Sighting { name: Some("Sohle-0386".into()), address: "C0:5E:00:00:00:01".into(), signal_dbm: Some(-60) };
        let here = self.air.lock().unwrap().in_range;
        self.stumbles |= !here;
        Ok(here.then(shoe).into_iter().collect())
    }

    fn connect(&mut self, shoe: &Sighting) -> Result<Line, Fault> {
        let mut air = self.air.lock().unwrap();
        if !air.in_range || std::mem::take(&mut self.stumbles) {
            air.failed += 1;
            return Err(Fault::Silent(shoe.address.clone()));
        }
        air.found += 1;
        let ((said, received), (sent, heard)) = (channel(), channel());
        air.connected = Some((said, heard));
        let send = move |piece: &[u8]| sent.send(piece.to_vec()).map_err(|_| io::ErrorKind::ConnectionReset.into());
        Ok(Line { received, send: Box::new(send), piece: 20 })
    }
}

fn made(id: u32) -> sohle_shared::step::Step {
    step(id, Micros(i64::from(id) * 1_000_000), &mut Random::new(u64::from(id), Purpose::MadeUpSteps))
}

/// The shoe: it makes steps, gets out of range and comes back. Ends when the laptop has all steps, and tells how many.
fn walk(air: &Mutex<Air>) -> u32 {
    let clock = HostClock::start();
    let identity = Identity { boot: BOOT, firmware: "1.0.0", board: "made up" };
    let mut outbox = Outbox::<1_000, 2>::new(BOOT, Pace::SERIAL);
    outbox.begin(Port::Radio, Pace::RADIO);
    let mut link = Link::<1_000, _, 2>::new(identity, &Parameters::default(), &Calibration::default(), outbox);
    let mut absences = ABSENCES.into_iter();
    // The number of the next step; whether there will be one; since when the laptop listens; from when to when it is absent.
    let (mut id, mut walks, mut near, mut absence) = (0, true, None, None);
    let mut open = false;
    while walks || link.waiting(Port::Radio) > 0 {
        let now = clock.now();
        let mut air = air.lock().unwrap();
        if walks && now.0 >= i64::from(id) * STRIDE_US {
            link.push(&made(id));
            id += 1;
        }
        match absence {
            Some((_, back)) if id >= back => absence = None,
            Some((begun, _)) if id >= begun + UNHEARD => air.connected = None,
            Some(_) => {}
            None if walks && near.is_some_and(|since| id >= since + NEAR) => {
                absence = absences.next().map(|length| (id, id + length));
                walks = absence.is_some();
                near = None;
            }
            None if open && link.connected(Port::Radio) => _ = near.get_or_insert(id),
            None => {}
        }
        air.in_range = absence.is_none();
        // As the firmware does whenever the stream begins or ends.
        if air.connected.is_some() != open {
            open = !open;
            link.part(Port::Radio, now);
        }
        if let Some((said, heard)) = &air.connected {
            let on_air = air.in_range;
            heard.try_iter().filter(|_| on_air).for_each(|bytes| link.receive(Port::Radio, &bytes, now));
            let mut buffer = [0; FRAME_MAX];
            while let Some(frame) = link.transmit(Port::Radio, now, &mut buffer) {
                // A notification holds any piece of the stream.
                for piece in frame.chunks(17).filter(|_| on_air) {
                    // A laptop that has just gone does not hear it.
                    let _ = said.send(piece.to_vec());
                }
            }
        }
        drop(air);
        thread::sleep(Duration::from_millis(2));
    }
    id
}

#[test]
fn a_link_that_is_lost_is_made_anew_and_no_step_is_lost_or_doubled() {
    let air = Arc::new(Mutex::new(Air { in_range: true, ..Air::default() }));
    let clock = HostClock::start();
    let mut adapter = Fake { air: air.clone(), stumbles: false };
    let open = move || {
        let line = connect(&mut adapter, &Wanted::Any, PATIENCE)?;
        Ok(Ends::from(pipe::ends(line)))
    };
    let mut connection = Connection::over(Transport::keeping(open, clock), clock);
    let walking = air.clone();
    let shoe = thread::spawn(move || walk(&walking));
    let (mut steps, mut closed, mut reasons) = (Vec::new(), 0, Vec::new());
    // Until the shoe knows that all have come.
    while !shoe.is_finished() {
        match connection.next(Duration::from_millis(20)) {
            Some(Happening::Event(Event::Step { boot, id, step })) => steps.push((boot, id, step)),
            Some(Happening::Event(Event::Gap { first, count, .. })) => panic!("{count} steps lost from {first} on"),
            Some(Happening::Closed(reason)) => {
                assert_eq!(reason, "the shoe is out of range, or off");
                closed += 1;
            }
            Some(Happening::Unreachable(reason)) => reasons.push(reason),
            _ => {}
        }
    }
    let made_in_all = shoe.join().unwrap();
    let expected: Vec<_> = (0..made_in_all).map(|id| (BOOT, id, PackedStep::pack(&made(id)))).collect();
    assert_eq!(steps, expected);
    let air = air.lock().unwrap();
    assert_eq!((closed, air.found), (3, 4));
    assert!(made_in_all >= 105 && air.failed > 0);
    // A short absence is over before the next try, a long one is not.
    assert!(reasons.iter().any(|reason| reason.contains("no shoe is in range")), "{reasons:?}");
}
