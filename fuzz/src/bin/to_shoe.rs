//! Fuzzes [`sohle_fuzz::to_shoe`].
#![no_main]

use sohle_fuzz::{seeds, to_shoe};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(to_shoe::seeds), |data: &[u8]| to_shoe::run(data));
