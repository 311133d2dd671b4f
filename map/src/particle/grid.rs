//! The walls of one floor, so arranged that the cost of a question does not grow with the building.
//!
//! The floor is cut into square cells. Each cell holds the walls that touch it, and how far it is from the nearest wall:
//! a move that is shorter meets none, and most moves are answered by that one number.

/// Side of a cell. **Units:** m. About a step: a move then meets two or three cells.
pub(super) const CELL_M: f32 = 1.0;
/// What lies beyond the outermost walls and still belongs to the grid. **Units:** m.
const MARGIN_M: f32 = 3.0;
/// A wall also counts in cells that it misses by so little: positions near the border of a cell are rounded. **Units:** m.
const SLACK_M: f32 = 1e-3;
/// Unit of the kept distances. **Units:** m.
const DISTANCE_UNIT_M: f32 = 0.05;

/// A wall from one point to another. **Units:** m; **Frame:** building.
pub type Wall = [[f32; 2]; 2];

/// Walls by place.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Lower left corner. **Units:** m.
    origin: [f32; 2],
    columns: usize,
    rows: usize,
    /// Where the walls of a cell begin in `walls`; one more than cells.
    starts: Vec<u32>,
    walls: Vec<Wall>,
    /// Distance from the nearest point of a cell to the nearest wall, rounded down. **Units:** [`DISTANCE_UNIT_M`].
    clear: Vec<u8>,
    /// Walls that were given.
    count: usize,
}

impl Grid {
    /// Arranges walls; `lower` and `upper` are the corners of the building. **Units:** m.
    pub fn new(walls: &[Wall], lower: [f32; 2], upper: [f32; 2]) -> Self {
        let origin = lower.map(|value| value - MARGIN_M);
        let extent = |axis: usize| ((upper[axis] + MARGIN_M - origin[axis]) / CELL_M).ceil().max(1.0) as usize;
        let (columns, rows) = (extent(0), extent(1));
        let mut cells: Vec<Vec<u32>> = vec![Vec::new(); columns * rows];
        for (index, wall) in walls.iter().enumerate() {
            let range = |axis: usize, count: usize| {
                let cell = |value: f32| ((value - origin[axis]) / CELL_M).floor();
                let (a, b) = (wall[0][axis], wall[1][axis]);
                let first = cell(a.min(b) - SLACK_M).max(0.0) as usize;
                let last = (cell(a.max(b) + SLACK_M).max(0.0) as usize).min(count - 1);
                first..=last
            };
            for row in range(1, rows) {
                for column in range(0, columns) {
                    let corner = [origin[0] + column as f32 * CELL_M, origin[1] + row as f32 * CELL_M];
                    if touches(wall, corner) {
                        cells[row * columns + column].push(index as u32);
                    }
                }
            }
        }
        let mut starts = Vec::with_capacity(cells.len() + 1);
        let mut sorted = Vec::new();
        starts.push(0);
        for cell in &cells {
            sorted.extend(cell.iter().map(|&index| walls[index as usize]));
            starts.push(sorted.len() as u32);
        }
        let mut grid =
            Self { origin, columns, rows, starts, walls: sorted, clear: vec![0; cells.len()], count: walls.len() };
        grid.measure(walls);
        grid
    }

    /// The distances: exact to cells within the reach of the byte, by spreading outwards from each wall.
    fn measure(&mut self, walls: &[Wall]) {
        let reach = f32::from(u8::MAX) * DISTANCE_UNIT_M;
        let mut distance = vec![reach; self.clear.len()];
        for wall in walls {
            let range = |axis: usize, count: usize| {
                let cell = |value: f32| ((value - self.origin[axis]) / CELL_M).floor().max(0.0) as usize;
                let (a, b) = (wall[0][axis], wall[1][axis]);
                cell(a.min(b) - reach)..=cell(a.max(b) + reach).min(count - 1)
            };
            for row in range(1, self.rows) {
                for column in range(0, self.columns) {
                    let centre = self.centre(column, row);
                    // The centre of a cell is never farther from any of its points than half its diagonal.
                    let near = distance_to(wall, centre) - CELL_M * std::f32::consts::FRAC_1_SQRT_2 - SLACK_M;
                    let known = &mut distance[row * self.columns + column];
                    *known = known.min(near);
                }
            }
        }
        for (clear, distance) in self.clear.iter_mut().zip(distance) {
            // Saturating: below zero where a wall crosses the cell.
            *clear = (distance / DISTANCE_UNIT_M) as u8;
        }
    }

