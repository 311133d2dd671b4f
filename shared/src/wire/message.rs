//! Everything that shoe and laptop say to each other.
//!
//! Plain numbers, arrays and texts of bounded length. The first message of either side is its hello, whose layout must
//! never change: it is what ends of different versions still understand of each other.

use super::frame::FrameCounters;
use super::packed::PackedStep;
use super::transfer::{Chunk, Item};
use crate::bmx055::{Batch, Config, DieCounters};
use crate::time::Micros;
use crate::tracker::{Counters, Order, State};
use heapless::String;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// As much of `text` as fits, cut between characters.
pub fn text<const N: usize>(text: &str) -> String<N> {
    let mut cut = String::new();
    for character in text.chars() {
        if cut.push(character).is_err() {
            break;
        }
    }
    cut
}

/// What the shoe says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum FromShoe {
    /// Who it is. Stays the first.
    Hello(Hello),
    /// A finished step; it is repeated until it is acknowledged.
    Step(SentStep),
    /// The answer to a command.
    Reply(Reply),
    /// The answer to a [`ToShoe::TimeRequest`].
    TimeReply(TimeReply),
    /// What went into the tracker.
    Raw(Raw),
    /// Where the foot is.
    Attitude(Attitude),
    /// How the shoe is.
    Status(Status),
    /// A line for the log.
    Log(Log),
}

/// What the laptop says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum ToShoe {
    /// Who it is. Stays the first.
    Hello(LaptopHello),
    /// Which steps have come.
    Ack(Ack),
    /// Asks for the time; the number comes back in the reply.
    TimeRequest(u32),
    /// Asks for something to be done.
    Command(Command),
}

/// The shoe's greeting: every second until it is answered, and in answer to the laptop's.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello {
    /// [`super::PROTOCOL`].
    pub protocol: u16,
    /// [`super::SCHEMA`].
    pub schema: u64,
    /// Differs from boot to boot.
    pub boot: u32,
    /// The shoe has heard a hello of its own protocol and schema since its boot.
    pub accepted: bool,
    /// Version of the firmware.
    pub firmware: String<24>,
    /// What it runs on.
    pub board: String<16>,
}

/// The laptop's greeting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LaptopHello {
    /// [`super::PROTOCOL`].
    pub protocol: u16,
    /// [`super::SCHEMA`].
    pub schema: u64,
    /// Differs from one run of the program to the next, so that its commands are not taken for those of an earlier run.
    pub session: u32,
    /// Version of the program.
    pub software: String<24>,
}

/// A step on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SentStep {
    /// The boot it belongs to.
    pub boot: u32,
    /// Counts up by one with each step since the boot.
    pub id: u32,
    /// The oldest step that the shoe still has; those before it are acknowledged or lost.
    pub oldest: u32,
    /// The step.
    pub step: PackedStep,
}

/// Which steps have come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Ack {
    /// The boot they belong to.
    pub boot: u32,
    /// All steps before this one have come; this one has not.
    pub next: u32,
    /// Bit `i` stands for step `next + 1 + i`.
    pub later: u64,
}

/// Both clocks of the shoe that a round trip needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TimeReply {
    /// The number of the request.
    pub number: u32,
    /// When the request came.
    pub received: Micros,
    /// When the reply went.
    pub sent: Micros,
}

/// Everything that went into the tracker, in its order, since the laptop asked for it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Raw {
    /// Counts up from 0, which is the [`RawItem::Start`]; a jump tells how many were lost.
    pub number: u32,
    /// What went in.
    pub item: RawItem,
}

/// One thing that went into the tracker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no heap on the shoe, and nearly all are batches")]
pub enum RawItem {
    /// The tracker was reset, so that what follows leads to the same steps again.
    Start(Config),
    /// What the sensor read.
    Batch(Batch),
    /// What the laptop commanded.
    Order(Order),
}

/// The state of the tracker, often enough to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Attitude {
    /// Time of the sample.
    pub time: Micros,
    /// RESET, INIT, TRACKING.
    pub state: State,
    /// The foot stands.
    pub stance: bool,
    /// Unit quaternion w, x, y, z. **Frame:** from the sensor to the heading frame of the last stance.
    pub attitude: [f32; 4],
    /// Since the last step. **Units:** m; **Frame:** heading frame of the last stance.
    pub displacement: [f32; 3],
    /// **Units:** m/s; **Frame:** heading frame of the last stance.
    pub velocity: [f32; 3],
}

/// What the shoe's end of the wire has counted since the boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LinkCounters {
    /// Frames of the laptop.
    pub frames: FrameCounters,
    /// Steps sent again.
    pub steps_resent: u32,
    /// Steps that gave way to newer ones before they were acknowledged.
    pub steps_dropped: u32,
    /// Other messages that were not sent, because the line was busy.
    pub messages_dropped: u32,
}

