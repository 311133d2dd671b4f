//! The window as people see it: opened on a display of its own by the commands that open it, and looked at.

mod screen;

use crate::process::{self, Failure};
use crate::{emulate, in_root, tools};
use screen::{Colours, Screen};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Where the pictures go.
const FOLDER: &str = "target/window";
/// A building, where walks begin in it, and where that of the emulated shoe leads.
const BUILDING: &str = "buildings/twin.geojson";
const START: &str = "W02";
const ROUTE: &str = "W02,hall,E05";
/// Everything is to be seen after so long at the latest, on a machine that has much else to do.
const PATIENCE: Duration = Duration::from_secs(180);
/// Between two looks.
const LOOK: Duration = Duration::from_millis(500);

/// What must be seen of each, in pixels of the map. The mark of the person is red too, and has a quarter of a thousand.
const LEAST: Colours = Colours { walls: 2_000, particles: 150, path: 450 };

/// Opens the window by `demo`, `replay` and `live`, and looks for walls, particles and path in it.
pub fn check() -> Result<(), Failure> {
    for tool in [&tools::XVFB, &tools::LAVAPIPE, &tools::QEMU] {
        tool.required()?;
    }
    let sohle = process::build("dev", "--bin", "sohle")?;
    emulate::machine::build(&[])?;
    let folder = in_root(FOLDER);
    std::fs::create_dir_all(folder.join("sohle")).map_err(|source| file(&folder, source))?;
    // Colours are looked for as they are on light ground.
    let layout = folder.join("sohle/window.json");
    std::fs::write(&layout, r#"{"look":"light"}"#).map_err(|source| file(&layout, source))?;
    let screen = Screen::start(&folder)?;
    let on_screen = |arguments: &[&str]| {
        let mut command = Command::new(&sohle);
        command.current_dir(crate::root()).args(arguments).args(["--start", START]);
        // The layout is the one above, and this display the only one.
        command.env("DISPLAY", screen.name()).env_remove("WAYLAND_DISPLAY").env("XDG_CONFIG_HOME", &folder);
        command.env("XDG_RUNTIME_DIR", &folder);
        command
    };
    println!("pixels of the map         walls  particles  path  seen after s");

    let demo = folder.join("demo");
    let walk = demo.join("recording.mcap");
    let (demo, walk) = (demo.to_string_lossy(), walk.to_string_lossy());
    let running = Running::start(on_screen(&["demo", "--out", &demo]))?;
    seen("demo", &screen, running)?;
    let again = folder.join("again");
    let again = again.to_string_lossy();
    let running = Running::start(on_screen(&["replay", &walk, "--building", BUILDING, "--out", &again]))?;
    seen("replay", &screen, running)?;

    let simulated = folder.join("simulated.mcap");
    let mut command = Command::new(&sohle);
    command.current_dir(crate::root()).args(["simulate", "--building", BUILDING, "--route", ROUTE, "--out"]);
    process::read(command.arg(&simulated))?;
    let counts = emulate::converted(&sohle, &folder, &simulated, None)?;
    let port = emulate::machine::free_port()?;
    let shoe = emulate::machine::Running::start(port, &counts)?;
    let address = format!("tcp:127.0.0.1:{port}");
    let running = Running::start(on_screen(&["live", &address, "--no-record", "--building", BUILDING]))?;
    let running = seen("live, the emulated shoe", &screen, running)?;
    // As at a terminal: the window closes, and what was heard is told.
    let ended = running.interrupt();
    drop(shoe);
    ended
}

/// Waits until everything is to be seen, and keeps the picture.
fn seen(name: &str, screen: &Screen, mut running: Running) -> Result<Running, Failure> {
    let begun = Instant::now();
    loop {
        std::thread::sleep(LOOK);
        let picture = screen.picture()?;
        let colours = picture.colours();
        let enough = colours.reaches(LEAST);
        let late = begun.elapsed() > PATIENCE;
        if !enough && !late && running.runs() {
            continue;
        }
        let path = in_root(FOLDER).join(format!("{}.png", name.split([',', ' ']).next().unwrap_or(name)));
        picture.write(&path)?;
        let Colours { walls, particles, path: way } = colours;
        println!("{name:<24} {walls:>6} {particles:>10} {way:>5} {:>13.1}", begun.elapsed().as_secs_f64());
        if enough {
            return Ok(running);
        }
        let why = if late { "is not all to be seen" } else { "the program ended" };
        return Err(Failure::Found(format!("{name}: {why}; {}", path.display())));
    }
}

/// A program with a window.
struct Running(Child);

impl Running {
    fn start(mut command: Command) -> Result<Self, Failure> {
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn();
        child.map(Self).map_err(|source| Failure::NotStarted { program: "sohle".into(), source })
    }

    fn runs(&mut self) -> bool {
        matches!(self.0.try_wait(), Ok(None))
    }

    /// Asks it to end by Ctrl-C, and waits until it has ended well.
    fn interrupt(mut self) -> Result<(), Failure> {
        match process::interrupt(&mut self.0, PATIENCE)? {
            Some(status) if status.success() => Ok(()),
            Some(status) => Err(Failure::Found(format!("the window ended with {status}"))),
            None => Err(Failure::Found("the window does not close by Ctrl-C".into())),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Killing fails only for a child that has just ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn file(path: &Path, source: std::io::Error) -> Failure {
    Failure::File { path: PathBuf::from(path).display().to_string(), source }
}
