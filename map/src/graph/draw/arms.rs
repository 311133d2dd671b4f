//! Ways from the middle of a corridor through a door into the middle of a room, as people go them: straight.

use super::free::Free;
use super::sketch::{Hold, Sketch, angle_between};
use crate::building::geometry::Point;
use std::f64::consts::PI;

/// Where the line from a room through its door meets the middle of the corridor may be so far from where the middle line of
/// the door does. **Units:** m.
const ASIDE_M: f64 = 1.5;
/// And nearer than this it is the same place. **Units:** m.
const SAME_M: f64 = 0.25;
/// A corridor is straight where a way leaves it if it bends less. **Units:** rad.
const STRAIGHT: f64 = PI / 9.0;

/// Lays the way through each door on the straight line from the place in the room to the middle of the corridor.
pub fn straight_through_doors(free: &Free, sketch: &mut Sketch) {
    for gate in 0..sketch.dots.len() {
        let [a, b] = sketch.dots[gate].beside[..] else { continue };
        if sketch.dots[gate].hold != Hold::Place {
            continue;
        }
        let _ = straight_through(free, sketch, gate, [a, b]) || straight_through(free, sketch, gate, [b, a]);
    }
}

/// The way from a node by the next on to where ways meet, end, or are held.
fn follow(sketch: &Sketch, from: usize, next: usize) -> Vec<usize> {
    let (mut before, mut here, mut way) = (from, next, vec![next]);
    while sketch.dots[here].hold == Hold::Loose && !sketch.dots[here].port && way.len() < 50 {
        let [a, b] = sketch.dots[here].beside[..] else { break };
        (before, here) = (here, if a == before { b } else { a });
        way.push(here);
    }
    way
}

fn straight_through(free: &Free, sketch: &mut Sketch, gate: usize, [inwards, outwards]: [usize; 2]) -> bool {
    let (inside, outside) = (follow(sketch, gate, inwards), follow(sketch, gate, outwards));
    let (Some(&room), Some(&spine)) = (inside.last(), outside.last()) else { return false };
    let (stand, meets) = (&sketch.dots[room], &sketch.dots[spine]);
    if stand.hold != Hold::Fixed || meets.hold != Hold::Loose || meets.beside.len() < 2 || room == spine {
        return false;
    }
    let last = outside.len().checked_sub(2).map_or(gate, |before| outside[before]);
    let others: Vec<usize> = meets.beside.iter().copied().filter(|&other| other != last).collect();
    // The corridor: the way on that runs most across the one through the door, and the one opposite, if there is one.
    let through = [meets.place, stand.place];
    let across = |other: &usize| {
        let [way, on] = [[through[1][0] - through[0][0], through[1][1] - through[0][1]], sketch.along(spine, *other)];
        (angle_between(way, on) - 0.5 * PI).abs()
    };
    let Some(ahead) = others.iter().copied().min_by(|a, b| across(a).total_cmp(&across(b)).then(a.cmp(b))) else {
        return false;
    };
    let on = sketch.along(spine, ahead);
    let back = others.iter().copied().find(|&other| angle_between(on, sketch.along(spine, other)) > PI - STRAIGHT);
    let Some(off) = meeting(stand.place, sketch.dots[gate].place, meets.place, on) else { return false };
    let towards = if off > 0.0 { Some(ahead) } else { back };
    let long = on[0].hypot(on[1]);
    let place =
        if off.abs() < SAME_M { meets.place } else { [0, 1].map(|axis| meets.place[axis] + off / long * on[axis]) };
    let room_for = towards.map_or(ASIDE_M, |towards| ASIDE_M.min(sketch.length(spine, towards) - SAME_M));
    if off.abs() >= room_for || !free.sees(stand.place, place) || !free.sees(meets.place, place) {
        return false;
    }
    for &dot in inside[..inside.len() - 1].iter().chain(&outside[..outside.len() - 1]) {
        sketch.remove(dot);
    }
    sketch.remove(gate);
    let node = if off.abs() < SAME_M {
        spine
    } else if let Some(towards) = towards {
        sketch.cut(spine, towards, off.abs() / sketch.length(spine, towards))
    } else {
        let node = sketch.add(place, Hold::Loose);
        sketch.join(spine, node);
        node
    };
    sketch.join(room, node);
    true
}

/// How far from `on` along a direction the line from one place through another meets the line through `on`. **Units:** m.
fn meeting(from: Point, through: Point, on: Point, along: [f64; 2]) -> Option<f64> {
    let long = along[0].hypot(along[1]);
    let along = along.map(|value| value / long);
    let way = [through[0] - from[0], through[1] - from[1]];
    let across = along[0] * way[1] - along[1] * way[0];
    // Not nearly along the corridor.
    if across.abs() < 0.5 * way[0].hypot(way[1]) {
        return None;
    }
    let offset = [from[0] - on[0], from[1] - on[1]];
    Some((offset[0] * way[1] - offset[1] * way[0]) / across)
}
