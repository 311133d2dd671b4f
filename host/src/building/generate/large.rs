//! A large building for scale: six floors of 100 m by 100 m, several hundred rooms, from a seed.
//!
//! Five corridors lead from west to east with a row of rooms on either side, two from north to south; in the corners where
//! they cross lie four staircases and two elevators. The rooms of a row are of random width, another on each floor.

use super::draft::{Draft, Rectangle};
use super::stairwell::{self, LENGTH, Stairwell, WIDTH};
use crate::building::{Building, Entrance, Error, Georeference, WalkGraph};
use crate::simulation::random::{Purpose, Random};

/// **Units:** mm.
const SIZE: i64 = 100_000;
/// From corridor to corridor, and where the corridor lies in it. **Units:** mm.
const STRIP: i64 = 20_000;
const CORRIDOR: [i64; 2] = [8_800, 11_200];
/// The corridors from north to south. **Units:** mm.
const ACROSS: [[i64; 2]; 2] = [[24_000, 26_400], [73_600, 76_000]];
/// The door of a room, and from the corner to it. **Units:** mm.
const DOOR: i64 = 950;
const CORNER: i64 = 600;
/// The narrowest and the widest room. **Units:** mm.
const ROOM: [i64; 2] = [3_200, 12_000];
/// The side of an elevator. **Units:** mm.
const ELEVATOR: i64 = 2_400;
/// The highest floor, and from one to the next.
const TOP: i32 = 5;
const STOREY_M: f64 = 3.6;
/// Strips that have staircases and those that have elevators.
const STAIRS: [i64; 2] = [0, 4];
const LIFTS: [i64; 1] = [2];

/// The building of a seed.
///
/// # Errors
/// Never for what is made here: only if the parts did not fit together.
pub fn large(seed: u64) -> Result<Building, Error> {
    let mut random = Random::new(seed, Purpose::Rooms);
    let mut graph = WalkGraph::default();
    let mut floors = Vec::new();
    for number in 0..=TOP {
        let draft = draft(number, &mut random);
        let height_m = f64::from(number) * STOREY_M;
        draft.add_ways(&mut graph, number, height_m);
        floors.push(draft.floor(number, format!("L{number}"), height_m));
    }
    let mut connectors = Vec::new();
    for (name, well) in wells() {
        well.add_ways(&mut graph, TOP, STOREY_M);
        connectors.push(well.connector(&name, TOP, STOREY_M));
    }
    for (name, area) in elevators() {
        stairwell::ride(&mut graph, area, TOP);
        connectors.push(stairwell::elevator(&name, area, TOP));
    }
    let middle = |across: [i64; 2]| (across[0] + across[1]) as f64 / 2e3;
    let entrance =
        |(name, across): (&str, [i64; 2])| Entrance { name: name.to_owned(), floor: 0, place: [middle(across), 0.5] };
    Building {
        name: "Large".to_owned(),
        // In the North Sea: nobody's house.
        georeference: Georeference::Geographic { origin: [7.6, 54.5], rotation_deg: 0.0 },
        floors,
        connectors,
        entrances: [("south-west", ACROSS[0]), ("south-east", ACROSS[1])].map(entrance).to_vec(),
        graph: Some(graph),
    }
    .assembled()
}

/// East of each corridor that leads north, in the row north of the corridor of a strip.
fn corners(strips: &[i64]) -> impl Iterator<Item = (String, [i64; 2])> {
    let names = ["west", "east"];
    strips.iter().flat_map(move |strip| {
        ACROSS
            .iter()
            .zip(names)
            .map(move |(across, name)| (format!("{name} {}", strip + 1), [across[1], strip * STRIP + CORRIDOR[1]]))
    })
}

fn wells() -> impl Iterator<Item = (String, Stairwell)> {
    corners(&STAIRS).map(|(name, corner)| (format!("stairs {name}"), Stairwell { corner, turned: false }))
}

fn elevators() -> impl Iterator<Item = (String, Rectangle)> {
    corners(&LIFTS).map(|(name, corner)| {
        (format!("elevator {name}"), Rectangle::new(corner, [corner[0] + ELEVATOR, corner[1] + ELEVATOR]))
    })
}

