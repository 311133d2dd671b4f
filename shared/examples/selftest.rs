//! Prints the fingerprints that this processor computes; they must be those of every other.
//!
//! `cargo run --release -p sohle-shared --example selftest`

use sohle_shared::selftest;
use sohle_shared::tracker::{Parameters, Tracker};

fn main() {
    println!("rotations {:016x}", selftest::rotations().0);
    for period_us in selftest::PERIODS_US {
        for (name, parameters) in [("default", Parameters::default()), ("documented", Parameters::documented())] {
            let report = selftest::track(period_us, &parameters, Tracker::push);
            println!("{name} {} Hz {report}", 1_000_000 / period_us);
        }
    }
}
