//! What can be checked of a shoe on a cable without a board: its bits, a line that damages and loses, and its sleep.
//!
//! Each walk has an emulator, a port and a folder of its own and waits by its shoe's clock, so that several run side by side.

use super::live::Walk;
use super::machine::{self, INSTRUCTIONS_PER_S, Running, free_port};
use super::proxy::Proxy;
use super::{RECORDINGS, SIMULATED_S, Summary, TWIN, converted, file, live_walk, simulated, within_budget};
use crate::firmware::{self, Budgets};
use crate::process::{self, Failure};
use crate::{device, in_root, together, tools};
use std::path::{Path, PathBuf};
use std::process::Command;

/// So many emulators run side by side: each leaves half of a processor idle while it waits for its walk.
const EMULATORS: usize = 2;
/// The walk of the check of sleep, 4 s of rest before and after it included; from then on the foot stands. **Units:** s.
const SHORT_S: u32 = 24;
/// In the check of its sleep the shoe sleeps when it has stood so long. **Units:** s.
const SLEEP_AFTER_S: u32 = 3;
/// After that walk: to fall asleep, and to tell twice of it. **Units:** s.
const ASLEEP_S: u32 = SLEEP_AFTER_S + 15;
/// After a walk over a bad line: for what is sent again. **Units:** s.
const AGAIN_S: u32 = 10;

/// What is looked at while the shoe walks.
#[derive(Clone, Copy)]
enum Look {
    /// What it computes must be what this processor does.
    Bits,
    /// Over a line that damages bytes and loses pieces, both ways, every step must arrive, once.
    BadLine,
    /// It sleeps after so many seconds of standing, if not 0, and is compared with one that does not.
    Sleep(u32),
}

/// A walk of the check.
struct Part {
    name: &'static str,
    look: Look,
    recording: PathBuf,
    /// How `sohle convert` reads the recording.
    profile: Option<&'static str>,
    seconds: u32,
    folder: PathBuf,
}

/// What came of a walk.
struct Outcome {
    name: &'static str,
    summary: Summary,
    /// More than the summary, in words.
    told: Option<String>,
}

/// Walks all of them.
pub fn check() -> Result<(), Failure> {
    tools::QEMU.required()?;
    let sohle = process::build("dev", "--bin", "sohle")?;
    machine::build(&[])?;
    let folder = in_root("target/emulate");
    std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
    let statics = firmware::statics_without(&device::binary("sohle-shoe"), &TWIN)?;
    let parts = parts(&sohle, &folder)?;
    println!("{} walks, {EMULATORS} at a time, by the shoe's clock", parts.len());
    let outcomes = together::each(parts, EMULATORS, |part| part.walk(&sohle))?;
    println!("(delays are right on a machine that does nothing else: on others the emulated clock falls behind)");
    println!("walk                          steps  delay ms, median / longest  load 1/1000  stack");
    for Outcome { name, summary, told } in &outcomes {
        row(name, summary);
        told.iter().for_each(|told| println!("  {told}"));
    }
    let [.., awake, slept] = outcomes.as_slice() else { unreachable!("the walks of sleep come last") };
    sleeps(&awake.summary, &slept.summary)?;
    let stack = outcomes.iter().filter_map(|outcome| outcome.summary.stack).max();
    within_budget(statics, stack.unwrap_or_default(), Budgets::read()?.wired)
}

/// All walks. The last two are those of sleep: awake, then asleep before and after the walk.
fn parts(sohle: &Path, folder: &Path) -> Result<Vec<Part>, Failure> {
    let mut parts = Vec::new();
    let mut add = |name, look, recording: &Path, profile, seconds| {
        let folder = folder.join(parts.len().to_string());
        std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
        parts.push(Part { name, look, recording: recording.to_owned(), profile, seconds, folder });
        Ok::<_, Failure>(())
    };
    let mut walks = Vec::new();
    for (name, profile, seconds) in RECORDINGS {
        let here = ["recordings", "../shared/recordings"].map(|folder| in_root(folder).join(name));
        match here.into_iter().find(|path| path.is_file()) {
            Some(path) => walks.push((name, path, profile, seconds)),
            None => println!("{name} is not here and is skipped"),
        }
    }
    walks.push(("a simulated walk", simulated(sohle, folder, "demo", 1)?, None, SIMULATED_S));
    for (name, path, profile, seconds) in &walks {
        add(name, Look::Bits, path, *profile, *seconds)?;
    }
    let (_, path, profile, seconds) = &walks[0];
    add("the first over a bad line", Look::BadLine, path, *profile, seconds + AGAIN_S)?;
    let short = folder.join("short.mcap");
    let mut command = Command::new(sohle);
    process::read(command.args(["simulate", "--gait", "walk", "--strides", "10", "--out"]).arg(&short))?;
    add("ten strides, awake", Look::Sleep(0), &short, None, SHORT_S)?;
    add("the same, asleep before and after", Look::Sleep(SLEEP_AFTER_S), &short, None, SHORT_S + ASLEEP_S)?;
    Ok(parts)
}

