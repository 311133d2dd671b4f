//! A short account of a walk in a building.

use crate::cli::table::Table;
use crate::evaluation::building::suite::Errors;
use crate::follow::Follower;
use crate::particle::State;
use crate::recording::SimulatedTruth;
use sohle_shared::time::Micros;

/// Heights within this of a floor belong to it alone. **Units:** m.
const ON_FLOOR_M: f64 = 0.6;

/// What was found out, and where the person may be at the end.
pub fn told(follower: &Follower) -> String {
    let (building, path, estimate) = (follower.building(), follower.path(), follower.estimate());
    let first = path.first().map_or(Micros(0), |first| first.time);
    let mut text = format!("in {}: {}", building.name, estimate.state.word());
    match path.iter().find(|followed| followed.state == State::Located) {
        Some(found) => {
            text += &format!(" at the end, first located after {:.0} s\n\n", (found.time - first) as f64 * 1e-6);
        }
        None => text += " at the end, never located\n\n",
    }
    let mut table = Table::new("possible at the end", &["probability %", "floor", "x m", "y m", "sigma m"]);
    for cluster in estimate.clusters.iter().take(5) {
        let [x, y] = [cluster.position.x, cluster.position.y];
        let room = building.floor(cluster.floor).and_then(|floor| floor.room_at([x, y]));
        table.row(
            room.map_or("-", |room| &room.name),
            vec![
                format!("{:.1}", 100.0 * cluster.probability),
                cluster.floor.to_string(),
                format!("{x:.2}"),
                format!("{y:.2}"),
                format!("{:.2}", cluster.sigma_m()),
            ],
        );
    }
    text + &table.text()
}

/// How far from the truth it was.
pub fn judged(follower: &Follower, truth: &SimulatedTruth) -> String {
    let at = |time: Micros| {
        let next = truth.poses.partition_point(|pose| pose.time < time).min(truth.poses.len() - 1);
        truth.poses[next].position
    };
    let apart = |x: f64, y: f64, [true_x, true_y, _]: [f64; 3]| (x - true_x).hypot(y - true_y);
    let (mut located, mut floors) = (Vec::new(), 0);
    for followed in follower.path().iter().filter(|followed| followed.state == State::Located) {
        let Some(place) = &followed.place else { continue };
        let truth = at(followed.time);
        located.push(apart(place.position.x, place.position.y, truth));
        let near = |height: f64| (truth[2] - height).abs() < ON_FLOOR_M;
        let mut heights = follower.building().floors.iter().filter(|floor| near(floor.height_m)).peekable();
        // Between floors, both are right.
        floors += usize::from(heights.peek().is_none() || heights.any(|floor| floor.number == place.floor));
    }
    let time_of = |step: u32| follower.path().iter().find(|followed| followed.step == step).map(|found| found.time);
    let corrected = follower.past().into_iter().filter_map(|past| {
        let [x, y, _] = past.position;
        Some(apart(x, y, at(time_of(past.step)?)))
    });
    let corrected: Vec<_> = corrected.collect();
    let right = 100.0 * floors as f64 / located.len().max(1) as f64;
    let headings = ["steps", "mean m", "95 % m", "worst m", "right floor %"];
    let mut table = Table::new("error in the plane", &headings);
    for (name, errors, right) in [("while located", located, Some(right)), ("corrected afterwards", corrected, None)] {
        let Errors { count, mean_m, p95_m, worst_m, .. } = Errors::of(errors);
        let mut cells = vec![count.to_string()];
        if count > 0 {
            cells.extend([mean_m, p95_m, worst_m].map(|metres| format!("{metres:.2}")));
            cells.extend(right.map(|share| format!("{share:.1}")));
        }
        table.row(name, cells);
    }
    table.text()
}
