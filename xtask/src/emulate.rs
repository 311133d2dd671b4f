//! A live shoe without hardware: the firmware's loops on an emulated Cortex-M4F, its serial line a TCP port.

mod live;
pub mod machine;
mod pace;
mod proxy;
pub mod radio;

use crate::firmware::{self, Budget, Budgets};
use crate::process::{self, Failure};
use crate::{device, in_root, tools};
use live::{Live, Walk};
use machine::{INSTRUCTIONS_PER_S, Running, free_port, machine};
use proxy::Proxy;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the emulated shoe keeps of the sensor that no board has: the twin and its walk.
const TWIN: [&str; 2] = ["TWIN", "WALK"];

/// Which walk the shoe takes, and where it is heard.
#[derive(clap::Args)]
pub struct Arguments {
    /// A recording that 'sohle convert' can read [default: a simulated walk]
    #[arg(value_name = "RECORDING")]
    recording: Option<PathBuf>,
    /// How 'sohle convert' reads the recording
    #[arg(long, value_name = "NAME|FILE.toml", requires = "recording")]
    profile: Option<String>,
    /// The walk that 'sohle simulate' makes
    #[arg(long, value_name = "PRESET", default_value = "demo", conflicts_with = "recording")]
    simulate: String,
    /// Seed of the simulated walk
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Walks recordings and a simulated walk, and compares what the emulated processor computes with what this one does, bit
    /// for bit; then a walk over a line that damages and loses, of which every step must arrive once
    #[arg(long, conflicts_with_all = ["recording", "port"])]
    check: bool,
    /// TCP port on this machine that is the shoe's serial line
    #[arg(long, default_value_t = 7_700)]
    port: u16,
    /// The shoe has Bluetooth, and a virtual radio with a laptop on it runs beside it; with --check, everything that can be
    /// checked of it is
    #[arg(long)]
    ble: bool,
}

/// Recordings that are walked by the check, as far as they are here: name in the folder of recordings, layout, seconds.
const RECORDINGS: [(&str, Option<&str>, u32); 2] =
    [("foot_xio/short_walk.csv", None, 46), ("foot_gaitmap/imu_sample.csv", Some("gaitmap-left"), 45)];
/// How long the simulated walk lasts in the check. **Units:** s.
const SIMULATED_S: u32 = 40;
/// The walk of that check, 4 s of rest before and after it included; from then on the foot stands. **Units:** s.
const SHORT_S: u32 = 24;
/// In the check of its sleep the shoe sleeps when it has stood so long. **Units:** s.
const SLEEP_AFTER_S: u32 = 3;
/// After that walk: to fall asleep, and to tell twice of it. **Units:** s.
const ASLEEP_S: u32 = SLEEP_AFTER_S + 15;

/// Runs the shoe until it is stopped.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match (arguments.check, arguments.ble) {
        (true, false) => return check(),
        (true, true) => return radio::check(),
        _ => tools::QEMU.required()?,
    }
    let sohle = process::build("dev", "--bin", "sohle")?;
    let folder = in_root("target/emulate");
    std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
    let walk = match &arguments.recording {
        Some(recording) => recording.clone(),
        None => simulated(&sohle, &folder, &arguments.simulate, arguments.seed)?,
    };
    let counts = converted(&sohle, &folder, &walk, arguments.profile.as_deref())?;
    if arguments.ble {
        return radio::run(&folder, &counts, arguments.port);
    }
    machine::build(&[])?;
    println!("the shoe waits for a laptop and walks as soon as it is there: in another terminal, run");
    println!("  cargo run --release -- live tcp:127.0.0.1:{}", arguments.port);
    println!("Ctrl-C ends it");
    process::run(&mut machine(arguments.port, &counts))
}

/// A simulated walk as a recording.
pub fn simulated(sohle: &Path, folder: &Path, preset: &str, seed: u64) -> Result<PathBuf, Failure> {
    let walk = folder.join("simulated.mcap");
    let mut command = Command::new(sohle);
    command.current_dir(crate::root()).args(["simulate", "--preset", preset, "--seed", &seed.to_string()]);
    process::read(command.arg("--out").arg(&walk))?;
    Ok(walk)
}

