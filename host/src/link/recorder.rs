//! Writes what is heard of a shoe, beside the program that shows it.
//!
//! A thread of its own writes, behind a bounded buffer: a slow disk delays nobody, a full one stops the recording and
//! nothing else. Once in a second everything is handed to the system, so that a program that is killed leaves what it heard.

use crate::fixes::Fix;
use crate::recording::RecordingError;
use crate::recording::heard::Heard;
use crate::recording::mcap::Writer;
use crate::recording::scene::{Lines, Moment};
use sohle_shared::time::Micros;
use sohle_shared::wire::message::FromShoe;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Messages that may wait for the disk: half a minute of everything a shoe says.
const WAITING: usize = 16_384;
/// Between two times that everything is handed to the system.
const FLUSHED: Duration = Duration::from_secs(1);

enum Entry {
    Heard(Box<Heard>),
    About(BTreeMap<String, String>),
    Building(Vec<Lines>, Micros),
    Moment(Box<Moment>),
    Fix(Box<Fix>),
}

/// A recording that goes on.
#[derive(Debug)]
pub struct Recorder {
    entries: SyncSender<Entry>,
    thread: JoinHandle<Result<u64, RecordingError>>,
    path: PathBuf,
    dropped: u64,
}

/// What became of a recording.
#[derive(Debug)]
pub struct Recorded {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes, or why it ended early.
    pub size: Result<u64, RecordingError>,
    /// Messages that are not in it, because the disk was too slow or the recording had ended.
    pub dropped: u64,
}

impl Recorder {
    /// Begins a recording at `path`.
    pub fn begin(path: &Path, name: &str) -> Result<Self, RecordingError> {
        let writer = Writer::live(path, name, &BTreeMap::new())?;
        let (entries, waiting) = sync_channel(WAITING);
        let thread = std::thread::spawn(move || write(writer, &waiting));
        Ok(Self { entries, thread, path: path.into(), dropped: 0 })
    }

    /// Records a message. Never waits; whether it will be written.
    pub fn heard(&mut self, heard: Heard) -> bool {
        self.send(Entry::Heard(Box::new(heard)))
    }

    /// Records something about the walk.
    pub fn about(&mut self, key: &str, text: String) -> bool {
        self.send(Entry::About(BTreeMap::from([(key.to_owned(), text)])))
    }

    /// Records the plan of a building, for viewers.
    pub fn building(&mut self, lines: Vec<Lines>, time: Micros) -> bool {
        self.send(Entry::Building(lines, time))
    }

    /// Records what was said after a step, for viewers.
    pub fn moment(&mut self, moment: Moment) -> bool {
        self.send(Entry::Moment(Box::new(moment)))
    }

    /// Records what another source said of the place.
    pub fn fix(&mut self, fix: Fix) -> bool {
        self.send(Entry::Fix(Box::new(fix)))
    }

    fn send(&mut self, entry: Entry) -> bool {
        match self.entries.try_send(entry) {
            Ok(()) => true,
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.dropped += 1;
                false
            }
        }
    }

    /// Whether it has ended by itself, because the disk refused.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Ends the recording.
    pub fn finish(self) -> Recorded {
        let Self { entries, thread, path, dropped } = self;
        drop(entries);
        let size = thread.join().unwrap_or_else(|fault| std::panic::resume_unwind(fault));
        Recorded { path, size, dropped }
    }
}

fn write(mut writer: Writer, entries: &Receiver<Entry>) -> Result<u64, RecordingError> {
    let mut flushed = Instant::now();
    loop {
        match entries.recv_timeout(FLUSHED) {
            Ok(Entry::Heard(heard)) => {
                if let FromShoe::Step(sent) = &heard.message {
                    writer.step(&sent.step.unpack())?;
                }
                writer.heard(&heard)?;
            }
            Ok(Entry::About(about)) => writer.about(&about)?,
            Ok(Entry::Building(lines, time)) => writer.building(&lines, time)?,
            Ok(Entry::Moment(moment)) => writer.moment(&moment)?,
            Ok(Entry::Fix(fix)) => writer.fix(&fix)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return writer.finish(),
        }
        if flushed.elapsed() >= FLUSHED {
            writer.flush()?;
            flushed = Instant::now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording;
    use sohle_shared::step::{FloorMode, Step, StepQuality};
    use sohle_shared::time::Micros;
    use sohle_shared::wire::message::SentStep;
    use sohle_shared::wire::packed::PackedStep;

    fn step(index: u32) -> Heard {
        let time = Micros(i64::from(index) * 1_100_000);
        let step = PackedStep::pack(&Step {
            index,
            stance_start: time,
            stance_end: time + 400_000,
            displacement: nalgebra::Vector3::new(1.3, 0.0, 0.0),
            turn: 0.1,
            covariance: nalgebra::Matrix4::identity() * 1e-4,
            mode: FloorMode::Level,
            quality: StepQuality::default(),
            clipped: Default::default(),
        });
        Heard { time, message: FromShoe::Step(SentStep { boot: 1, id: index, oldest: index, step }) }
    }

    #[test]
    fn a_file_that_was_cut_anywhere_still_tells_the_steps_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("live.mcap");
        let mut recorder = Recorder::begin(&path, "live").unwrap();
        for index in 0..40 {
            assert!(recorder.heard(step(index)));
            if index == 20 {
                // Longer than it takes to flush: the file is on the disk up to here.
                std::thread::sleep(FLUSHED + Duration::from_millis(400));
            }
        }
        let half = std::fs::read(&path).unwrap();
        let recorded = recorder.finish();
        assert_eq!((recorded.size.is_ok(), recorded.dropped), (true, 0));
        let whole = std::fs::read(&path).unwrap();
        assert_eq!(recording::open(&path, None).unwrap().steps.len(), 40);
        let cut = folder.path().join("cut.mcap");
        std::fs::write(&cut, &half).unwrap();
        let kept = recording::open(&cut, None).unwrap();
        assert!(kept.steps.len() >= 21 && kept.metadata.contains_key("truncated"), "{}", kept.steps.len());
        let mut before = 0;
        for length in (0..whole.len()).step_by(97) {
            std::fs::write(&cut, &whole[..length]).unwrap();
            let steps = recording::open(&cut, None).map_or(0, |recording| recording.steps.len());
            assert!(steps >= before, "{length} bytes tell {steps} steps, fewer bytes {before}");
            before = steps;
        }
        assert_eq!(before, 40);
    }

    #[test]
    fn a_disk_that_refuses_ends_the_recording_alone() {
        // The device that is always full.
        let full = Path::new("/dev/full");
        if !full.exists() {
            return;
        }
        let told = match Recorder::begin(full, "live") {
            Err(error) => error.to_string(),
            Ok(mut recorder) => {
                let written = (0..100_000).take_while(|&index| recorder.heard(step(index))).count();
                assert!(written < 100_000, "it has noticed");
                recorder.finish().size.unwrap_err().to_string()
            }
        };
        assert!(told.contains("No space left"), "{told}");
    }
}
