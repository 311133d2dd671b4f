//! Everything that can be checked of the shoe's Bluetooth without a board.

use super::bus::Bus;
use super::program::{Ports, Radio};
use super::walk::{Live, Told, Walk};
use super::{built, folder, forget, machine};
use crate::emulate::machine::{Running, SHIFT, free_port};
use crate::emulate::{RECORDINGS, SIMULATED_S, converted, simulated};
use crate::process::{self, Failure};
use crate::{in_root, tools};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// As many instructions as this machine can, in no real time.
const FAST: &str = "shift=4,sleep=off";
/// 99 % of what a step is made of get over the radio within this time. **Units:** ms.
const SOON_MS: f64 = 50.0;
/// Half of the steps are at a program on Bluetooth so soon after they are at one on the cable, though this machine runs the
/// processor, the radio and both programs, and perhaps more. **Units:** ms.
const BUSY_MS: f64 = 2.0 * SOON_MS;
/// For connecting, and for what is sent again. **Units:** s.
const LONGER_S: u32 = 12;
/// For programs that must fail soon.
const LIMIT: Duration = Duration::from_secs(60);
/// Out of range for so long by the shoe's clock. **Units:** s.
const OUT_S: f64 = 600.0;
/// Strides of the walk that is longer than that.
const LONG_WALK_STRIDES: &str = "640";
/// Packets of garbage from the controller, and from a stranger, whose connection often ends by one.
const GARBAGE: u32 = 400;
const GARBAGE_ON_AIR: u32 = 100;

/// Shoe, radio and laptop, with what they keep.
struct Scene {
    sohle: PathBuf,
    program: PathBuf,
    folder: PathBuf,
    flash: PathBuf,
    bus: Bus,
    radio: Radio,
    /// The walk, and how long it takes. **Units:** s.
    counts: PathBuf,
    seconds: u32,
}

/// Runs all of it.
pub fn check() -> Result<(), Failure> {
    tools::QEMU.required()?;
    let mut scene = Scene::prepare()?;
    scene.strangers_are_refused()?;
    scene.both_lines_get_every_step()?;
    scene.raw_counts_come()?;
    scene.garbage_stops_nothing()?;
    scene.out_of_range_and_back()
}

fn wrong(what: impl Into<String>) -> Failure {
    Failure::Found(what.into())
}

impl Scene {
    fn prepare() -> Result<Self, Failure> {
        let sohle = process::build("dev", "--bin", "sohle")?;
        let folder = folder()?;
        let (flash, keys) = (folder.join("flash.bin"), folder.join("laptop.json"));
        forget(&flash)?;
        forget(&keys)?;
        let program = built(&folder)?;
        let (name, profile, seconds) = RECORDINGS[0];
        let here = ["recordings", "../shared/recordings"].map(|folder| in_root(folder).join(name));
        let (walk, profile, seconds) = match here.into_iter().find(|path| path.is_file()) {
            Some(path) => (path, profile, seconds),
            None => {
                println!("{name} is not here; a simulated walk stands for it");
                (simulated(&sohle, &folder, "demo", 1)?, None, SIMULATED_S)
            }
        };
        let counts = converted(&sohle, &folder, &walk, profile)?;
        let bus = Bus::start(&folder)?;
        let radio = Radio::start(Ports::free()?, &keys, Some(&bus))?;
        Ok(Self { sohle, program, folder, flash, bus, radio, counts, seconds })
    }

    /// The shoe after its power has come, and the port of its cable.
    fn shoe(&self, pace: &str) -> Result<(Running, u16), Failure> {
        let cable = free_port()?;
        let files = [self.counts.as_path(), self.flash.as_path()];
        let running = Running::of(machine(pace, cable, self.radio.ports.hci, &files, &self.program))?;
        // The cable's port opens with the emulator.
        sleep(Duration::from_secs(2));
        Ok((running, cable))
    }

    /// What `sohle` says with these words, and whether it was content.
    fn sohle(&self, words: &[&str]) -> Result<(bool, String), Failure> {
        let mut command = Command::new(&self.sohle);
        self.bus.seen_by(command.args(words));
        let start = Instant::now();
        let ended = process::watch(&mut command, || start.elapsed() < LIMIT)?;
        Ok((ended.code == Some(0), ended.said.out + &ended.said.err))
    }

    /// Opens the pairing window over the cable, or closes it.
    fn window(&self, cable: &str, seconds: &str) -> Result<(), Failure> {
        match self.sohle(&["pair", cable, "--seconds", seconds])? {
            (true, _) => Ok(()),
            (false, said) => Err(wrong(format!("sohle pair on the cable said: {said}"))),
        }
    }

    fn live(&self, address: &str, seconds: u32, record: Option<&Path>) -> Result<Live, Failure> {
        Live::start(&self.sohle, address, seconds, record, &self.bus)
    }

