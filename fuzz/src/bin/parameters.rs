//! Fuzzes [`sohle_fuzz::parameters`].
#![no_main]

use sohle_fuzz::{parameters, seeds};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(parameters::seeds), |data: &[u8]| parameters::run(data));
