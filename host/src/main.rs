//! The program `sohle`.

fn main() {}
