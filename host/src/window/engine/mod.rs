//! What computes, so that the window does not: a thread of its own, which plays a recording or listens to a shoe.
//!
//! The window gives [`Command`]s and gets [`Snapshot`]s, of which only the latest counts: a window that is slow drops
//! pictures, never data, since every snapshot has all signals so far.

pub mod beside;
pub mod drawing;
mod export;
mod kept;
pub mod live;
mod moment;
mod on_graph;
pub mod opening;
pub mod replay;
mod sensed;
pub mod signals;
pub mod snapshot;
pub mod walk;

pub use beside::Beside;
pub use opening::{Opening, Plan, Positions, What};
pub use signals::{Signal, Signals};
pub use snapshot::{Kind, Pace, Snapshot};

use crate::particle;
use sohle_shared::tracker;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What the window asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Go on, or pause.
    Play(bool),
    /// Play so many times as fast as it was.
    Speed(f64),
    /// Go to a time. **Units:** s.
    Jump(f64),
    /// Go to the end of the next step.
    StepAhead,
    /// Go to the end of the step before.
    StepBack,
    /// Begin anew.
    Reset,
    /// Wait for a rest.
    Init,
    /// Follow the foot without waiting.
    Track,
    /// Who is followed is here, in the words of [`crate::follow::parse_start`].
    Start(String),
    /// Settings of the tracker.
    Tracker(Box<tracker::Parameters>),
    /// Settings of the particle filter.
    Particle(Box<particle::Parameters>),
    /// Follow by another method too, or end that.
    Beside(Beside, bool),
    /// Record what is heard into this file, or end that.
    Record(Option<PathBuf>),
    /// Write the path into this file.
    Export(PathBuf),
}

/// What came of some work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// Something is to be shown.
    pub changed: bool,
    /// It is a step, which is shown at once.
    pub stepped: bool,
    /// The foot stands: nothing moves, and a step is about to come.
    pub stands: bool,
    /// How long there is nothing to do; nothing until a command comes.
    pub pause: Option<Duration>,
}

/// Makes what is to be shown, in the thread that computes it; or tells why there is nothing.
pub type Make = Box<dyn FnOnce() -> Result<Box<dyn Source>, opening::Error> + Send>;

/// Something to be shown.
pub trait Source {
    /// Does what the window asks for.
    fn obey(&mut self, command: Command);

    /// Works until a time at the latest.
    fn work(&mut self, until: Instant) -> Work;

    /// What is known now.
    fn snapshot(&mut self) -> Snapshot;
}

/// Work in one go, before commands are looked at.
const TURN: Duration = Duration::from_millis(10);
/// Between two snapshots at least, but for steps; and so many times what a picture takes, so that who draws slowly leaves time
/// for computing.
const FRAME: Duration = Duration::from_millis(16);
const FRAMES: u32 = 2;
/// Where pictures are slow, a foot that stands is shown for so long, and then not until its step has come, which would wait
/// for a picture that shows nothing new; but no longer than steps take to come.
const STANDS: Duration = Duration::from_millis(120);
const STOOD: Duration = Duration::from_millis(1_050);
/// A single picture that took for ever does not keep others back.
const SLOWEST: Duration = Duration::from_millis(500);
/// Between two looks for commands when there is nothing to do.
const IDLE: Duration = Duration::from_secs(3600);

/// The thread, as the window has it. It ends when this is dropped.
pub struct Engine {
    commands: Sender<Command>,
    thread: JoinHandle<()>,
    latest: Arc<Mutex<Option<Arc<Snapshot>>>>,
    /// What a picture takes. **Units:** us.
    picture_us: Arc<AtomicU32>,
}

impl Engine {
    /// Makes something of this name in a thread of its own. `wake` is called when there is something to show.
    pub fn start(name: String, make: Make, wake: impl Fn() + Send + 'static) -> Self {
        let (commands, asked) = mpsc::channel();
        let picture_us = Arc::new(AtomicU32::new(0));
        let drawn_in = picture_us.clone();
        let latest = Arc::new(Mutex::new(None));
        let post = latest.clone();
        let publish = move |snapshot: Snapshot| {
            *post.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(snapshot));
            wake();
        };
        let thread = std::thread::spawn(move || {
            publish(Snapshot { name: name.clone(), kind: Kind::Opening, ..Snapshot::default() });
            match make() {
                Ok(mut source) => run(source.as_mut(), &asked, &drawn_in, publish),
                Err(error) => publish(Snapshot { name, fault: Some(error.to_string()), ..Snapshot::default() }),
            }
        });
        Self { commands, thread, latest, picture_us }
    }

    /// Asks for something. Nobody hears it when nothing could be opened.
    pub fn ask(&self, command: Command) {
        let _ = self.commands.send(command);
    }

    /// A picture took so long.
    pub fn drawn_in(&self, picture: Duration) {
        self.picture_us.store(u32::try_from(picture.as_micros()).unwrap_or(u32::MAX), Ordering::Relaxed);
    }

    /// Ends it. A recording is whole when the thread has ended.
    pub fn leave(self) -> JoinHandle<()> {
        self.thread
    }

    /// The latest snapshot, once.
    pub fn take(&self) -> Option<Arc<Snapshot>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

