//! Prints the fingerprints that this processor computes; they must be those of every other.
//!
//! `cargo run --release -p sohle-shared --example selftest`

use sohle_shared::selftest;
use sohle_shared::tracker::{Parameters, Tracker};

fn main() {
    println!("rotations {:016x}", selftest::rotations().0);
    for (name, parameters) in [("default", Parameters::default()), ("documented", Parameters::documented())] {
        println!("{name} {}", selftest::track(selftest::PERIOD_US, &parameters, Tracker::push));
    }
}
