//! The emulated shoe with Bluetooth: its second serial line is the HCI of a controller on a virtual radio.

mod bus;
mod check;
mod figures;
mod program;
mod python;
mod scene;

pub use check::check;

use super::file;
use super::machine::{SHIFT, build, cable, emulator, line_to};
use crate::process::{self, Failure};
use crate::{device, in_root};
use bus::Bus;
use program::{Ports, Radio};
use std::path::{Path, PathBuf};

/// The firmware with Bluetooth, beside the one without, which is built in the same place.
pub fn built(folder: &Path) -> Result<PathBuf, Failure> {
    build(&["ble"])?;
    let program = folder.join("sohle-shoe-ble");
    std::fs::copy(device::binary("sohle-shoe"), &program).map_err(|source| file(&program, source))?;
    Ok(program)
}

/// Runs shoe, radio and laptop until they are stopped, and tells what can be typed.
pub fn run(folder: &Path, counts: &Path, port: u16) -> Result<(), Failure> {
    let program = built(folder)?;
    let bus = Bus::start(folder)?;
    let radio = Radio::start(Ports::free()?, &folder.join("laptop.json"), Some(&bus))?;
    println!(
        "the shoe waits for a laptop and walks as soon as one is there, on its cable or on Bluetooth. This terminal's laptop"
    );
    println!("is not this machine's: what stands for BlueZ is on a bus of its own. In another terminal, run");
    println!("  cargo run --release -- pair tcp:127.0.0.1:{port}");
    println!("  DBUS_SYSTEM_BUS_ADDRESS={} cargo run --release -- live ble:any", bus.address());
    println!("The shoe's flash and the laptop's keys stay in {} for the next time; Ctrl-C ends it", folder.display());
    let flash = folder.join("flash.bin");
    let lines = [cable(port, false), line_to(radio.ports.hci)];
    process::run(&mut emulator(SHIFT, &lines, &[counts, &flash], &program))
}

/// A file of an earlier run.
fn forget(path: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(file(path, source)),
        _ => Ok(()),
    }
}

/// The folder of the check.
fn folder() -> Result<PathBuf, Failure> {
    let folder = in_root("target/ble");
    std::fs::create_dir_all(&folder).map_err(|source| file(&folder, source))?;
    Ok(folder)
}