    /// What was recorded, computed again.
    fn again(&self, recording: &Path) -> Result<String, Failure> {
        let mut command = Command::new(&self.sohle);
        command.args(["replay", "--headless"]).arg(recording).arg("--out").arg(self.folder.join("again"));
        let again = process::read(&mut command)?;
        let told = again.out.lines().find(|line| line.contains("bit for bit")).map(str::to_owned);
        told.ok_or_else(|| wrong(format!("nothing was computed again of {}", recording.display())))
    }

    /// Nobody is let in before the window was opened, and then only who pairs.
    fn strangers_are_refused(&mut self) -> Result<(), Failure> {
        let (_running, cable) = self.shoe(SHIFT)?;
        let said = self.radio.order("stranger")?;
        refused_everything(&said)?;
        if self.radio.ask("pair")?.get("fault").is_none() {
            return Err(wrong("the laptop could pair though the window was closed"));
        }
        let (content, said) = self.sohle(&["live", "ble:any", "--for", "12", "--no-record", "--headless"])?;
        if content || !said.contains("is not paired with this laptop") {
            return Err(wrong(format!("sohle live, not paired, said: {said}")));
        }
        println!("closed window: no pairing, and nothing read, subscribed or written without");
        let cable = format!("tcp:127.0.0.1:{cable}");
        self.window(&cable, "60")?;
        let facts = self.radio.order("pair")?;
        self.radio.order("leave")?;
        println!("window opened over the cable: paired ({})", facts_in_words(&facts));
        self.window(&cable, "0")?;
        refused_everything(&self.radio.order("stranger")?)?;
        let (content, said) = self.sohle(&["pair", "ble:any"])?;
        if content || !said.contains("refused") {
            return Err(wrong(format!("sohle pair over Bluetooth must be refused, and said: {said}")));
        }
        Ok(())
    }

    /// After a power cut, with the cable and Bluetooth at once: every step on both, the same, once, soon.
    fn both_lines_get_every_step(&mut self) -> Result<(), Failure> {
        let (_running, cable) = self.shoe(SHIFT)?;
        let recording = self.folder.join("cable.mcap");
        forget(&recording)?;
        let seconds = self.seconds + LONGER_S;
        let wired = self.live(&format!("tcp:127.0.0.1:{cable}"), seconds, Some(&recording))?;
        let wireless = self.live("ble:any", seconds, None)?;
        sleep(Duration::from_secs(u64::from(self.seconds)));
        let figures = self.radio.order("figures")?;
        let (wired, wireless) = (wired.finish()?, wireless.finish()?);
        whole(&wired, "the cable")?;
        whole(&wireless, "Bluetooth")?;
        let steps = same(&wired, &wireless)?;
        println!("power cut: reconnected with the bond that the flash kept, without pairing");
        println!("cable and Bluetooth at once: {steps} steps on both, the same and once");
        println!("  {}", self.again(&recording)?);
        let latencies = Latencies::of(&wired, &wireless);
        println!("  step after the end of its stance, on the cable: {}", latencies.wired);
        println!("  the same on Bluetooth: {}", latencies.wireless);
        println!("  of which Bluetooth: {}", latencies.more);
        println!("  on the radio: {}", carried(&figures));
        // The longest is that of a program which had to wait for this machine, not of the radio.
        let (median, radio) = (latencies.more.median, number(&figures, "wait_99_ms"));
        if median > BUSY_MS || radio > SOON_MS {
            return Err(wrong(format!("Bluetooth takes {median:.1} ms for a step, {radio:.1} ms of it on the radio")));
        }
        Ok(())
    }

    /// The counts of the sensor at 2 kHz over the radio, as far as they come.
    fn raw_counts_come(&mut self) -> Result<(), Failure> {
        let (_running, _) = self.shoe(SHIFT)?;
        let recording = self.folder.join("radio.mcap");
        forget(&recording)?;
        let live = self.live("ble:any", self.seconds + LONGER_S, Some(&recording))?;
        sleep(Duration::from_secs(u64::from(LONGER_S)));
        // What was before the counts is not of interest.
        self.radio.ask("figures")?;
        sleep(Duration::from_secs(u64::from(self.seconds - LONGER_S)));
        let figures = self.radio.order("figures")?;
        let walk = live.finish()?;
        whole(&walk, "Bluetooth with counts")?;
        let (raw, lost) = (walk.summary.raw, walk.summary.raw_lost);
        let share = 100.0 * raw as f64 / (raw + lost).max(1) as f64;
        println!("counts at 2 kHz over the radio: {raw} messages came and {lost} did not, {share:.1} %");
        println!("  {}", carried(&figures));
        println!("  {}", self.again(&recording)?);
        Ok(())
    }

