//! Normal equations of states in a row, each joined with the next only: a matrix of three diagonals of blocks.

use super::state::{Block, Column, Prior};
use nalgebra::Cholesky;

/// The equations, and how far they are eliminated from the oldest state on. The work is linear in the number of states.
#[derive(Clone, Debug, Default)]
pub struct Chain {
    /// Blocks on the diagonal, one for each state.
    pub diagonal: Vec<Block>,
    /// Blocks beside it: state and the next.
    pub beside: Vec<Block>,
    /// Right sides: the gradient with the other sign.
    pub right: Vec<Column>,
}

/// Eliminated equations.
#[derive(Clone, Debug, Default)]
pub struct Eliminated {
    /// Of each state: what is known of it from all that is older, inverted.
    inverse: Vec<Block>,
    /// `inverse` times the block beside.
    gain: Vec<Block>,
    right: Vec<Column>,
}

impl Chain {
    /// So many states, nothing known.
    pub fn clear(&mut self, count: usize) {
        self.diagonal.clear();
        self.diagonal.resize(count, Block::zeros());
        self.beside.clear();
        self.beside.resize(count.saturating_sub(1), Block::zeros());
        self.right.clear();
        self.right.resize(count, Column::zeros());
    }

    /// Eliminates all; nothing, and nothing is known, where a state is not determined.
    pub fn eliminate(&self, into: &mut Eliminated) -> Option<()> {
        into.clear();
        let done = self.eliminate_into(into);
        if done.is_none() {
            into.clear();
        }
        done
    }

    fn eliminate_into(&self, into: &mut Eliminated) -> Option<()> {
        let mut carried: Option<(Block, Column)> = None;
        for (index, (diagonal, right)) in self.diagonal.iter().zip(&self.right).enumerate() {
            let (mut own, mut side) = (*diagonal, *right);
            if let Some((block, column)) = carried {
                own -= block;
                side -= column;
            }
            let inverse = Cholesky::new(own)?.inverse();
            into.inverse.push(inverse);
            into.right.push(side);
            if let Some(beside) = self.beside.get(index) {
                let gain = inverse * beside;
                carried = Some((beside.tr_mul(&gain), gain.tr_mul(&side)));
                into.gain.push(gain);
            }
        }
        Some(())
    }
}

impl Chain {
    /// Of two states: what the first says of the second, which is at `state`.
    pub fn reduced(&self, state: Column) -> Prior {
        let [first, second] = [0, 1].map(|index| (self.diagonal[index], self.right[index]));
        let Some(cholesky) = Cholesky::new(first.0) else {
            return Prior { at: state, gradient: -second.1, information: second.0 };
        };
        let gain = cholesky.solve(&self.beside[0]);
        let information = second.0 - self.beside[0].tr_mul(&gain);
        let gradient = gain.tr_mul(&first.1) - second.1;
        // What rounding leaves asymmetric would grow.
        Prior { at: state, gradient, information: (information + information.transpose()) * 0.5 }
    }
}

impl Eliminated {
    fn clear(&mut self) {
        self.inverse.clear();
        self.gain.clear();
        self.right.clear();
    }

    /// The solution.
    pub fn solve(&self, into: &mut Vec<Column>) {
        into.clear();
        into.resize(self.right.len(), Column::zeros());
        for index in (0..self.right.len()).rev() {
            into[index] = self.inverse[index] * self.right[index];
            if index + 1 < self.right.len() {
                let next = into[index + 1];
                into[index] -= self.gain[index] * next;
            }
        }
    }

    /// A new state at the end, joined with the last by `before`, `cross` and `after`; at the solution, so that nothing moves.
    pub fn append(&mut self, before: &Block, cross: &Block, after: &Block) -> Option<()> {
        let last = self.inverse.len().checked_sub(1)?;
        // Inverting twice is for the last block only, and keeps one array less.
        let known = Cholesky::new(self.inverse[last])?.inverse() + before;
        let inverse = Cholesky::new(known)?.inverse();
        let gain = inverse * cross;
        self.inverse[last] = inverse;
        self.inverse.push(Cholesky::new(after - cross.tr_mul(&gain))?.inverse());
        self.gain.push(gain);
        self.right.push(Column::zeros());
        Some(())
    }

