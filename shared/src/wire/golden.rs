//! The bytes of every message as a text that is committed: a change of the wire shows in a diff.

use super::frame::{FRAME_MAX, FrameCounters, encode};
use super::message::*;
use super::packed::PackedStep;
use super::transfer::{self, Item};
use super::{PROTOCOL, SCHEMA};
use crate::bmx055::{BATCH_FRAMES, Batch, Config, Die, DieCounters};
use crate::sample::ClippedSamples;
use crate::step::{FloorMode, Step, StepQuality};
use crate::time::Micros;
use crate::tracker::{Counters, Order, State};
use nalgebra::{Matrix4, Vector3};
use serde::Serialize;
use std::fmt::{Debug, Write};
use std::string::{String, ToString};
use std::vec::Vec;

pub(super) fn step() -> Step {
    Step {
        index: 1_204,
        stance_start: Micros(3_600_000_000),
        stance_end: Micros(3_600_430_500),
        displacement: Vector3::new(1.345, -0.02, 0.17),
        turn: -0.3,
        covariance: Matrix4::new(
            4e-5, 1e-6, 0.0, 0.0, 1e-6, 9e-5, 0.0, 2e-5, 0.0, 0.0, 1e-5, 0.0, 0.0, 2e-5, 0.0, 1e-5,
        ),
        mode: FloorMode::Stairs,
        quality: StepQuality { gyro_clipped: true, weak_stance: true, ..StepQuality::default() },
        clipped: ClippedSamples { accel: 0, gyro: 17 },
    }
}

fn hello() -> Hello {
    let (firmware, board) = (text("0.1.0"), text("stm32wb55"));
    Hello { protocol: PROTOCOL, schema: SCHEMA, boot: 0x1234_5678, accepted: true, firmware, board }
}

fn laptop_hello() -> LaptopHello {
    LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session: 0x9abc_def0, software: text("0.1.0") }
}

fn sent() -> SentStep {
    SentStep { boot: 0x1234_5678, id: 1_300, oldest: 1_299, step: PackedStep::pack(&step()) }
}

fn raw(frame: [i16; 3]) -> Raw {
    let frames = [frame; BATCH_FRAMES].into_iter().collect();
    let (sequence, stamp) = (640_000, Micros(320_000_250));
    let batch = Batch { die: Die::Gyro, sequence, stamp, lost: true, temperature: Some(17), frames };
    Raw { number: 70_000, item: RawItem::Batch(batch) }
}

fn attitude() -> Attitude {
    Attitude {
        time: Micros(3_600_430_500),
        state: State::Tracking,
        stance: true,
        attitude: [0.6, 0.0, -0.8, 0.0],
        displacement: [0.25, 0.5, -1.0],
        velocity: [2.0, 0.0, 0.125],
    }
}

fn status() -> Status {
    Status {
        time: Micros(60_000_000),
        state: State::Init,
        load: 315,
        lateness_us: 12_000,
        temperature: Some(31.5),
        battery: None,
        stack: 9_872,
        reset: ResetReason::Watchdog,
        asleep: true,
        sleeps: 12,
        waiting: 3,
        accel: DieCounters {
            frames: 120_000,
            overruns: 1,
            invalid_frames: 2,
            missed_interrupts: 3,
            bus_errors: 4,
            bad_ids: 5,
            readback_errors: 6,
            restarts: 7,
        },
        gyro: DieCounters { frames: 119_980, ..DieCounters::default() },
        tracker: Counters { samples: 119_980, gaps: 1, gyro_clipped: 61, ..Counters::default() },
        link: LinkCounters {
            frames: FrameCounters { good: 70, stuffing: 1, checksum: 2, too_long: 3, unknown: 4 },
            steps_resent: 5,
            steps_dropped: 0,
            messages_dropped: 6,
        },
    }
}

fn log() -> Log {
    Log { time: Micros(1_500), level: Level::Warn, text: text("gyroscope: FIFO overrun") }
}

fn reply(outcome: Outcome) -> FromShoe {
    FromShoe::Reply(Reply { session: 0x9abc_def0, number: 7, outcome })
}

fn command(action: Action) -> ToShoe {
    ToShoe::Command(Command { session: 0x9abc_def0, number: 7, action })
}

fn piece() -> transfer::Chunk {
    let bytes = core::array::from_fn::<u8, { transfer::CHUNK_MAX }, _>(|at| at as u8);
    transfer::Chunk {
        total: 300,
        checksum: 0x89ab_cdef,
        offset: 128,
        bytes: heapless::Vec::from_slice(&bytes).unwrap(),
    }
}

/// One message of every kind.
fn from_shoe() -> Vec<FromShoe> {
    std::vec![
        FromShoe::Hello(hello()),
        FromShoe::Step(sent()),
        reply(Outcome::Done),
        reply(Outcome::Refused(Refusal::Piece(128))),
        reply(Outcome::Refused(Refusal::Port)),
        reply(Outcome::Piece(piece())),
        FromShoe::TimeReply(TimeReply { number: 9, received: Micros(1_000_000), sent: Micros(1_000_400) }),
        FromShoe::Raw(Raw { number: 0, item: RawItem::Start(Config::default()) }),
        FromShoe::Raw(raw([0, -12, 2_040])),
        FromShoe::Raw(Raw { number: 1, item: RawItem::Order(Order::FloorMode(Some(FloorMode::Stairs))) }),
        FromShoe::Attitude(attitude()),
        FromShoe::Status(status()),
        FromShoe::Log(log()),
    ]
}

