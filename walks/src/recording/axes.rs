//! Which recorded axis becomes which axis of the sensor frame.

use serde::{Deserialize, Serialize};

/// A turn of the axes by quarter turns, written as three axes with an optional sign: `["-y", "x", "z"]` means that
/// the new x is the recorded -y, the new y the recorded x, the new z the recorded z.
///
/// Only right-handed choices are accepted: a mirrored one would turn every rotation the wrong way round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "[String; 3]", into = "[String; 3]")]
pub struct Axes([Axis; 3]);

/// One recorded axis, perhaps reversed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Axis {
    index: usize,
    negative: bool,
}

const NAMES: [&str; 3] = ["x", "y", "z"];

impl Default for Axes {
    /// The axes as recorded.
    fn default() -> Self {
        Self([0, 1, 2].map(|index| Axis { index, negative: false }))
    }
}

impl Axes {
    /// Applies the choice to a vector.
    pub fn turn(&self, vector: [f64; 3]) -> [f64; 3] {
        self.0.map(|axis| if axis.negative { -vector[axis.index] } else { vector[axis.index] })
    }

    /// Determinant of the turn as a matrix: 0 when an axis is used twice, -1 when it mirrors.
    fn determinant(&self) -> i32 {
        let sign = self.0.iter().fold(1, |sign, axis| if axis.negative { -sign } else { sign });
        match self.0.map(|axis| axis.index) {
            [0, 1, 2] | [1, 2, 0] | [2, 0, 1] => sign,
            [0, 2, 1] | [2, 1, 0] | [1, 0, 2] => -sign,
            _ => 0,
        }
    }
}

impl TryFrom<[String; 3]> for Axes {
    type Error = String;

    fn try_from(names: [String; 3]) -> Result<Self, String> {
        let mut axes = Self::default();
        for (axis, name) in axes.0.iter_mut().zip(&names) {
            axis.negative = name.starts_with('-');
            let bare = name.trim_start_matches(['-', '+']);
            axis.index = NAMES
                .iter()
                .position(|&known| known == bare)
                .ok_or_else(|| format!("'{name}' is no axis; known: x, y, z, -x, -y, -z"))?;
        }
        match axes.determinant() {
            1 => Ok(axes),
            0 => Err(format!("axes {names:?} use an axis twice")),
            _ => Err(format!("axes {names:?} are left-handed; reverse one of them or exchange two")),
        }
    }
}

impl From<Axes> for [String; 3] {
    fn from(axes: Axes) -> Self {
        axes.0.map(|axis| format!("{}{}", if axis.negative { "-" } else { "" }, NAMES[axis.index]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(x: &str, y: &str, z: &str) -> Result<Axes, String> {
        Axes::try_from([x, y, z].map(String::from))
    }

    #[test]
    fn a_quarter_turn_moves_and_reverses_axes() {
        assert_eq!(axes("-y", "x", "z").unwrap().turn([1.0, 2.0, 3.0]), [-2.0, 1.0, 3.0]);
        assert_eq!(Axes::default().turn([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn there_are_twenty_four_mountings() {
        let signed = ["x", "y", "z", "-x", "-y", "-z"];
        let mut count = 0;
        for x in signed {
            for y in signed {
                for z in signed {
                    if let Ok(axes) = axes(x, y, z) {
                        count += 1;
                        assert_eq!(<[String; 3]>::from(axes), [x, y, z]);
                    }
                }
            }
        }
        assert_eq!(count, 24);
    }

    #[test]
    fn wrong_axes_are_told_apart() {
        assert!(axes("x", "x", "z").unwrap_err().contains("twice"));
        assert!(axes("y", "x", "z").unwrap_err().contains("left-handed"));
        assert!(axes("x", "y", "w").unwrap_err().contains("'w' is no axis"));
        assert!(axes("", "y", "z").unwrap_err().contains("'' is no axis"));
    }
}