    /// Forgets the oldest state; the last stays.
    pub fn forget_first(&mut self) {
        if self.inverse.len() > 1 {
            self.inverse.remove(0);
            self.gain.remove(0);
            self.right.remove(0);
        }
    }

    /// Covariances from the newest state back to `oldest`, newest first: of the state, and of the state with the next.
    pub fn covariances(&self, oldest: usize) -> Vec<(Block, Block)> {
        let mut found: Vec<(Block, Block)> = Vec::new();
        for index in (oldest..self.inverse.len()).rev() {
            let next = match (found.last(), self.gain.get(index)) {
                (Some((later, _)), Some(gain)) => {
                    let cross = -gain * later;
                    (self.inverse[index] - cross * gain.transpose(), cross)
                }
                _ => (self.inverse[index], Block::zeros()),
            };
            found.push(next);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SMatrix, SVector};

    const STATES: usize = 9;
    const ALL: usize = 5 * STATES;

    /// Some number, always the same.
    fn some(index: usize) -> f64 {
        (index as f64 * 12.9898).sin()
    }

    fn chain() -> (Chain, SMatrix<f64, ALL, ALL>, SVector<f64, ALL>) {
        let mut chain = Chain::default();
        chain.clear(STATES);
        let mut dense = SMatrix::<f64, ALL, ALL>::zeros();
        let mut right = SVector::<f64, ALL>::zeros();
        for index in 0..STATES {
            let block = Block::from_fn(|row, column| some(25 * index + 5 * row + column));
            chain.diagonal[index] = block * block.transpose() + Block::identity() * 8.0;
            chain.right[index] = Column::from_fn(|row, _| some(1_000 + 5 * index + row));
            dense.fixed_view_mut::<5, 5>(5 * index, 5 * index).copy_from(&chain.diagonal[index]);
            right.fixed_rows_mut::<5>(5 * index).copy_from(&chain.right[index]);
            if index + 1 < STATES {
                chain.beside[index] = Block::from_fn(|row, column| some(5_000 + 25 * index + 5 * row + column));
                dense.fixed_view_mut::<5, 5>(5 * index, 5 * index + 5).copy_from(&chain.beside[index]);
                dense.fixed_view_mut::<5, 5>(5 * index + 5, 5 * index).copy_from(&chain.beside[index].transpose());
            }
        }
        (chain, dense, right)
    }

    #[test]
    fn it_agrees_with_the_dense_solution_and_inverse() {
        let (chain, dense, right) = chain();
        let inverse = dense.lu().try_inverse().unwrap();
        let expected = inverse * right;
        let (mut eliminated, mut found) = (Eliminated::default(), Vec::new());
        chain.eliminate(&mut eliminated).unwrap();
        eliminated.solve(&mut found);
        let covariances = eliminated.covariances(0);
        for index in 0..STATES {
            let at = 5 * index;
            assert!((found[index] - expected.fixed_rows::<5>(at)).amax() < 1e-9);
            let (own, cross) = &covariances[STATES - 1 - index];
            assert!((own - inverse.fixed_view::<5, 5>(at, at)).amax() < 1e-9);
            if index + 1 < STATES {
                assert!((cross - inverse.fixed_view::<5, 5>(at, at + 5)).amax() < 1e-9);
            }
        }
    }

    #[test]
    fn a_state_that_is_appended_has_the_covariance_of_the_whole() {
        let (mut chain, ..) = chain();
        let (before, after) = (Block::identity() * 2.0, Block::identity() * 3.0);
        let cross = Block::from_fn(|row, column| 0.3 * some(row * 5 + column));
        let mut grown = Eliminated::default();
        chain.eliminate(&mut grown).unwrap();
        grown.append(&before, &cross, &after).unwrap();
        chain.diagonal[STATES - 1] += before;
        chain.beside.push(cross);
        chain.diagonal.push(after);
        chain.right.push(Column::zeros());
        let mut whole = Eliminated::default();
        chain.eliminate(&mut whole).unwrap();
        for (one, other) in grown.covariances(0).iter().zip(whole.covariances(0)) {
            assert!((one.0 - other.0).amax() < 1e-9 && (one.1 - other.1).amax() < 1e-9);
        }
    }

    #[test]
    fn what_is_not_determined_has_no_solution() {
        let mut chain = Chain::default();
        chain.clear(2);
        assert!(chain.eliminate(&mut Eliminated::default()).is_none());
    }
}
