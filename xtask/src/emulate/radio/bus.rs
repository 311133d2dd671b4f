//! A D-Bus of our own, on which the virtual radio stands for BlueZ.

use super::super::file;
use crate::process::{self, Failure};
use crate::tools;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A bus that is not there after this time does not come.
const PATIENCE: Duration = Duration::from_secs(10);

/// The bus; it ends when this is dropped.
pub struct Bus {
    child: Child,
    address: String,
}

impl Bus {
    /// Starts it in this folder.
    pub fn start(folder: &Path) -> Result<Self, Failure> {
        tools::DBUS.required()?;
        let (settings, socket) = (folder.join("bus.conf"), folder.join("bus"));
        let address = format!("unix:path={}", socket.display());
        let text = format!(
            "<busconfig><listen>{address}</listen><auth>EXTERNAL</auth><policy context=\"default\"><allow own=\"*\"/>\
             <allow send_destination=\"*\"/><allow receive_sender=\"*\"/></policy></busconfig>\n"
        );
        std::fs::write(&settings, text).map_err(|source| file(&settings, source))?;
        // One of an earlier run.
        let _ = std::fs::remove_file(&socket);
        let words = [format!("--config-file={}", settings.display()), "--nofork".into()];
        let started = process::program("dbus-daemon", words).stdin(Stdio::null()).stderr(Stdio::null()).spawn();
        let child = started.map_err(|source| Failure::NotStarted { program: "dbus-daemon".into(), source })?;
        let bus = Self { child, address };
        let until = Instant::now() + PATIENCE;
        while !socket.exists() {
            if Instant::now() > until {
                return Err(Failure::Found("dbus-daemon opens no socket".into()));
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(bus)
    }

    /// Where it is reached.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// A command for which this is the system's bus.
    pub fn seen_by(&self, command: &mut Command) {
        command.env("DBUS_SYSTEM_BUS_ADDRESS", &self.address);
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        // Killing fails only for a child that has just ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