fn run(source: &mut dyn Source, asked: &Receiver<Command>, picture_us: &AtomicU32, publish: impl Fn(Snapshot)) {
    publish(source.snapshot());
    let (mut published, mut stepped) = (Instant::now(), None::<Instant>);
    let (mut dirty, mut pause) = (false, Some(Duration::ZERO));
    let mut stands = None::<Instant>;
    loop {
        let picture = Duration::from_micros(picture_us.load(Ordering::Relaxed).into());
        let frame = (FRAMES * picture).clamp(FRAME, SLOWEST);
        let stood = stands.map(|since: Instant| since.elapsed()).filter(|stood| (STANDS..STOOD).contains(stood));
        let held = stood.filter(|_| picture > FRAME).map_or(Duration::ZERO, |stood| STOOD - stood);
        let due = dirty.then(|| frame.saturating_sub(published.elapsed()).max(held));
        let wait = pause.unwrap_or(IDLE).min(due.unwrap_or(IDLE));
        match asked.recv_timeout(wait) {
            Ok(command) => {
                source.obey(command);
                asked.try_iter().for_each(|command| source.obey(command));
                dirty = true;
                // What came of it is shown, whether the foot stands or not.
                stands = None;
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let work = source.work(Instant::now() + TURN);
        dirty |= work.changed;
        pause = work.pause;
        stands = work.stands.then(|| stands.unwrap_or_else(Instant::now));
        // Of steps that come all at once, not each has a picture.
        let step = work.stepped && stepped.is_none_or(|before| before.elapsed() >= FRAME);
        if dirty && (step || held.is_zero() && published.elapsed() >= frame) {
            publish(source.snapshot());
            published = Instant::now();
            stepped = if step { Some(published) } else { stepped };
            dirty = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Always something new, and a step when that is said.
    struct Restless {
        stepped: bool,
        stands: bool,
    }

    impl Source for Restless {
        fn obey(&mut self, _: Command) {}

        fn work(&mut self, _: Instant) -> Work {
            let stepped = std::mem::take(&mut self.stepped);
            Work { changed: true, stepped, stands: self.stands, pause: Some(Duration::from_millis(1)) }
        }

        fn snapshot(&mut self) -> Snapshot {
            Snapshot::default()
        }
    }

    /// Snapshots in about so long, where a picture takes some time; and how long it was.
    fn published(source: Restless, picture: Duration, time: Duration) -> (usize, Duration) {
        published_to(source, picture, time, None)
    }

    /// The same where somebody asks for something every so often.
    fn published_to(
        mut source: Restless,
        picture: Duration,
        time: Duration,
        every: Option<Duration>,
    ) -> (usize, Duration) {
        let (commands, asked) = mpsc::channel();
        let count = Cell::new(0);
        let begun = Instant::now();
        let ends = std::thread::spawn(move || {
            while let Some(every) = every.filter(|_| begun.elapsed() < time) {
                std::thread::sleep(every);
                commands.send(Command::Play(true)).unwrap();
            }
            std::thread::sleep(time.saturating_sub(begun.elapsed()));
            drop(commands);
        });
        let picture_us = AtomicU32::new(picture.as_micros() as u32);
        run(&mut source, &asked, &picture_us, |_| count.set(count.get() + 1));
        ends.join().unwrap();
        (count.get(), begun.elapsed())
    }

    #[test]
    fn who_draws_slowly_gets_fewer_snapshots_but_each_step_at_once() {
        for (picture, stepped) in [(0, false), (100, false), (100, true), (9_000, true)] {
            let picture = Duration::from_millis(picture);
            let interval = (FRAMES * picture).clamp(FRAME, SLOWEST);
            let source = Restless { stepped, stands: false };
            let (count, time) = published(source, picture, Duration::from_millis(100));
            let least = 1 + usize::from(stepped);
            let most = least + (time.as_secs_f64() / interval.as_secs_f64()) as usize;
            assert!((least..=most).contains(&count), "{picture:?} {stepped}: {count} in {time:?}");
        }
    }

    #[test]
    fn a_foot_that_stands_is_shown_for_a_moment_and_then_not_until_its_step_or_a_second_is_over() {
        let stands = || Restless { stepped: false, stands: true };
        let slow = Duration::from_millis(20);
        // Of 0.6 s the first 0.12; a machine that is busy shows fewer.
        let (count, _) = published(stands(), slow, Duration::from_millis(600));
        assert!(count <= 2 + (STANDS.as_millis() / 40) as usize, "{count}");
        // Who stands for longer is seen again.
        let (long, time) = published(stands(), slow, Duration::from_millis(1_800));
        assert!(long > count || time < STOOD, "{long} {count}");
        // What somebody asks for is shown.
        let every = Some(Duration::from_millis(100));
        let (asked, _) = published_to(stands(), slow, Duration::from_millis(600), every);
        assert!(asked > count, "{asked} {count}");
        // Where pictures are quick nothing is held back.
        let (quick, time) = published(stands(), Duration::ZERO, Duration::from_millis(600));
        assert!(quick > count, "{quick} {count} in {time:?}");
    }
}
