//! What a picture of a walk shows, before anything is drawn.

use super::Named;
use sohle_shared::step::FloorMode;

/// Which of several tracks of one walk a line is. Decides its colour and what lies on top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Where the foot really was.
    Truth,
    /// Tracked with the settings of the source document.
    Documented,
    /// Tracked with the settings in use.
    Chosen,
}

/// A turn about the vertical and a shift: how a track, whose origin and heading are arbitrary, lies in another frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Counter-clockwise from above, first. **Units:** rad.
    pub turn: f64,
    /// Then. **Units:** m.
    pub shift: [f64; 3],
}

impl Placement {
    /// Where `point` comes to lie.
    pub fn of(&self, point: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.turn.sin_cos();
        [
            cos * point[0] - sin * point[1] + self.shift[0],
            sin * point[0] + cos * point[1] + self.shift[1],
            point[2] + self.shift[2],
        ]
    }
}

/// A place where the foot stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Where. **Units:** m; **Frame:** that of the picture, z up.
    pub position: [f64; 3],
    /// What the ground did on the way there.
    pub mode: FloorMode,
}

/// One track.
#[derive(Clone, Debug)]
pub struct Line {
    /// Which.
    pub role: Role,
    /// Its name in the legend.
    pub label: String,
    /// One text for each of [`Picture::columns`].
    pub cells: Vec<String>,
    /// Where the foot stood, in order.
    pub dots: Vec<Dot>,
    /// The foot between the stances too; may be empty. **Units:** m; **Frame:** that of the picture.
    pub foot: Vec<[f64; 3]>,
}

impl Line {
    /// The line of a track, with the figures of its row.
    pub fn of(named: &Named<'_>, cells: Vec<String>) -> Self {
        let track = named.track;
        let dots = track
            .stances
            .iter()
            .zip(&track.steps)
            .map(|(stance, step)| Dot { position: named.placement.of(stance.position), mode: step.mode })
            .collect();
        let foot = track.path.iter().map(|point| named.placement.of(point.position)).collect();
        Self { role: named.role, label: named.label.to_owned(), cells, dots, foot }
    }
}

/// Several tracks of one walk and what is known about them.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// What walk it is.
    pub title: String,
    /// A line of figures below the title.
    pub note: String,
    /// Headings of the figures of each line.
    pub columns: Vec<String>,
    /// The tracks.
    pub lines: Vec<Line>,
}

impl Picture {
    /// A picture of nothing yet.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_placement_turns_counter_clockwise_and_then_shifts() {
        let placement = Placement { turn: core::f64::consts::FRAC_PI_2, shift: [10.0, 0.0, 1.0] };
        let [x, y, z] = placement.of([2.0, 0.0, 0.5]);
        // Only the rounding of sin and cos lies between.
        assert!((x - 10.0).abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && (z - 1.5).abs() < 1e-12);
    }
}
