//! Writing: as a stream, or a whole recording.

use super::{ABOUT, MESSAGE_ENCODING, OWN, SCHEMA_ENCODING, WIRE_SCHEMA, problem, wire_schema};
use crate::fixes::Fix;
use crate::recording::error::{Problem, RecordingError};
use crate::recording::heard::Heard;
use crate::recording::message::{Encoder, Message};
use crate::recording::scene::{self, Lines, Moment, Shown};
use crate::recording::truth::{TruthPose, TruthStance};
use crate::recording::{Recording, SensorRange};
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions};
use sohle_shared::sample::ImuSample;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Messages are collected in chunks of this size; those of the last chunk are lost when the power fails. **Units:** bytes.
pub(super) const CHUNK: u64 = 1 << 16;

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
