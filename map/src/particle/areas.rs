//! Areas of one floor (rooms, stairs, elevators) by place.

use super::grid::{CELL_M, Grid, distance_to};

/// The corners of an area, in order; the last is joined to the first. **Units:** m; **Frame:** building.
pub type Outline = Vec<[f32; 2]>;

/// Areas, each with a number of its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Areas {
    outlines: Vec<(u16, Outline)>,
    /// Where the entries of a cell begin in `entries`; one more than cells.
    starts: Vec<u32>,
    entries: Vec<Entry>,
}

/// An area that comes into a cell.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Which of the outlines.
    outline: u32,
    /// The whole cell is in it.
    whole: bool,
}

impl Areas {
    /// Arranges areas in the cells of `grid`.
    pub fn new(outlines: Vec<(u16, Outline)>, grid: &Grid) -> Self {
        let mut cells: Vec<Vec<Entry>> = vec![Vec::new(); grid.len()];
        let (columns, rows) = grid.size();
        for (index, (_, outline)) in outlines.iter().enumerate() {
            if outline.len() < 3 {
                continue;
            }
            let range = |axis: usize, count: usize| {
                let values = outline.iter().map(|point| (point[axis] - grid.origin()[axis]) / CELL_M);
                let (low, high) =
                    values.fold((f32::INFINITY, 0.0_f32), |(low, high), value| (low.min(value), high.max(value)));
                low.max(0.0) as usize..=(high as usize).min(count - 1)
            };
            for row in range(1, rows) {
                for column in range(0, columns) {
                    let centre = [0, 1].map(|axis| grid.origin()[axis] + ([column, row][axis] as f32 + 0.5) * CELL_M);
                    let border = edges(outline).map(|edge| distance_to(&edge, centre)).fold(f32::INFINITY, f32::min);
                    let inside = contains(outline, centre);
                    let half_diagonal = CELL_M * std::f32::consts::FRAC_1_SQRT_2;
                    if inside || border <= half_diagonal {
                        let whole = inside && border > half_diagonal;
                        cells[row * columns + column].push(Entry { outline: index as u32, whole });
                    }
                }
            }
        }
        let mut areas = Self { outlines, starts: vec![0], entries: Vec::new() };
        for cell in cells {
            areas.entries.extend(cell);
            areas.starts.push(areas.entries.len() as u32);
        }
        areas
    }

    /// The number of the first area that holds `point`, which lies in `cell` of the grid.
    pub fn at(&self, cell: usize, point: [f32; 2]) -> Option<u16> {
        let (first, last) = (self.starts[cell] as usize, self.starts[cell + 1] as usize);
        let entry = self.entries[first..last]
            .iter()
            .find(|entry| entry.whole || contains(&self.outlines[entry.outline as usize].1, point))?;
        Some(self.outlines[entry.outline as usize].0)
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        let corners: usize = self.outlines.iter().map(|(_, outline)| outline.len()).sum();
        corners * size_of::<[f32; 2]>() + self.starts.len() * size_of::<u32>() + self.entries.len() * size_of::<Entry>()
    }

    /// Every area.
    pub fn outlines(&self) -> &[(u16, Outline)] {
        &self.outlines
    }
}

fn edges(outline: &[[f32; 2]]) -> impl Iterator<Item = [[f32; 2]; 2]> + '_ {
    (0..outline.len()).map(|i| [outline[i], outline[(i + 1) % outline.len()]])
}

/// Whether an outline holds a point: a line from it crosses the border an odd number of times.
fn contains(outline: &[[f32; 2]], [x, y]: [f32; 2]) -> bool {
    edges(outline)
        .filter(|[a, b]| (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0])
        .count()
        % 2
        == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn cells_answer_as_the_outlines_do(
            corners in proptest::collection::vec(proptest::array::uniform2(0.0_f32..20.0), 3..8),
            points in proptest::collection::vec(proptest::array::uniform2(-2.0_f32..22.0), 1..100),
        ) {
            let grid = Grid::new(&[], [0.0; 2], [20.0; 2]);
            let areas = Areas::new(vec![(3, corners.clone())], &grid);
            for point in points {
                let cell = grid.cell(point).unwrap();
                prop_assert_eq!(areas.at(cell, point), contains(&corners, point).then_some(3), "{:?}", point);
            }
        }
    }

    #[test]
    fn a_square_holds_its_middle_and_not_its_outside() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        assert!(contains(&square, [2.0, 2.0]));
        assert!(!contains(&square, [5.0, 2.0]) && !contains(&square, [2.0, -1.0]));
    }
}
