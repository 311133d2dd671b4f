//! The settings of the matcher.

/// Settings of [`Matcher`](super::Matcher). Standard deviations unless said otherwise.
///
/// What is known of the way somebody takes beside an edge holds over a part of the way: two steps in the same corridor say
/// little more than one. Hence widths come with a length over which they count once.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// How far beside an edge people walk. **Units:** m.
    pub aside_m: f64,
    /// The same where the graph is a net over an open area. **Units:** m.
    pub open_aside_m: f64,
    /// There people keep to no line: it counts once over so much of the way. **Units:** m.
    pub open_over_m: f64,
    /// Over so much of the way the two count once. **Units:** m.
    pub aside_over_m: f64,
    /// How far people go beyond the end of an edge before they turn, or how far before it they do. **Units:** m.
    pub beyond_m: f64,
    /// The same at the end of a blind alley: a room has its node in the middle. **Units:** m.
    pub blind_m: f64,
    /// How far from the direction of an edge people walk on it. **Units:** degrees.
    pub direction_deg: f64,
    /// Over so much of the way that counts once. **Units:** m.
    pub direction_over_m: f64,
    /// The part of the way that people go in any direction, whatever edge they are on.
    pub any_direction: f64,
    /// An edge is reached early or late by so much, at a cut corner for instance. **Units:** m.
    pub slack_m: f64,
    /// Which of n edges is taken at a node costs this part of ln n.
    pub fork: f64,
    /// The same on a net over an open area, where the edges are no choices.
    pub open_fork: f64,
    /// What it costs to enter an elevator (logarithm of odds).
    pub elevator: f64,
    /// Without heights an elevator is thought of after so long without a step. **Units:** s.
    pub elevator_s: f64,
    /// How much longer or shorter steps may be than they say, at the start, as a part of them.
    pub scale: f64,
    /// The same from step to step.
    pub scale_walk: f64,
    /// Beyond its covariance a step is wrong by this much in each direction of the plane. **Units:** m.
    pub place_m: f64,
    /// Beyond its covariance the turn of a step is wrong by this. **Units:** degrees.
    pub turn_deg: f64,
    /// How long a step is on stairs, of a source that does not notice them (Graph, 6.11). Zero: as it was measured.
    /// **Units:** m.
    pub stairs_step_m: f64,
    /// The height that is measured differs so much from that of the graph. **Units:** m.
    pub height_m: f64,
    /// And that difference changes from step to step by this. **Units:** m.
    pub height_walk_m: f64,
    /// Hypotheses that are less likely than the best by this are given up (logarithm of odds).
    pub given_up: f64,
    /// More than so many are not kept, but for the first steps from an unknown start.
    pub most: usize,
    /// From there on the number of those that are kept becomes less by this factor in each step.
    pub fewer: f64,
    /// Hypotheses on one edge that are nearer than this become one. **Units:** m.
    pub merge_m: f64,
    /// Or nearer than this part of the standard deviation of the place, which counts up to a metre.
    pub merge_sigmas: f64,
    /// And look in directions that are nearer. **Units:** degrees.
    pub merge_deg: f64,
    /// When the best hypothesis loses more than this in each metre (logarithm of odds), new ones are sown.
    pub doubt: f64,
    /// Over so much of the way that is looked at. **Units:** m.
    pub doubt_over_m: f64,
    /// New ones are sown so far around the best. **Units:** m.
    pub sow_m: f64,
    /// All of them together are less likely than the best by this (logarithm of odds).
    pub sown: f64,
    /// When so many positions of other sources in succession contradict what is known, new ones are sown around the last.
    pub contradicted: usize,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            aside_m: 0.6,
            open_aside_m: 0.8,
            open_over_m: 4.0,
            aside_over_m: 5.0,
            beyond_m: 0.4,
            blind_m: 1.5,
            direction_deg: 13.0,
            direction_over_m: 2.5,
            any_direction: 0.1,
            slack_m: 1.5,
            fork: 0.2,
            open_fork: 0.4,
            elevator: 3.0,
            elevator_s: 6.0,
            scale: 0.03,
            scale_walk: 0.001,
            place_m: 0.02,
            turn_deg: 0.3,
            stairs_step_m: 0.0,
            height_m: 0.4,
            height_walk_m: 0.02,
            given_up: 12.0,
            most: 400,
            fewer: 0.97,
            merge_m: 0.5,
            merge_sigmas: 0.8,
            merge_deg: 8.0,
            doubt: 1.4,
            doubt_over_m: 6.0,
            sow_m: 15.0,
            sown: 4.0,
            contradicted: 3,
        }
    }
}

impl Parameters {
    /// The settings for a phone in the hand, which does not notice stairs.
    pub fn phone() -> Self {
        Self { stairs_step_m: 0.30, ..Self::default() }
    }

    /// Whether one can follow with them.
    ///
    /// # Errors
    /// Names the setting that is out of its bounds.
    pub fn check(&self) -> Result<(), String> {
        let bounds = [
            ("aside_m", self.aside_m, 0.05, 20.0),
            ("open_aside_m", self.open_aside_m, 0.05, 50.0),
            ("open_over_m", self.open_over_m, 0.1, 1e3),
            ("aside_over_m", self.aside_over_m, 0.1, 100.0),
            ("beyond_m", self.beyond_m, 0.05, 20.0),
            ("blind_m", self.blind_m, 0.05, 20.0),
            ("direction_deg", self.direction_deg, 0.5, 180.0),
            ("direction_over_m", self.direction_over_m, 0.1, 100.0),
            ("any_direction", self.any_direction, 1e-6, 1.0),
            ("slack_m", self.slack_m, 0.0, 20.0),
            ("fork", self.fork, 0.0, 1.0),
            ("open_fork", self.open_fork, 0.0, 1.0),
            ("elevator", self.elevator, 0.0, 100.0),
            ("elevator_s", self.elevator_s, 0.0, 1e4),
            ("scale", self.scale, 0.0, 0.5),
            ("scale_walk", self.scale_walk, 0.0, 0.5),
            ("place_m", self.place_m, 0.0, 10.0),
            ("turn_deg", self.turn_deg, 0.0, 90.0),
            ("stairs_step_m", self.stairs_step_m, 0.0, 2.0),
            ("height_m", self.height_m, 0.01, 100.0),
            ("height_walk_m", self.height_walk_m, 0.0, 10.0),
            ("given_up", self.given_up, 1.0, 100.0),
            ("most", self.most as f64, 1.0, 1e7),
            ("fewer", self.fewer, 0.1, 1.0),
            ("merge_sigmas", self.merge_sigmas, 0.0, 10.0),
            ("merge_m", self.merge_m, 0.0, 10.0),
            ("merge_deg", self.merge_deg, 0.0, 180.0),
            ("doubt", self.doubt, 0.01, 100.0),
            ("doubt_over_m", self.doubt_over_m, 0.1, 1e3),
            ("sow_m", self.sow_m, 0.0, 1e4),
            ("sown", self.sown, 0.0, 100.0),
            ("contradicted", self.contradicted as f64, 1.0, 1e6),
        ];
        match bounds.iter().find(|(_, value, low, high)| !(low..=high).contains(&value)) {
            Some((name, value, low, high)) => Err(format!("{name} = {value}: expected {low} to {high}")),
            None => Ok(()),
        }
    }
}
