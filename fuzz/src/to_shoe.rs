//! The shoe: whatever is said to it, and whatever its sensor reads, it goes on, and says only what can be read.

use crate::line::{framed, framed_bytes, messages};
use crate::script;
use crate::seeds::Seed;
use serde::{Deserialize, Serialize};
use sohle_shared::bmx055::{Batch, Config};
use sohle_shared::calibration::Calibration;
use sohle_shared::selftest::Batches;
use sohle_shared::shoe::{Health, Shoe};
use sohle_shared::step::FloorMode;
use sohle_shared::time::Micros;
use sohle_shared::tracker::settings::SETTINGS;
use sohle_shared::tracker::{Order, Parameters};
use sohle_shared::wire::frame::FRAME_MAX;
use sohle_shared::wire::link::Identity;
use sohle_shared::wire::message::{Action, Command, FromShoe, LaptopHello, Level, Refusal, ToShoe, text};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::port::Port;
use sohle_shared::wire::transfer::{Item, Value};
use sohle_shared::wire::{PROTOCOL, SCHEMA};

/// Batches of a walk that an input may take: two strides.
const WALK_MOST: usize = 400;
/// Frames that the shoe may have to say at a time: steps, logs, raw messages.
const FRAMES_MOST: usize = 1_000;

/// What happens to the shoe.
#[derive(Serialize, Deserialize)]
enum Happening {
    /// Bytes come.
    Bytes(Vec<u8>),
    /// A frame comes with what may be a message.
    Frame(Vec<u8>),
    /// The laptop of a session says hello.
    Hello(u32),
    /// Any message.
    Say(ToShoe),
    /// A command of the session that said hello, with the next number.
    Command(Action),
    /// New parameters: the defaults, but for these settings.
    Parameters(Vec<(u8, f32)>),
    /// A new calibration.
    Calibration(Calibration),
    /// The sensor reads so many batches of a walk.
    Walk(u8),
    /// The sensor reads this.
    Sense(Batch),
    /// The board has kept a value, or not.
    Kept(bool),
    /// The board says how it is.
    Report,
    /// A line for the log.
    Log(String),
    /// The sensor sleeps, and wakes.
    Sleep,
    Wake,
    /// Time passes. **Units:** microseconds.
    Wait(u32),
    /// The line is ready for so many frames.
    Transmit(u8),
}

struct Stage {
    shoe: Shoe<16>,
    now: Micros,
    session: u32,
    number: u32,
    walk: std::iter::Take<Batches>,
}

impl Stage {
    fn new() -> Self {
        let identity = Identity { boot: 1, firmware: "fuzz", board: "none" };
        let outbox = Outbox::new(1, Pace::default());
        Self {
            shoe: Shoe::new(identity, &Config::default(), &Parameters::default(), &Calibration::default(), outbox),
            now: Micros(0),
            session: 0,
            number: 0,
            walk: Batches::new().take(WALK_MOST),
        }
    }

    fn hear(&mut self, bytes: &[u8]) {
        self.shoe.received(Port::Serial, bytes, self.now);
    }

