//! The program as somebody runs it in a folder, and steps to give it.

use nalgebra::{Matrix4, Vector3};
use sohle_shared::sample::ClippedSamples;
use sohle_shared::step::{FloorMode, Step, StepQuality};
use sohle_shared::time::Micros;
use std::path::Path;
use std::process::{Command, Output};

/// The program, without a display to open windows on.
pub fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sohle"));
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command
}

/// Runs it in `folder`.
pub fn sohle(folder: &Path, arguments: &[&str]) -> Output {
    program().args(arguments).current_dir(folder).output().expect("it starts")
}

/// Runs a command that must succeed; what it says on both outputs.
#[track_caller]
pub fn said_and_warned(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = sohle(folder, arguments);
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("it is text"));
    assert!(output.status.success(), "{out}{err}");
    (out, err)
}

/// Runs a command that must succeed; what it says.
#[track_caller]
pub fn said(folder: &Path, arguments: &[&str]) -> String {
    said_and_warned(folder, arguments).0
}

/// Runs a command that must fail with this code, and say nothing but one line; the line.
#[track_caller]
pub fn refused_with(code: i32, folder: &Path, arguments: &[&str]) -> String {
    let output = sohle(folder, arguments);
    let told = String::from_utf8(output.stderr).expect("it is text");
    assert_eq!((output.status.code(), told.lines().count()), (Some(code), 1), "{told}");
    told
}

/// Runs a command that must fail on what it was given, with one line; the line.
#[track_caller]
pub fn refused(folder: &Path, arguments: &[&str]) -> String {
    refused_with(1, folder, arguments)
}

/// So many strides of 1.2 m straight ahead, as a shoe tells them, without the samples.
pub fn steps(strides: u32) -> Vec<Step> {
    let step = |index: u32| Step {
        index,
        stance_start: Micros(i64::from(index) * 1_100_000),
        stance_end: Micros(i64::from(index) * 1_100_000 + 400_000),
        displacement: Vector3::new(if index == 0 { 0.0 } else { 1.2 }, 0.0, 0.0),
        turn: 0.0,
        covariance: Matrix4::identity() * 1e-4,
        mode: FloorMode::Level,
        quality: StepQuality::default(),
        clipped: ClippedSamples::default(),
    };
    (0..=strides).map(step).collect()
}
