//! The project's own recordings: MCAP files, written as a stream and read back bit for bit.
//!
//! # What is inside
//! One channel for each kind of [message](super::message): `/imu`, and where known `/truth/pose`, `/truth/stance`,
//! `/step`; `/fix` for [what other sources said](super::fix) of the place; of a live walk also `/shoe`, which holds every
//! [message of the shoe](super::heard); of a walk that was followed in a building also what [viewers show](super::scene) of it. Their schemas are
//! `ros2msg` text, their messages CDR. The record of metadata `sohle` holds name, sensor range and version; the record
//! `about` whatever the writer had to say (parameters, seeds, origin). Nothing is compressed: the decoders of MCAP's
//! compressions are C code.
//!
//! # Why CDR
//! JSON, MCAP's other self-describing encoding without a code generator, takes 138 bytes for a sample of the surveyed
//! walk 31 against 38 (3.6 times; 2.2 times in the file, where a message brings 47 bytes of header and index) and must be
//! parsed digit by digit; a packed binary of our own would be four bytes smaller but could be shown by nobody else. CDR with a
//! `ros2msg` schema is understood by the viewers of MCAP without a plug-in. The messages are fixed sequences of numbers,
//! so no library is needed for it. The test `the_encoding_is_small` measures the sizes.

use super::error::{Problem, RecordingError};
use super::heard::Heard;
use super::message::{Encoder, Message};
use super::scene::{self, Lines, Moment, Shown};
use super::truth::{TruthPose, TruthStance};
use super::{Recording, SensorRange, live, table};
use crate::fixes::Fix;
use mcap::records::{ChunkHeader, MessageHeader, Metadata, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, WriteOptions};
use sohle_shared::sample::ImuSample;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Read};
use std::path::{Path, PathBuf};

/// The first bytes of every MCAP file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

const SCHEMA_ENCODING: &str = "ros2msg";
const MESSAGE_ENCODING: &str = "cdr";
/// Longer records are no recording of ours but a damaged length. **Units:** bytes.
const LONGEST_RECORD: usize = 64 << 20;
/// Messages are collected in chunks of this size; those of the last chunk are lost when the power fails. **Units:** bytes.
const CHUNK: u64 = 1 << 16;
/// Names of the records of metadata.
const OWN: &str = "sohle";
const ABOUT: &str = "about";

/// Writes a recording one item at a time, in any order. The file appears under its name when [`Writer::finish`] has
/// succeeded; until then it is `NAME.part`, and it is removed if the writer is dropped before.
pub struct Writer {
    /// `None` once finished.
    inner: Option<mcap::Writer<BufWriter<File>>>,
    part: PathBuf,
    target: PathBuf,
    /// What was written is worth keeping though the end is missing.
    live: bool,
    /// Channel of each schema and the number of messages on it.
    channels: BTreeMap<&'static str, (u16, u32)>,
    buffer: Encoder,
}

impl Writer {
    /// Begins a recording at `target`, in place of a file that is there.
    pub fn create(
        target: &Path,
        name: &str,
        range: SensorRange,
        about: &BTreeMap<String, String>,
    ) -> Result<Self, RecordingError> {
        let fail = |problem| RecordingError { path: target.into(), problem };
        if target.is_dir() {
            return Err(fail(Problem::Directory));
        }
        let mut part = target.as_os_str().to_owned();
        part.push(".part");
        Self::begin_at(PathBuf::from(part), target, name, range, about, false)
    }

    /// Begins the recording of something that happens now. It has its name from the start and stays if the writer is
    /// dropped; what was written before the last [`Writer::flush`] can be read however it ends.
    pub fn live(target: &Path, name: &str, about: &BTreeMap<String, String>) -> Result<Self, RecordingError> {
        let mut about = about.clone();
        about.insert(WIRE_SCHEMA.into(), wire_schema());
        Self::begin_at(target.into(), target, name, SensorRange::default(), &about, true)
    }