    /// Arbitrary packets from the controller and a stranger, and a stranger's commands, while the cable records.
    fn garbage_stops_nothing(&mut self) -> Result<(), Failure> {
        let (_running, cable) = self.shoe(SHIFT)?;
        let recording = self.folder.join("garbage.mcap");
        forget(&recording)?;
        let live = self.live(&format!("tcp:127.0.0.1:{cable}"), self.seconds + LONGER_S, Some(&recording))?;
        sleep(Duration::from_secs(4));
        self.radio.order("stranger-commands")?;
        let stranger = format!("tcp:127.0.0.1:{}", self.radio.ports.stranger);
        let (content, said) = self.sohle(&["command", &stranger, "reset"])?;
        if content {
            return Err(wrong(format!("a stranger's command was carried out: {said}")));
        }
        self.radio.ask("stranger-leave")?;
        let sent = self.radio.order(&format!("garbage-peer {GARBAGE_ON_AIR}"))?;
        self.radio.order(&format!("garbage-controller {GARBAGE}"))?;
        let walk = live.finish()?;
        whole(&walk, "the cable under garbage")?;
        let (times, steps) = (number(&sent, "connections"), walk.steps.len());
        println!(
            "a stranger's commands were not carried out; {GARBAGE_ON_AIR} packets of garbage from a stranger, over {times}"
        );
        println!("  connections, and {GARBAGE} from the controller cost no step: {steps} came");
        println!("  {}", self.again(&recording)?);
        // Sooner or later it is back.
        let facts = (0..3).map(|_| self.radio.order("connect")).find_map(Result::ok);
        let facts = facts.ok_or_else(|| wrong("after the garbage the shoe does not answer on Bluetooth"))?;
        self.radio.order("leave")?;
        println!("  and Bluetooth works again ({})", facts_in_words(&facts));
        Ok(())
    }

    /// Ten minutes of walking out of range: every step comes afterwards, once.
    fn out_of_range_and_back(&mut self) -> Result<(), Failure> {
        let walk = self.folder.join("long.mcap");
        let mut command = Command::new(&self.sohle);
        command.args(["simulate", "--gait", "walk", "--strides", LONG_WALK_STRIDES, "--out"]).arg(&walk);
        process::read(&mut command)?;
        self.counts = converted(&self.sohle, &self.folder, &walk, None)?;
        let (_running, _) = self.shoe(FAST)?;
        let live = self.live("ble:any", 200, None)?;
        sleep(Duration::from_secs(15));
        let out = Instant::now();
        self.radio.order("out")?;
        sleep(Duration::from_secs(120));
        let back = Instant::now();
        self.radio.order("in")?;
        let walk = live.finish()?;
        whole(&walk, "Bluetooth after a time out of range")?;
        let last = |came: &dyn Fn(Instant) -> bool| {
            walk.steps.values().filter(|step| came(step.at)).map(|step| step.stance_end_us).max()
        };
        let before = last(&|at| at < out + Duration::from_secs(1));
        let kept = last(&|at| at > back && at < back + Duration::from_secs(20));
        let (Some(before), Some(kept)) = (before, kept) else {
            return Err(wrong("no steps came before or after the time out of range"));
        };
        let away_s = (kept - before) as f64 * 1e-6;
        let waited = walk.steps.values().filter(|step| (before + 1..=kept).contains(&step.stance_end_us)).count();
        println!(
            "out of range for {away_s:.0} s by the shoe's clock (which ran faster than the room's) and back: {waited} steps"
        );
        println!("  waited and came, each once; {} in all", walk.steps.len());
        if away_s < OUT_S {
            return Err(wrong(format!(
                "only {away_s:.0} s of {OUT_S:.0} have passed out of range: this machine is too slow"
            )));
        }
        Ok(())
    }
}

/// Every attempt of the stranger was refused.
fn refused_everything(said: &Value) -> Result<(), Failure> {
    let attempts = ["read", "subscribe", "subscribe_uart", "write", "write_uart", "pair"];
    let told = |what: &str| said.get(what).and_then(Value::as_str).unwrap_or("nothing").to_owned();
    let allowed: Vec<&str> =
        attempts.into_iter().filter(|what| matches!(told(what).as_str(), "allowed" | "nothing")).collect();
    let notified = said.get("notified").and_then(Value::as_u64);
    if allowed.is_empty() && notified == Some(0) {
        return Ok(());
    }
    Err(wrong(format!("a stranger was not refused: {} (it said {said})", allowed.join(", "))))
}

