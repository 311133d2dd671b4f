//! The emulated microcontroller: its firmware, and the emulator while it runs.

use super::pace::Pace;
use crate::process::{self, Failure};
use crate::{device, in_root};
use std::collections::BTreeSet;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// Virtual nanoseconds of an instruction, as a power of two: 62.5 million instructions in a second, about what a Cortex-M4F
/// at 64 MHz executes.
pub const SHIFT: &str = "shift=4,sleep=on,align=on";

/// Instructions of the emulated processor in a second, by [`SHIFT`].
pub const INSTRUCTIONS_PER_S: f64 = 62.5e6;

/// Builds the firmware for the emulator, with these features.
pub fn build(features: &[&str]) -> Result<(), Failure> {
    let mut command = device::Route::find()?.build(&in_root("firmware/emulator"));
    process::run(command.args(["--bin", "sohle-shoe", "--features", &features.join(",")]))
}

/// The emulator with the shoe in it. It waits for the first connection to its port.
pub fn machine(port: u16, counts: &Path) -> Command {
    emulator(SHIFT, &[cable(port, true)], &[counts], &device::binary("sohle-shoe"))
}

/// A serial line that whoever connects to this port is at the other end of. What is written goes at once: by default the
/// emulator's system waits up to 40 ms for more.
pub fn cable(port: u16, wait: bool) -> String {
    format!("tcp:127.0.0.1:{port},server=on,wait={},nodelay=on", if wait { "on" } else { "off" })
}

/// A serial line to who listens on this port, in the same way.
pub fn line_to(port: u16) -> String {
    format!("tcp:127.0.0.1:{port},nodelay=on")
}

/// The emulator at this pace, with these serial lines, running `program` with the names of these files.
pub fn emulator(pace: &str, serials: &[String], files: &[&Path], program: &Path) -> Command {
    let words = "-machine mps2-an386 -display none -monitor none";
    let mut command = process::program("qemu-system-arm", words.split_whitespace());
    command.args(["-icount", pace]);
    for serial in serials {
        command.args(["-serial", serial]);
    }
    // The command line of the emulated program is cut at spaces, the paths are not.
    let mut semihosting = String::from("enable=on,target=native,arg=sohle-shoe");
    for path in files {
        semihosting += &format!(",arg={}", path.display().to_string().replace(',', ",,"));
    }
    command.args(["-semihosting-config", &semihosting]).arg("-kernel").arg(program);
    command
}

/// The emulator while it runs.
pub struct Running {
    child: Child,
    /// The shoe's time.
    pub pace: Pace,
}

impl Running {
    /// Starts it with the counts that its sensor gives.
    pub fn start(port: u16, counts: &Path) -> Result<Self, Failure> {
        let program = device::binary("sohle-shoe");
        Self::of(|pace| emulator(SHIFT, &[cable(port, true), "null".into(), pace], &[counts], &program))
    }

    /// Starts the one that has this as its third serial line.
    pub fn of(emulator: impl FnOnce(String) -> Command) -> Result<Self, Failure> {
        let pace = Pace::listen()?;
        let mut command = emulator(line_to(pace.port()?));
        // It tells that it waits, and when this machine is too slow for real time.
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let child = child.map_err(|source| Failure::NotStarted { program: "qemu-system-arm".into(), source })?;
        Ok(Self { child, pace })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Killing fails only for a child that has just ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A port that nobody listens on now, and that was not told before: who asked for that one may not listen yet.
pub fn free_port() -> Result<u16, Failure> {
    static TOLD: Mutex<BTreeSet<u16>> = Mutex::new(BTreeSet::new());
    let failed = |error: std::io::Error| Failure::Found(format!("no free port: {error}"));
    loop {
        let port = TcpListener::bind("127.0.0.1:0").and_then(|it| it.local_addr()).map_err(failed)?.port();
        if TOLD.lock().unwrap_or_else(PoisonError::into_inner).insert(port) {
            return Ok(port);
        }
    }
}
