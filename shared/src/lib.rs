//! What the shoe and the laptop share: from an inertial sample to a [`Step`](step::Step).
//!
//! A sensor on the shoe is at rest for a moment in every stride. The [`Tracker`](tracker::Tracker) finds these stances,
//! integrates the strides between them, corrects the integration with what is known of a standing foot, and hands out
//! one [`Step`](step::Step) at the end of each stance. The same code runs on the microcontroller and, against recorded
//! walks, on a PC; it gives the same bits on both.
//!
//! [`bmx055`] reads the sensor and brings its clocks together. The data are types with units: [`time`], [`sample`] and
//! [`step`]. Rotations are in [`so3`], the detectors that tell when the foot stands in [`stance`], the filters that follow
//! it in [`filter`]. [`calibration`] takes out of the samples what is known of the unit. Everything comes together in
//! [`tracker`] and, from the registers of the sensor on, in [`shoe`]; `wire` (a feature) carries what it finds to the
//! laptop; `bonds` (feature `store`) are the laptops that have paired with it; [`selftest`] proves that a processor computes
//! it as every other does.
//!
//! No heap, no clock, no panic on any input, `f32` only, every transcendental function from `libm`.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod bmx055;
#[cfg(feature = "store")]
pub mod bonds;
pub mod calibration;
#[cfg(any(feature = "wire", feature = "store"))]
pub mod checksum;
pub mod filter;
pub mod preintegration;
pub mod rest;
pub mod sample;
pub mod selftest;
pub mod shoe;
pub mod so3;
pub mod stance;
pub mod step;
pub mod time;
pub mod tracker;
#[cfg(feature = "wire")]
pub mod wire;
