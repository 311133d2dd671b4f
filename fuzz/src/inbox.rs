//! Both ends of the wire and a bad line between them: no step is doubled, wrong or out of order, and none is lost but those
//! that the shoe had no room for, which are told as a gap.

use crate::script;
use crate::seeds::Seed;
use serde::{Deserialize, Serialize};
use sohle::link::session::{Event, Session};
use sohle_shared::calibration::Calibration;
use sohle_shared::time::Micros;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::frame::FRAME_MAX;
use sohle_shared::wire::link::{Identity, Link};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::port::Port;
use std::collections::VecDeque;

/// Steps that the shoe has room for.
const ROOM: usize = 16;
/// From one turn of the clock to the next. **Units:** microseconds.
const TURN_US: i64 = 5_000;
/// Turns on a clean line after which all steps must be there: a minute, of which the slowest repetition takes a few seconds.
const TURNS_CLEAN: usize = 12_000;

/// What becomes of the frames that are sent, one after the other.
#[derive(Clone, Copy, Serialize, Deserialize)]
enum Fate {
    Arrives,
    Lost,
    Doubled,
    /// Comes after so many others.
    Late(u8),
    /// A bit is another, and perhaps a second one.
    Damaged(u16, u16),
    /// A step is made before it arrives.
    StepMade,
    /// Nothing is sent for so many turns.
    Pause(u8),
    /// The laptop opens the line anew: what is on it is lost.
    Reopened,
    /// Arrives in two pieces, the second in the next turn.
    Halved,
}

/// What is on its way: after so many others, the bytes.
type Way = VecDeque<(u8, Vec<u8>)>;

struct Stage {
    link: Link<ROOM>,
    session: Session,
    now: Micros,
    to_shoe: Way,
    from_shoe: Way,
    fates: VecDeque<Fate>,
    made: u32,
    /// The next step that the laptop must hear of; before the first, whichever the shoe still has.
    next: Option<u32>,
    dropped: u32,
}

/// A step that tells its number in the index and in where it leads.
fn step(number: u32) -> PackedStep {
    let mut bytes = [0; 256];
    // Index, end of the stance, its duration, displacement, turn: all arrays of bytes, which may hold any number.
    let numbers = number.to_le_bytes().into_iter().chain(number.wrapping_mul(0x9E37_79B9).to_le_bytes().repeat(4));
    bytes.iter_mut().zip(numbers).for_each(|(place, byte)| *place = byte);
    let step: PackedStep = postcard::from_bytes(&bytes).expect("numbers and zeros are a step");
    // As one that was packed: bits that mean nothing are gone.
    PackedStep::pack(&step.unpack())
}

impl Stage {
    /// Puts a frame on its way.
    fn send(&mut self, frame: Vec<u8>, to_shoe: bool) {
        let mut after = 0;
        let mut copies = 1;
        let mut frame = frame;
        let mut rest = Vec::new();
        loop {
            match self.fates.pop_front().unwrap_or(Fate::Arrives) {
                Fate::Arrives => {}
                Fate::Lost => copies = 0,
                Fate::Doubled => copies = 2,
                Fate::Late(others) => after = others % 16,
                Fate::Damaged(one, other) => {
                    // A checksum finds up to three bits that are wrong, and many more might be another right one.
                    for bit in [one, other] {
                        let bit = usize::from(bit) % (8 * frame.len());
                        frame[bit / 8] ^= 1 << (bit % 8);
                    }
                }
                Fate::StepMade => {
                    self.make_step();
                    continue;
                }
                Fate::Pause(turns) => {
                    self.now = self.now + i64::from(turns) * TURN_US;
                    continue;
                }
                Fate::Reopened => {
                    self.from_shoe.clear();
                    self.to_shoe.clear();
                    self.session.reconnected();
                    return;
                }
                Fate::Halved => rest = frame.split_off(frame.len() / 2),
            }
            break;
        }
        let way = if to_shoe { &mut self.to_shoe } else { &mut self.from_shoe };
        for _ in 0..copies {
            way.push_back((after, frame.clone()));
        }
        if !rest.is_empty() {
            way.push_back((0, rest));
        }
    }

    fn make_step(&mut self) {
        self.link.push(&step(self.made).unpack());
        self.made += 1;
    }