/// Steps came, none is missing, none waits, none came twice.
fn whole(walk: &Walk, where_from: &str) -> Result<(), Failure> {
    let summary = &walk.summary;
    let waiting = summary.waiting.unwrap_or(u32::MAX);
    if summary.lost + summary.doubled + summary.frames_bad + u64::from(waiting) == 0 && !walk.steps.is_empty() {
        return Ok(());
    }
    Err(wrong(format!(
        "{where_from}: {} steps came, {} were lost, {} came twice, {} frames were bad, {waiting} wait",
        summary.steps, summary.lost, summary.doubled, summary.frames_bad
    )))
}

/// The same steps on both lines, to the last bit, from when both were connected; tells how many.
///
/// A step that was made, and acknowledged, before the other laptop was there is not kept for it.
fn same(wired: &Walk, wireless: &Walk) -> Result<usize, Failure> {
    let begin = wired.steps.keys().next().max(wireless.steps.keys().next()).copied().unwrap_or_default();
    let both =
        |walk: &Walk| walk.steps.range(begin..).map(|(key, told)| (*key, told.content.clone())).collect::<Vec<_>>();
    let (left, right) = (both(wired), both(wireless));
    if let Some((one, other)) = left.iter().zip(&right).find(|(one, other)| one != other) {
        return Err(wrong(format!("not the same on the cable: {}, and on Bluetooth: {}", one.1, other.1)));
    }
    if left.len() != right.len() || 2 * left.len() < wired.steps.len().max(wireless.steps.len()) {
        return Err(wrong(format!("{} steps on the cable, {} on Bluetooth", left.len(), right.len())));
    }
    Ok(left.len())
}

/// Times of many steps. **Units:** ms.
struct Spread {
    median: f64,
    almost_all: f64,
    longest: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (values.len() as f64 * share) as usize;
            values.get(index.min(values.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
        };
        Self { median: at(0.5), almost_all: at(0.99), longest: at(1.0) }
    }
}

impl std::fmt::Display for Spread {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { median, almost_all, longest } = self;
        write!(out, "{median:.1} ms (median), {almost_all:.1} ms (99 %), {longest:.1} ms (longest)")
    }
}

/// How late steps come. The clock of the shoe is known well over the cable only: what Bluetooth takes longer is the time
/// between the lines of the two programs.
struct Latencies {
    wired: Spread,
    wireless: Spread,
    more: Spread,
}

impl Latencies {
    fn of(wired: &Walk, wireless: &Walk) -> Self {
        let pairs = || wired.steps.iter().filter_map(|(key, told)| Some((told, wireless.steps.get(key)?)));
        let more = |(wired, wireless): (&Told, &Told)| {
            let later = wireless.at.saturating_duration_since(wired.at).as_secs_f64();
            (later - wired.at.saturating_duration_since(wireless.at).as_secs_f64()) * 1e3
        };
        Self {
            wired: Spread::of(wired.steps.values().filter_map(|told| told.delay_ms)),
            wireless: Spread::of(pairs().filter_map(|pair| Some(pair.0.delay_ms? + more(pair)))),
            more: Spread::of(pairs().map(more)),
        }
    }
}

fn number(value: &Value, name: &str) -> f64 {
    value.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

fn facts_in_words(facts: &Value) -> String {
    let phy = facts.get("phy").and_then(Value::as_str).unwrap_or("?");
    format!(
        "interval {} ms, latency {}, MTU {}, {} bytes to a packet, {phy}",
        number(facts, "interval_ms"),
        number(facts, "latency"),
        number(facts, "mtu"),
        number(facts, "octets")
    )
}

fn carried(figures: &Value) -> String {
    format!(
        "{:.1} kB/s from the shoe; a packet waited {:.1} ms (median), {:.1} ms (99 %), {:.1} ms (longest) for its turn ({})",
        number(figures, "from_shoe") / number(figures, "seconds") * 1e-3,
        number(figures, "wait_median_ms"),
        number(figures, "wait_99_ms"),
        number(figures, "wait_longest_ms"),
        facts_in_words(figures)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn one_thing_that_a_stranger_may_is_too_much() {
        let mut said = json!({
            "read": "INSUFFICIENT_AUTHENTICATION", "subscribe": "INSUFFICIENT_AUTHENTICATION", "subscribe_uart": "x",
            "write": "x", "write_uart": "x", "pair": "PAIRING_NOT_SUPPORTED", "notified": 0,
        });
        assert!(refused_everything(&said).is_ok());
        said["write"] = "allowed".into();
        assert!(refused_everything(&said).unwrap_err().to_string().starts_with("a stranger was not refused: write "));
        assert!(refused_everything(&json!({ "notified": 0 })).is_err());
    }

    #[test]
    fn a_spread_is_of_sorted_values() {
        let spread = Spread::of((0..200).rev().map(f64::from));
        assert_eq!((spread.median, spread.almost_all, spread.longest), (100.0, 198.0, 199.0));
        assert!(Spread::of(std::iter::empty()).median.is_nan());
    }
}