impl Part {
    fn walk(self, sohle: &Path) -> Result<Outcome, Failure> {
        let counts = converted(sohle, &self.folder, &self.recording, self.profile)?;
        let shoe = free_port()?;
        let mut running = Running::start(shoe, &counts)?;
        let (summary, told) = match self.look {
            Look::Bits => {
                let (summary, told) = self.bits(sohle, &mut running, shoe)?;
                (summary, Some(told))
            }
            Look::BadLine => {
                let (summary, told) = self.bad_line(sohle, &mut running, shoe)?;
                (summary, Some(told))
            }
            Look::Sleep(after_s) => (self.sleep(sohle, &mut running, shoe, after_s)?, None),
        };
        Ok(Outcome { name: self.name, summary, told })
    }

    /// Records the walk with the counts of the sensor, and computes it again here.
    fn bits(&self, sohle: &Path, running: &mut Running, shoe: u16) -> Result<(Summary, String), Failure> {
        let live = self.folder.join("live.mcap");
        match std::fs::remove_file(&live) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => return Err(file(&live, source)),
            _ => {}
        }
        let Walk { summary, .. } = live_walk(sohle, running, shoe, self.seconds, |command| {
            command.arg("--raw").arg("--out").arg(&live);
        })?;
        let (name, steps, bad) = (self.name, summary.steps, summary.frames_bad);
        if bad > 0 || steps == 0 {
            return Err(Failure::Found(format!("{name}: {steps} steps, {bad} bad frames")));
        }
        let mut command = Command::new(sohle);
        command.args(["replay", "--headless"]).arg(&live).arg("--out").arg(self.folder.join("again"));
        let again = process::read(&mut command)?.out;
        let told = again.lines().find(|line| line.contains("bit for bit")).map(str::to_owned);
        let told = told.ok_or_else(|| Failure::Found(format!("{name}: nothing was computed again")))?;
        Ok((summary, told))
    }

    fn bad_line(&self, sohle: &Path, running: &mut Running, shoe: u16) -> Result<(Summary, String), Failure> {
        let laptop = free_port()?;
        let proxy = Proxy::start(laptop, shoe)
            .map_err(|source| Failure::NotStarted { program: "the bad line".into(), source })?;
        let Walk { summary, .. } = live_walk(sohle, running, laptop, self.seconds, |command| {
            command.arg("--no-record");
        })?;
        let (damaged, lost) = proxy.faults();
        let waiting = summary.waiting.unwrap_or(u32::MAX);
        if summary.lost + summary.doubled + u64::from(waiting) > 0 || summary.steps == 0 || damaged == 0 || lost == 0 {
            return Err(Failure::Found(format!(
                "over a bad line {} steps came, {} were lost, {} came twice, {waiting} wait",
                summary.steps, summary.lost, summary.doubled
            )));
        }
        let refused = summary.frames_bad;
        let told = format!("the line damaged {damaged} bytes and lost {lost} pieces; {refused} frames were refused");
        Ok((summary, told))
    }

    fn sleep(&self, sohle: &Path, running: &mut Running, shoe: u16, after_s: u32) -> Result<Summary, Failure> {
        let parameters = self.folder.join("parameters.toml");
        std::fs::write(&parameters, format!("sleep_after_s = {after_s}.0\n"))
            .map_err(|source| file(&parameters, source))?;
        let Walk { summary, .. } = live_walk(sohle, running, shoe, self.seconds, |command| {
            command.arg("--no-record").arg("--parameters").arg(parameters);
        })?;
        Ok(summary)
    }
}

/// The shoe must sleep before and after a walk, and miss no step. What the processor does then goes to the twin's readings for
/// the most part, which no real board has to make.
fn sleeps(awake: &Summary, slept: &Summary) -> Result<(), Failure> {
    let instructions = |load: u32| f64::from(load) * 1e-3 * INSTRUCTIONS_PER_S * 1e-6;
    let (busy, idle) = (instructions(slept.load_max), instructions(slept.load.unwrap_or_default()));
    let sleeps = slept.sleeps.unwrap_or_default();
    println!("  it slept {sleeps} times; {busy:.1} million instructions a second at most, {idle:.2} million asleep");
    if slept.asleep != Some(true) || slept.steps != awake.steps || sleeps == 0 || slept.lost + slept.doubled > 0 {
        let (steps, all) = (slept.steps, awake.steps);
        return Err(Failure::Found(format!("it slept {sleeps} times, and of {all} steps {steps} came")));
    }
    Ok(())
}

fn row(name: &str, summary: &Summary) {
    let cell = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.1}"));
    let number = |value: Option<u32>| value.map_or("-".into(), |value| value.to_string());
    println!(
        "{name:<30}{:>5} {:>18} / {:<8} {:>11} {:>6}",
        summary.steps,
        cell(summary.delay_median_ms),
        cell(summary.delay_max_ms),
        number(summary.load),
        number(summary.stack)
    );
}