    fn begin_at(
        part: PathBuf,
        target: &Path,
        name: &str,
        range: SensorRange,
        about: &BTreeMap<String, String>,
        live: bool,
    ) -> Result<Self, RecordingError> {
        let fail = |problem| RecordingError { path: target.into(), problem };
        let file = File::create(&part).map_err(|error| fail(error.into()))?;
        let mut writer = Self {
            inner: None,
            part,
            target: target.into(),
            live,
            channels: BTreeMap::new(),
            buffer: Encoder::default(),
        };
        let options = WriteOptions::new()
            .compression(None)
            .chunk_size(Some(CHUNK))
            // Whoever is killed in the middle of a chunk leaves none of it, instead of one without its length.
            .disable_seeking(live)
            .profile("ros2")
            .library(concat!("sohle ", env!("CARGO_PKG_VERSION")));
        writer.inner = Some(options.create(BufWriter::new(file)).map_err(|error| fail(problem(error)))?);
        writer.begin(name, range, about).map_err(|error| fail(problem(error)))?;
        Ok(writer)
    }

    fn begin(&mut self, name: &str, range: SensorRange, about: &BTreeMap<String, String>) -> Result<(), McapError> {
        let mut own = BTreeMap::from([
            ("name".to_owned(), name.to_owned()),
            ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ]);
        own.extend(range.accel.map(|end| ("accel_range_m_s2".to_owned(), end.to_string())));
        own.extend(range.gyro.map(|end| ("gyro_range_rad_s".to_owned(), end.to_string())));
        let inner = self.inner.as_mut().ok_or(McapError::AttemptedWriteAfterFailure)?;
        inner.write_metadata(&Metadata { name: OWN.into(), metadata: own })?;
        inner.write_metadata(&Metadata { name: ABOUT.into(), metadata: about.clone() })?;
        // Even a recording without samples is recognised as ours.
        self.channel::<ImuSample>().map(|_| ())
    }

    /// Adds to what was said about the recording when it began.
    pub fn about(&mut self, about: &BTreeMap<String, String>) -> Result<(), RecordingError> {
        self.whole(|inner| inner.write_metadata(&Metadata { name: ABOUT.into(), metadata: about.clone() }))
    }

    /// Appends a message of the shoe.
    pub fn heard(&mut self, heard: &Heard) -> Result<(), RecordingError> {
        self.message(heard)
    }

