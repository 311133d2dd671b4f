//! What is written is read back; what is damaged is told.

use super::write::CHUNK;
use super::*;
use crate::fixes::{Fix, Frame, Measured};
use crate::recording::heard::Heard;
use crate::recording::message::{Encoder, Message};
use crate::recording::truth::{TruthPose, TruthStance};
use crate::recording::{self, Recording, SensorRange, SimulatedTruth, table};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use nalgebra::{Matrix2, Matrix4, Vector3};
use proptest::prelude::*;
use proptest::sample::Index;
use sohle_shared::sample::{ClippedSamples, ImuSample};
use sohle_shared::step::{FloorMode, Step, StepQuality};
use sohle_shared::time::Micros;
use sohle_shared::wire::message::{FromShoe, Level, Log, text};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

fn sample(time: i64, value: f32) -> ImuSample {
    let mut sample = ImuSample::new(Micros(time), [value, -value, 9.81], [value * 0.1, 1e-30, -0.0]);
    sample.clipped.accel = value > 10.0;
    sample
}

fn pose(time: i64, value: f64) -> TruthPose {
    TruthPose {
        time: Micros(time),
        position: [value, value / 3.0, -0.0],
        velocity: [0.1, value, 1e-300],
        attitude: [0.6, 0.0, 0.8, 0.0],
        stance: value > 0.0,
    }
}

fn step(index: u32) -> Step {
    Step {
        index,
        stance_start: Micros(i64::from(index) * 1_000_000),
        stance_end: Micros(i64::from(index) * 1_000_000 + 300_000),
        displacement: Vector3::new(1.3, 0.01 * index as f32, -0.002),
        turn: 0.1,
        covariance: Matrix4::from_fn(|row, column| (row * 4 + column) as f32 * 1e-4),
        mode: FloorMode::Stairs,
        quality: StepQuality { gap: true, repaired: true, ..StepQuality::default() },
        clipped: ClippedSamples { accel: 513, gyro: 2 },
    }
}

fn fix(source: &str, floor: Option<i32>) -> Fix {
    let measured = Measured::Position { place: [9.99, 53.54], covariance: Matrix2::new(9.0, 1.0, 1.0, 4.0) };
    let [time, arrived] = [1_500_000, 3_500_000].map(Micros);
    Fix { time, arrived, source: source.into(), frame: Frame::Geographic, measured, floor }
}

/// A recording with everything in it.
fn full(count: i64) -> Recording {
    let stance =
        TruthStance { start: Micros(-5), end: Micros(300_000), position: [0.1, 0.2, 0.3], heading: -1.25, still: true };
    let samples: Vec<_> = (0..count).map(|index| sample(-2000 + index * 5000, index as f32 * 0.37)).collect();
    Recording {
        name: "a walk, \"quoted\"".into(),
        irregularities: table::irregularities(&samples),
        samples,
        range: SensorRange { accel: Some(156.906_4), gyro: Some(0.1 + 0.2) },
        truth: Some(SimulatedTruth {
            poses: (0..count).map(|index| pose(-2000 + index * 5000, index as f64 * 0.1)).collect(),
            stances: vec![stance, stance],
        }),
        steps: vec![step(0), step(1)],
        fixes: vec![fix("5g", Some(-1)), fix("uwb", None)],
        again: None,
        orders: Vec::new(),
        metadata: BTreeMap::from([("parameters".to_owned(), "gain = 0.1\n[stance]\n".to_owned())]),
    }
}

/// A folder and a full recording in it.
fn written(count: i64) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.mcap");
    write(&path, &full(count)).unwrap();
    (folder, path)
}

#[test]
fn everything_comes_back_bit_for_bit() {
    let (_folder, path) = written(30_000);
    let back = recording::open(&path, None).unwrap();
    assert_eq!(back, full(30_000));
    // `==` takes -0.0 for 0.0.
    assert!(back.samples.iter().all(|sample| sample.gyro.0.z.to_bits() == (-0.0_f32).to_bits()));
    assert_eq!(back.truth.unwrap().poses[3].position[2].to_bits(), (-0.0_f64).to_bits());
}

