//! Fuzzes [`sohle_fuzz::importers`].
#![no_main]

use sohle_fuzz::{importers, seeds};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(importers::seeds), |data: &[u8]| importers::run(data));
