//! The shoe, the radio and the laptop of the check, and what can be done with them.

use super::bus::Bus;
use super::program::{Ports, Radio};
use super::{built, folder, forget};
use crate::emulate::live::{Live, Walk};
use crate::emulate::machine::{Running, cable, emulator, free_port, line_to};
use crate::emulate::{RECORDINGS, SIMULATED_S, converted, simulated};
use crate::in_root;
use crate::process::{self, Failure};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// For programs that must fail soon.
const LIMIT: Duration = Duration::from_secs(60);

/// Shoe, radio and laptop, with what they keep.
pub struct Scene {
    /// The program of the laptop.
    pub sohle: PathBuf,
    /// The firmware.
    pub program: PathBuf,
    /// Where files go.
    pub folder: PathBuf,
    flash: PathBuf,
    bus: Bus,
    /// The radio.
    pub radio: Radio,
    /// The walk.
    pub counts: PathBuf,
    /// How long it takes. **Units:** s.
    pub seconds: u64,
    /// How deep the shoe's stack was so far. **Units:** bytes.
    pub stack: u32,
    /// A walk of more than ten minutes, when it has been computed.
    pub long: PathBuf,
}

impl Scene {
    /// Without a bond, and the shoe without power.
    pub fn prepare() -> Result<Self, Failure> {
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
        Ok(Self {
            sohle,
            program,
            folder,
            flash,
            bus,
            radio,
            counts,
            seconds: seconds.into(),
            stack: 0,
            long: PathBuf::new(),
        })
    }

    /// The shoe after its power has come, and the port of its cable.
    pub fn shoe(&self, speed: &str) -> Result<(Running, u16), Failure> {
        let port = free_port()?;
        let files = [self.counts.as_path(), self.flash.as_path()];
        let mut running = Running::of(|pace| {
            let lines = [cable(port, false), line_to(self.radio.ports.hci), pace];
            emulator(speed, &lines, &files, &self.program)
        })?;
        running.pace.wait_until(1)?;
        Ok((running, port))
    }

    /// What `sohle` says with these words, and whether it was content.
    pub fn sohle(&self, words: &[&str]) -> Result<(bool, String), Failure> {
        let mut command = Command::new(&self.sohle);
        self.bus.seen_by(command.args(words));
        let start = Instant::now();
        let ended = process::watch(&mut command, || start.elapsed() < LIMIT)?;
        Ok((ended.code == Some(0), ended.said.out + &ended.said.err))
    }

    /// Opens the pairing window over the cable, or closes it.
    pub fn window(&self, cable: &str, seconds: &str) -> Result<(), Failure> {
        match self.sohle(&["pair", cable, "--seconds", seconds])? {
            (true, _) => Ok(()),
            (false, said) => Err(wrong(format!("sohle pair on the cable said: {said}"))),
        }
    }

    /// A `sohle live` that listens, and records the counts of the sensor if a file is named.
    pub fn live(&self, address: &str, record: Option<&Path>) -> Result<Live, Failure> {
        Live::start(&self.sohle, address, |command| {
            match record {
                Some(path) => command.arg("--raw").arg("--out").arg(path),
                None => command.arg("--no-record"),
            };
            self.bus.seen_by(command);
        })
    }

    /// What was recorded, computed again.
    pub fn again(&self, recording: &Path) -> Result<String, Failure> {
        let mut command = Command::new(&self.sohle);
        command.args(["replay", "--headless"]).arg(recording).arg("--out").arg(self.folder.join("again"));
        let again = process::read(&mut command)?;
        let told = again.out.lines().find(|line| line.contains("bit for bit")).map(str::to_owned);
        told.ok_or_else(|| wrong(format!("nothing was computed again of {}", recording.display())))
    }

    /// Steps came, none is missing, none waits, none came twice.
    pub fn whole(&mut self, walk: &Walk, where_from: &str) -> Result<(), Failure> {
        let summary = &walk.summary;
        self.stack = self.stack.max(summary.stack.unwrap_or_default());
        let waiting = summary.waiting.unwrap_or(u32::MAX);
        if summary.lost + summary.doubled + summary.frames_bad + u64::from(waiting) == 0 && !walk.steps.is_empty() {
            return Ok(());
        }
        Err(wrong(format!(
            "{where_from}: {} steps came, {} were lost, {} came twice, {} frames were bad, {waiting} wait",
            summary.steps, summary.lost, summary.doubled, summary.frames_bad
        )))
    }
}

/// What must not be.
pub fn wrong(what: impl Into<String>) -> Failure {
    Failure::Found(what.into())
}
