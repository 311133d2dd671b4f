//! Fuzzes [`sohle_fuzz::inbox`].
#![no_main]

use sohle_fuzz::{inbox, seeds};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(inbox::seeds), |data: &[u8]| inbox::run(data));
