//! Everything that can be checked of the shoe's Bluetooth without a board.

use super::figures::{Latencies, Lateness, Spread, carried, facts_in_words, number};
use super::forget;
use super::scene::{Scene, wrong};
use crate::emulate::live::Walk;
use crate::emulate::machine::SHIFT;
use crate::emulate::{TWIN, converted, file, within_budget};
use crate::firmware::{self, Budgets};
use crate::process::{self, Failure};
use crate::tools;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Four times as many instructions in a second, for the part in which the shoe hurries.
const STRONG: &str = "shift=2,sleep=on,align=on";
/// So soon after it is on the cable a step is on Bluetooth. **Units:** ms.
const SOON_MS: f64 = 50.0;
/// On a machine that lets no thread wait longer than this, each step is; on one that is busier, half of them are, since five
/// programs have to run one after the other for each. **Units:** ms.
const QUIET_MS: f64 = 10.0;
/// For connecting, and for what is sent again. **Units:** s.
const LONGER_S: u64 = 8;
/// Of the counts of the sensor so much is recorded over the radio. **Units:** s.
const COUNTS_S: u64 = 20;
/// Out of range for so many times ten seconds by the shoe's clock.
const OUT_TENS: u8 = 60;
/// From being out of range to when both ends have lost the connection: longer than its supervision timeout of 2 s.
const LOST: Duration = Duration::from_secs(4);
/// In range again, the laptop is connected within this time, however long it was away, and looked for so often.
const RETURN: Duration = Duration::from_secs(60);
const LOOK: Duration = Duration::from_millis(250);
/// Strides of the walk that is longer than that.
const LONG_WALK_STRIDES: &str = "640";
/// Packets of garbage from the controller, from a stranger, whose connection often ends by one, and from the paired laptop.
const GARBAGE: u32 = 400;
const GARBAGE_ON_AIR: u32 = 100;

/// Runs all of it.
pub fn check() -> Result<(), Failure> {
    tools::QEMU.required()?;
    let mut scene = Scene::prepare()?;
    let (sohle, folder) = (scene.sohle.clone(), scene.folder.join("long"));
    // Computed while the first part waits, and before delays are measured.
    let long = std::thread::spawn(move || long_walk(&sohle, &folder));
    timed(&mut scene, Scene::strangers_are_refused)?;
    scene.long = long.join().map_err(|_| wrong("the long walk was not computed"))??;
    timed(&mut scene, Scene::both_lines_get_every_step)?;
    timed(&mut scene, Scene::raw_counts_come)?;
    timed(&mut scene, Scene::garbage_stops_nothing)?;
    timed(&mut scene, Scene::out_of_range_and_back)?;
    within_budget(firmware::statics_without(&scene.program, &TWIN)?, scene.stack, Budgets::read()?.ble)
}

/// A part of the check, with the time that it takes.
fn timed(scene: &mut Scene, part: fn(&mut Scene) -> Result<(), Failure>) -> Result<(), Failure> {
    let begun = Instant::now();
    part(scene)?;
    println!("  (in {:.0} s)", begun.elapsed().as_secs_f64());
    Ok(())
}

