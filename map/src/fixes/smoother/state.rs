//! What is estimated at the end of each step.

use nalgebra::{SMatrix, SVector, Vector2};

/// Unknowns of a state.
pub const SIZE: usize = 5;
/// A block of the normal matrix.
pub type Block = SMatrix<f64, SIZE, SIZE>;
/// A column of it.
pub type Column = SVector<f64, SIZE>;

/// Place of the heading, of the logarithm of the step scale, and of the heading drift in a [`Column`]; x and y come first.
pub const HEADING: usize = 2;
/// See [`HEADING`].
pub const SCALE: usize = 3;
/// See [`HEADING`].
pub const DRIFT: usize = 4;

/// The place of a state.
pub fn place(state: &Column) -> Vector2<f64> {
    Vector2::new(state[0], state[1])
}

/// What is known of the oldest state from all that was before: a quadratic cost.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Where it was linearised.
    pub at: Column,
    /// Its gradient there.
    pub gradient: Column,
    /// Its second derivative.
    pub information: Block,
}

impl Prior {
    /// Independent standard deviations about a state.
    pub fn of(at: Column, sigmas: Column) -> Self {
        let information = Block::from_diagonal(&sigmas.map(|sigma| sigma.powi(-2)));
        Self { at, gradient: Column::zeros(), information }
    }

    /// Its gradient at a state.
    pub fn gradient(&self, state: &Column) -> Column {
        self.gradient + self.information * (state - self.at)
    }

    /// Its cost at a state, up to a constant.
    pub fn cost(&self, state: &Column) -> f64 {
        let off = state - self.at;
        self.gradient.dot(&off) + 0.5 * off.dot(&(self.information * off))
    }
}
