//! The virtual radio while it runs, and the orders that it takes.

use super::bus::Bus;
use super::python;
use crate::emulate::machine::free_port;
use crate::in_root;
use crate::process::{self, Failure};
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// An order is answered within this time, or the radio hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// The ports of the radio on this machine.
#[derive(Clone, Copy)]
pub struct Ports {
    /// Where the shoe's HCI line goes.
    pub hci: u16,
    /// Where the laptop's connection to the shoe is.
    pub bridge: u16,
    /// From where commands go to the shoe without a bond.
    pub stranger: u16,
}

impl Ports {
    /// Ports that nobody uses now.
    pub fn free() -> Result<Self, Failure> {
        Ok(Self { hci: free_port()?, bridge: free_port()?, stranger: free_port()? })
    }
}

/// The radio; it ends when this is dropped.
pub struct Radio {
    child: Child,
    orders: ChildStdin,
    lines: Receiver<Value>,
    /// Where it can be reached.
    pub ports: Ports,
}

impl Radio {
    /// Starts it, with the laptop's bonds in the file `keys`, and waits until it can be reached.
    pub fn start(ports: Ports, keys: &Path, bus: Option<&Bus>) -> Result<Self, Failure> {
        let python = python::prepared()?;
        let mut command = process::program(&python.display().to_string(), [in_root("xtask/ble/radio.py")]);
        for (name, port) in [("--hci", ports.hci), ("--bridge", ports.bridge), ("--stranger", ports.stranger)] {
            command.args([name, &port.to_string()]);
        }
        command.arg("--keys").arg(keys);
        if let Some(bus) = bus {
            command.args(["--bus", bus.address()]);
        }
        // Its compiled modules would lie between the sources.
        command.env("PYTHONDONTWRITEBYTECODE", "1");
        let started = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child =
            started.map_err(|source| Failure::NotStarted { program: "the virtual radio".into(), source })?;
        let (Some(orders), Some(told)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Failure::Found("the virtual radio has no pipes".into()));
        };
        let (sender, lines) = channel();
        thread::spawn(move || {
            for line in BufReader::new(told).lines().map_while(Result::ok) {
                if serde_json::from_str(&line).is_ok_and(|value| sender.send(value).is_err()) {
                    return;
                }
            }
        });
        let mut radio = Self { child, orders, lines, ports };
        radio.until("event", "ready")?;
        Ok(radio)
    }

    /// Gives an order and waits for its answer, of which a fault is an error.
    pub fn order(&mut self, order: &str) -> Result<Value, Failure> {
        let answer = self.ask(order)?;
        match answer.get("fault").and_then(Value::as_str) {
            Some(fault) => Err(Failure::Found(format!("the virtual radio, asked to '{order}', says: {fault}"))),
            None => Ok(answer),
        }
    }

    /// Gives an order and waits for its answer.
    pub fn ask(&mut self, order: &str) -> Result<Value, Failure> {
        writeln!(self.orders, "{order}").and_then(|()| self.orders.flush()).map_err(|_| ended())?;
        self.until("order", order.split(' ').next().unwrap_or_default())
    }

    fn until(&mut self, key: &str, word: &str) -> Result<Value, Failure> {
        let until = Instant::now() + PATIENCE;
        loop {
            match self.lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(value) if value.get(key).and_then(Value::as_str) == Some(word) => return Ok(value),
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => {
                    return Err(Failure::Found(format!("the virtual radio did not answer '{word}'")));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(ended()),
            }
        }
    }
}

fn ended() -> Failure {
    Failure::Found("the virtual radio has ended".into())
}

impl Drop for Radio {
    fn drop(&mut self) {
        // Killing fails only for a child that has just ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