fn draft(number: i32, random: &mut Random) -> Draft {
    let mut draft = Draft::default();
    draft.walled(Rectangle::new([0, 0], [SIZE, SIZE]));
    let mut count = 0;
    for strip in 0..SIZE / STRIP {
        let y = CORRIDOR.map(|edge| strip * STRIP + edge);
        draft.corridor(format!("C{number}{strip}"), Rectangle::new([0, y[0]], [SIZE, y[1]]));
        across(&mut draft, number, strip, y);
        for north in [false, true] {
            let rows = if north { [y[1], (strip + 1) * STRIP] } else { [strip * STRIP, y[0]] };
            let mut from = 0;
            for (part, to) in [ACROSS[0][0], ACROSS[1][0], SIZE].into_iter().enumerate() {
                let start = if north && part > 0 { fixed(&mut draft, number, strip, part - 1, rows) } else { from };
                row(&mut draft, number, &mut count, [start, to], rows, if north { y[1] } else { y[0] }, random);
                from = ACROSS.get(part).map_or(SIZE, |across| across[1]);
            }
        }
    }
    draft
}

/// The pieces of the corridors from north to south on both sides of a strip's corridor.
fn across(draft: &mut Draft, number: i32, strip: i64, y: [i64; 2]) {
    for (index, across) in ACROSS.iter().enumerate() {
        let name = |end: &str| format!("A{number}{index}{strip}{end}");
        let (south, north) = (strip * STRIP, (strip + 1) * STRIP);
        draft.corridor(name("s"), Rectangle::new([across[0], south], [across[1], y[0]]));
        draft.corridor(name("n"), Rectangle::new([across[0], y[1]], [across[1], north]));
        for level in y {
            draft.opening([across[0], level], [across[1], level]);
        }
        if north < SIZE {
            draft.opening([across[0], north], [across[1], north]);
        }
        if strip == 0 && number == 0 {
            let middle = (across[0] + across[1]) / 2;
            draft.door([middle - 900, 0], [middle + 900, 0]);
        }
    }
}

/// A staircase or an elevator at the beginning of a row; returns where the rooms begin.
fn fixed(draft: &mut Draft, number: i32, strip: i64, index: usize, rows: [i64; 2]) -> i64 {
    let x = ACROSS[index][1];
    let door = |draft: &mut Draft, from: i64| draft.door([from, rows[0]], [from + 1_000, rows[0]]);
    if STAIRS.contains(&strip) {
        let well = Stairwell { corner: [x, rows[0]], turned: false };
        well.draw(draft, &format!("{number}{strip}{index}"));
        door(draft, x + WIDTH - 1_700);
        // The rest of the depth is a shaft without a door.
        draft.walled(Rectangle::new([x, rows[0] + LENGTH], [x + WIDTH, rows[1]]));
        x + WIDTH
    } else if LIFTS.contains(&strip) {
        let area = Rectangle::new([x, rows[0]], [x + ELEVATOR, rows[0] + ELEVATOR]);
        draft.room(format!("Elevator {number}{index}"), "elevator", area);
        door(draft, x + 700);
        draft.walled(Rectangle::new([x, area.high[1]], [x + ELEVATOR, rows[1]]));
        x + ELEVATOR
    } else {
        x
    }
}

/// Rooms of random width from one place to another, with a door to the corridor at `corridor`.
fn row(
    draft: &mut Draft,
    number: i32,
    count: &mut u32,
    [from, to]: [i64; 2],
    rows: [i64; 2],
    corridor: i64,
    random: &mut Random,
) {
    let mut x = from;
    while x < to {
        // Decimetres, as walls are built; what is left is never narrower than a room.
        let width = ROOM[0] + (random.unit() * ((ROOM[1] - ROOM[0]) / 100) as f64) as i64 * 100;
        let end = if to - x - width < ROOM[0] { to } else { x + width };
        *count += 1;
        let usage = if end - x > 10_000 { "open office" } else { "office" };
        draft.room(format!("{number}.{count:03}"), usage, Rectangle::new([x, rows[0]], [end, rows[1]]));
        // A door at one side or the other.
        let door = if random.unit() < 0.5 { x + CORNER } else { end - CORNER - DOOR };
        draft.door([door, corridor], [door + DOOR, corridor]);
        x = end;
    }
}
