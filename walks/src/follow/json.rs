//! What was said, for other programs: a JSON object for each step.

use super::{Follower, Said, Unusual};
use crate::building::georeference::Projection;
use crate::particle::Cluster;
use serde_json::{Value, json};
use sohle_shared::step::FloorMode;
use sohle_shared::time::Micros;

/// Places and rooms that are told of.
const MOST: usize = 10;

/// The object. With a projection each place has longitude and latitude too. `docs/places.md` has its members.
pub fn line(follower: &Follower, said: &Said, projection: Option<&Projection>) -> Value {
    let estimate = &said.estimate;
    let building = follower.building();
    let name = |floor: i32, room: Option<u16>| {
        let room = building.floor(floor)?.rooms.get(usize::from(room?))?;
        Some(room.name.clone())
    };
    let rooms = estimate.rooms.iter().take(MOST).map(|share| {
        json!({
            "floor": share.floor,
            "room": name(share.floor, share.room),
            "probability": rounded(share.probability, 4),
        })
    });
    json!({
        "event": "place",
        "time_us": estimate.time.map(|Micros(time)| time),
        "step": estimate.step,
        "state": estimate.state,
        "room": said.room,
        "places": estimate.clusters.iter().take(MOST).map(|cluster| place(cluster, projection)).collect::<Vec<_>>(),
        "rooms": rooms.collect::<Vec<_>>(),
        "floor_mode": mode_word(said.mode),
        "particles": estimate.particles,
        "likelihood": rounded(estimate.likelihood, 4),
        "unusual": said.unusual.map(|unusual| match unusual {
            Unusual::TooLong(_) => "too long",
            Unusual::NoNumber => "no number",
        }),
    })
}

fn place(cluster: &Cluster, projection: Option<&Projection>) -> Value {
    let covariance = &cluster.covariance;
    let mut place = json!({
        "probability": rounded(cluster.probability, 4),
        "floor": cluster.floor,
        "position_m": cluster.position.iter().map(|value| rounded(*value, 3)).collect::<Vec<_>>(),
        "sigma_m": rounded(cluster.sigma_m(), 3),
        "covariance_m2": (0..3).map(|row| (0..3).map(|column| rounded(covariance[(row, column)], 5)).collect())
            .collect::<Vec<Vec<_>>>(),
        "heading_deg": rounded(cluster.heading.to_degrees(), 1),
        "heading_agreement": rounded(cluster.heading_agreement, 3),
    });
    let earth = projection.and_then(|earth| earth.to_earth([cluster.position.x, cluster.position.y]).ok());
    if let Some(earth) = earth {
        place["lon_lat"] = json!(earth.map(|value| rounded(value, 8)));
    }
    place
}

/// A floor mode in a word; `auto` where the shoe decides.
pub fn mode_word(mode: Option<FloorMode>) -> &'static str {
    match mode {
        Some(FloorMode::Level) => "level",
        Some(FloorMode::Stairs) => "stairs",
        Some(FloorMode::Elevator) => "elevator",
        None => "auto",
    }
}

fn rounded(value: f64, digits: i32) -> f64 {
    let unit = 10_f64.powi(digits);
    // Adding zero turns a negative zero into zero.
    (value * unit).round() / unit + 0.0
}
