//! `sohle live`: a shoe's steps as they come, and everything it says in a recording.

use super::{Error, parameters, print};
use crate::calibration;
use crate::link::connection::Happening;
use crate::link::event::{Event, mismatch};
use crate::link::recorder::{Recorded, Recorder};
use crate::link::{Address, Connection};
use crate::recording::heard::Heard;
use crate::recording::live::{CALIBRATION, PARAMETERS};
use clap::ValueEnum;
use serde_json::{Value as Json, json};
use sohle_shared::step::{FloorMode, Step};
use sohle_shared::wire::message::{Action, FromShoe, Level, Raw, RawItem, SentStep, Status};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::transfer::{Item, Value};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Shows a shoe's steps as they come and records what it says
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Ctrl-C ends it. The port is opened anew as often as needed; steps that the shoe made meanwhile follow then.\n\
'sohle replay' takes the recording; with --raw it computes the steps again from the sensor's counts and tells whether\n\
they are the same.\n\n\
Examples:\n  sohle live serial:/dev/ttyACM0\n  sohle live tcp:127.0.0.1:7700 --raw --out walk.mcap"
)]
pub struct Args {
    /// Where the shoe is: a serial port, at 921600 baud unless it says otherwise, or a network port
    #[arg(value_name = "serial:PATH[@BAUD]|tcp:HOST:PORT")]
    address: Address,
    /// The recording [default: sohle-live-TIME.mcap]
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "no_record")]
    out: Option<PathBuf>,
    /// Records nothing
    #[arg(long)]
    no_record: bool,
    /// Records the counts of the sensor at its full rate too; the shoe's tracker starts anew for it
    #[arg(long, conflicts_with = "no_record")]
    raw: bool,
    /// Gives the shoe these settings of its tracker first
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Gives the shoe this calibration of its sensor first
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,
    /// Ends after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    duration: Option<f64>,
    /// Ends after so many steps
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// How steps and summary are told
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// Tells nothing but the summary and errors
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A line for each step, for people
    #[default]
    Table,
    /// A JSON object in each line
    Json,
}

/// How soon Ctrl-C is noticed.
const LOOK: Duration = Duration::from_millis(100);

/// Connects, shows, records.
pub fn run(args: Args) -> Result<(), Error> {
    let mut values = Vec::new();
    if let Some(path) = &args.parameters {
        values.push(Value::Parameters(parameters::read(path)?));
    }
    if let Some(path) = &args.calibration {
        values.push(Value::Calibration(calibration::read(path)?));
    }
    let until = match args.duration {
        Some(seconds) if !(seconds > 0.0 && seconds < 1e9) => {
            return Err(Error::new(format!("--for {seconds}: expected more than 0 seconds")));
        }
        seconds => seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds)),
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;

    let recorder = if args.no_record { None } else { Some(begin(args.out.as_deref())?) };
    let mut connection = Connection::open(args.address);
    let mut show = Show { recorder, format: args.format, quiet: args.quiet, ..Show::default() };
    show.head()?;
    let mut prepared = None;
    let result = loop {
        let enough = args.steps.is_some_and(|steps| show.steps >= steps);
        if enough || stop.load(Ordering::Relaxed) || until.is_some_and(|until| Instant::now() >= until) {
            break Ok(());
        }
        if let Some(fault) = show.fault.take() {
            break Err(Error::new(fault));
        }
        if show.boot.is_some() && show.boot != prepared {
            prepared = show.boot;
            if let Err(error) = prepare(&mut connection, &mut show, &values, args.raw) {
                break Err(error);
            }
        }
        if let Some(happening) = connection.next(LOOK) {
            show.take(happening, &connection);
        }
    };
    if args.raw && show.boot.is_some() && result.is_ok() {
        // If the shoe does not hear it, the next program that says hello ends it.
        let _ = connection.ask(Action::Raw(false), &mut |happening, connection| show.take(happening, connection));
    }
    show.finish(&connection)?;
    result
}