    fn centre(&self, column: usize, row: usize) -> [f32; 2] {
        [self.origin[0] + (column as f32 + 0.5) * CELL_M, self.origin[1] + (row as f32 + 0.5) * CELL_M]
    }

    /// The cell of a point, if it is on the grid.
    pub fn cell(&self, point: [f32; 2]) -> Option<usize> {
        let column = (point[0] - self.origin[0]) * (1.0 / CELL_M);
        let row = (point[1] - self.origin[1]) * (1.0 / CELL_M);
        // Written so that no number is on no grid.
        if column >= 0.0 && row >= 0.0 && column < self.columns as f32 && row < self.rows as f32 {
            Some(row as usize * self.columns + column as usize)
        } else {
            None
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.clear.len()
    }

    /// Walls, each counted once.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        self.walls.len() * size_of::<Wall>() + self.starts.len() * size_of::<u32>() + self.clear.len()
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }

    /// Lower left corner. **Units:** m.
    pub fn origin(&self) -> [f32; 2] {
        self.origin
    }

    /// Whether the straight move from `a` to `b` meets a wall or leaves the grid. Touching a wall counts.
    pub fn blocked(&self, a: [f32; 2], b: [f32; 2]) -> bool {
        let Some(start) = self.cell(a) else { return true };
        let Some(end) = self.cell(b) else { return true };
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let clear = f32::from(self.clear[start]) * DISTANCE_UNIT_M;
        if dx * dx + dy * dy < clear * clear {
            return false;
        }
        if self.meets(start, a, [dx, dy]) {
            return true;
        }
        if start == end {
            return false;
        }
        self.walk(start, end, a, [dx, dy])
    }

    /// The cells after the first that a move goes through, one by one (Amanatides and Woo, "A fast voxel traversal
    /// algorithm for ray tracing", Eurographics 1987).
    fn walk(&self, start: usize, end: usize, a: [f32; 2], move_by: [f32; 2]) -> bool {
        let columns = self.columns as isize;
        let mut cell = start as isize;
        let (mut column, mut row) = (cell % columns, cell / columns);
        let axis = |axis: usize, index: isize| {
            let speed = move_by[axis];
            let low = self.origin[axis] + index as f32 * CELL_M;
            let (border, stride) = if speed > 0.0 { (low + CELL_M, 1) } else { (low, -1) };
            let inverse = if speed == 0.0 { f32::INFINITY } else { 1.0 / speed };
            // Parts of the move until the next border, and from border to border.
            (if speed == 0.0 { f32::INFINITY } else { (border - a[axis]) * inverse }, CELL_M * inverse.abs(), stride)
        };
        let (mut next_x, part_x, stride_x) = axis(0, column);
        let (mut next_y, part_y, stride_y) = axis(1, row);
        let (end_column, end_row) = (end as isize % columns, end as isize / columns);
        // As many borders as there are between the two cells, and not one more, whatever was rounded.
        for _ in 0..(end_column - column).abs() + (end_row - row).abs() {
            let across = if column == end_column {
                false
            } else if row == end_row {
                true
            } else {
                next_x < next_y
            };
            if across {
                (column, next_x) = (column + stride_x, next_x + part_x);
            } else {
                (row, next_y) = (row + stride_y, next_y + part_y);
            }
            cell = row * columns + column;
            if self.meets(cell as usize, a, move_by) {
                return true;
            }
        }
        false
    }

