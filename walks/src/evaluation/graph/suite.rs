//! All methods on all walks of a building, side by side.

use super::follow::{Followed, Method, Settings, follow};
use super::walks::Site;
use crate::building::geometry;
use crate::simulation::phone::PhoneWalk;
use crate::{building, graph, particle};
use rayon::prelude::*;

/// A walk that is judged ends at the right place when it ends on the right floor no farther from the truth: nearer than the
/// next door. **Units:** m.
pub const RIGHT_M: f64 = 3.0;
/// A change of the floor is right when so many steps after it floor and place are: the document counts those after which
/// the walk is not given back correctly (Graph, 7.2).
const SETTLED_STEPS: usize = 8;
/// And the place is when it is no farther from the truth than this: other stairs are. **Units:** m.
const SETTLED_M: f64 = 5.0;

/// Why the suite did not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A building is of no use, or a walk could not be made.
    #[error(transparent)]
    Building(#[from] building::Error),
    /// The graph is of no use.
    #[error(transparent)]
    Graph(#[from] graph::Error),
    /// The particle filter refused.
    #[error(transparent)]
    Particle(#[from] particle::Error),
    /// The recorded walk is not there.
    #[error(transparent)]
    Recorded(#[from] crate::evaluation::phone::walk::Error),
}

/// What a method made of all walks of a building.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// The building.
    pub site: &'static str,
    /// The method.
    pub method: &'static str,
    /// How many walks.
    pub walks: usize,
    /// How many steps they have.
    pub steps: usize,
    /// Walks that end at the right place. **Units:** %.
    pub end_right_percent: f64,
    /// Edges that were chosen without a search, where edges are chosen. **Units:** %.
    pub without_search_percent: Option<f64>,
    /// Changes of the floor.
    pub changes: usize,
    /// Those that are right. **Units:** %.
    pub changes_right_percent: f64,
    /// Root mean square distance to the truth over all steps on the right floor. **Units:** m.
    pub rmse_m: f64,
    /// Median and 95th percentile of the distance. **Units:** m.
    pub median_m: f64,
    /// **Units:** m.
    pub p95_m: f64,
    /// Time of a step in the mean: what this machine took, not kept in the table. **Units:** us.
    #[serde(skip)]
    pub step_us: f64,
}

/// What a method made of one walk.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Whether the end is right.
    pub end_right: bool,
    /// Changes of the floor that are right.
    pub changes_right: usize,
    /// Distance to the truth after each step. **Units:** m.
    pub errors_m: Vec<f64>,
    /// All that it made.
    pub followed: Followed,
}

/// Judges.
pub fn judge(walk: &PhoneWalk, followed: Followed) -> Score {
    let far = |step: usize| {
        let truth = walk.truth[step];
        geometry::distance(followed.places[step].1, [truth.x, truth.y])
    };
    let last = walk.truth.len() - 1;
    let settled = |change: &&crate::simulation::phone::Change| {
        let step = (change.step + SETTLED_STEPS).min(last);
        followed.places[step].0 == walk.floors[step] && far(step) <= SETTLED_M
    };
    Score {
        end_right: followed.places[last].0 == walk.floors[last] && far(last) <= RIGHT_M,
        changes_right: walk.changes.iter().filter(settled).count(),
        errors_m: (0..=last).map(far).collect(),
        followed,
    }
}

/// Lets all methods follow all walks.
///
/// # Errors
/// When a method refuses.
pub fn rows(site: &Site, walks: &[PhoneWalk], settings: &Settings, done: impl Fn() + Sync) -> Result<Vec<Row>, Error> {
    Method::ALL.into_iter().map(|method| row(site, walks, method, settings, &done)).collect()
}

/// Lets a method follow all walks.
///
/// # Errors
/// When it refuses.
pub fn row(
    site: &Site,
    walks: &[PhoneWalk],
    method: Method,
    settings: &Settings,
    done: impl Fn() + Sync,
) -> Result<Row, Error> {
    let one = |(index, walk): (usize, &PhoneWalk)| {
        let settings = Settings { seed: settings.seed.wrapping_add(index as u64), ..settings.clone() };
        let followed = follow(site, walk, method, &settings)?;
        done();
        Ok(judge(walk, followed))
    };
    let scores: Vec<Score> = walks.par_iter().enumerate().map(one).collect::<Result<_, Error>>()?;
    let percent = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    let chosen = [0, 1].map(|which| scores.iter().map(|score| score.followed.chosen[which]).sum::<usize>());
    let changes = walks.iter().map(|walk| walk.changes.len()).sum();
    let mut errors: Vec<f64> = scores.iter().flat_map(|score| &score.errors_m).copied().collect();
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors.get((share * errors.len() as f64) as usize).copied().unwrap_or_default();
    let time: f64 = scores.iter().map(|score| score.followed.time.as_secs_f64()).sum();
    Ok(Row {
        site: site.name,
        method: method.word(),
        walks: walks.len(),
        steps: errors.len(),
        end_right_percent: percent(scores.iter().filter(|score| score.end_right).count(), walks.len()),
        without_search_percent: (chosen[0] > 0).then(|| percent(chosen[0] - chosen[1], chosen[0])),
        changes,
        changes_right_percent: percent(scores.iter().map(|score| score.changes_right).sum(), changes),
        rmse_m: crate::evaluation::phone::path::rms(&errors).unwrap_or_default(),
        median_m: at(0.5),
        p95_m: at(0.95),
        step_us: 1e6 * time / errors.len().max(1) as f64,
    })
}