fn begin(path: Option<&Path>) -> Result<Recorder, Error> {
    let path = path.map_or_else(
        || {
            let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
            PathBuf::from(format!("sohle-live-{}.mcap", since.as_secs()))
        },
        Path::to_path_buf,
    );
    // What was heard once comes never again.
    if path.is_file() {
        return Err(Error::new(format!("{} is there already; a live recording replaces nothing", path.display())));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Recorder::begin(&path, &name)?)
}

/// Gives a shoe that has just started what it is to have, and turns raw counts on.
fn prepare(connection: &mut Connection, show: &mut Show, values: &[Value], raw: bool) -> Result<(), Error> {
    for value in values {
        connection.write(value, &mut |happening, connection| show.take(happening, connection))?;
    }
    if !raw {
        return Ok(());
    }
    for item in [Item::Parameters, Item::Calibration] {
        let value = connection.read(item, &mut |happening, connection| show.take(happening, connection))?;
        let (key, text) = match value {
            Value::Parameters(parameters) => (PARAMETERS, toml::to_string(&parameters)?),
            Value::Calibration(calibration) => (CALIBRATION, toml::to_string(&calibration)?),
        };
        if let Some(recorder) = &mut show.recorder {
            recorder.about(key, text);
        }
    }
    connection.ask(Action::Raw(true), &mut |happening, connection| show.take(happening, connection))?;
    Ok(())
}

/// What is shown, and what has been so far.
#[derive(Default)]
struct Show {
    recorder: Option<Recorder>,
    format: Format,
    quiet: bool,
    /// The boot of the shoe that is connected.
    boot: Option<u32>,
    /// Boot and number of the last step.
    last: Option<(u32, u32)>,
    steps: u64,
    lost: u64,
    doubled: u64,
    distance: f64,
    /// From the end of a stance to the arrival of its step. **Units:** ms.
    delays: Vec<f64>,
    raw: u64,
    raw_lost: u64,
    raw_next: u32,
    status: Option<Status>,
    load_max: u16,
    fault: Option<String>,
}

impl Show {
    fn head(&self) -> Result<(), Error> {
        if self.quiet || self.format == Format::Json {
            return Ok(());
        }
        print("  step    time s  length m  height m    turn °  ground    delay ms  marks\n")
    }

