//! The plan of each floor with the paths on it.

use crate::export::plan::{Dots, Look, Mark, Trace, draw_with};
use crate::follow::{Follower, runs};
use crate::particle::State;

/// Colours of the document's map (Foot, 6.2.1): particles green, the path red; the corrected one blue, the truth violet.
const PARTICLES: &str = "#3a9b57";
const LIVE: &str = "#c8322d";
const CORRECTED: &str = "#2456b4";
const TRUTH: &str = "#8a3fb0";
/// More particles are not drawn.
const MOST_DRAWN: usize = 20_000;
/// More places are not marked.
const MOST_MARKED: usize = 5;
/// Heights within this of a floor are drawn on it; between floors a path is drawn on both. **Units:** m.
const STOREY_PART_M: f64 = 2.2;

/// Draws the floor of this index. `truth` is the true way, if it is known. **Units:** m; **Frame:** building.
pub fn draw(follower: &Follower, index: usize, truth: &[[f64; 3]]) -> String {
    let building = follower.building();
    let floor = &building.floors[index];
    let live = runs(follower.path().iter().map(|followed| {
        // Whoever searches has no path.
        let place = followed.place.as_ref().filter(|_| followed.state == State::Located)?;
        (place.floor == floor.number).then_some([place.position.x, place.position.y])
    }));
    let past = follower.past();
    let corrected =
        runs(past.iter().map(|place| (place.floor == index).then_some([place.position[0], place.position[1]])));
    let here = |z: f64| (z - floor.height_m).abs() < STOREY_PART_M;
    let truth = runs(truth.iter().map(|&[x, y, z]| here(z).then_some([x, y])));
    let particles = follower.particles();
    let every = particles.len().div_ceil(MOST_DRAWN).max(1);
    let particles = particles.iter().step_by(every).filter(|particle| usize::from(particle.floor) == index);
    let places = particles.map(|particle| [particle.x, particle.y].map(f64::from)).collect();
    let dots = [Dots { label: "particles at the end", colour: PARTICLES, places }];
    let traces = [
        Trace { label: "truth", colour: TRUTH, width: 1.2, pieces: truth },
        Trace { label: "as it was said", colour: LIVE, width: 1.5, pieces: live },
        Trace { label: "corrected", colour: CORRECTED, width: 2.5, pieces: corrected },
    ];
    draw_with(building, floor, &marks(follower, floor.number), &dots, &traces)
}

/// The places that are possible at the end, with their probability.
fn marks(follower: &Follower, floor: i32) -> Vec<Mark> {
    let estimate = follower.estimate();
    let look = if estimate.state == State::Located { Look::Place } else { Look::Warning };
    let here = estimate.clusters.iter().take(MOST_MARKED).filter(|cluster| cluster.floor == floor);
    here.map(|cluster| Mark {
        place: [cluster.position.x, cluster.position.y],
        text: format!("{:.0} %", 100.0 * cluster.probability),
        look,
    })
    .collect()
}