    fn hello(&mut self, session: u32) {
        (self.session, self.number) = (session, 0);
        let hello = LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session, software: text("fuzz") };
        self.hear(&framed(&ToShoe::Hello(hello)));
    }

    fn command(&mut self, action: Action) {
        self.number += 1;
        let command = Command { session: self.session, number: self.number, action };
        self.hear(&framed(&ToShoe::Command(command)));
    }

    fn write(&mut self, item: Item, value: &Value) {
        let mut offset = 0;
        while let Ok(piece) = value.chunk(offset)
            && !piece.bytes.is_empty()
        {
            offset += piece.bytes.len() as u16;
            self.command(Action::Write(item, piece));
        }
    }

    /// What the shoe says, at most so many messages.
    fn transmit(&mut self, most: usize) -> Vec<FromShoe> {
        let mut said = Vec::new();
        for _ in 0..most {
            let mut buffer = [0; FRAME_MAX];
            let Some(frame) = self.shoe.transmit(Port::Serial, self.now, &mut buffer) else { return said };
            said.extend(messages(frame));
        }
        said
    }

    fn happen(&mut self, happening: Happening) {
        match happening {
            Happening::Bytes(bytes) => self.hear(&bytes),
            Happening::Frame(bytes) => self.hear(&framed_bytes(&bytes)),
            Happening::Hello(session) => self.hello(session),
            Happening::Say(message) => self.hear(&framed(&message)),
            Happening::Command(action) => self.command(action),
            Happening::Parameters(changes) => {
                let mut parameters = Parameters::default();
                for (index, value) in changes {
                    SETTINGS[usize::from(index) % SETTINGS.len()].set(&mut parameters, value);
                }
                self.write(Item::Parameters, &Value::Parameters(parameters));
            }
            Happening::Calibration(calibration) => self.write(Item::Calibration, &Value::Calibration(calibration)),
            Happening::Walk(batches) => {
                for batch in self.walk.by_ref().take(usize::from(batches)) {
                    self.shoe.sensed(&batch);
                    self.now = self.now.max(batch.stamp);
                }
            }
            Happening::Sense(batch) => self.shoe.sensed(&batch),
            Happening::Kept(well) => self.shoe.kept(if well { Ok(()) } else { Err(Refusal::Failed) }),
            Happening::Report => self.shoe.report(self.now, &Health::default()),
            Happening::Log(line) => self.shoe.log(self.now, Level::Info, &line),
            Happening::Sleep => self.shoe.fell_asleep(),
            Happening::Wake => self.shoe.woke(self.now),
            Happening::Wait(us) => self.now = self.now + i64::from(us),
            Happening::Transmit(frames) => self.transmit(usize::from(frames)).iter().for_each(check),
        }
        assert!(self.shoe.tracker().parameters().check().is_ok(), "settings in effect make sense");
        self.shoe.deadline(Port::Serial, self.now);
        self.shoe.drowsy();
    }
}

fn check(message: &FromShoe) {
    if let FromShoe::Attitude(attitude) = message {
        let numbers = attitude.attitude.iter().chain(&attitude.displacement).chain(&attitude.velocity);
        assert!(numbers.into_iter().all(|number| number.is_finite()), "{attitude:?}");
    }
    if let FromShoe::Step(sent) = message {
        let step = sent.step.unpack();
        let numbers = step.displacement.iter().chain(step.covariance.iter()).chain([&step.turn]);
        assert!(numbers.into_iter().all(|number| number.is_finite()), "{step:?}");
    }
}

/// A script of what happens to the shoe. Whatever it was, the shoe answers the hello that follows.
pub fn run(data: &[u8]) {
    let mut stage = Stage::new();
    script::read(data).for_each(|happening| stage.happen(happening));
    stage.transmit(FRAMES_MOST).iter().for_each(check);
    stage.hello(u32::MAX);
    let answered = stage.transmit(FRAMES_MOST);
    assert!(answered.iter().any(|said| matches!(said, FromShoe::Hello(hello) if hello.accepted)), "{answered:?}");
}

/// A laptop that connects, commands, writes and reads, and a walk.
pub fn seeds() -> Vec<Seed> {
    use Happening::{Bytes, Calibration as Calibrate, Command, Frame, Hello, Kept, Report, Say, Transmit, Wait, Walk};
    let walk = [Hello(1), Walk(200), Transmit(50), Command(Action::Resend), Walk(200), Report, Transmit(50)];
    let orders = [
        Hello(1),
        Command(Action::Order(Order::Init)),
        Walk(40),
        Command(Action::Order(Order::Track)),
        Command(Action::Order(Order::FloorMode(Some(FloorMode::Stairs)))),
        Walk(60),
        Command(Action::Raw(true)),
        Walk(20),
        Transmit(40),
        Command(Action::Raw(false)),
        Wait(1_000_000),
        Say(ToShoe::TimeRequest(3)),
        Transmit(9),
    ];
    let values = [
        Hello(2),
        Happening::Parameters(vec![(0, 1.5), (9, 0.25)]),
        Kept(true),
        Calibrate(Calibration::default()),
        Kept(false),
        Command(Action::Read(Item::Parameters, 0)),
        Command(Action::Read(Item::Calibration, 128)),
        Transmit(20),
    ];
    let bad =
        [Bytes(vec![0, 9, 1, 0]), Frame(vec![3, 1, 1, 4]), Hello(1), Frame(vec![9; 9]), Happening::Log("é".into())];
    let asleep =
        [Hello(1), Walk(30), Happening::Sleep, Wait(5_000_000), Report, Happening::Wake, Walk(30), Transmit(9)];
    vec![
        ("walk", script::written(&walk)),
        ("orders", script::written(&orders)),
        ("values", script::written(&values)),
        ("bad", script::written(&bad)),
        ("asleep", script::written(&asleep)),
    ]
}
