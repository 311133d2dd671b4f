//! Fuzzes [`sohle_fuzz::fifo`].
#![no_main]

use sohle_fuzz::{fifo, seeds};

libfuzzer_sys::fuzz_target!(init: seeds::write_if_asked(fifo::seeds), |data: &[u8]| fifo::run(data));