#[test]
fn the_same_recording_gives_the_same_bytes() {
    let ((_one, first), (_other, second)) = (written(3000), written(3000));
    assert_eq!(fs::read(first).unwrap(), fs::read(second).unwrap());
}

#[test]
fn nothing_is_left_of_a_recording_that_was_not_finished() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.mcap");
    fs::write(&path, "what was there before").unwrap();
    let mut writer = Writer::create(&path, "", SensorRange::default(), &BTreeMap::new()).unwrap();
    writer.sample(&sample(0, 1.0)).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    drop(writer);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(fs::read(&path).unwrap(), b"what was there before");
}

#[test]
fn a_live_recording_can_be_read_at_any_moment_of_its_making() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    let mut writer = Writer::live(&path, "live", &BTreeMap::new()).unwrap();
    let mut told = 0;
    for index in 0..6_000 {
        let log = Log { time: Micros(0), level: Level::Info, text: text("a line as long as lines are") };
        writer.heard(&Heard { time: Micros(index), message: FromShoe::Log(log) }).unwrap();
        writer.step(&step(index as u32)).unwrap();
        if index == 50 {
            writer.flush().unwrap();
        }
        if index >= 50 && index % 97 == 50 {
            // As a program leaves it that is killed now.
            let steps = read(File::open(&path).unwrap()).unwrap().steps.len();
            assert!(steps >= told && steps > 50, "{index}: {steps} after {told}");
            told = steps;
        }
    }
    assert!(told > 5_000, "{told}: chunks go out as they are full");
}

#[test]
fn a_recording_that_cannot_be_written_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let message = |path: &Path| write(path, &full(1)).unwrap_err().to_string();
    assert!(message(folder.path()).ends_with("is a directory, expected a recording"));
    assert!(message(&folder.path().join("none/walk.mcap")).ends_with("walk.mcap: no such file or directory"));
}

#[test]
fn a_file_cut_anywhere_tells_how_much_was_read() {
    let (_folder, path) = written(2000);
    let bytes = fs::read(&path).unwrap();
    let mut most = 0_usize;
    for length in (MAGIC.len()..bytes.len()).step_by(997).chain(bytes.len() - 40..bytes.len()) {
        let before = most;
        let message = read(&bytes[..length]).unwrap_err().to_string();
        let count = message.strip_prefix("truncated: the MCAP ends early, after ").unwrap();
        most = count.split(' ').next().unwrap().parse().unwrap();
        // Samples are read by chunks; one takes 38 bytes and 31 of its record.
        assert!(most >= before && most - before <= CHUNK as usize / 69 + 1, "{length}: {before} {most}");
    }
    assert_eq!(most, 2000);
}

#[test]
fn a_changed_byte_is_noticed_or_harmless() {
    let (_folder, path) = written(200);
    let bytes = fs::read(&path).unwrap();
    let expected = full(200);
    for (index, bits) in (MAGIC.len()..bytes.len()).flat_map(|index| [(index, 0x41), (index, 0x80), (index, 1)]) {
        let mut damaged = bytes.clone();
        damaged[index] ^= bits;
        if let Ok(recording) = read(damaged.as_slice()) {
            // Only the chunks, which hold every message, are protected by a checksum.
            assert_eq!(recording.samples, expected.samples, "byte {index}");
        }
    }
}

#[test]
fn the_mcap_of_another_program_is_refused_by_its_schemas() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().compression(None).create(&mut bytes).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/Imu", "ros2msg", b"").unwrap();
    let channel_id = writer.add_channel(schema, "/imu", "cdr", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, &[0, 1, 0, 0]).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let message = read(bytes.get_ref().as_slice()).unwrap_err().to_string();
    assert_eq!(message, "an MCAP without the schema sohle/msg/ImuSample; schemas in it: sensor_msgs/msg/Imu");
}

#[test]
fn another_version_of_a_schema_is_refused() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().compression(None).library("sohle 9.9").create(&mut bytes).unwrap();
    let schema = writer.add_schema(ImuSample::SCHEMA, SCHEMA_ENCODING, b"float64 time").unwrap();
    writer.add_channel(schema, ImuSample::TOPIC, MESSAGE_ENCODING, &BTreeMap::new()).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let message = read(bytes.get_ref().as_slice()).unwrap_err().to_string();
    assert!(message.ends_with("it was written by 'sohle 9.9'"), "{message}");
}

