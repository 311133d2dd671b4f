//! What the tracker decided at a step, and why.

use super::floors::{By, Change};
use super::matching::Matching;
use crate::building::geometry::Point;
use crate::graph::EdgeId;
use std::fmt;

/// What a step was taken for (Graph, figure 6.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// 1: straight on.
    Straight,
    /// 2: turning round, carried out.
    HalfTurn,
    /// 2: turning round, not yet at its end.
    HalfTurnBegun,
    /// 3: a turn, carried out.
    Turn,
    /// 3: what is left of turning round; a step along the edge.
    RestOfHalfTurn,
    /// 4: straight on beyond the end node.
    Beyond,
    /// 4: a turn behind the end of the edge.
    TurnBehindEnd,
    /// 5: found within the radius.
    LocalSearch,
    /// 5: found anywhere on the floor.
    GlobalSearch,
    /// 5: at the end of the route whose shape is most like that of the steps.
    MapMatching,
    /// 3 to 5: no edge fits yet.
    Waiting,
}

impl Case {
    /// Its number in the document; none while it waits.
    pub fn number(self) -> Option<u8> {
        match self {
            Self::Straight => Some(1),
            Self::HalfTurn | Self::HalfTurnBegun => Some(2),
            Self::Turn | Self::RestOfHalfTurn => Some(3),
            Self::Beyond | Self::TurnBehindEnd => Some(4),
            Self::LocalSearch | Self::GlobalSearch | Self::MapMatching => Some(5),
            Self::Waiting => None,
        }
    }

    /// Whether the edge was searched for.
    pub fn is_search(self) -> bool {
        self.number() == Some(5)
    }

    fn word(self) -> &'static str {
        match self {
            Self::Straight => "straight on",
            Self::HalfTurn => "half turn",
            Self::HalfTurnBegun => "half turn begun",
            Self::Turn => "turn",
            Self::RestOfHalfTurn => "rest of a half turn",
            Self::Beyond => "beyond the node",
            Self::TurnBehindEnd => "turn behind the end",
            Self::LocalSearch => "local search",
            Self::GlobalSearch => "global search",
            Self::MapMatching => "map matching",
            Self::Waiting => "waiting",
        }
    }
}

/// An edge that was looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Which.
    pub edge: EdgeId,
    /// Between its direction and the heading (Graph, 6.9). **Units:** rad, 0 to pi.
    pub angle: f64,
}

/// Where an edge was searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Around which place. **Units:** m; **Frame:** building.
    pub from: Point,
    /// How far. **Units:** m.
    pub radius_m: f64,
}

/// What was decided at a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// What the step was taken for.
    pub case: Case,
    /// Deviation of the heading from the edge, before the decision. **Units:** rad.
    pub delta: f64,
    /// Edges that were looked at, the best first; of a search those that fit.
    pub candidates: Vec<Candidate>,
    /// How far from the heading they may be. **Units:** rad.
    pub limit: f64,
    /// Where was searched, if it was.
    pub search: Option<Search>,
    /// What came of map matching, if the edge was searched for by that.
    pub matching: Option<Matching>,
    /// The floor was changed after that.
    pub change: Option<Change>,
    /// Steps held back, after the decision.
    pub window: usize,
    /// The edge after the decision.
    pub edge: EdgeId,
    /// How far along. **Units:** m.
    pub along_m: f64,
    /// Where that is. **Units:** m; **Frame:** building.
    pub place: Point,
    /// Its propagated error (standard deviation). **Units:** m.
    pub sigma_m: f64,
}

impl fmt::Display for Decision {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = self.case.number().map_or_else(|| "-".to_owned(), |number| number.to_string());
        write!(
            out,
            "case {number} {}, delta {:.1} deg, window {}",
            self.case.word(),
            self.delta.to_degrees(),
            self.window
        )?;
        if let Some(matching) = &self.matching {
            write!(out, ", {matching}")?;
        }
        if let Some(Search { from: [x, y], radius_m }) = self.search {
            write!(out, ", searched within {radius_m:.1} m of ({x:.2}, {y:.2})")?;
        }
        if !self.candidates.is_empty() {
            let listed = self.candidates.iter().take(6);
            let listed: Vec<String> = listed
                .map(|candidate| format!("{} at {:.1}", candidate.edge.0, candidate.angle.to_degrees()))
                .collect();
            write!(out, ", candidates {} (limit {:.0} deg)", listed.join(", "), self.limit.to_degrees())?;
        }
        if let Some(Change { from, to, by }) = self.change {
            let by = if by == By::Stairs { "stairs" } else { "an elevator" };
            write!(out, ", from floor {from} to floor {to} by {by}")?;
        }
        let [x, y] = self.place;
        write!(out, ": edge {} at {:.2} m, ({x:.2}, {y:.2}) +- {:.1} m", self.edge.0, self.along_m, self.sigma_m)
    }
}
