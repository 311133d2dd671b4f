//! Segments by place, to find those near a point without looking at all.

use crate::building::geometry::{self, Point, Segment};
use std::collections::BTreeMap;

/// Side of a cell. **Units:** m.
const CELL_M: f64 = 1.0;

/// Segments in a grid of cells.
pub struct Index<'a> {
    segments: &'a [Segment],
    cells: BTreeMap<[i64; 2], Vec<usize>>,
}

impl<'a> Index<'a> {
    /// An index of all segments.
    pub fn of(segments: &'a [Segment]) -> Self {
        let mut cells: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
        for (number, segment) in segments.iter().enumerate() {
            for piece in pieces(segment, CELL_M) {
                let [low, high] = geometry::bounds(piece).unwrap_or_default();
                for cell in between(low, high) {
                    let here = cells.entry(cell).or_default();
                    if here.last() != Some(&number) {
                        here.push(number);
                    }
                }
            }
        }
        Self { segments, cells }
    }

    /// Numbers of the segments that may be within `reach` of the rectangle between two corners, each once, in order.
    pub fn near(&self, [low, high]: [Point; 2], reach: f64) -> Vec<usize> {
        let cells = between(low.map(|value| value - reach), high.map(|value| value + reach));
        let mut found: Vec<usize> = cells.filter_map(|cell| self.cells.get(&cell)).flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The segment of a number.
    pub fn segment(&self, number: usize) -> &Segment {
        &self.segments[number]
    }
}

/// A segment cut into pieces of at most `longest`.
pub fn pieces(segment: &Segment, longest: f64) -> impl Iterator<Item = Segment> {
    let [a, b] = *segment;
    let count = (geometry::length(segment) / longest).ceil().max(1.0);
    let at = move |index: u32| geometry::between(a, b, f64::from(index) / count);
    (0..count as u32).map(move |index| [at(index), at(index + 1)])
}

fn between(low: Point, high: Point) -> impl Iterator<Item = [i64; 2]> {
    let cell = |point: Point| point.map(|value| (value / CELL_M).floor() as i64);
    let ([x0, y0], [x1, y1]) = (cell(low), cell(high));
    (x0..=x1).flat_map(move |x| (y0..=y1).map(move |y| [x, y]))
}