#[test]
fn an_mcap_takes_no_profile_and_needs_samples() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.mcap");
    write(&path, &Recording { steps: Vec::new(), ..full(0) }).unwrap();
    let message = recording::open(&path, None).unwrap_err().to_string();
    assert!(message.ends_with("no samples: no message on /imu"), "{message}");
    let message = recording::open(&path, Some(&recording::Preset::Xio.into())).unwrap_err().to_string();
    assert!(message.ends_with("it takes no profile"), "{message}");
}

/// What a sample would be in JSON.
#[derive(serde::Serialize)]
struct Json {
    time_us: i64,
    accel: [f32; 3],
    gyro: [f32; 3],
    accel_clipped: bool,
    gyro_clipped: bool,
}

impl Json {
    fn of(sample: &ImuSample) -> Self {
        let (accel, gyro) = (sample.accel.0.into(), sample.gyro.0.into());
        Self { time_us: sample.time.0, accel, gyro, accel_clipped: false, gyro_clipped: false }
    }
}

#[test]
fn the_encoding_is_small() {
    let Some(folder) = recording::recordings_dir() else { return };
    let walk = recording::open(&folder.join("foot_koroglu_gcp/exp31_imu.csv"), None).unwrap();
    let mut buffer = Encoder::default();
    let cdr: usize = walk.samples.iter().map(|sample| sample.encode(&mut buffer).len()).sum();
    let json: usize = walk.samples.iter().map(|sample| serde_json::to_string(&Json::of(sample)).unwrap().len()).sum();
    println!("{} samples: CDR {cdr} bytes, JSON {json} bytes", walk.samples.len());
    assert_eq!(cdr, 38 * walk.samples.len());
    assert!(json > 3 * cdr, "JSON {json} bytes, CDR {cdr} bytes");
}

proptest! {
    #[test]
    fn a_file_with_some_changed_words_is_no_panic(words in proptest::collection::vec((any::<Index>(), any::<u32>()), 1..5)) {
        // Without checksums, so that the damage gets through to what reads the records.
        let mut bytes = std::io::Cursor::new(Vec::new());
        let options = WriteOptions::new().compression(None).calculate_chunk_crcs(false);
        let mut writer = options.create(&mut bytes).unwrap();
        let schema = writer.add_schema(ImuSample::SCHEMA, SCHEMA_ENCODING, ImuSample::DEFINITION.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, ImuSample::TOPIC, MESSAGE_ENCODING, &BTreeMap::new()).unwrap();
        let mut buffer = Encoder::default();
        for sequence in 0..5 {
            let header = MessageHeader { channel_id, sequence, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, sample(0, 1.0).encode(&mut buffer)).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let mut bytes = bytes.into_inner();
        for (at, word) in words {
            let at = at.index(bytes.len() - 4);
            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        }
        // Either answer is right.
        let _ = read(bytes.as_slice());
    }

    #[test]
    fn arbitrary_bytes_are_an_error_and_no_panic(bytes in proptest::collection::vec(any::<u8>(), 0..4000)) {
        prop_assert!(read(bytes.as_slice()).is_err());
        prop_assert!(read([MAGIC, &bytes].concat().as_slice()).is_err());
    }

    #[test]
    fn any_bits_of_a_sample_come_back(time: i64, bits: [u32; 6], accel: bool, gyro: bool) {
        let values = bits.map(f32::from_bits);
        let [ax, ay, az, gx, gy, gz] = values;
        let mut sample = ImuSample::new(Micros(time), [ax, ay, az], [gx, gy, gz]);
        sample.clipped = sohle_shared::sample::Clipped { accel, gyro };
        let mut buffer = Encoder::default();
        let back = ImuSample::decode(sample.encode(&mut buffer)).unwrap();
        prop_assert_eq!((back.time, back.clipped), (sample.time, sample.clipped));
        let back = [back.accel.0.x, back.accel.0.y, back.accel.0.z, back.gyro.0.x, back.gyro.0.y, back.gyro.0.z];
        prop_assert_eq!(back.map(f32::to_bits), bits);
    }
}
