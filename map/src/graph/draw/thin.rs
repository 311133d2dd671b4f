//! Thins the free places of a floor to lines along their middle.
//!
//! # Source
//! Distance-ordered homotopic thinning (Pudney 1998): cells are taken away from the walls inwards, as long as nothing falls
//! apart, no hole closes and none of those that are to stay goes.

use super::free::Free;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What is left of the free cells; those of `keep` stay. What leads to none of them vanishes but for one cell.
pub fn thin(free: &Free, keep: &[bool]) -> Vec<bool> {
    let mut left = free.free.clone();
    let mut open = BinaryHeap::new();
    let key = |cell: usize| Reverse(((f64::from(free.clearance[cell]) * 1e3) as u64, cell));
    for cell in (0..left.len()).filter(|&cell| left[cell]) {
        if !free.around(cell).iter().all(|next| next.is_some_and(|next| left[next])) {
            open.push(key(cell));
        }
    }
    while let Some(Reverse((_, cell))) = open.pop() {
        if !left[cell] || keep[cell] || !is_simple(free, &left, cell) {
            continue;
        }
        left[cell] = false;
        open.extend(free.around(cell).into_iter().flatten().filter(|&next| left[next]).map(key));
    }
    left
}

/// Whether what is left stays in one piece, with the same holes, without a cell: eight neighbours are beside it in what is
/// left, four in what is not (Hilditch's crossing number is one).
fn is_simple(free: &Free, left: &[bool], cell: usize) -> bool {
    let around = free.around(cell).map(|next| next.is_some_and(|next| left[next]));
    let crossing = [0, 2, 4, 6].into_iter().filter(|&side| {
        let [here, next, after] = [side, side + 1, side + 2].map(|side| around[side % 8]);
        !here && (next || after)
    });
    crossing.count() == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{Building, Floor, Room, geometry::Segment};

    fn rectangle(x: f64, y: f64, [w, h]: [f64; 2]) -> Vec<[f64; 2]> {
        vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
    }

    /// A ring: 10 m by 10 m with a block of 6 m by 6 m in it.
    fn ring() -> Free {
        let walls: Vec<Segment> = [rectangle(0.0, 0.0, [10.0; 2]), rectangle(2.0, 2.0, [6.0; 2])]
            .iter()
            .flat_map(|outline| crate::building::geometry::sides(outline).collect::<Vec<_>>())
            .collect();
        let room = Room { name: "ring".into(), usage: None, outline: rectangle(0.0, 0.0, [10.0; 2]) };
        let floor = Floor { walls, rooms: vec![room], ..Floor::default() };
        let building = Building { floors: vec![floor], ..Building::default() };
        Free::of(&building, &building.floors[0], 0.2, 0.1)
    }

    #[test]
    fn a_ring_stays_a_ring_in_its_middle_and_what_leads_nowhere_vanishes() {
        let free = ring();
        let mut keep = vec![false; free.count()];
        let start = free.cell([1.0, 5.0]).unwrap();
        keep[start] = true;
        let left = thin(&free, &keep);
        let cells: Vec<usize> = (0..left.len()).filter(|&cell| left[cell]).collect();
        for &cell in &cells {
            let [x, y] = free.place(cell);
            let in_block = (2.0..8.0).contains(&x) && (2.0..8.0).contains(&y);
            // The block encloses free cells, which are thinned to one.
            if !in_block {
                let middle = [x, y].map(|value: f64| (value - 1.0).abs().min((value - 9.0).abs()));
                assert!(middle[0].min(middle[1]) < 0.16, "{x} {y}");
                assert_eq!(free.around(cell).into_iter().flatten().filter(|&next| left[next]).count(), 2, "{x} {y}");
            }
        }
        assert!((300..=340).contains(&cells.len()), "{}", cells.len());
    }

    #[test]
    fn without_a_ring_the_way_between_two_places_is_left() {
        let free = ring();
        let mut cut = free;
        for cell in 0..cut.count() {
            let [x, y] = cut.place(cell);
            if x > 8.0 && (4.0..5.0).contains(&y) {
                cut.free[cell] = false;
            }
        }
        let mut keep = vec![false; cut.count()];
        let ends = [[1.0, 5.0], [5.0, 9.0]].map(|place| cut.cell(place).unwrap());
        ends.iter().for_each(|&end| keep[end] = true);
        let left = thin(&cut, &keep);
        for end in ends {
            assert_eq!(cut.around(end).into_iter().flatten().filter(|&next| left[next]).count(), 1);
        }
        let right = (0..left.len()).filter(|&cell| left[cell] && cut.place(cell)[0] > 8.0).count();
        assert_eq!(right, 0);
    }
}
