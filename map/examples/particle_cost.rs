//! Runs parts of the particle filter's step so that callgrind can count what they cost; `cargo xtask bench` calls it.
//!
//! `particle_cost PART PARTICLES FLOORS ROOMS`: the parts are those of [`Work`], in a building of so many floors with so many
//! rooms along each side. The part runs within [`counted`], on one thread. Prints over how many particles it ran.

use sohle_map::particle::speed::{Work, building};
use sohle_shared::selftest::counted;
use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [part, numbers @ ..] = words.as_slice() else { return usage() };
    let [Ok(particles), Ok(floors), Ok(rooms)] = numbers.iter().map(|word| word.parse()).collect::<Vec<_>>()[..] else {
        return usage();
    };
    let Some(mut work) = building(floors, rooms).and_then(|map| Work::new(map, usize::from(particles))).ok() else {
        return usage();
    };
    // What runs on the threads of a pool would run outside of the function that is counted.
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() else { return usage() };
    let known = pool.install(|| match part.as_str() {
        "moves" => counted(|| work.moves()) > 0,
        "reference" => counted(|| work.reference()).is_finite(),
        "draw" => counted(|| work.draw(usize::from(particles))) > 0,
        "clusters" => !counted(|| work.clusters()).is_empty(),
        _ => false,
    });
    if !known {
        return usage();
    }
    println!("{particles}");
    ExitCode::SUCCESS
}

fn usage() -> ExitCode {
    eprintln!("error: usage: particle_cost moves|reference|draw|clusters PARTICLES FLOORS ROOMS");
    ExitCode::from(2)
}
