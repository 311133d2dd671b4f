//! How long it takes from a step to its picture, measured in a window without a display.
//!
//! A walk is played through the engine and the window as they are, and each frame is waited for until the graphics card has
//! drawn all of it.

use super::App;
use super::engine::replay::Replay;
use super::engine::walk::{Settings, Walk};
use super::engine::{Command, Kind, Source};
use super::gpu::offscreen::{Error, Sheet, Studio};
use super::map::Map;
use crate::building::{Building, generate, route};
use crate::follow;
use crate::particle;
use crate::recording::Recording;
use crate::simulation::{Route, Scenario, Simulation};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Numbers of particles with which a step is followed.
pub const PARTICLES: [usize; 3] = [10_000, 50_000, 150_000];

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Steps that count.
    pub steps: usize,
    /// The half takes no longer. **Units:** ms.
    pub median_ms: f64,
    /// Of a hundred, 99 take no longer. **Units:** ms.
    pub p99_ms: f64,
}

/// Between two looks, as a display with 60 pictures a second has them.
const FRAME: Duration = Duration::from_micros(16_667);
/// So often it is looked whether a frame is asked for; and one is drawn at last.
const LOOK: Duration = Duration::from_micros(500);
const IDLE: Duration = Duration::from_millis(500);
/// Nothing takes longer.
const PATIENCE: Duration = Duration::from_secs(300);
/// The rooms of the twin that are walked to, over and over.
const STOPS: [&str; 6] = ["W02", "hall", "E04", "hall", "W05", "hall"];

/// Plays a simulated walk with so many particles, `speed` times as fast as it is walked, until `steps` were seen. `told` is told
/// how many there are.
///
/// # Errors
/// When the card does not answer, or it takes for ever.
pub fn latency(
    studio: &mut Studio,
    sheet: Sheet,
    particles: usize,
    speed: f64,
    steps: usize,
    mut told: impl FnMut(u64),
) -> Result<Measured, Error> {
    let building = generate::twin(2);
    let recording = Arc::new(walk(&building, steps));
    // As many from the beginning to the end.
    let filter = particle::Parameters { least: particles, most: particles, ..particle::Parameters::default() };
    let follow = follow::Settings { start: STOPS[0].into(), particle: filter, ..follow::Settings::default() };
    let settings = Settings { follow, ..Settings::default() };
    let make = move || {
        let walk = Walk::new(recording, Some(building), settings)?;
        Ok(Box::new(Replay::new(walk)) as Box<dyn Source>)
    };
    let mut make = Some(make);
    let mut app = App::new(Some(Map::quick(studio.render())), None).measured();
    let begun = Instant::now();
    let mut fast = false;
    loop {
        let frame = Instant::now();
        // A window draws when it is asked to, and no more often than its display can show.
        while make.is_none() && !studio.is_asked() && frame.elapsed() < IDLE {
            std::thread::sleep(LOOK);
        }
        let frame = Instant::now();
        studio.frame(sheet, |ui| {
            if let Some(make) = make.take() {
                app.begin("a walk".into(), Box::new(make), ui.ctx(), false);
            }
            app.show(ui);
        })?;
        let snapshot = app.snapshot();
        told(snapshot.steps.min(steps) as u64);
        let over = snapshot.kind == Kind::Replay && (snapshot.steps > steps || !snapshot.pace.playing);
        if let (true, Some(latency)) = (over, app.latency()) {
            let super::status::Latency { steps, median_ms, p99_ms } = latency;
            return Ok(Measured { steps, median_ms, p99_ms });
        }
        if begun.elapsed() > PATIENCE {
            return Err(Error::Stuck(format!("after {} s the walk is not over", PATIENCE.as_secs())));
        }
        if snapshot.kind == Kind::Replay && !fast {
            fast = true;
            app.ask(Command::Speed(speed));
        }
        std::thread::sleep(FRAME.saturating_sub(frame.elapsed()));
    }
}

/// A walk of more steps than that, from room to room.
fn walk(building: &Building, steps: usize) -> Recording {
    // A foot goes more than a metre with each of its steps, and a leg between two of the rooms has ten metres.
    let stops: Vec<&str> = STOPS.iter().copied().cycle().take(2 + steps / 8).collect();
    let scenario = route::plan(building, &stops)
        .and_then(|plan| Route::through(building, &plan))
        .map(|route| Scenario { route, ..Scenario::default() })
        .expect("the twin has these rooms");
    let simulation = Simulation::new(&scenario).expect("a walk through rooms can be simulated");
    let samples = simulation.map(|moment| moment.sample).collect();
    Recording { name: "a walk".into(), samples, ..Recording::default() }
}
