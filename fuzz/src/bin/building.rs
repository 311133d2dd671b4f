//! Fuzzes [`sohle_fuzz::building`].
#![no_main]

use sohle_fuzz::{building, seeds};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(building::seeds), |data: &[u8]| building::run(data));
