//! The simulated twin of the building in which the source document was evaluated.
//!
//! The document shows pictures, no measures: two floors, about 805 m² each (141 120 particles, 16 at a place, 0.30 m apart),
//! offices along corridors, two staircases, an elevator, a large room. Here two wings that are the same after half a
//! turn, each with a staircase at its outer end, stand on both sides of a hall: steps over stairs alone fit both.

use super::draft::{Draft, Rectangle};
use super::stairwell::{self, Stairwell};
use crate::building::{Building, Entrance, Error, Georeference, WalkGraph};

/// **Units:** mm.
const SIZE: [i64; 2] = [35_000, 23_000];
/// From floor to floor. **Units:** m.
const STOREY_M: f64 = 3.5;
/// The door of a room. **Units:** mm.
const DOOR: i64 = 950;
/// The corridor of the west wing, and where the one between the wings begins and ends. **Units:** mm.
const WING: [i64; 2] = [4_600, 6_400];
const ACROSS: [i64; 2] = [10_400, 12_600];
/// From where to where the middle part reaches. **Units:** mm.
const MIDDLE: [i64; 2] = [11_000, 24_000];
const ELEVATOR: Rectangle = Rectangle::new([16_400, ACROSS[1]], [18_600, 14_800]);

/// The building.
///
/// # Errors
/// Never for what is made here: only if the parts did not fit together.
pub fn twin() -> Result<Building, Error> {
    let wells = [
        ("west", Stairwell { corner: [0, 16_000], turned: false }),
        ("east", Stairwell { corner: [SIZE[0], SIZE[1] - 16_000], turned: true }),
    ];
    let mut graph = WalkGraph::default();
    let mut floors = Vec::new();
    for number in 0..2 {
        let mut draft = Draft::default();
        wing(&mut draft, number, false);
        wing(&mut draft, number, true);
        for (name, well) in &wells {
            well.draw(&mut draft, name);
        }
        middle(&mut draft, number);
        let height_m = f64::from(number) * STOREY_M;
        draft.add_ways(&mut graph, number, height_m);
        floors.push(draft.floor(number, if number == 0 { "EG" } else { "1OG" }, height_m));
    }
    for (_, well) in &wells {
        well.add_ways(&mut graph, 1, STOREY_M);
    }
    stairwell::ride(&mut graph, ELEVATOR, 1);
    let mut connectors: Vec<_> = wells.iter().map(|(name, well)| well.connector(name, 1, STOREY_M)).collect();
    connectors.push(stairwell::elevator("elevator", ELEVATOR, 1));
    let entrance = |name: &str, place| Entrance { name: name.to_owned(), floor: 0, place };
    Building {
        name: "Twin".to_owned(),
        // In the North Sea: nobody's house.
        georeference: Georeference::Geographic { origin: [7.5, 54.5], rotation_deg: 0.0 },
        floors,
        connectors,
        entrances: vec![entrance("main", [17.5, 0.5]), entrance("west", [5.5, 0.5]), entrance("east", [29.5, 22.5])],
        graph: Some(graph),
    }
    .assembled()
}

/// One wing: a corridor with offices on both sides and the staircase's door.
fn wing(draft: &mut Draft, number: i32, east: bool) {
    let place = |area: Rectangle| if east { area.turned(SIZE) } else { area };
    let line = |low, high| {
        let Rectangle { low, high } = place(Rectangle::new(low, high));
        (low, high)
    };
    let letter = if east { 'E' } else { 'W' };
    draft.corridor(format!("{letter}{number}"), place(Rectangle::new([WING[0], 0], [WING[1], SIZE[1]])));
    let outer = [0, 4_000, 8_000, 12_000, 16_000];
    let inner = [0, 3_400, 6_900, ACROSS[0], ACROSS[1], 16_100, 19_600, SIZE[1]];
    let mut count = 0;
    let mut office = |draft: &mut Draft, x: [i64; 2], y: [i64; 2], door_x: i64| {
        count += 1;
        let area = place(Rectangle::new([x[0], y[0]], [x[1], y[1]]));
        draft.room(format!("{letter}{number}{count:02}"), "office", area);
        let door = y[0] + 800;
        let (from, to) = line([door_x, door], [door_x, door + DOOR]);
        draft.door(from, to);
    };
    for pair in outer.windows(2) {
        office(draft, [0, WING[0]], [pair[0], pair[1]], WING[0]);
    }
    for pair in inner.windows(2).filter(|pair| pair[0] != ACROSS[0]) {
        office(draft, [WING[1], MIDDLE[0]], [pair[0], pair[1]], WING[1]);
    }
    let (from, to) = line([WING[0], 16_400], [WING[0], 17_400]);
    draft.door(from, to);
    let (from, to) = line([WING[1], ACROSS[0]], [WING[1], ACROSS[1]]);
    draft.opening(from, to);
    if number == 0 {
        let (from, to) = line([5_000, 0], [6_000, 0]);
        draft.door(from, to);
    }
}

/// The corridor between the wings, the hall to its south, rooms and elevator to its north.
fn middle(draft: &mut Draft, number: i32) {
    draft.corridor(format!("M{number}"), Rectangle::new([WING[1], ACROSS[0]], [SIZE[0] - WING[1], ACROSS[1]]));
    let (left, right) = (MIDDLE[0], MIDDLE[1]);
    if number == 0 {
        draft.room("Hall", "hall", Rectangle::new([left, 0], [right, ACROSS[0]]));
        draft.door([16_550, 0], [18_450, 0]);
    } else {
        draft.room("Library", "library", Rectangle::new([left, 0], [right, ACROSS[0]]));
    }
    for door in [13_500, 20_500] {
        draft.door([door, ACROSS[0]], [door + 1_000, ACROSS[0]]);
    }
    let Rectangle { low, high } = ELEVATOR;
    draft.room(format!("Elevator {number}"), "elevator", ELEVATOR);
    draft.door([17_000, low[1]], [18_000, low[1]]);
    draft.room(format!("Seminar {number}a"), "seminar", Rectangle::new([left, ACROSS[1]], [low[0], SIZE[1]]));
    draft.room(format!("Seminar {number}b"), "seminar", Rectangle::new([high[0], ACROSS[1]], [right, SIZE[1]]));
    draft.door([15_000, ACROSS[1]], [15_000 + DOOR, ACROSS[1]]);
    draft.door([20_000, ACROSS[1]], [20_000 + DOOR, ACROSS[1]]);
    draft.room(format!("Store {number}"), "store", Rectangle::new([low[0], high[1]], [high[0], SIZE[1]]));
    for side in [low[0], high[0]] {
        draft.door([side, 18_000], [side, 18_000 + 900]);
    }
}