    fn say(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    fn take(&mut self, happening: Happening, connection: &Connection) {
        let event = match happening {
            Happening::Opened => return self.say("the port is open"),
            Happening::Closed(reason) => return self.say(&format!("the port is closed: {reason}; opening it anew")),
            Happening::Unreachable(reason) => return self.say(&format!("no shoe yet: {reason}; trying on")),
            Happening::Event(event) => event,
        };
        let message = match event {
            Event::Connected(hello) => {
                let (board, firmware, boot) = (&hello.board, &hello.firmware, hello.boot);
                self.say(&format!("connected: {board}, firmware {firmware}, boot {boot:08x}"));
                self.boot = Some(boot);
                FromShoe::Hello(hello)
            }
            Event::Refused(hello) => {
                self.fault = Some(mismatch(&hello));
                return;
            }
            Event::Rebooted { boot } => return self.say(&format!("the shoe has started anew: boot {boot:08x}")),
            Event::Step { boot, id, step } => {
                self.step(boot, id, &step, connection);
                FromShoe::Step(SentStep { boot, id, oldest: id, step })
            }
            Event::Gap { boot, first, count } => {
                self.lost += u64::from(count);
                self.last = Some((boot, first.wrapping_add(count).wrapping_sub(1)));
                eprintln!("{count} steps are lost: the shoe ran out of room for them");
                return;
            }
            Event::Status(status) => {
                self.status(&status);
                FromShoe::Status(status)
            }
            Event::Attitude(attitude) => FromShoe::Attitude(attitude),
            Event::Raw(raw) => {
                self.raw(&raw);
                FromShoe::Raw(raw)
            }
            Event::Log(log) => {
                if log.level <= Level::Warn || !self.quiet {
                    eprintln!("shoe, {:.3} s: {}", log.time.as_seconds(), log.text);
                }
                FromShoe::Log(log)
            }
            Event::Reply { .. } => return,
            Event::Asleep => return self.say("the shoe stands still and is asleep"),
            Event::Woken => return self.say("the shoe has woken"),
            Event::Silent => return self.say("nothing is heard of the shoe any more"),
            Event::Back => return self.say("the shoe is heard again"),
        };
        if let Some(recorder) = &mut self.recorder {
            let whole = recorder.heard(Heard { time: connection.now(), message });
            if !whole && self.fault.is_none() && recorder.has_ended() {
                self.end_recording();
            }
        }
    }

    fn step(&mut self, boot: u32, id: u32, packed: &PackedStep, connection: &Connection) {
        let step = packed.unpack();
        match self.last {
            Some((before, last)) if before == boot && id <= last => self.doubled += 1,
            Some((before, last)) if before == boot => self.lost += u64::from(id - last - 1),
            _ => {}
        }
        self.last = Some((boot, id));
        self.steps += 1;
        self.distance += f64::from(step.length());
        let arrived = connection.session().clock().to_host(step.stance_end);
        let delay = arrived.map(|arrived| (connection.now() - arrived) as f64 * 1e-3);
        self.delays.extend(delay);
        if !self.quiet {
            let text = match self.format {
                Format::Table => row(id, &step, delay),
                Format::Json => format!("{}\n", object(boot, id, &step, delay)),
            };
            // Nobody who reads is no reason to stop recording.
            let _ = print(&text);
        }
    }

    /// Tells what went wrong on the shoe since the status before.
    fn status(&mut self, status: &Status) {
        let before = self.status.replace(*status);
        self.load_max = self.load_max.max(status.load);
        let counts = |status: &Status| {
            [
                ("accelerometer FIFO overruns", status.accel.overruns),
                ("gyroscope FIFO overruns", status.gyro.overruns),
                ("accelerometer bus errors", status.accel.bus_errors),
                ("gyroscope bus errors", status.gyro.bus_errors),
                ("accelerometer restarts", status.accel.restarts),
                ("gyroscope restarts", status.gyro.restarts),
                ("gaps in the samples", status.tracker.gaps),
                ("restarts of the tracker", status.tracker.restarts),
                ("steps given up", status.link.steps_dropped),
            ]
        };
        let Some(before) = before else { return };
        for ((what, now), (_, then)) in counts(status).into_iter().zip(counts(&before)) {
            if now > then {
                self.say(&format!("shoe, {:.3} s: {} more {what}", status.time.as_seconds(), now - then));
            }
        }
    }

    fn raw(&mut self, raw: &Raw) {
        if !matches!(raw.item, RawItem::Start(_)) {
            self.raw_lost += u64::from(raw.number.wrapping_sub(self.raw_next));
        }
        self.raw_next = raw.number.wrapping_add(1);
        self.raw += 1;
    }

    /// The disk refuses: what was heard before is kept, the rest goes on.
    fn end_recording(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            eprintln!("{}", told(&recorder.finish()));
        }
    }