/// The recording as counts of the sensor's twin.
pub fn converted(sohle: &Path, folder: &Path, recording: &Path, profile: Option<&str>) -> Result<PathBuf, Failure> {
    let counts = folder.join("walk.counts");
    let mut command = Command::new(sohle);
    command.args(["convert", "--force"]).arg(recording).arg(&counts);
    if let Some(profile) = profile {
        command.args(["--profile", profile]);
    }
    process::read(&mut command)?;
    Ok(counts)
}

fn file(path: &Path, source: std::io::Error) -> Failure {
    Failure::File { path: path.display().to_string(), source }
}

/// The part of the summary of `sohle live` that matters here.
#[derive(serde::Deserialize)]
struct Summary {
    steps: u64,
    lost: u64,
    doubled: u64,
    frames_bad: u64,
    delay_median_ms: Option<f64>,
    delay_max_ms: Option<f64>,
    load: Option<u32>,
    stack: Option<u32>,
    waiting: Option<u32>,
    load_max: u32,
    raw: u64,
    raw_lost: u64,
    asleep: Option<bool>,
    sleeps: Option<u32>,
}

/// The bits of the emulated processor against this one's, and a walk over a bad line.
pub fn check() -> Result<(), Failure> {
    tools::QEMU.required()?;
    let sohle = process::build("dev", "--bin", "sohle")?;
    machine::build(&[])?;
    let folder = in_root("target/emulate");
    std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
    let statics = firmware::statics_without(&device::binary("sohle-shoe"), &TWIN)?;
    let mut stack = 0;
    let mut walks = Vec::new();
    for (name, profile, seconds) in RECORDINGS {
        let here = ["recordings", "../shared/recordings"].map(|folder| in_root(folder).join(name));
        match here.into_iter().find(|path| path.is_file()) {
            Some(path) => walks.push((name, path, profile, seconds)),
            None => println!("{name} is not here and is skipped"),
        }
    }
    walks.push(("a simulated walk", simulated(&sohle, &folder, "demo", 1)?, None, SIMULATED_S));

    println!("(delays are right on a machine that does nothing else: on others the emulated clock falls behind)");
    println!("walk                          steps  delay ms, median / longest  load 1/1000  stack");
    for (name, walk, profile, seconds) in &walks {
        let counts = converted(&sohle, &folder, walk, *profile)?;
        let live = folder.join("live.mcap");
        match std::fs::remove_file(&live) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => return Err(file(&live, source)),
            _ => {}
        }
        let port = free_port()?;
        let mut running = Running::start(port, &counts)?;
        let Walk { summary, .. } = live_walk(&sohle, &mut running, port, *seconds, |command| {
            command.arg("--raw").arg("--out").arg(&live);
        })?;
        drop(running);
        row(name, &summary);
        stack = stack.max(summary.stack.unwrap_or_default());
        if summary.frames_bad > 0 || summary.steps == 0 {
            return Err(Failure::Found(format!("{name}: {} steps, {} bad frames", summary.steps, summary.frames_bad)));
        }
        let again = process::read(
            Command::new(&sohle).args(["replay", "--headless"]).arg(&live).arg("--out").arg(folder.join("again")),
        )?;
        let told = again.out.lines().find(|line| line.contains("bit for bit"));
        println!("  {}", told.ok_or_else(|| Failure::Found(format!("{name}: nothing was computed again")))?);
    }
    let (_, walk, profile, seconds) = &walks[0];
    let bad = over_a_bad_line(&sohle, &converted(&sohle, &folder, walk, *profile)?, *seconds)?;
    let walk = folder.join("short.mcap");
    let mut command = Command::new(&sohle);
    command.args(["simulate", "--gait", "walk", "--strides", "10", "--out"]).arg(&walk);
    process::read(&mut command)?;
    let slept = asleep(&sohle, &folder, &converted(&sohle, &folder, &walk, None)?)?;
    within_budget(statics, stack.max(bad).max(slept), Budgets::read()?.wired)
}