impl Scene {
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
        let (mut running, cable) = self.shoe(SHIFT)?;
        let recording = self.folder.join("cable.mcap");
        forget(&recording)?;
        let begun = running.pace.seconds()?;
        let wired = self.live(&format!("tcp:127.0.0.1:{cable}"), Some(&recording))?;
        let wireless = self.live("ble:any", None)?;
        running.pace.wait_until(begun + LONGER_S)?;
        let lateness = Lateness::measure();
        running.pace.wait_until(begun + self.seconds + LONGER_S)?;
        let late = lateness.longest_ms();
        let figures = self.radio.order("figures")?;
        let (wired, wireless) = (wired.finish()?, wireless.finish()?);
        self.whole(&wired, "the cable")?;
        self.whole(&wireless, "Bluetooth")?;
        let steps = same(&wired, &wireless)?;
        println!("power cut: reconnected with the bond that the flash kept, without pairing");
        println!("cable and Bluetooth at once: {steps} steps on both, the same and once");
        println!("  {}", self.again(&recording)?);
        let latencies = Latencies::of(&wired, &wireless);
        let (quiet, Spread { median, longest, .. }) = (late <= QUIET_MS, &latencies.more);
        if quiet {
            println!("  step after the end of its stance, on the cable: {}", latencies.wired);
            println!("  the same on Bluetooth: {}", latencies.wireless);
        } else {
            println!(
                "  (this machine is too busy for the shoe's clock to be that of the room, by which delays are told)"
            );
        }
        println!("  step on Bluetooth after the same on the cable: {}", latencies.more);
        println!("  on the radio: {}", carried(&figures));
        let (what, is) = if quiet { ("the longest", *longest) } else { ("half of them", *median) };
        println!("  this machine let a thread wait for {late:.1} ms at most, so {what} must be within {SOON_MS} ms");
        if is > SOON_MS {
            return Err(wrong(format!("Bluetooth takes {is:.1} ms for a step")));
        }
        Ok(())
    }

    /// The counts of the sensor at 2 kHz over the radio, as far as they come.
    fn raw_counts_come(&mut self) -> Result<(), Failure> {
        let (mut running, _) = self.shoe(SHIFT)?;
        let recording = self.folder.join("radio.mcap");
        forget(&recording)?;
        let live = self.live("ble:any", Some(&recording))?;
        let begun = running.pace.seconds()? + LONGER_S;
        running.pace.wait_until(begun)?;
        // What was before the counts is not of interest.
        self.radio.ask("figures")?;
        running.pace.wait_until(begun + COUNTS_S)?;
        let figures = self.radio.order("figures")?;
        let walk = live.finish()?;
        self.whole(&walk, "Bluetooth with counts")?;
        let (raw, lost) = (walk.summary.raw, walk.summary.raw_lost);
        let share = 100.0 * raw as f64 / (raw + lost).max(1) as f64;
        println!("counts at 2 kHz over the radio: {raw} messages came and {lost} did not, {share:.1} %");
        println!("  {}", carried(&figures));
        println!("  {}", self.again(&recording)?);
        Ok(())
    }

    /// Arbitrary packets from the controller, from a stranger and from the laptop that has paired, and a stranger's commands,
    /// while the cable records.
    fn garbage_stops_nothing(&mut self) -> Result<(), Failure> {
        let (mut running, cable) = self.shoe(SHIFT)?;
        let recording = self.folder.join("garbage.mcap");
        forget(&recording)?;
        let begun = running.pace.seconds()?;
        let live = self.live(&format!("tcp:127.0.0.1:{cable}"), Some(&recording))?;
        self.radio.order("stranger-commands")?;
        let stranger = format!("tcp:127.0.0.1:{}", self.radio.ports.stranger);
        let (content, said) = self.sohle(&["command", &stranger, "reset"])?;
        if content {
            return Err(wrong(format!("a stranger's command was carried out: {said}")));
        }
        self.radio.ask("stranger-leave")?;
        let stranger = self.radio.order(&format!("garbage-stranger {GARBAGE_ON_AIR}"))?;
        let laptop = self.radio.order(&format!("garbage-laptop {GARBAGE_ON_AIR}"))?;
        self.radio.order(&format!("garbage-controller {GARBAGE}"))?;
        running.pace.wait_until(begun + self.seconds + LONGER_S)?;
        let walk = live.finish()?;
        self.whole(&walk, "the cable under garbage")?;
        let times = |sent: &Value| number(sent, "connections");
        println!(
            "a stranger's commands were not carried out; {GARBAGE_ON_AIR} packets of garbage from a stranger over"
        );
        println!(
            "  {} connections, {GARBAGE_ON_AIR} from the paired laptop over {}, and {GARBAGE} from the controller",
            times(&stranger),
            times(&laptop)
        );
        println!("  cost no step: {} came", walk.steps.len());
        println!("  {}", self.again(&recording)?);
        // Sooner or later it is back.
        let facts = (0..3).map(|_| self.radio.order("connect")).find_map(Result::ok);
        let facts = facts.ok_or_else(|| wrong("after the garbage the shoe does not answer on Bluetooth"))?;
        self.radio.order("leave")?;
        println!("  and Bluetooth works again ({})", facts_in_words(&facts));
        Ok(())
    }

    /// Ten minutes of walking out of range: every step comes afterwards, once, as the cable had it at once.
    ///
    /// While the laptop is away the shoe hurries: its ten minutes take as long as this machine has to compute for them.
    /// Whenever something passes over the radio, the shoe's time is the room's.
    fn out_of_range_and_back(&mut self) -> Result<(), Failure> {
        self.counts.clone_from(&self.long);
        let (mut running, cable) = self.shoe(STRONG)?;
        let wireless = self.live("ble:any", None)?;
        let wired = self.live(&format!("tcp:127.0.0.1:{cable}"), None)?;
        let near = running.pace.seconds()? + 2 * LONGER_S;
        running.pace.wait_until(near)?;
        self.radio.order("out")?;
        sleep(LOST);
        if self.radio.ask("figures")?.get("fault").is_none() {
            return Err(wrong("the laptop is connected though it is out of range"));
        }
        let out = Instant::now();
        let out_s = running.pace.seconds()?;
        running.pace.hurry(OUT_TENS)?;
        let (back, back_s) = (Instant::now(), running.pace.seconds()?);
        self.radio.order("in")?;
        while self.radio.ask("figures")?.get("fault").is_some() {
            if back.elapsed() > RETURN {
                return Err(wrong("the laptop is in range again, but does not connect"));
            }
            sleep(LOOK);
        }
        let connected = back.elapsed().as_secs_f64();
        let near = running.pace.seconds()? + 2 * LONGER_S;
        running.pace.wait_until(near)?;
        let (wired, wireless) = (wired.finish()?, wireless.finish()?);
        self.whole(&wired, "the cable")?;
        self.whole(&wireless, "Bluetooth after a time out of range")?;
        let steps = same(&wired, &wireless)?;
        let came = |walk: &Walk| walk.steps.values().filter(|step| (out..back).contains(&step.at)).count();
        let (away, heard) = (came(&wired), came(&wireless));
        println!(
            "out of range for {} s by the shoe's clock ({:.0} s of the room's) and back: {away} steps were made meanwhile",
            back_s - out_s,
            (back - out).as_secs_f64()
        );
        println!("  and came then, each once and as the cable had it at once; {steps} on both in all");
        println!("  the laptop was connected {connected:.1} s after it was in range again");
        // A stride takes no longer than 1.2 s.
        let least = usize::from(OUT_TENS) * 10 * 10 / 12;
        if heard > 0 || away < least {
            return Err(wrong(format!(
                "out of range, {heard} steps came by Bluetooth and {away} of {least} on the cable"
            )));
        }
        Ok(())
    }
}

/// Counts of a walk of more than ten minutes.
fn long_walk(sohle: &Path, folder: &Path) -> Result<PathBuf, Failure> {
    std::fs::create_dir_all(folder).map_err(|source| file(folder, source))?;
    let walk = folder.join("long.mcap");
    let mut command = Command::new(sohle);
    command.args(["simulate", "--gait", "walk", "--strides", LONG_WALK_STRIDES, "--out"]).arg(&walk);
    process::read(&mut command)?;
    let counts = converted(sohle, folder, &walk, None)?;
    forget(&walk)?;
    Ok(counts)
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
}