    /// Tells how it went. An error if it went badly.
    fn finish(mut self, connection: &Connection) -> Result<(), Error> {
        let counters = connection.session().counters();
        let bound = connection.session().clock().error_bound().map(|bound| bound * 1e3);
        self.delays.sort_by(f64::total_cmp);
        let (median, longest) = (self.delays.get(self.delays.len() / 2).copied(), self.delays.last().copied());
        match self.format {
            Format::Json => print(&format!(
                "{}\n",
                json!({
                    "event": "summary", "connected": self.boot.is_some(), "steps": self.steps, "lost": self.lost,
                    "doubled": self.doubled, "distance_m": self.distance, "delay_median_ms": median,
                    "delay_max_ms": longest, "clock_error_bound_ms": bound, "frames": counters.frames.good,
                    "frames_bad": counters.frames.bad(), "mended": counters.mended, "reboots": counters.reboots, "raw": self.raw,
                    "raw_lost": self.raw_lost, "waiting": self.status.map(|status| status.waiting),
                    "load": self.status.map(|status| status.load), "stack": self.status.map(|status| status.stack),
                    "lateness_us": self.status.map(|status| status.lateness_us),
                    "load_max": self.load_max,
                    "asleep": self.status.map(|status| status.asleep), "sleeps": self.status.map(|status| status.sleeps),
                })
            ))?,
            Format::Table => {
                let ms = |value: Option<f64>| value.map_or("unknown".into(), |value| format!("{value:.1} ms"));
                let Self { steps, lost, doubled, distance, .. } = self;
                let mended = match counters.mended {
                    0 => String::new(),
                    mended => format!(", {mended} messages put together from those"),
                };
                print(&format!(
                    "{steps} steps, {lost} lost, {doubled} doubled, {distance:.1} m; from the end of the stance {} (median), \
                     {} (longest)\nclock of the shoe known within {}; {} frames, {} damaged{mended}{}\n",
                    ms(median),
                    ms(longest),
                    ms(bound),
                    counters.frames.good,
                    counters.frames.bad(),
                    if self.raw > 0 {
                        format!("; {} raw messages, {} lost", self.raw, self.raw_lost)
                    } else {
                        String::new()
                    }
                ))?;
            }
        }
        if let Some(recorder) = self.recorder.take() {
            let recorded = recorder.finish();
            self.say(&told(&recorded));
            recorded.size?;
        }
        if self.boot.is_none() && self.fault.is_none() {
            return Err(Error::new("no shoe was found"));
        }
        if self.lost + self.doubled > 0 {
            return Err(Error::new(format!("{} steps were lost, {} came twice", self.lost, self.doubled)));
        }
        Ok(())
    }
}

fn told(recorded: &Recorded) -> String {
    let dropped = match recorded.dropped {
        0 => String::new(),
        dropped => format!("; {dropped} messages are not in it"),
    };
    match &recorded.size {
        Ok(size) => format!("recorded to {} ({size} bytes){dropped}", recorded.path.display()),
        Err(error) => format!("the recording has ended: {error}; what was heard before is in it{dropped}"),
    }
}

fn ground(mode: FloorMode) -> &'static str {
    match mode {
        FloorMode::Level => "level",
        FloorMode::Stairs => "stairs",
        FloorMode::Elevator => "elevator",
    }
}

fn marks(step: &Step) -> Vec<&'static str> {
    let quality = &step.quality;
    [
        (quality.accel_clipped, "accelerometer clipped"),
        (quality.gyro_clipped, "gyroscope clipped"),
        (quality.gap, "gap"),
        (quality.long_swing, "long swing"),
        (quality.weak_stance, "weak stance"),
        (quality.repaired, "repaired"),
    ]
    .into_iter()
    .filter_map(|(set, name)| set.then_some(name))
    .collect()
}

fn row(id: u32, step: &Step, delay: Option<f64>) -> String {
    format!(
        "{id:>6} {:>9.2} {:>9.2} {:>9.2} {:>9.1}  {:<8} {:>9}  {}\n",
        step.stance_end.as_seconds(),
        step.length(),
        step.displacement.z,
        step.turn.to_degrees(),
        ground(step.mode),
        delay.map_or("-".into(), |delay| format!("{delay:.1}")),
        marks(step).join(", ")
    )
}

fn object(boot: u32, id: u32, step: &Step, delay: Option<f64>) -> Json {
    json!({
        "event": "step", "boot": boot, "id": id, "index": step.index, "stance_start_us": step.stance_start.0,
        "stance_end_us": step.stance_end.0, "displacement_m": <[f32; 3]>::from(step.displacement),
        "turn_rad": step.turn, "ground": ground(step.mode), "marks": marks(step), "delay_ms": delay,
    })
}
