//! Reading: a whole recording, of which a live walk may lack the end.

use super::{ABOUT, MESSAGE_ENCODING, OWN, WIRE_SCHEMA, problem, wire_schema};
use crate::fixes::Fix;
use crate::recording::error::Problem;
use crate::recording::heard::Heard;
use crate::recording::message::Message;
use crate::recording::truth::{TruthPose, TruthStance};
use crate::recording::{Recording, SensorRange, live, table};
use mcap::McapError;
use mcap::records::{ChunkHeader, Metadata, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use sohle_shared::sample::ImuSample;
use sohle_shared::step::Step;
use std::collections::BTreeMap;
use std::io::Read;

/// Longer records are no recording of ours but a damaged length. **Units:** bytes.
const LONGEST_RECORD: usize = 64 << 20;

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

/// Reads a recording of the project from the start of `source`.
pub fn read(source: impl Read) -> Result<Recording, Problem> {
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
