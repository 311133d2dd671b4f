//! Tells the linker where the memory of the chosen board is.

use std::{env, fs, path::PathBuf};

fn main() {
    let board = match (env::var_os("CARGO_FEATURE_BOARD_WB55"), env::var_os("CARGO_FEATURE_BOARD_F405")) {
        (Some(_), None) => "wb55",
        (None, Some(_)) => "f405",
        // The library says what is wrong, in the compiler's own words.
        _ => return,
    };
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let map = root.join("memory").join(board).with_extension("x");
    // By what the emulated shoe takes of it (`cargo xtask emulate --check`), with room for a calibration that comes.
    let stack = if env::var_os("CARGO_FEATURE_BLE").is_some() { "40K" } else { "28K" };
    let text = fs::read_to_string(&map).expect("every board has its memory map");
    fs::write(out.join("memory.x"), text.replace("@STACK@", stack)).expect("cargo has made the folder");
    println!("cargo:rerun-if-changed={}", map.display());
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
}