/// All that the shoe needs of the RAM, against its budget. What the twin and the walk keep is left out, since no board has
/// either; the stack below the twin's driver is not. It holds the shoe itself, as on the boards.
fn within_budget(statics: u64, stack: u32, budget: Budget) -> Result<(), Failure> {
    let (ram, budget) = (statics + u64::from(stack), budget.ram);
    let told = format!("{statics} bytes of statics and {stack} of stack are {ram} of RAM, of {budget}");
    println!("  {told}");
    if stack > 0 && ram <= budget { Ok(()) } else { Err(Failure::Found(told)) }
}

/// A short walk with a sensor that sleeps soon: the shoe must sleep before and after it, and miss no step. What
/// the processor does then goes to the twin's readings for the most part, which no real board has to make. Tells the depth
/// of the stack.
fn asleep(sohle: &Path, folder: &Path, counts: &Path) -> Result<u32, Failure> {
    let parameters = |seconds: u32| {
        let path = folder.join("parameters.toml");
        let text = format!("sleep_after_s = {seconds}.0\n");
        std::fs::write(&path, text).map_err(|source| file(&path, source)).map(|()| path)
    };
    let walk = |sleep_after_s, seconds| {
        let parameters = parameters(sleep_after_s)?;
        let port = free_port()?;
        let mut running = Running::start(port, counts)?;
        let Walk { summary, .. } = live_walk(sohle, &mut running, port, seconds, |command| {
            command.arg("--no-record").arg("--parameters").arg(parameters);
        })?;
        Ok::<_, Failure>(summary)
    };
    let awake = walk(0, SHORT_S)?;
    let slept = walk(SLEEP_AFTER_S, SHORT_S + ASLEEP_S)?;
    row("ten strides, awake", &awake);
    row("the same, asleep before and after", &slept);
    let instructions = |load: u32| f64::from(load) * 1e-3 * INSTRUCTIONS_PER_S * 1e-6;
    let (busy, idle) = (instructions(slept.load_max), instructions(slept.load.unwrap_or_default()));
    let sleeps = slept.sleeps.unwrap_or_default();
    println!("  it slept {sleeps} times; {busy:.1} million instructions a second at most, {idle:.2} million asleep");
    if slept.asleep != Some(true) || slept.steps != awake.steps || sleeps == 0 || slept.lost + slept.doubled > 0 {
        let (steps, all) = (slept.steps, awake.steps);
        return Err(Failure::Found(format!("it slept {sleeps} times, and of {all} steps {steps} came")));
    }
    Ok(slept.stack.max(awake.stack).unwrap_or_default())
}

/// The first walk over a line that damages bytes and loses pieces, both ways: every step must arrive, once. Tells the depth
/// of the stack.
fn over_a_bad_line(sohle: &Path, counts: &Path, seconds: u32) -> Result<u32, Failure> {
    let (shoe, laptop) = (free_port()?, free_port()?);
    let mut running = Running::start(shoe, counts)?;
    let proxy =
        Proxy::start(laptop, shoe).map_err(|source| Failure::NotStarted { program: "the bad line".into(), source })?;
    // Time for what is sent again.
    let Walk { summary, .. } = live_walk(sohle, &mut running, laptop, seconds + 10, |command| {
        command.arg("--no-record");
    })?;
    let (damaged, lost) = proxy.faults();
    drop(running);
    row("the first over a bad line", &summary);
    println!("  the line damaged {damaged} bytes and lost {lost} pieces; {} frames were refused", summary.frames_bad);
    let waiting = summary.waiting.unwrap_or(u32::MAX);
    if summary.lost + summary.doubled + u64::from(waiting) > 0 || summary.steps == 0 || damaged == 0 || lost == 0 {
        return Err(Failure::Found(format!(
            "over a bad line {} steps came, {} were lost, {} came twice, {waiting} wait",
            summary.steps, summary.lost, summary.doubled
        )));
    }
    Ok(summary.stack.unwrap_or_default())
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

/// `sohle live` with `more` of its arguments, until the shoe's clock is so far.
fn live_walk(
    sohle: &Path,
    running: &mut Running,
    port: u16,
    seconds: u32,
    more: impl FnOnce(&mut Command),
) -> Result<Walk, Failure> {
    let live = Live::start(sohle, &format!("tcp:127.0.0.1:{port}"), more)?;
    running.pace.wait_until(seconds.into())?;
    live.finish()
}