    /// Hands everything so far to the system.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.whole(mcap::Writer::flush)
    }

    fn whole<T>(
        &mut self,
        work: impl FnOnce(&mut mcap::Writer<BufWriter<File>>) -> Result<T, McapError>,
    ) -> Result<T, RecordingError> {
        let done = self.inner.as_mut().ok_or(McapError::AttemptedWriteAfterFailure).and_then(work);
        done.map_err(|error| RecordingError { path: self.target.clone(), problem: problem(error) })
    }

    /// Appends a sample.
    pub fn sample(&mut self, sample: &ImuSample) -> Result<(), RecordingError> {
        self.message(sample)
    }

    /// Appends a pose of the truth.
    pub fn pose(&mut self, pose: &TruthPose) -> Result<(), RecordingError> {
        self.message(pose)
    }

    /// Appends a stance of the truth.
    pub fn stance(&mut self, stance: &TruthStance) -> Result<(), RecordingError> {
        self.message(stance)
    }

    /// Appends a step.
    pub fn step(&mut self, step: &Step) -> Result<(), RecordingError> {
        self.message(step)
    }

    /// Appends what another source said of the place.
    pub fn fix(&mut self, fix: &Fix) -> Result<(), RecordingError> {
        self.message(fix)
    }

    /// Appends the plan of a building, for viewers.
    pub fn building(&mut self, lines: &[Lines], time: Micros) -> Result<(), RecordingError> {
        self.shown(&scene::building(lines, time), time)
    }

    /// Appends what was said after a step, for viewers.
    pub fn moment(&mut self, moment: &Moment) -> Result<(), RecordingError> {
        if let Some(place) = &moment.place {
            self.shown(&scene::place(place, moment.time), moment.time)?;
        }
        self.shown(&scene::cloud(&moment.particles, moment.time), moment.time)?;
        let channel = self.whole(|inner| inner.add_channel(0, scene::LINE_TOPIC, "json", &BTreeMap::new()))?;
        self.write_to(channel, 0, moment.time, moment.line.as_bytes())
    }

    fn shown(&mut self, shown: &Shown, time: Micros) -> Result<(), RecordingError> {
        // The library knows schemas and channels that it has been given before.
        let channel = self.whole(|inner| {
            let schema = inner.add_schema(shown.schema, SCHEMA_ENCODING, shown.definition.as_bytes())?;
            inner.add_channel(schema, shown.topic, MESSAGE_ENCODING, &BTreeMap::new())
        })?;
        self.write_to(channel, 0, time, &shown.bytes)
    }

    fn write_to(&mut self, channel_id: u16, sequence: u32, time: Micros, bytes: &[u8]) -> Result<(), RecordingError> {
        let log_time = log_time(time);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.whole(|inner| inner.write_to_known_channel(&header, bytes))
    }

    /// Completes the file and gives it its name. Returns its size. **Units:** bytes.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        self.complete().map_err(|problem| RecordingError { path: self.target.clone(), problem })
    }

    fn complete(&mut self) -> Result<u64, Problem> {
        let mut inner = self.inner.take().ok_or_else(|| Problem::Malformed("already finished".into()))?;
        inner.finish().map_err(problem)?;
        let file = inner.into_inner().into_inner().map_err(|error| Problem::Io(error.into_error()))?;
        file.sync_all()?;
        let size = file.metadata()?.len();
        drop(file);
        if !self.live {
            fs::rename(&self.part, &self.target)?;
        }
        self.part = PathBuf::new();
        Ok(size)
    }

    /// The channel of a kind of message and how many there are on it.
    fn channel<M: Message>(&mut self) -> Result<&mut (u16, u32), McapError> {
        let inner = self.inner.as_mut().ok_or(McapError::AttemptedWriteAfterFailure)?;
        if !self.channels.contains_key(M::SCHEMA) {
            let schema = inner.add_schema(M::SCHEMA, SCHEMA_ENCODING, M::DEFINITION.as_bytes())?;
            let channel = inner.add_channel(schema, M::TOPIC, MESSAGE_ENCODING, &BTreeMap::new())?;
            self.channels.insert(M::SCHEMA, (channel, 0));
        }
        self.channels.get_mut(M::SCHEMA).ok_or(McapError::AttemptedWriteAfterFailure)
    }

    fn message<M: Message>(&mut self, message: &M) -> Result<(), RecordingError> {
        self.put(message).map_err(|error| RecordingError { path: self.target.clone(), problem: problem(error) })
    }

    fn put<M: Message>(&mut self, message: &M) -> Result<(), McapError> {
        let (channel_id, count) = self.channel::<M>()?;
        let (channel_id, sequence) = (*channel_id, *count);
        *count = count.wrapping_add(1);
        let log_time = log_time(message.time());
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        let bytes = message.encode(&mut self.buffer);
        let inner = self.inner.as_mut().ok_or(McapError::AttemptedWriteAfterFailure)?;
        inner.write_to_known_channel(&header, bytes)
    }
}

/// MCAP counts unsigned nanoseconds; what lies before zero is shown at zero and keeps its time inside.
fn log_time(time: Micros) -> u64 {
    u64::try_from(time.0).unwrap_or(0).saturating_mul(1000)
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.inner = None;
        if !self.live && !self.part.as_os_str().is_empty() {
            // Nobody is left to be told that the rest of a failed recording could not be removed.
            let _ = fs::remove_file(&self.part);
        }
    }
}