    /// Whether a move meets a wall of this cell.
    fn meets(&self, cell: usize, a: [f32; 2], move_by: [f32; 2]) -> bool {
        let walls = &self.walls[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        walls.iter().any(|wall| intersects(wall, a, move_by))
    }
}

/// Whether the move from `a` by `move_by` meets the wall. Along the wall it does not.
fn intersects(wall: &Wall, a: [f32; 2], move_by: [f32; 2]) -> bool {
    // From `a`, so that the products are small and exact enough.
    let p = [wall[0][0] - a[0], wall[0][1] - a[1]];
    let q = [wall[1][0] - a[0], wall[1][1] - a[1]];
    let side_p = move_by[0] * p[1] - move_by[1] * p[0];
    let side_q = move_by[0] * q[1] - move_by[1] * q[0];
    if side_p * side_q > 0.0 {
        return false;
    }
    let along = [q[0] - p[0], q[1] - p[1]];
    let side_a = along[1] * p[0] - along[0] * p[1];
    let side_b = side_a + along[0] * move_by[1] - along[1] * move_by[0];
    side_a * side_b <= 0.0 && side_a != side_b
}

/// Whether a wall comes into the cell with this lower left corner.
fn touches(wall: &Wall, corner: [f32; 2]) -> bool {
    let low = corner.map(|value| value - SLACK_M);
    let high = corner.map(|value| value + CELL_M + SLACK_M);
    // Clips the wall (Liang and Barsky, ACM Transactions on Graphics 3, 1984).
    let (mut first, mut last) = (0.0_f32, 1.0_f32);
    for axis in 0..2 {
        let (from, by) = (wall[0][axis], wall[1][axis] - wall[0][axis]);
        if by == 0.0 {
            if from < low[axis] || from > high[axis] {
                return false;
            }
            continue;
        }
        let (enter, leave) = ((low[axis] - from) / by, (high[axis] - from) / by);
        first = first.max(enter.min(leave));
        last = last.min(enter.max(leave));
    }
    first <= last
}

/// Distance of a point to a wall. **Units:** m.
pub(super) fn distance_to(wall: &Wall, point: [f32; 2]) -> f32 {
    let [along, to] =
        [[wall[1][0] - wall[0][0], wall[1][1] - wall[0][1]], [point[0] - wall[0][0], point[1] - wall[0][1]]];
    let length = along[0] * along[0] + along[1] * along[1];
    let part = if length > 0.0 { ((along[0] * to[0] + along[1] * to[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - part * along[0]).hypot(to[1] - part * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same question, asked of every wall.
    fn blocked_by_any(walls: &[Wall], a: [f32; 2], b: [f32; 2]) -> bool {
        walls.iter().any(|wall| intersects(wall, a, [b[0] - a[0], b[1] - a[1]]))
    }

    fn point(size: f32) -> impl Strategy<Value = [f32; 2]> {
        proptest::array::uniform2(0.0..size)
    }

    proptest! {
        #[test]
        fn the_grid_answers_as_if_every_wall_had_been_asked(
            walls in proptest::collection::vec(proptest::array::uniform2(point(20.0)), 0..40),
            moves in proptest::collection::vec((point(20.0), point(20.0)), 1..100),
            short in proptest::collection::vec((point(20.0), proptest::array::uniform2(-1.5_f32..1.5)), 1..100),
        ) {
            let grid = Grid::new(&walls, [0.0; 2], [20.0; 2]);
            let short = short.into_iter().map(|(a, by)| (a, [a[0] + by[0], a[1] + by[1]]));
            for (a, b) in moves.into_iter().chain(short) {
                prop_assert_eq!(grid.blocked(a, b), blocked_by_any(&walls, a, b), "{:?} {:?}", a, b);
            }
        }

        #[test]
        fn walls_along_the_borders_of_cells_do_not_leak(x in -4_i32..4, y in 0.0_f32..1.0, by in 0.001_f32..3.0) {
            let wall = [[x as f32, -10.0], [x as f32, 10.0]];
            let grid = Grid::new(&[wall], [-10.0; 2], [10.0; 2]);
            prop_assert!(grid.blocked([x as f32 - by, y], [x as f32 + by, -y]));
            prop_assert!(grid.blocked([x as f32 + by, y], [x as f32 - by, -y]));
        }
    }

    #[test]
    fn a_joint_of_two_walls_is_closed() {
        let walls = [[[0.0, -5.0], [0.3, 0.7]], [[0.3, 0.7], [0.0, 5.0]]];
        let grid = Grid::new(&walls, [-5.0; 2], [5.0; 2]);
        assert!(grid.blocked([-0.7, 0.7], [1.3, 0.7]));
    }

    #[test]
    fn beyond_the_grid_nobody_goes_and_no_number_is_nowhere() {
        let grid = Grid::new(&[], [0.0; 2], [10.0; 2]);
        assert!(!grid.blocked([1.0, 1.0], [12.0, 1.0]));
        assert!(grid.blocked([1.0, 1.0], [14.0, 1.0]));
        assert!(grid.blocked([1.0, 1.0], [f32::NAN, 1.0]));
        assert_eq!(grid.cell([f32::INFINITY, 0.0]), None);
    }
}