    fn turn(&mut self) {
        let now = self.now;
        let mut buffer = [0; FRAME_MAX];
        if let Some(frame) = self.link.transmit(Port::Serial, now, &mut buffer).map(<[u8]>::to_vec) {
            self.send(frame, false);
        }
        let mut said = Vec::new();
        self.session.transmit(now, &mut said);
        // The laptop may say several things at once; they share the fate of one frame.
        if !said.is_empty() {
            self.send(said, true);
        }
        if let Some(bytes) = arrival(&mut self.from_shoe) {
            self.session.receive(&bytes, self.now);
        }
        if let Some(bytes) = arrival(&mut self.to_shoe) {
            self.link.receive(Port::Serial, &bytes, self.now);
        }
        while let Some(event) = self.session.event() {
            match event {
                Event::Step { boot, id, step: heard } => {
                    if self.next.is_none() {
                        self.dropped = id;
                    }
                    let next = self.next.unwrap_or(id);
                    assert_eq!((boot, id, heard), (1, next, step(id)), "each step comes once, in order, as it was");
                    self.next = Some(id + 1);
                }
                Event::Gap { first, count, .. } => {
                    if self.next.is_none() {
                        self.dropped = first;
                    }
                    assert_eq!(self.next.unwrap_or(first), first);
                    self.next = Some(first + count);
                    self.dropped += count;
                }
                Event::Refused(_) | Event::Rebooted { .. } => panic!("the shoe is the same all the time"),
                _ => {}
            }
        }
        assert!(self.next.unwrap_or(0) <= self.made);
        self.now = self.now + TURN_US;
    }
}

/// The bytes that arrive next: those whose time has come, else the first with one fewer to wait for.
fn arrival(way: &mut Way) -> Option<Vec<u8>> {
    let at = way.iter().position(|(after, _)| *after == 0);
    way.iter_mut().for_each(|(after, _)| *after = after.saturating_sub(1));
    way.remove(at?).map(|(_, bytes)| bytes)
}

/// A script of what becomes of frames. When it has ended, the line is clean.
pub fn run(data: &[u8]) {
    let identity = Identity { boot: 1, firmware: "fuzz", board: "none" };
    let outbox = Outbox::new(1, Pace::default());
    let fates = script::read(data).take(2_000).collect();
    let mut stage = Stage {
        link: Link::new(identity, &Parameters::default(), &Calibration::default(), outbox),
        session: Session::new(1, "fuzz"),
        now: Micros(0),
        to_shoe: Way::new(),
        from_shoe: Way::new(),
        fates,
        made: 0,
        next: None,
        dropped: 0,
    };
    while !stage.fates.is_empty() {
        stage.turn();
    }
    for _ in 0..TURNS_CLEAN {
        if stage.link.connected(Port::Serial) && stage.link.waiting(Port::Serial) == 0 {
            break;
        }
        stage.turn();
    }
    assert_eq!(
        (stage.link.waiting(Port::Serial), stage.next.unwrap_or(0)),
        (0, stage.made),
        "all have come on a clean line"
    );
    assert!(
        stage.dropped <= stage.link.counters(Port::Serial).steps_dropped,
        "only what the shoe had no room for is missing"
    );
}

/// A good line, one of each fault, and more steps than there is room for.
pub fn seeds() -> Vec<Seed> {
    use Fate::{Arrives, Damaged, Doubled, Halved, Late, Lost, Pause, Reopened, StepMade};
    let good = [[Arrives; 3], [StepMade, Arrives, Arrives], [StepMade, StepMade, Arrives]].concat();
    let bad =
        [Arrives, Lost, StepMade, Doubled, Late(3), Arrives, StepMade, Damaged(77, 78), Arrives, Halved, Pause(50)];
    let reopened = [Arrives, Arrives, StepMade, StepMade, Arrives, Reopened, StepMade, Lost, Lost, Arrives, Doubled];
    let full = [vec![Arrives; 4], vec![StepMade; 40], vec![Lost, Pause(255), StepMade, Arrives]].concat();
    vec![
        ("good", script::written(&good)),
        ("bad", script::written(&bad.repeat(4))),
        ("reopened", script::written(&reopened)),
        ("full", script::written(&full)),
    ]
}
