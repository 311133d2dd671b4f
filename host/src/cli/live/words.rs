//! What `sohle live` says of steps, places and recordings.

use crate::fixes::Estimate;
use crate::follow::{Said, mode_word};
use crate::link::recorder::Recorded;
use crate::particle::{Cluster, State};
use serde_json::{Value as Json, json};
use sohle_shared::step::{FloorMode, Step};

/// Over the lines of the steps.
pub const HEAD: &str = "  step    time s  length m  height m    turn °  ground    delay ms  marks\n";

/// What became of a recording.
pub fn recorded(recorded: &Recorded) -> String {
    let dropped = match recorded.dropped {
        0 => String::new(),
        dropped => format!("; {dropped} messages are not in it"),
    };
    match &recorded.size {
        Ok(size) => format!("recorded to {} ({size} bytes){dropped}", recorded.path.display()),
        Err(error) => format!("the recording has ended: {error}; what was heard before is in it{dropped}"),
    }
}

fn ground(mode: FloorMode) -> &'static str {
    match mode {
        FloorMode::Level => "level",
        FloorMode::Stairs => "stairs",
        FloorMode::Elevator => "elevator",
    }
}

fn marks(step: &Step) -> Vec<&'static str> {
    let quality = &step.quality;
    [
        (quality.accel_clipped, "accelerometer clipped"),
        (quality.gyro_clipped, "gyroscope clipped"),
        (quality.gap, "gap"),
        (quality.long_swing, "long swing"),
        (quality.weak_stance, "weak stance"),
        (quality.repaired, "repaired"),
    ]
    .into_iter()
    .filter_map(|(set, name)| set.then_some(name))
    .collect()
}

/// A step for people.
pub fn row(id: u32, step: &Step, delay: Option<f64>) -> String {
    format!(
        "{id:>6} {:>9.2} {:>9.2} {:>9.2} {:>9.1}  {:<8} {:>9}  {}\n",
        step.stance_end.as_seconds(),
        step.length(),
        step.displacement.z,
        step.turn.to_degrees(),
        ground(step.mode),
        delay.map_or("-".into(), |delay| format!("{delay:.1}")),
        marks(step).join(", ")
    )
}

/// A step for programs.
pub fn object(boot: u32, id: u32, step: &Step, delay: Option<f64>) -> Json {
    json!({
        "event": "step", "boot": boot, "id": id, "index": step.index, "stance_start_us": step.stance_start.0,
        "stance_end_us": step.stance_end.0, "displacement_m": <[f32; 3]>::from(step.displacement),
        "turn_rad": step.turn, "ground": ground(step.mode), "marks": marks(step), "delay_ms": delay,
    })
}

/// A place of steps and positions alone, for people.
pub fn position(estimate: &Estimate) -> String {
    let [x, y] = estimate.place;
    format!("{:>6} by positions and steps: ({x:.2}, {y:.2}) m, sigma {:.2} m\n", "", estimate.sigma_m())
}

/// A place for people.
pub fn place(said: &Said) -> String {
    let estimate = &said.estimate;
    let at = |cluster: &Cluster| {
        let [x, y] = [cluster.position.x, cluster.position.y];
        format!(
            "floor {} ({x:.2}, {y:.2}) m, sigma {:.2} m, {:.0} %",
            cluster.floor,
            cluster.sigma_m(),
            100.0 * cluster.probability
        )
    };
    let places: Vec<_> = match estimate.state {
        State::Searching => Vec::new(),
        State::SeveralPlaces | State::Lost => estimate.clusters.iter().take(3).map(at).collect(),
        State::Located => estimate.clusters.iter().take(1).map(at).collect(),
    };
    let room = match (&said.room, estimate.state) {
        (Some(room), State::Located) => format!(" {room},"),
        _ => String::new(),
    };
    let places = if places.is_empty() { String::new() } else { format!(":{room} {}", places.join("; ")) };
    format!("{:>6} {}{places}; ground: {}\n", "", estimate.state.word(), mode_word(said.mode))
}
