//! A `sohle live` that runs, with the time at which each of its lines came.

use super::Summary;
use crate::process::{self, Failure};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Asked to end, it does within this time, farewell to the shoe included.
const FAREWELL: Duration = Duration::from_secs(30);
/// It ends after this time, should nobody be left to ask it to. **Units:** s.
const LONGEST_S: &str = "900";

/// A step as it was told.
pub struct Told {
    /// When the line came.
    pub at: Instant,
    /// From the end of the stance by the clocks of shoe and laptop. **Units:** ms.
    pub delay_ms: Option<f64>,
    /// Everything that the shoe said of it.
    pub content: String,
}

/// What one `sohle live` was told.
pub struct Walk {
    /// By boot and number.
    pub steps: BTreeMap<(u64, u64), Told>,
    /// Its last line.
    pub summary: Summary,
}

/// The program while it runs; it is stopped when this is dropped.
pub struct Live {
    child: Child,
    lines: Option<JoinHandle<Vec<(Instant, String)>>>,
    errors: Option<JoinHandle<String>>,
}

impl Live {
    /// Starts it on an address, with `more` of its arguments and of its surroundings.
    pub fn start(sohle: &Path, address: &str, more: impl FnOnce(&mut Command)) -> Result<Self, Failure> {
        let mut command = Command::new(sohle);
        command.args(["live", address, "--for", LONGEST_S, "--format", "json", "--headless"]);
        more(&mut command);
        let started = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = started.map_err(|source| Failure::NotStarted { program: process::typed(&command), source })?;
        let (out, err) = (child.stdout.take(), child.stderr.take());
        let lines = thread::spawn(move || {
            let lines = out.into_iter().flat_map(|pipe| BufReader::new(pipe).lines().map_while(Result::ok));
            lines.map(|line| (Instant::now(), line)).collect()
        });
        let errors = thread::spawn(move || {
            let mut text = String::new();
            // What broke off is shown as far as it came.
            let _ = err.map(|mut pipe| pipe.read_to_string(&mut text));
            text
        });
        Ok(Self { child, lines: Some(lines), errors: Some(errors) })
    }

    /// Ends it as Ctrl-C does and tells what it heard.
    pub fn finish(mut self) -> Result<Walk, Failure> {
        if process::interrupt(&mut self.child, FAREWELL)?.is_none() {
            return Err(Failure::Found("sohle live does not end by Ctrl-C".into()));
        }
        let lines = self.lines.take().and_then(|lines| lines.join().ok()).unwrap_or_default();
        let errors = self.errors.take().and_then(|errors| errors.join().ok()).unwrap_or_default();
        let failed = |why: &str| Failure::Found(format!("{why}; sohle live said: {}", errors.trim()));
        let summary = lines.last().and_then(|(_, line)| serde_json::from_str(line).ok());
        let summary = summary.ok_or_else(|| failed("there is no summary"))?;
        let mut steps = BTreeMap::new();
        for (at, line) in &lines {
            let Some((key, told)) = step(*at, line) else { continue };
            if steps.insert(key, told).is_some() {
                return Err(failed(&format!("step {} of boot {} came twice", key.1, key.0)));
            }
        }
        Ok(Walk { steps, summary })
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        // Killing fails only for a child that has just ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A line as a step, if it is one.
fn step(at: Instant, line: &str) -> Option<((u64, u64), Told)> {
    let mut object: Value = serde_json::from_str(line).ok()?;
    if object.get("event")? != "step" {
        return None;
    }
    let key = (object.get("boot")?.as_u64()?, object.get("id")?.as_u64()?);
    let delay_ms = object.as_object_mut()?.remove("delay_ms").and_then(|delay| delay.as_f64());
    Some((key, Told { at, delay_ms, content: object.to_string() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_known_by_its_number_and_compared_without_its_delay() {
        let line = |delay: &str| {
            format!(r#"{{"event":"step","boot":7,"id":3,"stance_end_us":5000,"turn_rad":0.25,"delay_ms":{delay}}}"#)
        };
        let now = Instant::now();
        let ((key, soon), (_, late)) = (step(now, &line("12.5")).unwrap(), step(now, &line("null")).unwrap());
        assert_eq!((key, soon.delay_ms, late.delay_ms), ((7, 3), Some(12.5), None));
        assert_eq!(soon.content, late.content);
        assert!(step(now, r#"{"event":"summary","steps":3}"#).is_none());
    }
}