/// Why the processor started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetReason {
    /// Not known.
    #[default]
    Unknown,
    /// The power came.
    PowerOn,
    /// The supply voltage had been too low.
    BrownOut,
    /// The reset pin.
    Pin,
    /// The program asked for it.
    Software,
    /// The watchdog.
    Watchdog,
}

/// How the shoe is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// When this was so.
    pub time: Micros,
    /// RESET, INIT, TRACKING.
    pub state: State,
    /// Time the processor was busy since the status before. **Units:** 1/1000.
    pub load: u16,
    /// Longest time from a FIFO's interrupt to its samples being through the tracker, since the status before. **Units:**
    /// microseconds.
    pub lateness_us: u32,
    /// Of the sensor. **Units:** °C.
    pub temperature: Option<f32>,
    /// **Units:** V.
    pub battery: Option<f32>,
    /// Largest depth of the stack since the boot. **Units:** bytes.
    pub stack: u32,
    /// Why the processor started.
    pub reset: ResetReason,
    /// The sensor sleeps until the foot moves or a command comes; a status is rare then.
    pub asleep: bool,
    /// Times the sensor was put to sleep since the boot.
    pub sleeps: u16,
    /// Steps that wait for their acknowledgement.
    pub waiting: u16,
    /// Accelerometer.
    pub accel: DieCounters,
    /// Gyroscope.
    pub gyro: DieCounters,
    /// The tracker.
    pub tracker: Counters,
    /// The wire.
    pub link: LinkCounters,
}

impl Status {
    /// The one whose message is longest: a buffer for a status must hold it.
    pub const fn longest() -> Self {
        const MOST: u32 = u32::MAX;
        let die = DieCounters {
            frames: MOST,
            overruns: MOST,
            invalid_frames: MOST,
            missed_interrupts: MOST,
            bus_errors: MOST,
            bad_ids: MOST,
            readback_errors: MOST,
            restarts: MOST,
        };
        let tracker = Counters {
            samples: u64::MAX,
            not_finite: MOST,
            repeated: MOST,
            backwards: MOST,
            gaps: MOST,
            accel_clipped: MOST,
            gyro_clipped: MOST,
            repaired: MOST,
            restarts: MOST,
        };
        let frames = FrameCounters { good: MOST, stuffing: MOST, checksum: MOST, too_long: MOST, unknown: MOST };
        let link = LinkCounters { frames, steps_resent: MOST, steps_dropped: MOST, messages_dropped: MOST };
        Self {
            time: Micros(i64::MIN),
            state: State::Tracking,
            load: u16::MAX,
            lateness_us: MOST,
            temperature: Some(f32::MAX),
            battery: Some(f32::MAX),
            stack: MOST,
            reset: ResetReason::PowerOn,
            asleep: true,
            sleeps: u16::MAX,
            waiting: u16::MAX,
            accel: die,
            gyro: die,
            tracker,
            link,
        }
    }
}

/// How much a line of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, Schema)]
pub enum Level {
    /// Something failed.
    Error,
    /// Something is not as it should be.
    Warn,
    /// Something happened.
    Info,
    /// For who looks for a fault.
    Debug,
}

/// A line for the log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Log {
    /// When it was written.
    pub time: Micros,
    /// How much it matters.
    pub level: Level,
    /// The line.
    pub text: String<120>,
}

/// A command with its number. It is carried out once, however often it comes, and answered each time it comes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Command {
    /// The session of the laptop's hello.
    pub session: u32,
    /// Counts up by one with each command of the session.
    pub number: u32,
    /// What to do.
    pub action: Action,
}

/// What the laptop may ask for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Action {
    /// Something for the tracker.
    Order(Order),
    /// Send [`Raw`] messages, or stop. To begin with, the tracker is reset.
    Raw(bool),
    /// A piece of a new value; the last one puts it into effect.
    Write(Item, Chunk),
    /// The piece of the value in effect that begins at this byte.
    Read(Item, u16),
    /// Send all unacknowledged steps again now.
    Resend,
    /// Let other devices pair by Bluetooth for so long. Only over the serial line: who has it has the shoe at hand.
    /// **Units:** s.
    Pair(u16),
}

/// The one answer to a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Reply {
    /// Of the command.
    pub session: u32,
    /// Of the command.
    pub number: u32,
    /// What became of it.
    pub outcome: Outcome,
}

/// What became of a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Outcome {
    /// It was carried out.
    Done,
    /// It was not, and nothing changed.
    Refused(Refusal),
    /// A piece of a value.
    Piece(Chunk),
}

/// Why a command was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// This firmware cannot do it.
    Unsupported,
    /// Not in the present state.
    NotNow,
    /// It was tried and failed.
    Failed,
    /// The piece does not follow the one before: the next one begins at this byte.
    Piece(u16),
    /// The value is longer than the shoe can take.
    TooLong,
    /// The checksum of the value is that of other bytes.
    Checksum,
    /// The bytes are no such value of this version, or its numbers make no sense.
    Value,
    /// Not by this way: only over the serial line.
    Port,
}