/// Writes a whole recording. Returns the size of the file. **Units:** bytes.
pub fn write(target: &Path, recording: &Recording) -> Result<u64, RecordingError> {
    write_shown(target, recording, &[], &[])
}

/// The same with what viewers show of a walk in a building.
pub fn write_shown(
    target: &Path,
    recording: &Recording,
    building: &[Lines],
    moments: &[Moment],
) -> Result<u64, RecordingError> {
    let mut writer = Writer::create(target, &recording.name, recording.range, &recording.metadata)?;
    for sample in &recording.samples {
        writer.sample(sample)?;
    }
    if let Some(truth) = &recording.truth {
        for pose in &truth.poses {
            writer.pose(pose)?;
        }
        for stance in &truth.stances {
            writer.stance(stance)?;
        }
    }
    for step in &recording.steps {
        writer.step(step)?;
    }
    for fix in &recording.fixes {
        writer.fix(fix)?;
    }
    if let Some(first) = moments.first() {
        writer.building(building, first.time)?;
    }
    for moment in moments {
        writer.moment(moment)?;
    }
    writer.finish()
}

/// What the writing or reading library says, in the words of this module.
fn problem(error: McapError) -> Problem {
    match error {
        McapError::Io(error) => Problem::Io(error),
        McapError::UnsupportedCompression(name) => {
            Problem::Malformed(format!("compressed with {name}, expected an MCAP without compression"))
        }
        other => Problem::Malformed(format!("damaged MCAP: {}", other.to_string().replace('\n', " "))),
    }
}

/// Which kind of message a channel carries.
#[derive(Clone, Copy)]
enum Kind {
    Sample,
    Pose,
    Stance,
    Step,
    Heard,
    Fix,
}

/// What has been read so far.
#[derive(Default)]
struct Contents {
    schemas: BTreeMap<u16, (String, Vec<u8>)>,
    channels: BTreeMap<u16, Kind>,
    /// Names of all schemas, for the error.
    present: Vec<String>,
    library: String,
    has_samples: bool,
    heard: Vec<Heard>,
    recording: Recording,
}

/// What tells which messages of the wire a recording holds.
const WIRE_SCHEMA: &str = "wire_schema";

fn wire_schema() -> String {
    format!("{:016x}", sohle_shared::wire::SCHEMA)
}

/// Reads a recording of the project from the start of `source`.
pub(super) fn read(source: impl Read) -> Result<Recording, Problem> {
    let mut contents = Contents::default();
    match contents.fill(source) {
        Ok(()) => contents.finish(),
        // A live walk whose program was killed has no end, but all that was flushed.
        Err(Problem::Truncated(_)) if !contents.heard.is_empty() => {
            contents.recording.metadata.insert("truncated".into(), "true".into());
            contents.finish()
        }
        Err(Problem::Truncated(_)) => Err(Problem::Truncated(contents.progress())),
        Err(other) => Err(other),
    }
}

