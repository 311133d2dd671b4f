//! The laptop's end of the wire: whatever a shoe says, steps come in the order of their numbers, without hole.

use crate::line::{framed, framed_bytes, messages};
use crate::script;
use crate::seeds::Seed;
use serde::{Deserialize, Serialize};
use sohle::link::session::{Event, Session};
use sohle_shared::time::Micros;
use sohle_shared::wire::message::{Action, FromShoe, Hello, SentStep, Status, TimeReply, ToShoe, text};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::{PROTOCOL, SCHEMA};
use std::collections::BTreeMap;

/// What happens to the laptop.
#[derive(Serialize, Deserialize)]
enum Happening {
    /// Bytes come.
    Bytes(Vec<u8>),
    /// A frame comes with what may be a message.
    Frame(Vec<u8>),
    /// Any message.
    Say(FromShoe),
    /// The shoe says hello, with its boot and whether it has accepted ours.
    Hello(u32, bool),
    /// A step: boot, number, number of the oldest.
    Step(u32, u32, u32),
    /// The question for the time is answered, and when it came and went.
    Time(Micros, Micros),
    /// Something is asked of the shoe.
    Command(Action),
    /// Time passes. **Units:** microseconds.
    Wait(u32),
    /// The line is opened anew.
    Reconnect,
    LeaveSteps,
}

struct Stage {
    session: Session,
    now: Micros,
    /// Number of the last question for the time.
    question: u32,
    /// The next step by boot.
    next: BTreeMap<u32, u32>,
}

impl Stage {
    fn hear(&mut self, bytes: &[u8]) {
        self.session.receive(bytes, self.now);
    }

    fn say(&mut self, message: &FromShoe) {
        self.hear(&framed(message));
    }

    fn hello(&mut self, boot: u32, accepted: bool) {
        let (firmware, board) = (text("fuzz"), text("none"));
        self.say(&FromShoe::Hello(Hello { protocol: PROTOCOL, schema: SCHEMA, boot, accepted, firmware, board }));
    }

    fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::Bytes(bytes) => self.hear(&bytes),
            Happening::Frame(bytes) => self.hear(&framed_bytes(&bytes)),
            Happening::Say(message) => self.say(&message),
            Happening::Hello(boot, accepted) => self.hello(boot, accepted),
            Happening::Step(boot, id, oldest) => self.say(&FromShoe::Step(SentStep { boot, id, oldest, step: step() })),
            Happening::Time(received, sent) => {
                let number = self.question;
                self.say(&FromShoe::TimeReply(TimeReply { number, received, sent }));
            }
            Happening::Command(action) => _ = self.session.command(action),
            Happening::Wait(us) => self.now = self.now + i64::from(us),
            Happening::Reconnect => self.session.reconnected(),
            Happening::LeaveSteps => self.session.leave_steps(),
        }
        self.events();
        let mut out = Vec::new();
        self.session.transmit(self.now, &mut out);
        for message in messages(&out) {
            if let ToShoe::TimeRequest(number) = message {
                self.question = number;
            }
        }
        assert!(self.session.deadline(self.now) >= self.now);
        self.session.clock().to_host(self.now);
        assert!(self.session.clock().drift().is_none_or(f64::is_finite));
        assert!(self.session.clock().error_bound().is_none_or(f64::is_finite));
    }

    /// Takes the events; whether one says that the shoe is connected.
    fn events(&mut self) -> bool {
        let mut connected = false;
        while let Some(event) = self.session.event() {
            let (boot, first, count) = match event {
                Event::Step { boot, id, .. } => (boot, id, 1),
                Event::Gap { boot, first, count } => (boot, first, count),
                // Long forgotten, it begins anew.
                Event::Rebooted { boot } => {
                    self.next.remove(&boot);
                    continue;
                }
                event => {
                    connected |= matches!(event, Event::Connected(_));
                    continue;
                }
            };
            let next = self.next.entry(boot).or_insert(first);
            assert_eq!((*next, count > 0), (first, true), "steps of boot {boot} are in order");
            *next = first.saturating_add(count);
        }
        connected
    }
}

fn step() -> PackedStep {
    postcard::from_bytes(&[0; 256]).expect("a step has no length that zeros could miss")
}

/// A script of what happens to the laptop. Whatever it was, it understands the hello that follows.
pub fn run(data: &[u8]) {
    let session = Session::new(1, "fuzz");
    let mut stage = Stage { session, now: Micros(0), question: 0, next: BTreeMap::new() };
    script::read(data).for_each(|happening| stage.happen(happening));
    stage.session.reconnected();
    stage.hello(u32::MAX, true);
    assert!(stage.events(), "a shoe that says hello is heard");
}

/// A shoe that connects, tells steps in and out of order, is rebooted, is of another version.
pub fn seeds() -> Vec<Seed> {
    use Happening::{Bytes, Command, Frame, Reconnect, Say, Step, Time, Wait};
    let hello = Happening::Hello;
    let steps =
        [hello(5, true), Step(5, 0, 0), Step(5, 2, 0), Step(5, 1, 0), Wait(30_000), Step(5, 9, 7), Step(5, 8, 8)];
    let clock = [
        hello(5, true),
        Wait(1_000),
        Time(Micros(77_000), Micros(77_100)),
        Wait(1_000_000),
        Time(Micros(1_077_000), Micros(1_077_050)),
        Say(FromShoe::Status(Status { asleep: true, ..Status::default() })),
        Wait(20_000_000),
    ];
    let boots =
        [hello(1, false), hello(1, true), Step(1, 3, 3), hello(2, true), Step(2, 0, 0), Reconnect, hello(1, true)];
    let bad = [
        Bytes(vec![0, 200, 1, 0]),
        Frame(vec![0, 1, 2, 3, 4, 5, 6, 7, 8, 9]),
        hello(1, true),
        Command(Action::Resend),
        Wait(400_000),
        Bytes(vec![0, 3, 1, 2, 0]),
        Bytes(vec![0, 3, 1, 3, 0]),
        Bytes(vec![0, 3, 5, 2, 0]),
        Happening::LeaveSteps,
    ];
    vec![
        ("steps", script::written(&steps)),
        ("clock", script::written(&clock)),
        ("boots", script::written(&boots)),
        ("bad", script::written(&bad)),
    ]
}
