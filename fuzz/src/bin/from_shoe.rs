//! Fuzzes [`sohle_fuzz::from_shoe`].
#![no_main]

use sohle_fuzz::{from_shoe, seeds};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(from_shoe::seeds), |data: &[u8]| from_shoe::run(data));