/// One message of every kind.
fn to_shoe() -> Vec<ToShoe> {
    std::vec![
        ToShoe::Hello(laptop_hello()),
        ToShoe::Ack(Ack { boot: 0x1234_5678, next: 1_300, later: 0b101 }),
        ToShoe::TimeRequest(9),
        command(Action::Order(Order::Reset)),
        command(Action::Order(Order::Init)),
        command(Action::Order(Order::Track)),
        command(Action::Order(Order::FloorMode(None))),
        command(Action::Order(Order::FloorMode(Some(FloorMode::Elevator)))),
        command(Action::Raw(true)),
        command(Action::Write(Item::Parameters, piece())),
        command(Action::Read(Item::Calibration, 256)),
        command(Action::Resend),
        command(Action::Pair(60)),
    ]
}

fn length<M: Serialize>(message: &M) -> usize {
    encode(message, &mut [0; FRAME_MAX]).unwrap().len()
}

#[test]
fn the_bytes_of_every_message_are_as_they_were() {
    fn write<M: Serialize + Debug>(text: &mut String, message: &M) {
        let mut buffer = [0; FRAME_MAX];
        let frame = encode(message, &mut buffer).unwrap();
        let name: String = std::format!("{message:?}").chars().take(60).collect();
        writeln!(text, "{name}: {} bytes", frame.len()).unwrap();
        for line in frame.chunks(48) {
            let hex: Vec<_> = line.iter().map(|byte| std::format!("{byte:02x}")).collect();
            writeln!(text, "    {}", hex.concat()).unwrap();
        }
    }
    let mut text = String::new();
    from_shoe().iter().for_each(|message| write(&mut text, message));
    to_shoe().iter().for_each(|message| write(&mut text, message));
    insta::assert_snapshot!(text.to_string());
}

#[test]
fn the_longest_messages_fit_their_buffers() {
    let longest = |n| core::iter::repeat_n('x', n).collect::<String>();
    let far = Micros(i64::MIN);
    let mut farthest = raw([i16::MIN; 3]);
    farthest.number = u32::MAX;
    if let RawItem::Batch(batch) = &mut farthest.item {
        (batch.sequence, batch.stamp) = (u32::MAX, far);
    }
    let messages = [
        FromShoe::Hello(Hello {
            protocol: u16::MAX,
            schema: u64::MAX,
            boot: u32::MAX,
            accepted: true,
            firmware: text(&longest(99)),
            board: text(&longest(99)),
        }),
        FromShoe::Step(SentStep { boot: u32::MAX, id: u32::MAX, oldest: u32::MAX, ..sent() }),
        reply(Outcome::Piece(transfer::Chunk {
            total: u16::MAX,
            checksum: u32::MAX,
            offset: u16::MAX,
            bytes: heapless::Vec::from_slice(&[0xff; transfer::CHUNK_MAX]).unwrap(),
        })),
        FromShoe::Raw(farthest),
        FromShoe::Attitude(Attitude { time: far, ..attitude() }),
        FromShoe::Status(Status::longest()),
        FromShoe::Log(Log { time: far, text: text(&longest(999)), ..log() }),
    ];
    for message in &messages {
        let mut buffer = [0; FRAME_MAX];
        let mut frame = encode(message, &mut buffer).unwrap();
        assert_eq!(super::frame::AnyDecoder::new().next(&mut frame), Some(Ok(message.clone())));
    }
    let mut buffer = [0; FRAME_MAX];
    let longest = command(Action::Write(
        Item::Calibration,
        transfer::Chunk {
            total: u16::MAX,
            checksum: u32::MAX,
            offset: u16::MAX,
            bytes: heapless::Vec::from_slice(&[0xff; transfer::CHUNK_MAX]).unwrap(),
        },
    ));
    let mut frame = encode(&longest, &mut buffer).unwrap();
    assert_eq!(super::link::ToShoeDecoder::new().next(&mut frame), Some(Ok(longest)));
}

#[test]
fn everything_at_once_fits_the_line() {
    // Both dies at 2 kHz with the largest counts, 20 attitudes, a status, a time reply and 10 lines of the log in a
    // second, while old steps are sent as fast as they may be.
    let raw = 2.0 * 2_000.0 / BATCH_FRAMES as f64 * length(&FromShoe::Raw(raw([i16::MIN; 3]))) as f64;
    let steps = 200.0 * length(&FromShoe::Step(sent())) as f64;
    let rest = 20.0 * length(&FromShoe::Attitude(attitude())) as f64 + 1_500.0;
    // A byte is ten bits: a start and a stop bit.
    let load = (raw + steps + rest) * 10.0 / 921_600.0;
    assert!((0.4..0.7).contains(&load), "{load}");
    // Walking, without raw counts: a step in a second.
    let walking = (rest + length(&FromShoe::Step(sent())) as f64) * 10.0 / 115_200.0;
    assert!(walking < 0.4, "{walking}: a slow line carries it too");
}