impl Contents {
    fn fill(&mut self, mut source: impl Read) -> Result<(), Problem> {
        let options = LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(LONGEST_RECORD);
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let count = loop {
                        match source.read(reader.insert(wanted)) {
                            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                            other => break other?,
                        }
                    };
                    reader.notify_read(count);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    self.record(opcode, data)?;
                }
                Err(McapError::UnexpectedEof) => return Err(Problem::Truncated(String::new())),
                Err(error) => return Err(problem(error)),
            }
        }
        Ok(())
    }

    /// Takes a record in. Kinds that are not needed are not given to the library, which slices some without checking.
    fn record(&mut self, opcode: u8, data: &[u8]) -> Result<(), Problem> {
        if !matches!(opcode, op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::METADATA) {
            return Ok(());
        }
        match mcap::parse_record(opcode, data).map_err(problem)? {
            Record::Header(header) => self.library = header.library,
            Record::Schema { header, data } => {
                if !self.present.contains(&header.name) {
                    self.present.push(header.name.clone());
                }
                self.schemas.insert(header.id, (header.name, data.into_owned()));
            }
            Record::Channel(channel) => {
                if let Some(kind) = self.kind(&channel)? {
                    self.has_samples |= matches!(kind, Kind::Sample);
                    self.channels.insert(channel.id, kind);
                }
            }
            Record::Message { header, data } => self.message(header.channel_id, &data)?,
            Record::Metadata(metadata) => self.metadata(metadata)?,
            Record::Chunk { header, data } => self.chunk(&header, &data)?,
            _ => {}
        }
        Ok(())
    }

    /// Takes the records of a chunk in, after its checksum. The library's own loop relies on their lengths.
    fn chunk(&mut self, header: &ChunkHeader, mut data: &[u8]) -> Result<(), Problem> {
        if !header.compression.is_empty() {
            return Err(problem(McapError::UnsupportedCompression(header.compression.clone())));
        }
        let mut checksum = flate2::Crc::new();
        checksum.update(data);
        let (saved, calculated) = (header.uncompressed_crc, checksum.sum());
        if saved != 0 && saved != calculated {
            return Err(problem(McapError::BadChunkCrc { saved, calculated }));
        }
        while let Some((&opcode, behind)) = data.split_first() {
            let (length, behind) = behind.split_first_chunk().ok_or_else(|| problem(McapError::UnexpectedEoc))?;
            let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
            let (record, rest) = behind.split_at_checked(length).ok_or_else(|| problem(McapError::UnexpectedEoc))?;
            if opcode == op::CHUNK {
                return Err(Problem::Malformed("damaged MCAP: a chunk inside a chunk".into()));
            }
            self.record(opcode, record)?;
            data = rest;
        }
        Ok(())
    }

    /// What a channel carries; `None` for channels of others, which are passed over.
    fn kind(&self, channel: &mcap::records::Channel) -> Result<Option<Kind>, Problem> {
        let Some((name, definition)) = self.schemas.get(&channel.schema_id) else { return Ok(None) };
        let (kind, expected) = match name.as_str() {
            ImuSample::SCHEMA => (Kind::Sample, ImuSample::DEFINITION),
            TruthPose::SCHEMA => (Kind::Pose, TruthPose::DEFINITION),
            TruthStance::SCHEMA => (Kind::Stance, TruthStance::DEFINITION),
            Step::SCHEMA => (Kind::Step, Step::DEFINITION),
            Heard::SCHEMA => (Kind::Heard, Heard::DEFINITION),
            Fix::SCHEMA => (Kind::Fix, Fix::DEFINITION),
            _ => return Ok(None),
        };
        if definition != expected.as_bytes() || channel.message_encoding != MESSAGE_ENCODING {
            return Err(Problem::Malformed(format!(
                "schema {name} is not the one of this program ({}), it was written by '{}'",
                env!("CARGO_PKG_VERSION"),
                self.library
            )));
        }
        Ok(Some(kind))
    }

    fn message(&mut self, channel: u16, bytes: &[u8]) -> Result<(), Problem> {
        let recording = &mut self.recording;
        match self.channels.get(&channel) {
            None => {}
            Some(Kind::Sample) => recording.samples.push(decode(bytes, recording.samples.len())?),
            Some(Kind::Heard) => {
                // Looked at before the bytes are taken for something that they are not.
                let schema = recording.metadata.get(WIRE_SCHEMA);
                if schema != Some(&wire_schema()) {
                    return Err(Problem::Malformed(format!(
                        "recorded with the messages {} of another version ('{}'), this program ({}) knows {}",
                        schema.map_or("?", String::as_str),
                        self.library,
                        env!("CARGO_PKG_VERSION"),
                        wire_schema()
                    )));
                }
                self.heard.push(decode(bytes, self.heard.len())?);
            }
            Some(Kind::Fix) => recording.fixes.push(decode(bytes, recording.fixes.len())?),
            Some(Kind::Step) => recording.steps.push(decode(bytes, recording.steps.len())?),
            Some(Kind::Pose) => {
                let poses = &mut recording.truth.get_or_insert_default().poses;
                poses.push(decode(bytes, poses.len())?);
            }
            Some(Kind::Stance) => {
                let stances = &mut recording.truth.get_or_insert_default().stances;
                stances.push(decode(bytes, stances.len())?);
            }
        }
        Ok(())
    }

    fn metadata(&mut self, metadata: Metadata) -> Result<(), Problem> {
        match metadata.name.as_str() {
            ABOUT => self.recording.metadata.extend(metadata.metadata),
            OWN => {
                let end = |key: &str| {
                    let text = metadata.metadata.get(key);
                    let number = |text: &String| {
                        text.parse()
                            .map_err(|_| Problem::Malformed(format!("metadata {key} is '{text}', not a number")))
                    };
                    text.map(number).transpose()
                };
                self.recording.range = SensorRange { accel: end("accel_range_m_s2")?, gyro: end("gyro_range_rad_s")? };
                self.recording.name = metadata.metadata.get("name").cloned().unwrap_or_default();
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(self) -> Result<Recording, Problem> {
        if !self.has_samples {
            let present = if self.present.is_empty() { "none".into() } else { self.present.join(", ") };
            return Err(Problem::Malformed(format!(
                "an MCAP without the schema {}; schemas in it: {present}",
                ImuSample::SCHEMA
            )));
        }
        let mut recording = self.recording;
        if !self.heard.is_empty() {
            live::compute(&self.heard, &mut recording)?;
        }
        if recording.samples.is_empty() && recording.steps.is_empty() {
            return Err(Problem::NoSamples(format!("no message on {}", ImuSample::TOPIC)));
        }
        let mut latest = None;
        for (index, sample) in recording.samples.iter().enumerate() {
            let place = || format!("sample {}", index + 1);
            if !sample.is_finite() {
                return Err(Problem::Value { place: place(), what: "not a finite number".into() });
            }
            table::forwards(&mut latest, sample.time, place)?;
        }
        recording.irregularities = table::irregularities(&recording.samples);
        Ok(recording)
    }

    /// How far the reading came.
    fn progress(&self) -> String {
        let samples = &self.recording.samples;
        let span = match (samples.first(), samples.last()) {
            (Some(first), Some(last)) => (last.time - first.time) as f64 * 1e-6,
            _ => 0.0,
        };
        format!("the MCAP ends early, after {} samples ({span:.3} s)", samples.len())
    }
}

/// One message; `index` counts those of its kind.
fn decode<M: Message>(bytes: &[u8], index: usize) -> Result<M, Problem> {
    M::decode(bytes).ok_or_else(|| {
        let length = bytes.len();
        Problem::Malformed(format!("message {} on {} ({length} bytes) is not a {}", index + 1, M::TOPIC, M::SCHEMA))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixes::{Frame, Measured};
    use crate::recording::{self, SimulatedTruth};
    use nalgebra::{Matrix2, Matrix4, Vector3};
    use proptest::prelude::*;
    use proptest::sample::Index;
    use sohle_shared::sample::ClippedSamples;
    use sohle_shared::step::{FloorMode, StepQuality};
    use sohle_shared::time::Micros;
    use sohle_shared::wire::message::{FromShoe, Level, Log, text};

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
        let stance = TruthStance {
            start: Micros(-5),
            end: Micros(300_000),
            position: [0.1, 0.2, 0.3],
            heading: -1.25,
            still: true,
        };
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
        let json: usize =
            walk.samples.iter().map(|sample| serde_json::to_string(&Json::of(sample)).unwrap().len()).sum();
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
}
