//! The thresholds of the documented tracker.

use super::matching::Thresholds;

/// By what case 5 chooses an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SearchBy {
    /// Its direction and its distance (Graph, 6.10.1)
    #[default]
    Distance,
    /// The shape of the route to it (Graph, 6.10.2), and by direction and distance where that tells nothing
    MapMatching,
}

/// Settings of [`Tracker`](super::Tracker).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How long a step is on the level (Graph, 6.6; SPEC section 8, decision 8). Zero: as it was measured. **Units:** m.
    pub step_m: f64,
    /// How long it is on stairs (Graph, 6.11). **Units:** m.
    pub stairs_step_m: f64,
    /// Who deviates by less goes straight on (Graph, 6.6). **Units:** degrees.
    pub straight_deg: f64,
    /// Who deviates by more turns round (Graph, 6.7). **Units:** degrees.
    pub half_turn_deg: f64,
    /// An edge fits a heading that is no farther from it (Graph, 6.6 and 6.8). **Units:** degrees.
    pub fit_deg: f64,
    /// The edge that goes straight on beyond a node may bend so far (Graph, 6.9). **Units:** degrees.
    pub ahead_deg: f64,
    /// After so many steps without an edge one is searched for (Graph, 6.6).
    pub window: usize,
    /// The end node of an edge counts as so much nearer than its start node (Graph, 6.8; SPEC section 8, decision 8).
    /// **Units:** m.
    pub end_favour_m: f64,
    /// By what an edge is searched for: the document's results are by direction and distance (Graph, 6.10).
    pub search: SearchBy,
    /// An edge that is searched for may be so far from the heading (Graph, 6.10.1). **Units:** degrees.
    pub search_deg: f64,
    /// It is searched for within so many standard deviations (Graph, 6.10.1).
    pub search_sigmas: f64,
    /// A search so few edges after the last goes on from where that began (Graph, 6.10.1).
    pub again_edges: usize,
    /// Error of the length of a step (standard deviation; Graph, table 6.3). **Units:** m.
    pub sigma_length_m: f64,
    /// Error of its heading (standard deviation; Graph, table 6.3). **Units:** degrees.
    pub sigma_heading_deg: f64,
    /// Error of walking on a line: half the width of a corridor (standard deviation; Graph, table 6.3). **Units:** m.
    pub sigma_graph_m: f64,
    /// Who is so near to the height of another floor has changed to it (Graph, 6.11). **Units:** m.
    pub floor_m: f64,
    /// How much of the height between two floors is so near to neither (Graph, 6.11). **Units:** m.
    pub between_floors_m: f64,
    /// More steps than this on the last of that height were stairs, not an elevator (Graph, 6.11).
    pub stairs_steps: usize,
    /// After a change of the floor one is on the stair edge beside which one was, up to so far (Graph, 6.11). **Units:** m.
    pub project_m: f64,
    /// Else on one that is no farther from the heading (Graph, 6.11). **Units:** degrees.
    pub stairs_deg: f64,
    /// Of the search by map matching.
    pub matching: Thresholds,
}

impl Default for Parameters {
    fn default() -> Self {
        Self::documented()
    }
}

impl Parameters {
    /// As the document has them.
    pub const fn documented() -> Self {
        Self {
            step_m: 0.68,
            stairs_step_m: 0.30,
            straight_deg: 10.0,
            half_turn_deg: 145.0,
            fit_deg: 10.0,
            ahead_deg: 20.0,
            window: 5,
            end_favour_m: 1.5,
            search: SearchBy::Distance,
            search_deg: 20.0,
            search_sigmas: 3.0,
            again_edges: 3,
            sigma_length_m: 0.05,
            sigma_heading_deg: 0.5,
            sigma_graph_m: 1.5,
            floor_m: 1.0,
            between_floors_m: 1.65,
            stairs_steps: 3,
            project_m: 0.5,
            stairs_deg: 35.0,
            matching: Thresholds::documented(),
        }
    }
}
